"""Sentences of certificates, of cautions and of ranges, from records that are written down."""

import numpy as np
from wrists import random_mechanism, regular_poses

import exo_pin as ep
from exo_pin.reaction import Certificate, ForceRange

NAN, INF = np.nan, np.inf


def certificate(undetermined, f, g, shoulder, torso=True, **more):
    flags = (np.array(flag) for flag in (f, g, shoulder, torso))
    return Certificate(np.array(undetermined), np.array(0), *flags, "a wish", **more)


def test_statements_word_by_word():
    assert certificate(-1, False, False, False).statement == "The arm cannot be held in this pose."
    assert certificate([-1, -1], [False] * 2, [False] * 2, [False] * 2).statement == "No pose has a solution."
    sure = certificate([0, -1], [True, False], [True, False], [True, False], [True, False])
    assert str(sure) == "Equilibrium determines every reaction."
    one = certificate(3, [True, True], [False, True], False)
    assert str(one) == (
        "Equilibrium alone does not determine 3 of the reactions. Determined: limb forces f, total wrench on the "
        "torso. Not determined: side forces g, shoulder force F_s. Assumed: a wish."
    )
    some = certificate([1, 0, 3, -1], [[True]] * 3 + [[False]], [[True]] * 4, [[True]] * 4, [True] * 4)
    assert some.statement == (
        "Equilibrium alone does not determine 0 to 3 of the reactions. Determined: limb forces f, side forces g, "
        "shoulder force F_s, total wrench on the torso. Not determined: none."
    )
    assert str(some).endswith("Not determined: none. Assumed: a wish.")
    other = certificate([2], [[False]], [[False]], [[False]], [False], words=("efforts", "structure"))
    assert "Determined: none. Not determined: efforts, structure, shoulder force F_s" in other.statement


def test_ranges_word_by_word():
    def told(*ends):
        return ForceRange(*(np.array(end) for end in ends))

    assert str(told(NAN, NAN, NAN)) == "no set of forces is allowed"
    assert str(told(3.0, INF, INF)) == "3.00 N to unbounded"
    assert str(told(3.0, 3.0 + 1e-7, 3.0)) == "3.00 N, the only value"
    assert str(told(3.0, 3.001, 3.001)) == "3.00 to 3.00 N"
    assert str(told(3.0, 9.0, 9.0)) == "3.00 to 9.00 N"
    assert str(told(3.0, 9.0, 8.0)) == "3.00 to at most 9.00 N (at least 8.00 N)"
    assert str(told(0.0, 1e-10, 1e-10)) == "0 N, the only value"
    assert str(told(1.0, 30.0, 30.0 - 1e-5)) == "1.00 to 30.0 N"
    assert str(told(1.0, 30.0, 30.0 - 1e-4)) == "1.00 to at most 30.0 N (at least 30.0 N)"
    assert told([0.0, 1.0], [1e-8, 1.0], [0.0, 1.0]).is_single.tolist() == [False, True]
    stack = told([1.0, NAN, 2.0], [4.0, NAN, 9.0], [4.0, NAN, 9.0])
    assert str(stack) == "3 poses, largest |F_s| of the allowed forces 9.00 N"
    assert str(told([1.0, 2.0], [INF, 7.0], [INF, 7.0])).endswith("forces 7.00 N; unbounded in 1")
    assert str(told([1.0], [INF], [INF])) == "1 poses, largest |F_s| of the allowed forces -; unbounded in 1"


def test_what_an_answer_was_chosen_by_names_limits_and_socket_where_a_pose_keeps_them():
    exo = ep.load("four-cables")
    poses, far = exo.pose([40.0, 40.0], 20.0), np.array([0.0, 900.0])
    facing = ep.glenoid_orientation(35, 0, -10, retroversion=5, inclination=8, degrees=True)

    def chosen_by(moments, **asked):
        couples = np.array(moments)[:, None] * [1.0, 0.0, 0.0]
        return exo.reaction(poses, load=ep.Load(np.zeros(3), couples), **asked).certificate.chosen_by

    plain = chosen_by(far, limits="none")
    limits, socket = ", within the limits of the limbs", ", with regard to the socket"
    assert chosen_by(far) == plain + limits
    assert chosen_by(far + 900.0) == plain
    soft = ep.GlenoidCone(orientation=facing, penalty=1.0)
    assert chosen_by(far, cone=soft) == plain + limits + socket
    assert chosen_by(far, limits="none", cone=soft) == plain + socket


def test_slack_limbs_are_counted_in_held_poses():
    exo, rest = ep.load("four-cables"), "slack: a least tension of the actuator (least_tension) keeps a limb taut."

    def slack(answer):
        return [text for text in answer.cautions if "slack" in text]

    one = exo.reaction(exo.pose(60.0, 30.0))
    loose = np.flatnonzero(np.abs(one.actuator_forces) < 1e-9 * np.abs(one.actuator_forces).max()) + 1
    assert len(loose) == 1
    assert slack(one) == [f"Limb {loose[0]} is {rest}"]
    # An arm of a gram counts alike: shares of the largest force, however small that is.
    light = exo.replace(arm=ep.Arm(1e-3, exo.arm.centre_of_mass))
    assert slack(light.reaction(exo.pose(60.0, 30.0))) == [f"Limb {loose[0]} is {rest}"]
    poses = exo.pose([60.0, 20.0, 90.0, 0.0, 60.0], [30.0, 80.0, 0.0, 30.0, 30.0])
    moments = np.zeros((5, 3))
    moments[4, 0] = 900.0
    stack = exo.reaction(poses, load=ep.Load(np.zeros(3), moments))
    assert stack.held.tolist() == [True] * 4 + [False]
    f = np.abs(stack.actuator_forces[:4])
    none = f <= 1e-9 * f.max(axis=1, keepdims=True)
    loose = (np.flatnonzero(none.any(axis=0)) + 1).tolist()
    assert len(loose) > 1
    each = [f"limb {limb} in {int(none[:, limb - 1].sum())}" for limb in loose]
    names = f"{', '.join(each[:-1])} and {each[-1]}"
    assert slack(stack) == [f"Of 4 held poses limbs are slack, {names}{rest.removeprefix('slack')}"]
    # Limbs that may push, or that a least tension keeps taut, are not slack.
    assert slack(exo.replace(limbs=[ep.Limb("SPS")] * 4).reaction(poses, limits=(-5.0, 1e4))) == []
    assert slack(exo.reaction(exo.pose(60.0, 30.0), limits=(2.0, 1e4))) == []


def test_side_forces_beyond_ten_times_the_others_are_named():
    mechanism, named = random_mechanism(np.random.default_rng(4), 3), 0
    exo = ep.ShoulderExo.from_mechanism(mechanism)
    for pose in regular_poses(mechanism, np.random.default_rng(5), 40, margin=0.01):
        answer = exo.reaction(pose, split="minimal", limits="none")
        plain = exo.reaction(pose, limits="none")
        side, needed = np.abs(answer.constraint_forces).max(), np.abs(plain.actuator_forces).max()
        ratio = side / max(needed, float(plain.magnitude))
        text = [text for text in answer.cautions if "Side forces reach" in text]
        assert text == [
            f"Side forces reach {side:.3g} N, {ratio:.0f} times the forces without them: nothing bounds them there "
            "(constraint_bounds does)."
        ] * int(ratio > 10.0)
        named += len(text)
    assert 2 <= named <= 30
