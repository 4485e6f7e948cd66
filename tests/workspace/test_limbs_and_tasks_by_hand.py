"""Tables of limbs and of tasks, whose numbers are known: lengths, forces, gaps, rates and what limits a task."""

from types import SimpleNamespace

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.workspace import query as tasks

pytestmark = pytest.mark.usefixtures("plain")

NAN = np.nan


def reached(inside, met, tensions=None):
    met = {name: np.array(values) for name, values in met.items()}
    inside = np.array(inside)
    return SimpleNamespace(inside=inside, index=float(inside.mean()), met=met, tensions=tensions)


def rates(values, turning=(False, False), limits=((NAN, NAN), (NAN, NAN))):
    own = object.__new__(tasks._Rates)
    own.values, own.turning, own.limits = np.array(values, dtype=float), np.array(turning), np.array(limits)
    return own


def test_speed_and_power_of_a_movement_by_hand():
    """Power is what an actuator gives, so that what it takes up counts as none; slides and hinges apart."""
    found = reached([True, True], {}, tensions=np.array([[10.0, -20.0], [30.0, 5.0]]))
    own = rates([[0.5, 0.25], [-2.0, -0.1]], limits=[[3.0, 0.3], [6.0, 5.0]])
    np.testing.assert_allclose(own.power(found.tensions), [[5.0, 0.0], [0.0, 0.0]])
    row = tasks._row("lift", "movement", found, own)
    assert (row["fastest_limb_m_s"], row["largest_power_W"], row["fast_enough"]) == (2.0, 5.0, 1.0)
    # Of a single sample, too.
    one = tasks._row(
        "lift", "movement", reached([True], {}, found.tensions[:1]), rates(own.values[:1], limits=own.limits)
    )
    assert (one["largest_power_W"], one["fast_enough"]) == (5.0, 1.0)
    both = tasks._row("lift", "movement", found, rates(own.values, turning=[False, True]))
    assert (both["fastest_limb_m_s"], both["fastest_joint_rad_s"]) == (2.0, 0.25)
    for limits, share in (
        ([[1.9, 0.3], [6.0, 5.0]], 0.5),  # too fast in the second sample
        ([[3.0, 0.3], [4.9, 5.0]], 0.5),  # too strong in the first
        ([[2.0, 0.25], [5.0, 5.0]], 1.0),  # just at the limits
        ([[NAN, 0.3], [5.0, NAN]], 1.0),
        ([[NAN, 0.3], [4.0, NAN]], 0.5),
        ([[1.0, 0.2], [1.0, 1.0]], 0.0),
        ([[NAN, 0.3], [NAN, NAN]], NAN),  # nothing is known of the first
    ):
        np.testing.assert_equal(rates(own.values, limits=limits).fast_enough(own.power(found.tensions)), share)
    nobody = rates(np.empty((2, 0)), turning=np.zeros(0, dtype=bool), limits=np.empty((2, 0)))
    assert np.isnan(nobody.fast_enough(np.empty((2, 0))))


def lift(exo, degrees=60.0):
    angles = degrees * np.sin(np.linspace(0.0, np.pi / 2, 41)) ** 2
    return ep.Movement.from_samples(np.linspace(0.0, 2.0, 41), exo.pose(angles, 10.0, 5.0), smoothing=None)
