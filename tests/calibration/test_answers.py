"""Answers of calibrations, as they are stored: what is found, how surely, what contradicts it, which poses to take."""

import warnings

import numpy as np
from answers import changes, each_of
from asked_in_turn import in_turn, tried
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.calibration import Information, pose_information, suggest_poses

NOMINAL = ep.load("prototype")
WORN = ep.load("four-linear-actuators-worn")
NOISE = 3e-4
FIXED = {"arm_mounting": Rotation.identity()}
RINGS = ("length_offsets", "cuff_offset", "arm_mounting")


def waves(shape, pace, size=1.0):
    """Numbers that look like noise."""
    count = np.arange(float(np.prod(shape)))
    return size * np.sqrt(2.0) * np.sin(pace * count + count**1.5).reshape(shape)


#: Middle and reach of clinical angles, deg, and how they change from pose to pose.
BOX = ((55.0, 55.0, 1.7), (46.0, 50.0, 2.3), (32.0, 52.0, 3.1))


def poses(count, reach=1.0):
    """From all over the box of daily life, or from the middle of it."""
    k = np.arange(count)
    return ep.shoulder_rotation(
        *(middle + reach * part * np.sin(pace * k + place) for place, (middle, part, pace) in enumerate(BOX)),
        degrees=True,
    )


def measured(
    exo=NOMINAL,
    count=24,
    noise=NOISE,
    joints=0.003,
    offsets=0.0,
    cuff=(0.0, 0.0, 0.0),
    turn=(0.0, 0.0, 0.0),
    scale=1.0,
    reach=1.0,
):
    """Orientations and lengths of a device that is a little other than its design."""
    geometry, arm = exo.geometry, poses(count, reach)
    base = geometry.base_points + waves((geometry.limb_count, 3), 0.7, joints)
    platform = geometry.platform_points + waves((geometry.limb_count, 3), 1.9, joints) + cuff
    ends = np.stack([arm.apply(point) for point in platform], axis=1)
    lengths = np.linalg.norm(ends - base, axis=2) / scale - offsets * (1.0 + np.arange(geometry.limb_count))
    return arm * Rotation.from_rotvec(turn).inv(), lengths + waves(lengths.shape, 0.3, noise)


def told(found):
    """What a calibration says, in words and numbers."""
    return {
        "says": str(found).splitlines(),
        "shown": repr(found),
        "values": found.values,
        "deviations": found.standard_deviations,
        "joints": found.joint_deviations,
        "interval": found.interval(0.9)[:2],
        "covariance": 1e6 * found.covariance[:2, :3],
        "residuals": 1e3 * found.residuals[:3],
        "normalised": found.normalised_residuals[:2],
        "sizes": (
            found.length_noise,
            found.degrees_of_freedom,
            found.probability,
            found.distance,
            found.estimate.scale,
        ),
        "known": [(each.name, each.effects, each.shows, each.is_stated) for each in found.known],
        "judged": (found.is_decided, found.contradiction, found.outliers, found.device_count),
        "devices": [(device.distance, repr(device)) for device in found.devices[:3]],
        "offset": (found.centre_offset.base, found.centre_offset.cuff, found.length_offsets),
        "mountings": (found.torso_mounting.as_rotvec(), found.arm_mounting.as_rotvec()),
        "singular": found.information.singular_values,
        "information": str(found.information).splitlines(),
    }


def asked_of_joints():
    return told(ep.calibrate(*measured(), NOMINAL, length_noise=NOISE))


def asked_of_unstated_noise():
    cables = ep.load("four-cables").worn_by(ep.Wearer(1.755, 85.0, "male"))
    return told(ep.calibrate(*measured(cables, 30), cables, unknowns=["platform_points", "base_offset"]))


def asked_of_rings():
    data = measured(WORN, 30, joints=0.0, offsets=0.01, cuff=(0.004, -0.006, 0.01), turn=(0.1, -0.05, 0.2))
    return told(ep.calibrate(*data, WORN, unknowns=RINGS, length_noise=NOISE, **FIXED))


