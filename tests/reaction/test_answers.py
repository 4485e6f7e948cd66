"""Answers of the reaction query as they are stored: splits and limits, devices, maps, movements, remedies."""

from dataclasses import replace

import numpy as np
from answers import changes, each_of
from asked_in_turn import in_turn
from guided_limbs import GUIDE, SOFT_JOINTS, guided
from places import URDF
from sockets import following, hanging
from wrists import exo_of, random_mechanism, regular_poses

import exo_pin as ep
from exo_pin.load_case import MeasurementNoise
from exo_pin.reaction import Assumptions, glenoid_orientation, posture_range, reaction_table

MAN = ep.Arm.from_anthropometry(1.8, 80.0, sex="male")
MOTION = ep.Motion([0.7, -0.4, 0.9], [2.0, 1.0, -3.0])
PUSH = ep.Load([9.0, -12.0, 15.0], [0.4, 0.3, -0.6], at=(0.01, 0.02, -0.3), frame="arm")
OFFSET = ep.CentreOffset([0.012, -0.008, 0.01], [-0.004, 0.003, 0.008])
PATH = ep.CentrePath(
    np.radians([0.0, 90.0, 180.0]), np.array([[0, 0, 0], [0, -0.004, 0.012], [0, -0.01, 0.02]]), (0.001, 0.0, 0.002)
)
CUFF = ep.Interface.of([3e3, 2e3, 1e3], [90.0, 80.0, 70.0], at=(0.01, 0.02, -0.15))
FACES = ep.Interfaces(cuff=CUFF, harness=ep.Interface.of(2e4, 300.0, at=(-0.1, 0.0, 0.1)), cuff_area=0.02)


class Muscle:
    """Pulls up to 900 N, less as it shortens; takes lengths of 5 to 30 cm."""

    def force_limits(self, length):
        reach = (length > 0.05) & (length < 0.3)
        return np.where(reach, 2.0, np.nan), np.where(reach, 60.0 + 100.0 * length, np.nan)


def device(name, **changes):
    return ep.load(URDF / f"{name}.urdf" if (URDF / f"{name}.urdf").exists() else name).replace(**changes)


def poses_of(exo):
    return exo.pose([20.0, 50.0, 100.0], [30.0, 60.0, 20.0], [5.0, -10.0, 30.0])


def asked(exo, poses=None, *more, brief=False, **options):
    """An answer with its table, and its numbers as they are written; a brief one is told by its table and forces."""
    found = exo.reaction(poses_of(exo) if poses is None else poses, *more, **options)
    if brief:
        check = found.limits
        forces = found.shoulder_force, found.actuator_forces, found.constraint_forces, found.cuff_wrench
        return str(found).splitlines(), forces, found.status, check.force_error, check.length_error, check.excess_speed
    return {
        "answer": found,
        "range": found.range(),
        "columns": list(found.columns().items()),
        "crossings": found.crossings(),
    }


def of_presets():
    """Muscles, cables and linear actuators within the limits of the designs, at rest and in motion, loaded and worn."""
    muscles, cables, screws = (
        ep.load("prototype"),
        ep.load("four-cables").worn_by(MAN),
        ep.load("three-linear-actuators"),
    )
    quick = ep.Motion([[0.7, -0.4, 0.9], [7.0, 1.0, 0.0], [0.0, 0.0, 0.0]], [[2.0, 1.0, -3.0]] * 3)
    return {
        "muscles": asked(muscles, load=ep.Load([0.0, 0.0, 2.0]), brief=True),
        "cables": asked(cables, None, MOTION, PUSH), "screws": asked(screws, None, quick, brief=True),
        "one": asked(cables, cables.pose(40.0, 30.0), brief=True), "weak": asked(cables, cables.pose(80.0, 60.0),
        load=ep.Load([0.0, 0.0, 0.0], [90.0, 250.0, 10.0])),
    }  # fmt: skip


