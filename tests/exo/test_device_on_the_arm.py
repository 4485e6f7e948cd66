"""What a device puts on the arm of its wearer, by the geometry of its limbs, whoever chooses their forces."""

import numpy as np
import pytest
from places import URDF

pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")

import exo_pin as ep
from exo_pin.exo.pose_report import report_on_pose

MAN = ep.Person(1.75, 75, "male")
SHIFT = np.array([0.004, -0.006, 0.008])


def wrench(exo, poses, f, shift=0.0):
    """About O: tensions along the limbs, and the weight of the device's own part; both ends are shifted alike."""
    R, geometry = poses.as_matrix(), exo.geometry
    b = np.einsum("...ij,nj->...ni", R, geometry.platform_points + shift)
    pull = geometry.base_points + shift - b
    pull = f[..., None] * pull / np.linalg.norm(pull, axis=-1, keepdims=True)
    (own,) = (part for part in exo.arm.parts if part.device)
    weight, at = own.mass * exo.mechanism.gravity, R @ own.centre_of_mass
    forces = pull.sum(axis=-2) + weight
    return np.concatenate([forces, np.cross(b, pull).sum(axis=-2) + np.cross(at, weight)], axis=-1)


@pytest.fixture(scope="module")
def cables():
    return ep.load("four-cables").worn_by(MAN)


@pytest.mark.parametrize("side", ["left", "right"])
def test_limbs_pull_along_their_lines_whoever_chooses(cables, side):
    exo = cables if side == "left" else cables.mirrored()
    poses = exo.pose([[20.0, 60.0], [80.0, 40.0]], [[20.0, 10.0], [20.0, 40.0]])
    given = exo.reaction(poses).actuator_forces
    low, high = 0.0, exo.limbs[0].actuator.pull_limit
    for forces in (given, given[0, 0], "least_effort", "least_contact"):
        for shift in (None, SHIFT):
            told = exo.joint_contact(poses, MAN, forces, centre_offset=shift)
            f = told.device_forces
            np.testing.assert_allclose(
                told.device_wrench, wrench(exo, poses, f, 0.0 if shift is None else shift), atol=1e-7
            )
            if isinstance(forces, str):
                assert low - 1e-6 <= f.min() <= f.max() <= high + 1e-6
                assert told.held.all()
                assert not told.caution.startswith("Limb")
            else:
                np.testing.assert_array_equal(f, np.broadcast_to(forces, f.shape))
            assert told.assumptions["device"].endswith("; no side forces")


def test_what_is_beyond_the_limits_is_counted(cables):
    poses = cables.pose([20.0, 60.0, 80.0], 20.0)
    given = np.array(cables.reaction(poses).actuator_forces)
    given[1, 2] = -1.0
    told = cables.joint_contact(poses, MAN, given)
    assert told.held.tolist() == [True, False, True]
    assert told.caution == "Limb lengths or forces are beyond the device's limits in 1 of 3 poses."
    alone = cables.joint_contact(poses[1], MAN, given[1])
    assert alone.caution == "Limb lengths or forces are beyond the device's limits."
    most = given.max(axis=1)
    weak = cables.reaction(poses, limits=(0.0, 0.7 * float(most.max())))
    closest = cables.joint_contact(poses, MAN, weak)
    np.testing.assert_array_equal(closest.held, weak.can_hold)
    assert 0 < (~weak.can_hold).sum() < 3
    count = int((~weak.can_hold).sum())
    assert f"limits in {count} of 3 poses; the closest forces that it can give are taken there." in closest.caution
    np.testing.assert_allclose(closest.device_wrench, wrench(cables, poses, closest.device_forces), atol=1e-7)


