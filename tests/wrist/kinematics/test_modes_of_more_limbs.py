"""Modes of more limbs than three, and what is kept of them: copies, tolerances, margins and starts that are tried."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import random_mechanism

from exo_pin import wrist
from exo_pin.design import WristGeometry
from exo_pin.wrist.kinematics import forward
from exo_pin.wrist.kinematics import from_lengths as from_directions
from exo_pin.wrist.kinematics.assembly import CONTINUUM, margin_of
from exo_pin.wrist.kinematics.from_lengths import twist_roots
from exo_pin.wrist.kinematics.solutions import Solutions, solve
from exo_pin.wrist.limbs import classify

pytestmark = pytest.mark.usefixtures("plain")


def geometry_of(seed, n=3):
    return random_mechanism(np.random.default_rng(seed), n).geometry


def with_copy(geometry):
    """The same wrist with its last limb twice."""
    rows = [0, 1, 2, 2]
    return WristGeometry(geometry.base_points[rows], geometry.platform_points[rows])


def modes_of(geometry, measured, values, **options):
    if measured == "lengths":
        return wrist.forward_kinematics(geometry, values, **options)
    return wrist.forward_kinematics_from_base_angles(geometry, **{measured[5:]: values}, **options)


def short_armed(seed, n=3):
    geometry = geometry_of(seed, n)
    size = np.linalg.norm(geometry.base_points, axis=1) / np.linalg.norm(geometry.platform_points, axis=1)
    return geometry.replace(platform_points=geometry.platform_points * (0.8 * size)[:, None])


@pytest.mark.parametrize("measured", ["lengths", "base_theta_y"])
def test_a_copy_of_a_limb_changes_no_mode(measured):
    """Modes close to each other stay apart, and the best three limbs give the margin."""
    close = 0
    for seed in range(6):
        three = geometry_of(250 + seed)
        four = with_copy(three)
        pose = Rotation.random(rng=np.random.default_rng(seed))
        values = getattr(wrist.inverse_kinematics(three, pose), measured)
        ours, theirs = modes_of(three, measured, values), modes_of(four, measured, values[[0, 1, 2, 2]])
        assert ours.count == theirs.count
        assert (theirs.side == 0).all()
        assert (ours.side[ours.valid] != 0).all()
        apart = []
        for k in range(int(ours.count)):
            away = (theirs.rotations[theirs.valid] * ours.rotations[k].inv()).magnitude()
            same = int(away.argmin())
            assert away[same] < 1e-8
            assert theirs.margin[same] == pytest.approx(ours.margin[k], rel=1e-6)
            apart.append(np.sort((ours.rotations[ours.valid] * ours.rotations[k].inv()).magnitude())[1:2])
        close += int((np.concatenate(apart) < 0.8).sum())
    assert close > 1


def test_the_side_of_a_mode_is_the_sign_of_its_equations():
    """Rows R v_i × u_i; a length grows with the cosine's fall, so that the limbs' own rows have the other sign."""
    geometry, seen = geometry_of(260), set()
    u, v = (p / np.linalg.norm(p, axis=1)[:, None] for p in (geometry.base_points, geometry.platform_points))
    for seed in range(4):
        pose = Rotation.random(rng=np.random.default_rng(seed))
        modes = wrist.forward_kinematics(geometry, wrist.inverse_kinematics(geometry, pose).lengths)
        for k in range(int(modes.count)):
            rows = np.cross(modes.rotations[k].apply(v), u)
            assert modes.side[k] == np.sign(np.linalg.det(rows))
            assert modes.margin[k] == pytest.approx(abs(margin_of(rows)), rel=1e-7)
            jacobian = wrist.limb_jacobian(geometry, modes.rotations[k])
            assert modes.side[k] == -np.sign(np.linalg.det(jacobian))
            seen.add(int(modes.side[k]))
    assert seen == {-1, 1}


@pytest.mark.parametrize("measured", ["lengths", "base_theta_x", "base_theta_y"])
@pytest.mark.parametrize("n", [4, 5])
def test_poses_of_least_squares_count_up_to_the_tolerance(measured, n):
    rng = np.random.default_rng(261)
    geometry = geometry_of(262, n)
    pose = Rotation.random(rng=rng)
    values = getattr(wrist.inverse_kinematics(geometry, pose), measured) + 1e-4 * rng.normal(size=n)

    every = modes_of(geometry, measured, values, near=pose, tolerance=np.inf)
    residuals = every.residual[every.valid]
    own = every.residual[every.nearest]
    assert 1e-6 < own < 1e-2
    assert (every.nearest_rotations * pose.inv()).magnitude() < 0.05
    back = getattr(wrist.inverse_kinematics(geometry, every.nearest_rotations), measured)
    assert own == pytest.approx(np.abs(back - values).max(), rel=1e-9)
    for tolerance in (0.999 * own, 1.001 * own):
        count = modes_of(geometry, measured, values, tolerance=tolerance).count
        assert count == (residuals <= tolerance).sum()
    assert residuals.min() == own


@pytest.mark.parametrize("measured", ["lengths", "base_theta_x", "base_theta_y"])
def test_limbs_that_are_one_leave_a_curve_of_poses(measured):
    geometry = geometry_of(263)
    rows = [0, 1, 1]
    twice = WristGeometry(geometry.base_points[rows], geometry.platform_points[rows])
    values = getattr(wrist.inverse_kinematics(twice, Rotation.from_rotvec([0.3, 0.2, 0.1])), measured)
    modes = modes_of(twice, measured, values)
    assert modes.status == "continuum"
    assert modes.count == 0


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_roots_of_an_angle_have_no_unit(size):
    """The line misses the sphere by 2e-15 and 8e-15 of its radius squared: the first is rounding."""
    a, b = 0.3 * size, 0.2 * size
    for off, count in ((1e-15, 1), (4e-15, 0), (-1e-13, 1), (-1e-10, 2)):
        cosine = b / a * (1.0 + off)
        roots = np.empty(2)
        found, _ = twist_roots(-np.sqrt(1.0 - cosine * cosine), a, b, roots)
        assert found == count
        np.testing.assert_allclose(roots[:found], np.sqrt(a * a - b * b), rtol=1e-4)


@pytest.mark.parametrize("n", [3, 4])
def test_the_exact_fit_is_found_wherever_it_stands(n):
    """Both angles of limbs shorter than the base's: each has two ends, and of 2^n fits the exact one may be any."""
    rng, found = np.random.default_rng(270), 0
    for seed in range(6):
        geometry = short_armed(270 + seed, n)
        poses = Rotation.random(400, rng=rng)
        state = wrist.inverse_kinematics(geometry, poses)
        along = np.einsum("kij,kij->ki", state.platform_points, state.directions)
        # The shorter of two lengths where the limb meets the sphere from outside.
        last = np.flatnonzero((np.abs(along).min(axis=1) > 0.02) & (along[:, -1] < 0.0))[:1]
        for k in last:
            modes = wrist.forward_kinematics_from_base_angles(
                geometry, state.base_theta_x[k], state.base_theta_y[k], near=poses[k]
            )
            assert (modes.nearest_rotations * poses[k].inv()).magnitude() < 1e-9
            assert modes.residual[0] < 1e-12
            assert modes.nearest == 0
            found += 1
    assert found > 2


