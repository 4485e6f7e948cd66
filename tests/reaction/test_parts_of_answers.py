"""Parts of an answer one by one: closest forces, what is open, ratios and words."""

from types import SimpleNamespace

import numpy as np

import exo_pin as ep
from exo_pin.reaction import Certificate, Reaction

NAN, INF = np.nan, np.inf


def test_a_stack_without_an_answer_is_not_trivial():
    exo = ep.load("prototype")
    poses = exo.pose(abduction=[90.0, 90.0])
    lost = exo.reaction(poses, split="minimal", limits="none")
    assert not lost.has_answer.any()
    assert lost.trivial is False
    both = exo.reaction(exo.pose(flexion=[0.0, 30.0], abduction=[90.0, 30.0]), split="minimal", limits="none")
    assert both.has_answer.tolist() == [False, True]
    assert both.trivial is True


def test_closest_forces_are_those_of_held_poses_and_of_the_evidence():
    exo = ep.load("four-cables")
    load = ep.Load(np.zeros(3), [[0.0, 0.0, 0.0], [900.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    answer = exo.reaction(exo.pose([[30.0], [60.0], [50.0]]), load=ep.Load(np.zeros(3), load.moment[:, None]))
    assert answer.held.ravel().tolist() == [True, False, True]
    near = answer.closest
    for k in (0, 2):
        np.testing.assert_array_equal(near.actuator_forces[k], answer.actuator_forces[k])
        np.testing.assert_array_equal(near.constraint_forces[k], answer.constraint_forces[k])
        np.testing.assert_array_equal(near.cuff_wrench[k], answer.cuff_wrench[k])
    proof = answer.infeasibility
    np.testing.assert_allclose(near.actuator_forces[1], proof.closest_actuator_forces[1], atol=1e-9)
    np.testing.assert_array_equal(near.constraint_forces[1], 0.0)
    # With these forces the cuff gives less than is needed by what is missing.
    missed = answer.cuff_wrench[1, 0] - near.cuff_wrench[1, 0]
    np.testing.assert_allclose(missed[3:], proof.missing_wrench[1, 0, 3:], atol=1e-7)
    # Three limbs have no other forces: beyond a limit these are no closest ones within.
    three = ep.load("three-linear-actuators").worn_by(ep.Arm.from_anthropometry(1.75, 75, "male"))
    pose = three.pose(60.0, 30.0)
    needed = np.abs(three.reaction(pose, limits="none").actuator_forces)
    top = needed + np.where(needed == needed.max(), -0.5, 10.0)
    over = three.reaction(pose, limits=(-top, top))
    assert over.status == "beyond_limits"
    assert np.count_nonzero(over.limits.force_error) == 1
    assert not (np.abs(over.closest.actuator_forces) > top + 1e-6).any()
    # Within its limits an answer is its own closest.
    held = three.reaction(pose, limits=(-needed - 1.0, needed + 1.0))
    np.testing.assert_array_equal(held.closest.actuator_forces, held.actuator_forces)


def test_what_is_open_in_poses_with_and_without_an_answer():
    """A side force of each limb that takes one; of lost poses nothing is said."""
    exo = ep.load("prototype")
    answer = exo.reaction(exo.pose(flexion=[0.0, 30.0], abduction=[90.0, 30.0]), split="minimal", limits="none")
    assert answer.has_answer.tolist() == [False, True]
    found = answer.certificate
    assert found.undetermined.tolist() == [-1, 3]
    assert found.redundant_closures.tolist() == [-1, 3]
    assert found.actuator_forces.tolist() == [[False] * 3, [True] * 3]
    assert not found.constraint_forces.any()
    assert not found.shoulder_force.any()
    assert not found.torso_wrench[0]


def test_words_on_what_equilibrium_determines():
    def told(undetermined, f, shoulder=(True, True)):
        flags = np.array(f)
        every = np.ones_like(flags)
        own = Certificate(np.array(undetermined), None, flags, every, np.array(shoulder)[:, None] & every, every, "")
        return own.statement

    text = told([1, 0], [[True, True], [True, False]])
    # A pose in which nothing is open counts like any other.
    assert text.startswith("Equilibrium alone does not determine 0 to 1 of the reactions. Determined: ")
    assert "limb forces f" not in text.split("Not determined: ")[0]
    assert "limb forces f" in text.split("Not determined: ")[1]
    lost = told([1, -1], [[True, True], [False, False]])
    assert lost.startswith("Equilibrium alone does not determine 1 of the reactions.")
    assert lost.endswith("Not determined: none.")
    own = Certificate(np.array(1), None, *[np.array([True])] * 4, "a wish", source="HIDDEN")
    assert str(own).endswith(" Assumed: a wish.")
    assert "HIDDEN" not in repr(own)
    assert told([0, 0], [[True, True], [True, True]]) == "Equilibrium determines every reaction."
    assert told([-1, -1], [[False, False], [False, False]]) == "No pose has a solution."


def test_poses_that_were_not_solved_are_not_known():
    exo = ep.load("four-cables")
    answer = exo.reaction(exo.pose([[30.0, 60.0]]))
    states = answer.equilibrium_status.astype("<U12")
    states[0, 1] = "not_solved"
    own = SimpleNamespace(source=answer.source, equilibrium_status=states, has_answer=states == "ok")
    check = Reaction.limits.func(own)
    assert check.unknown.tolist() == [[False, True]]
    assert check.can_hold.shape == (1, 2)
    assert not check.can_hold[0, 1]


def test_ratios_of_forces_that_vanish():
    def ratio(size, spherical, limbs=10.0):
        size = np.array(size)
        vectors, wrench = np.outer(spherical, [0.0, 0.6, 0.8]), np.zeros((len(size), 2, 6))
        wrench[:, 1, 2], wrench[:, :, 3:] = -limbs, 1e9
        own = SimpleNamespace(magnitude=size, spherical_force=vectors, limb_wrenches=wrench)
        return Reaction.ratio.fget(own)

    found = ratio([3.0, 3.0, 0.0, NAN, 1e-12, 0.0], [2.0, 0.0, 0.0, 2.0, 1e-12, 4.0])
    np.testing.assert_allclose(found, [1.5, INF, NAN, NAN, NAN, 0.0])
    np.testing.assert_allclose(ratio([3e-9], [2e-9]), [1.5])
