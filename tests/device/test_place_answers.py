"""Answers of postures, dimensions, accuracy and gaps of devices, as they are stored."""

from dataclasses import replace

import device_doors as doors
import numpy as np
import pinocchio as pin
import pytest
from answers import changes, each_of
from asked_in_turn import in_turn
from places import URDF

import exo_pin as ep
from exo_pin.device import Drive, GasSpring, GuidedSlide, LinearSpring, Route, SoftLink, Spring
from exo_pin.workspace import limb_loss


def hinges(**parts):
    """Three hinges on the arm, with other parts, and what they carry."""
    return doors.shipped("serial-y-x-z").replace(**parts)


def postures():
    """Values of idle joints that are asked for, and those that are none."""
    exo, angles = doors.device_of("idle-2")
    pose, poses, chain = exo.pose(*angles[:, 1]), exo.pose(*angles), exo.chain
    modes = exo.configurations(pose)

    def asked(posture, pose=pose):
        answer = exo.reaction(pose, limits="none", posture=posture)
        return answer.status, answer.shoulder_force, answer.actuator_forces, answer.cautions

    def weak():
        return exo.replace(drives=[replace(drive, lower=-1.0, upper=1.0) for drive in exo.device.drives])

    elbow = doors.generated("limbs-4")
    elbow_pose = elbow.pose(3.0, 4.0, 1.0)

    def turned(posture):
        answer = elbow.reaction(elbow_pose, limits="none", posture=posture)
        return answer.status, answer.verdict, answer.shoulder_force, answer.cautions

    return in_turn(
        {
            "names": lambda: [str(name) for name in chain.model.names],
            "ring": lambda: asked({"ring_mm": 4.0}),
            "in m": lambda: asked({"ring": 0.004}),
            "each": lambda: asked({"ring_m": [0.0, 0.002, -0.003, 0.001]}, poses),
            "far": lambda: asked({"ring_mm": 400.0}),
            "driven": lambda: asked({"slide_1_mm": 4.0}),
            "in degrees": lambda: asked({"ring_deg": 4.0}),
            "ball": lambda: asked({"ball_1": 4.0}),
            "unknown": lambda: asked({"rings": 4.0}),
            "none": lambda: asked({}),
            "twice": lambda: asked({"ring": 0.001, "ring_mm": 2.0}),
            "too many": lambda: asked({"ring": [0.1, 0.2, 0.3]}),
            "configuration": lambda: asked(modes),
            "near": lambda: asked(modes + 1e-9),
            "open": lambda: asked(modes + 0.01),
            "shape": lambda: asked(modes[:-1]),
            "of another pose": lambda: asked(exo.configurations(poses)[0]),
            "hinge": lambda: turned({"limb_0_1_deg": 3.0}),
            "back": lambda: turned({"limb_0_1_rad": -0.02}),
            "out of reach": lambda: turned({"limb_0_1_deg": 100.0}),
            "back out of reach": lambda: turned({"limb_0_1_deg": -60.0}),
            "modes": lambda: elbow.assembly_modes(elbow_pose, starts=4, seed=1).shape,
            "no freedom": lambda: hinges().reaction(pose, posture={"flexion": 0.1}),
            "where it is": lambda: asked({"ring": float(modes[chain.configuration_slice("ring")][0])}),
            "strokes": lambda: exo.workspace(poses, ["stroke"], posture={"ring_mm": 4.0}).lengths,
            "without a drive": lambda: [
                {**limb_loss(exo.device, exo.workspace(poses, ep.Criteria(("forces",)), posture=each))}
                for each in ({"ring_mm": [0.0, 2.0, -3.0, 1.0]}, exo.configurations(poses))
            ],
            "nearby": lambda: weak().remedy(pose, posture={"ring_mm": 4.0}).nearest is None,
        }
    )


def spans():
    """Forces over all postures of idle joints, within their limits and without."""

    def asked(exo, pose):
        found = ep.reaction.posture_range(exo, ep.Case(pose), ep.Assumptions(limits="none"))
        return str(found), found.least, found.greatest, found.postures, found.held

    elbow = doors.generated("limbs-4")
    chain = elbow.chain
    model = chain.model.copy()
    own = chain.configuration_slice("limb_0_1")
    model.lowerPositionLimit[own], model.upperPositionLimit[own] = -0.22, 0.17
    held = elbow.replace(chain=ep.ClosedChain(model, chain.description))
    return in_turn(
        {
            "elbow": lambda: asked(held, elbow.pose(3.0, 4.0, 1.0)),
            "none": lambda: asked(hinges(), hinges().pose(30)),
            "spins": lambda: asked(doors.generated("idle-3"), elbow.pose(3.0, 4.0, 1.0)),
            "limb": lambda: asked(doors.generated("limbs-2"), elbow.pose(3.0, 4.0, 1.0)),
        }
    )


