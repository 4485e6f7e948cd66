"""Side wrenches of straight and bent guides by their definitions: free bodies and strain energy."""

import numpy as np
import pytest
from limb_bodies import transmitted
from scipy.spatial.transform import Rotation
from wrists import random_mechanism, regular_poses

import exo_pin as ep
from exo_pin.wrist.forces.bent_guides import _PLACES, bent_wrenches, largest_deflection
from exo_pin.wrist.forces.side_forces import (
    guide_flexibility,
    reciprocal_couples,
    side_wrenches,
    signed_root,
    straight_guides,
)


def wrist_with_guides(rng, n=3):
    mechanism = random_mechanism(rng, n, ["UPU", "SPS", "UPU", "UPU"][:n])
    guide = ep.LimbGuide(60.0, 50.0, 400.0, 300.0)
    limbs = [ep.Limb(limb.kind, guide=guide if limb.kind == "UPU" else None) for limb in mechanism.limbs]
    return mechanism.replace(limbs=limbs), regular_poses(mechanism, rng, 2, margin=0.1)


@pytest.mark.parametrize("shift", [0.0, 0.02])
def test_wrenches_and_stiffness_of_straight_guides(shift):
    rng = np.random.default_rng(180)
    mechanism, poses = wrist_with_guides(rng)
    base, cuff = shift * rng.normal(size=(2, 2, 3))
    side = side_wrenches(mechanism, poses.as_matrix(), base, cuff)
    flexibility, resists = guide_flexibility(mechanism)
    np.testing.assert_array_equal(resists, [True, False, True])
    np.testing.assert_allclose(flexibility[0], [1 / 60.0, 1 / 50.0, 1 / 400.0, 1 / 300.0], rtol=1e-15)
    assert not flexibility[1].any()
    points = mechanism.geometry
    for k in range(2):
        R = poses[k].as_matrix()
        for i in range(3):
            a, b = points.base_points[i] + base[k], R @ (points.platform_points[i] + cuff[k])
            s = (b - a) / np.linalg.norm(b - a)
            np.testing.assert_allclose(side.directions[k, i], s, atol=1e-14)
            np.testing.assert_allclose(side.moment_arms[k, i], np.cross(b, s), atol=1e-14)
            if i == 1:  # SPS: no side force, no stiffness
                for part in ("forces", "moments", "misfit", "stiffness", "twist", "deflection", "bending", "torque"):
                    assert not getattr(side, part)[k, i].any()
                continue
            y_a, y_b = -points.base_points[i], -R @ points.platform_points[i]
            # The oracle's second column is the wrench on the arm of a positive force.
            own = transmitted(a, b, y_a, y_b)[:, 1]
            np.testing.assert_allclose(np.concatenate([side.forces[k, i], side.moments[k, i]]), own, atol=1e-10)
            # Strain energy along the guide: the couple at a place is that at B and the force's, by quadrature.
            force, at_b = own[:3], own[3:] - np.cross(b, own[:3])
            nodes, weights = np.polynomial.legendre.leggauss(4)
            length, compliance = np.linalg.norm(b - a), 0.0
            for node, weight in zip(0.5 * (nodes + 1.0), 0.5 * weights, strict=True):
                inside = at_b + np.cross(b - (a + node * (b - a)), force)
                twist = inside @ s
                compliance += length * weight * ((inside @ inside - twist**2) / 60.0 + twist**2 / 50.0)
            at_a = at_b + np.cross(b - a, force)
            compliance += 2.0 * force @ force / 400.0 + (at_a @ at_a + at_b @ at_b) / 300.0
            assert side.stiffness[k, i] == pytest.approx(1.0 / compliance, rel=1e-9)
            assert side.torque[k, i] == pytest.approx(at_b @ s, rel=1e-9, abs=1e-11)
            across = [np.linalg.norm(couple - couple @ s * s) for couple in (at_a, at_b)]
            assert side.bending[k, i] == pytest.approx(max(across), rel=1e-9)
            X = [np.cross(y, s) / np.linalg.norm(np.cross(y, s)) for y in (y_a, y_b)]
            angle = np.arctan2(np.cross(X[0], X[1]) @ s, X[0] @ X[1])
            assert side.twist[k, i] == pytest.approx(angle, rel=1e-9, abs=1e-12)
            assert side.deflection[k, i] == pytest.approx(side.torque[k, i] * angle, rel=1e-9, abs=1e-14)
            gap = R @ cuff[k] - base[k]
            assert side.misfit[k, i] == pytest.approx(force @ gap, rel=1e-9, abs=1e-14)


def test_couples_do_no_work_in_any_revolute_joint():
    rng = np.random.default_rng(181)
    mechanism, poses = wrist_with_guides(rng)
    base, cuff = 0.02 * rng.normal(size=(2, 2, 3))
    points = mechanism.geometry
    guides = straight_guides(points.base_points, points.platform_points, poses.as_matrix(), base, cuff)
    force, arm, torso = reciprocal_couples(guides)
    for couple, axes in ((arm, (guides.y_arm, guides.x_arm)), (torso, (guides.y_base, guides.x_base))):
        for axis in axes:
            np.testing.assert_allclose((couple * axis).sum(axis=-1), 0.0, atol=1e-13)
    np.testing.assert_allclose(np.linalg.norm(force, axis=-1), 1.0, rtol=1e-14)
    np.testing.assert_allclose((force * guides.directions).sum(axis=-1), 0.0, atol=1e-14)
    assert ((force * (guides.x_base + guides.x_arm)).sum(axis=-1) > 0.0).all()


