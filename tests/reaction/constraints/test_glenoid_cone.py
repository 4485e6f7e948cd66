"""The glenoid cone against its ellipse, its mirror image, and its effect on the reaction."""

import numpy as np
import pytest
from guided_limbs import guided
from mirror_image import MIRROR, mirrored
from mujoco_oracle import MujocoWrist
from scipy.spatial.transform import Rotation
from sockets import following, hanging
from wrists import random_mechanism, regular_poses

import exo_pin as ep
from exo_pin.reaction import GlenoidCone, Weights, glenoid_orientation


@pytest.mark.parametrize("approximation", ["inner", "outer"])
@pytest.mark.parametrize("faces", [3, 8, 16, 64])
def test_polyhedral_cone_and_its_stated_error(approximation, faces):
    cone = hanging(faces=faces, approximation=approximation)
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
    def axes(name=None, side="left"):
        angles = dict.fromkeys(("internal_rotation", "upward_rotation", "tilt", "retroversion", "inclination"), 0.0)
        turn = glenoid_orientation(**(angles | ({} if name is None else {name: 0.1})))
        return GlenoidCone(orientation=turn).axes(side)

    np.testing.assert_allclose(axes(), [[0, 1, 0], [0, 0, 1], [1, 0, 0]], atol=1e-15)
    np.testing.assert_allclose(axes(side="right"), [[0, -1, 0], [0, 0, 1], [1, 0, 0]], atol=1e-15)
    for side in ("left", "right"):
        assert axes("retroversion", side)[0, 0] == pytest.approx(-np.sin(0.1))  # opens backwards
        assert axes("internal_rotation", side)[0, 0] == pytest.approx(np.sin(0.1))
        assert axes("upward_rotation", side)[0, 2] == pytest.approx(np.sin(0.1))
        assert axes("inclination", side)[0, 2] == pytest.approx(np.sin(0.1))  # opens upwards
        assert axes("tilt", side)[1, 0] == pytest.approx(-np.sin(0.1))  # the upper edge goes backwards
    np.testing.assert_allclose(hanging().axes("right"), hanging().axes() @ MIRROR)
    assert GlenoidCone().error == pytest.approx(0.0192, abs=1e-4)


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_cone_follows_the_arm(side):
    cone = following(muscle_compression=30.0)
    poses = ep.shoulder_rotation([0, 0, 0, 90], [0, 90, 45, 0], [0, 20, -30, 40], side=side, degrees=True)
    axes = cone.axes(side, poses)
    ends = cone.orientation.as_matrix()[..., [1, 2, 0]].swapaxes(1, 2) @ (np.eye(3) if side == "left" else MIRROR)
    np.testing.assert_allclose(axes[[0, 1, 3]], ends[[0, 1, 1]], atol=1e-12)
    # Half way between two elevations it has turned half way, about one axis.
    turns = [Rotation.from_matrix(b.T @ a).as_rotvec() for a, b in ((axes[0], axes[2]), (axes[2], axes[1]))]
    np.testing.assert_allclose(*turns, atol=1e-9)
    forces = np.random.default_rng(5).normal(size=(4, 3))
    for row in range(4):
        used = cone.utilisation(forces, side, poses)[row]
        assert used == pytest.approx(cone.utilisation(forces[row], side, poses[row]), rel=1e-12)
        np.testing.assert_allclose(cone.half_spaces(side, poses)[0][row], cone.half_spaces(side, poses[row])[0])
    with pytest.raises(ep.InvalidInput, match="give the pose"):
        cone.axes(side)
    measured = GlenoidCone(orientation=cone.orientation[:2], elevation=[0.5, 1.0])
    with pytest.raises(ep.InvalidInput, match=r"28.6479 to 57.2958 degrees.*got 90 degrees"):
        measured.axes(side, poses[1])


