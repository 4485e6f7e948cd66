"""Strokes and force limits of poses, one rule at a time, where each outcome is known by hand."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from exo_pin.reaction.answer import QUERY_STATUS
from exo_pin.reaction.batch.limit_kernels import CompiledLimits, check_limits
from exo_pin.reaction.constraints.actuator_limits import PullLaws

pytestmark = pytest.mark.usefixtures("plain")

#: Two limbs of 0.3 and 0.5 m in the pose of zero angles.
BASE = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]])
PLATFORM = np.array([[0.0, 0.0, -0.3], [0.1, 0.3, -0.4]])
NAN, INF = np.nan, np.inf
NO_LAWS = [[0.0]] * 2, [0.0] * 2, [INF] * 2, [-INF] * 2, [INF] * 2


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


def test_within_all_known_limits_nothing_is_marked_or_unknown():
    assert told() == ("ok", False)
    assert told(status="near_singular") == ("near_singular", False)


@pytest.mark.parametrize("limb", [0, 1])
def test_each_end_of_each_stroke_counts(limb):
    length = (0.3, 0.5)[limb]
    for name, off, out in (
        ("shortest", 1e-6, True),
        ("shortest", -1e-6, False),
        ("longest", -1e-6, True),
        ("longest", 1e-6, False),
    ):
        ends = [0.1, 0.1] if name == "shortest" else [0.9, 0.9]
        ends[limb] = length + off
        assert told(**{name: ends}) == ("out_of_stroke" if out else "ok", False)
        # By an estimate it is out for all that is known, but not for sure.
        estimated = [k == limb for k in range(2)]
        assert told(**{name: ends}, estimated=estimated) == ("out_of_stroke" if out else "ok", True)
        ends[limb] = NAN
        assert told(**{name: ends}) == ("ok", True)


def test_lengths_are_those_of_the_turned_platform():
    turn = Rotation.from_rotvec([0.4, -0.2, 0.7])
    lengths = np.linalg.norm(turn.apply(PLATFORM) - BASE, axis=1)
    for off, status in ((1e-9, "ok"), (-1e-9, "out_of_stroke")):
        assert told(q=turn.as_quat(), longest=lengths + off)[0] == status
        assert told(q=turn.as_quat(), shortest=lengths - off)[0] == status


@pytest.mark.parametrize(("limb", "sign"), [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)])
def test_forces_may_pass_their_limits_by_rounding_of_the_largest_alone(limb, sign):
    f = np.array([2.0, 2.0])
    f[limb] = sign * 8.0
    name = "upper" if sign > 0.0 else "lower"
    for off, status in ((0.5e-9, "ok"), (2e-9, "beyond_limits")):
        limit = np.full(2, sign * INF)
        limit[limb] = sign * 8.0 * (1.0 - off)
        assert told(f, **{name: limit}) == (status, False)


def test_a_limit_that_is_not_known_leaves_the_outcome_open_where_it_may_act():
    for f, below, above, unknown in (
        ([5.0, 1.0], [False, False], [True, False], True),
        ([5.0, 1.0], [False, False], [False, True], True),
        ([5.0, -1.0], [False, False], [False, True], False),
        ([5.0, -1.0], [False, True], [False, False], True),
        ([5.0, 1.0], [True, True], [False, False], False),
        ([5.0, 1e-10], [False, False], [False, True], False),
        ([5.0, -1e-10], [False, True], [False, False], False),
    ):
        assert told(f, open_below=below, open_above=above) == ("ok", unknown)
    # What is beyond a known limit is so whatever others are.
    assert told([5.0, 1.0], upper=[4.0, INF], open_above=[False, True]) == ("beyond_limits", False)


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


def test_a_stroke_goes_before_a_force_and_an_estimate_does_not_decide_beside_it():
    assert told([5.0, 1.0], upper=[4.0, INF], longest=[0.2, 0.9]) == ("out_of_stroke", False)
    assert told([5.0, 1.0], upper=[4.0, INF], longest=[0.2, 0.9], estimated=[True, False]) == ("out_of_stroke", False)
    assert told(longest=[0.2, 0.4], estimated=[True, False]) == ("out_of_stroke", False)


def test_poses_without_forces_are_checked_for_their_lengths_alone_or_left():
    none = (NAN, NAN)
    assert told(none, "infeasible", upper=[0.0, 0.0], open_above=[True, True]) == ("infeasible", False)
    assert told(none, "infeasible", longest=[0.2, 0.9]) == ("out_of_stroke", False)
    assert told(none, "infeasible", longest=[0.2, 0.9], estimated=[True, True]) == ("out_of_stroke", False)
    for status in ("singular", "folded"):
        assert told(none, status, longest=[0.2, 0.9]) == (status, False)
