"""A found design computed again from its file alone, and its controller run on an arm that MuJoCo moves.

    python benchmarks/recomputed_design.py [poses] [runs] [design]

Own code: points, strokes and limits from the TOML file; linear programs of HiGHS for what the limbs hold, with all of
them and without one; |F_s| by the parabola that is left; distances of capsules by the closest points of two segments.
From the package come the sizes of three persons (capsules, masses), the controller, and the verdicts that are compared:
shares of the same random poses of the daily box. The run: MuJoCo turns the arm on a ball joint, a limb is a spring and
a damper on a motor with dry friction, integrated here with steps of 0.1 ms; poses are drawn and reached as in
held_poses.py. The numbers stand on docs/evidence/designs_found.md.
"""

from __future__ import annotations

import sys
import tomllib
import warnings
from dataclasses import replace
from importlib.resources import files
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.control import Experiment, ModelController, Turn, options_for
from exo_pin.load_case import ADL_BOX

SIZES = (ep.Wearer(1.755, 85, "male"), ep.Wearer(1.525, 51, "female"), ep.Wearer(1.87, 111, "male"))
ELBOW = (0.0, np.radians(130.0))
#: |F_s|, N; gap, radius of an actuator, m; step of the own integration, s.
LARGEST, GAP, RADIUS, STEP = 250.0, 0.003, 0.016, 1e-4
DOWN = np.array([0.0, 0.0, -9.81])


def drawn(count: int, seed: int) -> Rotation:
    """Poses of the daily box; the arm hangs along -z, x points forward, y to the left."""
    low, high = np.array(ADL_BOX.intervals).T
    flexion, abduction, internal = np.random.default_rng(seed).uniform(low, high, (count, 3)).T
    ways = (("Y", -flexion), ("X", abduction), ("Z", -internal))
    first, second, third = (Rotation.from_euler(axis, angle[:, None], degrees=True) for axis, angle in ways)
    return first * second * third


def apart(p: Any, q: Any, r: Any, s: Any) -> Any:
    """Distance of segments p to q and r to s, all of shape (..., 3): inside, or with an end of one of them."""
    u, v, w = q - p, s - r, p - r
    a, b, c, d, e = (np.sum(x * y, axis=-1) for x, y in ((u, u), (u, v), (v, v), (u, w), (v, w)))
    det = np.maximum(a * c - b * b, 1e-15)
    safe_a, safe_c = np.maximum(a, 1e-15), np.maximum(c, 1e-15)
    pairs = [(np.clip((b * e - c * d) / det, 0, 1), np.clip((a * e - b * d) / det, 0, 1))]
    pairs += [(np.full_like(a, end), np.clip((b * end + e) / safe_c, 0, 1)) for end in (0.0, 1.0)]
    pairs += [(np.clip((b * end - d) / safe_a, 0, 1), np.full_like(a, end)) for end in (0.0, 1.0)]
    points = [w + i[..., None] * u - j[..., None] * v for i, j in pairs]
    return np.min([np.linalg.norm(each, axis=-1) for each in points], axis=0)


def clearance(base: Any, ends: Any, R: Any, body: ep.BodyShape) -> float:
    """Least gap of four actuators to persons and to one another, m."""
    arm = body.arm.copy()
    arm[:, :3], arm[:, 3:6] = arm[:, :3] @ R.T, arm[:, 3:6] @ R.T
    parts = np.concatenate([body.torso, arm])
    gaps = apart(base[:, None], ends[:, None], parts[None, :, :3], parts[None, :, 3:6]) - parts[:, 6] - RADIUS
    i, j = np.triu_indices(len(base), 1)
    between = apart(base[i], ends[i], base[j], ends[j]) - 2.0 * RADIUS
    return float(min(gaps.min(), between.min()))


