"""reaction_map beside its peers, in one run, as ratios of time per pose.

Peers, each doing the same work on the same poses:

- MuJoCo's ``mj_forward`` of the same mechanism (ball joint, a site tendon a limb, force sensor at the joint), called
  from Python as a sweep would;
- ProxQP in a loop, one program a pose (initialised anew, as its bounds and matrix change with the pose), and BatchQP
  (``solve_in_parallel``), both for the bounded minimal split, from given F_s0 and X_i: building those is not counted.

    python benchmarks/reaction.py                # 1e3 to 1e7 poses
    python benchmarks/reaction.py --most 1e6     # shorter

Every figure is the best of several repetitions; nothing is asserted. Numbers of other runs do not compare with these.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
from proxsuite import proxqp
from scipy.spatial.transform import Rotation

import exo_pin as ep

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "oracles"))
from mujoco_oracle import MujocoWrist

#: Poses that the peers are given: enough for a steady figure.
PEER_POSES = 3000
BOUND = 10.0  # N
EPS = 1e-9


def best(call: Callable[[], object], seconds: float = 0.5, least: int = 2) -> float:
    """Best time of repeated calls, s; a slow call is repeated ``least`` times only."""
    shortest, spent, calls = np.inf, 0.0, 0
    while calls < least or spent < seconds:
        start = time.perf_counter()
        call()
        took = time.perf_counter() - start
        shortest, spent, calls = min(shortest, took), spent + took, calls + 1
    return shortest


def mj_forward(exo: ep.ShoulderExo, poses: Rotation) -> float:
    """Seconds a pose."""
    wrist = MujocoWrist(exo.mechanism)
    model, data, forward = wrist.model, wrist.data, mujoco.mj_forward
    quaternions, qpos = poses.as_quat(scalar_first=True), wrist.data.qpos

    def sweep() -> None:
        for row in quaternions:
            qpos[:] = row
            forward(model, data)

    return best(sweep) / len(poses)


def programs(exo: ep.ShoulderExo, poses: Rotation) -> list[tuple[np.ndarray, np.ndarray]]:
    """c = F_s0 and G = [X_1 X_2 X_3] of every pose that has an answer, scaled to a largest force of one."""
    own = exo.reaction_map(poses, limits="none")
    normals = np.swapaxes(exo.inverse_kinematics(poses).normals, 1, 2)
    return [(own.shoulder_force[k], np.ascontiguousarray(normals[k])) for k in np.flatnonzero(own.has_answer)]


def proxqp_loop(cases: list[tuple[np.ndarray, np.ndarray]]) -> tuple[float, np.ndarray]:
    """Seconds a pose, and |F_s|: min ½|y|², y - G z = c, |z| <= bound, z boxed."""
    H, A = np.diag([1.0, 1, 1, 0, 0, 0]), np.hstack([np.eye(3), np.zeros((3, 3))])
    nothing, low = np.zeros(6), np.array([-1e20] * 3 + [-BOUND] * 3)
    sizes = np.empty(len(cases))

    def sweep() -> None:
        for k, (c, G) in enumerate(cases):
            A[:, 3:] = -G
            program = proxqp.dense.QP(6, 3, 0, True)
            program.settings.eps_abs = EPS
            program.settings.eps_rel = 0.0
            program.init(H, nothing, A, c, None, None, None, low, -low)
            program.solve()
            sizes[k] = np.linalg.norm(program.results.x[:3])

    return best(sweep) / len(cases), sizes


def proxqp_batch(cases: list[tuple[np.ndarray, np.ndarray]], threads: int) -> tuple[float, float]:
    """Seconds a pose: filling the batch and solving it, and solving alone. BatchQP has no box, so it takes C z."""
    H, A, C = np.diag([1.0, 1, 1, 0, 0, 0]), np.hstack([np.eye(3), np.zeros((3, 3))]), np.eye(6)[3:]
    nothing, bound = np.zeros(6), np.full(3, BOUND)
    solving = []

    def sweep() -> None:
        batch = proxqp.dense.BatchQP()
        for c, G in cases:
            A[:, 3:] = -G
            program = batch.init_qp_in_place(6, 3, 3)
            program.settings.eps_abs = EPS
            program.settings.eps_rel = 0.0
            program.init(H, nothing, A, c, C, -bound, bound)
        start = time.perf_counter()
        proxqp.dense.solve_in_parallel(batch, threads)
        solving.append(time.perf_counter() - start)

    return best(sweep) / len(cases), min(solving) / len(cases)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--most", type=float, default=1e7, help="largest number of poses")
    most = int(parser.parse_args().most)
    exo = ep.load("prototype").worn_by(ep.Arm.from_anthropometry(1.75, 75, "male"))
    sample = Rotation.random(PEER_POSES, np.random.default_rng(0))
    questions = {
        # The peers know no limits of actuators; "within limits" adds those of the prototype's muscles.
        "spherical": {"split": "spherical", "limits": "none"},
        "within limits": {"split": "spherical"},
        "standalone": {"split": "standalone", "limits": "none"},
        f"minimal ±{BOUND:g} N": {"split": "minimal", "limits": "none", "constraint_bounds": (-BOUND, BOUND)},
    }
    for question in questions.values():
        exo.reaction_map(sample, **question)  # compiled before anything is measured

    cases = programs(exo, sample)
    bounded = questions[f"minimal ±{BOUND:g} N"]
    own = exo.reaction_map(sample, **bounded)

    def peers() -> tuple[float, float, list[tuple[float, float]]]:
        loop, sizes = proxqp_loop(cases)
        miss = float(np.abs(own.magnitude[own.has_answer] - sizes).max() / sizes.max())
        if miss > 1e-6:
            sys.exit(f"ProxQP and reaction_map answer differently: |F_s| by {miss:.1e}")
        return mj_forward(exo, sample), loop, [proxqp_batch(cases, threads) for threads in (1, 2)]

    print("reaction_map: all arrays kept; x: how many times faster a pose than the peer (BatchQP: filled, 2 threads).")
    print(f"Peers are measured anew for every number of poses, on {PEER_POSES} of them.")
    for count in (10**power for power in range(3, 10) if 10**power <= most):
        forward, loop, batches = peers()
        print(f"\n{count:.0e} poses. µs a pose: mj_forward {forward * 1e6:.2f}, ProxQP loop {loop * 1e6:.1f}", end="")
        for threads, (filled, solved) in zip((1, 2), batches, strict=True):
            print(f", BatchQP {threads} thread(s) {filled * 1e6:.1f} (solving alone {solved * 1e6:.1f})", end="")
        print(
            f"\n{'split':<16}{'threads':>8}{'µs a pose':>11}{'x mj_forward':>14}{'x ProxQP loop':>15}{'x BatchQP':>12}"
        )
        poses = Rotation.random(count, np.random.default_rng(1))
        for name, question in questions.items():
            for threads in (1, 2):
                show = sys.stderr.isatty() and count >= 10**6
                took = measured(exo, poses, question | {"threads": threads, "progress": show})
                line = f"{name:<16}{threads:>8}{took * 1e6:>11.4f}{forward / took:>14.1f}"
                if question["split"] == "minimal":
                    line += f"{loop / took:>15.0f}{batches[1][0] / took:>12.0f}"
                print(line, flush=True)
        for threads in (1, 2):
            took = measured(exo, poses, {"limits": "none", "threads": threads, "keep": ("magnitude", "status")})
            print(f"{'spherical, |F_s|':<16}{threads:>8}{took * 1e6:>11.4f}{forward / took:>14.1f}", flush=True)


def measured(exo: ep.ShoulderExo, poses: Rotation, question: dict) -> float:
    """Seconds a pose."""
    return best(lambda: exo.reaction_map(poses, **question)) / len(poses)


if __name__ == "__main__":
    main()