def of_splits():
    """Side forces, cones, weights and offsets of wrists without symmetry, with limits of every form."""
    found = {}
    for n, kinds in ((3, None), (4, ["UPU", "SPS", "UPU", "UPU"]), (5, ["SPS", "UPU"] * 2 + ["UPU"])):
        exo = exo_of(random_mechanism(np.random.default_rng(70 + n), n, kinds))
        poses = regular_poses(exo.mechanism, np.random.default_rng(80 + n), 2, margin=0.05)
        cone = following(muscle_compression=300.0 * n, faces=8)
        found |= in_turn(**{
            f"{n} {name}": lambda exo=exo, poses=poses, own=own: asked(exo, poses, MOTION, PUSH, brief=True, **own)
            for name, own in {
                "plain": {}, "pull": {"limits": "pull", "centre_offset": OFFSET},
                "range": {"limits": (-70.0, 90.0), "split": "minimal"},
                "sides": {"split": "minimal", "constraint_bounds": (-9.0, 14.0)},
                "actuator": {"split": "minimal", "constraint_bounds": "actuator", "limits": "pull"},
                "cone": {"cone": cone, "split": "minimal", "constraint_bounds": 60.0},
                "soft": {"cone": replace(cone, penalty=10.0)}, "alone": {"split": "standalone", "centre_offset": PATH},
                "weights": {"split": "minimal", "constraint_bounds": 30.0,
                "weights": ep.Weights(2.0, 0.5, 0.1, hanging())}, "muscles": {"limits": Muscle()},
                "each": {"limits": [Muscle()] * n},
            }.items()
        })  # fmt: skip
    return found


def elastic():
    """Guides, joints, shoulder, cuff and harness that give way; offsets, limits, cones, and guides overloaded."""
    exo = guided(ep.load("prototype"), replace(SOFT_JOINTS, largest_bending_moment=0.5, largest_torque=0.2)).replace(
        interfaces=FACES
    )
    wrist = random_mechanism(np.random.default_rng(74), 4)
    half = ep.LimbBody.rod(0.2, 0.12, 0.012)
    five = exo_of(
        wrist.replace(
            limbs=tuple(ep.Limb("UPU", half, half, guide=GUIDE) for _ in range(4)),
            shoulder=ep.Shoulder(stiffness=2e4 * np.eye(3)),
        )
    )
    poses = regular_poses(wrist, np.random.default_rng(84), 2, margin=0.05)
    return {
        "free": asked(exo, exo.pose([20.0, 35.0], [30.0, 40.0]), MOTION, PUSH, split="elastic", limits="none"),
        "locked": asked(exo, exo.pose([20.0, 35.0], [30.0, 40.0]), load=PUSH, split="elastic_locked", limits="none",
        centre_offset=OFFSET),
        "one": asked(exo, exo.pose(25.0, 35.0), split="elastic", brief=True),
    } | in_turn(**{
        name: lambda own=own: asked(five, poses, MOTION, PUSH, split="elastic", brief=True, **own)
        for name, own in {"none": {}, "pull": {"limits": "pull"}, "range": {"limits": (-20.0, 60.0),
        "centre_offset": PATH}, "cone": {"cone": following(muscle_compression=900.0, faces=8)},
        "tight": {"limits": (-2.0, 3.0)}}.items()
    }, rigid=lambda: ep.load("prototype").reaction(ep.load("prototype").pose(), split="elastic"),
    five=lambda: asked(five, poses, split="elastic_locked", brief=True))  # fmt: skip


def of_chains():
    """Devices of other kinds, which are chains: side forces, springs, more drives than freedoms, soft cuffs."""
    brief = {"serial-y-x-z": True, "spherical-3rrr": True, "spring-support": False, "nesm": False, "six-cables": True}
    found = {
        name: lambda name=name, short=short: asked(device(name), None, None, PUSH, brief=short)
        for name, short in brief.items()
    }
    more = {
        "soft serial": (device("serial-y-x-z", interfaces=FACES), {"split": "elastic"}),
        "locked": (device("serial-y-x-z", interfaces=FACES), {"split": "elastic_locked"}),
        "offset": (device("serial-y-x-z"), {"centre_offset": OFFSET}),
        "path": (device("spherical-3rrr"), {"centre_offset": PATH}),
        "cone": (device("six-cables"), {"cone": following(muscle_compression=100.0)}),
        "minimal": (device("spherical-3rrr"), {"split": "minimal"}), "alone": (device("six-cables"),
        {"split": "standalone"}),
        "bounds": (device("prototype"), {"split": "minimal", "constraint_bounds": 5.0}),
        "actuator": (device("spherical-3rrr"), {"split": "minimal", "constraint_bounds": "actuator"}),
        "worn": (device("nesm").worn_by(MAN), {"limits": (-5.0, 6.0)}),
    }  # fmt: skip
    return in_turn(
        **found,
        **{
            name: lambda exo=exo, own=own: asked(exo, None, MOTION, PUSH, brief=True, **own)
            for name, (exo, own) in more.items()
        },
    )


