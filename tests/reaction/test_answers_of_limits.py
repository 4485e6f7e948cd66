"""Answers at the limits of devices as they are stored: nearest poses, words of verdicts, speeds, ranges."""

from dataclasses import replace

import device_doors as doors
import numpy as np
from answers import changes, each_of
from asked_in_turn import in_turn
from guided_limbs import GUIDE, guided
from places import URDF
from sockets import following
from wrists import exo_of, random_mechanism, regular_poses

import exo_pin as ep
from exo_pin.device import Drive, Route
from exo_pin.reaction import Assumptions, movement_reaction, solve

MAN = ep.Arm.from_anthropometry(1.8, 80.0, sex="male")
HEAVY = ep.Load([0.0, 0.0, -60.0], at=[0.0, 0.0, -0.3])
SPINNING = ep.Motion([[0.7, -0.4, 0.9], [7.0, 1.0, 0.0], [-2.0, 3.0, 1.0]], [[2.0, 1.0, -3.0]] * 3)


def told(answer):
    """Words of an answer, its status, and what is beyond each limit."""
    check = answer.limits
    return {
        "says": str(answer).splitlines(), "status": answer.status, "beyond": [check.force_error, check.length_error,
        check.excess_speed],
        "caution": answer.cautions, "range": answer.range(), "unknown": answer.unknown,
        "why": answer.columns()["reason"],
    }  # fmt: skip


def nearest():
    """The nearest poses that are held, where there are some, of wrists and a chain, on both sides."""
    cables, mirrored = ep.load("four-cables"), ep.load("four-cables", side="right")
    asked = {
        "heavy": lambda: cables.remedy(cables.pose(120.0, 60.0), HEAVY),
        "far": lambda: cables.remedy(cables.pose(-40.0, 80.0)),
        "right": lambda: mirrored.remedy(mirrored.pose(150.0, 20.0)),
        "stroke": lambda: ep.load("four-linear-actuators").remedy(cables.pose(150.0, 100.0, 60.0)),
        "muscles": lambda: ep.load("prototype").remedy(cables.pose(30.0, 20.0)),
        "moving": lambda: cables.remedy(cables.pose([120.0, 60.0])),
    }  # fmt: skip
    return in_turn(
        **{
            name: lambda question=question: (lambda found: (found, str(found)))(question())
            for name, question in asked.items()
        }
    )


def fast():
    """Motions that are too quick for the drives, or ask for more power than they have."""

    def limited(name, speed, power):
        exo = ep.load(name)
        drives = [
            replace(limb, actuator=replace(limb.actuator, speed_limit=speed, power_limit=power)) for limb in exo.limbs
        ]
        return exo.replace(limbs=drives)

    poses = ep.shoulder_rotation([20.0, 50.0, 60.0], [30.0, 60.0, 20.0], [5.0, -10.0, 0.0], degrees=True)
    found = {}
    for name in ("three-linear-actuators", "four-cables"):
        for speed, power in ((0.1, None), (None, 3.0), (0.3, 20.0)):
            exo = limited(name, speed, power)
            found[f"{name} {speed} {power}"] = (
                told(exo.reaction(poses, SPINNING)),
                str(exo.reaction(poses[1], ep.Motion([7.0, 1.0, 0.0], [2.0, 1.0, -3.0]))).splitlines(),
            )
            found[f"map {name} {speed} {power}"] = exo.reaction_map(poses, SPINNING).status
    return found


def verdicts():
    """Words of single poses and stacks: singular, folded, by estimates, slack, unknown, and not evaluated."""
    muscles, cables, bare = ep.load("prototype"), ep.load("four-cables"), ep.load("prototype").replace(limbs=None)
    taut = cables.replace(
        limbs=[replace(limb, actuator=replace(limb.actuator, least_tension=25.0)) for limb in cables.limbs]
    )
    nesm = ep.load(URDF / "nesm.urdf")
    asked = {
        "singular": lambda: bare.reaction(bare.pose(0.0, 90.0)), "near": lambda: bare.reaction(bare.pose(0.5, 89.5)),
        "limits": lambda: cables.reaction(cables.pose(40.0, 30.0), limits=(3.0, 12.0)),
        "taut": lambda: taut.reaction(taut.pose([40.0, 80.0], 30.0)),
        "taut one": lambda: taut.reaction(taut.pose(40.0, 30.0)),
        "muscles": lambda: muscles.reaction(muscles.pose(5.0, 12.0, 0.0)),
        "resting": lambda: muscles.reaction(ep.thesis_rotation([13.0, 20.0, 60.0], -5.0, 0.6, degrees=True)),
        "one muscle": lambda: muscles.reaction(ep.thesis_rotation(13.0, -5.0, 0.6, degrees=True)),
        "pull": lambda: bare.reaction(bare.pose([30.0, 0.0, 60.0], [20.0, 90.0, 10.0]), limits="pull"),
        "minimal": lambda: bare.reaction(bare.pose([30.0, 60.0], [80.0, 10.0]), split="minimal"),
        "steep": lambda: bare.reaction(bare.pose(30.0, 84.0), split="minimal", constraint_bounds=None),
        "heavy": lambda: bare.reaction(
            bare.pose([5.0, 60.0], [20.0, 30.0]),
            load=ep.Load([[0.0, 0.0, -10.0], [0.0, 0.0, -1e5]], at=[0.0, 0.0, -0.3]),
            split="minimal",
        ),
        "alone": lambda: cables.reaction(cables.pose(30.0), split="standalone"),
        "nesm": lambda: nesm.reaction(nesm.pose([30.0, 170.0], [20.0, 150.0])),
        "brakes": lambda: nesm.reaction(nesm.pose(20.0, 170.0, 90.0)),
        "worn": lambda: solve(cables, ep.Case(cables.pose(30.0), wearer=ep.Wearer(1.6, 50, "female"))),
        "six": lambda: ep.load("six-cables").reaction(cables.pose([30.0, 60.0], 20.0), limits=(0.0, 30.0)),
    }  # fmt: skip
    return in_turn(**{name: lambda question=question: told(question()) for name, question in asked.items()})


