"""What bounds and objective choose, against exo.reaction's own programs and against trying every set of bounds."""

import contextlib
import dataclasses

import numpy as np
import pytest
from asked_dynamics import loaded
from closed_motion import wrist
from exchanged_closures import turned
from mechanisms import random_wrist
from scipy.spatial.transform import Rotation
from self_stress import Open, lexicographic
from skeletons import four_bar_skeleton

import exo_pin as ep
from exo_pin import InfeasibleForces, SolverFailed, thesis_rotation
from exo_pin.chain import PULL, PUSH, ClosedChain
from exo_pin.wrist_chain import mechanism_urdf

FORCE_ONLY = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
POSES = [(40, -20, -30), (10, 5, 0), (20, -10, 15), (-15, 25, 10)]


def posed(mechanism, pose):
    chain = ClosedChain.from_urdf(*mechanism_urdf(mechanism))
    q = chain.neutral()
    q[chain.configuration_slice("root_joint")] = pose.as_quat()
    return chain, chain.close(q, hold=["root_joint"])


def by_side_force(chain, q, normals):
    """The chain with the first axis of every limb's frame at the torso along X_i of this pose."""
    closures = []
    for closure, normal in zip(chain.closures, normals, strict=True):
        R = chain.placement(q, closure.frame_a).rotation
        across = np.cross(normal, [0.3, -0.8, 0.5])
        across /= np.linalg.norm(across)
        axes = np.column_stack([normal, across, np.cross(normal, across)])
        turn = Rotation.from_matrix(R.T @ axes).as_quat()
        ends = turned(closure.placement_a, turn), turned(closure.placement_b, turn)
        closures.append(dataclasses.replace(closure, placement_a=ends[0], placement_b=ends[1]))
    return ClosedChain(chain.model, dataclasses.replace(chain.description, closures=tuple(closures)))


@pytest.mark.parametrize("pose", POSES)
@pytest.mark.parametrize("bounds", [(-10.0, 10.0), (-2.0, 0.5), (-0.3, 4.0), (0.0, 0.0), None])
def test_the_prototypes_least_shoulder_force_is_that_of_reaction(pose, bounds):
    load = ep.Load([5.0, -3.0, -20.0], at=(0.0, 0.0, -0.3))
    exo, R = ep.load("prototype"), thesis_rotation(*pose, degrees=True)
    expected = exo.reaction(R, load=load, split="minimal", constraint_bounds=bounds, limits="none")
    chain, q = posed(exo.mechanism, R)
    chain = by_side_force(chain, q, exo.inverse_kinematics(R).normals)
    limits = None
    if bounds is not None:
        # A limb pulls the arm by -g X and the torso holds the limb by as much.
        low, high = np.full(6, -np.inf), np.full(6, np.inf)
        low[0], high[0] = -bounds[1], -bounds[0]
        limits = {closure.name: (low, high) for closure in chain.closures}
    external = {"arm": np.concatenate([load.force, np.cross(R.as_matrix() @ load.at, load.force)])}
    forces = chain.inverse_dynamics(q, external=external, reaction_bounds=limits, objective={"root_joint": FORCE_ONLY})
    size = max(np.abs(expected.limb_wrenches).max(), 1.0)
    shoulder = forces.joint_reaction("root_joint").force
    np.testing.assert_allclose(shoulder, expected.shoulder_force, rtol=0, atol=1e-7 * size)
    f = [-forces.effort(joint)[0] for joint in chain.roles.actuated]
    np.testing.assert_allclose(f, expected.actuator_forces, rtol=0, atol=1e-7 * size)
    g = [-forces.joint_reaction(closure.name, in_frame="local").force[0] for closure in chain.closures]
    np.testing.assert_allclose(g, expected.constraint_forces, rtol=0, atol=1e-6 * size)
    if bounds is None:
        assert np.linalg.norm(shoulder) < 1e-7 * size


def pulled(seed, kinds):
    mechanism = random_wrist(seed, kinds, with_masses=True)
    return ep.ShoulderExo(mechanism.geometry, arm=mechanism.arm, limbs=mechanism.limbs)