def asked_of_searched_mountings():
    turn = Rotation.from_euler("XYZ", [90.0, 5.0, -3.0], degrees=True).as_rotvec()
    data = measured(WORN, 26, joints=0.0, turn=turn)
    return told(ep.calibrate(*data, WORN, unknowns=("arm_mounting",), length_noise=NOISE))


def asked_of_tolerances():
    found = ep.calibrate(
        *measured(WORN, 28, scale=1.002),
        WORN,
        unknowns=("base_points", "length_scale"),
        length_noise=NOISE,
        orientation_noise=1e-3,
        tolerances={"base_points": 0.01, "cuff_offset": 0.004, "torso_mounting": 0.02},
    )
    return told(found)


def judged(found):
    """What is said of a calibration as a whole."""
    return found.verdict, found.contradiction, found.outliers, found.is_decided, found.device_count


def spoilt(limb=None, pose=None, size=0.0, noise=NOISE, count=24, stated=NOISE, below=None, square=0.0, **options):
    """What is said of lengths of which some are wrong."""
    seen, lengths = measured(count=count, noise=noise, joints=0.0)
    if pose is not None:
        lengths[pose, limb] += size
    elif below is not None:
        lengths[:, limb] = np.maximum(lengths[:, limb], np.quantile(lengths[:, limb], below))
    elif limb is not None:
        lengths[:, limb] += waves(count, 0.9, size)
    lengths = lengths + square * (lengths - lengths.mean(axis=0)) ** 2
    return judged(ep.calibrate(seen, lengths, NOMINAL, unknowns=("base_points",), length_noise=stated, **options))


def asked_of_contradictions():
    return in_turn(
        outlier=lambda: spoilt(1, 7, 0.01),
        limb=lambda: spoilt(2, size=0.004),
        unstated=lambda: spoilt(noise=6e-4, stated=None),
        unstated_outlier=lambda: spoilt(0, 3, -0.01, stated=None),
        slack=lambda: spoilt(0, below=0.3, stated=None),
        curved=lambda: spoilt(square=0.3, stated=None, noise=1e-4),
        sides=lambda: [
            [spoilt(**{name: size}, **others)[1] for size in sizes]
            for name, sizes, others in (
                ("square", (0.0597, 0.0609), {}),
                ("noise", (4.02e-4, 4.10e-4), {}),
                ("size", (0.00218, 0.00223, 0.00228), {"limb": 1, "pose": 7}),
                ("size", (0.00110, 0.00113), {"limb": 2}),
                ("size", (-0.00620, -0.00631), {"limb": 0, "pose": 3, "stated": None}),
            )
        ],
        exact=lambda: spoilt(noise=0.0, stated=None)[1:],
        few=lambda: spoilt(count=4),
        far=lambda: judged(ep.calibrate(*measured(joints=0.0, cuff=(0.0, 0.0, 0.21)), NOMINAL, unknowns="cuff_offset")),
        near=lambda: judged(
            ep.calibrate(*measured(joints=0.0, cuff=(0.0, 0.0, 0.19)), NOMINAL, unknowns="cuff_offset")
        ),
    )


def asked_of_large_errors():
    """Joints so far from the design that another device is nearly as near, and poses of large errors."""
    twins = ep.calibrate(*measured(count=14, joints=0.1), NOMINAL, unknowns="platform_points", length_noise=NOISE)
    turned = {"length_noise": NOISE, "orientation_noise": 0.05}
    rough = ep.calibrate(*measured(count=14, joints=0.02), NOMINAL, unknowns="base_points", **turned)
    return judged(twins), [one.distance for one in twins.devices], rough.values, rough.standard_deviations