def ranges():
    """Ranges of the shoulder's force: single, unbounded, along two ways of self-stress, and within a cone."""
    found = {}
    for n in (3, 4, 5):
        exo = exo_of(random_mechanism(np.random.default_rng(70 + n), n, ["SPS"] * n))
        pose = regular_poses(exo.mechanism, np.random.default_rng(81 + n), 1, margin=0.05)[0]
        size = float(np.abs(exo.reaction(pose, limits="none").actuator_forces).max())
        for name, own in {
            "none": {"limits": "none"},
            "pull": {"limits": "pull"},
            "range": {"limits": (-1.5 * size, 1.7 * size)},
            "tight": {"limits": (-0.01, 0.01)},
        }.items():
            answer = exo.reaction(pose, **own)
            found[f"{n} {name}"] = answer.range(), str(answer.range())
        found[f"{n} cone"] = exo.reaction(
            pose, limits=(-2.0 * size, 2.0 * size), cone=following(muscle_compression=20.0 * size, faces=6)
        ).range()
    return found


def rough():
    """Movements whose noise outweighs the forces, and those of devices without a person."""
    exo, rng = ep.load("four-cables").worn_by(MAN), np.random.default_rng(7)
    times = np.linspace(0.0, 1.0, 41)
    angles = [20.0 + 40.0 * times, 30.0 + 10.0 * np.sin(5.0 * times), 3.0 * times]
    clean = exo.pose(*angles)
    noisy = ep.shoulder_rotation(*(each + rng.normal(0.0, 0.8, 41) for each in angles), degrees=True)
    found = {}
    for name, poses, smoothing in (("clean", clean, None), ("smooth", noisy, "gcv"), ("rough", noisy, None)):
        movement = ep.Movement.from_samples(times, poses, smoothing=smoothing)
        answer = movement_reaction(exo, movement, ep.Case(movement), Assumptions())
        found[name] = answer.cautions, answer.summary(), str(answer).splitlines()[:12], answer.force_noise
    return found


class Wrong(type(ep.reaction.SPLITS["minimal"])):
    """A split that calls itself by another's name, or by none."""

    def __init__(self, name, assumption="an assumption"):
        self.name, self.assumption = name, assumption


