"""Errors of calibrated joints in the body's frames: within what is stated, where mountings, scale and centre are not.

::

    python benchmarks/calibration_coverage.py            # 500 cases: 4 minutes
    python benchmarks/calibration_coverage.py --cases 60

Devices differ from their design at random, and sensors and centre from what is taken as known, by the stated prior.
The first table has the share of joint coordinates, seen from the shoulder in the frames of the body, that lie in their
95 % intervals. The second has errors of joints and |F_s| where no prior is stated, beside the effect in the verdict.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "oracles"))

from measured_devices import measured, near, poses, random_exo

import exo_pin as ep

JOINTS, MOUNTINGS, CENTRE = (
    ("base_points", "platform_points"),
    ("torso_mounting", "arm_mounting"),
    ("base_offset", "cuff_offset"),
)
#: Standard deviation of each component: rad, rad, 1, m, m; and of the workshop, m.
PRIOR = dict.fromkeys(MOUNTINGS, np.radians(2.0)) | {"length_scale": 0.005} | dict.fromkeys(CENTRE, 0.005)
WORKSHOP = 0.002
NOISE = 3e-4
#: What is unknown, and what has the prior.
SETS = {
    "joints": (JOINTS, (*MOUNTINGS, "length_scale")),
    "joints, within the workshop's tolerance": (JOINTS, (*MOUNTINGS, "length_scale", *CENTRE)),
    "joints of the base": (("base_points",), ("torso_mounting", "length_scale", "cuff_offset")),
    "joints of the cuff, length offsets": (("platform_points", "length_offsets"), ("arm_mounting", "base_offset")),
    "centre": (CENTRE, (*MOUNTINGS, "length_scale")),
    "mountings": (MOUNTINGS, (*CENTRE, "length_scale")),
}


def drawn(name, rng):
    """A calibration of a device drawn from the prior, and the device."""
    unknowns, known = SETS[name]
    exo = ep.load("three-linear-actuators") if rng.random() < 0.5 else random_exo(rng, int(rng.integers(3, 6)))
    device = near(exo, rng, joints=0.0)
    moved = {ring: np.zeros((exo.geometry.limb_count, 3)) for ring in ("base", "platform")}
    turns = dict.fromkeys(MOUNTINGS, Rotation.identity())
    for ring, points, offset in (("base", *JOINTS[:1], *CENTRE[:1]), ("platform", *JOINTS[1:], *CENTRE[1:])):
        if points in unknowns:
            moved[ring] = moved[ring] + WORKSHOP * rng.normal(size=moved[ring].shape)
        if offset in (*unknowns, *known):
            moved[ring] = moved[ring] + PRIOR[offset] * rng.normal(size=3)
    for mounting in MOUNTINGS:
        if mounting in (*unknowns, *known):
            turns[mounting] = Rotation.from_rotvec(PRIOR[mounting] * rng.normal(size=3))
    offsets = 0.002 * rng.normal(size=len(device.base)) * ("length_offsets" in unknowns)
    device = type(device)(device.base + moved["base"], device.platform + moved["platform"], offsets, *turns.values())
    seen, lengths = measured(device, poses(rng, 40), rng, NOISE)
    if "length_scale" in known:
        lengths = lengths / (1.0 + PRIOR["length_scale"] * rng.normal())
    stated = {each: PRIOR[each] for each in known}
    if "workshop" in name:
        stated |= dict.fromkeys(unknowns, WORKSHOP)
    starts = {each: Rotation.identity() for each in MOUNTINGS if each in unknowns}
    return ep.calibrate(seen, lengths, exo, unknowns=unknowns, length_noise=NOISE, tolerances=stated, **starts), device


def apart(found, device):
    """Error of each joint coordinate in the body's frames, shape (2, n, 3), m."""
    return np.stack(found.joints) - np.stack([device.base, device.platform])


