"""Parts of an answer one by one: balance, marks, closest forces and words, from written-down records."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from wrists import random_mechanism, regular_poses

import exo_pin as ep
from exo_pin.reaction import SPLITS, Certificate, Reaction
from exo_pin.reaction.answer import BEYOND, QUERY_STATUS, _balance_residual, _mark_non_finite, answered, chosen_forces
from exo_pin.reaction.constraints.actuator_limits import LimbLimits
from exo_pin.reaction.indeterminacy.certificate import certificate_of
from exo_pin.reaction.indeterminacy.infeasibility import closest_forces
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


def test_why_limits_are_not_met_goes_by_rank():
    """A stroke goes before a speed, and a lost equilibrium of soft parts before both."""
    mechanism = random_mechanism(np.random.default_rng(3), 3, ["SPS"] * 3)
    exo = ep.ShoulderExo.from_mechanism(mechanism)
    answer = exo.reaction(regular_poses(mechanism, np.random.default_rng(4), 6, 0.05), limits="none")
    none, every = np.zeros((6, 3)), np.ones((6, 3), dtype=bool)
    error, speed = none.copy(), none.copy()
    error[[1, 3, 5], 0], speed[[2, 3], 1] = 0.01, 0.2
    limits = LimbLimits(none - INF, none + INF, ~every, ~every, error, True, speed)
    lost = np.array([0, 0, 0, 0, 1, 1], dtype=bool)
    poses = answer.source.poses._replace(limits=limits, moved=SimpleNamespace(infeasible=lost))
    found = chosen_forces(SPLITS["spherical"], poses)
    names = [QUERY_STATUS[code] for code in found.unmet]
    assert names == ["ok", "out_of_stroke", "beyond_limits", "out_of_stroke", "infeasible", "infeasible"]
    np.testing.assert_allclose(found.f, answer.actuator_forces)
    asked = poses._replace(limits=LimbLimits(none - INF, none + INF, ~every, ~every, error, False, speed))
    assert (chosen_forces(SPLITS["spherical"], asked).unmet == 0).all()


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
    near = closest_forces(answer)
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
    # Forces that are beyond a limit, and no evidence of others: nothing is known. One limb is enough.
    three = ep.load("three-linear-actuators").worn_by(ep.Arm.from_anthropometry(1.75, 75, "male"))
    needed = three.reaction(three.pose(60.0, 30.0), limits="none")
    top = np.abs(needed.actuator_forces) + np.array([10.0, 10.0, 10.0])
    worst = int(np.abs(needed.actuator_forces).argmax())
    top[worst] -= 10.5
    over = three.reaction(three.pose(60.0, 30.0), limits=(-top, top))
    assert over.status == "beyond_limits"
    assert np.count_nonzero(over.limits.force_error) == 1
    fake = SimpleNamespace(
        actuator_forces=over.actuator_forces, constraint_forces=over.constraint_forces, cuff_wrench=over.cuff_wrench,
        infeasibility=None, held=over.held, limits=over.limits,
    )  # fmt: skip
    assert all(np.isnan(part).all() for part in closest_forces(fake))
    # Without a force beyond its limit what is known stays.
    fake.limits = SimpleNamespace(force_error=np.zeros(3))
    np.testing.assert_array_equal(closest_forces(fake).actuator_forces, over.actuator_forces)
    fake.limits, fake.held = over.limits, np.array(True)
    np.testing.assert_array_equal(closest_forces(fake).actuator_forces, over.actuator_forces)


def test_closest_forces_take_tensions_and_side_forces_from_the_evidence():
    rng = np.random.default_rng(12)
    f, g, near_f, near_g = rng.normal(size=(4, 2, 3, 4))
    cuff, of_f, of_g = rng.normal(size=(2, 3, 6)), rng.normal(size=(6, 4, 6)), rng.normal(size=(6, 4, 6))
    lost = np.array([[True, False, True], [False, True, False]])
    state = SimpleNamespace(on_arm_of=lambda f, g: f[..., None] * of_f + g[..., None] * of_g)
    evidence = SimpleNamespace(infeasible=lost, closest_actuator_forces=near_f, closest_constraint_forces=near_g)
    limits, poses = SimpleNamespace(force_error=np.ones((2, 3, 4))), SimpleNamespace(state=state)
    own = SimpleNamespace(
        actuator_forces=f, constraint_forces=g, cuff_wrench=cuff, infeasibility=evidence, held=~lost, limits=limits,
        source=SimpleNamespace(poses=poses),
    )  # fmt: skip
    found = closest_forces(own)
    np.testing.assert_allclose(found.actuator_forces, np.where(lost[..., None], near_f, f))
    np.testing.assert_allclose(found.constraint_forces, np.where(lost[..., None], near_g, g))
    change = np.einsum("ki,kij->kj", (near_f - f).reshape(6, 4), of_f)
    change += np.einsum("ki,kij->kj", (near_g - g).reshape(6, 4), of_g)
    np.testing.assert_allclose(found.cuff_wrench, np.where(lost[..., None], cuff + change.reshape(2, 3, 6), cuff))
    np.testing.assert_allclose(own.actuator_forces, f)  # the answer stays


def test_what_is_open_in_poses_with_and_without_an_answer():
    """Of four limbs one tension is, and a side force of each that takes one; of lost poses nothing is said."""
    exo = ep.ShoulderExo.from_mechanism(random_mechanism(np.random.default_rng(6), 4, ["UPU", "SPS", "UPU", "SPS"]))
    good = regular_poses(exo.mechanism, np.random.default_rng(7), 2, 0.1)
    answer = exo.reaction(good, limits="none")
    values = answer.source.values.copy()
    values[0] = NAN
    found = certificate_of(replace(answer.source, values=values))
    assert found.undetermined.tolist() == [-1, 3]
    assert found.redundant_closures.tolist() == [-1, 2]
    assert found.constraint_forces.tolist() == [[False] * 4, [False, True, False, True]]
    assert found.torso_wrench.tolist() == [False, True]
    assert not found.actuator_forces[0].any()
    assert not found.shoulder_force.any()


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