def holds(moments: Any, span: Any, missing: Any, push: Any, along: Any) -> tuple[bool, bool, float]:
    """Whether four limbs hold a moment, whether any three do, and the least |F_s| with all of them."""
    solved = [
        linprog(np.zeros(4), A_eq=moments, b_eq=missing, bounds=[(0, 0) if i == lost else pair for i, pair in
                enumerate(span)], method="highs").status == 0
        for lost in (None, 0, 1, 2, 3)
    ]  # fmt: skip
    if not solved[0]:
        return False, False, np.inf
    start, freedom = np.linalg.lstsq(moments, missing, rcond=None)[0], np.linalg.svd(moments)[2][3]
    ends = np.sort(np.stack([(np.array(span)[:, k] - start) / freedom for k in (0, 1)]), axis=0)
    change, force = -(along.T @ freedom), -(along.T @ start) - push
    t = np.clip(-(force @ change) / (change @ change), ends[0].max(), ends[1].min())
    return True, all(solved[1:]), float(np.linalg.norm(force + t * change))


def shares(name: str, file: Any, count: int) -> None:
    """Print shares of poses by own code and by the package."""
    points, poses = file["geometry"]["points"], drawn(count, 11)
    A, B = (1e-3 * np.array(points[key]) for key in ("base_mm", "platform_mm"))
    span = [(-limb["actuator"]["push_limit_N"], limb["actuator"]["pull_limit_N"]) for limb in file["limbs"]]
    low, high = (1e-3 * np.array([limb["stroke"][key] for limb in file["limbs"]]) for key in
                 ("shortest_mm", "longest_mm"))  # fmt: skip
    device, arms = file["arm"]["parts"][1], []
    for size in SIZES:
        for bend in np.linspace(*ELBOW, 4):
            mass, centre = zip(*((m, c) for m, c, _ in replace(size, elbow_flexion=bend).segments()), strict=True)
            mass, centre = [*mass, device["mass_kg"]], [*centre, device["centre_of_mass_m"]]
            arms.append((sum(mass), np.average(centre, axis=0, weights=mass)))
    body, found = ep.BodyShape.of(SIZES, "left", ELBOW), np.zeros((count, 2), dtype=bool)
    for k, R in enumerate(poses.as_matrix()):
        ends = B @ R.T
        length = np.linalg.norm(ends - A, axis=1)
        if (length < low).any() or (length > high).any() or clearance(A, ends, R, body) < GAP:
            continue
        along = (A - ends) / length[:, None]
        moments = np.cross(ends, along).T
        each = [holds(moments, span, -np.cross(R @ c, m * DOWN), m * DOWN, along) for m, c in arms]
        found[k, 0] = all(one[0] and one[2] <= LARGEST for one in each)
        found[k, 1] = found[k, 0] and all(one[1] for one in each)
    names = ("stroke", "clearance", "forces", "shoulder_force", "limb_loss")
    limits = ep.Criteria(
        names=names, largest_shoulder_force=LARGEST, least_gap=GAP, wearers=SIZES, elbow_range=ELBOW,
        least_moment_without_limb=0.0,
    )  # fmt: skip
    exo = ep.load(name)
    theirs = [exo.workspace(poses, replace(limits, names=names[:end])).inside for end in (4, 5)]
    for k, words in enumerate(("inside", "the same, and held without any one limb")):
        own, other = 100.0 * found[:, k].mean(), 100.0 * theirs[k].mean()
        differ = int((found[:, k] != theirs[k]).sum())
        print(f"{words}: own {own:.2f} %, package {other:.2f} %, {differ} of {count} poses differ", flush=True)


