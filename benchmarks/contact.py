"""Contact forces of a person's shoulder, beside the same programs in SciPy, and a map with a device.

::

    python benchmarks/contact.py [--poses N] [--map N]

Random poses within the range of motion; CPU time a pose. SciPy's SLSQP gets the same programs, with gradients and
started at the solution of the program without a socket; the table says how far its effort lies above ours.
"""

import argparse
import time

import numpy as np
import scipy

import exo_pin as ep
from exo_pin.person.contact import query

PERSON = ep.Person(1.75, 75, "male")


def poses(count):
    """Seeded poses within the range of motion."""
    angles = np.random.default_rng(0).uniform([-10, 5, -30], [80, 100, 40], (2 * count, 3)).T
    found = ep.shoulder_rotation(*angles, degrees=True)
    return found[PERSON.allows(found)][:count]


def programs(stack):
    """The programs that a query solves."""
    caught, solve = [], query._solve_pose

    def catch(pose, *more):
        caught.append(pose)
        return solve(pose, *more)

    solve.cache_clear()
    query._solve_pose = catch
    try:
        PERSON.joint_contact(stack)
    finally:
        query._solve_pose = solve
    return caught


def by_scipy(pose, start):
    """The same program by SLSQP."""

    def room(z):
        v = pose.socket @ (pose.pull @ z + pose.rest) / 500.0
        return v[0] - np.hypot(v[1], v[2])

    held = np.arange(5) != 3 if pose.stopped else np.ones(5, dtype=bool)
    conditions = [
        {
            "type": "eq",
            "fun": lambda z: (pose.rows @ z + pose.constant)[held] / 10,
            "jac": lambda z: pose.rows[held] / 10,
        },
        {"type": "ineq", "fun": room},
    ]
    if pose.stopped:
        stop = {"fun": lambda z: -(pose.rows @ z + pose.constant)[3] / 10, "jac": lambda z: -pose.rows[3] / 10}
        conditions.append({"type": "ineq", **stop})
    return scipy.optimize.minimize(
        lambda z: float(z @ z),
        start,
        jac=lambda z: 2 * z,
        bounds=list(zip(pose.low, pose.high, strict=True)),
        constraints=conditions,
        method="SLSQP",
        options={"ftol": 1e-10, "maxiter": 300},
    )


def main():
    """Time both and compare."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--poses", type=int, default=200)
    parser.add_argument("--map", type=int, default=2000, help="poses of the map, 0 for none (default 2000)")
    options = parser.parse_args()
    stack = poses(options.poses)
    PERSON.joint_contact(stack[:3])
    start = time.process_time()
    result = PERSON.joint_contact(stack)
    ours = (time.process_time() - start) / len(stack)
    start = time.process_time()
    query._solve_pose.cache_clear()
    for pose in stack[:50]:
        PERSON.joint_contact(pose)
    single = (time.process_time() - start) / min(50, len(stack))
    starts = PERSON.joint_contact(stack, options=ep.ContactOptions(cone=None)).activations
    problems = programs(stack)
    start = time.process_time()
    theirs = [by_scipy(pose, first) for pose, first in zip(problems, starts, strict=True)]
    peer = (time.process_time() - start) / len(stack)
    good = np.array([answer.success for answer in theirs])
    above = np.array([answer.fun for answer in theirs]) / np.maximum(result.effort, 1e-12) - 1.0
    print(f"{len(stack)} poses, {int(result.has_result.sum())} with a result")
    print(f"paths, muscles and programs   {1e3 * ours:6.2f} ms a pose, residual {result.residual.max():.1e}")
    print(f"the same, called pose by pose {1e3 * single:6.2f} ms a pose")
    print(
        f"SciPy, programs alone         {1e3 * peer:6.2f} ms a pose, {int(good.sum())} solved, "
        f"effort above ours {np.median(above[good]):.1e} (median), {above[good].min():.1e} (least)"
    )
    if options.map:
        device, grid = ep.load("four-cables"), poses(options.map)
        start = time.process_time()
        relief = device.joint_contact(grid, PERSON).relief_percent
        spent = time.process_time() - start
        print(
            f"map of {len(grid)} poses, with the device and without  {spent:6.1f} s, "
            f"{1e3 * spent / len(grid):.2f} ms a pose; relief {np.nanmedian(relief):.0f} % (median)"
        )


if __name__ == "__main__":
    main()
