"""Postures, paths and glenoid of the anatomical model against MuJoCo's own quantities and finite differences."""

import runpy
from types import SimpleNamespace

import numpy as np
import pytest
from mirror_image import MIRROR, mirrored
from places import SCRIPTS
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import OutsideRangeOfMotion
from exo_pin.load_case.motion_and_load import elevation_angle

pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")

from free_humerus import jacobians

from exo_pin.person import MUSCLES
from exo_pin.person.contact.query import _length_rates
from exo_pin.person.limb.limb_state import angles_of, limb_lengths, limb_state, model_axes, placed, thorax_to_base
from exo_pin.person.limb.myoarm import glenoid_surface, myoarm

#: A person of the model's own size.
HEIGHT = 1.741 * 0.2907243711831287 / 0.2817


def orientation_of(angles):
    """From plane, elevation and axial rotation, shape (N, 3), to right upper arms."""
    K = model_axes(myoarm())
    plane, elevation, rotation = np.asarray(angles).T
    turn = Rotation.from_euler("ZXZ", np.stack([plane, elevation, rotation - plane], axis=1)).as_matrix()
    return Rotation.from_matrix(K @ turn @ K.T)


def some_angles(count, seed):
    return np.random.default_rng(seed).uniform([-1.6, 0.02, -1.5], [2.2, 2.8, 2.0], (count, 3))


def test_orientation_of_the_humerus_is_met():
    limb = myoarm()
    angles = some_angles(40, 1)
    R = orientation_of(angles).as_matrix()
    assert np.abs(angles_of(limb, R) - angles).max() < 1e-9
    to_base = thorax_to_base(limb)
    rest = None
    for row in range(-1, len(angles)):
        data = placed(limb, np.zeros(3) if row < 0 else angles[row], 0.3, 0.2)
        humerus = to_base @ data.xmat[limb.root].reshape(3, 3).T @ data.xmat[limb.humerus].reshape(3, 3)
        rest = humerus if rest is None else rest
        if row >= 0:
            assert np.abs(humerus @ rest.T - R[row]).max() < 1e-9


def test_elevation_is_that_of_the_arm_in_every_plane():
    R = Rotation.random(200, rng=5)
    angles = angles_of(myoarm(), R.as_matrix())
    assert np.abs(angles[:, 1] - elevation_angle(R)).max() < 1e-12


def test_paths_do_not_jump_where_the_plane_of_elevation_has_no_meaning():
    rows = orientation_of([[plane, 1e-9, 0.4 + 0 * plane] for plane in np.linspace(-1.6, 2.2, 7)])
    state = limb_state(rows.as_matrix(), 0.5, 0.0, 1.0, left=False)
    assert np.abs(state.moment - state.moment[:1]).max() < 1e-7
    assert not state.outside.any()


def test_rest_is_a_hanging_arm_with_the_forearm_bending_forwards():
    state = limb_state(np.eye(3)[None], 0.0, 0.0, 1.0, left=False)
    assert np.abs(state.angles).max() < 1e-12
    assert np.abs(state.centre).max() == 0.0
    limb = myoarm()
    data = placed(limb, np.zeros(3), 0.0, 0.0)
    to_base = thorax_to_base(limb) @ data.xmat[limb.root].reshape(3, 3).T
    elbow = to_base @ (data.xpos[limb.ulna] - data.xpos[limb.humerus])
    assert np.degrees(np.arccos(-elbow[2] / np.linalg.norm(elbow))) == pytest.approx(1.48, abs=0.05)
    # Flexion about an axis to the right swings -z towards +x.
    assert np.cross(state.elbow_axis[0], [0, 0, -1])[0] > 0.99


def test_pulls_and_moments_are_those_of_mujocos_jacobians():
    limb, to_base = myoarm(), thorax_to_base(myoarm())
    angles = some_angles(25, 2)
    rng = np.random.default_rng(3)
    for row, (elbow, forearm) in zip(angles, rng.uniform([0, -1.5], [2.2, 1.5], (25, 2)), strict=True):
        state = limb_state(orientation_of(row[None]).as_matrix(), elbow, forearm, 1.0, left=False)
        force, moments, axes = jacobians(*angles_of(limb, orientation_of(row[None]).as_matrix())[0], elbow, forearm)
        assert np.abs(state.pull[0] @ to_base - force).max() < 1e-9
        assert np.abs(state.moment[0] @ to_base @ axes.T - moments[:, :3]).max() < 1e-9
        assert np.abs(state.elbow[0] - moments[:, 3]).max() < 1e-9
        assert np.abs(state.forearm[0] - moments[:, 4]).max() < 1e-9


