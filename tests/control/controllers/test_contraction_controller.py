"""The thesis's controller, sample by sample."""

from types import SimpleNamespace

import numpy as np

import exo_pin as ep
from exo_pin.control import (
    TABLE_5_5,
    ContractionController,
    abduction,
)

EXO = ep.load("prototype")
POSE = ep.thesis_rotation(8.8, -13.4, -8.8, degrees=True)


def seen(pose=POSE, **more):
    return SimpleNamespace(orientation=pose, angular_velocity=np.zeros(3), pressures=np.zeros(3), **more)


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
