"""The glenoid cone against its ellipse, its mirror image, and its effect on the reaction."""

import numpy as np
import pytest
from mujoco_oracle import MujocoWrist
from scipy.spatial.transform import Rotation
from wrists import random_mechanism, regular_poses

import exo_pin as ep
from exo_pin.core.conventions import MIRROR
from exo_pin.reaction import GlenoidCone, Weights


@pytest.mark.parametrize("approximation", ["inner", "outer"])
@pytest.mark.parametrize("faces", [3, 8, 16, 64])
def test_polyhedral_cone_and_its_stated_error(approximation, faces):
    cone = GlenoidCone(retroversion=0.02, inclination=0.12, protraction=0.5, faces=faces, approximation=approximation)
    axes = cone.axes()
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
    N, h = cone.half_spaces()
    np.testing.assert_allclose(np.linalg.norm(N, axis=1), 1)
    np.testing.assert_array_equal(h, 0)
    # In every direction of shear: how far out the polyhedral cone reaches, over how far the ellipse does.
    phi = 2 * np.pi * np.arange(1920) / 1920  # corners of all four polygons among them
    shear = np.stack([cone.superior * np.cos(phi), cone.anterior * np.sin(phi)], axis=-1) @ axes[1:]
    with np.errstate(divide="ignore"):
        reach = -(N @ axes[0]) / np.maximum(shear @ N.T, 0.0)
    reach = reach.min(axis=1)
    if approximation == "inner":
        assert reach.max() <= 1 + 1e-12
        assert 1 - reach.min() == pytest.approx(cone.error, rel=1e-3)
    else:
        assert reach.min() >= 1 - 1e-12
        assert reach.max() - 1 == pytest.approx(cone.error, rel=1e-3)
    np.testing.assert_allclose(cone.utilisation(axes[0] + shear), 1, rtol=1e-12)
    assert np.isinf(cone.utilisation(-axes[0]))
    assert cone.utilisation(np.zeros(3)) == 0.0


def test_axes_point_where_they_should():
    np.testing.assert_allclose(GlenoidCone().axes(), [[0, 1, 0], [0, 0, 1], [1, 0, 0]], atol=1e-15)
    np.testing.assert_allclose(GlenoidCone().axes("right")[0], [0, -1, 0], atol=1e-15)
    assert GlenoidCone(retroversion=0.1).axes()[0, 0] < 0  # opens backwards
    assert GlenoidCone(protraction=0.1).axes()[0, 0] > 0
    assert GlenoidCone(inclination=0.1).axes()[0, 2] > 0  # opens upwards
    cone = GlenoidCone(retroversion=0.1, inclination=0.2)
    np.testing.assert_allclose(cone.axes("right"), cone.axes() @ MIRROR)
    assert GlenoidCone.circular(0.5).superior == GlenoidCone.circular(0.5).anterior == 0.5
    assert GlenoidCone().error == pytest.approx(0.0192, abs=1e-4)


def shoulder():
    return ep.ShoulderExo.from_mechanism(random_mechanism(np.random.default_rng(100), 6, ["SPS"] * 6))


@pytest.mark.parametrize("count", [24, pytest.param(80, marks=pytest.mark.full)])
def test_constraint_keeps_the_head_in_the_socket(count):
    exo = shoulder()
    poses = regular_poses(exo.mechanism, np.random.default_rng(101), count)
    limits = {"limits": (0, 500), "split": "minimal"}
    free = exo.reaction(poses, **limits)
    cone = GlenoidCone(muscle_compression=20.0)
    kept = exo.reaction(poses, cone=cone, **limits)
    held = kept.held
    assert count // 16 < held.sum() <= free.held.sum()
    assert (cone.utilisation(free.shoulder_force[held]) > 1.01).any()
    assert cone.utilisation(kept.shoulder_force[held]).max() <= 1 + 1e-7
    assert (kept.magnitude[held] >= free.magnitude[held] - 1e-9).all()
    # More muscle holds more poses, up to those that the limbs hold at all.
    counts = [
        exo.reaction(poses, cone=GlenoidCone(muscle_compression=newtons), **limits).held.sum()
        for newtons in (0.0, 20.0, 2000.0)
    ]
    assert counts[0] <= counts[1] <= counts[2] == free.held.sum()
    # At a price no pose is lost, and a high price leads to the constraint.
    soft = exo.reaction(poses, cone=GlenoidCone(muscle_compression=20.0, penalty=1e5), **limits)
    np.testing.assert_array_equal(soft.status, free.status)
    np.testing.assert_allclose(soft.shoulder_force[held], kept.shoulder_force[held], atol=0.05)


def test_muscles_as_a_load_are_muscles_in_the_cone():
    exo = shoulder()
    poses = regular_poses(exo.mechanism, np.random.default_rng(102), 15)
    plain = GlenoidCone(inclination=0.1)
    load = ep.Load(plain.muscle_load(80.0))
    a = exo.reaction(poses, load=load, limits="pull", cone=plain)
    b = exo.reaction(poses, limits="pull", cone=GlenoidCone(inclination=0.1, muscle_compression=80.0))
    np.testing.assert_array_equal(a.status, b.status)
    held = a.held
    assert held.any()
    np.testing.assert_allclose(a.shoulder_force[held], b.shoulder_force[held] + 80 * plain.axes()[0], atol=1e-6)


def test_chosen_tensions_hold_the_arm_in_mujoco():
    import mujoco

    exo = shoulder()
    poses = regular_poses(exo.mechanism, np.random.default_rng(103), 100)
    oracle = MujocoWrist(exo.mechanism)
    checked = 0
    for options in ({}, {"split": "minimal"}, {"split": "minimal", "weights": Weights(4, 1, 0.01)}):
        answer = exo.reaction(poses, limits=(2, 400), **options)
        for k in np.flatnonzero(answer.held):
            oracle.data.qpos[:] = poses[int(k)].as_quat(scalar_first=True)
            oracle.data.qvel[:], oracle.data.xfrc_applied[:] = 0.0, 0.0
            oracle.data.ctrl[:] = -answer.actuator_forces[k]
            mujoco.mj_forward(oracle.model, oracle.data)
            largest = np.abs(answer.actuator_forces[k]).max()
            assert np.abs(oracle.data.qfrc_bias - oracle.data.qfrc_actuator).max() <= 1e-9 * largest
            sensed = oracle.data.site("O").xmat.reshape(3, 3) @ oracle.data.sensordata[:3]
            np.testing.assert_allclose(sensed, answer.shoulder_force[k], atol=1e-7 * largest)
            checked += 1
    assert checked > 30


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"superior": 0.0}, "above zero"),
        ({"inclination": 7.1}, "degrees"),
        ({"faces": 2}, "3 to 256"),
        ({"faces": 8.0}, "integer"),
        ({"approximation": "exact"}, "inner, outer"),
        ({"muscle_compression": -1.0}, "zero or more"),
        ({"penalty": 0.0}, "above zero"),
    ],
)
def test_cones_that_cannot_be(arguments, message):
    with pytest.raises(ep.InvalidInput, match=message):
        GlenoidCone(**arguments)
    with pytest.raises(ep.InvalidInput, match="above zero"):
        Weights(shear=0.0)
    with pytest.raises(ep.InvalidInput, match="GlenoidCone"):
        Weights(glenoid=Rotation.identity())
