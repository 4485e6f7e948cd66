"""The thesis's controller, sample by sample."""

from types import SimpleNamespace

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import InvalidInput, MissingData
from exo_pin.control import (
    TABLE_5_5,
    ContractionController,
    Imu,
    ImuSensor,
    Measurement,
    PIGains,
    abduction,
)

EXO = ep.load("prototype")
POSE = ep.thesis_rotation(8.8, -13.4, -8.8, degrees=True)


def seen(pose=POSE, **more):
    return SimpleNamespace(orientation=pose, angular_velocity=np.zeros(3), pressures=np.zeros(3), **more)


def test_ratios_are_those_of_5_4():
    contractions = ep.Plant(EXO).contractions
    lengths = EXO.inverse_kinematics(POSE).lengths
    np.testing.assert_allclose(contractions.lengths(POSE), lengths, atol=1e-15)
    muscles = lengths - [0.126, 0.154, 0.154]
    np.testing.assert_allclose(contractions.ratios(lengths), ([0.15, 0.25, 0.25] - muscles) / [0.15, 0.25, 0.25])
    stack = contractions.lengths(ep.thesis_rotation([0.1, 0.2], 0.0, 0.0))
    assert stack.shape == (2, 3)


def test_first_sample_is_proportional_with_the_printed_gains():
    reference = abduction()
    controller = ContractionController(EXO.mechanism, reference)
    contractions = ep.Plant(EXO).contractions
    error = contractions.ratios(contractions.lengths(reference(2.0).orientation))
    error = error - contractions.ratios(contractions.lengths(POSE))
    gains = np.array([2.3e-2, 3.3e-2, 3.3e-2])
    duty = np.clip(gains * 100.0 * error, 0.0, 1.0)
    assert (duty > 0.0).any()
    assert (duty == 0.0).any()
    np.testing.assert_allclose(controller(2.0, seen()), 2.0 * duty - 1.0, atol=1e-14)
    # The second sample has a hundredth of a second of integral, where the output was not at its limit.
    more = np.clip(gains * 100.0 * error * (1.0 + 0.01 / np.array([0.662, 0.95, 0.95])), 0.0, 1.0)
    np.testing.assert_allclose(controller(2.0, seen())[2], 2.0 * more[2] - 1.0, atol=1e-12)
    controller.reset()
    np.testing.assert_allclose(controller(2.0, seen()), 2.0 * duty - 1.0, atol=1e-14)
    assert TABLE_5_5[0.150].T_i == 0.662


def test_without_a_reading_it_goes_on_with_the_last_one():
    controller = ContractionController(EXO.mechanism, abduction())
    before = controller(2.0, seen())
    assert controller(2.01, seen(lost=True))[2] > before[2]


def test_sensor_puts_the_pose_that_it_reads_in_place_of_the_true_one():
    exact = Measurement(POSE, np.zeros(3), np.full(3, 1e5), 4e5, EXO.inverse_kinematics(POSE).lengths, np.zeros(3))
    sensor = ImuSensor(Imu(drift=0.1), EXO.mechanism)
    sensor(0.0, exact)
    read = sensor(0.5, exact)
    assert (read.orientation * POSE.inv()).magnitude() == pytest.approx(0.05)
    np.testing.assert_allclose(read.lengths, EXO.inverse_kinematics(read.orientation).lengths, atol=1e-15)
    np.testing.assert_array_equal(read.pressures, exact.pressures)
    assert not read.lost
    assert read.supply_pressure == exact.supply_pressure


def test_separate_valves_take_the_duty_as_it_is():
    three_way = ContractionController(EXO.mechanism, abduction())(2.0, seen())
    separate = ContractionController(EXO.mechanism, abduction(), layout="fill and vent")(2.0, seen())
    np.testing.assert_allclose(three_way, 2.0 * separate - 1.0, atol=1e-14)


def test_a_plain_function_is_a_controller():
    calls = []
    run = ep.Plant(EXO).simulate(lambda t, measurement: calls.append(t) or [0.0, 0.0, 0.0], 0.02)
    assert run.status == "completed"
    np.testing.assert_allclose(calls, [0.0, 0.01])
    study = ep.experiment("abduction", calls.append)
    assert study.made_controller(study.plant) == calls.append
    with pytest.raises(InvalidInput):
        ep.experiment("abduction", 3.0)


@pytest.mark.parametrize(
    "options",
    [
        {"reference": None}, {"reference": abduction(), "gains": [PIGains(1.0, 1.0)]},
        {"reference": abduction(), "rate": 0.0},
    ],
)  # fmt: skip
def test_bad_input_is_refused(options):
    with pytest.raises(InvalidInput):
        ContractionController(EXO.mechanism, **options)


def test_missing_strokes_are_named():
    with pytest.raises(MissingData, match="limb 1"):
        ContractionController(ep.load("appendix-d").mechanism, abduction())