def moved(exo: ep.ShoulderExo, pose: Rotation) -> Any:
    """Orientation after 7 s and peak |F_s|, by MuJoCo and own motors, under the package's controller."""
    plant = ep.Plant(exo.mechanism, options_for(exo.mechanism))
    controller = ModelController(plant, Turn(exo.pose(), pose.as_rotvec(), 4.0))
    A, B, arm = exo.geometry.base_points, exo.geometry.platform_points, exo.mechanism.arm
    model = _arm(arm)
    data = mujoco.MjData(model)
    own = [drive.parameters for drive in plant.drives]
    k, limit = (np.array([getattr(d, name) for d in plant.drives]) for name in ("stiffness", "force_limit"))
    m, c, dry, share, v0, ratio = (np.array([getattr(p, name) for p in own]) for name in
        ("mass", "viscous", "coulomb", "load_friction", "no_load_speed", "stall_ratio"))  # fmt: skip
    start = exo.reaction(exo.pose(), split="minimal").actuator_forces
    s, v = np.linalg.norm(B - A, axis=1) - start / k, np.zeros(4)
    command, peak = np.zeros(4), 0.0
    for step in range(round(7.0 / STEP)):
        mujoco.mj_kinematics(model, data)
        R = data.xmat[1].reshape(3, 3)
        ends, omega = B @ R.T, R @ data.qvel
        span = ends - A
        length = np.linalg.norm(span, axis=1)
        rate = np.einsum("ij,ij->i", span, np.cross(omega, ends)) / length
        tension = k * (length - s) + 5e-4 * k * (rate - v)
        if step % round(0.01 / STEP) == 0:
            seen = SimpleNamespace(
                orientation=Rotation.from_matrix(R), angular_velocity=omega, pressures=np.zeros(4), lengths=length,
                drive_positions=s.copy(), drive_speeds=v.copy(), lost=False,
            )  # fmt: skip
            command = controller(step * STEP, seen)
        force = np.clip(limit * command, -ratio * limit * (1.0 + v / v0), ratio * limit * (1.0 - v / v0))
        # Pulling in shortens: m v' = T - F - friction, friction against the motion within what keeps it at rest.
        free = v + STEP * (tension - force - c * v) / m
        v = np.sign(free) * np.maximum(np.abs(free) - STEP * (dry + share * np.abs(force)) / m, 0.0)
        s = s + STEP * v
        pulls = -span / length[:, None] * tension[:, None]
        data.qfrc_applied[:] = R.T @ np.cross(ends, pulls).sum(axis=0)
        mujoco.mj_step(model, data)
        if step % 10 == 0:
            centre = R @ arm.centre_of_mass
            spin = R @ data.qacc
            swing = np.cross(spin, centre) + np.cross(omega, np.cross(omega, centre))
            peak = max(peak, float(np.linalg.norm(arm.mass * (swing - DOWN) - pulls.sum(axis=0))))
    mujoco.mj_kinematics(model, data)
    return Rotation.from_matrix(data.xmat[1].reshape(3, 3)), peak


def _arm(arm: ep.Arm) -> Any:
    """An arm on a ball joint."""
    i, c = arm.inertia, arm.centre_of_mass
    numbers = " ".join(f"{value:.17g}" for value in (i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]))
    return mujoco.MjModel.from_xml_string(
        f"""<mujoco><option timestep="{STEP}" gravity="0 0 -9.81" integrator="implicitfast"/><worldbody><body>
        <joint type="ball"/><inertial pos="{c[0]:.17g} {c[1]:.17g} {c[2]:.17g}" mass="{arm.mass:.17g}"
        fullinertia="{numbers}"/></body></worldbody></mujoco>"""
    )


def main(count: int, runs: int, name: str) -> None:
    """Print shares, and how runs end."""
    warnings.simplefilter("ignore")
    folder = files("exo_pin.design").joinpath("presets", "found")
    shares(name, tomllib.loads(folder.joinpath(f"{name}.toml").read_text(encoding="utf-8")), count)
    exo, poses = ep.load(name), drawn(4 * runs, 12)
    held = poses[np.flatnonzero(exo.reaction(poses).held)[:runs]]
    off, peaks = np.zeros((len(held), 2)), np.zeros((len(held), 2))
    for k, pose in enumerate(held):
        reach = Turn(exo.pose(), pose.as_rotvec(), 4.0)
        run = Experiment("held", "held", exo.mechanism, reach, "model", options_for(exo.mechanism), duration=7.0).run()
        ended, peak = moved(exo, pose)
        off[k] = np.degrees([(pose.inv() * ended).magnitude(), run.error[-1]])
        peaks[k] = peak, np.linalg.norm(run.shoulder_force, axis=1).max()
    own, theirs = (off < 1.0).sum(axis=0)
    print(
        f"after 7 s, of {len(held)} runs: settled within 1° own {own}, package {theirs}; errors differ by "
        f"{np.abs(np.subtract(*off.T)).max():.2f}° at most, peaks of |F_s| by "
        f"{np.abs(np.subtract(*peaks.T) / peaks[:, 1]).max():.1%}"
    )


if __name__ == "__main__":
    given = sys.argv[1:]
    main(int(given[0]) if given else 1000, int(given[1]) if given[1:] else 10,
         given[2] if given[2:] else "four-linear-actuators-worn")  # fmt: skip