def compare_pull(exo, pose, split, objective):
    """Both answers of limbs that only pull, or both refusals: True if there was an answer."""
    R = thesis_rotation(*pose, degrees=True)
    expected = exo.reaction(R, split=split, limits="pull")
    chain, q = posed(exo.mechanism, R)
    bounds = dict.fromkeys(chain.roles.actuated, PULL)
    if expected.status != "ok":
        with pytest.raises(InfeasibleForces):
            chain.inverse_dynamics(q, effort_bounds=bounds, objective=objective)
        return False
    forces = chain.inverse_dynamics(q, effort_bounds=bounds, objective=objective)
    size = max(np.abs(expected.actuator_forces).max(), np.abs(expected.shoulder_force).max())
    expressed = forces.joint_reaction("root_joint").force
    np.testing.assert_allclose(expressed, expected.shoulder_force, rtol=0, atol=1e-6 * size)
    if objective == "efforts":
        f = [-forces.effort(joint)[0] for joint in chain.roles.actuated]
        np.testing.assert_allclose(f, expected.actuator_forces, rtol=0, atol=1e-6 * size)
    return True


@pytest.mark.parametrize(("split", "objective"), [("minimal", {"root_joint": FORCE_ONLY}), ("spherical", "efforts")])
@pytest.mark.parametrize("kinds", ["SSSS", "SSSSS"])
@pytest.mark.full
def test_limbs_that_only_pull_agree_with_reaction_or_are_infeasible_in_both(kinds, split, objective):
    answered = [
        compare_pull(pulled(seed, kinds), pose, split, objective)
        for seed in (1, 4, 5, 12, 13, 15)
        for pose in POSES[1:3]
    ]
    assert any(answered)
    assert not all(answered)


def lexicographic_answer(chain, q, v, a, bounds, goal, rounding=1e-9):
    """Own answer to bounds on efforts and an objective, with every self-stress tried."""
    other = Open(chain, q, v, a)
    C, c = [], []
    for joint, (low, high) in bounds.items():
        own = chain.velocity_slice(joint)
        constant, effect = other.affine(lambda z, own=own: other.forces(z).tau[own])
        if np.isfinite(high):
            C, c = [*C, effect], [*c, high - constant]
        if np.isfinite(low):
            C, c = [*C, -effect], [*c, constant - low]
    rows = np.vstack(C) if C else np.zeros((0, other.size))
    sides = np.concatenate(c) if c else np.zeros(0)
    metric = other.affine(other.everything)
    expressed = (np.zeros(0), np.zeros((0, other.size)))
    if goal is not None:
        expressed = other.affine(lambda z: goal(other, z))
    return other, lexicographic(expressed, metric, rows, sides, rounding)


@pytest.mark.parametrize("bounded", [False, True])
@pytest.mark.parametrize("goal", [None, "shoulder", "efforts"])
@pytest.mark.parametrize(
    ("kinds", "seed"), [("UUU", 21), pytest.param("UUSS", 4, marks=pytest.mark.full), ("USUSU", 13)]
)
def test_the_result_is_the_best_of_all_sets_of_bounds_and_then_the_shortest(kinds, seed, goal, bounded):
    named = wrist(random_wrist(seed, kinds, with_masses=True))
    chain, rng = named.chain(), np.random.default_rng(seed)
    q = named.q
    v = chain.project_velocity(q, rng.normal(size=chain.model.nv))
    a = chain.project_acceleration(q, v, rng.normal(size=chain.model.nv) * 3)
    free = chain.inverse_dynamics(q, v, a)
    slides = chain.roles.actuated
    # Limbs of which the tension is open may give 0.8 of what they would without bounds, and 1 N.
    bounds = {}
    if bounded:
        for joint in slides:
            effort = free.effort(joint)[0]
            if not free.effort_is_unique[chain.velocity_slice(joint)].all():
                bounds[joint] = (min(0.0, 0.8 * effort) - 1.0, max(0.0, 0.8 * effort) + 1.0)
        if not bounds:
            bounds = {slides[0]: (-1e3, 1e3)}
    goals = {
        None: None,
        "shoulder": lambda other, z: other.wrench("root_joint", z)[:3],
        "efforts": lambda other, z: other.forces(z).tau[chain.velocity_indices(slides)],
    }
    other, (best, _, z) = lexicographic_answer(chain, q, v, a, bounds, goals[goal])
    objective = {"shoulder": {"root_joint": FORCE_ONLY}, "efforts": "efforts", None: None}[goal]
    if z is None:
        with pytest.raises(InfeasibleForces):
            chain.inverse_dynamics(q, v, a, effort_bounds=bounds, objective=objective)
        return
    forces = chain.inverse_dynamics(q, v, a, effort_bounds=bounds or None, objective=objective)
    size = np.abs(other.everything(z)).max()
    for joint in [*list(chain.model.names)[1:], *(closure.name for closure in chain.closures)]:
        expressed = forces.joint_reaction(joint, intervals=False).wrench
        np.testing.assert_allclose(expressed, other.wrench(joint, z), rtol=0, atol=2e-6 * size)
    if goal == "shoulder":
        assert np.linalg.norm(forces.joint_reaction("root_joint").force) == pytest.approx(best, abs=1e-6 * size)


