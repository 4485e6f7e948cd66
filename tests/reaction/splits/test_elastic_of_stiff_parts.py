"""The split "elastic" where parts are so stiff that the geometry stays: least energy, and its limits."""

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


#: Parts so much stiffer hardly change the geometry; only ratios of stiffness count then.
STIFFER = 1e6
#: What is left of the change of geometry, over the largest force.
LEFT = 1e-5


def elastic(exo, poses, EI, GJ, shoulder, joint=np.inf, twist=np.inf):
    guide = ep.LimbGuide(
        EI * STIFFER, GJ * STIFFER, joint_stiffness=joint * STIFFER, joint_twist_stiffness=twist * STIFFER
    )
    limbs = [ep.Limb(limb.kind, guide=guide if limb.kind == "UPU" else None) for limb in exo.limbs]
    stiff = exo.replace(limbs=limbs, shoulder=ep.Shoulder(stiffness=shoulder * STIFFER))
    answer = stiff.reaction_map(poses, split="elastic")
    np.testing.assert_array_equal(answer.shoulder_force, stiff.reaction(poses, split="elastic").shoulder_force)
    return answer


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
    np.testing.assert_allclose(
        own.actuator_forces, none.actuator_forces, atol=1e-6 * np.abs(none.actuator_forces).max()
    )
    for row in range(len(poses)):
        N = -none.shoulder_force[row]
        delta = np.linalg.solve(K + X[row].T @ np.diag(k[row]) @ X[row], N)
        near = {"rtol": 0.0, "atol": LEFT * max(np.abs(N).max(), np.abs(none.actuator_forces[row]).max())}
        np.testing.assert_allclose(own.constraint_forces[row], k[row] * (X[row] @ delta), **near)
        np.testing.assert_allclose(own.shoulder_force[row], -K @ delta, **near)
        # No other split that balances stores less energy.
        softness = np.linalg.inv(K)

        def energy(g, row=row, softness=softness, N=N):
            F = g @ X[row] - N
            return 0.5 * (g**2 / k[row]).sum() + 0.5 * F @ softness @ F

        least = energy(own.constraint_forces[row])
        for _ in range(5):
            assert energy(own.constraint_forces[row] + rng.normal(size=len(k[row]))) > least


@pytest.mark.full
def test_elastic_limits():
    exo, rng = ep.load("prototype").replace(limbs=None), np.random.default_rng(83)
    poses = regular_poses(exo.mechanism, rng, 200, margin=0.05)
    spherical, standalone = exo.reaction_map(poses), exo.reaction_map(poses, split="standalone")
    scale = np.abs(standalone.constraint_forces).max()
    soft_limbs, soft_joint = elastic(exo, poses, 3e-5, 3e-5, 1e4), elastic(exo, poses, 300.0, 300.0, 1e-4)
    stiff_joint = elastic(exo, poses, 3e-3, 3e-3, 1e6)
    for limit, known in ((soft_limbs, spherical), (soft_joint, standalone), (stiff_joint, spherical)):
        np.testing.assert_allclose(limit.constraint_forces, known.constraint_forces, rtol=LEFT, atol=LEFT * scale)
        np.testing.assert_allclose(limit.shoulder_force, known.shoulder_force, rtol=LEFT, atol=LEFT * scale)
    # A bare muscle, and a guide that is not locked against twist, carry no side force at all.
    for EI, GJ in ((0.0, 0.0), (300.0, 0.0), (0.0, 300.0)):
        bare = elastic(exo, poses, EI, GJ, 1e4)
        assert (bare.constraint_forces == 0).all()
        np.testing.assert_allclose(bare.shoulder_force, spherical.shoulder_force, atol=LEFT * scale)
    # Elastic universal joints are in series. SPS limbs have no side stiffness whatever their guides.
    series = elastic(exo, poses, 300.0, 300.0, 1e4, 1e5, 1e3)
    k, X = side_stiffnesses(exo, poses, 300.0, 300.0)
    radii = [np.linalg.norm(p, axis=-1) for p in (exo.geometry.base_points, exo.geometry.platform_points)]
    # Each joint takes the force g across and, (D-18), the couple g times its distance from the centre.
    k = 1 / (1 / k + 2 / 1e5 + (radii[0] ** 2 + radii[1] ** 2) / 1e3)
    delta = -series.shoulder_force / 1e4
    expected = k * np.einsum("kni,ki->kn", X, delta)
    np.testing.assert_allclose(series.constraint_forces, expected, rtol=LEFT, atol=LEFT * scale)
    cables = exo.replace(limbs=(ep.Limb("SPS"),) * 3)
    assert (elastic(cables, poses, 300.0, 300.0, 1e4).constraint_forces == 0).all()
    nothing = elastic(cables, poses, 300.0, 300.0, 0.0)
    assert (nothing.status == "no_equilibrium").all()
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
