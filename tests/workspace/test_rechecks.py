"""A check of a design refuses what Pinocchio does not confirm."""

from types import SimpleNamespace

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import SolverFailed
from exo_pin.workspace import Criteria, recheck

LIMITS = Criteria(names=("stroke", "connected", "forces"), least_tension=5.0)


def asked_of(exo, change=lambda answer: {}):
    """The design's reaction, whose answers are changed, and the questions that it gets."""
    questions = []

    def reaction(poses, **options):
        answer = exo.reaction(poses, **options)
        questions.append((poses, options, answer))
        names = ("magnitude", "status", "can_hold", "unknown")
        return SimpleNamespace(**({name: getattr(answer, name) for name in names} | change(answer)))

    return reaction, questions


@pytest.mark.parametrize(
    ("change", "error"),
    [
        (lambda answer: {"magnitude": answer.magnitude + 1e-7}, None),
        (lambda answer: {"magnitude": answer.magnitude + 1.0}, "difference of"),
        (lambda answer: {"magnitude": np.where(np.arange(answer.magnitude.size) == 2, np.nan, answer.magnitude)},
         "difference of"),
        # Forces of poses out of their strokes are others, and say nothing.
        (lambda answer: {"magnitude": answer.magnitude + 1.0, "status": np.full(answer.status.shape, "out_of_stroke")},
         None),
        (lambda answer: {"can_hold": answer.can_hold & (np.arange(answer.can_hold.size) != 2)}, "cannot be held"),
        # Whether a pose inside can be held may be unknown.
        (lambda answer: {"can_hold": answer.can_hold & False, "unknown": answer.unknown | True}, None),
    ],
)  # fmt: skip
def test_what_pinocchio_does_not_confirm_is_refused(change, error):
    exo = ep.load("four-cables")
    reaction, _ = asked_of(exo, change)
    if error is None:
        assert recheck(exo.mechanism, reaction, LIMITS, 45.0).pinocchio_difference < 1e-6
        return
    with pytest.raises(SolverFailed, match=error):
        recheck(exo.mechanism, reaction, LIMITS, 45.0)
