"""Maps with the split "elastic": least energy, limits, and the query's numbers."""

import numpy as np
import pytest
from scipy.integrate import quad
from wrists import random_mechanism, regular_poses

import exo_pin as ep

DEGREES = {"degrees": True}

MECHANISMS = {
    "prototype": lambda: ep.load("prototype").replace(limbs=None).mechanism,
    "random-4": lambda: random_mechanism(np.random.default_rng(73), 4),
}


def exo_of(name):
    return ep.ShoulderExo.from_mechanism(MECHANISMS[name]())


def elastic(exo, poses, *stiffness, **question):
    elasticity = ep.Elasticity.of(*stiffness, limb_count=len(exo.limbs))
    return exo.reaction_map(poses, split="elastic", elasticity=elasticity, **question)


def side_stiffnesses(exo, poses, EI, GJ):
    """k_i by integrating the strain energy of a unit side force along the limb."""
    state = exo.inverse_kinematics(poses)
    k = np.empty(state.lengths.shape)
    for index in np.ndindex(k.shape):
        a, b, s = exo.geometry.base_points[index[1]], state.platform_points[index], state.directions[index]
        # Distance along the limb from the foot of O's perpendicular is the arm of the unit force at O.
        bending = quad(lambda t, EI=EI: t * t / EI, a @ s, b @ s)[0]
        k[index] = 1 / (bending + state.reach[index] ** 2 * state.lengths[index] / GJ)
    return k, state.normals


@pytest.mark.parametrize("name", ["prototype", "random-4"])
def test_elastic_split_is_the_one_of_least_energy(name):
    exo, rng = exo_of(name), np.random.default_rng(82)
    poses = regular_poses(exo.mechanism, rng, 30)
    K = rng.normal(size=(3, 3)) * 100
    K = K @ K.T
    own, none = elastic(exo, poses, 300.0, 40.0, K), exo.reaction_map(poses)
    k, X = side_stiffnesses(exo, poses, 300.0, 40.0)
    assert (own.status == "ok").all()
    np.testing.assert_array_equal(own.actuator_forces, none.actuator_forces)
    for row in range(len(poses)):
        N = -none.shoulder_force[row]
        delta = np.linalg.solve(K + X[row].T @ np.diag(k[row]) @ X[row], N)
        np.testing.assert_allclose(own.constraint_forces[row], k[row] * (X[row] @ delta), rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(own.shoulder_force[row], -K @ delta, rtol=1e-8, atol=1e-8)
        # The three forces on the arm sum to zero.
        total = N - own.constraint_forces[row] @ X[row] + own.shoulder_force[row]
        np.testing.assert_allclose(total, 0, atol=1e-10 * np.abs(N).max())
        # No other split that balances stores less energy.
        softness = np.linalg.inv(K)

        def energy(g, row=row, softness=softness, N=N):
            F = g @ X[row] - N
            return 0.5 * (g**2 / k[row]).sum() + 0.5 * F @ softness @ F

        least = energy(own.constraint_forces[row])
        for _ in range(5):
            assert energy(own.constraint_forces[row] + rng.normal(size=len(k[row]))) > least


def test_elastic_limits():
    exo, rng = ep.load("prototype").replace(limbs=None), np.random.default_rng(83)
    poses = regular_poses(exo.mechanism, rng, 200, margin=0.05)
    spherical, standalone = exo.reaction_map(poses), exo.reaction_map(poses, split="standalone")
    scale = np.abs(standalone.constraint_forces).max()
    soft_limbs, soft_joint = elastic(exo, poses, 3e-9, 3e-9, 1e4), elastic(exo, poses, 300.0, 300.0, 1e-9)
    stiff_joint = elastic(exo, poses, 300.0, 300.0, 1e12)
    for limit, known in ((soft_limbs, spherical), (soft_joint, standalone), (stiff_joint, spherical)):
        np.testing.assert_allclose(limit.constraint_forces, known.constraint_forces, atol=1e-8 * scale)
        np.testing.assert_allclose(limit.shoulder_force, known.shoulder_force, atol=1e-8 * scale)
    # A bare muscle, and a guide that is not locked against twist, carry no side force at all.
    for EI, GJ in ((0.0, 0.0), (300.0, 0.0), (0.0, 300.0)):
        bare = elastic(exo, poses, EI, GJ, 1e4)
        assert (bare.constraint_forces == 0).all()
        np.testing.assert_allclose(bare.shoulder_force, spherical.shoulder_force, rtol=1e-12)
    # Elastic universal joints are in series. SPS limbs have no side stiffness whatever their guides.
    jointed = ep.Elasticity.of(300.0, 300.0, 1e4, joint_stiffness=1e5, joint_twist_stiffness=1e3)
    series = exo.reaction_map(poses, split="elastic", elasticity=jointed)
    k, X = side_stiffnesses(exo, poses, 300.0, 300.0)
    radii = [np.linalg.norm(p, axis=-1) for p in (exo.geometry.base_points, exo.geometry.platform_points)]
    # Each joint takes the force g across and, (D-18), the couple g times its distance from the centre.
    k = 1 / (1 / k + 2 / 1e5 + (radii[0] ** 2 + radii[1] ** 2) / 1e3)
    delta = -series.shoulder_force / 1e4
    np.testing.assert_allclose(series.constraint_forces, k * np.einsum("kni,ki->kn", X, delta), rtol=1e-9, atol=1e-9)
    cables = exo.replace(limbs=(ep.Limb("SPS"),) * 3)
    assert (elastic(cables, poses, 300.0, 300.0, 1e4).constraint_forces == 0).all()
    nothing = elastic(cables, poses, 300.0, 300.0, 0.0)
    assert (nothing.status == "not_solved").all()
    assert np.isnan(nothing.shoulder_force).all()


def test_elastic_of_the_design_is_that_of_the_query():
    guide = ep.LimbGuide(40.0, 30.0, joint_stiffness=2e5, joint_twist_stiffness=3e3)
    exo = ep.load("prototype").replace(
        limbs=[ep.Limb(guide=guide), ep.Limb(), ep.Limb(guide=guide)], shoulder=ep.Shoulder(stiffness=2e4)
    )
    poses = regular_poses(exo.mechanism, np.random.default_rng(70), 50)
    series, query = exo.reaction_map(poses, split="elastic"), exo.reaction(poses, split="elastic")
    assert series.split == query.split == "elastic"
    np.testing.assert_array_equal(series.status, query.status)
    np.testing.assert_array_equal(series.shoulder_force, query.shoulder_force)
    # Stiff parts move little: then the compiled law of small displacements is the limit of the other.
    stiff = 1e6
    elasticity = ep.Elasticity.of(40.0 * stiff, 30.0 * stiff, 2e4 * stiff, 2e5 * stiff, 3e3 * stiff, limb_count=3)
    guide = ep.LimbGuide(40.0 * stiff, 30.0 * stiff, joint_stiffness=2e5 * stiff, joint_twist_stiffness=3e3 * stiff)
    exo = exo.replace(limbs=[ep.Limb(guide=guide)] * 3, shoulder=ep.Shoulder(stiffness=2e4 * stiff))
    small, query = (exo.reaction_map(poses, split="elastic", **more) for more in ({"elasticity": elasticity}, {}))
    scale = np.abs(query.actuator_forces).max(axis=1)[:, None]
    np.testing.assert_allclose(small.shoulder_force / scale, query.shoulder_force / scale, atol=1e-5)
    np.testing.assert_allclose(small.constraint_forces / scale, query.constraint_forces / scale, atol=1e-5)
