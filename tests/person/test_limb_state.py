"""Postures, paths, glenoid and contact force against MuJoCo's own quantities and finite differences."""

import runpy
from types import SimpleNamespace

import numpy as np
import pytest
from places import SCRIPTS
from scipy.spatial.transform import Rotation

import exo_pin as ep

pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")

from free_humerus import jacobians

from exo_pin.person.contact.query import _length_rates
from exo_pin.person.limb.limb_state import angles_of, limb_lengths, limb_state, model_axes, placed, thorax_to_base
from exo_pin.person.limb.myoarm import glenoid_surface, myoarm
from exo_pin.person.limb.skeleton import bone_meshes


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


def test_paths_do_not_jump_where_the_plane_of_elevation_has_no_meaning():
    rows = orientation_of([[plane, 1e-9, 0.4 + 0 * plane] for plane in np.linspace(-1.6, 2.2, 7)])
    state = limb_state(rows.as_matrix(), 0.5, 0.0, 1.0, left=False)
    assert np.abs(state.moment - state.moment[:1]).max() < 1e-7
    assert not state.outside.any()


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


def test_arm_is_a_free_body_in_balance():
    """Lines of action of the muscles from MuJoCo's Jacobians, weights from the segments of the person's arm."""
    person = ep.Person(1.75, 75, "male", elbow_flexion=40, payload=2.0, side="right", degrees=True)
    angles = np.random.default_rng(1).uniform([-15, 5, -30], [80, 100, 40], (12, 3)).T
    poses = ep.shoulder_rotation(*angles, side="right", degrees=True)
    load = ep.Load([5.0, -8.0, 12.0], moment=[0.4, -0.3, 0.2], at=(0.0, 0.0, -0.2))
    result = person.joint_contact(poses, load=load)
    assert (result.status == "ok").all()
    to_base = thorax_to_base(myoarm())
    for row, R in enumerate(poses.as_matrix()):
        force, moments, axes = jacobians(*angles_of(myoarm(), R[None])[0], person.elbow_flexion, 0.0)
        tension = result.muscle_forces[row]
        weight = person.arm.mass * np.array([0.0, 0.0, -9.81])
        pull = force.T @ tension @ to_base.T
        balance = result.force[row] + pull + weight + load.force
        largest = max(np.linalg.norm(result.force[row]), tension.max())
        assert np.abs(balance).max() < 1e-9 * largest
        outer = np.cross(R @ person.arm.centre_of_mass, weight) + load.moment + np.cross(R @ load.at, load.force)
        about = person.length_scale * tension @ moments[:, :3] + axes @ to_base.T @ outer
        assert np.abs(about).max() < 1e-9 * largest
        assert abs(tension @ moments[:, 4]) * person.length_scale < 1e-9 * largest
    assert result.residual.max() < 1e-12


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


def test_faces_of_every_bone_join_its_corners_up_to_the_last():
    bones = bone_meshes("right")
    for vertices, faces in bones.values():
        assert (faces.min(), faces.max()) == (0, len(vertices) - 1)
    # A picture has no more triangles than it needs.
    assert sum(len(faces) for _, faces in bones.values()) < 50_000


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
