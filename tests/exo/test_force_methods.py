"""What the one object a user holds accepts, and what it says of a pose."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog
from sockets import hanging
from wrists import PERSON, exo_of, random_mechanism, regular_poses

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.control import Turn
from exo_pin.control.controllers.model_controller import gains_for


@pytest.fixture(scope="module")
def cables():
    return ep.load("four-cables")


def strong(exo, **limits):
    """The design with linear actuators of stated limits that take any length."""
    limb = ep.Limb(actuator=ep.Actuator("linear", **limits), stroke=ep.Stroke(0.3, 0.01, 10.0, 0.0))
    return exo.replace(limbs=[limb] * len(exo.limbs))


def test_a_number_is_a_bound_to_either_side(exo):
    pose = exo.pose(40, 20)
    one = exo.reaction(pose, split="minimal", constraint_bounds=20)
    other = exo.reaction(pose, split="minimal", constraint_bounds=(-20, 20))
    np.testing.assert_array_equal(one.shoulder_force, other.shoulder_force)
    one, other = exo.reaction(pose, limits=5.0), exo.reaction(pose, limits=(-5, 5))
    np.testing.assert_array_equal(one.infeasibility.relief, other.infeasibility.relief)
    for option in ("constraint_bounds", "limits"):
        with pytest.raises(InvalidInput, match="zero or more"):
            exo.reaction(pose, split="minimal", **{option: -5})


def test_movement_is_a_stack_of_poses_with_its_motion(exo):
    times = np.linspace(0, 1, 30)
    movement = ep.Movement.from_samples(times, exo.pose(40 * np.sin(times), 10 * times))
    one = exo.reaction(movement)
    other = exo.reaction(movement.poses, movement.motion)
    np.testing.assert_array_equal(one.shoulder_force, other.shoulder_force)
    with pytest.raises(InvalidInput, match="motion of its own"):
        exo.reaction(movement, movement.motion)


def test_prototype_cannot_hold_a_lifted_arm_and_says_why(exo):
    answer = exo.reaction(exo.pose(60, 30))
    assert answer.status == "out_of_stroke"
    assert answer.equilibrium_status == "ok"
    assert answer.has_answer
    assert not answer.can_hold
    assert not answer.unknown
    f, lengths = answer.actuator_forces, exo.inverse_kinematics(exo.pose(60, 30)).lengths
    for words in (
        f"limbs 1 and 3 would have to push with {-f[0]:.0f} and {-f[2]:.0f} N",
        f"limb 2 would have to pull with {f[1]:.0f} N (at most 73 N)",
        f"limb 2 would be {1e3 * (0.75 * 0.25 + 0.154 - lengths[1]):.0f} mm too short",
    ):
        assert words in answer.verdict
    assert str(answer).startswith("The device cannot hold this pose")


def test_length_alone_is_judged_by_an_estimate(exo):
    weightless = exo.replace(gravity=[0, 0, -1e-6]).reaction(exo.pose(60, 30))
    assert not weightless.can_hold
    lengths = weightless.limits.length_error
    assert (lengths < 0).any()
    only = strong(exo, pull_limit=500.0, push_limit=500.0)
    limbs = [replace(limb, stroke=own.stroke) for limb, own in zip(only.limbs, exo.limbs, strict=True)]
    judged = exo.replace(limbs=limbs, estimated=exo.mechanism.estimated).reaction(exo.pose(60, 30))
    assert judged.unknown
    assert not judged.can_hold
    assert "probably cannot hold" in judged.verdict
    assert "estimate of end fitting of limbs 1, 2 and 3" in judged.verdict


def test_known_limits_that_are_met_hold_the_pose(exo):
    answer = strong(exo, pull_limit=500.0, push_limit=300.0).reaction(exo.pose(60, 30))
    assert answer.can_hold
    assert answer.status == "ok"
    assert answer.verdict.startswith("The device can hold this pose.")
    weak = strong(exo, pull_limit=500.0, push_limit=250.0).reaction(exo.pose(60, 30))
    assert not weak.can_hold
    assert "limb 1 would have to push with 264 N (at most 250 N)" in weak.verdict


def test_unknown_limits_are_named(exo):
    answer = exo.replace(limbs=None).reaction(exo.pose(60, 30))
    assert answer.unknown
    assert not answer.can_hold
    assert answer.status == "ok"
    assert "not known: stroke of limbs 1, 2 and 3, actuator of limbs 1, 2 and 3" in answer.verdict


def test_estimates_of_replaced_limbs_are_forgotten(exo):
    assert exo.mechanism.estimated
    assert strong(exo, pull_limit=1.0).mechanism.estimated == ()
    assert exo.worn_by(PERSON).mechanism.estimated == exo.mechanism.estimated


def test_singular_pose_names_the_axis_that_is_not_held(exo):
    answer = exo.reaction(exo.pose(0, 90))
    assert answer.status == "singular"
    axis = exo.singularity(exo.pose(0, 90)).lost_direction
    assert abs(axis[1]) > 0.999
    assert "cannot resist a moment about the sideways axis" in answer.verdict


def test_spare_limbs_are_judged_by_the_best_tensions(cables):
    pose = cables.pose(60, 30)
    plain, held = cables.reaction(pose, limits="none"), cables.reaction(pose)
    assert plain.actuator_forces.min() < 0.0
    assert not plain.can_hold
    assert plain.unknown
    assert held.can_hold
    assert held.actuator_forces.min() >= -1e-9
    np.testing.assert_allclose(
        held.shoulder_force + held.limb_wrenches[:, :3].sum(axis=0), [0, 0, 9.81 * cables.arm.mass], atol=1e-9
    )


def test_spare_limbs_without_a_choice_have_the_forces_of_equilibrium(cables):
    """In some poses the tensions that the cables can give lead F_s out of the socket."""
    poses, cone = cables.pose([20, 40, 60, 80, 100, 120], 60), hanging(muscle_compression=30.0)
    plain, held = cables.reaction(poses, limits="none"), cables.reaction(poses, cone=cone)
    lost = np.flatnonzero(held.status == "infeasible")
    assert lost.size
    assert cables.reaction(poses).can_hold[lost].any()
    assert not held.can_hold[lost].any()
    np.testing.assert_allclose(held.shoulder_force[lost], plain.shoulder_force[lost], atol=1e-9)
    # In the other poses of the stack they stay within limits and socket.
    kept = held.can_hold
    assert kept.any()
    assert held.actuator_forces[kept].min() >= -1e-9
    assert cone.utilisation(held.shoulder_force[kept]).max() <= 1.0 + 1e-7


def _can_be_held(answer, k):
    """Whether tensions of 0 to 3000 N and any side forces balance the arm without a shoulder, by a linear program."""
    state, upu = answer.source.poses.state.row(k), answer.source.poses.upu
    n = len(state.closure)
    A = np.block(
        [
            [state.moment_of_f, np.zeros((3, upu.size))],
            [state.shoulder_of_f, state.shoulder_of_g[:, upu]],
        ]
    )
    b = np.concatenate([state.moment, -state.shoulder])
    bounds = [(0.0, 3000.0)] * n + [(None, None)] * upu.size
    return linprog(np.zeros(n + upu.size), A_eq=A, b_eq=b, bounds=bounds).status == 0


@pytest.mark.parametrize(("sides", "cables"), [(0, 6), (0, 7), (1, 4), (3, 2)])
def test_without_a_shoulder_only_tensions_that_leave_it_unloaded_count(sides, cables):
    kinds = ["UPU"] * sides + ["SPS"] * cables
    rng = np.random.default_rng(90)
    mechanism = random_mechanism(rng, len(kinds), kinds)
    pull = ep.Actuator("cable", pull_limit=3000.0)
    stroke = ep.Stroke(0.3, 0.01, 10.0, 0.0)
    exo = exo_of(mechanism.replace(limbs=[ep.Limb(kind, actuator=pull, stroke=stroke) for kind in kinds]))
    poses = regular_poses(mechanism, rng, 15, margin=0.1)
    alone, held = (exo.reaction(poses, split="standalone", limits=bounds) for bounds in ("none", "design"))
    assert alone.has_answer.all()
    np.testing.assert_allclose(alone.shoulder_force, 0.0, atol=1e-6)
    np.testing.assert_array_equal(held.can_hold, [_can_be_held(held, k) for k in range(len(poses))])
    np.testing.assert_allclose(held.shoulder_force[held.can_hold], 0.0, atol=1e-6)
    assert held.actuator_forces[held.can_hold].min(initial=0.0) >= -1e-9
    # With a shoulder, other tensions hold some more of these poses, unless three side forces can replace it.
    assert (exo.reaction(poses).can_hold & ~held.can_hold).any() == (sides < 3)


def test_pose_that_cannot_be_held_leaves_the_tensions_of_the_others_within_their_limits(cables):
    poses = cables.pose([60, 110, 20], [30, 96, 0])
    held, plain = cables.reaction(poses), cables.reaction(poses, limits="none")
    assert held.can_hold.tolist() == [True, False, True]
    for row in (0, 2):
        assert plain.actuator_forces[row].min() < 0.0
        alone = cables.reaction(poses[row])
        np.testing.assert_allclose(held.actuator_forces[row], alone.actuator_forces, rtol=1e-12, atol=1e-12)
        assert held.actuator_forces[row].min() >= -1e-9
    np.testing.assert_array_equal(held.actuator_forces[1], plain.actuator_forces[1])


def test_limb_without_actuator_has_no_limits(cables):
    limbs = [*cables.limbs[:3], replace(cables.limbs[3], actuator=None)]
    answer = cables.replace(limbs=limbs).reaction(cables.pose([60, 20], [30, 0]))
    assert answer.unknown.all()
    assert (answer.actuator_forces[:, :3] >= -1e-9).all()


def test_remedy_leads_to_a_pose_that_can_be_held(exo):
    weak = strong(ep.load("prototype"), pull_limit=20.0, push_limit=20.0)
    pose = weak.pose(40, 20, 10)
    assert not weak.reaction(pose).can_hold
    found = weak.remedy(pose)
    assert weak.reaction(found.nearest.pose).can_hold
    assert (found.nearest.pose * pose.inv()).magnitude() == pytest.approx(found.nearest.distance)
    # Half way there it cannot be held: the search has not gone further than it had to.
    turn = (found.nearest.pose * pose.inv()).as_rotvec()
    for share in (0.5, 0.9):
        assert not weak.reaction(type(pose).from_rotvec(share * turn) * pose).can_hold
    assert "N m about" in str(found)
    assert exo.remedy(exo.pose(60, 30)).nearest is None
    with pytest.raises(InvalidInput, match="single rotation"):
        weak.remedy(weak.pose([0, 10]))


def test_stack_counts_poses_and_reasons(exo):
    answer = exo.reaction(exo.pose([0, 30, 60]))
    assert answer.can_hold.shape == (3,)
    pushes = int((answer.limits.force_error < 0).any(axis=-1).sum())
    assert answer.verdict.startswith("The device can hold none of 3 poses: ")
    assert f"a limb would have to push ({pushes})" in answer.verdict


@pytest.mark.full
def test_the_contact_force_of_a_run_has_its_peak_after_a_fault():
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    man = ep.Person(1.75, 75, "male")
    exo = ep.load("four-linear-actuators-worn").worn_by(man)
    still = Turn(exo.pose(60.0, 30.0), np.array([0.0, 0.0, 1e-9]), 0.2)
    gains = replace(gains_for(exo.moved_record), lost_beyond=0.01)
    run = exo.track(still, "model", duration=0.6, faults=(ep.Fault("torn", 0, start=0.2),), feedback=gains)
    found, every = exo.joint_contact_of_run(run, man), exo.joint_contact_of_run(run, man, rate=1000.0)
    assert len(found.magnitude) < 0.2 * len(every.magnitude)
    assert found.magnitude.max() > 1.5 * found.magnitude[0]
    assert found.magnitude.max() == pytest.approx(every.magnitude.max(), rel=1e-3)
    k = int(np.linalg.norm(run.run.shoulder_force, axis=1).argmax())
    motion = ep.Motion(run.run.angular_velocity[k], run.run.angular_acceleration[k])
    alone = exo.joint_contact(run.run.rotations[k], man, forces=run.run.tensions[k], motion=motion)
    assert alone.magnitude == pytest.approx(every.magnitude.max(), rel=1e-6)
