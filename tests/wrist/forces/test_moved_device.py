"""The device at given displacements, and which rows of a stack an equilibrium is sought for."""

import numpy as np
import pytest
from guided_limbs import guided
from scipy.spatial.transform import Rotation
from wrists import MECHANISMS, random_mechanism, regular_poses

import exo_pin as ep
from exo_pin.load_case.pose_stacks import arm_loads, as_query
from exo_pin.wrist.forces.displaced import Displaced, MovedDevice
from exo_pin.wrist.forces.elastic_equilibrium import ElasticEquations, settle
from exo_pin.wrist.limbs import classify

SOFT = ep.Interfaces(ep.Interface.of(3e4, 500.0, [0, 0.05, 0]), ep.Interface.upper_arm_cuff(0.2, 4.0))


def equations_of(interfaces, seed, locked=False, count=2, EI=60.0, kinds=None):
    exo = guided(
        ep.ShoulderExo.from_mechanism(random_mechanism(np.random.default_rng(seed), 3, kinds)),
        ep.LimbGuide(EI, 0.8 * EI),
    )
    mechanism, rng = exo.replace(interfaces=interfaces).mechanism, np.random.default_rng(seed)
    poses = regular_poses(mechanism, rng, count, margin=0.05)
    base, cuff = 0.004 * rng.normal(size=(2, count, 3))

    def loads(rows, matrices):
        return arm_loads(mechanism.arm, mechanism.gravity, as_query(Rotation.from_matrix(matrices)))

    return ElasticEquations(mechanism, as_query(poses), base, cuff, loads, 2e4 * np.eye(3), locked)


@pytest.mark.parametrize("interfaces", [ep.Interfaces(), SOFT], ids=["rigid", "soft"])
def test_lengths_of_moved_limbs_are_those_between_the_moved_points(interfaces):
    """Base ring and platform are carried by harness and cuff; the arm's centre has moved by δ."""
    equations = equations_of(interfaces, 210)
    geometry, rows = equations.mechanism.geometry, np.arange(2)
    x = 0.01 * np.random.default_rng(211).normal(size=(2, equations.size))
    moved = MovedDevice(equations, rows, x).movement
    soft = equations.size > 3
    np.testing.assert_array_equal(moved.displacement, x[:, :3])
    np.testing.assert_array_equal(np.hstack([moved.harness, moved.cuff]), x[:, 3:] if soft else np.zeros((2, 12)))
    for k in rows:
        own = equations.mechanism.interfaces
        base, platform = geometry.base_points + equations.base[k], geometry.platform_points + equations.cuff[k]
        if soft:
            for points, part, give in ((base, own.harness, moved.harness[k]), (platform, own.cuff, moved.cuff[k])):
                points[:] = part.at + give[:3] + Rotation.from_rotvec(give[3:]).apply(points - part.at)
        ends = moved.displacement[k] + Rotation.from_matrix(moved.arm[k]).apply(platform)
        np.testing.assert_allclose(moved.lengths[k], np.linalg.norm(ends - base, axis=1), rtol=1e-13)
    assert moved.forces is None


def test_a_guide_without_a_stable_shape_leaves_the_rows_beside_it_alone():
    """Its own forces are those of straight guides: numbers, with a NaN for its bending."""
    equations = equations_of(ep.Interfaces(), 212, EI=0.5)
    size = 0.3 * equations.mechanism.geometry.platform_radius
    directions = np.random.default_rng(213).normal(size=(200, 3))
    for direction in directions:
        x = np.array([[1e-3, 0.0, -1e-3], size * direction / np.linalg.norm(direction)])
        both = MovedDevice(equations, np.arange(2), x)
        lost = np.isnan(both.movement.bending).any(axis=1)
        if lost.tolist() == [False, True]:
            break
    assert lost.tolist() == [False, True]
    alone = MovedDevice(equations, np.arange(1), x[:1])
    np.testing.assert_allclose(both.misfit[0], alone.misfit[0], rtol=1e-9)
    np.testing.assert_allclose(both.displaced.side.moments[0], alone.displaced.side.moments[0], rtol=1e-9, atol=1e-12)
    for part in (both.displaced.side, both.displaced.state, (both.misfit,)):
        assert all(np.isfinite(one).all() for one in part if one is not None)
    at, _ = equations.place(np.arange(2), x, np.ones(2))
    straight = Displaced(equations.mechanism, equations.query_at(np.arange(2), at), at.base, at.cuff, *both.loads[:2])
    np.testing.assert_allclose(both.displaced.side.forces[1], straight.side.forces[1], rtol=1e-12, atol=1e-12)
    assert np.abs(both.displaced.side.forces[0] - straight.side.forces[0]).max() > 1e-6