def test_side_forces_that_are_given_are_those_of_a_reaction():
    exo = ep.load("prototype").worn_by(MAN)
    poses = exo.pose([30.0, 50.0], [30.0, 10.0])
    answer = exo.reaction(poses, split="minimal", constraint_bounds=15.0, limits="none")
    f, g = answer.actuator_forces, answer.constraint_forces
    assert (np.abs(g) > 1.0).any(axis=1).all()
    there = exo.joint_contact(poses, MAN, answer)
    same = exo.joint_contact(poses, MAN, f, constraint_bounds=(g, g))
    np.testing.assert_allclose(same.device_wrench, there.device_wrench, atol=1e-6)
    np.testing.assert_allclose(same.constraint_forces, g, atol=1e-9)
    assert "given limb forces; side forces and activations of least contact force" in same.assumptions["device"]
    # Together with the muscles they load the joint no more than those that are best without muscles.
    free = exo.joint_contact(poses, MAN, f, constraint_bounds=15.0)
    assert (free.magnitude <= same.magnitude + 1e-6).all()
    assert (np.abs(free.constraint_forces) <= 15.0 + 1e-6).all()
    chosen = exo.joint_contact(poses, MAN, "least_effort", limits="none", constraint_bounds=15.0)
    assert "chosen together with the activations; side forces of the limbs with them" in chosen.assumptions["device"]
    with pytest.raises(ep.InvalidInput, match=r"None, a number or \(lower, upper\) in N"):
        exo.joint_contact(poses, MAN, f, constraint_bounds="much")


@pytest.mark.parametrize("name", ["serial-y-x-z", "3rps-passive-ball"])
def test_drives_put_on_the_arm_what_their_reaction_does(name):
    exo = ep.load(URDF / f"{name}.urdf").worn_by(MAN)
    poses = exo.pose([[30.0, 60.0]], [[20.0, 40.0]])
    answer = exo.reaction(poses, limits="none")
    efforts = np.array(answer.actuator_forces)
    efforts[..., len(exo.device.drives) :] = 0.0  # what the wearer adds is no part of the device
    there = exo.joint_contact(poses, MAN, answer)
    same = exo.joint_contact(poses, MAN, efforts, limits="none")
    np.testing.assert_allclose(same.device_wrench, there.device_wrench, atol=1e-8)
    np.testing.assert_allclose(there.device_wrench, answer.cuff_wrench, atol=1e-9)
    # Twice the efforts put twice as much on it, but for the weights of its links.
    zero, one, two = (
        exo.joint_contact(poses, MAN, k * efforts, limits="none", outside="mark").device_wrench for k in (0.0, 1.0, 2.0)
    )
    np.testing.assert_allclose(two - one, one - zero, atol=1e-8)
    assert np.abs(one - zero).max() > 1.0
    if name == "serial-y-x-z":
        given = exo.joint_contact(poses, MAN, 0.5 * efforts, limits="none")
        effort, contact = (
            exo.joint_contact(poses, MAN, f"least_{what}", limits="none") for what in ("effort", "contact")
        )
        assert (effort.effort <= given.effort + 1e-9).all()
        assert (contact.magnitude <= np.minimum(given.magnitude, effort.magnitude) + 0.1).all()
        assert "chosen together with the activations" in effort.assumptions["device"]


def test_a_run_is_answered_at_its_rate_and_where_the_shoulder_bears_most(cables):
    tracking = cables.track("flexion", "model", duration=0.6)
    run = tracking.run
    step = round((len(run.times) - 1) / 3)
    peak = int(np.linalg.norm(run.shoulder_force, axis=1).argmax())
    rows = np.unique([*range(0, len(run.times), step), peak])
    assert np.diff(run.times[::step]) == pytest.approx(0.2, abs=0.02)
    found = cables.joint_contact_of_run(tracking, MAN, rate=5.0)
    motion = ep.Motion(run.angular_velocity[rows], run.angular_acceleration[rows])
    more = {"motion": motion, "load": run.external_load(rows), "outside": "mark"}
    there = cables.joint_contact(run.rotations[rows], MAN, run.tensions[rows], **more)
    np.testing.assert_allclose(found.force, there.force, rtol=1e-9)
    np.testing.assert_array_equal(found.device_forces, run.tensions[rows])
    np.testing.assert_allclose(cables.joint_contact_of_run(run, MAN, rate=5.0).force, found.force, rtol=1e-9)


