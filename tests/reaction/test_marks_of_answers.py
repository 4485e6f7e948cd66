"""What marks rows of an answer: the miss of its balance, and numbers that overflow, which no sound question reaches."""

import numpy as np
import pytest

from exo_pin.reaction.answer import BEYOND, QUERY_STATUS, _balance_residual, _mark_non_finite, answered
from exo_pin.reaction.splits.split import Chosen

NAN, INF = np.nan, np.inf
CODE = {name: QUERY_STATUS.index(name) for name in QUERY_STATUS}


def test_the_residual_is_what_is_missing_over_the_largest_force(plain):
    shoulder = np.array([[1.0, 2.0, -3.0], [1.0, 2.0, -3.0], [0.0, 0.0, 0.0], [NAN, 0.0, 0.0], [8.0, 0.0, 0.0]])
    on_arm = np.zeros((5, 2, 6))
    on_arm[:2, 0], on_arm[:2, 1] = [3.0, -1.0, 5.0, 0.1, 0.2, -0.3], [-2.0, 4.0, 1.0, -0.4, 0.1, 0.5]
    force = -shoulder - on_arm[..., :3].sum(axis=1)
    moment = -on_arm[..., 3:].sum(axis=1)
    found = np.empty(5)
    _balance_residual(shoulder, on_arm, force, moment, 0.2, found)
    np.testing.assert_allclose(found[[0, 1, 2, 4]], 0.0, atol=1e-16)
    assert np.isnan(found[3])
    # The largest of all force components counts: here one of a limb, of the load and of the shoulder.
    for axis in range(3):
        for miss in (0.5, -0.5):
            off = force.copy()
            off[0, axis] += miss
            off[4, axis] += miss
            _balance_residual(shoulder, on_arm, off, moment, 0.2, found)
            largest = max(np.abs(shoulder[0]).max(), np.abs(off[0]).max(), np.abs(on_arm[0, :, :3]).max())
            assert found[0] == pytest.approx(0.5 / largest)
            assert found[4] == pytest.approx(0.5 / max(8.0, np.abs(off[4]).max()))
            off = moment.copy()
            off[0, axis] += 0.4 * miss
            _balance_residual(shoulder, on_arm, force, off, 0.2, found)
            largest = max(np.abs(shoulder[0]).max(), np.abs(force[0]).max(), np.abs(on_arm[0, :, :3]).max())
            assert found[0] == pytest.approx(1.0 / largest)
    lost = np.zeros((5, 3))
    lost[2, 1] = 0.06
    _balance_residual(shoulder, on_arm, force, moment + lost, 0.2, found)
    assert found[2] == pytest.approx(0.3)  # without any force the miss itself


def chosen(status, f, unmet=None):
    own = Chosen(np.array(status, dtype=np.int8), 3)
    own.f[:], own.g[:], own.kkt[:], own.gap[:], own.unique[:] = np.array(f)[:, None], 1.0, 0.5, 0.25, True
    own.unmet[:] = 0 if unmet is None else unmet
    return own


def test_rows_without_an_answer_are_not_numbers():
    own = chosen([0, 1, 0, CODE["singular"], 0], [1.0, 2.0, INF, 4.0, NAN], [0, CODE["infeasible"], 0, 7, 8])
    _mark_non_finite(own)
    assert own.status.tolist() == [0, 1, CODE["not_solved"], CODE["singular"], CODE["not_solved"]]
    for part in (own.f[:, 0], own.g[:, 0], own.kkt, own.gap):
        assert np.isnan(part).tolist() == [False, False, True, True, True]
    assert own.unique.tolist() == [True, True, False, False, False]
    assert own.unmet.tolist() == [0, CODE["infeasible"], 0, 0, 0]
    # Only g overflows.
    own = chosen([0, 0], [1.0, 1.0])
    own.g[1, 2] = -INF
    _mark_non_finite(own)
    assert own.status.tolist() == [0, CODE["not_solved"]]
    # A status without an answer is enough.
    own = chosen([0, CODE["folded"]], [1.0, 1.0])
    _mark_non_finite(own)
    assert np.isnan(own.f[1]).all()
    assert own.status.tolist() == [0, CODE["folded"]]
    # So it is where all are lost.
    own = chosen([CODE["folded"], CODE["singular"]], [1.0, 2.0])
    _mark_non_finite(own)
    assert np.isnan(own.f).all()
    assert not own.unique.any()
    own = chosen([0, 1], [1.0, 1.0])
    _mark_non_finite(own)
    assert own.status.tolist() == [0, 1]
    assert np.isfinite(own.f).all()
    assert answered(np.array([0, 1, 2, 3, 9], dtype=np.int8)).tolist() == [0, 1]
    assert [code for name, code in CODE.items() if name in BEYOND] == [CODE[name] for name in BEYOND]