@pytest.mark.parametrize("split", ["minimal", pytest.param("elastic", marks=pytest.mark.full)])
def test_programs_take_the_socket_of_each_pose(split):
    """On both sides of the body, in a stack as in single poses."""
    exo = guided(shoulder())
    poses = regular_poses(exo.mechanism, np.random.default_rng(106), 30)
    cone, options = following(muscle_compression=20.0), {"split": split, "limits": (1, 400)}
    if split == "minimal":
        options["weights"] = Weights(shear=9.0, glenoid=cone)
    found, free = exo.reaction(poses, cone=cone, **options), exo.reaction(poses, **options)
    held = found.held
    assert held.sum() > 5
    assert cone.utilisation(found.shoulder_force[held], "left", poses[held]).max() < 1 + 1e-7
    assert (cone.utilisation(free.shoulder_force[held], "left", poses[held]) > 1.01).any()
    # The cone of another elevation would have let some of them out.
    assert cone.utilisation(found.shoulder_force[held], "left", Rotation.identity()).max() > 1.01
    other = exo.mirrored().reaction(mirrored(poses), cone=cone, **options)
    np.testing.assert_array_equal(other.status, found.status)
    np.testing.assert_allclose(other.shoulder_force[held], found.shoulder_force[held] @ MIRROR, atol=1e-5)
    for k in np.flatnonzero(held)[:3]:
        alone = exo.reaction(poses[int(k)], cone=cone, **options)
        np.testing.assert_allclose(alone.shoulder_force, found.shoulder_force[k], atol=1e-6)


def shoulder():
    return ep.ShoulderExo.from_mechanism(random_mechanism(np.random.default_rng(100), 6, ["SPS"] * 6))


@pytest.mark.full
@pytest.mark.parametrize("count", [24, pytest.param(80, marks=pytest.mark.full)])
def test_constraint_keeps_the_head_in_the_socket(count):
    exo = shoulder()
    poses = regular_poses(exo.mechanism, np.random.default_rng(101), count)
    limits = {"limits": (0, 500), "split": "minimal"}
    free = exo.reaction(poses, **limits)
    cone = hanging(muscle_compression=20.0)
    kept = exo.reaction(poses, cone=cone, **limits)
    held = kept.held
    assert count // 16 < held.sum() <= free.held.sum()
    assert (cone.utilisation(free.shoulder_force[held]) > 1.01).any()
    assert cone.utilisation(kept.shoulder_force[held]).max() <= 1 + 1e-7
    assert (kept.magnitude[held] >= free.magnitude[held] - 1e-9).all()
    # More muscle holds more poses, up to those that the limbs hold at all.
    counts = [
        exo.reaction(poses, cone=hanging(muscle_compression=newtons), **limits).held.sum()
        for newtons in (0.0, 20.0, 2000.0)
    ]
    assert counts[0] <= counts[1] <= counts[2] == free.held.sum()
    # At a price no pose is lost, and a high price leads to the constraint.
    soft = exo.reaction(poses, cone=hanging(muscle_compression=20.0, penalty=1e5), **limits)
    np.testing.assert_array_equal(soft.status, free.status)
    np.testing.assert_allclose(soft.shoulder_force[held], kept.shoulder_force[held], atol=0.05)


def test_chosen_tensions_hold_the_arm_in_mujoco():
    import mujoco

    exo = shoulder()
    poses = regular_poses(exo.mechanism, np.random.default_rng(103), 100)
    oracle = MujocoWrist(exo.mechanism)
    checked = 0
    for options in ({}, {"split": "minimal"}, {"split": "minimal", "weights": Weights(4, 1, 0.01, hanging())}):
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


def test_the_cone_of_published_models_is_the_default():
    """Shear of 0.61 of the compression towards superior and of 0.34 towards anterior; of 0.5 in a circle; 16 faces."""
    turn = ep.glenoid_orientation(0, 0, 0, retroversion=0, inclination=0)
    cone, round_ = ep.GlenoidCone(orientation=turn), ep.GlenoidCone(0.5, 0.5, turn)
    out, superior, anterior = cone.axes()
    np.testing.assert_allclose(out, [0.0, 1.0, 0.0], atol=1e-15)
    for sign in (1.0, -1.0):
        for way, least, most in ((superior, 0.61, 0.5), (anterior, 0.34, 0.5)):
            assert cone.utilisation(100.0 * out + sign * 100.0 * least * way) == pytest.approx(1.0)
            assert round_.utilisation(100.0 * out + sign * 100.0 * most * way) == pytest.approx(1.0)
    N, h = cone.half_spaces()
    assert N.shape == (16, 3)
    np.testing.assert_array_equal(h, 0.0)
    assert cone.error == pytest.approx(1.0 - np.cos(np.pi / 16.0))
    assert cone.penalty is None
    # A face of the polyhedral cone lies inside the ellipse by as much as is said.
    assert (N @ (100.0 * out + (1.0 - cone.error) * 61.0 * superior)).max() == pytest.approx(0.0, abs=1e-9)
    assert cone.utilisation(np.zeros(3)) == 0.0
    assert cone.utilisation(0.25 * out + 0.1 * anterior) == pytest.approx(0.1 / 0.34 / 0.25)
    assert cone.utilisation(superior) == np.inf
