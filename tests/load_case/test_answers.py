"""Answers of load cases and movements, as they are stored."""

import warnings

import foreign_records as foreign
import numpy as np
import planted_records as planted
from answers import changes, each_of
from asked_in_turn import in_turn
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.load_case import ADL_BOX, CentreOffset, CentrePath, Load, Motion, RangeOfMotion
from exo_pin.load_case.case import beyond_motion
from exo_pin.load_case.ranges_of_motion import DAILY_RANGES


def other_sides():
    """Movements that were made for no side, on the devices of both."""
    truth = foreign.movement(0, "right", planted.SIDEWAYS, rate=20)
    movement = ep.Movement.from_samples(truth.t, truth.poses, smoothing=None)
    backward = ep.Movement.from_samples(truth.t, truth.poses.inv(), smoothing=None)

    def cautions(own, side):
        return ep.load("four-linear-actuators", side=side).follow(own, static=True).cautions

    return {side: (cautions(movement, side), cautions(backward, side)) for side in ("left", "right")}


def samples(count=60, noise=0.0, seed=3, last=2.0, angles=(70.0, 25.0, 10.0)):
    """Times and poses of a raise with white noise, degrees."""
    t = np.linspace(0.0, last, count)
    s = (0.5 - 0.5 * np.cos(np.pi * t / t[-1])) + 0.05 * np.sin(5.0 * t / t[-1])
    jitter = noise * np.random.default_rng(seed).normal(size=(count, 3))
    return t, ep.shoulder_rotation(*(np.outer(s, angles) + jitter).T, degrees=True)


def smoothed():
    """Movements of samples with and without noise, and how they are smoothed."""
    from_samples = ep.Movement.from_samples
    t, poses = samples(noise=0.4)
    few, gap = np.r_[:11], np.r_[:20, 30:60]
    uneven = np.sort(t + np.random.default_rng(2).uniform(-0.01, 0.01, t.size))
    return in_turn(
        {
            "gcv": lambda: from_samples(t, poses),
            "stated": lambda: from_samples(t, poses, sensor_noise=0.01),
            "of a good sensor": lambda: from_samples(*samples(noise=1e-6), sensor_noise=np.radians(1e-6)).noise,
            "at rest": lambda: from_samples(*samples(), ends="rest"),
            "uneven": lambda: from_samples(uneven, poses, smoothing=None, ends="rest"),
            "with a gap": lambda: from_samples(t[gap], poses[gap]).noise,
            "of none": lambda: from_samples(*samples(), smoothing="gcv").noise,
            "interpolated": lambda: from_samples(*samples(25), smoothing=None),
            "of few": lambda: from_samples(t[few], samples()[1][few]),
            "of five": lambda: from_samples(*samples(5)).motion,
        }
    )


