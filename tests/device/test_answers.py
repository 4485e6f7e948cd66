"""Answers of devices of every kind, as they are stored."""

import device_doors as doors
import numpy as np
from answers import changes, each_of
from asked_in_turn import in_turn

import exo_pin as ep

#: A motion, and a device that sits beside the shoulder, on either side.
MOTION = ep.Motion([0.3, -0.9, 0.2], [1.0, -2.0, 0.5])
OFFSET = ep.CentreOffset([0.004, 0.006, -0.003], [0.001, -0.002, 0.004])
#: What of an answer is told; the rest is that of the reaction's own tests.
PARTS = (
    "shoulder_force", "actuator_forces", "constraint_forces", "cuff_wrench", "harness_wrenches", "status",
    "equilibrium_status", "can_hold", "margin", "cautions",
)  # fmt: skip


def told(answer):
    """Numbers and words of an answer."""
    return {"says": str(answer), "shows": answer.infeasibility} | {name: getattr(answer, name) for name in PARTS}


def asked(name, *splits):
    """One device at rest, moving, displaced and loaded, and where its joints are."""
    exo, angles = doors.device_of(name.removeprefix("chain of "))
    exo = ep.ShoulderExo.from_device(exo.chain_device) if name.startswith("chain of ") else exo
    pose, poses, load = exo.pose(*angles[:, 1]), exo.pose(*angles), doors.load(exo.side)

    def singular():
        found = exo.singularity(poses)
        freedom = getattr(found, "freedom", None)  # of chains alone
        return found.kind, found.smallest_singular_value, found.margin, freedom, found.determinant

    questions = {
        "loaded": lambda: told(exo.reaction(pose, load=load)),
        "moving": lambda: told(exo.reaction(poses, MOTION, limits="none")),
        "displaced": lambda: told(exo.reaction(pose, centre_offset=OFFSET, split="minimal", constraint_bounds=20.0)),
        "weak": lambda: told(exo.reaction(pose, load=load, limits=7.0)),
        "singular": singular,
        "jacobian": lambda: exo.jacobian(pose),
        "configurations": lambda: exo.configurations(poses),
        "coordinates": lambda: exo.inverse_kinematics(poses).positions,
        "checked": lambda: [(own.name, own.outcome) for own in exo.check().findings],
        "name": lambda: repr(exo),
        "document": lambda: described(exo.chain_device),
    } | {split: lambda split=split: told(exo.reaction(pose, load=load, split=split)) for split in splits}
    return in_turn(questions)


def described(device):
    """What a device says of itself."""
    names = (
        "name", "side", "limbs", "limb_count", "is_upu", "has_limbs", "drive_units", "summary", "force_words",
        "arm_joint", "cuff_is_known", "doubts", "gravity", "radius", "links_mass", "driven_moments", "holds_alone",
        "structure",
    )  # fmt: skip
    own = {name: getattr(device, name) for name in names}
    own["limbs"] = [(limb.name, limb.joint, limb.effort_range, limb.length_range) for limb in device.limbs]
    gaps = device.gaps(np.array([ep.shoulder_rotation(20, 35, 10, device.side, degrees=True).as_matrix()]))
    return own | {"gaps": (gaps.unknown, gaps.left_out, gaps.parts, gaps.least)}


ASKED = {
    "nesm": lambda: asked("nesm"),
    "serial": lambda: asked("serial-y-x-z"),
    "six_cables": lambda: asked("six-cables", "standalone"),
    "muscles": lambda: asked("chain of prototype", "elastic"),
    "actuators": lambda: asked("chain of four-linear-actuators", "elastic", "elastic_locked"),
    "support": lambda: asked("spring-support"),
    "spherical": lambda: asked("spherical-3rrr", "elastic"),
    "three_rps": lambda: asked("3rps-passive-ball"),
    "ring": lambda: asked("idle-2"),
    "idle_limbs": lambda: asked("idle-13"),
    "both_kinds": lambda: asked("idle-11"),
    "hinged_limbs": lambda: asked("limbs-4"),
    "parts_on_arm": lambda: asked("handed-0", "elastic", "elastic_locked"),
    "parts_on_hinges": lambda: asked("handed-1", "elastic", "elastic_locked"),
    "parts_on_links": lambda: asked("handed-9", "elastic"),
    "motors": lambda: asked("motor-3"),
}

#: Those that take longer than 0.15 s.
LONGER = set(ASKED)


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
