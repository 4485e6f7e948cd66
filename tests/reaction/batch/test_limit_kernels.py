"""Strokes and force limits of poses, by the law of a muscle, known by hand."""

import numpy as np
import pytest

from exo_pin.reaction.answer import QUERY_STATUS
from exo_pin.reaction.batch.limit_kernels import CompiledLimits, check_limits
from exo_pin.reaction.constraints.actuator_limits import PullLaws

pytestmark = pytest.mark.usefixtures("plain")

#: Two limbs of 0.3 and 0.5 m in the pose of zero angles.
BASE = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]])
PLATFORM = np.array([[0.0, 0.0, -0.3], [0.1, 0.3, -0.4]])
NAN, INF = np.nan, np.inf


def told(
    f=(5.0, -7.0),
    status="ok",
    q=(0.0, 0.0, 0.0, 1.0),
    laws=([[0.0]] * 2, [0.0] * 2, [INF] * 2, [-INF] * 2, [INF] * 2),
    **limits,
):
    """Status and whether the outcome is unknown; limits that are not named are wide and known."""
    wide = {
        "lower": [-INF] * 2,
        "upper": [INF] * 2,
        "open_below": [False] * 2,
        "open_above": [False] * 2,
        "shortest": [0.1] * 2,
        "longest": [0.9] * 2,
        "estimated": [False] * 2,
    }
    own = (np.array(value) for value in (wide | limits).values())
    own = CompiledLimits(*own, PullLaws(*(np.array(part, dtype=float) for part in laws)))
    code, unknown = np.array([QUERY_STATUS.index(status)], dtype=np.int8), np.array([True])
    check_limits(np.array([q]), BASE, PLATFORM, own, np.array([f], dtype=float), code, unknown)
    return QUERY_STATUS[code[0]], bool(unknown[0])


@pytest.mark.parametrize(("pull", "status"), [(8.0 - 1e-6, "ok"), (8.0 + 1e-6, "beyond_limits")])
def test_a_law_gives_the_greatest_pull_of_a_length_where_it_was_identified(pull, status):
    """Limb 1 has 0.3 m, so that 2 + 40 x + 200 x² is 8 N at its contraction of 0.1 m; limb 2 has no law."""
    within = [[2.0, 40.0, 200.0], [0.0] * 3], [0.4, 0.0], [0.05, INF], [0.15, -INF], [50.0, INF]
    outside = within[0], within[1], [0.11, INF], *within[3:]
    own = {"laws": within, "upper": [INF, INF], "open_above": [True, False]}
    assert told([pull, 1.0], **own) == (status, False)
    # Where it was not identified, the limit is not known.
    assert told([pull, 1.0], **own | {"laws": outside}) == ("ok", True)
    assert told([pull, 1.0], **own | {"laws": outside, "upper": [7.0, INF]}) == ("beyond_limits", False)
    # The tension is never beyond the ceiling, nor does a law push.
    assert told([pull, 1.0], **own | {"laws": (*within[:4], [7.9, INF])}) == ("beyond_limits", False)
    push = [[-2.0, 0.0, 0.0], [0.0] * 3]
    assert told([-1.0, 1.0], **own | {"laws": (push, *within[1:])}) == ("ok", False)
    assert told([1e-6, 1.0], **own | {"laws": (push, *within[1:])}) == ("beyond_limits", False)
    # A least tension that it cannot give at this length.
    assert told([pull, 1.0], **own, lower=[8.1, -INF])[0] == "out_of_stroke"
    assert told([7.5, 1.0], **own, lower=[7.4, -INF]) == ("ok", False)