def test_fits_are_kept_up_to_three_times_the_least_residual(monkeypatch):
    """In their order, of all that are found; many evaluations would be too many."""
    kernel = from_directions.directions_stack
    used, evaluated = kernel.plain.__globals__, []
    errors = used["_angle_errors"]

    def noted(*arguments):
        evaluated.append(errors(*arguments))
        return evaluated[-1]

    monkeypatch.setitem(used, "_angle_errors", noted)
    kept = dropped = 0
    for design, seed in ((283, 3), (282, 1), (281, 1)):
        geometry, rng = short_armed(design), np.random.default_rng(seed)
        pose = Rotation.random(rng=rng)
        state = wrist.inverse_kinematics(geometry, pose)
        x, y = state.base_theta_x + 0.05 * rng.normal(size=3), state.base_theta_y + 0.05 * rng.normal(size=3)
        some = wrist.forward_kinematics_from_base_angles(geometry, x, y)
        monkeypatch.setitem(used, "_KEEP", 1e9)
        every = wrist.forward_kinematics_from_base_angles(geometry, x, y)
        monkeypatch.setitem(used, "_KEEP", 3.0)
        residuals = every.residual[every.valid]
        assert (np.diff(residuals) >= 0.0).all()
        count = int((residuals <= 3.0 * residuals[0] + 1e-9).sum())
        assert some.count == count
        np.testing.assert_array_equal(some.residual[:count], residuals[:count])
        kept, dropped = kept + count - 1, dropped + len(residuals) - count
        for k in range(int(every.count)):
            own = wrist.inverse_kinematics(geometry, every.rotations[k])
            off = np.concatenate([x - own.base_theta_x, np.angle(np.exp(1j * (y - own.base_theta_y)))])
            rows = wrist.joint_jacobians(geometry, every.rotations[k])
            J = np.concatenate([rows.base_theta_x, rows.base_theta_y])
            assert every.residual[k] == pytest.approx(np.abs(off).max(), rel=1e-6, abs=1e-12)
            assert every.margin[k] == pytest.approx(np.linalg.svd(J, compute_uv=False)[-1], rel=1e-5)
            assert np.abs(J.T @ off).max() < 1e-7 * np.abs(J).max() ** 2
    assert min(kept, dropped) > 0
    # Of 24 fits, each found twice.
    assert len(evaluated) <= 48 * 24


