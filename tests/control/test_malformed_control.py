"""Spoiled arguments of calibration and trajectories: a typed error, or an answer that is finite or says infinite."""

import warnings

import numpy as np
import pytest
from malformed_calls import either, junk
from measured_devices import poses
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import control

EXO = ep.load("prototype")
JOINTS = ("base_points", "platform_points")
CALLS = 150


def calibrate(rng):
    arm = poses(rng, 9)
    lengths = EXO.inverse_kinematics(arm).lengths + 1e-4 * rng.normal(size=(9, 3))
    good = {
        "orientations": arm,
        "lengths": lengths,
        "nominal": EXO,
        "unknowns": JOINTS,
        "length_noise": 1e-4,
        "orientation_noise": 1e-3,
        "tolerances": {"base_points": 1e-3},
        "torso_mounting": Rotation.identity(),
        "loss": "linear",
    }
    name = rng.choice(list(good))
    if name == "orientations":
        good[name] = (junk(rng), Rotation.identity(9), Rotation.identity(0), arm[:4])[int(rng.integers(4))]
    elif name in ("lengths", "length_noise", "orientation_noise"):
        good[name] = either(rng, good[name])
    elif name == "tolerances":
        good[name] = junk(rng) if rng.random() < 0.5 else {"base_points": junk(rng)}
    else:
        good[name] = junk(rng)
    found = ep.calibrate(good.pop("orientations"), good.pop("lengths"), good.pop("nominal"), **good)
    assert np.isfinite(found.values).all()
    assert not np.isnan(found.standard_deviations).any()
    assert str(found).startswith(found.verdict)


def suggestion(rng):
    good = {
        "count": 3,
        "candidates": poses(rng, 6),
        "length_noise": 1e-4,
        "orientation_noise": 1e-3,
        "criterion": "variance",
    }
    name = rng.choice(list(good))
    good[name] = junk(rng)
    found = control.suggest_poses(EXO, good.pop("count"), good.pop("candidates"), **good)
    assert not np.isnan(found.expected.standard_deviations).any()


def trajectory(rng):
    which = int(rng.integers(5))
    if which == 0:
        made = control.Turn(Rotation.identity(), either(rng, [0.1, 0.2, 0.3]), either(rng, 2.0))
    elif which == 1:
        made = control.AnglePath(either(rng, [0.0, 1.0, 2.0]), either(rng, np.zeros((3, 3))))
    elif which == 2:
        made = control.OrientationSpline(either(rng, [0.0, 1.0, 2.0]), Rotation.random(3, rng), bool(rng.integers(2)))
    elif which == 3:
        made = control.daily_task("feeding", either(rng, 2.0), side=str(junk(rng)))
    else:
        made = control.abduction(
            either(rng, 1.0), either(rng, 2.0), control.TimeLaw("constant_speed", either(rng, 0.1))
        )
    state = made(either(rng, [0.0, 0.5]))
    assert np.isfinite(state.angular_acceleration).all()
    assert np.isfinite(state.orientation.as_quat()).all()


@pytest.mark.parametrize("maker", [calibrate, suggestion, trajectory])
def test_malformed_calls_raise_typed_errors(maker):
    rng, refused = np.random.default_rng(70), 0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", ep.SuspectMeasurements)
        for call in range(CALLS):
            try:
                maker(rng)
            except ep.ExoPinError:
                refused += 1
            except Exception as error:
                raise AssertionError(f"call {call}: {type(error).__name__}: {error}") from error
    assert refused > 0.3 * CALLS