def soft_cables():
    """More drives than freedoms on springs, within limits that change where it comes to rest."""
    exo = device("six-cables", interfaces=FACES)
    return asked(exo, exo.pose([20.0], [30.0], [5.0]), load=PUSH, brief=True, split="elastic", limits=(12.0, 60.0))


def maps():
    """Maps of many poses, which say the same in closed form."""
    grid = np.meshgrid([0.0, 30.0, 75.0, 120.0], [-20.0, 20.0, 70.0], indexing="ij")
    cables, muscles, wrist = (
        ep.load("four-cables").worn_by(MAN),
        ep.load("prototype"),
        exo_of(random_mechanism(np.random.default_rng(73), 3)),
    )
    quick = ep.Motion([2.5, -1.4, 0.9], [2.0, 1.0, -3.0])
    told = {
        "cables": (cables, {"load": PUSH}), "moving": (ep.load("four-linear-actuators"), {"motion": quick}),
        "muscles": (muscles, {}), "minimal": (wrist, {"split": "minimal", "constraint_bounds": (-9.0, 14.0),
        "load": PUSH}),
        "free": (wrist, {"split": "minimal", "limits": "pull"}), "alone": (wrist,
        {"split": "standalone", "motion": quick}), "range": (cables, {"limits": (-20.0, 60.0)}),
        "some": (cables, {"keep": ["shoulder_force", "margin"], "chunk": 5, "threads": 2}),
        "offset": (wrist, {"centre_offset": OFFSET, "load": PUSH}), "actuator": (wrist,
        {"split": "minimal", "constraint_bounds": "actuator"}), "chain": (device("serial-y-x-z"), {"load": PUSH}),
        "keep": (cables, {"keep": ["force"]}), "threads": (cables, {"threads": 0}), "chunk": (cables, {"chunk": 0}),
        "cone": (cables, {"cone": following()}), "weights": (cables, {"weights": ep.Weights(tension=1.0)}),
    }  # fmt: skip
    return in_turn(
        **{name: lambda exo=exo, own=own: exo.reaction_map(exo.pose(*grid), **own) for name, (exo, own) in told.items()}
    )


def movements():
    """Histories along a movement, rough at its ends, with doubts of the record."""
    rng, exo = np.random.default_rng(5), ep.load("four-cables").worn_by(MAN)
    times, ends = np.array([0.0, 0.1, 0.25, 0.3, 0.5, 0.6]), np.array([True, False, False, False, False, True])
    poses = exo.pose([20.0, 40.0, 60.0, 90.0, 95.0, 100.0], [30.0, 35.0, 40.0, 30.0, 20.0, 10.0])
    root = rng.normal(size=(6, 3, 3)) * 1e-5
    rough = ep.Movement(
        times,
        poses,
        ep.Motion(*rng.normal(size=(2, 6, 3))),
        MeasurementNoise("gcv", 0.01, 0.02, 5.0, root @ np.swapaxes(root, 1, 2), ends),
    )
    one = exo.follow(rough, load=PUSH)
    bare = ep.load("prototype").follow(rough, static=True, limits="none")
    told = [(each, each.summary(), str(each).splitlines(), list(each.columns().items())) for each in (one, bare)]
    return told, in_turn(
        split=lambda: str(exo.follow(rough, split="minimal", constraint_bounds=9.0)),
        lost=lambda: str(ep.load("prototype").follow(rough, load=PUSH)),
    )


def remedies():
    """The nearest pose that can be held, what the range of postures asks, and several answers in one table."""
    exo, muscles = ep.load("four-cables"), ep.load("prototype")
    heavy = ep.Load([0.0, 0.0, -60.0], at=[0.0, 0.0, -0.3])
    pose = exo.pose(80.0, 60.0)
    both = [
        exo.reaction(exo.pose(40.0, 30.0), load=PUSH, split=split)
        for split in ("spherical", "minimal", "standalone")[:2]
    ]
    stack = [exo.worn_by(MAN).reaction(poses_of(exo), split=split) for split in ("spherical", "minimal")]
    return {
        "nearest": exo.remedy(pose, heavy),
        "weak": str(exo.remedy(exo.pose(45), ep.Load([0.0, 0.0, 0.0], [4000.0, 0.0, 0.0]))),
        "held": exo.remedy(exo.pose(45.0)), "muscles": muscles.remedy(muscles.pose(60.0, 20.0)),
        "range": posture_range(device("nesm"), ep.Case(device("nesm").pose(30.0, 20.0), load=PUSH)),
        "wrist": posture_range(exo, ep.Case(pose), Assumptions(limits="none")),
        "table": reaction_table(both).splitlines(), "stack": reaction_table(stack).splitlines(),
        "page": both[1]._repr_html_(), "data": both[0].as_dict(), "closest": exo.reaction(poses_of(exo),
        load=heavy).closest,
    }  # fmt: skip


