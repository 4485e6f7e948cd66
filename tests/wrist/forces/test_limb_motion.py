"""Limbs with mass on a moving arm: momentum of each half, differentiated along the movement."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import heavy_limbs, random_mechanism, regular_poses

import exo_pin as ep
from exo_pin.load_case.pose_stacks import as_query
from exo_pin.wrist.forces.side_forces import limb_loads

#: s; weights of central differences of order eight: first derivative, for the steps 1 to 4.
STEP, WEIGHTS = 4e-3, np.array([4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0])


def rate(function, t=0.0):
    steps = STEP * np.arange(1, 5)
    return sum(w * (function(t + h) - function(t - h)) for w, h in zip(WEIGHTS, steps, strict=True)) / STEP


def unit(v):
    return v / np.linalg.norm(v)


def axes(s, y):
    """Frame of a half: X across the joint's Y, and s."""
    x = unit(np.cross(y, s))
    return np.stack([x, np.cross(s, x), s], axis=1)


@pytest.mark.parametrize("kind", ["UPU", "SPS"])
@pytest.mark.parametrize("own_points", [False, True])
def test_halves_obey_newton_and_euler(kind, own_points):
    rng = np.random.default_rng(101)
    mechanism = heavy_limbs(random_mechanism(rng, 3, [kind] * 3), rng)
    bodies = [ep.LimbBody(0.3, 0.05, 2e-3, 7e-4), ep.LimbBody(0.2, 0.04, 1e-3, 5e-4)]
    mechanism = mechanism.replace(
        limbs=[ep.Limb(kind, *bodies), ep.Limb(kind, bodies[1]), ep.Limb(kind, None, bodies[0])]
    )
    pose = regular_poses(mechanism, rng, 1, margin=0.1)
    base, cuff = 0.02 * rng.normal(size=(2, 1, 3))
    omega, eta = rng.normal(size=(2, 3))
    points = mechanism.geometry.base_points + (0.02 * rng.normal(size=(3, 3)) if own_points else 0.0)
    query = as_query(pose, ep.Motion(omega[None], eta[None]))
    given = points[None] if own_points else None
    closure, share = limb_loads(mechanism, query, base, cuff, np.zeros(1, dtype=bool), given)

    def turned(t):
        return (Rotation.from_rotvec(omega * t + 0.5 * eta * t**2) * pose[0]).as_matrix()

    def line(i, t):
        a, p = points[i] + base[0], turned(t) @ (mechanism.geometry.platform_points[i] + cuff[0])
        return a, p, unit(p - a)

    gravity = np.array(mechanism.gravity)
    for i, limb in enumerate(mechanism.limbs):
        total, force_along = np.zeros(6), 0.0
        for body, is_base in ((limb.base_body, True), (limb.platform_body, False)):
            if body is None:
                continue

            def centre(t, i=i, body=body, is_base=is_base):
                a, p, s = line(i, t)
                return a + body.centre * s if is_base else p - body.centre * s

            def frame(t, i=i, is_base=is_base):
                seat = -points[i] if is_base else -turned(t) @ mechanism.geometry.platform_points[i]
                return axes(line(i, t)[2], unit(seat))

            def momentum(t, body=body, frame=frame, i=i, kind=kind):
                s = line(i, t)[2]
                across = np.cross(s, rate(lambda r: line(i, r)[2], t))
                spin = 0.0
                if kind == "UPU":
                    turn = rate(frame, t) @ frame(t).T
                    spin = np.array([turn[2, 1], turn[0, 2], turn[1, 0]]) @ s
                return body.transverse_inertia * across + body.axial_inertia * spin * s

            force = body.mass * (rate(lambda t, c=centre: rate(c, t)) - gravity)
            moment = rate(momentum)
            total += np.concatenate([force, moment + np.cross(centre(0.0), force)])
            if not is_base:
                force_along = force @ line(i, 0.0)[2]
        np.testing.assert_allclose(share[0, i], total, atol=2e-9)
        # The arm holds the outer half along the limb by a force at B, and all that the joint at A lets go.
        a, p, s = line(i, 0.0)
        on_arm, torso = closure[0, i] - share[0, i], closure[0, i]
        np.testing.assert_allclose(on_arm[3:], np.cross(p, on_arm[:3]), atol=1e-12)
        assert on_arm[:3] @ s == pytest.approx(-force_along, abs=1e-9)
        about_a = torso[3:] - np.cross(a, torso[:3])
        free = axes(s, unit(-points[i]))[:, 0], unit(-points[i])
        if limb.kind == "UPU":
            assert abs(about_a @ free[0]) < 1e-12
            assert abs(about_a @ free[1]) < 1e-12
        else:
            np.testing.assert_allclose(np.cross(s, about_a), 0.0, atol=1e-12)
