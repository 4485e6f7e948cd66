"""One call of a chain's dynamics beside raw Pinocchio and MuJoCo, measured in one run.

::

    python benchmarks/chain_speed.py

Forward dynamics: Pinocchio's ``constraintDynamics`` alone, with its memory made beforehand and nothing checked;
MuJoCo's ``mj_forward`` of the same chain, which solves soft constraints; and ``ClosedChain.forward_dynamics``, which
checks the input, the loops, the velocity, singular configurations, inertia and the answer. The last column is the
largest difference of the accelerations, as a share of the largest. Cassie is cassie_v2.sdf of example-robot-data, whose
hinges that close loops Pinocchio gets as two points each. toolbox-parallel-robots has no forward dynamics;
benchmarks/dynamics.py and closing.py measure what it has.

Massless links: the same forward dynamics with one link of the chain without mass.

Derivatives: Pinocchio's ``constraintDynamics`` and ``computeConstraintDynamicsDerivatives``, with nothing checked, in
all coordinates as if the loops were open; and ``inverse_dynamics_derivatives``, which checks, solves the inverse
dynamics and gives total derivatives along the loops. Of each the six derivatives are read, of accelerations or efforts
and of multipliers. Pinocchio's are wrong for closures of points between two moving bodies; here only the times count.
The same of ``forward_dynamics_derivatives``, which solves and checks the forward dynamics and differentiates the
acceleration in all coordinates; and with what it reads in independent coordinates, by q, v and efforts ("reduced").
The reduced Jacobian: four lines of NumPy with ``lstsq`` on a Jacobian that is there already, and ``reduced_jacobian``,
which computes it.

Reactions: ``inverse_dynamics`` alone, and with the reaction and certificate of every joint and closure.

Trajectories: closing, projections of the motion, inverse dynamics and the reactions of all joints and closures, sample
by sample and as one stack, in microseconds a sample, with the largest difference of efforts and wrenches as a share of
the largest.

The solvers take turns, and a number is the median of 101 short turns, in CPU time of the calling thread, so
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
from pinocchio_constraints import constrained_dynamics
from spatial_mechanisms import delta

from exo_pin.chain import ClosedChain

#: Turns of each solver, and how long one takes, s.
TURNS, SECONDS = 101, 0.002
#: Samples of a trajectory, and those that a loop computes, too.
SAMPLES, LOOPED = 10_000, 2_000


def spent(solve, calls):
    """CPU time of a call, s."""
    begun = time.thread_time()
    for _ in range(calls):
        solve()
    return (time.thread_time() - begun) / calls


def medians(solvers):
    """Median time of a call, s, of functions by name, which take turns."""
    calls = {name: max(1, int(SECONDS / min(spent(solve, 1) for _ in range(20)))) for name, solve in solvers.items()}
    times = {name: [] for name in solvers}
    for _ in range(TURNS):
        for name, solve in solvers.items():
            times[name].append(spent(solve, calls[name]))
    return {name: float(np.median(values)) for name, values in times.items()}


def raw(chain, q, v, tau):
    """Pinocchio's constrained dynamics with nothing around it; springs and dampers are among the efforts."""
    tau = tau + chain._state.passive.force(q, v)
    solve, _ = constrained_dynamics(chain)
    return lambda: solve(q, v, tau)


def simulated(chain, q):
    """MuJoCo's forward dynamics of the same chain at rest."""
    with tempfile.TemporaryDirectory() as folder:
        model = mujoco.MjModel.from_xml_path(str(chain.to_mjcf(folder, q)))
    data = mujoco.MjData(model)
    return lambda: mujoco.mj_forward(model, data)


def parts_of(chain):
    """Names of all joints and closures."""
    return [*list(chain.model.names)[1:], *(closure.name for closure in chain.closures)]


def all_reactions(chain, q, v, a):
    """Inverse dynamics with the reactions of all joints and closures."""
    forces = chain.inverse_dynamics(q, v, a)
    return forces, [forces.joint_reaction(name) for name in parts_of(chain)]


def without_mass(chain, joint):
    """The chain with one link that weighs nothing."""
    model = chain.model.copy()
    model.inertias[joint] = pin.Inertia.Zero()
    return ClosedChain(model, chain.description)


def pinocchio_derivatives(chain, q, v, tau):
    """Pinocchio's constrained dynamics and its derivatives, which are read, with nothing around them."""
    _, (data, models, datas, settings) = constrained_dynamics(chain)
    model = chain.model

    def solve():
        pin.constraintDynamics(model, data, q, v, tau, models, datas, settings)
        pin.computeConstraintDynamicsDerivatives(model, data, models, datas, settings)
        by_q, by_v, by_tau = data.ddq_dq, data.ddq_dv, data.ddq_dtau
        return by_q, by_v, by_tau, data.dlambda_dq, data.dlambda_dv, data.dlambda_dtau

    return solve


def all_derivatives(found):
    """Read what the answer holds, because its arrays are made when they are read."""
    efforts = found.tau_q, found.tau_v, found.tau_a
    return *efforts, found.multipliers_q, found.multipliers_v, found.multipliers_a


def in_independent(found):
    """Read the derivatives in independent coordinates, which are made when they are read."""
    return found.independent_q, found.independent_v, found.independent_tau


def reduced_by_numpy(chain, q):
    """The reduced Jacobian of a Jacobian that is known."""
    J, parts = chain.constraint_jacobian(q), chain.split(q)
    free, led = parts.independent, parts.dependent

    def solve():
        G = np.zeros((J.shape[1], len(free)))
        G[free, np.arange(len(free))] = 1.0
        G[led] = -np.linalg.lstsq(J[:, led], J[:, free])[0]
        return G

    return solve


