"""Thousands of malformed calls: each raises a typed error or marks its rows; none hangs, none warns."""

import contextlib
import signal
import warnings

import numpy as np
import pytest
from malformed_calls import MAKERS
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import wrist
from exo_pin.load_case import Movement
from exo_pin.reaction import Reaction
from exo_pin.reaction.answer import BEYOND
from exo_pin.study import StudyTable

#: A call of this test takes milliseconds; one that takes this long, s, hangs.
HANGS = 20


def check_answer(answer):
    """What came back is finite wherever it claims to be an answer, and marked wherever it is not."""
    if isinstance(answer, Reaction):
        held = answer.has_answer
        for name in ("shoulder_force", "actuator_forces", "constraint_forces", "limb_wrenches"):
            values = getattr(answer, name)
            assert np.isfinite(values[held]).all(), name
            assert np.isnan(values[~held]).all(), name
        if (answer.status == "infeasible").any():
            bad = answer.infeasibility.infeasible
            assert bad[answer.status == "infeasible"].all()
            # Evidence leaves strokes out: a pose out of stroke can lack forces besides.
            assert np.isin(answer.status[bad], BEYOND).all()
            assert (answer.infeasibility.required[bad] > answer.infeasibility.available[bad]).all()
    elif isinstance(answer, wrist.Holding):
        regular = np.isin(answer.status, ("ok", "near_singular"))
        np.testing.assert_array_equal(np.isnan(answer.margin), ~regular)
    elif isinstance(answer, Movement):
        assert np.isfinite(answer.motion.angular_acceleration).all()
    elif isinstance(answer, StudyTable):
        figures = answer["holdable"]
        np.testing.assert_array_equal(np.isnan(figures), answer["error"] != "")
    elif isinstance(answer, Rotation):
        assert np.isfinite(answer.as_quat()).all()


@contextlib.contextmanager
def alarm(seconds):
    def ring(*_):
        raise TimeoutError(f"a call took more than {seconds} s")

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


@pytest.mark.parametrize("calls", [4_000, pytest.param(20_000, marks=pytest.mark.full)])
@pytest.mark.parametrize("maker", MAKERS, ids=lambda maker: maker.__name__)
def test_malformed_calls_raise_typed_errors_or_mark_their_rows(maker, calls):
    rng = np.random.default_rng(90 + MAKERS.index(maker))
    count = -(-calls // len(MAKERS))
    refused = 0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # Random poses are no poses of people.
        warnings.simplefilter("ignore", ep.OutsideHumanRange)
        for call in range(count):
            try:
                with alarm(HANGS):
                    check_answer(maker(rng))
            except ep.ExoPinError:
                refused += 1
            except Exception as error:
                raise AssertionError(f"call {call} of {maker.__name__}: {type(error).__name__}: {error}") from error
    assert refused > 0.1 * count