def framed():
    """A device whose loop ends in a turned frame of the arm has the forces of the one that ends in the arm itself."""
    device = doors.generated("idle-5").device
    model, place = (
        device.chain.model.copy(),
        pin.SE3(pin.exp3(np.array([0.3, -0.5, 0.8])), np.array([0.01, 0.02, -0.1])),
    )
    model.addFrame(pin.Frame("turned", device.arm_index, 0, place, pin.FrameType.OP_FRAME))
    first, *others = device.chain.closures
    at = place.actInv(np.array(first.placement_b.translation))
    first = replace(first, frame_b="turned", placement_b=ep.chain.Placement(tuple(at.tolist())))
    described = replace(device.chain.description, closures=(first, *others))
    exo = ep.ShoulderExo.from_device(device.replace(chain=ep.ClosedChain(model, described)))
    load = doors.load("left")
    shifted = {"centre_offset": ep.CentreOffset([0.004, 0.006, -0.003], [0.01, -0.02, 0.004])}

    def asked(own):
        answers = [own.reaction(own.pose(5, 3, 2), load=load, limits="none", **more) for more in ({}, shifted)]
        return [(answer.shoulder_force, answer.actuator_forces, answer.cuff_wrench) for answer in answers]

    return asked(exo), asked(ep.ShoulderExo.from_device(device))


def sizes():
    """Dimensions of a device and others, places, and names that are none."""
    exo = hinges()
    device = exo.device
    route = Route.over(("universe", [0.0, 0.2, 0.3]), (exo.chain.roles.arm, [0.0, 0.02, -0.25]))
    joint = device.drives[0].joint
    limbs, slides = doors.generated("limbs-3").device, doors.generated("idle-5").device
    device = device.replace(
        springs=[
            Spring("strut", LinearSpring(90.0, 0.1), route=route), Spring("spiral", LinearSpring(3.0, 0.2), joint),
            Spring("gas", GasSpring(60.0, 0.9, 0.8, 1.1), route=route),
        ],
        drives=(*device.drives, Drive("cable", route=route, upper=30.0)),
    )  # fmt: skip
    wrist = ep.load("four-cables-worn").device if "four-cables-worn" in ep.presets() else ep.load("four-cables").device

    def changed(device=device, **values):
        before, found = device.dimensions(), device.with_dimensions(**values)
        own = {name: value for name, value in found.dimensions().items() if abs(value - before[name]) > 1e-12}
        return own | {"forces": forces(found)}

    def forces(found):
        own = ep.ShoulderExo.from_device(found)
        answer = own.reaction(own.pose(7, 4, 2), limits="none")
        return answer.status, answer.shoulder_force, answer.actuator_forces

    return in_turn(
        {
            "all": device.dimensions,
            "places": device.places,
            "joint": lambda: changed(slides, **{"joint[ball_1].x_mm": 290.0}),
            "axis": lambda: changed(**{f"axis[{joint}].azimuth_deg": 80.0, f"axis[{joint}].elevation_deg": 5.0}),
            "end": lambda: changed(slides, **{"end_a[end_1].y_m": 0.003}),
            "other end": lambda: changed(slides, **{"end_b[end_2].z": -0.22, "axis[slide_3].azimuth_deg": 3.0}),
            "places of limbs": lambda: list(limbs.places()),
            "upright": lambda: forces(slides.with_place("joint[ball_2]", np.array([-0.1, 0.25, 0.2]))),
            "point": lambda: changed(**{"spring[strut,2].y_mm": 30.0}),
            "cable": lambda: changed(**{"cable[cable,1].z_m": 0.35}),
            "law": lambda: changed(**{"law[strut].stiffness_N_m": 70.0, "law[strut].slack_m": 0.12}),
            "spiral": lambda: changed(**{"law[spiral].stiffness_N_m_rad": 2.0, "law[spiral].slack_rad": 0.1}),
            "gas": lambda: changed(**{"law[gas].exponent": 1.2, "law[gas].gas_height_m": 0.7}),
            "twice": lambda: changed(**{"spring[strut,2].y_mm": 30.0, "spring[strut,2].y": 0.1}),
            "unknown": lambda: changed(**{"spring[strut,3].y_mm": 30.0}),
            "unit": lambda: changed(**{"law[strut].slack_mm": 30.0}),
            "wearer": lambda: device.with_dimensions(wearer_mass_kg=90.0),
            "value": lambda: [
                device.value_of(own)
                for own in device.parameters([f"joint[{joint}].x_mm", f"axis[{joint}].azimuth_deg"])
            ],
            "no value": lambda: [device.value_of(own) for own in device.parameters(["payload_kg"])],
            "with": lambda: forces(
                device.with_values(dict.fromkeys(device.parameters(["payload_kg"]), 0.7), [0.0, 0.0, -0.5])
            ),
            "place": lambda: forces(device.with_place("cable[cable,2]", np.array([0.01, 0.0, -0.3]))),
            "of limbs": lambda: ep.load("prototype").device.as_chain().places(),
            "of cables": lambda: list(ep.load("four-cables").device.as_chain().places()),
            "of a limb": lambda: forces(
                ep.load("four-cables").device.as_chain().with_place("A[2]", np.array([-0.05, 0.12, 0.22]))
            ),
            "wrist": lambda: (wrist.dimensions(), wrist.places()),
            "of the wrist": lambda: forces(wrist.with_place("B[2]", np.array([0.05, 0.03, -0.22]))),
            "no place": lambda: wrist.with_place("C[2]", np.zeros(3)),
        }
    )