def own_splits():
    """Splits that are none, actuators that answer wrongly, and sockets that see a force."""
    exo = ep.load("four-cables").replace(limbs=None)
    poses = exo.pose([20.0, 30.0], 30.0)

    class Given:
        def __init__(self, *ends):
            self.ends = ends

        def force_limits(self, length):
            return self.ends[0](length) if callable(self.ends[0]) else self.ends

    def breaks(length):
        if (length > exo.inverse_kinematics(poses).lengths[:, 0].min()).any():
            raise ep.InvalidInput("too long")
        return 0.0 * length, 0.0 * length + 500.0

    def asked(*ends):
        return lambda: told(exo.reaction(poses, limits=[Given([0.0, 0.0], [900.0, 900.0])] * 3 + [Given(*ends)]))

    cone, force = ep.GlenoidCone(0.5, 0.4, muscle_compression=20.0), np.array([[10.0, -20.0, 5.0], [-30.0, 2.0, 0.0]])
    turned = following(0.5, 0.4)
    return in_turn(
        name=lambda: exo.reaction(poses, split=Wrong("spherical")), words=lambda: exo.reaction(poses,
        split=Wrong("")), assumed=lambda: exo.reaction(poses, split=Wrong("mine", "")), breaks=asked(breaks),
        three=asked([0.0, 0.0], [1.0, 1.0], [2.0, 2.0]), text=asked("a", "b"), shape=asked([0.0] * 3, [1.0] * 3),
        crossed=asked([0.0, 2.0], [1.0, 1.0]), endless=asked([0.0, np.inf], [1.0, np.inf]),
        large=asked([0.0, 0.0], [1.0, 1e30]), lost=asked([0.0, np.nan], [900.0, 2.0]),
        none=lambda: exo.reaction(poses, limits=[Given(0, 1), 3, Given(0, 1), Given(0, 1)]),
        components=lambda: [turned.components(force, side, poses) for side in ("left", "right")],
        ratio=lambda: turned.utilisation(force, "left", poses), hanging=lambda: cone.components(force, "left"),
        pose=lambda: turned.half_spaces("left"), faces=lambda: ep.GlenoidCone(faces=2.5),
        degrees=lambda: ep.reaction.glenoid_orientation(35, 0, 0, retroversion=0, inclination=0, degrees=1),
        right=lambda: ep.reaction.glenoid_orientation(135, 0, 0, retroversion=0, inclination=95, degrees=True),
        shapes=lambda: ep.reaction.glenoid_orientation([1, 2], [1, 2, 3], 0, retroversion=0, inclination=0,
        degrees=True),
    )  # fmt: skip


def corners():
    """Maps with side forces beside tensions, words of one pose of a stack, and actuators that may refuse."""
    four = exo_of(random_mechanism(np.random.default_rng(73), 4))
    poses = regular_poses(four.mechanism, np.random.default_rng(84), 6, margin=0.05)
    cables = ep.load("four-cables")
    proof = cables.reaction(cables.pose([40.0, 120.0], [30.0, 60.0]), load=HEAVY).infeasibility

    longest = np.sort(four.inverse_kinematics(poses).lengths.max(axis=1))[2:4].mean()

    class Refuses:
        def force_limits(self, length):
            if (length > longest).any():
                raise ep.InvalidInput("too long")
            return 0.0 * length - 500.0, 0.0 * length + 500.0

    class Pulls:
        def force_limits(self, length):
            return 0.0 * length, 0.0 * length + 200.0

    def soft():
        exo = guided(ep.load("prototype").worn_by(MAN), GUIDE, 4000.0)
        load = ep.Load([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, -200.0]])
        found = exo.reaction(exo.pose([0.0, 60.0, 60.0], [90.0, 30.0, 30.0]), load=load, split="elastic", limits="none")
        return found.status, found.load_share

    seven = exo_of(random_mechanism(np.random.default_rng(75), 7, ["UPU"] * 7))

    def sides(bounds):
        return lambda: four.reaction_map(poses, load=HEAVY, split="minimal", constraint_bounds=bounds, limits="pull")

    def light():
        """Forces of least tensions alone."""
        exo = cables.replace(arm=ep.Arm(1e-15, [0.0, 0.0, -0.2]))
        found = exo.reaction(
            exo.pose([40.0, 80.0], [30.0, 60.0]), split="minimal", constraint_bounds=5.0, limits=(20, 60)
        )
        return found.status, found.actuator_forces[0]

    return in_turn(
        light=light, tension=sides("actuator"), soft=soft, many=lambda: seven.reaction(
            poses[0], split="minimal", constraint_bounds=20.0, limits=(-50.0, 250.0)
        ).range(), actuators=lambda: four.reaction_map(
            poses, load=HEAVY, split="minimal", constraint_bounds="actuator", limits=[Pulls()] * 4
        ).magnitude,
        endless=lambda: str(four.reaction(poses, split="minimal", limits="none").range()),
        muscles=lambda: ep.load("prototype").reaction_map(
            cables.pose([0.0, 0.0], -10.0, 30.0),
            load=ep.Load([0.0, 0.0, 0.0], [[2.76, 2.86, 0.4], [3.07, 3.48, 0.62]]),
        ),
        given=sides((-4.0, np.arange(6.0)[:, None] + 2.0)),
        keep=lambda: four.reaction_map(poses, keep=3), held=lambda: proof.explain(0), index=lambda: proof.explain(5),
        whole=lambda: proof.explain(), refuses=lambda: told(four.reaction(poses, limits=[Refuses()] * 4)),
        elevation=lambda: ep.GlenoidCone(elevation=[0.0, 1.0]),
        chain=lambda: ep.ShoulderExo.from_device(ep.load("four-linear-actuators").device.as_chain()).reaction(
            cables.pose(30.0), split="minimal", constraint_bounds="actuator"
        ).constraint_forces,
    )  # fmt: skip


