"""Every kind of device on one man: what it holds, what the shoulder's joint feels, what its drives do.

::

    python benchmarks/compare_devices.py                   # print the tables
    python benchmarks/compare_devices.py --docs docs       # write them into which_kind.md, draw the figure
    python benchmarks/compare_devices.py --out which.png   # draw the figure alone

216 poses of the thesis's box, a measured lift, three poses with the wearer's muscles, and one lost drive at a time. A
pose counts as singular where the drives' Jacobian has less than 0.05 of its largest singular value in some direction.
"""

import argparse
import warnings
from pathlib import Path

import numpy as np
from device_tables import (
    DEVICES,
    DRIVES,
    FEW,
    HOLDING,
    MARKS,
    SHOULDER,
    draw,
    drive_count,
    drive_row,
    markdown,
    row,
)

import exo_pin as ep
from exo_pin.load_case import read_movement
from exo_pin.uncertainty.offset_search import DIRECTIONS

ROOT = Path(__file__).parents[1]
MAN = {"height": 1.755, "mass": 85.0, "sex": "male"}
STEP, NEAR, OFF = 20.0, 0.05, 0.01


def device(name):
    """A device on the man's arm, from the presets or from ``urdf/``."""
    source = name if name in ep.presets() else ROOT / "urdf" / f"{name}.urdf"
    return ep.load(source).worn_by(ep.Wearer(**MAN))


def limits_of(exo):
    """Limits that a question keeps: a passive device has none to keep but what its wearer adds."""
    return "none" if is_passive(exo) else "design"


def is_passive(exo):
    """Whether it has no drives."""
    return not exo.is_wrist and not exo.device.drives


def dexterity(exo, poses):
    """Least over largest singular value of the drives' Jacobian, by pose; NaN out of reach."""
    J = exo.jacobian(poses).reshape(-1, drive_count(exo), 3)
    there = np.isfinite(J).all(axis=(1, 2))
    found = np.full(len(J), np.nan)
    values = np.linalg.svd(J[there], compute_uv=False)
    found[there] = values[:, 2] / values[:, 0]
    return found


def singular_share(exo, poses):
    """Share of the poses that are singular, or nearly: over those that are reached."""
    kind = np.asarray(exo.singularity(poses).kind).reshape(-1)
    there = kind != "out_of_reach"
    return float((~(dexterity(exo, poses) >= NEAR) | (kind != "regular"))[there].mean())


def within_travel(answer):
    """Poses that are reached and within the travel of the drives, as far as it is known."""
    return (answer.status != "out_of_reach") & (np.nan_to_num(answer.limits.length_error) == 0.0).all(axis=-1)


def travels(exo, poses):
    """Travel of each drive over poses, m or rad; a hinge that turns on takes the shorter arc."""
    if exo.is_wrist:
        return np.ptp(exo.inverse_kinematics(poses).lengths.reshape(-1, drive_count(exo)), axis=0)
    chain, q = exo.chain, exo.configurations(poses)
    q = q.reshape(-1, q.shape[-1])
    q = q[~np.isnan(q).any(axis=1)]
    found = []
    for drive in exo.device.drives:
        values = q[:, chain.configuration_slice(drive.joint)][:, 0]
        if exo.device.unit_of(drive) == "N m":
            turns = np.sort(values % (2.0 * np.pi))
            found.append(2.0 * np.pi - np.diff(turns, append=turns[0] + 2.0 * np.pi).max())
        else:
            found.append(np.ptp(values))
    return np.array(found)


def held_after_failure(exo, poses):
    """Share of the poses held while one drive gives no effort, for each drive."""
    count = exo.device.limb_count
    shares = []
    for lost in range(drive_count(exo)):
        free = np.full(count, np.inf)
        free[lost] = 0.0
        shares.append(float(exo.reaction(poses, limits=(-free, free)).held.mean()))
    return np.array(shares)


def off_centre(exo, split="spherical"):
    """Largest change of |F_s| by 10 mm in a direction, N, in the few poses; infinite where the device cannot follow."""
    poses = exo.pose(*np.transpose(FEW))
    there, worst = exo.reaction(poses, limits="none", split=split).magnitude, 0.0
    for offset in OFF * DIRECTIONS:
        answer = exo.reaction(poses, limits="none", split=split, centre_offset=offset)
        if (answer.status == "out_of_reach").any():
            return np.inf
        worst = max(worst, float(np.abs(answer.magnitude - there).max()))
    return worst


def off_centre_on_cuff(exo):
    """The same of a rigid device on a cuff as measured on 21 persons; NaN of wrists, which also need a soft joint."""
    if exo.is_wrist:
        return np.nan
    middle = exo.chain.placement(exo.chain.neutral(), "cuff_middle").translation
    cuff = ep.Interface.upper_arm_cuff(distance=-middle[2])
    return off_centre(exo.replace(interfaces=ep.Interfaces(cuff=cuff)), "elastic")


def clear(exo, poses):
    """Poses in which the device's links keep clear of the wearer; NaN for a strut, which has no shapes."""
    if is_passive(exo):
        return np.full(poses.shape, np.nan)
    return exo.workspace(poses, ["clearance"]).inside


