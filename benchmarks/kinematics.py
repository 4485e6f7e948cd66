"""Forward kinematics of the wrist, timed beside a root search with SciPy, in one run on one thread.

    python benchmarks/kinematics.py [--poses 20000]

The peer is what one would write without the closed form: ``scipy.optimize.root`` on the three loop equations in a
rotation vector, started once from a pose 0.1 rad away (it finds one mode) and, to collect all modes, from 64 poses all
over the rotation group. The thesis needed up to 0.1 s for one solution (Section 5.1.2).
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable

import numpy as np
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from exo_pin import wrist
from exo_pin.design import WristGeometry, preset

#: Seconds a solution, Section 5.1.2.
THESIS = 0.1


def median_time(call: Callable[[], object], repeats: int = 7) -> float:
    """Median of several runs after one that compiles, s."""
    call()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def search(geometry: WristGeometry, lengths: np.ndarray, start: Rotation) -> Rotation | None:
    """One mode by SciPy's root search on a_i · R B_i, as a peer would write it."""
    A, B = geometry.base_points, geometry.platform_points
    wanted = ((A**2).sum(axis=1) + (B**2).sum(axis=1) - lengths**2) / 2
    scale = np.linalg.norm(A, axis=1) * np.linalg.norm(B, axis=1)

    def error(vector: np.ndarray) -> np.ndarray:
        R = (Rotation.from_rotvec(vector) * start).as_matrix()
        return (np.einsum("ij,jk,ik->i", A, R, B) - wanted) / scale

    answer = root(error, np.zeros(3), tol=1e-12)
    if np.abs(answer.fun).max() > 1e-10:
        return None
    return Rotation.from_rotvec(answer.x) * start


def all_by_search(geometry: WristGeometry, lengths: np.ndarray, starts: Rotation) -> int:
    """How many modes the peer finds from many starts."""
    found: list[Rotation] = []
    for start in starts:
        mode = search(geometry, lengths, start)
        if mode is not None and all((mode * other.inv()).magnitude() > 1e-6 for other in found):
            found.append(mode)
    return len(found)


def table(name: str, geometry: WristGeometry, poses: Rotation, state: wrist.LimbState) -> float:
    """Print the rows of one geometry; return the peer's time for one mode, s."""
    count, few = len(poses), range(20)
    near = Rotation.from_rotvec(0.1 * np.array([0.6, 0.0, 0.8])) * poses
    lengths, x, y = state.lengths, state.base_theta_x, state.base_theta_y
    one = median_time(lambda: [search(geometry, lengths[k], near[k]) for k in few], 3) / len(few)
    solvers: dict[str, Callable[[], wrist.AssemblyModes]] = {
        "lengths": lambda: wrist.forward_kinematics(geometry, lengths),
        "θ_xA": lambda: wrist.forward_kinematics_from_base_angles(geometry, theta_x=x),
        "θ_yA": lambda: wrist.forward_kinematics_from_base_angles(geometry, theta_y=y),
        "both angles": lambda: wrist.forward_kinematics_from_base_angles(geometry, x, y),
    }
    for label, solve in solvers.items():
        seconds = median_time(solve) / count
        print(
            f"{name:22} {label:16} {seconds * 1e6:9.1f} {solve().count.mean():6.2f} {THESIS / seconds:18,.0f}x "
            f"{one / seconds:18,.0f}x"
        )
    return one


def main() -> None:
    """Print a table of times."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--poses", type=int, default=20_000)
    count = parser.parse_args().poses
    rng = np.random.default_rng(0)
    print(
        f"{'geometry':22} {'from':16} {'µs a set':>9} {'modes':>6} "
        f"{'against the thesis':>19} {'against one search':>19}"
    )
    for name in ("prototype", "scenario-one", "optimised-table-c-2"):
        geometry = preset(name).geometry
        poses = Rotation.random(count, rng)
        state = wrist.inverse_kinematics(geometry, poses)
        one = table(name, geometry, poses, state)
        print(f"{'':22} {'SciPy, one mode':16} {one * 1e6:9.1f} {1.0:6.2f}")
    starts = Rotation.random(64, rng)
    begin = time.perf_counter()
    found = [all_by_search(geometry, state.lengths[k], starts) for k in range(5)]
    spent = (time.perf_counter() - begin) / 5
    exact = wrist.forward_kinematics(geometry, state.lengths[:5]).count.tolist()
    print(f"{'':22} {'SciPy, 64 starts':16} {spent * 1e6:9.0f}   found {found} of {exact} modes")


if __name__ == "__main__":
    main()