def asked_of_few_poses():
    found = ep.calibrate(*measured(count=5), NOMINAL, unknowns=("base_points", "base_offset"), length_noise=NOISE)
    near = " ".join(f"{1e3 * value:.1f}" for value in found.values)
    single = [
        ep.calibrate(*measured(exo, 1, joints=0.0), exo, unknowns="cuff_offset", length_noise=NOISE)
        for exo in (NOMINAL, WORN)
    ]
    left = [(one.degrees_of_freedom, one.probability) for one in single]
    # Of one freedom, Student's t is wide.
    left.append(ep.calibrate(*measured(WORN, 1, joints=0.0), WORN, unknowns="cuff_offset").interval(0.9))
    return str(found).splitlines()[0], near, len(found.undetermined), found.information.rank, found.probability, left


def asked_of_fewer_lengths_than_unknowns():
    """What poses that determine little say of themselves, and a calibration of as few."""
    told = pose_information(poses(3), NOMINAL, length_noise=NOISE)
    words = []
    for count in (3, 4):
        found = ep.calibrate(
            *measured(count=count), NOMINAL, unknowns=("base_points", "base_offset"), length_noise=NOISE
        )
        words += [line for line in str(found).splitlines() if "unknowns" in line or "measure" in line.lower()]
    return str(told).splitlines()[0], len(str(told).splitlines()), words


def quaternions(seen):
    w_first = seen.as_quat()[:, [3, 0, 1, 2]]
    return Rotation.from_quat(w_first)


def euler(seen, order, places, signs=(1.0, 1.0, 1.0), factor=1.0, read="YXZ"):
    return Rotation.from_euler(read, factor * seen.as_euler(order)[:, places] * signs)


MIXED = {
    "none": lambda seen, lengths: (seen, lengths),
    "limbs": lambda seen, lengths: (seen, lengths[:, [1, 0, 2]]),
    "late": lambda seen, lengths: (seen[1:], lengths[:-1]),
    "early": lambda seen, lengths: (seen[:-1], lengths[1:]),
    "quaternions": lambda seen, lengths: (quaternions(seen), lengths),
    "radians": lambda seen, lengths: (euler(seen, "YXZ", [0, 1, 2], factor=np.pi / 180.0), lengths),
    "swapped": lambda seen, lengths: (euler(seen, "YXZ", [1, 0, 2], (-1.0, -1.0, 1.0)), lengths),
    "swapped_right": lambda seen, lengths: (euler(seen, "YXZ", [1, 0, 2]), lengths),
    "few": lambda seen, lengths: (seen[1:11], lengths[:10]),
    "hardly": lambda seen, lengths: (seen[1:12], lengths[:11]),
    "inverted": lambda seen, lengths: (seen.inv(), lengths),
    "side": lambda seen, lengths: (Rotation.from_quat(seen.as_quat() * [-1.0, 1.0, -1.0, 1.0]), lengths),
    "thesis": lambda seen, lengths: (euler(seen, "YXZ", [1, 0, 2], read="XYZ"), lengths),
    "clinical": lambda seen, lengths: (euler(seen, "XYZ", [1, 0, 2]), lengths),
    "constant": lambda seen, lengths: (seen, lengths + np.array([0.0, 0.041, -0.05])),
    "less": lambda seen, lengths: (seen, lengths + np.array([0.0, 0.039, 0.0])),
    "spread": lambda seen, lengths: (seen, lengths + np.array([0.0, 0.06, 0.0]) + waves(lengths.shape, 0.9, 0.0065)),
}


def mixed(change, noise=1e-3, reach=0.6, unknowns=("base_points",)):
    data = measured(noise=noise, joints=0.0, reach=reach)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        found = ep.calibrate(*change(*data), NOMINAL, unknowns=unknowns, length_noise=1e-3)
    for each in said:
        warnings.warn(each.message, stacklevel=1)
    return len(found.lengths), len(said)


def asked_of_mix_ups():
    # Of a small movement, lengths of another pose still look right.
    small = {f"late_{reach}": lambda reach=reach: mixed(MIXED["late"], 0.0, reach) for reach in (0.045, 0.055)}
    mounted = {"mounted": lambda: mixed(MIXED["limbs"], unknowns=("arm_mounting",))}
    return in_turn({name: lambda change=change: mixed(change) for name, change in MIXED.items()}, **small, **mounted)