def doubted():
    """Cautions and errors of samples with gaps, rests, rounding, filters, and wrong clocks."""
    t, poses = samples(120, last=3.0)
    noisy = samples(120, 0.5, last=3.0)[1]

    def said(t, poses, **options):
        return ep.Movement.from_samples(t, poses, **options).cautions

    def held(*runs, poses=poses):
        rows = np.arange(len(poses))
        for first, after in runs:
            rows[first:after] = first
        return poses[rows]

    def without(first, after, t=t, poses=poses, **options):
        rows = np.r_[: first + 1, after : len(t)]
        return said(t[rows], poses[rows], **options)

    def filtered(width, rate=100.0, noise=0.5):
        time = np.arange(int(4 * rate)) / rate
        angles = np.outer(np.sin(0.4 * time), (60, 20, 5)) + noise * np.random.default_rng(1).normal(
            size=(len(time), 3)
        )
        kept = np.stack(
            [np.convolve(np.pad(own, width, "edge"), np.hanning(width + 2)[1:-1], "same") for own in angles.T]
        )
        kept = kept[:, width:-width] / np.hanning(width + 2).sum()
        return time, ep.shoulder_rotation(*kept, degrees=True)

    rounded = ep.shoulder_rotation(*ep.shoulder_angles(poses, degrees=True).round(0).T, degrees=True)
    finer = ep.shoulder_rotation(*ep.shoulder_angles(poses, degrees=True).round(1).T, degrees=True)
    far, farther = ([0, 60, 119, last, 250, 140, 30, 40, 50, 60, 70, 80, 90] for last in (238.5, 239.5))
    turned = [Rotation.from_rotvec(np.outer(np.radians(own), [0, 1, 0])) for own in (far, farther)]
    return in_turn(
        {
            "gap of 0.2 s": lambda: without(40, 48, smoothing=None),
            "gap of 0.3 s": lambda: without(40, 52, smoothing=None),
            "two gaps": lambda: said(*(own[np.r_[:20, 32:60, 75:120]] for own in (t, poses))),
            "gap of a slow record": lambda: without(20, 24, *samples(30, last=3.0), smoothing=None),
            "longer gap of a slow record": lambda: without(20, 27, *samples(30, last=3.0), smoothing=None),
            "gap of 5.5": lambda: said(t + 4.5 * t[1] * (t > 1.0), poses, smoothing=None),
            "gap of 4.9": lambda: said(t + 3.9 * t[1] * (t > 1.0), poses, smoothing=None),
            "gap of noise": lambda: without(40, 50, poses=noisy),
            "one still": lambda: said(t, held((50, 52)), smoothing=None),
            "four still": lambda: said(t, held((50, 55)), smoothing=None),
            "still at the ends": lambda: said(t, held((0, 12), (110, 120)), smoothing=None),
            "still at the start": lambda: said(t, held((0, 12)), smoothing=None),
            "every other": lambda: said(t, held(*((k, k + 2) for k in range(0, 120, 2))), smoothing=None),
            "every third": lambda: said(t, held(*((k, k + 3) for k in range(0, 118, 3))), smoothing=None),
            "now and then": lambda: said(t, held(*((k, k + 2) for k in range(0, 110, 9))), smoothing=None),
            "all still": lambda: said(t, held((0, 120)), smoothing=None),
            "whole degrees": lambda: said(t, rounded),
            "tenths": lambda: said(t, finer),
            "ms": lambda: said(40 * t, poses),
            "frames": lambda: said(np.arange(120.0), poses),
            "nearly 1 s": lambda: said(0.999 * np.arange(120.0), poses),
            "people are slower": lambda: said(0.06 * t, poses),
            "nearly": lambda: said(0.12 * t, poses),
            "few and fast": lambda: said(*samples(9, last=0.15)),
            "few and slow": lambda: said(*samples(9, last=1.5)),
            "impossible": lambda: said(1e-4 * t, noisy, smoothing=None),
            "impossible, smoothed": lambda: said(1e-4 * t, noisy),
            "filtered": lambda: said(*filtered(15)),
            "filtered more": lambda: said(*filtered(25)),
            "filtered at 200 Hz": lambda: said(*filtered(15, 200.0)),
            "filtered a little": lambda: said(*filtered(15, 100.0, 0.02)),
            "filtered and stated": lambda: said(*filtered(15), sensor_noise=0.02),
            "raw": lambda: said(*filtered(1)),
            "far": lambda: said(t[:13], turned[0], smoothing=None),
            "farther": lambda: said(t[:13], turned[1], smoothing=None),
            "three": lambda: said(t[:3], poses[:3]),
            "many": lambda: said(t[:9], poses),
            "twice": lambda: said(np.r_[t[:5], t[4:119]], poses),
            "other smoothing": lambda: said(t, poses, smoothing="spline"),
            "a number": lambda: said(t, poses, smoothing=0.1),
            "noise of none": lambda: said(t, poses, smoothing=None, sensor_noise=0.1),
            "noise in degrees": lambda: said(t, poses, sensor_noise=1.1),
            "noise of few": lambda: said(t[:11], poses[:11], sensor_noise=0.1),
            "no noise": lambda: said(t, poses, sensor_noise=0.0),
            "rest of none": lambda: said(t, poses, smoothing=None, ends="rest"),
            "other ends": lambda: said(t, poses, ends="still"),
        }
    )


