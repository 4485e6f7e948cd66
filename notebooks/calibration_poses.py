"""What a calibration of a device gains, and which poses it needs.

Run it to write docs/pictures/calibration.png and print the tables of docs/howto/calibration.md:  python notebooks/calibration_poses.py

The device with three linear actuators, with joints that are 3 mm (standard deviation) off in every coordinate, 40 such
devices; lengths measured with 0.3 mm of noise in poses that it can reach. Forces are those on the arm of a man of 1.75 m
and 75 kg, at rest, in poses of daily activities with |det X| > 0.1.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from picture_options import picture_options

import exo_pin as ep
from exo_pin.calibration import pose_information, suggest_poses
from exo_pin.core.progress import track
from exo_pin.load_case.ranges_of_motion import ADL_BOX
from exo_pin.view.colours import BLUE, GREY, ORANGE, RED
from exo_pin.view.plots.plot_style import tidy

NOISE = 0.3e-3
JOINTS = ("base_points", "platform_points")
MODES: dict[str, tuple[str, ...]] = {
    "joints": JOINTS,
    "joints, length offsets": (*JOINTS, "length_offsets"),
    "centre": ("base_offset", "cuff_offset"),
    "centre, length offsets": ("base_offset", "cuff_offset", "length_offsets"),
    "centre, length offsets, mountings": ("base_offset", "cuff_offset", "length_offsets", "torso_mounting", "arm_mounting"),
}
COUNTS = (8, 12, 20, 30, 50, 80)


def daily(rng: np.random.Generator, count: int) -> Rotation:
    """Poses drawn uniformly from the box of daily activities."""
    box = np.array(ADL_BOX.intervals)
    return ep.shoulder_rotation(*rng.uniform(box[:, 0], box[:, 1], (count, 3)).T, degrees=True)


def suggested(exo: ep.ShoulderExo, count: int, **errors: Any) -> Rotation:
    """The best poses of a grid of daily activities, of those within strokes and on the side of rest."""
    box = ep.adl_box(15.0)
    reached = box[exo.workspace(box, ["stroke", "singularity"]).inside]
    return reached[suggest_poses(exo, count, reached, length_noise=NOISE, **errors)]


def reachable(rng: np.random.Generator, count: int, exo: ep.ShoulderExo) -> Rotation:
    """The same, those within strokes and on the side of rest."""
    drawn = daily(rng, 2 * count)
    inside = exo.workspace(drawn, ep.Criteria(names=("stroke", "singularity"))).inside
    return drawn[np.flatnonzero(inside)[:count]]


def two_sweeps(count: int) -> Rotation:
    """Half of the poses along abduction, half along flexion, as in the thesis's first tests."""
    half = np.linspace(0.0, 90.0, count // 2)
    return ep.shoulder_rotation(
        np.concatenate([half, 0.0 * half]), np.concatenate([0.0 * half, half]), 0.0, degrees=True
    )


def deviation(poses: Rotation, exo: ep.ShoulderExo) -> float:
    """Root mean square of the expected standard deviations of all joint coordinates, mm."""
    found = pose_information(poses, exo, length_noise=NOISE).standard_deviations
    return float(1e3 * np.sqrt((found**2).mean()))


def force_errors(exo: ep.ShoulderExo, devices: int) -> tuple[np.ndarray, np.ndarray]:
    """Errors of |F_s| of the nominal and of the calibrated device, %, over devices and poses."""
    worn = exo.worn_by(ep.Arm.from_anthropometry(1.75, 75, "male"))
    where = suggested(exo, 30)
    rng, errors = np.random.default_rng(2), []
    for _ in track(range(devices), "devices", True):
        shape = exo.geometry.base_points.shape
        real = worn.replace(
            geometry=exo.geometry.replace(
                base_points=exo.geometry.base_points + 0.003 * rng.normal(size=shape),
                platform_points=exo.geometry.platform_points + 0.003 * rng.normal(size=shape),
            )
        )
        lengths = real.inverse_kinematics(where).lengths
        found = ep.calibrate(where, lengths + NOISE * rng.normal(size=lengths.shape), worn, length_noise=NOISE)
        poses = daily(rng, 100)
        poses = poses[np.abs(real.singularity(poses).determinant) > 0.1]
        true = real.reaction_map(poses).magnitude
        errors.append([100 * np.abs(each.reaction_map(poses).magnitude / true - 1) for each in (worn, found.exo)])
    before, after = (np.concatenate([pair[k] for pair in errors]) for k in (0, 1))
    return before, after


def draw_errors(ax: Any, before: np.ndarray, after: np.ndarray) -> None:
    """Shares of poses with an error below a value."""
    share = np.linspace(0.0, 100.0, len(before))
    for errors, colour, name, side in ((before, ORANGE, "nominal", "left"), (after, BLUE, "calibrated", "right")):
        ax.plot(np.sort(errors), share, color=colour, lw=2.2)
        middle = np.median(errors)
        ax.plot(middle, 50, "o", color=colour, ms=6)
        shift = (9, -16) if side == "left" else (-9, 4)
        text = f"{name}\nmedian {middle:.2g} %"
        ax.annotate(text, (middle, 50), shift, textcoords="offset points", color=colour, ha=side)
    ax.set(xscale="log", xlim=(0.02, 100), ylim=(0, 100), xlabel="error of the shoulder force, %", ylabel="poses, %")
    ax.set_xticks([0.1, 1, 10, 100], ["0.1", "1", "10", "100"])
    ax.set_title("Joints 3 mm off (standard deviation), 30 poses", fontsize=10, loc="left")


def draw_counts(ax: Any, exo: ep.ShoulderExo, counts: tuple[int, ...]) -> None:
    """Expected deviation over the number of poses."""
    rng = np.random.default_rng(3)
    rows = {
        "random": ([float(np.median([deviation(reachable(rng, k, exo), exo) for _ in range(25)])) for k in counts], GREY),
        "suggested": (
            [deviation(suggested(exo, k), exo) for k in counts],
            BLUE,
        ),
    }
    for name, (values, colour) in rows.items():
        print(f"{name:12}" + "".join(f"{value:8.2f}" for value in values))
        ax.plot(counts, values, "o-", color=colour, lw=2.2, ms=4.5)
        shift = (10, -2) if name == "random" else (0, -36)
        ax.annotate(name, (counts[0], values[0]), shift, textcoords="offset points", color=colour)
    lost = pose_information(two_sweeps(80), exo, length_noise=NOISE).undetermined
    print(f"abduction and flexion only: {len(lost)} directions undetermined")
    note = f"abduction and flexion alone: {len(lost)} directions\nundetermined, with any number of poses"
    ax.text(0.99, 0.97, note, color=RED, ha="right", va="top", transform=ax.transAxes)
    ax.set(xscale="log", yscale="log", xlabel="measured poses", ylabel="expected error of a joint coordinate, mm")
    ax.set_xticks(counts, [str(k) for k in counts])
    ax.minorticks_off()
    ax.set_yticks([0.2, 0.5, 1, 2], ["0.2", "0.5", "1", "2"])
    ax.set(xlim=(7, 95), ylim=(0.15, 4))
    ax.set_title("Lengths measured to 0.3 mm (standard deviation)", fontsize=10, loc="left")


def print_table(exo: ep.ShoulderExo) -> None:
    """Largest expected standard deviation with suggested poses: of a joint, or of the centre, mm."""
    for name, unknowns in MODES.items():
        for turn in (0.0, 0.1, 1.0):
            cells = []
            for count in (20, 50, 100):
                errors = {"unknowns": unknowns, "orientation_noise": np.radians(turn)}
                found = pose_information(suggested(exo, count, **errors), exo, length_noise=NOISE, **errors)
                own = [place[:1] in "AB" or "base" in place or "cuff" in place for place in found.names]
                cells.append(f"{1e3 * found.standard_deviations[own].max():.2g}")
            print(f"| {name} | {turn:g} | {' | '.join(cells)} |")


def main() -> None:
    asked = picture_options(__doc__, "calibration.png")
    import matplotlib.pyplot as plt

    exo = ep.load("three-linear-actuators")
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 4.2), layout="constrained")
    counts, devices = (COUNTS[:2], 2) if asked.coarse else (COUNTS, 40)
    before, after = force_errors(exo, devices)
    print(f"error of |F_s|: median {np.median(before):.2g} % and {np.median(after):.2g} %, ninth decile "
          f"{np.quantile(before, 0.9):.2g} % and {np.quantile(after, 0.9):.2g} %")  # fmt: skip
    draw_errors(left, before, after)
    draw_counts(right, exo, counts)
    for ax in (left, right):
        tidy(ax)
    if not asked.coarse:
        print_table(exo)
    figure.savefig(asked.out, dpi=200)


if __name__ == "__main__":
    main()