def asked_of_lengths():
    seen, lengths = measured(count=12)

    def calibrated(given=lengths, arm=seen, exo=NOMINAL, **options):
        return len(ep.calibrate(arm, given, exo, **{"unknowns": ("base_points",)} | options).devices)

    one = np.where(np.arange(3) == 1, 1000.0, 1.0)
    return in_turn(
        units=lambda: tried(
            lambda factor: calibrated(factor * lengths), 1000.0, 100.0, 1.0 / 0.0254, 1e-3, 1.0 / 25.4, 0.1, 20.0, 0.5
        ),
        limits=lambda: tried(lambda factor: calibrated(factor * lengths), 0.63, 1.57, 610.0, 1590.0),
        one=lambda: calibrated(one * lengths),
        changes=lambda: calibrated(1000.0 * lengths, unknowns=("length_offsets",)),
        negative=lambda: calibrated(lengths - [0.0, 0.25, 0.0]),
        below=lambda: calibrated(np.where(np.arange(12)[:, None] == 3, -lengths, lengths)),
        longest=lambda: calibrated(np.where(np.arange(12)[:, None] == 3, 5.1, lengths)),
        shape=lambda: calibrated(lengths[:, :2]),
        rows=lambda: calibrated(lengths[:-1]),
        single=lambda: calibrated(lengths[0], seen[0]),
        none=lambda: calibrated(lengths[:0], seen[:0]),
        grid=lambda: calibrated(lengths.reshape(3, 4, 3), Rotation.from_quat(seen.as_quat().reshape(3, 4, 4))),
        unknowns=lambda: tried(lambda names: calibrated(unknowns=names), (), 3, "base", ["base_points", "length"]),
        noise=lambda: tried(lambda size: calibrated(length_noise=size), 0.1, 0.11, 0.0),
        turn=lambda: tried(lambda size: calibrated(length_noise=NOISE, orientation_noise=size), -0.1, 1.1),
        alone=lambda: calibrated(orientation_noise=0.01),
        tolerance=lambda: calibrated(tolerances={"base_points": 0.01}),
        wrong_tolerance=lambda: calibrated(tolerances={"base": 0.01}, length_noise=NOISE),
        no_tolerance=lambda: calibrated(tolerances={"base_points": 0.0}, length_noise=NOISE),
        tolerances=lambda: calibrated(tolerances=3, length_noise=NOISE),
        mounting=lambda: calibrated(arm_mounting=seen),
        nominal=lambda: calibrated(exo="prototype"),
        too_few=lambda: calibrated(lengths[:3], seen[:3]),
        probability=lambda: tried(ep.calibrate(seen, lengths, NOMINAL, unknowns="base_points").interval, 0.0, 1.0),
    )


OFFSETS = {"unknowns": ("base_offset", "length_offsets")}


def partly_known():
    """Spread of what one pose determines, together with more and more of what it does not."""
    told = pose_information(poses(1), WORN, unknowns="base_points", length_noise=NOISE)
    apart = poses(1).as_matrix()[0] @ WORN.geometry.platform_points.T - WORN.geometry.base_points.T
    along = apart[:, 1] / np.linalg.norm(apart[:, 1])
    across = np.cross(along, [0.6, 0.0, 0.8])
    rows = np.zeros((6, 4, 3))
    rows[:, 1] = along + np.outer([0.0, 0.9e-6, 1.1e-6, 1.0, 0.0, 0.0], across)
    rows[4, 0], rows[5, 2] = along, apart[:, 2]
    return 1e6 * told.spread(rows.reshape(6, -1))