def standing():
    """Which equal samples of a turn by given steps count as a sensor that stands still."""

    def marked(*steps):
        angles = np.cumsum([0.0, *np.ravel(steps)])
        poses = Rotation.from_rotvec(np.outer(0.01 * angles, [0.0, -1.0, 0.0]))
        cautions = ep.Movement.from_samples(0.1 * np.arange(len(angles)), poses, smoothing=None).cautions
        return [text for text in cautions if "equal the one before" in text]

    def run(near, beyond, count=3, many=57, smallest=1.0):
        return marked([smallest, *[6.0] * (many - 4), beyond, near, *[0.0] * count, smallest, smallest])

    def slow(share, middle):
        moving = [1.0, 1.0, *[middle] * 23]
        return marked([[step, 0.0] if k < share else [step, middle] for k, step in enumerate(moving[:17])])

    return {
        "of the smallest step": [run(near, 4.8) for near in (3.9, 4.1, 4.5, 8.0)],
        "of the step before": [run(near, 20.0) for near in (13.5, 14.5, 16.0)],
        "by chance": [run(6.0, 6.0, many=many) for many in (31, 32, 33, 34, 35)],
        "of one": [run(6.0, 6.0, count, many=20) for count in (1, 2, 3, 4)],
        "of a slow sensor": [slow(share, middle) for share in (8, 9, 10, 11) for middle in (2.4, 2.6)],
        "equal": [run(6.0, 6.0, smallest=size) for size in (0.8e-9, 1.1e-9)],
    }


def cases():
    """Loads, motions, offsets, paths and ranges, at both sides of their limits."""
    exo = ep.load("four-linear-actuators")
    poses = exo.pose([20, 70], [[10], [30], [50]], 5)
    path = CentrePath(
        [0.1, 0.9, 2.0], [[0.0, 0.001, 0.0], [-0.01, 0.004, 0.012], [-0.02, -0.003, 0.03]], [0.002, 0, -0.001]
    )
    load = Load([[1.0, 2.0, -9.0], [3.0, 0.0, -5.0]], [0.2, -0.1, 0.3], [0.01, 0.02, -0.4], frame="arm")
    motion = Motion([0.5, -1.0, 0.2], [[[2.0, -3.0, 1.0]], [[1.0, 1.0, 1.0]], [[0.0, 2.0, 0.0]]])
    case = ep.Case(poses, motion, load, path, posture={"elbow_deg": [[1.0], [2.0], [3.0]]})
    shifted = ep.Case(poses, centre_offset=[0.01, 0.0, 0.02], posture=np.arange(18.0).reshape(3, 2, 3))
    movement = ep.Movement.from_samples(*samples(6), smoothing=None)
    own = RangeOfMotion("own", (-10, 50), (0, 20.0000001), (5, 5))
    return in_turn(
        {
            "case": lambda: case,
            "row": lambda: case.row(4),
            "shifted row": lambda: shifted.row(3),
            "beyond": lambda: case.row(6),
            "turned": lambda: case.turned(np.array([5, 0]), exo.pose([0, 40]).as_matrix()),
            "at": lambda: case.at(exo.pose(33), Motion([1, 0, 0], [0, 0, 2])),
            "stacked": lambda: (case.is_stacked, shifted.is_stacked, ep.Case(poses, load=Load([0, 0, 1])).is_stacked),
            "moving": lambda: ep.Case(movement),
            "moving twice": lambda: ep.Case(movement, motion),
            "no poses": lambda: ep.Case([1.0, 2.0]),
            "no load": lambda: ep.Case(poses, load=[1.0, 2.0, 3.0]),
            "does not fit": lambda: exo.reaction(poses, load=Load([[0, 0, 1.0]] * 5)),
            "answer": lambda: exo.reaction(poses, motion, load=load, centre_offset=path).shoulder_force,
            "on the cuff": lambda: exo.reaction(poses, motion, load=load, centre_offset=path).cuff_wrench,
            "path": lambda: (
                path.elevation + 0.0,
                path.displacement + 0.0,
                path.fit + 0.0,
                path.at([0.1, 0.5, 1.4, 2.0]),
                path.at(2.0 + 9e-8),
                path.mirrored(),
            ),
            "offset": lambda: path.offset(poses),
            "above": lambda: path.at([0.5, 2.0 + 2e-7]),
            "below": lambda: path.at(0.1 - 2e-7),
            "plain": lambda: CentrePath([0.1, 0.2], [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0]]),
            "one elevation": lambda: CentrePath([0.1], [[0, 0, 0]]),
            "fewer": lambda: CentrePath([0.1, 0.2], [[0, 0, 0]] * 3),
            "falling": lambda: CentrePath([0.2, 0.1], [[0, 0, 0]] * 2),
            "from below": lambda: CentrePath([-0.1, 0.1], [[0, 0, 0]] * 2),
            "to above": lambda: CentrePath([0.1, np.pi + 1e-8], [[0, 0, 0]] * 2),
            "to the top": lambda: CentrePath([0.0, np.pi + 5e-10], [[0, 0, 0.2]] * 2).at(np.pi),
            "far": lambda: CentrePath([0.0, 1.0], [[0, 0, 0.201]] * 2),
            "together": lambda: CentreOffset.together([0.2, -0.2, 0.1]),
            "too far": lambda: CentreOffset([0.0, -0.201, 0.0], [0, 0, 0]),
            "too fast": lambda: Motion([0, 0, 0], [0, -1.1e6, 0]),
            "fast": lambda: Motion([0, 1e6, 0], [0, 0, 0]),
            "too strong": lambda: Load([0, 0, -1.1e9]),
            "strong": lambda: Load([0, 0, 1e9], 0),
            "no moment": lambda: Load([0, 0, 1], 1.0),
            "too long": lambda: Load([0, 0, 1], at=[0, 0, -5.01]),
            "long": lambda: Load([0, 0, 1], at=[0, 0, -5.0]),
            "frame": lambda: Load([0, 0, 1], frame="hand"),
            "own range": lambda: (own, own.axes(7.0), own.poses(30, "right")),
            "box": lambda: (DAILY_RANGES, ADL_BOX, ADL_BOX.axes(40), ADL_BOX.poses(60)),
            "no range": lambda: RangeOfMotion("own", (10, -10), (0, 1), (0, 1)),
            "wide": lambda: RangeOfMotion("own", (-360, 360), (0, 1), (0, 361)),
            "step": lambda: own.axes(0.0),
        }
    )


