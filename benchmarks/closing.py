"""Closing loops, side by side with toolbox-parallel-robots in one run.

::

    python benchmarks/closing.py                    # builds the peer's environment in a temporary folder
    python benchmarks/closing.py --environment DIR  # builds it there, or uses what is there

Both sides get the same URDF, the same 6D closures and the same starts, every coordinate up to 0.1 rad off, and close
with all joints free; of the peer, its SciPy and its proximal solver (see benchmarks/peer.py). The sides take turns; a
time is CPU time of the calling thread, the median of 7 turns of the median over the starts. What the peer prints at
every step goes nowhere, and its time is in. MuJoCo has no function that closes loops, and Pinocchio's way is the peer's
proximal solver.
"""

import time

import numpy as np
import peer

STARTS, OFF = 40, 0.1
#: A residual above this is an open loop.
OPEN = 1e-6

WORKER = """
from toolbox_parallel_robots.mounting import closedLoopMountProximal, closedLoopMountScipy

def residual(model, data, constraints, q):
    pin.forwardKinematics(model, data, q)
    worst = 0.0
    for c in constraints:
        gap = (data.oMi[c.joint1_id] * c.joint1_placement).actInv(data.oMi[c.joint2_id] * c.joint2_placement)
        worst = max(worst, np.abs(gap.translation).max(), np.abs(pin.log3(gap.rotation)).max())
    return worst if np.isfinite(worst) else 1e300

def turn():
    return [answered(problem, name, solve) for problem in problems for name, solve in SOLVERS]

def answered(problem, name, solve):
    model, constraints = robot(problem)
    data, datas = model.createData(), [c.createData() for c in constraints]
    times, residuals = [], []
    for start in problem["starts"]:
        q0 = np.array(start)
        begun = time.thread_time()
        try:
            q = solve(model, data, constraints, datas, q_prec=q0.copy())
        except Exception:
            q = q0 * np.nan
        times.append(time.thread_time() - begun)
        residuals.append(float(residual(model, data, constraints, q)))
    return {"robot": problem["name"], "solver": name, "times": times, "residuals": residuals}

SOLVERS = [("proximal", closedLoopMountProximal), ("scipy", closedLoopMountScipy)]
take_turns(turn)
"""


def problem(name, urdf, chain, q):
    """What the worker needs."""
    rng = np.random.default_rng(0)
    starts = [(q + rng.uniform(-OFF, OFF, len(q))).tolist() for _ in range(STARTS)]
    return peer.problem(name, urdf, chain, starts=starts)


def ours(name, chain, starts):
    """Close every start."""
    from exo_pin.chain.kinematics.closing import nearest_closed
    from exo_pin.core.errors import LoopNotClosed

    times, residuals, steps = [], [], []
    for start in starts:
        q0 = np.array(start)
        begun = time.thread_time()
        try:
            q = chain.close(q0)
        except LoopNotClosed as error:
            q = error.q
        times.append(time.thread_time() - begun)
        residuals.append(float(np.abs(chain.residual(q)).max()))
        steps.append(nearest_closed(chain._state, q0, np.zeros(0, dtype=int), 1e-12, 60)[1])
    return {"robot": name, "solver": "exo_pin", "times": times, "residuals": residuals, "steps": steps}


def run(folder):
    """Measure both sides and print the table."""
    robots = [peer.five_bar_with_tip(), peer.delta_of_rods()]
    problems = [problem(*robot) for robot in robots]

    def own():
        return [ours(name, chain, given["starts"]) for (name, _, chain, _), given in zip(robots, problems, strict=True)]

    answers = peer.in_turns(folder, WORKER, problems, own)
    print(f"{'robot':10}{'solver':22}{'median':>10}{'closed':>10}{'residual':>12}{'ratio':>9}")
    for name, *_ in robots:
        mine = next(item for item in answers if item["robot"] == name and item["solver"] == "exo_pin")
        for item in answers:
            if item["robot"] != name:
                continue
            residuals = np.array(item["residuals"])
            closed = residuals < OPEN
            label = item["solver"] if item is mine else f"toolbox {item['solver']}"
            worst = f"{residuals[closed].max():.1e}" if closed.any() else "none"
            ratio = item["time"] / mine["time"]
            count = f"{int(closed.sum())}/{len(closed)}"
            print(f"{name:10}{label:22}{item['time'] * 1e6:>7.1f} µs{count:>9}{worst:>12}{ratio:>8.1f}x")
            if item is not mine:
                lost = int((closed & ~(np.array(mine["residuals"]) < OPEN)).sum())
                if lost:
                    print(f"          {lost} starts that toolbox {item['solver']} closes are not closed by exo_pin")
        print(f"          exo_pin: {np.mean(mine['steps']):.1f} steps on average, {max(mine['steps'])} at most")


if __name__ == "__main__":
    peer.main(__doc__.splitlines()[0], run)
