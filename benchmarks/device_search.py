"""The searches behind two devices of ``urdf/`` (python benchmarks/device_search.py spherical-3rrr | 3rps-passive-ball).

Both are for the thesis's box and the arm of the devices' files. Torso and head are boxes here and rods are lines,
because a search wants thousands of designs.

* spherical 3RRR: of the designs whose least singular value of the unit vectors w_i × v_i and least sine between u_i and
  v_i stay above 0.15, the one whose links are clear of arm and body in the most poses;
* 3RPS: weighted sum of the greatest force of a drive for one of the cuff, of the same the other way round, of the ratio
  of lengths, of the poses in which limbs are in the way, and of sizes beyond those of a frame to wear.
"""

import argparse
import itertools
import sys
from pathlib import Path

import numpy as np
from scipy.optimize import differential_evolution, minimize
from scipy.spatial.transform import Rotation

from exo_pin.core.conventions import shoulder_rotation

sys.path.insert(0, str(Path(__file__).parents[1] / "docs" / "scripts"))

from published_devices.rps_device import AT

#: Upper arm, m, and radii of both segments with half a bar.
_ELBOW, _UPPER, _FOREARM = 0.284, 0.0633, 0.0465
#: Bounds of the 3RPS: turn and rise of n, rad; first joint of the base, rad; height and radius of the base, radius and
#: height of the platform, m; how far its joints are turned from the base's, rad.
RPS_BOUNDS = np.array(
    [(-0.5, 2.2), (-1.2, 0.8), (0.0, 2.1), (-0.35, 0.12), (0.12, 0.40), (0.08, 0.25), (-0.35, 0.1), (-1.05, 1.05)]
)


def box(counts):
    """Rotations of the arm over the thesis's box."""
    ends = ((0.0, 110.0), (-4.0, 96.0), (-20.0, 85.0))
    grids = np.meshgrid(*(np.linspace(*end, n) for end, n in zip(ends, counts, strict=True)), indexing="ij")
    return shoulder_rotation(*(grid.ravel() for grid in grids), degrees=True).as_matrix()


def in_body(points):
    """Whether points are in the box of the torso or of the head, shape (...)."""
    x, y, z = np.moveaxis(np.asarray(points), -1, 0)
    return ((y < 0.0) & (z < 0.06) & (abs(x) < 0.14)) | ((y < -0.06) & (abs(x) < 0.11) & (z < 0.3))


def in_the_way(points, R):
    """Whether some of a device's points, shape (k, m, 3), is in the body or in the arm of k poses."""
    down = -R[:, :, 2]
    along = np.clip(np.einsum("kmi,ki->km", points, down), 0.0, 0.64)
    away = np.linalg.norm(points - along[..., None] * down[:, None], axis=2)
    return (in_body(points) | (away < np.where(along < _ELBOW, _UPPER, _FOREARM))).any(axis=1)


def eye_measure(u, v, R, outer=0.22, inner=0.18):
    """Distance from singular poses, which poses are in the way, and the sides of the links, limb by limb."""
    turned = np.einsum("kij,lj->kli", R, v)
    w = np.cross(u, turned)
    sines = np.linalg.norm(w, axis=2)
    w = w / np.maximum(sines, 1e-9)[..., None]
    margin = np.minimum(np.linalg.svd(np.cross(w, turned), compute_uv=False)[:, 2], sines.min(axis=1))
    angles = np.linspace(0.0, np.pi / 2.0, 7)[:, None]
    blocked, sides = np.zeros(len(R), dtype=bool), []
    for i in range(3):
        best, chosen = np.ones(len(R), dtype=bool), (1, 1, 1)
        for motor, elbow, cuff in itertools.product((1, -1), repeat=3):
            if in_body(motor * 0.24 * u[i]):
                continue
            middle = elbow * w[:, None, i]
            bows = [
                outer * (np.cos(angles) * middle + np.sin(angles) * motor * u[i]),
                inner * (np.cos(angles) * cuff * turned[:, None, i] + np.sin(angles) * middle),
            ]
            hit = in_the_way(np.concatenate(bows, axis=1), R)
            if hit.mean() < best.mean():
                best, chosen = hit, (motor, elbow, cuff)
        blocked |= best
        sides.append(chosen)
    return margin, blocked, tuple(sides)


def eye_cost(vector, R):
    """Share of the poses that are singular or in the way, and a penalty; rotation vectors of u and v, shape (6,)."""
    u, v = (Rotation.from_rotvec(part).as_matrix().T for part in (vector[:3], vector[3:]))
    margin, blocked, _ = eye_measure(u, v, R)
    return float((blocked | (margin < 0.15)).mean() + 3.0 * max(0.0, 0.16 - margin.min()))


def rps_design(x):
    """Direction n, places A_i, axes r_i and balls seen from the cuff's, of a vector of dimensions."""
    n = np.array([np.cos(x[1]) * np.cos(x[0]), np.cos(x[1]) * np.sin(x[0]), np.sin(x[1])])
    level = np.cross([0.0, 0.0, 1.0], n)
    level /= np.linalg.norm(level)
    other, turns = np.cross(n, level), x[2] + 2.0 * np.pi / 3.0 * np.arange(3)
    rays, balls = (
        np.outer(np.cos(angles), level) + np.outer(np.sin(angles), other) for angles in (turns, turns + x[7])
    )
    return n, x[3] * n + x[4] * rays, np.cross(n, rays), x[6] * n + x[5] * balls


