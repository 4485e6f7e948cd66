"""Limbs with mass as free bodies, by differences of their motion."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import (
    MECHANISMS,
    exo_of,
    heavy_limbs,
    random_terms,
    regular_poses,
)

import exo_pin as ep
from exo_pin import wrist

OFFSETS = {
    "fits": None,
    "base": ep.CentreOffset([0.012, -0.008, 0.015], [0, 0, 0]),
    "cuff": ep.CentreOffset([0, 0, 0], [-0.01, 0.006, 0.012]),
    "both": ep.CentreOffset([0.01, 0.007, -0.012], [0.008, -0.011, 0.009]),
}


@pytest.mark.parametrize("offset", OFFSETS.values(), ids=OFFSETS)
@pytest.mark.parametrize("name", ["prototype", "random-3-mixed", "random-5"])
def test_limbs_with_mass_balance_as_free_bodies(name, offset):
    """Each limb: torso's wrench + arm's wrench + weight = rate of change of momentum, by differences of its motion."""
    mechanism = heavy_limbs(MECHANISMS[name](), np.random.default_rng(25))
    rng = np.random.default_rng(26)
    poses = regular_poses(mechanism, rng, 10, margin=0.1)
    motion, load = random_terms(rng, len(poses))
    answer = exo_of(mechanism).reaction(poses, motion, load, centre_offset=offset)
    assert np.nanmax(answer.residual) < 1e-9
    assert answer.has_answer.sum() >= 9
    step = np.finfo(float).eps ** 0.25  # second differences: truncation and rounding both about 1e-8 of the scale

    for k in np.flatnonzero(answer.has_answer):
        pose, omega, eta = poses[k], motion.angular_velocity[k], motion.angular_acceleration[k]

        def momenta(t, pose=pose, omega=omega, eta=eta):
            """Momentum and moment of momentum about O of each limb by differences, at time t."""
            state = {s: limb_points(mechanism, moved(pose, omega, eta, t + s), offset) for s in (-step / 2, step / 2)}
            return limb_momenta(mechanism, state[-step / 2], state[step / 2], step)

        rate = (momenta(step) - momenta(-step)) / (2 * step)
        weight = limb_weights(mechanism, limb_points(mechanism, pose, offset))
        forces = -answer.harness_wrenches[k] - answer.limb_wrenches[k] + weight
        scale = max(np.abs(answer.limb_wrenches[k]).max(), 1)
        np.testing.assert_allclose(forces, rate, atol=3e-5 * scale)


def moved(pose, omega, eta, t):
    return Rotation.from_rotvec(omega * t + eta * t**2 / 2) * pose


def limb_points(mechanism, pose, offset=None):
    """Two point masses and an axial spin cannot stand for a rod, so six points a half: the same mass properties.

    A half turns with the universal joint at its own end: one axis across the limb stays perpendicular to the joint's
    axis that is fixed to torso or arm.
    """
    R = pose.as_matrix()
    base, cuff = (np.zeros(3), np.zeros(3)) if offset is None else (offset.base, offset.cuff)
    points, masses = [], []
    for i, limb in enumerate(mechanism.limbs):
        A, B = mechanism.geometry.base_points[i], R @ mechanism.geometry.platform_points[i]
        a, b = A + base, B + R @ cuff
        s = (b - a) / np.linalg.norm(b - a)
        own, weights = [], []
        for half, joint, fixed, sign in ((limb.base_body, a, A, 1.0), (limb.platform_body, b, B, -1.0)):
            X = np.cross(fixed, s)
            X /= np.linalg.norm(X)
            centre = joint + sign * half.centre * s
            m = half.mass / 6
            # Pairs at ±r along the three axes: axial inertia 4 m r_t², transverse 2 m (r_t² + r_s²).
            # An SPS limb's idle spin is no matter of the model: a rod without inertia about its own line.
            r_t = np.sqrt(half.axial_inertia / (4 * m)) if limb.kind == "UPU" else 0.0
            r_s = np.sqrt(half.transverse_inertia / (2 * m) - r_t**2)
            for axis, r in ((s, r_s), (X, r_t), (np.cross(s, X), r_t)):
                own += [centre + r * axis, centre - r * axis]
                weights += [m, m]
        points.append(own)
        masses.append(weights)
    return np.array(points), np.array(masses)


def limb_momenta(mechanism, before, after, step):
    (p, masses), (q, _) = before, after
    velocity, middle = (q - p) / step, (p + q) / 2
    momentum = (masses[..., None] * velocity).sum(axis=1)
    angular = (masses[..., None] * np.cross(middle, velocity)).sum(axis=1)
    return np.concatenate([momentum, angular], axis=1)


def limb_weights(mechanism, state):
    points, masses = state
    weight = masses[..., None] * mechanism.gravity
    return np.concatenate([weight.sum(axis=1), np.cross(points, weight).sum(axis=1)], axis=1)


def test_side_force_is_the_couple_in_the_universal_joint():
    """With heavy limbs too: g = 0 leaves no couple at B_i across both axes of its joint, (D-13), (D-18)."""
    mechanism = heavy_limbs(MECHANISMS["prototype"](), np.random.default_rng(27))
    poses = regular_poses(mechanism, np.random.default_rng(28), 10)
    exo = exo_of(mechanism)
    for split in ("spherical", "standalone"):
        answer = exo.reaction(poses, split=split)
        state = wrist.inverse_kinematics(mechanism.geometry, poses)
        force, moment = answer.limb_wrenches[..., :3], answer.limb_wrenches[..., 3:]
        couple = moment - np.cross(state.platform_points, force)
        radius = np.linalg.norm(state.platform_points, axis=-1)
        across = np.cross(state.platform_points / radius[..., None], state.normals)
        expected = answer.constraint_forces[..., None] * radius[..., None] * across
        np.testing.assert_allclose(couple, expected, atol=1e-9 * max(1, np.abs(moment).max()))


@pytest.mark.parametrize("name", ["prototype", "random-3-mixed", "random-5"])
def test_no_offset_equals_the_chain_through_pinocchio(name):
    """The closed form of displaced limbs with mass, at no offset and at 1e-9 m, against the multibody chain."""
    mechanism = heavy_limbs(MECHANISMS[name](), np.random.default_rng(25))
    rng = np.random.default_rng(29)
    poses = regular_poses(mechanism, rng, 20, margin=0.1)
    motion, load = random_terms(rng, len(poses))
    exo = exo_of(mechanism)
    chain = exo.reaction(poses, motion, load)
    for size, tolerance in ((0.0, 1e-10), (1e-9, 1e-6)):
        closed = exo.reaction(poses, motion, load, centre_offset=[size, 0.0, -size])
        for field in ("actuator_forces", "shoulder_force", "limb_wrenches", "harness_wrenches", "cuff_wrench"):
            ours, theirs = getattr(closed, field), getattr(chain, field)
            np.testing.assert_allclose(ours, theirs, rtol=0, atol=tolerance * np.abs(chain.limb_wrenches).max())


def test_tension_of_displaced_heavy_limbs_is_what_the_slide_carries():
    """Free body of the platform half along the limb, as above, with base and cuff off the shoulder's centre."""
    mechanism = heavy_limbs(MECHANISMS["prototype"](), np.random.default_rng(61))
    offset = OFFSETS["both"]
    poses = regular_poses(mechanism, np.random.default_rng(62), 5, margin=0.1)
    motion, load = random_terms(np.random.default_rng(63), len(poses))
    answer = exo_of(mechanism).reaction(poses, motion, load, centre_offset=offset)
    step = np.finfo(float).eps ** 0.25
    for k, pose in enumerate(poses):
        omega, eta = motion.angular_velocity[k], motion.angular_acceleration[k]

        def line(t, pose=pose, omega=omega, eta=eta):
            R = moved(pose, omega, eta, t).as_matrix()
            b = (mechanism.geometry.platform_points + offset.cuff) @ R.T
            span = b - mechanism.geometry.base_points - offset.base
            return b, span / np.linalg.norm(span, axis=1, keepdims=True)

        def centres(t):
            half = np.array([limb.platform_body.centre for limb in mechanism.limbs])
            b, s = line(t)
            return b - half[:, None] * s

        acceleration = (centres(step) - 2 * centres(0.0) + centres(-step)) / step**2
        mass = np.array([limb.platform_body.mass for limb in mechanism.limbs])[:, None]
        from_slide = mass * (acceleration - mechanism.gravity) + answer.limb_wrenches[k, :, :3]
        f = -np.einsum("ij,ij->i", from_slide, line(0.0)[1])
        np.testing.assert_allclose(f, answer.actuator_forces[k], atol=2e-6 * np.abs(f).max())
