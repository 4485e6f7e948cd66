"""Errors of sensors: each channel, what is kept for later, and a run that goes on."""

import pickle

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import control
from exo_pin.control.sensors import CHANNELS
from exo_pin.core.errors import InvalidInput, UnknownName


def measured(t):
    """What exact sensors of two drives say at a time."""
    two = np.array([1.0 + t, 2.0 - t])
    pose = Rotation.from_rotvec([0.0, t, 0.0])
    return control.Measurement(pose, np.array([t, 0.0, 0.0]), 1e5 * two, 4e5, two, two, two, two)


def readings(*errors, times=tuple(range(8))):
    sensors = control.Sensors(errors)
    return [sensors(t / 100.0, measured(t / 100.0)) for t in times]


@pytest.mark.parametrize("channel", CHANNELS)
def test_bias_delay_and_loss_of_every_channel(channel):
    seen = readings(control.SensorError(channel, bias=0.5, delay=0.02, lost=((0.03, 0.05),)))
    # Nothing is read at 0.03 and 0.04 s; the first reading stands until the second is old enough.
    for now, of in zip(seen, [0.0, 0.0, 0.0, 0.01, 0.02, 0.02, 0.02, 0.05], strict=True):
        value, true = getattr(now, channel), getattr(measured(of), channel)
        if channel == "orientation":
            np.testing.assert_allclose((value * true.inv()).as_rotvec(), 0.5, atol=1e-12)
        else:
            np.testing.assert_allclose(value, true + 0.5)
    assert any(now.lost for now in seen) == (channel == "orientation")


def test_noise_has_its_size_and_resolution_its_step():
    errors = control.SensorError("lengths", noise=0.02), control.SensorError("lengths", resolution=0.01)
    seen = np.array([now.lengths for now in readings(*errors, times=np.zeros(2000))])
    assert seen.std() == pytest.approx(np.sqrt(0.25 + 0.02**2), rel=0.02)
    assert (seen[:, 0] - 1.0).std() == pytest.approx(0.02, rel=0.06)
    np.testing.assert_allclose(100.0 * seen, np.round(100.0 * seen), atol=1e-9)


def test_errors_of_one_drive_leave_the_others_alone():
    seen = readings(control.SensorError("drive_positions", bias=0.1, delay=0.01, limb=1, resolution=0.05))
    np.testing.assert_array_equal([now.drive_positions[0] for now in seen], [1.0 + k / 100.0 for k in range(8)])
    assert seen[4].drive_positions[1] == pytest.approx(2.05)


def test_a_run_with_noisy_sensors_goes_on_bit_for_bit():
    exo = ep.load("four-cables")
    plant = ep.Plant(exo)
    controller = control.LengthController(plant, control.flexion())
    errors = [control.SensorError("drive_positions", 1e-4, delay=0.025, seed=3), control.SensorError("lengths", 1e-4)]

    def go(duration, state):
        return plant.simulate(controller, duration, state, sensor=control.Sensors(errors))

    start = plant.held(exo.pose(), np.full(4, 40.0))
    whole = go(0.1, start)
    controller.reset()
    first = go(0.05, start)
    rest = go(0.05, pickle.loads(pickle.dumps(first.state(0.05))))
    assert (rest.commands[0] == whole.commands[5]).all()
    assert (rest.tensions[-1] == whole.tensions[-1]).all()


def test_bad_input_is_refused():
    with pytest.raises(UnknownName, match="pressures"):
        control.SensorError("pressure")
    with pytest.raises(InvalidInput, match="intervals"):
        control.SensorError("lengths", lost=((2.0, 1.0),))
    with pytest.raises(InvalidInput, match="limb"):
        readings(control.SensorError("orientation", limb=1))