def placed():
    """How well drives place the arm, with and without play, and how far the hand gives way."""

    def asked(exo, *angles):
        found = exo.accuracy(exo.pose(*angles))
        return found, found.sensitivity()

    serial, wrist = hinges(), ep.load("four-linear-actuators-worn")
    loose = serial.replace(
        drives=[Drive(own.joint, own.joint, play=0.02, resolution=0.001) for own in serial.device.drives]
    )
    half = serial.replace(drives=[Drive("a", serial.device.drives[0].joint, play=0.02), *serial.device.drives[1:]])
    cable = Drive("cable", route=Route.over(("universe", [0, 0.2, 0.3]), (serial.chain.roles.arm, [0, 0.02, -0.25])))
    mixed = serial.replace(drives=[*serial.device.drives[:2], cable])
    found = wrist.accuracy(wrist.pose(40, 25, 5))
    # A limb without length at one of two poses.
    cables = ep.load("four-cables")
    bases = cables.geometry.base_points.copy()
    bases[0] = cables.pose(30).as_matrix() @ cables.geometry.platform_points[0]
    limbs = [replace(limb, actuator=replace(limb.actuator, play=1e-3)) for limb in cables.limbs]
    folded = cables.replace(geometry=cables.geometry.replace(base_points=bases), limbs=limbs)

    def made(weak, twin, barrier, free, stiff, turning=False):
        """As if the rate were so weak, mm/° or °/°, a twin so near, and the hand so soft."""
        own = {"twin_difference": twin, "barrier": barrier, "free_turn": np.radians(free), "hand_stiffness": stiff}
        unit = 1.0 if turning else np.pi / 180.0 * 1e3
        given = replace(
            found, rate=np.array(weak / unit), has_hinges=turning, **{k: np.array(v) for k, v in own.items()}
        )
        return str(given), given.sensitivity(), given.is_doubtful, given.has_twin

    return in_turn(
        {
            "serial": lambda: asked(serial, 20, 30),
            "loose": lambda: asked(loose, 20, 30),
            "half": lambda: asked(half, 20, 30),
            "mixed": lambda: asked(mixed, 20, 30),
            "two": lambda: asked(serial.replace(drives=serial.device.drives[:2]), 20, 30),
            "none": lambda: asked(serial.replace(drives=()), 20, 30),
            "singular": lambda: asked(serial, 0, 90),
            "kinds": lambda: serial.singularity(serial.pose([0, 0, 0, 30], [90, 89.99, 60, 90])).kind,
            "wrist": lambda: asked(wrist, 40, 25, 5),
            "stack": lambda: asked(wrist, [40, 70], [[25], [50]], 5),
            "folded": lambda: [folded.accuracy(folded.pose([30, 40])).free_turn, str(asked(folded, 30)[0])],
            "six": lambda: asked(doors.shipped("six-cables"), 40, 25, 5),
            "chain": lambda: asked(ep.ShoulderExo.from_device(wrist.chain_device), 40, 25, 5),
            "made": lambda: [
                made(*case)
                for case in (
                    (0.29, 1.05, 2.9, np.nan, 9.9),
                    (0.31, 0.99, 2.9, 0.3, 10.1),
                    (0.35, 0.95, 3.1, 2.0, np.nan),
                    (0.31, 1.15, 3.4, 0.3, 11.0, True),
                    (0.34, 1.1, 1.0, 0.3, 1.0),
                    (1.01 / 180.0, 2.0, 1.0, 1.0, 1.0),
                    (0.99 / 180.0, 2.0, 1.0, 1.0, 1.0),
                    (0.9 / 180.0, 0.9, 1.0, 1.0, 1.0, True),
                    (np.nan,) * 5,
                )
            ],
        }
    )


