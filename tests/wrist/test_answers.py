"""Answers of wrists: of their kinematics, singularities, clearances, sensors and forces off centre, as stored."""

import numpy as np
from answers import changes, each_of
from asked_in_turn import refused
from wrists import heavy_limbs, random_mechanism, regular_poses

import exo_pin as ep
from exo_pin import wrist
from exo_pin.load_case import RangeOfMotion

MAN = ep.Wearer(1.755, 85, "male", elbow_flexion=0.6, payload=0.5)
WOMAN = ep.Wearer(1.60, 55, "female", clothing=0.004)
KINDS = ["UPU", "SPS", "UPU", "SPS", "UPU"]


def design(seed, limbs=3, kinds=KINDS):
    """A wrist whose joints lie anywhere, and three poses of it."""
    rng = np.random.default_rng(seed)
    found = random_mechanism(rng, limbs, kinds[:limbs])
    return found, regular_poses(found, rng, 3, margin=0.1)


def folded():
    """A wrist of three limbs in poses where one is folded, stretched or without length, near and beyond such a pose."""
    geometry = wrist_of([0.1, 0.0, 0.02], [0.02, 0.12, 0.03], [-0.05, -0.1, 0.06])
    turns = [0.0, 1e-12, 1e-7, 1e-4, 0.3, np.pi, 2.0]
    return geometry, ep.shoulder_rotation(0.0, np.array(turns), 0.1 * np.array(turns))


def wrist_of(*base):
    return ep.WristGeometry(
        np.array(base), np.array(base) * [[0.8], [1.0], [1.3]], neutral=ep.thesis_rotation(0.3, 0.2, -0.4)
    )


def rows(found):
    """Fields of a record that are data."""
    return {name: value for name, value in vars(found).items() if not name.startswith("_")}


def inverse():
    found, (limbs, bent) = [], folded()
    # Where a limb is folded exactly, the angles of its joints are nobody's.
    for geometry, poses in (
        (limbs, bent[1:]),
        *((each.geometry, poses) for each, poses in (design(4), design(5, 5))),
    ):
        jacobians = wrist.joint_jacobians(geometry, poses)
        found.append(
            [rows(wrist.inverse_kinematics(geometry, poses)), rows(jacobians), wrist.limb_jacobian(geometry, poses)]
        )
    directions = [[0.1, 0.2, -0.9], [0.0, -1.0, 0.0], [0.0, 0.3, 0.0], [-0.4, 0.0, -0.2]]
    return found, wrist.universal_angles(np.array(directions) / np.linalg.norm(directions, axis=1)[:, None])


def singular():
    geometry, poses = folded()
    held, other = design(6), design(7, 4)
    near = ep.load("prototype")
    close = near.pose(abduction=[6.0, 6.2, 6.20706, 6.25, 7.0])
    return [
        rows(wrist.singularity(geometry, poses[3:5])), wrist.singularity(geometry, poses).kind,
        rows(wrist.singularity(held[0].geometry, held[1], held[0].is_upu)), rows(wrist.singularity(*_of(held))),
        rows(wrist.singularity(other[0].geometry, other[1], other[0].is_upu)),
        wrist.singularity(near.geometry, close).kind, wrist.singularity(near.geometry, close).determinant[[0, 1, 3, 4]],
        [wrist.centre_shift(normals) for normals in (np.eye(3)[:2], [*np.eye(3), [0.6, 0.8, 0.0]], np.ones((3, 3)))],
        [rows(wrist.nearest_singularity(*_of(each))) for each in (held, design(8))],
        [rows(each) for each in wrist.daily_crossings(
            held[0].geometry, [RangeOfMotion("near", (0.0, 50.0), (10.0, 70.0), (-20.0, 40.0))], 10.0, "right",
            start=held[1][1])],
    ]  # fmt: skip


def _of(pair):
    return pair[0].geometry, pair[1]


def modes(found):
    """Poses that fit, without the digits of their residuals."""
    near = () if found.nearest is None else (found.nearest, found.ambiguous)
    fits = np.round(found.residual, 8) + 0.0
    return found.status, found.count, found.side, found.margin, found.rotations.as_rotvec(), fits, found.meets, *near