def test_limbs_without_length_have_no_reach():
    """So that a folded limb is the only one whose angles have no rate."""
    mechanism = random_mechanism(np.random.default_rng(282), 3)
    geometry = mechanism.geometry
    base = np.array(geometry.base_points)
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    base[1] = quarter @ geometry.platform_points[1]
    limbs = classify(mechanism.replace(geometry=WristGeometry(base, geometry.platform_points)), quarter[None])
    assert limbs.length[0, 1] == 0.0
    assert limbs.reach[0, 1] == 0.0


def test_a_folded_limb_has_no_error_of_its_angles_to_fit():
    """One is enough, and no number comes of it."""
    geometry = geometry_of(283)
    a, b = geometry.base_points[1], geometry.platform_points[1]
    errors, pose = from_directions._angle_errors, Rotation.align_vectors(a[None].copy(), b[None].copy())[0]
    joints = forward._joints(geometry)
    room = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty(3), np.empty(3)
    rest = room, np.empty((5, 3)), np.empty((6, 3)), np.empty(6)
    angles = np.array([0.1, -0.2, 0.3]), np.array([0.5, 3.0, -3.0])
    assert errors(pose.as_matrix(), joints, *angles, *rest) == np.inf
    other = Rotation.from_rotvec([0.3, 0.1, -0.2]) * pose
    state = wrist.inverse_kinematics(geometry, other)
    off = angles[0] - state.base_theta_x, np.angle(np.exp(1j * (angles[1] - state.base_theta_y)))
    total = errors(other.as_matrix(), joints, *angles, *rest)
    assert total == pytest.approx((np.array(off) ** 2).sum(), rel=1e-12)
    np.testing.assert_allclose(rest[3], np.array(off).T.ravel(), atol=1e-14)
    rows = wrist.joint_jacobians(geometry, other)
    expected = np.stack([rows.base_theta_x, rows.base_theta_y], axis=1).reshape(6, 3)
    np.testing.assert_allclose(rest[2], expected, atol=1e-13)


@pytest.mark.parametrize("measured", ["lengths", "base_theta_x", "base_theta_y"])
def test_three_limbs_fit_exactly_and_ask_for_no_tolerance(measured):
    geometry = geometry_of(284)
    values = getattr(wrist.inverse_kinematics(geometry, Rotation.random(rng=np.random.default_rng(5))), measured)
    usual = modes_of(geometry, measured, values)
    none = modes_of(geometry, measured, values, tolerance=-1.0)
    assert none.count == usual.count > 0
    np.testing.assert_array_equal(none.rotations.as_quat(), usual.rotations.as_quat())


def test_other_three_limbs_are_taken_where_the_best_leave_a_curve():
    """Of four limbs, of which two are one, half of the triples do: the order in which they are tried matters not."""
    four = with_copy(geometry_of(285))
    pose = Rotation.random(rng=np.random.default_rng(6))
    joints = forward._joints(four)
    v, u = joints.v, joints.u
    c = np.einsum("ij,ij->i", u, pose.apply(v.copy()))
    curves = [t for t in joints.triples.tolist() if {2, 3} <= set(t)]
    isolated = [t for t in joints.triples.tolist() if not {2, 3} <= set(t)]
    assert len(curves) == len(isolated) == 2
    for order in (isolated + curves, curves + isolated, [*curves, isolated[0]], [isolated[0], *curves, isolated[1]]):
        found = Solutions(np.empty((8, 3, 3)), np.empty(8), np.empty(8))
        count = solve(u, v, c, np.array(order), found)
        assert count > 0
        assert np.abs(found.R[:count] - pose.as_matrix()).max(axis=(1, 2)).min() < 1e-9
    assert solve(u, v, c, np.array(curves), found) == CONTINUUM
