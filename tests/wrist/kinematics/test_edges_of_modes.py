"""Edges of forward kinematics: roots that are small, limbs that fold, rows that say nothing, sides of second roots."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import random_mechanism

from exo_pin import wrist
from exo_pin.design import WristGeometry
from exo_pin.wrist.kinematics.assembly import margin_of, polish
from exo_pin.wrist.kinematics.forward import _triples
from exo_pin.wrist.kinematics.from_lengths import twist_roots

pytestmark = pytest.mark.usefixtures("plain")


def unit_rows(rng, count=3):
    rows = rng.normal(size=(count, 3))
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def test_a_start_where_newtons_matrix_is_singular_stays_at_the_least_error():
    """u_1 = R v_1 is the extremum of the first equation: no step changes it to first order."""
    u, v, c = np.eye(3), np.eye(3), np.array([np.cos(1e-3), 0.0, 0.0])
    v[1:], u[1:] = [[0.0, 0.6, 0.8], [0.0, -0.8, 0.6]], [[0.0, 0.6, 0.8], [0.6, 0.0, 0.8]]
    c[1], c[2] = u[1] @ v[1], u[2] @ v[2]
    R = np.eye(3)
    assert polish(R, u, v, c, np.empty((3, 3)), np.empty(3), np.empty((3, 3))) == pytest.approx(5e-7, rel=1e-3)
    np.testing.assert_allclose(R, np.eye(3), atol=1e-12)


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_two_roots_have_the_sum_and_the_product_of_the_quadratic(size):
    """Where one is a billionth of the other, too; below a trillionth of the wrist it is the spurious one."""
    a = 0.2 * size
    for off, sine, count in ((1e-9, -0.7, 2), (1e-2, -0.98, 2), (1e-13, -0.7, 1), (0.0, -0.7, 1), (-1e-9, -0.7, 1)):
        b, roots = a * (1.0 - off), np.empty(2)
        found, width = twist_roots(sine, a, b, roots)
        assert found == count
        assert width == pytest.approx(np.sqrt(b * b - a * a * (1.0 - sine * sine)) / b, rel=1e-7)
        if count == 2:
            assert roots[0] > roots[1] > 0.0
            assert roots.sum() == pytest.approx(-2.0 * a * sine, rel=1e-14)
            assert roots.prod() == pytest.approx((a - b) * (a + b), rel=1e-14)
    # Both are negative where the line leaves the sphere behind A.
    assert twist_roots(0.98, a, 0.99 * a, np.empty(2))[0] == 0
    # Half a turn of the angle and no length at all, for equal arms.
    assert twist_roots(0.0, a, a, np.empty(2))[0] == 0


@pytest.mark.parametrize("n", [3, 4])
def test_a_limb_that_folds_is_where_two_modes_meet(n):
    """One of several modes; its plane is lost, and the others are single."""
    rng = np.random.default_rng(290)
    for _ in range(6):
        geometry = random_mechanism(rng, n).geometry
        pose, _ = Rotation.align_vectors(geometry.base_points[:1].copy(), geometry.platform_points[:1].copy())
        state = wrist.inverse_kinematics(geometry, pose)
        np.testing.assert_array_equal(np.isnan(state.normals).all(axis=1), np.arange(n) == 0)
        assert np.isfinite(state.normals[1:]).all()
        modes = wrist.forward_kinematics(geometry, state.lengths, near=pose, tolerance=1e-7)
        if n == 3:
            assert modes.status == "meeting"
            assert modes.meets.sum() == 1
            assert modes.meets[modes.nearest]
            assert modes.ambiguous
        else:
            # The other three limbs hold the pose.
            assert modes.status == "ok"
        assert (modes.nearest_rotations * pose.inv()).magnitude() < 1e-5


@pytest.mark.parametrize("measured", ["theta_x", "theta_y", "both", "lengths"])
def test_rows_that_say_nothing_are_empty_and_spoil_no_other(measured):
    geometry = random_mechanism(np.random.default_rng(291), 3).geometry
    state = wrist.inverse_kinematics(geometry, Rotation.random(rng=np.random.default_rng(0)))

    def found(spoiled, limb, number):
        values = {"theta_x": state.base_theta_x, "theta_y": state.base_theta_y, "lengths": state.lengths}
        rows = {name: np.stack([part, part]) for name, part in values.items()}
        rows[spoiled][0, limb] = number
        if measured == "lengths":
            return wrist.forward_kinematics(geometry, rows["lengths"])
        names = ("theta_x", "theta_y") if measured == "both" else (measured,)
        return wrist.forward_kinematics_from_base_angles(geometry, **{name: rows[name] for name in names})

    for spoiled in ("theta_x", "theta_y") if measured == "both" else (measured,):
        for limb in range(3):
            for number in (np.nan, np.inf):
                modes = found(spoiled, limb, number)
                assert modes.status.tolist() == ["invalid", "ok"]
                assert modes.count[0] == 0
                assert modes.count[1] > 0
                assert not modes.valid[0].any()
                assert np.isnan(modes.residual[0]).all()
                assert (modes.side[0] == 0).all()
                # The identity, without meaning.
                assert modes.rotations[0].magnitude().max() == 0.0


def test_the_side_of_a_mode_turns_with_each_limb_that_takes_the_shorter_length():
    rng, seen = np.random.default_rng(292), set()
    for _ in range(4):
        geometry = random_mechanism(rng, 3).geometry
        a = np.linalg.norm(geometry.base_points, axis=1)
        # Joints of the arm not far from those of the base, and closer to O.
        platform = geometry.base_points + 0.3 * a[:, None] * unit_rows(rng)
        b = np.linalg.norm(platform, axis=1)
        geometry = WristGeometry(geometry.base_points, platform * (0.9 * a / b)[:, None])
        poses = Rotation.from_rotvec(rng.normal(size=(100, 3)))
        state = wrist.inverse_kinematics(geometry, poses)
        shorter = (np.einsum("kij,kij->ki", state.platform_points, state.directions) < 0.0).sum(axis=1)
        for k in [*np.flatnonzero(shorter == 3)[:2], *np.flatnonzero(shorter == 2)[:1]]:
            modes = wrist.forward_kinematics_from_base_angles(geometry, theta_x=state.base_theta_x[k], near=poses[k])
            u, v = geometry.base_points / a[:, None], geometry.platform_points / (0.9 * a)[:, None]
            rows = np.cross(poses[k].apply(v), u)
            assert (modes.nearest_rotations * poses[k].inv()).magnitude() < 1e-7
            assert modes.side[modes.nearest] == np.sign(margin_of(rows)) * (-1) ** shorter[k]
            seen.add(int(shorter[k]))
    assert {2, 3} <= seen


def test_margins_of_more_limbs_are_those_of_the_best_three():
    rng = np.random.default_rng(293)
    for n in (4, 5, 6):
        geometry = random_mechanism(rng, n).geometry
        for pose in Rotation.random(3, rng=rng):
            modes = wrist.forward_kinematics(geometry, wrist.inverse_kinematics(geometry, pose).lengths, near=pose)
            u, v = (p / np.linalg.norm(p, axis=1)[:, None] for p in (geometry.base_points, geometry.platform_points))
            rows = np.cross(pose.apply(v), u)
            triples = [[i, j, k] for i in range(n) for j in range(i) for k in range(j)]
            best = max(abs(margin_of(rows[triple])) for triple in triples)
            assert modes.margin[modes.nearest] == pytest.approx(best, rel=1e-6)


def test_triples_with_directions_in_one_plane_come_before_pairs_that_are_nearly_one():
    """Three directions in a plane on one side leave single poses; two limbs that nearly coincide nearly a curve."""
    rng = np.random.default_rng(294)
    for turn in Rotation.random(6, rng=rng):
        u, v = unit_rows(rng, 4), unit_rows(rng, 4)
        u[:3] = [[1.0, 0.0, 0.0], [-0.5, 0.8, 0.0], [-0.4, -0.9, 0.0]]
        u[3], v[3] = u[0] + [0.0, 0.0, 1e-3], v[0] + 1e-3
        u, v = turn.apply(u / np.linalg.norm(u, axis=1)[:, None]), v / np.linalg.norm(v, axis=1)[:, None]
        assert {tuple(triple) for triple in _triples(u, v)[:2].tolist()} == {(0, 1, 2), (1, 2, 3)}


def test_a_wrist_with_two_equal_directions_is_solved():
    """The equation whose v is parallel to no other is the first; parallel ones give ψ in nothing."""
    rng = np.random.default_rng(297)
    base, platform = 0.2 * unit_rows(rng), 0.2 * unit_rows(rng)
    platform[1] = 0.8 * platform[0]
    geometry = WristGeometry(base, platform)
    for pose in Rotation.random(3, rng=rng):
        modes = wrist.forward_kinematics(geometry, wrist.inverse_kinematics(geometry, pose).lengths, near=pose)
        assert (modes.nearest_rotations * pose.inv()).magnitude() < 1e-7