def test_moments_are_minus_the_changes_of_length_with_the_scapula_held():
    limb = myoarm()
    turn, steps, misses = 1e-6, 0, []
    for angles in some_angles(15, 4):
        state = limb_state(orientation_of(angles[None]).as_matrix(), 0.6, 0.1, 1.0, left=False)
        for joint in (0, 1, 3):
            lengths = []
            for sign in (1.0, -1.0):
                data = placed(limb, angles, 0.6, 0.1)
                axis = thorax_to_base(limb) @ data.xmat[limb.root].reshape(3, 3).T @ data.xaxis[limb.angles[joint]]
                data.qpos[limb.angles[joint]] += sign * turn
                limb.mujoco.mj_kinematics(limb.model, data)
                limb.mujoco.mj_comPos(limb.model, data)
                limb.mujoco.mj_tendon(limb.model, data)
                lengths.append(data.ten_length[limb.tendons].copy())
            rate = (lengths[0] - lengths[1]) / (2.0 * turn)
            misses.append(np.abs(rate + state.moment[0] @ axis))
            steps += 1
    # Rounding of a length of 0.4 m over the step, times ten; a path that starts to wrap within the step is rare.
    close = np.array(misses) < 1e-8
    assert close.mean() > 0.995
    assert steps == 45


def test_left_arm_is_the_mirror_image():
    R = orientation_of(some_angles(10, 6))
    right = limb_state(R.as_matrix(), 0.4, 0.2, 1.1, left=False)
    left = limb_state(mirrored(R).as_matrix(), 0.4, 0.2, 1.1, left=True)
    assert np.abs(left.pull - right.pull @ MIRROR).max() < 1e-9
    assert np.abs(left.moment + right.moment @ MIRROR).max() < 1e-9
    assert np.abs(left.glenoid - right.glenoid @ MIRROR).max() < 1e-9
    assert np.abs(left.elbow - right.elbow).max() < 1e-9
    assert (
        np.abs(np.cross(left.elbow_axis, [0, 0, -1.0]) - np.cross(right.elbow_axis, [0, 0, -1.0]) @ MIRROR).max() < 1e-9
    )


def test_lengths_scale_and_directions_stay():
    R = orientation_of(some_angles(4, 7)).as_matrix()
    one, two = (limb_state(R, 0.4, 0.2, scale, left=False) for scale in (1.0, 2.0))
    for name in ("centre", "moment", "elbow", "forearm", "length"):
        assert np.allclose(getattr(two, name), 2.0 * getattr(one, name), rtol=1e-14)
    assert np.array_equal(one.pull, two.pull)


def test_shoulder_muscles_have_a_pull_and_elbow_muscles_none_at_the_shoulder():
    state = limb_state(orientation_of(some_angles(3, 8)).as_matrix(), 0.5, 0.0, 1.0, left=False)
    crossing = {*MUSCLES[:16], "BIClong", "BICshort"}
    for index, name in enumerate(MUSCLES):
        assert bool(np.abs(state.pull[:, index]).max() > 0.1) == (name in crossing)


def test_glenoid_is_fitted_to_the_mesh():
    script = runpy.run_path(str(SCRIPTS / "glenoid_surface.py"))
    centre, axes, height, width, triangles = script["fitted"]()
    np.testing.assert_allclose(glenoid_surface().centre, centre, rtol=0, atol=1e-15)
    np.testing.assert_allclose(glenoid_surface().axes, axes, rtol=0, atol=1e-14)
    assert np.allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert 0.034 < height < 0.042
    assert 0.024 < width < 0.031
    vertices, faces = script["scapula_mesh"](myoarm(all_bones=True))
    spots = vertices[np.unique(faces[triangles])] - centre
    # A shallow dish: deep against its plane by less than a fifth of its width.
    assert np.ptp(spots @ axes[0]) < 0.2 * width
    joint = myoarm().model.body("scapphant_r").pos
    assert (joint - centre) @ axes[0] == pytest.approx(0.0306, abs=0.0005)


def test_scapula_turns_the_socket_upwards_with_elevation():
    abduction = np.radians([0.0, 30.0, 60.0, 90.0, 120.0])
    R = ep.shoulder_rotation(0, abduction, 0, side="right")
    up = np.degrees(np.arcsin(limb_state(R.as_matrix(), 0.0, 0.0, 1.0, left=False).glenoid[:, 0, 2]))
    assert (np.diff(up) > 5.0).all()
    assert 30.0 < up[3] - up[0] < 45.0  # about a third of the elevation