def one_by_one(chain, q, v, a):
    """Closing, projections, inverse dynamics and reactions of samples in a loop: efforts and wrenches."""
    efforts, wrenches = [], []
    for here, speed, rate in zip(q, v, a, strict=True):
        at = chain.close(here)
        moved = chain.project_velocity(at, speed)
        forces, reactions = all_reactions(chain, at, moved, chain.project_acceleration(at, moved, rate))
        efforts.append(forces.tau)
        wrenches.append([reaction.wrench for reaction in reactions])
    return np.array(efforts), np.swapaxes(wrenches, 0, 1)


def in_a_stack(chain, q, v, a):
    """The same in one call."""
    forces = chain.inverse_dynamics(q, v, a, close=True)
    return forces.tau, np.array([forces.joint_reaction(name).wrench for name in parts_of(chain)])


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
        cells = f"{len(parts_of(chain)):>9}{found['forces'] * 1e6:>18.1f}{found['reactions'] * 1e6:>16.1f}"
        print(f"{name:22}{cells}{found['reactions'] / found['forces']:>7.1f}x")
    massless(robots)
    derivatives(robots)
    trajectories()
    print("\nmicroseconds a call")


def massless(robots):
    """Print forward dynamics with a link without mass."""
    print(f"\n{'one link without mass':22}{'with mass':>10}{'without':>10}{'ratio':>8}")
    for name, joint in (("four-bar", 3), ("five-bar", 4), ("delta, rigid closures", 3)):
        chain, q, v, tau = robots[name]
        light = without_mass(chain, joint)
        found = medians(
            {
                "heavy": lambda chain=chain, q=q, v=v, tau=tau: chain.forward_dynamics(q, v, tau),
                "light": lambda chain=light, q=q, v=v, tau=tau: chain.forward_dynamics(q, v, tau),
            }
        )
        ratio = found["light"] / found["heavy"]
        print(f"{name:22}{found['heavy'] * 1e6:>10.1f}{found['light'] * 1e6:>10.1f}{ratio:>7.1f}x")


def derivatives(robots):
    """Print derivatives and reduced Jacobians."""
    heads = f"{'Pinocchio':>10}{'inverse':>10}{'ratio':>8}{'forward':>10}{'ratio':>8}{'reduced':>10}{'ratio':>8}"
    print(f"\n{'derivatives':22}{heads}{'lstsq':>10}{'reduced':>10}{'ratio':>8}")
    for name, (chain, q, v, tau) in robots.items():
        a = chain.project_acceleration(q, v, tau)
        joints = list(chain.model.names)[1:]
        found = medians(
            {
                "pinocchio": pinocchio_derivatives(chain, q, v, tau),
                "own": lambda chain=chain, q=q, v=v, a=a, joints=joints: all_derivatives(
                    chain.inverse_dynamics_derivatives(q, v, a, actuated=joints)
                ),
                "forward": lambda chain=chain, q=q, v=v, tau=tau: chain.forward_dynamics_derivatives(q, v, tau),
                "independent": lambda chain=chain, q=q, v=v, tau=tau: in_independent(
                    chain.forward_dynamics_derivatives(q, v, tau)
                ),
                "lstsq": reduced_by_numpy(chain, q),
                "reduced": lambda chain=chain, q=q: chain.reduced_jacobian(q),
            }
        )
        times = {key: value * 1e6 for key, value in found.items()}
        cells = f"{times['pinocchio']:>10.1f}{times['own']:>10.1f}{times['own'] / times['pinocchio']:>7.1f}x"
        for key in ("forward", "independent"):
            cells += f"{times[key]:>10.1f}{times[key] / times['pinocchio']:>7.1f}x"
        cells += f"{times['lstsq']:>10.1f}{times['reduced']:>10.1f}{times['reduced'] / times['lstsq']:>7.1f}x"
        print(f"{name:22}{cells}")


def trajectories():
    """Print times of trajectories."""
    print(f"\n{'trajectories':22}{'samples':>9}{'a loop':>10}{'a stack':>10}{'ratio':>8}  differ by")
    for name, mechanism in (("five-bar", five_bar()), ("delta", delta()), ("delta, rigid closures", delta("rigid"))):
        chain, rng = mechanism.chain(), np.random.default_rng(0)
        nv = chain.model.nv
        q = np.array([pin.integrate(chain.model, mechanism.q, rng.uniform(-0.1, 0.1, nv)) for _ in range(SAMPLES)])
        v, a = rng.normal(size=(SAMPLES, nv)), 5.0 * rng.normal(size=(SAMPLES, nv))
        some = slice(0, LOOPED)
        one_by_one(chain, q[:40], v[:40], a[:40])
        in_a_stack(chain, q[:40], v[:40], a[:40])
        begun = time.thread_time()
        looped = one_by_one(chain, q[some], v[some], a[some])
        loop = (time.thread_time() - begun) / LOOPED
        begun = time.thread_time()
        stacked = in_a_stack(chain, q, v, a)
        stack = (time.thread_time() - begun) / SAMPLES
        wrong = max(
            np.abs(one - other).max() / np.abs(one).max()
            for one, other in ((looped[0], stacked[0][some]), (looped[1], stacked[1][:, some]))
        )
        print(f"{name:22}{SAMPLES:>9}{loop * 1e6:>10.1f}{stack * 1e6:>10.1f}{loop / stack:>7.1f}x{wrong:>12.1e}")


if __name__ == "__main__":
    main()