def share_of_limit(exo, efforts):
    """Largest share of its greatest effort that a drive gives; NaN where that is not known."""
    drives = exo.limbs if exo.is_wrist else exo.device.drives
    limits = [np.max(np.abs(drive.effort_range)) for drive in drives]
    return np.max(efforts / limits) if limits and len(efforts) else np.nan


def contacts(exo):
    """Contact force with the wearer's muscles in the few poses, with and without the device, N; NaN if not held."""
    poses = exo.pose(*np.transpose(FEW))
    answer = exo.reaction(poses, limits=limits_of(exo))
    found = exo.joint_contact(poses, ep.Person(**MAN), forces=answer)
    return np.where(answer.held, found.magnitude, np.nan), found.without_device.magnitude


def masses(exo):
    """Mass of the device on the arm and of its other links, kg; massless limbs weigh nothing."""
    own = sum(part.mass for part in exo.arm.parts if part.device)
    person = sum(part.mass for part in exo.arm.parts if not part.device)
    return own, sum(inertia.mass for inertia in exo.chain.model.inertias) - person - own


def wearers_share(exo, poses):
    """Moments that the wearer of a passive device makes, over those of the arm alone, by pose."""
    left = exo.reaction(poses, limits="none").actuator_forces
    arm = ep.Arm.of_wearer(ep.Wearer(**MAN))
    alone = np.cross(poses.apply(arm.centre_of_mass), arm.mass * exo.device.gravity)
    return np.linalg.norm(left, axis=-1) / np.linalg.norm(alone, axis=-1)


def lift(exo, every=10):
    """Share of the samples of examples/lift.csv that the device holds, in motion."""
    moved = read_movement(ROOT / "examples" / "lift.csv", side=exo.side)
    motion = ep.Motion(moved.motion.angular_velocity[::every], moved.motion.angular_acceleration[::every])
    return float(exo.reaction(moved.poses[::every], motion).held.mean())


def figures(name, whole=True, step=STEP):
    """All figures of one device, or all but those with muscles and on a soft cuff."""
    exo = device(name)
    poses = ep.adl_box(step)
    passive = is_passive(exo)
    answer = exo.reaction(poses, limits=limits_of(exo))
    held, force = np.asarray(answer.held), np.asarray(answer.magnitude)
    free = exo.reaction(poses, limits="none")
    efforts = np.abs(answer.actuator_forces[held]) if held.any() else np.zeros((0, exo.device.limb_count))
    nothing = np.full(len(FEW), np.nan)
    return {
        "exo": exo,
        "force": force[held],
        "all_known": bool((answer.can_hold == held).all()),
        "held": np.nan if passive else held.mean(),
        "lift": np.nan if passive else lift(exo),
        "reached": (there := within_travel(answer)).mean(),
        "clear": (apart := clear(exo, poses)).mean(),
        "useful": np.nan if passive else (held & apart).mean(),
        "singular": np.nan if passive else singular_share(exo, poses),
        "dexterity": np.nan if passive else np.nanmedian(dexterity(exo, poses)),
        "median": np.median(force[held]) if held.any() else np.nan,
        "peak": force[held].max() if held.any() else np.nan,
        "free": np.nanmedian(free.magnitude),
        "open": int(exo.device.is_upu.sum()),
        "failed": np.array([np.nan]) if passive else held_after_failure(exo, poses),
        "off": off_centre(exo),
        "cuff": off_centre_on_cuff(exo) if whole else np.nan,
        "contact": contacts(exo) if whole else (nothing, nothing),
        "masses": masses(exo),
        "effort": efforts.max(axis=0) if len(efforts) else None,
        "share": share_of_limit(exo, efforts[:, : drive_count(exo)]),
        "travel": travels(exo, poses[there] if there.any() else poses),
        "wearer": np.median(wearers_share(exo, poses)) if passive else 0.0,
    }


def main():
    """Print the tables, or write them into the page with the figure."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--docs", type=Path, help="folder of the documentation")
    parser.add_argument("--out", type=Path, metavar="FILE", help="figure alone")
    parser.add_argument("--coarse", action="store_true", help="two devices in few poses: shows that it runs, no result")
    options = parser.parse_args()
    names, step = (("prototype", "spring-support"), 50.0) if options.coarse else (DEVICES, STEP)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ep.OutsideHumanRange)
        found = {name: figures(name, step=step) for name in names}
    rows = [row(name, each) for name, each in found.items()]
    last = [drive_row(name, each) for name, each in found.items()]
    text = "\n\n".join([markdown(HOLDING, rows), markdown(SHOULDER, rows), markdown(DRIVES, last)])
    print(text)
    if options.out is not None:
        draw(found, options.out)
    if options.docs is not None:
        page = options.docs / "concepts" / "which_kind.md"
        before, rest = page.read_text(encoding="utf-8").split(MARKS[0])
        page.write_text(f"{before}{MARKS[0]}\n\n{text}\n\n{MARKS[1]}{rest.split(MARKS[1])[1]}", encoding="utf-8")
        draw(found, options.docs / "pictures" / "which_kind.png")


if __name__ == "__main__":
    main()