@pytest.mark.parametrize(
    ("flexion", "abduction", "rotation", "name"),
    [(0, 40, 125, "axial rotation"), (-110, 0, 0, "plane of elevation"), (0, 40, -100, "axial rotation")],
)
def test_poses_beyond_the_range_are_refused_with_angle_and_limits(flexion, abduction, rotation, name):
    person = ep.Person(1.75, 75, "male")
    bad = ep.shoulder_rotation(flexion, abduction, rotation, degrees=True)
    if name == "plane of elevation":
        bad = Rotation.from_euler("ZYZ", [-150, -60, 150], degrees=True)
    with pytest.raises(OutsideRangeOfMotion, match=name) as caught:
        person.joint_contact(bad)
    assert caught.value.count == 1
    assert not person.allows(bad)
    both = Rotation.concatenate([Rotation.identity(), bad])
    assert person.allows(both).tolist() == [True, False]
    assert person.joint_contact(both, outside="mark").status.tolist() == ["ok", "outside"]


def test_a_little_adduction_and_extension_is_allowed():
    person = ep.Person(1.75, 75, "male")
    assert person.allows(ep.shoulder_rotation([-9, 0, 5], [0, -9, -5], 0, degrees=True)).all()


def test_centre_path_holds_in_every_plane_of_elevation():
    for side in ("left", "right"):
        person = ep.Person(1.70, 70, "female", side=side)
        path = person.centre_path()
        R = orientation_of(some_angles(40, 9))
        R = mirrored(R) if side == "left" else R
        there = person.limb_state(R).centre
        at = path.at(elevation_angle(R))
        assert np.abs(at - there).max() < 5e-6
        outwards = path.displacement[-1, 1] * (1 if side == "left" else -1)
        assert outwards < -0.03  # the centre moves to the body
        assert path.displacement[-1, 2] > 0.04  # and up


def test_model_without_the_meshes_of_pictures_moves_as_the_whole_one():
    """No mesh is needed for forces; they take most of the time of compiling."""
    light, whole = myoarm(), myoarm(all_bones=True)
    assert light.model.nmesh == 0 < whole.model.nmesh
    for name in (
        "body_pos",
        "body_quat",
        "body_parentid",
        "site_pos",
        "site_bodyid",
        "jnt_axis",
        "eq_data",
        "jnt_range",
    ):
        np.testing.assert_array_equal(getattr(light.model, name), getattr(whole.model, name))
    for name in ("root", "scapula", "humerus", "ulna", "radius"):
        assert getattr(light, name) == getattr(whole, name)
    rng = np.random.default_rng(5)
    for _ in range(5):
        q = rng.uniform(*light.model.jnt_range.T)
        lengths = []
        for limb in (light, whole):
            data = limb.mujoco.MjData(limb.model)
            data.qpos[:] = q
            limb.mujoco.mj_kinematics(limb.model, data)
            limb.mujoco.mj_comPos(limb.model, data)
            limb.mujoco.mj_tendon(limb.model, data)
            lengths.append(data.ten_length.copy())
        np.testing.assert_array_equal(*lengths)


def test_rates_of_lengths_are_those_along_the_motion():
    """Whatever the speed: muscles lengthen by their rates in a millisecond, and twice as fast at twice the speed."""
    person, rng = ep.Person(1.8, 79.3, "male"), np.random.default_rng(8)
    matrices = orientation_of(some_angles(3, 8)).as_matrix()
    posture = person.elbow_flexion, person.forearm_rotation, person.length_scale, person.scapular_motion
    for speed in (0.3, 4.0):
        way = rng.normal(size=(3, 3))
        velocity = speed * way / np.linalg.norm(way, axis=1, keepdims=True)
        found = _length_rates(person, SimpleNamespace(matrices=matrices, velocity=velocity))
        h = 1e-4 / speed
        ends = [limb_lengths(Rotation.from_rotvec(s * h * velocity).as_matrix() @ matrices, *posture) for s in (1, -1)]
        np.testing.assert_allclose(found, (ends[0] - ends[1]) / (2 * h), atol=2e-5 * speed)
        assert np.abs(found).max() > 0.01 * speed
    assert (_length_rates(person, SimpleNamespace(matrices=matrices, velocity=0.0 * velocity)) == 0.0).all()