def exactly_known(count, variance):
    """What lengths say whose errors have a variance, beside tolerances of another size."""
    options = {"unknowns": ("base_offset", "cuff_offset"), "tolerances": {"length_offsets": 0.003}}
    told = pose_information(poses(count), NOMINAL, length_noise=1.0, **options)
    jacobian = told.model.evaluate(told.values, told.measured).by_unknowns.reshape(-1, told.model.size)
    found = Information(told.model, told.values, told.measured, jacobian, variance, told.prior)
    return found.standard_deviations, found.rank, str(found).splitlines()


def asked_of_pose_choice():
    def chosen(count, exo=NOMINAL, **options):
        return suggest_poses(exo, count, poses(30), **{"length_noise": NOISE} | options)

    def informed(count, **options):
        found = pose_information(poses(count), WORN, length_noise=NOISE, **options)
        lost = [size for size in (each.standard_deviation for each in found.undetermined) if np.isfinite(size)]
        return (
            found.singular_values,
            found.rank,
            found.variance,
            len(found.undetermined),
            len(lost),
            str(found).splitlines()[0],
        )

    return in_turn(
        twelve=lambda: chosen(12),
        four=lambda: chosen(4, WORN, unknowns=("base_offset", "cuff_offset"), orientation_noise=2e-3),
        tolerant=lambda: chosen(3, tolerances={"base_points": 0.002}),
        mounted=lambda: chosen(3, unknowns=("base_offset", "arm_mounting", "length_scale")),
        all=lambda: chosen(30),
        too_many=lambda: chosen(31),
        none=lambda: chosen(0),
        no_noise=lambda: chosen(3, length_noise=0.0),
        no_turn=lambda: chosen(3, orientation_noise=-1.0),
        no_device=lambda: chosen(3, "prototype"),
        many=lambda: informed(40),
        few=lambda: informed(4, unknowns="base_points"),
        turned=lambda: informed(20, unknowns=("base_offset", "torso_mounting"), orientation_noise=3e-3),
        scaled=lambda: informed(20, unknowns=("length_scale", "length_offsets"), tolerances={"base_points": 0.01}),
        spread=lambda: (
            1e6 * pose_information(poses(20), WORN, unknowns="cuff_offset", length_noise=NOISE).spread(np.eye(3)[:2])
        ),
        rows=lambda: pose_information(poses(20), WORN, unknowns="cuff_offset", length_noise=NOISE).spread(np.eye(2)),
        lost=lambda: [
            str(pose_information(poses(*seen), exo, unknowns=asked, length_noise=NOISE)).splitlines()
            for *seen, exo, asked in (
                (2, WORN, ("base_offset", "cuff_offset", "length_offsets")),
                (3, NOMINAL, ("base_offset", "torso_mounting", "length_scale", "length_offsets")),
                (5, 0.01, NOMINAL, ("arm_mounting", "base_offset")),
                (2, 0.3, NOMINAL, ("arm_mounting", "cuff_offset")),
                (1, 0.01, WORN, ("base_offset", "arm_mounting")),
            )
        ],
        certain=lambda: [
            len(pose_information(poses(5, 0.01), WORN, length_noise=NOISE * 1.15**k, **OFFSETS).undetermined)
            for k in range(-12, 8)
        ],
        partly=partly_known,
        exact=lambda: [exactly_known(*each) for each in ((2, 0.0), (4, 0.0), (2, 1e-4))],
        no_nominal=lambda: pose_information(poses(3), 3, length_noise=NOISE),
    )


ASKED = {
    "joints": asked_of_joints,
    "unstated_noise": asked_of_unstated_noise,
    "rings": asked_of_rings,
    "searched": asked_of_searched_mountings,
    "tolerances": asked_of_tolerances,
    "contradictions": asked_of_contradictions,
    "large_errors": asked_of_large_errors,
    "few_poses": asked_of_few_poses,
    "fewer_lengths": asked_of_fewer_lengths_than_unknowns,
    "mix_ups": asked_of_mix_ups,
    "lengths": asked_of_lengths,
    "pose_choice": asked_of_pose_choice,
}
#: Those that take longer than 0.15 s.
LONGER = set(ASKED) - {"pose_choice", "large_errors"}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
