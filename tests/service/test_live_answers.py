"""Samples of a live stream: what is lost and late, clocks, sensors, and messages of ROS."""

import json
from itertools import pairwise

import msgspec
import numpy as np
import pytest
from places import REPOSITORY
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.service.live_answers import LiveSession
from exo_pin.service.problems import encoded
from exo_pin.service.ros_messages import sample_of_quaternion, wrench_of_answer
from exo_pin.service.samples import Opening, Sample, SampledSensors, Stream

CABLES = {"design": "four-cables"}


def session(**options):
    return LiveSession(Opening(**{"open": CABLES, **options}))


@pytest.mark.parametrize("numbered", [True, False])
def test_gaps_and_late_samples_are_those_that_were_made(numbered):
    rng = np.random.default_rng(5)
    sent = np.arange(200)
    kept = sent[rng.random(200) > 0.2]
    kept[0] = 0
    # Some neighbours change places on the way.
    order = kept.copy()
    for k in rng.choice(np.arange(5, len(kept) - 5, 3), 10, replace=False):
        order[[k, k + 1]] = order[[k + 1, k]]
    stream, missing, late = Stream(rate=100.0), [], []
    for number in order:
        sample = Sample(t=7.0 + 0.01 * number, seq=int(number) if numbered else None)
        found = stream.take(sample, 50.0 + 0.01 * number)
        assert found.seq == number
        if found.is_late:
            late.append(found.seq)
        elif found.lost is not None:
            missing += range(found.lost[0], found.lost[1] + 1)
    assert late == [b for a, b in pairwise(order) if b < a]
    assert sorted(set(missing) - set(late)) == sorted(set(range(kept[-1])) - set(kept))


def test_the_delay_is_against_the_quickest_sample_and_clocks_may_drift():
    stream, drift = Stream(), 1e-4
    ways = 0.02 + 0.03 * np.random.default_rng(1).random(3000)
    ways[::50] = 0.02
    found = [stream.take(Sample(t=0.01 * k), (1.0 + drift) * 0.01 * k + way).delay for k, way in enumerate(ways)]
    # Within what clocks that are off by 100 ppm make in half a second and a bit.
    assert found == pytest.approx(ways - 0.02, abs=2e-4)


def sensors_on(poses, seed):
    """What two sensors say that are strapped on anyhow: of the trunk z points forward."""
    rng = np.random.default_rng(seed)
    facing = Rotation.from_euler("z", rng.uniform(0.0, 360.0), degrees=True)
    leaning = Rotation.from_euler("y", np.linspace(0.0, 10.0, len(poses))[:, None], degrees=True)
    on_trunk = Rotation.from_matrix(np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]).T)
    trunk = facing * leaning
    return (trunk * poses * Rotation.random(rng=rng)).as_quat(), (trunk * on_trunk).as_quat()


@pytest.mark.parametrize("side", ["left", "right"])
def test_sensors_on_arm_and_trunk_give_the_poses(side):
    exo = ep.load("four-cables", side=side)
    still, count = 51, 20
    flexion = np.concatenate([np.zeros(still), np.linspace(2.0, 60.0, count)])
    poses = exo.pose(flexion, 0.3 * flexion)
    arm, trunk = sensors_on(poses, 3)
    # The trunk does not lean while the arm hangs still.
    trunk[:still] = trunk[0]
    arm[:still] = arm[0]
    live = session(open={**CABLES, "side": side}, sensors=SampledSensors("z", 0.5))
    found = [
        live.answer(Sample(t=0.01 * k, arm_xyzw=tuple(a), trunk_wxyz=(b[3], *b[:3])))
        for k, (a, b) in enumerate(zip(arm, trunk, strict=True))
    ]
    assert [each["status"] for each in found[:still]] == ["calibrating"] * still
    own = exo.reaction(poses[still:])
    assert np.array([each["shoulder_force"] for each in found[still:]]) == pytest.approx(own.shoulder_force, abs=1e-6)


@pytest.mark.parametrize(
    ("change", "reading"),
    [
        (lambda q: q, None),
        (lambda q: np.roll(q, 1, axis=1), "w-first"),
        (lambda q: Rotation.from_quat(q).inv().as_quat(), "inverse"),
    ],
)
def test_a_stream_that_no_arm_makes_says_what_it_may_be(change, reading):
    exo = ep.load("four-cables")
    time = 0.02 * np.arange(101)
    poses = exo.pose(60.0 - 55.0 * np.cos(np.pi * time), 35.0 - 20.0 * np.cos(1.3 * np.pi * time))
    changed = change(poses.as_quat())
    said = [live_doubt(each, time, changed) for each in (session(), session(reading="as-named"))]
    assert said[1] is None
    assert said[0] is None if reading is None else f'reading="{reading}"' in said[0]
    if reading is not None:
        found = session(reading=reading).answer(Sample(t=0.0, quaternion_xyzw=tuple(changed[30])))
        assert found["shoulder_force"] == pytest.approx(exo.reaction(poses[30]).shoulder_force, rel=1e-9)


def live_doubt(live, times, quaternions):
    for time, each in zip(times, quaternions, strict=True):
        found = live.answer(Sample(t=float(time), quaternion_xyzw=tuple(each)))
    return found["doubt"]


def recorded():
    """Messages of a recorded movement, with the fields of ROS 2, and its poses."""
    movement = ep.read_movement(REPOSITORY / "examples" / "lift.csv", "left", None)
    rows = movement.poses[::20].as_quat()
    stamps = [divmod(round(1e9 * t), 10**9) for t in movement.times[::20]]
    headers = [{"stamp": {"sec": s, "nanosec": n}, "frame_id": "torso"} for s, n in stamps]
    return headers, rows, movement.poses[::20]


def test_ros_messages_of_a_recording_give_the_forces_of_its_poses():
    exo, live = ep.load("four-cables"), session()
    headers, rows, poses = recorded()
    own = exo.reaction(poses)
    assert len(poses) > 5
    for k, (header, row) in enumerate(zip(headers, rows, strict=True)):
        message = {"header": header, "quaternion": dict(zip("xyzw", row.tolist(), strict=True))}
        sample = msgspec.convert(json.loads(json.dumps(sample_of_quaternion(message, k))), Sample)
        answer = json.loads(encoded(live.answer(sample))) | {"t": sample.t}
        wrench = wrench_of_answer(answer, "torso")
        assert wrench["header"] == header
        assert list(wrench["wrench"]["force"].values()) == pytest.approx(own.shoulder_force[k], rel=1e-9)
        assert set(wrench["wrench"]["torque"].values()) == {0.0}
