"""One call of a chain's dynamics beside raw Pinocchio and MuJoCo, measured in one run.

::

    python benchmarks/chain_speed.py

Forward dynamics: Pinocchio's ``constraintDynamics`` alone, with its memory made beforehand and nothing checked;
MuJoCo's ``mj_forward`` of the same chain, which solves soft constraints; and ``ClosedChain.forward_dynamics``, which
checks the input, the loops, the velocity, singular configurations, inertia and the answer. The last column is the
largest difference of the accelerations, as a share of the largest. Cassie is cassie_v2.sdf of example-robot-data, whose
hinges that close loops Pinocchio gets as two points each. toolbox-parallel-robots has no forward dynamics;
benchmarks/dynamics.py and closing.py measure what it has.

Reactions: ``inverse_dynamics`` alone, and with the reaction and certificate of every joint and closure.

The solvers take turns, and a number is the median of 7 turns of many calls each, in CPU time of the calling thread, so
that other programs on the machine count as little as they can. Compiled functions are compiled before.
"""

import os
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault("EXO_PIN_COMPILE", "compiled")
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "oracles"))

import mujoco
import numpy as np
import pinocchio as pin
from large_chains import cassie, cassies, state_of
from mechanisms import five_bar, four_bar
from spatial_mechanisms import delta

from exo_pin.chain.structure.memory.chain_buffers import proximal_constraints

TURNS, SECONDS = 41, 0.001


def medians(solvers):
    """Median time of a call, s, of functions by name, which take turns."""
    calls = {}
    for name, solve in solvers.items():
        solve()
        begun = time.thread_time()
        solve()
        calls[name] = max(1, int(SECONDS / (time.thread_time() - begun)))
    times = {name: [] for name in solvers}
    for _ in range(TURNS):
        for name, solve in solvers.items():
            begun = time.thread_time()
            for _ in range(calls[name]):
                solve()
            times[name].append((time.thread_time() - begun) / calls[name])
    return {name: float(np.median(values)) for name, values in times.items()}


def raw(chain, q, v, tau):
    """Pinocchio's constrained dynamics with nothing around it; springs and dampers are among the efforts."""
    tau = tau + chain._state.passive.force(q, v)
    models, datas = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
    for constraint in proximal_constraints(chain.model, chain.closures, chain._state.topology):
        models.append(constraint)
        datas.append(constraint.createData())
    model, data = chain.model, pin.Data(chain.model)
    pin.initConstraintDynamics(model, data, models, datas)
    settings = pin.ProximalSettings(1e-14, 1e-10, 40)
    return lambda: pin.constraintDynamics(model, data, q, v, tau, models, datas, settings)


def simulated(chain, q):
    """MuJoCo's forward dynamics of the same chain at rest."""
    with tempfile.TemporaryDirectory() as folder:
        model = mujoco.MjModel.from_xml_path(str(chain.to_mjcf(folder, q)))
    data = mujoco.MjData(model)
    return lambda: mujoco.mj_forward(model, data)


def all_reactions(chain, q, v, a):
    """Inverse dynamics with the reactions of all joints and closures."""
    forces = chain.inverse_dynamics(q, v, a)
    for name in chain.parts:
        forces.joint_reaction(name)


def named(mechanism, seed=0):
    """A named mechanism in motion."""
    chain, rng = mechanism.chain(), np.random.default_rng(seed)
    q = chain.close(pin.integrate(chain.model, mechanism.q, rng.uniform(-0.1, 0.1, chain.model.nv)))
    v = chain.project_velocity(q, rng.normal(size=chain.model.nv))
    return chain, q, v, rng.normal(size=chain.model.nv)


def main():
    """Measure and print both tables."""
    heads = f"{'forward dynamics':22}{'nv':>4}{'rows':>5}{'Pinocchio':>12}{'MuJoCo':>10}{'exo_pin':>10}"
    print(f"{heads}{'ratio':>8}  differ by")
    robots = {
        "four-bar": named(four_bar()),
        "five-bar": named(five_bar()),
        "delta, rigid closures": named(delta("rigid")),
        "legs of Cassie": (robot := cassies(1), *state_of(robot)),
    }
    if (real := cassie()) is not None:
        robots["Cassie (SDF)"] = (real, *state_of(real))
    for name, (chain, q, v, tau) in robots.items():
        solve = raw(chain, q, v, tau)
        own = chain.forward_dynamics(q, v, tau).a
        wrong = np.abs(solve() - own).max() / np.abs(own).max()
        found = medians(
            {
                "raw": solve,
                "mujoco": simulated(chain, q),
                "own": lambda chain=chain, q=q, v=v, tau=tau: chain.forward_dynamics(q, v, tau),
            }
        )
        cells = "".join(f"{found[key] * 1e6:>{width}.1f}" for key, width in (("raw", 12), ("mujoco", 10), ("own", 10)))
        ratio = found["own"] / found["raw"]
        print(f"{name:22}{chain.model.nv:>4}{chain.row_count:>5}{cells}{ratio:>7.1f}x{wrong:>12.1e}")
    print(f"\n{'reactions':22}{'joints':>9}{'inverse dynamics':>18}{'and reactions':>16}{'ratio':>8}")
    for name, mechanism in (("five-bar", five_bar()), ("delta", delta()), ("delta, rigid closures", delta("rigid"))):
        chain, q, v, _ = named(mechanism)
        a = chain.project_acceleration(q, v, np.random.default_rng(1).normal(size=chain.model.nv))
        found = medians(
            {
                "forces": lambda chain=chain, q=q, v=v, a=a: chain.inverse_dynamics(q, v, a),
                "reactions": lambda chain=chain, q=q, v=v, a=a: all_reactions(chain, q, v, a),
            }
        )
        cells = f"{len(chain.parts):>9}{found['forces'] * 1e6:>18.1f}{found['reactions'] * 1e6:>16.1f}"
        print(f"{name:22}{cells}{found['reactions'] / found['forces']:>7.1f}x")
    print("\nmicroseconds a call")


if __name__ == "__main__":
    main()