def test_roots_with_a_sign():
    np.testing.assert_array_equal(signed_root(np.array([4.0, 9.0, 0.0]), np.array([1.0, -1.0, -1.0])), [2.0, -3.0, 1.0])
    assert signed_root(np.array(4.0), np.array(0.0)) == 2.0


def test_deflections_are_those_of_cubics_with_the_slopes_of_the_ends():
    rng = np.random.default_rng(182)
    for ends in rng.normal(size=(5, 4)):
        t = _PLACES
        (a, b), (c, d) = ends.reshape(2, 2)
        shape = [slope * t * (1 - t) ** 2 - other * t**2 * (1 - t) for slope, other in ((a, c), (b, d))]
        assert largest_deflection(ends) == pytest.approx(np.hypot(*shape).max(), rel=1e-14)
        # A cubic that is zero at the ends, with these slopes there.
        fine = np.polynomial.Polynomial.fit([0, 1e-5, 1 - 1e-5, 1], [0, a * 1e-5, -c * 1e-5, 0], 3)
        assert abs(fine(0.5) - (0.125 * a - 0.125 * c)) < 1e-4
    assert _PLACES[0] == 0.0
    assert _PLACES[-1] == 1.0


def test_bent_guides_come_to_straight_ones_as_the_centres_meet():
    """The wrench, the stiffness and the deflection differ in proportion to the gap, and not where there is none."""
    rng = np.random.default_rng(183)
    mechanism, poses = wrist_with_guides(rng)
    points, way = mechanism.geometry, rng.normal(size=(2, 2, 3))
    flexibility, resists = guide_flexibility(mechanism)
    off = []
    for shift in (0.0, 1e-5, 1e-4):
        base, cuff = shift * way
        guides = straight_guides(points.base_points, points.platform_points, poses.as_matrix(), base, cuff)
        straight = side_wrenches(mechanism, poses.as_matrix(), base, cuff)
        bent, ends = bent_wrenches(guides, flexibility, resists, mechanism.is_upu)
        again, _ = bent_wrenches(guides, flexibility, resists, mechanism.is_upu, start=ends)
        np.testing.assert_allclose(again.forces, bent.forces, atol=1e-12)
        assert np.abs(ends).max() <= 300.0 * shift + 1e-12
        off.append(np.abs(bent.moments - straight.moments).max())
        g = bent.stiffness * bent.deflection
        np.testing.assert_allclose(g, straight.stiffness * straight.misfit, atol=2e-2 * np.abs(g).max() + 1e-8)
    assert off[0] < 1e-12
    assert 5.0 < off[2] / max(off[1], 1e-300) < 20.0


def test_guides_turn_to_the_least_energy():
    """The bent shape's energy by its formula, with ends turned by SciPy; no small change of the ends lowers it."""
    rng = np.random.default_rng(184)
    mechanism, poses = wrist_with_guides(rng)
    points, (base, cuff) = mechanism.geometry, 0.01 * rng.normal(size=(2, 2, 3))
    guides = straight_guides(points.base_points, points.platform_points, poses.as_matrix(), base, cuff)
    flexibility, resists = guide_flexibility(mechanism)
    _, ends = bent_wrenches(guides, flexibility, resists, mechanism.is_upu)

    def energy(k, i, turns):
        s, length = guides.directions[k, i], guides.lengths[k, i]
        x = guides.x_base[k, i] + guides.x_arm[k, i]
        x = x / np.linalg.norm(x)
        v, (EI, GJ, joint, twist) = np.cross(s, x), 1.0 / flexibility[i]
        theta = [pair[0] * x + pair[1] * v for pair in turns.reshape(2, 2)]
        crosses = []
        for y, turn in zip((guides.y_base[k, i], guides.y_arm[k, i]), theta, strict=True):
            rotation = Rotation.from_rotvec(turn)
            cross = np.cross(y, rotation.apply(s))
            crosses.append(rotation.inv().apply(cross / np.linalg.norm(cross)))
        psi = np.arctan2(np.cross(*crosses) @ s, crosses[0] @ crosses[1])
        tau = psi + 0.5 * s @ np.cross(*theta)
        F = length / (6.0 * EI) * np.array([[2.0, -1.0], [-1.0, 2.0]]) + 2.0 / (joint * length**2) + np.eye(2) / twist
        stiff, both = np.linalg.inv(F), turns.reshape(2, 2)
        return 0.5 * np.einsum("ec,ef,fc", both, stiff, both) + 0.5 * tau**2 / (length / GJ + 2.0 / twist)

    h = 1e-4
    for k in range(2):
        for i in (0, 2):
            slopes = [energy(k, i, ends[k, i] + h * way) - energy(k, i, ends[k, i] - h * way) for way in np.eye(4)]
            assert np.abs(slopes).max() / (2.0 * h) < 1e-5 * max(1.0, energy(k, i, 0.0 * ends[k, i]))
            assert energy(k, i, ends[k, i]) < energy(k, i, 0.0 * ends[k, i])
    assert not ends[:, 1].any()