def rps_cost(x, directions, steps=6):
    """The weighted sum of the module's head; 18 and more where the platform does not reach or meets a singular pose."""
    n, A, r, b = rps_design(x)
    if in_body(A).any() or x[4] < 0.1 or x[5] < 0.08 or abs(x[7]) > 1.05:
        return 60.0
    way = np.cross(n, directions)
    way *= (np.arctan2(np.linalg.norm(way, axis=1), directions @ n) / np.linalg.norm(way, axis=1))[:, None]
    Q = np.repeat(np.eye(3)[None], len(directions), axis=0)
    for step in range(1, steps + 1):
        at = AT * Rotation.from_rotvec(way * step / steps).apply(n)
        Q = Rotation.from_rotvec(way / steps).as_matrix() @ Q
        for _ in range(4 if step < steps else 7):
            arms = np.einsum("kij,lj->kli", Q, b)
            gap = np.einsum("li,kli->kl", r, at[:, None] + arms)
            turn = -np.linalg.solve(np.cross(arms, r[None]) + 1e-12 * np.eye(3), gap[..., None])[..., 0]
            turn *= np.minimum(1.0, 0.5 / np.maximum(np.linalg.norm(turn, axis=1, keepdims=True), 1e-12))
            Q = Rotation.from_rotvec(turn).as_matrix() @ Q
    missed = np.abs(gap).max(axis=1) > 1e-6
    if missed.any():
        return 20.0 + 10.0 * float(missed.mean())
    ends = AT * directions[:, None] + np.einsum("kij,lj->kli", Q, b)
    arms, limbs = ends - AT * directions[:, None], ends - A
    lengths = np.linalg.norm(limbs, axis=2)
    along = limbs / lengths[..., None]
    planes = np.concatenate([np.broadcast_to(r, along.shape), np.cross(arms, r) / AT], axis=2)
    rows = np.concatenate([planes, np.concatenate([along, np.cross(arms, along) / AT], axis=2)], axis=1)
    determinants = np.linalg.det(rows)
    if determinants.min() * determinants.max() <= 0.0:
        return 18.0
    values = np.linalg.svd(np.linalg.inv(rows)[:, :3, 3:], compute_uv=False)
    lines = A[None, :, None] + np.linspace(0.0, 1.0, 7)[:, None] * limbs[:, :, None]
    poses = np.stack([Rotation.align_vectors([d], [[0.0, 0.0, -1.0]])[0].as_matrix() for d in directions])
    blocked = in_the_way(lines.reshape(len(directions), -1, 3), poses)
    sizes = max(x[5] - 0.20, 0.0) + max(-0.28 - x[6], 0.0) + max(x[4] - 0.28, 0.0)
    ratio = (lengths.max(axis=0) / lengths.min(axis=0)).max()
    forces = 0.3 * max(values[:, 0].max() - 2.0, 0.0) + 0.3 * max(1.0 / values[:, -1].min() - 4.0, 0.0)
    return float(5.0 * sizes + forces + 2.0 * max(ratio - 2.2, 0.0) + 4.0 * blocked.mean())


def search_eye(seed):
    """Differential evolution on a coarse grid, then a simplex on a finer one; prints the turns in degrees."""
    coarse, fine = box((5, 5, 5)), box((9, 9, 9))
    found = differential_evolution(
        eye_cost, [(-np.pi, np.pi)] * 6, (coarse,), maxiter=60, popsize=8, rng=seed, polish=False
    ).x
    options = {"maxiter": 250, "initial_simplex": np.vstack([found, found + 0.1 * np.eye(6)])}
    found = minimize(eye_cost, found, (fine,), method="Nelder-Mead", options=options).x
    turns = [np.round(Rotation.from_rotvec(part).as_euler("XYZ", degrees=True)) for part in (found[:3], found[3:])]
    u, v = (Rotation.from_euler("XYZ", turn, degrees=True).as_matrix().T for turn in turns)
    margin, blocked, sides = eye_measure(u, v, fine)
    print(f"turns {turns[0]}, {turns[1]} deg, sides {sides}: at least {margin.min():.3f} from singular, ", end="")
    print(f"{100 * (1 - blocked.mean()):.1f} % of {len(fine)} poses clear")


def search_rps(seed, count=6000):
    """The best of random designs, each moved by a simplex; prints their dimensions."""
    rng, directions = np.random.default_rng(seed), -box((5, 5, 1))[:, :, 2]
    drawn = rng.uniform(RPS_BOUNDS[:, 0], RPS_BOUNDS[:, 1], (count, 8))
    for x in sorted(drawn, key=lambda each: rps_cost(each, directions))[:8]:
        for _ in range(2):
            x = minimize(rps_cost, x, (directions,), method="Nelder-Mead", options={"maxiter": 400}).x
        print(f"{rps_cost(x, directions):.3f}: {np.round(x, 3).tolist()}", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("device", choices=("spherical-3rrr", "3rps-passive-ball"))
    parser.add_argument("--seed", type=int, default=4)
    given = parser.parse_args()
    (search_eye if given.device == "spherical-3rrr" else search_rps)(given.seed)
