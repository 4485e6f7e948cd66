"""Efforts of devices that give way, looked for within their limits: rounds between geometry and efforts."""

from typing import Any, NamedTuple

import numpy as np

from exo_pin.reaction.answer import QUERY_STATUS
from exo_pin.reaction.constraints.actuator_limits import LimbLimits
from exo_pin.reaction.device_poses import _put
from exo_pin.reaction.device_poses import _within_limits as within_limits
from exo_pin.reaction.effort_sharing import EffortSharing
from exo_pin.wrist.forces.affine_state import AffineState

NOT_SOLVED, SINGULAR = QUERY_STATUS.index("not_solved"), QUERY_STATUS.index("singular")


def _within_limits(settled, found, limits):
    """Of a device without idle motions, whose efforts all count alike."""
    within_limits(settled, found, limits, 3, EffortSharing(None, (), None))


class Found(NamedTuple):
    """What a device's equilibrium has, as far as the rounds within limits read and change it."""

    state: AffineState
    status: Any
    coordinates: Any
    name: str = "kept"


def state_of(arms, moment):
    count, _, n = arms.shape
    none = np.zeros((count, 3, n))
    blank = np.zeros((count, n, 6))
    return AffineState(arms, none, moment, np.zeros((count, 3)), none, none, blank, blank, blank, blank)


def limits_of_rows(count, n, high, error=0.0):
    zero, no = np.zeros((count, n)), np.zeros((count, n), dtype=bool)
    return LimbLimits(zero, np.broadcast_to(high, (count, n)).copy(), no, no, zero + error)


class Soft:
    """A device whose moment moves with its efforts: m = m_0 + share of J f."""

    def __init__(self, share, seed=3, count=5, n=5):
        rng = np.random.default_rng(seed)
        self.arms, self.share, self.asked = 0.2 * rng.normal(size=(count, 3, n)), share, []
        self.efforts = rng.uniform(2.0, 9.0, (count, n))
        self.m0 = (self.arms @ self.efforts[..., None])[..., 0] * (1.0 - share)
        self.lost = ()

    def at(self, f, rows):
        moment = self.m0[rows] + self.share * (self.arms[rows] @ f[..., None])[..., 0]
        status = np.array([SINGULAR if row in self.lost else 0 for row in rows], dtype=np.int8)
        return Found(state_of(self.arms[rows], moment), status, f + 100.0)

    def settled(self, preferred, rows):
        """Of all poses, but for those that were not asked without numbers."""
        self.asked.append(rows.tolist())
        whole, part = self.start(), self.at(preferred[rows], rows)
        for one in (*whole.state, whole.coordinates):
            one[:] = np.nan
        whole.status[:] = NOT_SOLVED
        for one, own in zip((*whole.state, whole.status, whole.coordinates), (*part.state, *part[1:3]), strict=True):
            one[rows] = own
        return whole

    def start(self):
        found = self.at(np.zeros_like(self.efforts), np.arange(len(self.m0)))
        return found._replace(state=AffineState(*(part.copy() for part in found.state)))


def least_norm(arms, moment, high):
    """Tensions of least norm in a box with a moment, by SciPy."""
    from scipy.optimize import minimize

    free = np.linalg.lstsq(arms, moment, rcond=None)[0]
    return minimize(
        lambda f: f @ f, np.clip(free, 0.0, high), jac=lambda f: 2.0 * f, bounds=[(0.0, high)] * len(free),
        constraints={"type": "eq", "fun": lambda f: arms @ f - moment, "jac": lambda f: arms},
        options={"ftol": 1e-15, "maxiter": 500},
    ).x  # fmt: skip


