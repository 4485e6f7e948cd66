"""Every sentence of a verdict, from checks and axes that are written down here with the words they have to give."""

import numpy as np
import pytest

from exo_pin.reaction.holding.hold_check import HoldCheck
from exo_pin.reaction.holding.verdict import describe_axis, verdict

NAN, INF = np.nan, np.inf
OK = np.array("ok")


def check(shape=(), n=3, **given):
    """A check of poses that keep all limits, but for what is given."""
    zero = np.zeros((*shape, n))
    no = np.zeros(shape, dtype=bool)
    fields = {"can_hold": no, "violated": no, "unknown": no, "missing": (), "estimated": ()}
    fields |= dict.fromkeys(("length_error", "force_error", "excess_speed", "tensions"), zero)
    return HoldCheck(**(fields | {key: np.array(v) if isinstance(v, list | bool) else v for key, v in given.items()}))


def broken(**given):
    """The reasons of one pose that breaks limits."""
    text = verdict(check(violated=np.array(True), **given), OK)
    assert text.startswith("The device cannot hold this pose: ")
    return text.removeprefix("The device cannot hold this pose: ")


def test_a_pose_without_an_answer_says_why():
    lost = check()
    assert verdict(lost, np.array("not_solved")) == (
        "It is not known whether the device can hold this pose: its equilibrium could not be solved."
    )
    assert verdict(lost, np.array("singular")) == (
        "The device cannot hold this pose: it is singular, and the limbs cannot resist a moment about some axis."
    )
    assert "a moment about the vertical axis (0.00, 0.00, 1.00)." in verdict(
        lost, np.array("singular"), np.array([0.0, 0.0, -2.0])
    )
    for status, words in (
        ("folded", "a joint of a limb lies in the shoulder's centre"),
        ("no_equilibrium", "no equilibrium is near it"),
        ("guide_overloaded", "the guide of a limb would have to bear more than it can"),
        ("out_of_reach", "the device does not reach it"),
    ):
        assert verdict(lost, np.array(status)) == f"The device cannot hold this pose: {words}."


DRIVES = (("lift", "N m"), ("rope", "N"), ("wearer about z", "N m"))


def test_each_limit_of_a_drive_has_its_words():
    def told(**given):
        return broken(drives=DRIVES, **given)

    assert told(passive=True) == "a joint without drive would be beyond its range."
    assert told(tensions=[50.0, 7.0, 1.0], force_error=[20.0, 0.0, 0.0]) == (
        "lift would have to give 50 N m (it gives at most 30 N m)."
    )
    assert told(tensions=[-50.0, 7.0, 1.0], force_error=[-20.0, 0.0, 0.0]) == (
        "lift would have to give -50 N m (it gives at least -30 N m)."
    )
    # A limit of zero is none that it gives.
    assert told(tensions=[1.0, -7.0, 1.0], force_error=[0.0, -7.0, 0.0]) == "rope would have to push with 7 N."
    assert told(tensions=[1.0, -7.0, 1.0], force_error=[0.0, -7.0 + 1e-5, 0.0]) == (
        "rope would have to push with 7 N (at most 1e-05 N)."
    )
    # A slide whose effort is no tension pushes where it is positive.
    slide = {"tensions": [1.0, 7.0, 1.0], "force_error": [0.0, 2.0, 0.0]}
    assert told(**slide) == "rope would have to pull with 7 N (at most 5 N)."
    assert told(**slide, pulls=(False, False, False)) == "rope would have to push with 7 N (at most 5 N)."
    assert told(tensions=[1.0, 2.0, 1.0], force_error=[0.0, -3.0, 0.0]) == (
        "rope would pull with only 2 N (at least 5 N)."
    )
    assert told(tensions=[1.0, 1.0, 2.5], force_error=[NAN, INF, 2.5]) == (
        "the wearer's own muscles would have to add 2.5 N m about the vertical axis (0.00, 0.00, 1.00)."
    )
    assert told(excess_speed=[0.5, 0.25, 0.0]) == (
        "rope would have to be 0.25 m/s faster than the actuator can; lift would have to be 0.5 rad/s faster than the "
        "actuator can."
    )
    assert told(length_error=[-np.pi / 6.0, 0.012, 0.0]) == (
        "rope would be 12 mm too long; lift would be 30° beyond its range."
    )
    slides = told(length_error=[0.0, -0.012, 0.0], pulls=(False, False, False))
    assert slides == "rope would be 12 mm beyond its range."
    assert told(length_error=[INF, NAN, 0.0]) == "lift cannot take this position."