def devices():
    """Limits of a device that moves by itself, of one with drives in N and N m, and of one that needs its wearer."""
    idle, hinges = doors.generated("idle-2"), doors.shipped("serial-y-x-z")
    way = Route.over(("universe", [0.0, 0.2, 0.3]), (hinges.chain.roles.arm, [0.0, 0.02, -0.25]))
    mixed = hinges.replace(drives=[*hinges.device.drives, Drive("cable", route=way, upper=60.0)])
    muscle = ep.Actuator("pneumatic muscle", force_law="best", supply_pressure=4e5)
    two, cone = hinges.replace(drives=hinges.device.drives[:2]), following(muscle_compression=120.0, faces=8)

    def asked(exo, *angles, **own):
        found = exo.reaction(exo.pose(*angles), **own)
        proof = {} if found.infeasibility is None else vars(found.infeasibility)
        parts = {"F": found.shoulder_force, "f": found.actuator_forces} | proof
        # Of what is zero there is no rounding.
        return [
            found.status,
            {name: np.round(1.0 * part, 6) + 0.0 for name, part in parts.items() if name != "drive_units"},
        ]

    def shared(hinge, **cable):
        """Of drives in N and N m, of which one hinge has only these limits."""
        first, *others = hinges.device.drives
        own = hinges.replace(
            drives=[Drive(first.name, first.joint, **hinge), *others, Drive("cable", route=way, **cable)]
        )
        found = own.reaction(own.pose(60, 20), limits="none")
        return found.actuator_forces, found.cautions

    def tiny():
        """All limits below one."""
        drives = [replace(drive, upper=0.4 + 0.1 * k, lower=-0.2) for k, drive in enumerate(hinges.device.drives)]
        own = hinges.replace(drives=[*drives, Drive("cable", route=way, upper=0.9)])
        return own.reaction(own.pose(60, 20), limits="none").actuator_forces

    def singular():
        """Beside a pose that is none."""
        found = hinges.reaction(hinges.pose([20, 60], [90, 20]))
        return found.status, found.spherical_force, found.ratio, found.cuff_wrench, found.limits.force_error

    return in_turn(
        tiny=tiny,
        small=lambda: shared({"upper": 0.4}, upper=60.0), unknown=lambda: shared({}, upper=60.0),
        still=lambda: shared({"lower": 0.0, "upper": 0.0}, upper=60.0), loose=lambda: shared({"upper": 0.4}),
        muscle=lambda: shared({"upper": 0.4}, actuator=muscle, stroke=ep.Stroke(0.25, 0.7, 1.1, 0.15)),
        bare=lambda: shared({}, actuator=muscle, stroke=ep.Stroke(0.25, 0.7, 1.1, 0.15)),
        weak=lambda: asked(idle, 3, 4, 1, limits=7.0), nearly=lambda: asked(idle, 3, 4, 1, limits=24.0),
        mixed=lambda: asked(mixed, 60, 20, cone=cone), free=lambda: asked(mixed, 60, 20),
        wearer=lambda: asked(two, 50, 20, 30, limits="none", cone=cone),
        none=lambda: asked(two, 50, 20, 30, limits=3.0), singular=singular,
    )  # fmt: skip


def notes():
    """What is said of stiffness that a split does not use or lacks, and a wrist that is flat, off its centre."""
    soft = ep.load("prototype").replace(
        limbs=[ep.Limb("UPU", guide=GUIDE), ep.Limb("UPU"), ep.Limb("UPU", guide=GUIDE)],
        shoulder=ep.Shoulder(stiffness=2e4 * np.eye(3)),
        interfaces=ep.Interfaces(harness=ep.Interface.of(2e4, 300.0, at=(-0.1, 0.0, 0.1))),
    )
    stiff, bare = soft.replace(interfaces=ep.Interfaces()), soft.replace(shoulder=ep.Shoulder())
    ring = np.array([[0.1, 0.02, 0.0], [-0.06, 0.09, 0.0], [-0.03, -0.11, 0.0]])
    geometry = ep.WristGeometry(ring, 0.7 * ring, neutral=ep.shoulder_rotation(0.0, 0.0, 0.3))
    flat = ep.ShoulderExo.from_mechanism(ep.Mechanism(geometry, arm=MAN))

    def off(height):
        answer = flat.reaction(flat.pose(0, 0, 25), limits="none", centre_offset=[0.012, -0.007, height])
        return answer.status, np.round(answer.determinant, 9) + 0.0

    return [
        own.reaction(own.pose(25.0, 35.0), split=split, limits="none").cautions
        for own in (soft, stiff, bare)
        for split in ("spherical", "minimal", "elastic")
    ], [off(height) for height in (0.0, 1e-5, 0.05)]


ASKED = {each.__name__: each for each in (nearest, fast, verdicts, ranges, rough, own_splits, corners, devices, notes)}

#: Those that take longer than 0.15 s.
LONGER = {"nearest", "fast", "ranges", "rough", "verdicts", "devices"}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
