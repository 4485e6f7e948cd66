"""Inverse dynamics of closed chains beside toolbox-parallel-robots, plain Pinocchio and MuJoCo, in one run.

::

    python benchmarks/dynamics.py                    # builds the peer's environment in a temporary folder
    python benchmarks/dynamics.py --environment DIR  # builds it there, or uses what is there

All get the same robots, motors and states, random motions that keep the loops closed. The rows:

* toolbox: its ``closedLoopInverseDynamicsCasadi`` (see benchmarks/peer.py), a quadratic program that ProxQP solves to
  1e-6, with zero for its wanted efforts. It has its solver report and prints its residual, which goes nowhere, with its
  time in; "silent" is the same function with both switched off.
* Pinocchio: ``rnea``, ``getConstraintsJacobian`` and NumPy's ``lstsq`` for efforts and multipliers, as one would write
  it. Nothing is checked, and no reaction computed.
* MuJoCo: ``mj_inverse``, for which loops are soft and every joint is driven, so that it answers another question.
* exo_pin: the question as such, with one joint's reaction and its certificate, and with those of all joints and
  closures.

The residual is the largest generalised force by which M a + h = τ + Jᵀλ is missed, each side's by its own Pinocchio.
The programs take turns; a time is CPU time of the calling thread, the median of 7 turns of the median over the states.
"""

import tempfile
import time

import mujoco
import numpy as np
import peer
import pinocchio as pin

STATES = 40

WORKER = """
import toolbox_parallel_robots.inverse_dynamics as module
loud = module.closedLoopInverseDynamicsCasadi

def silent(*arguments):
    solve = module.solve_qp
    module.solve_qp = lambda *args, **options: solve(*args, **(options | {"verbose": False}))
    module.print = lambda *args: None
    try:
        return loud(*arguments)
    finally:
        module.solve_qp = solve
        del module.print

def turn():
    return [answered(problem, name, solve) for problem in problems for name, solve in SOLVERS]

def answered(problem, name, solve):
    model, constraints = robot(problem)
    actuation = np.zeros((model.nv, len(problem["driven"])))
    actuation[problem["driven"], range(len(problem["driven"]))] = 1.0
    data, datas = model.createData(), [c.createData() for c in constraints]
    times, residuals, efforts = [], [], []
    for q, v, a in ((np.array(part) for part in state) for state in problem["states"]):
        begun = time.thread_time()
        u, f = solve(model, constraints, q, v, a, actuation, np.zeros(actuation.shape[1]))
        times.append(time.thread_time() - begun)
        pin.computeAllTerms(model, data, q, v)
        J = pin.getConstraintsJacobian(model, data, constraints, datas)
        residuals.append(float(np.abs(actuation @ u + J.T @ f - pin.rnea(model, data, q, v, a)).max()))
        efforts.append(u.tolist())
    return {"robot": problem["name"], "solver": name, "times": times, "residuals": residuals, "efforts": efforts}

SOLVERS = [("toolbox", loud), ("toolbox, silent", silent)]
take_turns(turn)
"""


def states(chain, q):
    """Random motions near a closed configuration that keep the loops closed."""
    rng = np.random.default_rng(0)
    drawn = []
    for _ in range(STATES):
        here = chain.close(q + rng.uniform(-0.1, 0.1, len(q)))
        v = chain.project_velocity(here, rng.normal(size=chain.model.nv))
        a = chain.project_acceleration(here, v, rng.normal(size=chain.model.nv) * 5)
        drawn.append((here, v, a))
    return drawn


def one_reaction(chain, forces):
    """The first joint's reaction and its certificate."""
    forces.joint_reaction(chain.model.names[1])


def all_reactions(chain, forces):
    """Every joint's and closure's reaction and its certificate."""
    for name in [*list(chain.model.names)[1:], *(closure.name for closure in chain.closures)]:
        forces.joint_reaction(name)


def plain_pinocchio(chain):
    """Efforts, and generalised forces of the closures, by least squares."""
    model, data, constraints = chain.model, chain.model.createData(), chain.constraint_models
    datas = [constraint.createData() for constraint in constraints]
    driven = chain.velocity_indices(chain.roles.actuated)
    selected = np.eye(model.nv)[:, driven]

    def solve(q, v, a):
        tau = pin.rnea(model, data, q, v, a)
        pin.computeJointJacobians(model, data, q)
        J = pin.getConstraintsJacobian(model, data, constraints, datas)
        found = np.linalg.lstsq(np.hstack([selected, J.T]), tau)[0]
        return found[: len(driven)], J.T @ found[len(driven) :]

    return solve


