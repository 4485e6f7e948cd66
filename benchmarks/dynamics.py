"""Inverse dynamics of closed chains, side by side with toolbox-parallel-robots in one run.

::

    python benchmarks/dynamics.py                    # builds the peer's environment in a temporary folder
    python benchmarks/dynamics.py --environment DIR  # builds it there, or uses what is there

Both sides get the same URDF, the same 6D closures, the same motors and the same states, random motions that keep the
loops closed, and tell efforts and closure forces. The peer's function (see benchmarks/peer.py) is
``closedLoopInverseDynamicsCasadi``, a quadratic program that ProxQP solves to 1e-6, with zero for its wanted efforts.
It has its solver report and prints its residual, which goes nowhere, with its time in; the row "silent" is the same
function with both switched off.

exo_pin's three rows are the question as such, with one joint's reaction and its certificate, and with those of all
joints and closures. The residual is the largest generalised force by which M a + h = τ + Jᵀλ is missed, each side's by
its own Pinocchio. Every state is solved several times and the fastest counts; the table has medians over the states.
"""

import time

import numpy as np
import peer

STATES, REPEATS = 40, 5

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

answers = []
for problem in problems:
    model, constraints = robot(problem)
    actuation = np.zeros((model.nv, len(problem["driven"])))
    actuation[problem["driven"], range(len(problem["driven"]))] = 1.0
    data, datas = model.createData(), [c.createData() for c in constraints]
    for name, solve in (("toolbox", loud), ("toolbox, silent", silent)):
        times, residuals, efforts = [], [], []
        for q, v, a in ((np.array(part) for part in state) for state in problem["states"]):
            best = np.inf
            for _ in range(problem["repeats"]):
                begun = time.perf_counter()
                u, f = solve(model, constraints, q, v, a, actuation, np.zeros(actuation.shape[1]))
                best = min(best, time.perf_counter() - begun)
            pin.computeAllTerms(model, data, q, v)
            J = pin.getConstraintsJacobian(model, data, constraints, datas)
            residuals.append(float(np.abs(actuation @ u + J.T @ f - pin.rnea(model, data, q, v, a)).max()))
            times.append(best)
            efforts.append(u.tolist())
        answers.append({"robot": problem["name"], "solver": name, "times": times, "residuals": residuals,
            "efforts": efforts})
answer(answers)
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


def ours(name, chain, motions):
    """Solve every state, alone and with reactions."""
    import pinocchio as pin

    driven, data = chain.velocity_indices(chain.roles.actuated), chain.model.createData()
    answers = []
    for label, then in (
        ("exo_pin", None),
        ("exo_pin, one reaction", one_reaction),
        ("exo_pin, all reactions", all_reactions),
    ):
        times, residuals, efforts = [], [], []
        all_reactions(chain, chain.inverse_dynamics(*motions[0]))  # compiles
        for q, v, a in motions:
            best = np.inf
            for _ in range(REPEATS):
                begun = time.perf_counter()
                forces = chain.inverse_dynamics(q, v, a)
                if then is not None:
                    then(chain, forces)
                best = min(best, time.perf_counter() - begun)
            J = chain.constraint_jacobian(q)
            left = forces.tau + J.T @ forces.multipliers - pin.rnea(chain.model, data, q, v, a)
            residuals.append(float(np.abs(left).max()))
            times.append(best)
            efforts.append(forces.tau[driven].tolist())
        answers.append({"robot": name, "solver": label, "times": times, "residuals": residuals, "efforts": efforts})
    return answers


def run(folder):
    """Measure both sides and print the table."""
    robots = [peer.five_bar_with_tip(), peer.delta_of_rods()]
    motions = {name: states(chain, q) for name, _, chain, q in robots}
    problems = [
        peer.problem(
            name,
            urdf,
            chain,
            driven=chain.velocity_indices(chain.roles.actuated).tolist(),
            states=[[part.tolist() for part in state] for state in motions[name]],
            repeats=REPEATS,
        )
        for name, urdf, chain, _ in robots
    ]
    answers = peer.asked(folder, WORKER, problems)
    print(f"{'robot':10}{'solver':24}{'median':>10}{'ratio':>9}{'residual':>12}{'efforts off by':>16}")
    for name, _, chain, _ in robots:
        own = ours(name, chain, motions[name])
        mine = own[0]
        for item in [other for other in answers if other["robot"] == name] + own:
            median = float(np.median(item["times"]))
            off = float(np.abs(np.array(item["efforts"]) - mine["efforts"]).max())
            told = "" if item in own else f"{off:.1e} N m"
            ratio = median / float(np.median(mine["times"]))
            print(
                f"{name:10}{item['solver']:24}{median * 1e3:>7.3f} ms{ratio:>8.1f}x{max(item['residuals']):>12.1e}"
                f"{told:>16}"
            )


if __name__ == "__main__":
    peer.main(__doc__.splitlines()[0], run)