def test_two_motors_of_a_four_bar_share_its_load_as_the_least_squares_of_their_torques_do():
    # One freedom, two motors at A and B with rates 1 and r of it: power balances τ_A + r τ_B = P, so the least
    # τ_A² + τ_B² has τ_B = r τ_A.
    chain = four_bar_skeleton().chain(("C",), actuated=("A", "B"))
    q = chain.neutral()
    alone = chain.inverse_dynamics(q, actuated=["A"]).effort("A")[0]
    v, _ = chain.dependent_motion(q, ["A"], [1.0])
    rate = v[chain.velocity_slice("B")][0]
    forces = chain.inverse_dynamics(q, objective="efforts")
    assert forces.effort("A")[0] == pytest.approx(alone / (1 + rate**2), rel=1e-8)
    assert forces.effort("B")[0] == pytest.approx(rate * alone / (1 + rate**2), rel=1e-8)
    assert not forces.effort_is_unique[chain.velocity_indices(["A", "B"])].any()
    # And between bounds: A may give half of what it would alone, B has to give the rest.
    half = chain.inverse_dynamics(q, effort_bounds={"A": (alone / 2, alone / 2) if alone > 0 else (alone / 2,) * 2})
    assert half.effort("B")[0] == pytest.approx(alone / 2 / rate, rel=1e-7)
    np.testing.assert_allclose(half.effort_interval("B"), [[alone / 2 / rate] * 2], rtol=1e-7)
    # One that only pushes where it would have to pull leaves all to the other.
    wrong = PULL if alone > 0 else PUSH
    other = chain.inverse_dynamics(q, effort_bounds={"A": wrong}, objective="efforts")
    assert other.effort("A")[0] == pytest.approx(0.0, abs=1e-7 * abs(alone))
    assert other.effort("B")[0] == pytest.approx(alone / rate, rel=1e-7)


@pytest.mark.parametrize("share", [1e-12, 1e-9, 1e-7, 1e-3])
def test_efforts_that_bounds_nearly_fix_are_within_their_intervals(share):
    case = loaded("four-bar")
    chain, names = case.chain, list(case.chain.model.names)[1:]
    own = chain.inverse_dynamics(case.q, case.v, case.a, actuated=names).tau
    bounds = {name: (tau, tau + 2.0 * share * abs(tau)) for name, tau in zip(names, own, strict=True)}
    found = chain.inverse_dynamics(case.q, case.v, case.a, actuated=names, effort_bounds=bounds)
    for name, tau in zip(names, own, strict=True):
        low, high = found.effort_interval(name)[0]
        assert low - 1e-6 <= tau <= high + 1e-6
        assert high - low <= 2.0 * share * abs(tau) + 1e-6


def test_intervals_within_bounds_a_billion_times_the_forces_are_solved_or_refused():
    case = loaded("four-bar")
    chain, names = case.chain, list(case.chain.model.names)[1:]
    own = chain.inverse_dynamics(case.q, case.v, case.a, actuated=names)
    bounds = dict.fromkeys(names, (-1e12, 1e12)) | {names[1]: (own.tau[1], own.tau[1])}
    found = chain.inverse_dynamics(case.q, case.v, case.a, actuated=names, effort_bounds=bounds)
    for name in names:
        with contextlib.suppress(SolverFailed):
            low, high = found.effort_interval(name)[0]
            assert low - 1e-3 <= found.effort(name)[0] <= high + 1e-3