def in_mujoco(chain, q):
    """mj_inverse."""
    with tempfile.TemporaryDirectory() as folder:
        model = mujoco.MjModel.from_xml_path(str(chain.to_mjcf(folder, q)))
    data = mujoco.MjData(model)

    def solve(q, v, a):
        data.qpos[:], data.qvel[:], data.qacc[:] = q, v, a
        mujoco.mj_inverse(model, data)

    return solve


def timed(name, label, solve, motions):
    """Time of every state, and the last results."""
    times, results = [], []
    for state in motions:
        begun = time.thread_time()
        results.append(solve(*state))
        times.append(time.thread_time() - begun)
    return {"robot": name, "solver": label, "times": times}, results


def own(robots, motions, extra):
    """Solve every state by all that runs here."""
    answers = []
    for name, _, chain, _ in robots:
        plain, simulator = extra[name]
        driven = chain.velocity_indices(chain.roles.actuated)
        answer, found = timed(name, "Pinocchio, lstsq", plain, motions[name])
        whole = [np.eye(chain.model.nv)[:, driven] @ tau + closing for tau, closing in found]
        answers.append(answer | checked(chain, motions[name], whole, [tau for tau, _ in found]))
        answers.append(timed(name, "MuJoCo, mj_inverse", simulator, motions[name])[0])
        for label, then in (("", None), (", one reaction", one_reaction), (", all reactions", all_reactions)):
            answer, found = timed(name, f"exo_pin{label}", solving(chain, then), motions[name])
            whole = [
                forces.tau + chain.constraint_jacobian(q).T @ forces.multipliers
                for (q, _, _), forces in zip(motions[name], found, strict=True)
            ]
            answers.append(answer | checked(chain, motions[name], whole, [forces.tau[driven] for forces in found]))
    return answers


def solving(chain, then):
    """inverse_dynamics, and what is done with its answer."""

    def solve(q, v, a):
        forces = chain.inverse_dynamics(q, v, a)
        if then is not None:
            then(chain, forces)
        return forces

    return solve


def checked(chain, motions, forces, efforts):
    """Residuals of generalised forces, and the efforts."""
    data = chain.model.createData()
    missed = [force - pin.rnea(chain.model, data, *state) for force, state in zip(forces, motions, strict=True)]
    return {"residuals": [float(np.abs(each).max()) for each in missed], "efforts": [tau.tolist() for tau in efforts]}


def run(folder):
    """Measure all and print the table."""
    robots = [peer.five_bar_with_tip(), peer.delta_of_rods()]
    motions = {name: states(chain, q) for name, _, chain, q in robots}
    problems = [
        peer.problem(
            name,
            urdf,
            chain,
            driven=chain.velocity_indices(chain.roles.actuated).tolist(),
            states=[[part.tolist() for part in state] for state in motions[name]],
        )
        for name, urdf, chain, _ in robots
    ]
    extra = {name: (plain_pinocchio(chain), in_mujoco(chain, q)) for name, _, chain, q in robots}
    answers = peer.in_turns(folder, WORKER, problems, lambda: own(robots, motions, extra))
    print(f"{'robot':10}{'solver':24}{'median':>10}{'ratio':>9}{'residual':>12}{'efforts off by':>16}")
    for name, *_ in robots:
        mine = next(answer for answer in answers if answer["robot"] == name and answer["solver"] == "exo_pin")
        for answer in (each for each in answers if each["robot"] == name):
            cells = f"{answer['time'] * 1e6:>7.1f} µs{answer['time'] / mine['time']:>8.1f}x"
            if "residuals" in answer:
                cells += f"{max(answer['residuals']):>12.1e}"
            if "efforts" in answer and not answer["solver"].startswith("exo_pin"):
                cells += f"{np.abs(np.array(answer['efforts']) - mine['efforts']).max():>12.1e} N m"
            print(f"{name:10}{answer['solver']:24}{cells}")


if __name__ == "__main__":
    peer.main(__doc__.splitlines()[0], run)