@pytest.mark.parametrize("locked", [False, True])
def test_an_equilibrium_is_sought_in_the_given_rows_alone(locked):
    equations = equations_of(ep.Interfaces(), 214, locked, count=3)
    x, reached = settle(equations, np.array([1]))
    np.testing.assert_array_equal(reached, [0.0, 1.0, 0.0])
    np.testing.assert_array_equal(x[[0, 2]], 0.0)
    residual, _, _ = equations(np.array([1]), x[[1]], np.ones(1))
    assert np.abs(residual[0] / equations.scale.clip(max=1e3)).max() < 1e-6
    assert np.abs(x[1]).max() > 1e-5


@pytest.mark.parametrize("name", sorted(MECHANISMS))
def test_status_margin_and_determinant_without_an_offset_are_those_of_the_aligned_wrist(name):
    """Also of a folded pose, whose lever arm is zero and has no direction."""
    mechanism = MECHANISMS[name]()
    a, b = mechanism.geometry.base_points[0], mechanism.geometry.platform_points[0]
    folded, _ = Rotation.align_vectors(a[None], b[None])
    poses = Rotation.concatenate([Rotation.random(20, np.random.default_rng(215)), folded])
    query, zero = as_query(poses), np.zeros((21, 3))
    limbs = classify(mechanism, query.matrices)
    moved = Displaced(mechanism, query, zero, zero, zero, zero)
    np.testing.assert_array_equal(moved.status[:20], limbs.status[:20])
    determinant = np.linalg.det(limbs.X) if limbs.X.shape[1] == 3 else np.full(21, np.nan)
    for found in (moved.determinant, limbs.determinant):
        np.testing.assert_allclose(found, determinant, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(moved.margin, limbs.margin, rtol=1e-9, atol=1e-12)


def test_limbs_without_side_force_have_no_deflection_of_a_guide():
    equations = equations_of(ep.Interfaces(), 216, kinds=["UPU", "SPS", "UPU"])
    x = np.array([[2e-3, 1e-3, -1e-3]])
    moved = MovedDevice(equations, np.arange(1), x)
    held = equations.mechanism.is_upu
    assert held.tolist() == [True, False, True]
    for part in (moved.misfit[0], moved.displaced.side.stiffness[0], moved.displaced.side.deflection[0]):
        np.testing.assert_array_equal(part != 0.0, held)
    np.testing.assert_array_equal(moved.movement.bending[0] != 0.0, held)
    # The deflection is the displacement along the side force, to first order.
    S = moved.displaced.side.forces[0]
    alone = equations.sides(equations.place(np.arange(1), 0.0 * x, np.ones(1))[0])[0]
    change = moved.displaced.side.deflection[0] - alone.deflection[0]
    np.testing.assert_allclose(change[held], (S @ x[0])[held], atol=0.1 * np.abs(x).max())


@pytest.mark.parametrize("locked", [False, True])
def test_unknowns_are_scaled_by_a_fifth_of_the_platforms_radius_and_half_a_radian(locked):
    """Forces of locked limbs have no scale."""
    equations = equations_of(SOFT, 217, locked)
    metres, radians = [0.2 * equations.mechanism.geometry.platform_radius] * 3, [0.5] * 3
    parts = [*metres, *(radians if locked else []), *metres, *radians, *metres, *radians, *([np.inf] * 3 * locked)]
    np.testing.assert_allclose(equations.scale, parts)
    assert equations.size == len(parts)