def coverage(cases, seed=0):
    """Of each set: cases, shares of the coordinates within 95 % and 68 %, median error and deviation, m."""
    per = {name: [] for name in SETS}
    for number in range(cases):
        name = list(SETS)[number % len(SETS)]
        found, device = drawn(name, np.random.default_rng([seed, number]))
        error, deviation = np.abs(apart(found, device)), found.joint_deviations
        free = deviation > 0.0
        ratio = error[free] / deviation[free]
        per[name].append(
            ((ratio < 1.96).mean(), (ratio < 1.0).mean(), np.median(error[free]), np.median(deviation[free]))
        )
    return {name: np.array(rows) for name, rows in per.items()}


def without_prior(cases, seed=1):
    """Rows of mistakes: of each, errors of joints (mm) and |F_s| (%), and what the verdicts say of it."""
    for text, name, size, per in (
        ("torso sensor 2° off", "torso mounting", 2.0, "deg"),
        ("torso sensor 5° off", "torso mounting", 5.0, "deg"),
        ("arm sensor 2° off", "arm mounting", 2.0, "deg"),
        ("scale 1 % off", "length scale", 1.0, "%"),
    ):
        joints, forces, said, shown = [], [], [], 0
        for number in range(cases):
            rng = np.random.default_rng([seed, number])
            exo = ep.load("three-linear-actuators")
            device = near(exo, rng, joints=0.003)
            axis = rng.normal(size=3)
            turn = Rotation.from_rotvec(np.radians(size) * axis / np.linalg.norm(axis))
            wrong = device._replace(**{name.split()[0]: turn}) if per == "deg" else device
            arm = poses(rng, 40)
            seen, lengths = measured(wrong, arm, rng, NOISE)
            lengths = lengths if per == "deg" else lengths / (1.0 + 1e-2 * size)
            found = ep.calibrate(seen, lengths, exo, length_noise=NOISE)
            known = {each.name: each for each in found.known}[name]
            shown += bool(found.contradiction)
            joints.append(1e3 * np.linalg.norm(apart(found, device), axis=-1).max())
            real, own = (force(exo, *there, arm) for there in ((device.base, device.platform), found.joints))
            forces.append(100.0 * np.abs(own / real - 1.0))
            said.append([size * known.effects[key] for key in ("joints_mm", "F_s_percent")])
        yield text, np.median(joints), np.median(forces), np.quantile(forces, 0.9), *np.median(said, axis=0), shown


def force(exo, base, platform, arm):
    """|F_s|, N, of a device with its joints there."""
    moved = exo.replace(geometry=exo.geometry.replace(base_points=base, platform_points=platform))
    return moved.reaction(arm, limits="none").magnitude


def main():
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=500)
    cases = parser.parse_args().cases
    print(
        "| unknown | known to the prior | cases | within 95 % | within 68 % | median error, mm | median deviation, mm |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- |")
    per = coverage(cases)
    for name, rows in per.items():
        known = ", ".join(each.replace("_", " ") for each in SETS[name][1])
        inside, one, error, deviation = rows[:, 0].mean(), rows[:, 1].mean(), *np.median(rows[:, 2:], axis=0)
        print(f"| {name} | {known} | {len(rows)} | {100 * inside:.1f} % | {100 * one:.1f} % |"
              f" {1e3 * error:.2g} | {1e3 * deviation:.2g} |")  # fmt: skip
    every = np.concatenate(list(per.values()))
    print(f"| all |  | {len(every)} | {100 * every[:, 0].mean():.1f} % | {100 * every[:, 1].mean():.1f} % |  |  |")
    print()
    print("| mistake | largest joint error, mm | F_s off, % | ninth decile | verdict: mm | verdict: % | contradicted |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    count = max(cases // 25, 2)
    for text, *numbers, shown in without_prior(count):
        print(f"| {text} | " + " | ".join(f"{x:.2g}" for x in numbers) + f" | {shown} of {count} |")


if __name__ == "__main__":
    main()