def near_the_body():
    """Gaps of links and cables of devices on a person, and with the arm elsewhere."""

    def asked(name, *angles):
        exo = doors.shipped(name)
        found = exo.chain_device.gaps(
            exo.pose(*angles).as_matrix().reshape(-1, 3, 3), (np.array([[0.0, 0.01, 0.0]]), np.zeros((1, 3)))
        )
        return found, found.parts, found.left_out, found.each(np.arange(len(found.least)))

    names = ("nesm", "serial-y-x-z", "spherical-3rrr", "six-cables", "spring-support", "prototype", "3rps-passive-ball")
    return in_turn({name: lambda name=name: asked(name, [10, 60], [30, 15], 5) for name in names})


def gives_way():
    """Devices that give way beyond what they can follow, small moments, and arms that begin to move or turn evenly."""
    cuff = ep.Interface.upper_arm_cuff(0.19)
    serial, support, round_ = (doors.shipped(name) for name in ("serial-y-x-z", "spring-support", "spherical-3rrr"))
    own = ep.load("four-linear-actuators-worn")
    limbs = [ep.Limb("UPU", actuator=limb.actuator, guide=ep.LimbGuide(60.0, 40.0)) for limb in own.limbs]
    chain = ep.ShoulderExo.from_device(own.replace(limbs=limbs).device.as_chain())
    soft_limb = round_.replace(soft_links=[SoftLink("limb_1_outer", ep.Interface.of(5e3, 50.0, np.zeros(3)))])
    bent = ep.load(URDF / "3rps-passive-ball.urdf").worn_by(
        ep.Wearer(1.755, 85.0, "male", elbow_flexion=np.radians(0.2))
    )
    guided = ep.load("prototype").device.as_chain().replace(
        guided_slides=[GuidedSlide("limb_1_slide", ep.LimbGuide(65.0, 50.0))],
        soft_links=[SoftLink("limb_1_base_body", ep.Interface.of(1e5, 1e3))],
    )  # fmt: skip

    def asked(exo, *angles, **more):
        answer = exo.reaction(exo.pose(*angles), **more)
        return answer.status, answer.load_share, answer.verdict, answer.shoulder_force, answer.cautions

    on_cuff = {"interfaces": ep.Interfaces(cuff=cuff)}
    bare = ep.load(URDF / "serial-y-x-z.urdf")
    on_arm = {"interfaces": ep.Interfaces(cuff=ep.Interface.upper_arm_cuff(0.15))}
    locked = {"split": "elastic_locked", "limits": "none"}
    heavy = ep.Load([2e4, 0.0, -2e4], at=[0.0, 0.0, -0.5])
    return in_turn(
        {
            "soft limb": lambda: asked(soft_limb, 30, 20, split="elastic"),
            "rigid limbs": lambda: asked(soft_limb, 30, 20, split="elastic", centre_offset=[0.0, 0.0, 0.01]),
            "too heavy": lambda: asked(bare.replace(**on_arm), 60, 30, load=heavy, **locked),
            "holds nothing": lambda: asked(support.replace(**on_cuff), 60, **locked),
            "too many": lambda: asked(chain, 40, 30, **locked),
            "rigid": lambda: asked(serial, 60, 30, split="elastic"),
            "guide and spring": lambda: asked(ep.ShoulderExo.from_device(guided), 20, split="elastic"),
            "two drives": lambda: asked(
                bare.replace(drives=bare.device.drives[:2], arm=ep.Arm(3.1, [0.0, 0.0, -0.2]), **on_cuff),
                [0.0, 50.0, 0.0],
                [0.0, 30.0, 40.0],
                split="elastic",
                limits="none",
            ),
            "little is left": lambda: asked(bent, 30, 30),
            "begins to move": lambda: asked(
                serial, 60, 30, motion=ep.Motion([0, 0, 0], [1.0, -2.0, 0.5]), limits="none"
            ),
            "turns evenly": lambda: asked(serial, 60, 30, motion=ep.Motion([1.0, -2.0, 0.5], [0, 0, 0]), limits="none"),
        }
    )


ASKED = {
    "gives_way": gives_way,
    "postures": postures,
    "spans": spans,
    "framed": framed,
    "sizes": sizes,
    "placed": placed,
    "near_the_body": near_the_body,
}


@pytest.mark.full
@each_of(ASKED)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