def suspicious():
    """Warnings of angles that are radians, or that no shoulder reaches, on both sides."""
    said = []
    for side in ("left", "right"):
        exo = ep.load("four-linear-actuators", side=side)
        for angles in (
            (1.05,), (0.0, -2.094), (0, 0, np.radians(50)), (np.radians(17), 3.0), (181.0,), (0, [-180, 10, -190]),
            (np.linspace(0, 1.3, 4),), (np.linspace(0, 1.3, 3),), (np.linspace(0, 0.5, 9),), (np.linspace(0, 3.0, 9),),
            (np.linspace(0, 3.1, 9),), (-64.0,), (-66.0,), (0.0, -49.0), (0.0, -51.0), (19.0, -60.0),
            (42.0, -60.0), (44.0, -60.0),
            ([10.0, -70.0, -80.0], 10.0), (0, [-60.0, 20.0], 0), (4e-4,),
            *((rounded,) for rounded in (0.52, 0.524, 0.79, 0.785, 1.047, 1.57, 1.571, 2.09, 2.094)),
        ):  # fmt: skip
            with warnings.catch_warnings(record=True) as warned:
                warnings.simplefilter("always")
                exo.pose(*angles)
            said.append([str(each.message) for each in warned])
        said.append(beyond_motion(exo.pose(0, 0, [-135.1, -134.9, 95.0, 95.2]).as_matrix(), side))
    return said


ASKED = {
    "other_sides": other_sides,
    "smoothed": smoothed,
    "doubted": doubted,
    "standing": standing,
    "cases": cases,
    "suspicious": suspicious,
}

#: Those that take longer than 0.15 s.
LONGER = {"doubted"}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