def test_efforts_within_limits_and_the_geometry_they_lead_to_agree():
    soft = Soft(0.2)
    found, limits = soft.start(), limits_of_rows(5, 5, 12.0)
    _within_limits(soft.settled, found, limits)
    assert (found.status == 0).all()
    assert found.name == "kept"
    moved = sorted({row for rows in soft.asked for row in rows})
    assert moved
    for row in moved:
        f = found.coordinates[row] - 100.0
        led = soft.at(f[None], np.array([row])).state.moment[0]
        np.testing.assert_allclose(found.state.moment[row], led, atol=1e-9)
        best = least_norm(soft.arms[row], found.state.moment[row], 12.0)
        np.testing.assert_allclose(f, best, atol=1e-4)
        np.testing.assert_allclose(soft.arms[row] @ f, found.state.moment[row], atol=1e-8)
        assert (f >= -1e-9).all()
        assert (f <= 12.0 + 1e-9).all()
    # Poses whose efforts are within their limits as they are stay where they are.
    for row in set(range(5)) - set(moved):
        np.testing.assert_array_equal(found.coordinates[row], 100.0)


def test_poses_out_of_their_stroke_or_without_an_answer_are_left():
    soft = Soft(0.2)
    every = soft.start()
    _within_limits(soft.settled, every, limits_of_rows(5, 5, 12.0))
    moved = sorted({row for rows in soft.asked for row in rows})
    error = np.zeros((5, 5))
    error[moved[0], 2] = 0.01
    soft.asked.clear()
    found = soft.start()
    _within_limits(soft.settled, found, limits_of_rows(5, 5, 12.0, error))
    assert sorted({row for rows in soft.asked for row in rows}) == moved[1:]
    soft.asked.clear()
    found = soft.start()
    found.status[moved] = SINGULAR
    _within_limits(soft.settled, found, limits_of_rows(5, 5, 12.0))
    assert soft.asked == []
    assert (found.status[moved] == SINGULAR).all()


def test_poses_that_no_efforts_hold_stay_and_lost_ones_say_so():
    soft = Soft(0.2)
    found = soft.start()
    _within_limits(soft.settled, found, limits_of_rows(5, 5, 1e-3))
    assert soft.asked == []
    np.testing.assert_array_equal(found.coordinates, 100.0)
    assert (found.status == 0).all()
    # One whose geometry becomes singular on the way is asked no more.
    soft = Soft(0.2)
    whole = soft.start()
    _within_limits(soft.settled, whole, limits_of_rows(5, 5, 12.0))
    moved = sorted({row for rows in soft.asked for row in rows})
    soft.asked.clear()
    found = soft.start()
    soft.lost = moved[:1]
    _within_limits(soft.settled, found, limits_of_rows(5, 5, 12.0))
    assert sum(moved[0] in rows for rows in soft.asked) == 1
    assert found.status[moved[0]] == SINGULAR
    np.testing.assert_allclose(found.coordinates[moved[1:]], whole.coordinates[moved[1:]], atol=1e-9)


def test_poses_that_do_not_come_to_rest_are_not_solved():
    """Moments that turn with every round: the efforts never repeat."""
    soft, calls = Soft(0.0), []

    def settled(preferred, rows):
        calls.append(len(rows))
        share = 1.0 + 0.05 * (-1) ** len(calls)
        own = soft.settled(preferred, rows)
        return own._replace(state=own.state._replace(moment=share * own.state.moment))

    found = soft.start()
    limits = limits_of_rows(5, 5, 12.0)
    _within_limits(settled, found, limits)
    assert len(calls) == 30
    assert set(found.status.tolist()) == {0, NOT_SOLVED}
    assert (found.status == NOT_SOLVED).sum() == calls[-1]


def test_rows_of_a_record_are_put_into_another():
    whole = ((np.zeros((3, 2)), "kept"), np.arange(3), None, np.zeros(3))
    part = ((np.array([[1.0, 2.0], [9.0, 9.0], [3.0, 4.0]]), "other"), np.array([7, 9, 8]), 5.0, "no array")
    _put(whole, part, np.array([2, 0]))
    np.testing.assert_array_equal(whole[0][0], [[1.0, 2.0], [0.0, 0.0], [3.0, 4.0]])
    np.testing.assert_array_equal(whole[1], [7, 1, 8])
    np.testing.assert_array_equal(whole[3], 0.0)
    assert whole[0][1] == "kept"