def cones():
    """Sockets that hang and follow, both sides, and what is refused of them."""
    turn = glenoid_orientation(35, 5, -10, retroversion=5, inclination=8, degrees=True)
    several = [
        hanging(0.5, 0.4, faces=8),
        following(superior=0.3, approximation="outer", muscle_compression=30.0),
        ep.GlenoidCone(penalty=3.0, orientation=turn, elevation=None),
    ]
    poses = poses_of(ep.load("prototype"))
    told = [
        (cone, [cone.axes(side, poses) for side in ("left", "right")], cone.half_spaces("left", poses[0]))
        for cone in several
    ]
    cone, ask = ep.GlenoidCone, ep.load("prototype").reaction
    return told, turn, glenoid_orientation([35, 40], [0, 3], 1.0, retroversion=4, inclination=3, degrees=True), in_turn(
        superior=lambda: cone(0.0), anterior=lambda: cone(anterior=-1.0), faces=lambda: cone(faces=2),
        outer=lambda: cone(approximation="near"), compression=lambda: cone(muscle_compression=-1.0),
        penalty=lambda: cone(penalty=0.0),
        count=lambda: cone(orientation=turn, elevation=[0.0, 1.0]),
        rises=lambda: cone(orientation=glenoid_orientation([35, 40], 0, 0, retroversion=4, inclination=3,
        degrees=True), elevation=[1.0, 0.0]), none=lambda: cone().axes("left", poses),
        shear=lambda: ep.Weights(2.0, 1.0), tension=lambda: ep.Weights(tension=-1.0),
        glenoid=lambda: ep.Weights(glenoid=3),
        laws=lambda: [
            (own.name, own.assumption, sorted(own.options), own.chooses_tensions, own.refusals)
            for own in map(type(ep.reaction.SPLITS["elastic"]), ("held", "locked"))
        ],
        split=lambda: ask(poses, split="best"), kind=lambda: ask(poses, split=type(ep.reaction.SPLITS["minimal"])),
        bounds=lambda: ask(poses, constraint_bounds=9.0), cone=lambda: ask(poses, split="standalone", cone=cone()),
        weights=lambda: ask(poses, weights=3),
        crossed=lambda: ask(poses, split="minimal", constraint_bounds=([1.0, -1.0, 2.0], [0.0, 0.0, 0.0])),
        word=lambda: ask(poses, split="minimal", constraint_bounds="drive"),
        nan=lambda: ask(poses, split="minimal", constraint_bounds=(np.nan, 1.0)),
        large=lambda: ask(poses, split="minimal", constraint_bounds=1e30),
        above=lambda: ask(poses, split="minimal", constraint_bounds=(np.inf, np.inf)),
        shape=lambda: ask(poses, split="minimal", constraint_bounds=([1.0, 2.0], 3.0)),
        limits=lambda: ask(poses, limits="some"), nothing=lambda: ask(poses, limits=None),
        three=lambda: ask(poses, limits=(1, 2, 3)),
        fewer=lambda: ask(poses, limits=[Muscle()] * 2), lower=lambda: ask(poses, limits=(3.0, 2.0)),
        empty=lambda: reaction_table([]), index=lambda: ask(poses).cuff_text((7,)),
        convex=lambda: ep.load("four-cables").reaction(poses, split="minimal", limits="none",
        constraint_bounds="actuator"),
        locked=lambda: ep.load("six-cables").reaction(poses, split="elastic_locked"),
        device=lambda: device("serial-y-x-z").reaction(poses, split="elastic"),
        unknown=lambda: ep.load("prototype").replace(arm=None).reaction(poses, MOTION),
    )  # fmt: skip


ASKED = {
    each.__name__: each
    for each in (of_presets, of_splits, elastic, of_chains, soft_cables, maps, movements, remedies, cones)
}

#: Those that take longer than 0.15 s.
LONGER = {"of_splits", "of_chains", "soft_cables", "elastic", "movements", "remedies"}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
