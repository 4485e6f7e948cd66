"""Closing loops, side by side with toolbox-parallel-robots in one run.

::

    python benchmarks/closing.py                    # builds the peer's environment in a temporary folder
    python benchmarks/closing.py --environment DIR  # builds it there, or uses what is there

Both sides get the same URDF, the same 6D closures and the same starts, every coordinate up to 0.1 rad off, and close
with all joints free; of the peer, its SciPy and its proximal solver (see benchmarks/peer.py). Every start is solved
several times and the fastest counts (SciPy's is solved once); the table has medians over the starts. What the peer
prints at every step goes nowhere, and its time is in.
"""

import time

import numpy as np
import peer

STARTS, REPEATS, OFF = 40, 5, 0.1
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

answers = []
for problem in problems:
    model, constraints = robot(problem)
    data, datas = model.createData(), [c.createData() for c in constraints]
    for name, solve in (("proximal", closedLoopMountProximal), ("scipy", closedLoopMountScipy)):
        times, residuals = [], []
        for start in problem["starts"]:
            q0, best = np.array(start), np.inf
            for _ in range(problem["repeats"] if name == "proximal" else 1):
                begun = time.perf_counter()
                try:
                    q = solve(model, data, constraints, datas, q_prec=q0.copy())
                except Exception:
                    q = q0 * np.nan
                best = min(best, time.perf_counter() - begun)
            times.append(best)
            residuals.append(float(residual(model, data, constraints, q)))
        answers.append({"robot": problem["name"], "solver": name, "times": times, "residuals": residuals})
answer(answers)
"""


def problem(name, urdf, chain, q):
    """What the worker needs."""
    rng = np.random.default_rng(0)
    starts = [(q + rng.uniform(-OFF, OFF, len(q))).tolist() for _ in range(STARTS)]
    return peer.problem(name, urdf, chain, starts=starts, repeats=REPEATS)


def ours(name, chain, starts):
    """Close every start."""
    from exo_pin.chain.kinematics.closing import nearest_closed
    from exo_pin.core.errors import LoopNotClosed

    times, residuals, steps = [], [], []
    chain.close(np.array(starts[0]))  # compiles
    for start in starts:
        q0, best = np.array(start), np.inf
        for _ in range(REPEATS):
            begun = time.perf_counter()
            try:
                q = chain.close(q0)
            except LoopNotClosed as error:
                q = error.q
            best = min(best, time.perf_counter() - begun)
        times.append(best)
        residuals.append(float(np.abs(chain.residual(q)).max()))
        steps.append(nearest_closed(chain.state, q0, np.zeros(0, dtype=int), 1e-12, 60)[1])
    return {"robot": name, "solver": "exo_pin", "times": times, "residuals": residuals, "steps": steps}


def run(folder):
    """Measure both sides and print the table."""
    robots = [peer.five_bar_with_tip(), peer.delta_of_rods()]
    problems = [problem(*robot) for robot in robots]
    answers = peer.asked(folder, WORKER, problems)
    answers += [ours(name, chain, given["starts"]) for (name, _, chain, _), given in zip(robots, problems, strict=True)]
    print(f"{'robot':10}{'solver':22}{'median':>10}{'closed':>10}{'residual':>12}{'ratio':>9}")
    for name, *_ in robots:
        mine = next(item for item in answers if item["robot"] == name and item["solver"] == "exo_pin")
        for item in answers:
            if item["robot"] != name:
                continue
            residuals = np.array(item["residuals"])
            closed = residuals < OPEN
            median = float(np.median(item["times"]))
            label = item["solver"] if item is mine else f"toolbox {item['solver']}"
            worst = f"{residuals[closed].max():.1e}" if closed.any() else "none"
            ratio = median / float(np.median(mine["times"]))
            count = f"{int(closed.sum())}/{len(closed)}"
            print(f"{name:10}{label:22}{median * 1e3:>7.3f} ms{count:>9}{worst:>12}{ratio:>8.1f}x")
            if item is not mine:
                lost = int((closed & ~(np.array(mine["residuals"]) < OPEN)).sum())
                if lost:
                    print(f"          {lost} starts that toolbox {item['solver']} closes are not closed by exo_pin")
        print(f"          exo_pin: {np.mean(mine['steps']):.1f} steps on average, {max(mine['steps'])} at most")


if __name__ == "__main__":
    peer.main(__doc__.splitlines()[0], run)