def forward():
    """From lengths and from one or both angles a limb; with rows that are unreachable or no numbers."""
    found = []
    for seed, limbs in ((9, 3), (10, 4)):
        made, poses = design(seed, limbs)
        state, geometry = wrist.inverse_kinematics(made.geometry, poses), made.geometry
        lengths = np.concatenate([state.lengths, [state.lengths[0] * 3.0, np.full(limbs, np.nan), -state.lengths[1]]])
        x, y = state.base_theta_x, state.base_theta_y
        found += [
            modes(wrist.forward_kinematics(geometry, lengths)),
            modes(wrist.forward_kinematics(geometry, lengths[:3] + 1e-4, near=poses, tolerance=1e-3)),
            modes(wrist.forward_kinematics_from_base_angles(geometry, theta_x=x, near=poses)),
            modes(wrist.forward_kinematics_from_base_angles(geometry, theta_y=y)),
            modes(wrist.forward_kinematics_from_base_angles(geometry, x + 0.01, y - 0.02, near=poses[1])),
        ]
    near = ep.load("prototype")
    way = near.pose(abduction=np.linspace(3.0, 9.0, 7), flexion=2.0)
    lengths = near.inverse_kinematics(way).lengths
    lost = np.where(np.arange(7)[:, None] == 3, 9.0, lengths)
    paths = [near.forward_kinematics(each).follow(way[0]) for each in (lengths, lost)]
    return found, [(path.rotations.as_rotvec(), path.index, path.ambiguous) for path in paths]


def tolerances():
    """How many poses fit as one length or angle of too many is more and more off."""
    made, poses = design(10, 4)
    state, exo = wrist.inverse_kinematics(made.geometry, poses[0]), ep.ShoulderExo.from_mechanism(made)
    off = 1e-9 * 1.12 ** np.arange(-10.0, 16.0)[:, None] * [1.0, 0.0, 0.0, 0.0]
    lengths, angles = state.lengths + off, state.base_theta_x + off
    return [
        wrist.forward_kinematics(made.geometry, lengths).count, exo.forward_kinematics(lengths).count,
        wrist.forward_kinematics_from_base_angles(made.geometry, angles).count,
        exo.forward_kinematics_from_base_angles(angles).count,
    ]  # fmt: skip


def clear():
    """Gaps to a body in two postures and to what stands about it, of limbs that share a fitting."""
    body = wrist.BodyShape.of((MAN, WOMAN), "right", (0.2, 0.9), ("chair", "wall:120"))
    bare = wrist.BodyShape(
        np.array([[0.1, 0.2, 0.0, 0.1, 0.2, 0.0, 0.03]]), np.array([[0.0, 0.0, 0.0, 0.0, 0.0, -0.3, 0.05]])
    )
    base = np.array([[0.1, 0.1, 0.2], [0.1, 0.11, 0.2], [0.3, -0.1, -0.2], [0.3, -0.1, -0.2]])
    ends = np.array([[0.1, 0.0, -0.1], [0.0, 0.1, -0.12], [0.08, 0.02, -0.2], [0.08, 0.03, -0.21]])
    turns = ep.shoulder_rotation([0.2, 1.1, 1.7], [0.3, 0.9, 0.1], [0.1, -0.4, 0.6]).as_matrix()
    radii, off = np.array([0.01, 0.012, 0.003, 0.02]), (np.full((1, 3), 0.01), np.array([[0.0, -0.02, 0.005]]))
    exos = [ep.load("four-linear-actuators-worn").worn_by(each) for each in (MAN, ep.Wearer(1.3, 80, "female"))]
    answers = [
        exo.reaction(exo.pose(*at))
        for exo in exos
        for at in ((5.0, 170.0), (70.0, 140.0, 40.0), ([5.0, 70.0, 5.0], [0.0, 140.0, 170.0]))
    ]
    words = [
        (each.clearance, each.verdict if each.margin.ndim == 0 else str(each).split("\n\n")[0]) for each in answers
    ]
    return [
        wrist.BodyShape.of(WOMAN), body.arm[:5], body.torso[[0, 4, 8, -1]],
        wrist.clearances(turns, base, ends, radii, body), wrist.clearances(turns, base, ends, radii, bare, off), words,
    ]  # fmt: skip


def sensed():
    turn = ep.thesis_rotation
    torso = turn([0.1, 0.3, -0.2], [0.0, 0.2, 0.1], [0.5, 0.1, -0.4])
    arm = torso * turn([0.5, 0.52, 0.48], 0.3, [-0.1, -0.12, -0.1])
    chain = wrist.OrientationChain.calibrated(arm, torso, turn(0.1, 0.2, 0.3), turn(-0.2, 0.0, 0.4))
    return chain.arm_mount, chain.torso_mount, chain.spread, chain.orientation(arm, torso[1]).as_rotvec()


def answered(answer):
    """Status and columns of a reaction, with numbers that are no more than rounding as zero."""
    found = {name: np.asarray(value) for name, value in answer.columns().items()}
    return {name: np.round(each, 9) + 0.0 if each.dtype.kind == "f" else each for name, each in found.items()}


def guided(made):
    """The same wrist with guides that bend and twist."""
    guide = ep.LimbGuide(60.0, 50.0, 400.0, 300.0)
    return made.replace(limbs=[ep.Limb(limb.kind, guide=guide if limb.kind == "UPU" else None) for limb in made.limbs])


