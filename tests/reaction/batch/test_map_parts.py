"""Maps by free bodies, and with limits in every form that a question may give them."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from wrists import random_mechanism

import exo_pin as ep

COUNT = 70  # more than one block of poses


def free_body(mechanism, R, motion, load):
    """Per pose: directions s, normals X and b x s as columns, force and moment that limbs and shoulder hold."""
    a, arm = np.array(mechanism.geometry.base_points), mechanism.arm
    for k in range(len(R)):
        b = np.array(mechanism.geometry.platform_points) @ R[k].T
        s = (b - a) / np.linalg.norm(b - a, axis=1)[:, None]
        X = -np.cross(a, b) / np.linalg.norm(np.cross(a, b), axis=1)[:, None]
        c, inertia = R[k] @ arm.centre_of_mass, R[k] @ arm.inertia_about_origin @ R[k].T
        weight = arm.mass * np.array(mechanism.gravity)
        force, moment = weight.copy(), np.cross(c, weight)
        if motion is not None:
            w, e = motion.angular_velocity[k], motion.angular_acceleration[k]
            force -= arm.mass * (np.cross(e, c) + np.cross(w, np.cross(w, c)))
            moment -= inertia @ e + np.cross(w, inertia @ w)
        if load is not None:
            turn = R[k] if load.frame == "arm" else np.eye(3)
            push = turn @ load.force[k]
            force += push
            moment += turn @ load.moment[k] + np.cross(R[k] @ load.at[k], push)
        yield s.T, X.T, np.cross(b, s).T, force, moment


@pytest.mark.parametrize("split", ["spherical", "standalone"])
@pytest.mark.parametrize("terms", ["rest", "motion", "base", "arm"])
def test_maps_of_three_limbs_are_free_bodies(split, terms):
    rng = np.random.default_rng(len(terms) + len(split))
    mechanism = random_mechanism(rng, 3)
    poses = Rotation.random(COUNT, rng=rng)
    motion = ep.Motion(*rng.normal(size=(2, COUNT, 3))) if terms == "motion" else None
    load = None
    if terms in ("base", "arm"):
        load = ep.Load(*(10.0 * rng.normal(size=(2, COUNT, 3))), at=rng.normal(size=(COUNT, 3)), frame=terms)
    found = ep.ShoulderExo.from_mechanism(mechanism).reaction_map(poses, motion, load, split, limits="none")
    assert (found.status != "ok").sum() < COUNT // 2
    R = poses.as_matrix()
    for k, (s, X, arms, force, moment) in enumerate(free_body(mechanism, R, motion, load)):
        values = np.linalg.svd(arms, compute_uv=False) ** 2
        assert found.margin[k] == pytest.approx(3.0 / np.sqrt(values.sum() * (1.0 / values).sum()), rel=1e-6, abs=1e-9)
        if not found.has_answer[k]:
            assert np.isnan(found.actuator_forces[k]).all()
            continue
        f = np.linalg.solve(arms, moment)
        scale = np.abs(f).max()
        np.testing.assert_allclose(found.actuator_forces[k], f, atol=1e-8 * scale)
        held = s @ f - force
        if split == "spherical":
            np.testing.assert_array_equal(found.constraint_forces[k], 0.0)
            assert not np.signbit(found.constraint_forces[k]).any()  # tables have no "-0"
            np.testing.assert_allclose(found.shoulder_force[k], held, atol=1e-8 * scale)
        else:
            g = np.linalg.solve(X, -held)
            np.testing.assert_allclose(found.constraint_forces[k], g, atol=1e-7 * max(scale, np.abs(g).max()))
            np.testing.assert_array_equal(found.shoulder_force[k], 0.0)
            assert not np.signbit(found.shoulder_force[k]).any()
        assert found.magnitude[k] == pytest.approx(np.linalg.norm(found.shoulder_force[k]), rel=1e-12)