CERTAIN = ("offset_mm", "pose_deg", "A_mm", "B_mm", "mass_percent", "centre_of_mass_mm", "load_percent", "tone_percent")


def test_draws_of_what_is_certain_are_the_answer_and_tone_loads_the_joint(cables):
    pose, load = cables.pose(60.0, 20.0), ep.Load([0.0, 0.0, -8.0], at=[0.0, 0.0, -0.25])
    certain = dict.fromkeys(CERTAIN, 0.0)
    sure = cables.total_uncertainty(pose, MAN, load=load, draws=8, uncertainties=certain)
    answer = cables.reaction(pose, load=load)
    joint = cables.joint_contact(pose, MAN, answer, load=load)
    np.testing.assert_allclose(sure.shoulder_forces, answer.magnitude, rtol=1e-9)
    np.testing.assert_allclose(sure.joint_forces, joint.magnitude, rtol=1e-6)
    assert (sure.magnitude, sure.joint_N) == pytest.approx((float(answer.magnitude), float(joint.magnitude)))
    assert sure.title.startswith("four-cables, flexion 60°, abduction 20°")
    tense = cables.total_uncertainty(
        pose, MAN, load=load, draws=8, seed=1, uncertainties=certain | {"tone_percent": 40.0}
    )
    assert (tense.joint_forces >= joint.magnitude - 1e-6).all()
    assert tense.joint_forces.max() > joint.magnitude + 1.0
    # Nobody is asked for muscles without a person.
    alone = cables.total_uncertainty(pose, load=load, draws=8, uncertainties=dict.fromkeys(CERTAIN[:-1], 0.0))
    assert np.isnan(alone.joint_N)
    assert np.isnan(alone.joint_forces).all()


def test_a_load_on_the_hand_is_carried_by_the_elbow(cables):
    """What acts beyond the elbow loads it too: of one on the upper arm it does not."""
    pose, bent = cables.pose(60.0), MAN.with_changes(elbow_flexion=1.0)
    for at, on in (((0.0, 0.0, -0.5), "forearm"), ((0.0, 0.0, -0.2), "upper arm")):
        load = ep.Load([0.0, 0.0, -15.0], at=at)
        answer = cables.reaction(pose, load=load)
        told = report_on_pose(cables, answer, bent).contact
        options = ep.ContactOptions(load_on=on)
        same = cables.joint_contact(pose, bent, answer, load=load, options=options)
        other = cables.joint_contact(pose, bent, answer, load=load, options=ep.ContactOptions(
            load_on="forearm" if on == "upper arm" else "upper arm"))  # fmt: skip
        np.testing.assert_allclose(told.force, same.force, rtol=1e-6)
        assert np.abs(told.force - other.force).max() > 0.1


def test_what_stands_where_the_posture_says_is_in_the_contact():
    """Given efforts take the configuration that was asked for, and the bodies beside it are those of the reaction."""
    exo = ep.load(URDF / "serial-y-x-z.urdf").worn_by(MAN)
    pose = exo.pose(80.0, 80.0)
    answer = exo.reaction(pose, limits="none")
    there = exo.joint_contact(pose, MAN, answer, outside="mark")
    same = exo.joint_contact(pose, MAN, answer.actuator_forces, limits="none", outside="mark")
    words = answer.verdict.partition("As it is worn, ")[2]
    assert words
    for contact in (there, same):
        assert words.split(" (")[0] in contact.caution
    lift = ep.Movement.from_samples(np.linspace(0.0, 1.0, 21), exo.pose(np.linspace(20.0, 40.0, 21)))
    moving = exo.joint_contact(lift, MAN)
    assert moving.status.shape == (21,)
    with pytest.raises(ep.InvalidInput, match="its own centre_offset"):
        exo.joint_contact(pose, MAN, answer, posture={"flexion": 0.1})