def forces():
    """Off centre, with heavy limbs in motion, soft interfaces and guides that bend, by every split that applies."""
    (four, poses), (three, others) = design(11, 4), design(13)
    heavy = heavy_limbs(four, np.random.default_rng(20))
    soft = ep.Interfaces(ep.Interface.of(3e4, 500.0, [0, 0.05, 0]), ep.Interface.upper_arm_cuff(0.2, 4.0))
    off = ep.CentreOffset([0.006, -0.002, 0.003], [0.0, 0.004, -0.005])
    load = ep.Load([3.0, -2.0, 5.0], [0.1, 0.0, -0.2], at=[0.0, 0.02, -0.3])
    motion = ep.Motion(np.tile([0.7, -0.4, 1.1], (3, 1)), np.tile([2.0, 1.0, -3.0], (3, 1)))
    bending = three.replace(limbs=[ep.Limb("UPU", guide=ep.LimbGuide(5.0, 300.0))] * 3)
    asked = [
        (heavy, poses, {"motion": motion, "load": load}),
        (heavy, poses, {"split": "minimal", "motion": motion}),
        (four, poses, {"split": "minimal", "centre_offset": off, "load": load}),
        (four.replace(interfaces=soft), poses, {"split": "elastic", "centre_offset": off, "load": load}),
        (guided(four), poses, {"split": "elastic", "centre_offset": off}),
        (guided(three), others, {"split": "elastic_locked", "centre_offset": off}),
        (guided(three).replace(interfaces=soft), others, {"split": "elastic_locked", "load": load}),
        (three.replace(limbs=[ep.Limb("UPU")] * 3), others, {"split": "standalone", "load": load}),
        (four.replace(interfaces=soft), poses, {"split": "elastic", "load": load, "limits": (-25.0, 25.0)}),
        (
            three.replace(limbs=[ep.Limb("UPU", guide=ep.LimbGuide(0.1, 0.08))] * 3),
            others,
            {"split": "elastic", "centre_offset": off},
        ),
        (
            bending,
            others,
            {"split": "elastic", "centre_offset": ep.CentreOffset([0.03, 0.0, -0.03], [0.0, 0.03, 0.03])},
        ),
    ]
    return [
        answered(ep.ShoulderExo.from_mechanism(each).reaction(at, **{"limits": "none"} | question))
        for each, at, question in asked
    ]


def refusals():
    poses = folded()[1]
    four = design(7, 4)[0].geometry
    state = wrist.inverse_kinematics(four, poses)
    chain = wrist.OrientationChain
    return refused(
        lambda: wrist.nearest_singularity(four, poses),
        lambda: wrist.daily_crossings(four),
        lambda: wrist.daily_crossings(ep.load("prototype").geometry, start=ep.thesis_rotation(0, 0, 0)),
        lambda: wrist.singularity(four, poses, [True, False]),
        lambda: wrist.singularity(four, poses, [1, 1, 0, 1]),
        lambda: wrist.centre_shift([1.0, 2.0]),
        lambda: wrist.forward_kinematics(four, [0.1, 0.2, 0.3]),
        lambda: wrist.forward_kinematics(four, [0.1, 0.2, 0.3, -0.1]),
        lambda: wrist.forward_kinematics(four, "long"),
        lambda: wrist.forward_kinematics_from_base_angles(four),
        lambda: wrist.forward_kinematics_from_base_angles(four, np.zeros((2, 4)), np.zeros((3, 4))),
        lambda: wrist.forward_kinematics(four, state.lengths).nearest_rotations,
        lambda: wrist.forward_kinematics(four, 9.0 * state.lengths, near=poses[0]).nearest_rotations,
        lambda: wrist.forward_kinematics(four, state.lengths[0]).follow(poses[0]),
        lambda: wrist.forward_kinematics(four, state.lengths).follow(poses),
        lambda: wrist.BodyShape.of([]),
        lambda: wrist.BodyShape.of("a man"),
        lambda: wrist.BodyShape.of(MAN, elbow_range=(-0.4, 1.0)),
        lambda: wrist.BodyShape.of(MAN, elbow_range=(0.4, 2.9)),
        lambda: wrist.BodyShape(np.zeros((1, 7)), np.array([[0.0] * 6 + [-0.1]])),
        lambda: wrist.BodyShape.of((MAN, WOMAN)).require_fit([MAN, ep.Wearer(1.9, 90, "male")]),
        lambda: wrist.BodyShape.of(MAN).require_fit([ep.Wearer(1.78, 80, "male")]),
        lambda: wrist.clearances(
            np.eye(3)[None], np.zeros((2, 3)), np.zeros((2, 3)), np.zeros(3), wrist.BodyShape.of(MAN)
        ),
        lambda: chain(poses, poses[0]),
        lambda: chain.calibrated(poses[:0], poses[:0]),
        lambda: chain.calibrated(poses[:2], poses[:3]),
    )


ASKED = {
    "inverse": inverse,
    "singular": singular,
    "forward": forward,
    "tolerances": tolerances,
    "clear": clear,
    "sensed": sensed,
    "forces": forces,
    "refusals": refusals,
}


@each_of(ASKED)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