def test_a_stack_counts_the_poses_of_each_reason():
    def count(status=("ok",) * 4, lacking="", **given):
        return verdict(check((4,), **given), np.array(status), lacking=lacking)

    each = np.array
    assert count(asked=False) == (
        'It is not known which of 4 poses the device can hold: limits were left out (limits="none").'
    )
    assert count(can_hold=each([1, 1, 1, 1], bool)) == "The device can hold 4 of 4 poses."
    assert count() == "The device can hold none of 4 poses."
    some = {"can_hold": each([1, 0, 0, 0], bool), "unknown": each([0, 1, 1, 1], bool)}
    assert count(**some) == "The device can hold 1 of 4 poses, and 3 more if the unknown limits allow it."
    likely = "limbs[0].stroke.end_fitting"
    assert count(**some, estimated=(likely,)) == (
        "The device can hold 1 of 4 poses, and 3 more if the estimates are right."
    )
    assert count(**some, estimated=(likely,), missing=("mass",)).endswith("3 more if the unknown limits allow it.")
    assert count(unknown=each([0, 0, 1, 1], bool)) == "The device can hold 2 of 4 poses if the unknown limits allow it."
    # Neither a broken limit nor a pose without equilibrium is likely.
    assert count(("ok", "ok", "not_solved", "ok"), unknown=each([0, 1, 1, 1], bool), violated=each([0, 0, 0, 1], bool),
                 length_error=each([[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, INF, 0]], float)) == (
        "1 of 4 poses: can hold if the unknown limits allow it; 2: cannot hold; 1: not known, because the equilibrium "
        "could not be solved. Where it cannot: an actuator cannot take the length of its limb (1)."
    )  # fmt: skip
    assert count(("not_evaluated",) * 4, asked=False, lacking="of that") == (
        'It is not known which of 4 poses the device can hold: limits were left out (limits="none"); 4 have no result, '
        "because of that."
    )
    errors = 0.25 * each([[-1, 0, 0], [2, 0, 0], [0, -1, NAN], [0, 0, 0]], float)
    assert count(violated=each([1, 1, 1, 1], bool), force_error=errors, length_error=2.0 * errors) == (
        "The device can hold none of 4 poses: a limb would have to push (2), a limb would have to pull too hard (1), a "
        "limb would be too short (2), a limb would be too long (1)."
    )
    statuses = ("infeasible", "infeasible", "folded", "singular")
    assert count(statuses, violated=each([1, 1, 1, 1], bool), force_error=errors * [[1], [0], [0], [0]],
                 excess_speed=each([[0, 0.5, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]], float)) == (
        "The device can hold none of 4 poses: a limb would have to push (1), a limb would have to be too fast (1), the "
        "pose is singular (1), a joint of a limb lies in the shoulder's centre (1), no forces within the limits "
        "balance it (1)."
    )  # fmt: skip
    statuses = ("no_equilibrium", "guide_overloaded", "out_of_reach", "ok")
    assert count(statuses, can_hold=each([0, 0, 0, 1], bool), drives=DRIVES, force_error=errors,
                 length_error=errors) == (
        "The device can hold 1 of 4 poses; in the others a drive would have to give more than it can (3), a drive "
        "would be beyond its range (3), no equilibrium is near the pose (1), the guide of a limb would be overloaded "
        "(1), the device does not reach the pose (1)."
    )  # fmt: skip


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_axis_is_named_after_the_nearest_of_three(sign):
    def words(*axis):
        return describe_axis(sign * np.array(axis))

    assert words(3.0, 0.0, 0.0) == "the forward axis (1.00, 0.00, 0.00)"
    assert words(np.sin(0.015), -np.cos(0.015), 0.0) == "the sideways axis (-0.01, 1.00, 0.00)"
    assert words(np.sin(0.02), -np.cos(0.02), 0.0) == "an axis 1° from the sideways axis (-0.02, 1.00, 0.00)"
    assert words(-0.004, 0.3, -0.95) == "an axis 18° from the vertical axis (0.00, -0.30, 0.95)"
