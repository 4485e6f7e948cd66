"""Wrenches about other points, in other axes and on other bodies, against cross products and free bodies."""

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import five_bar, four_bar

from exo_pin import InvalidInput, UnknownName


def moving(named, seed=0):
    chain, rng = named.chain(), np.random.default_rng(seed)
    q = chain.close(named.q + rng.uniform(-0.1, 0.1, chain.model.nq))
    v = chain.project_velocity(q, rng.normal(size=chain.model.nv))
    a = chain.project_acceleration(q, v, rng.normal(size=chain.model.nv))
    joints = [str(name) for name in list(chain.model.names)[1:]]
    return chain, (q, v, a), chain.inverse_dynamics(q, v, a, actuated=joints)


@pytest.mark.parametrize("named", [four_bar(), five_bar()])
def test_the_wrenches_on_a_body_are_its_rate_of_momentum_and_weight(named):
    chain, (q, v, a), forces = moving(named)
    data = chain.model.createData()
    pin.forwardKinematics(chain.model, data, q, v, a)
    weight = chain.model.gravity.linear
    total = np.zeros(6)
    for joint in range(1, chain.model.njoints):
        body, pose = chain._state.body_names[joint], data.oMi[joint]
        inertia, twist, rate = chain.model.inertias[joint], data.v[joint], data.a[joint]
        needed = inertia * rate + twist.cross(inertia * twist)
        force = pose.rotation @ needed.linear - inertia.mass * weight
        arm = pose.rotation @ inertia.lever
        moment = pose.rotation @ needed.angular - np.cross(arm, inertia.mass * weight)
        found = forces.wrench_on(body)
        np.testing.assert_allclose(found.wrench, np.concatenate([force, moment]), atol=1e-9)
        assert found.on == body
        assert found.unique.all()
        # About another point, in the body's own axes.
        point = np.array([0.3, -0.2, 0.5])
        other = forces.wrench_on(body, at=point, in_frame="local").wrench
        back = pose.rotation.T
        expected = np.concatenate([back @ force, back @ (moment - np.cross(point - pose.translation, force))])
        np.testing.assert_allclose(other, expected, atol=1e-9)
        total += np.concatenate([force, moment + np.cross(pose.translation, force)])
    np.testing.assert_allclose(forces.wrench_on("universe").wrench, -total, atol=1e-9)


@pytest.mark.parametrize("named", [four_bar(), five_bar()])
def test_a_reaction_on_the_other_body_is_opposite_and_moves_with_its_point(named):
    chain, (q, _, _), forces = moving(named, 1)
    state = chain._state
    parts = [(str(name), joint) for joint, name in enumerate(chain.model.names) if joint]
    for name, joint in [*parts, (chain.closures[0].name, None)]:
        one = forces.joint_reaction(name)
        if joint is not None:
            bodies = state.body_names[joint], state.body_names[chain.model.parents[joint]]
        else:
            bodies = chain.closures[0].frame_a, chain.closures[0].frame_b
        assert one.on == bodies[0]
        other = forces.joint_reaction(name, on=bodies[1])
        np.testing.assert_allclose(other.wrench, -one.wrench, atol=1e-12)
        assert other.on == bodies[1]
        point = np.array([0.1, 0.7, -0.3])
        place = chain.placements(q)
        own = place[name].translation if joint is not None else None
        if own is not None:
            about = forces.joint_reaction(name, at=point).wrench
            moment = one.wrench[3:] - np.cross(point - own, one.wrench[:3])
            np.testing.assert_allclose(about, np.concatenate([one.wrench[:3], moment]), atol=1e-10)
            # At a frame, in the axes of a frame.
            frame = bodies[0]
            axes = place[frame].rotation.T
            there = forces.joint_reaction(name, at=frame, in_frame=frame).wrench
            moment = one.wrench[3:] - np.cross(place[frame].translation - own, one.wrench[:3])
            np.testing.assert_allclose(there, np.concatenate([axes @ one.wrench[:3], axes @ moment]), atol=1e-10)
        outside = next(body for body in state.body_names if body not in bodies)
        with pytest.raises(InvalidInput, match=f"{bodies[0]!r} or {bodies[1]!r}"):
            forces.joint_reaction(name, on=outside)
        with pytest.raises(UnknownName, match="elsewhere"):
            forces.joint_reaction(name, at="elsewhere")
        with pytest.raises(UnknownName, match="sideways"):
            forces.joint_reaction(name, in_frame="sideways")


def test_a_printed_reaction_says_what_is_unique():
    chain, motion, _ = moving(four_bar(), 2)
    forces = chain.inverse_dynamics(*motion, actuated=["crank_hinge"])
    found = forces.joint_reaction("rocker_hinge")
    lines = str(found).splitlines()
    assert lines[0] == f"rocker_hinge on {chain._state.body_names[3]}"
    for k, name in enumerate(("F_x", "F_y", "F_z", "M_x", "M_y", "M_z")):
        words = lines[1 + k].split()
        assert words[0] == name
        assert float(words[1]) == pytest.approx(found.wrench[k], rel=5.1e-3, abs=1e-6)
        assert " ".join(words[2:]).startswith("N" if k < 3 else "N m")
        assert ("unique" in words) == bool(found.unique[k])
        assert ("equilibrium alone allows any number" in lines[1 + k]) == (not found.unique[k])
    # Across its plane the four-bar is redundant.
    assert not found.unique[2]
    assert found.unique[:2].all()
    np.testing.assert_array_equal(found.force, found.wrench[:3])
    np.testing.assert_array_equal(found.moment, found.wrench[3:])


@pytest.mark.parametrize("weight", [1.0, 2.5, (1.0, 2.0, 0.5, 3.0, 0.0, 1.5)])
@pytest.mark.parametrize("name", ["rocker_hinge", "tip"])
def test_an_objective_is_least_where_no_self_stress_lessens_it(name, weight):
    """Weighted forces, and moments over the length, are at right angles to what they may change by."""
    chain, motion, _ = moving(four_bar(), 3)
    joints = [str(name) for name in list(chain.model.names)[1:]]
    forces = chain.inverse_dynamics(*motion, actuated=joints, objective={name: weight})
    found = forces.joint_reaction(name, in_frame="local", intervals=False)
    unit = np.array([1.0] * 3 + [1.0 / chain.characteristic_length] * 3)
    weights = np.broadcast_to(weight, 6) * unit
    assert found.directions.shape[1] > 0
    slope = (weights[:, None] * found.directions).T @ (weights * found.wrench)
    largest = np.abs(weights[:, None] * found.directions).max() * max(1.0, np.abs(found.wrench).max())
    np.testing.assert_allclose(slope, 0.0, atol=1e-6 * largest)
    # Another solution has more.
    other = chain.inverse_dynamics(*motion, actuated=joints).joint_reaction(name, in_frame="local", intervals=False)
    assert np.linalg.norm(weights * found.wrench) <= np.linalg.norm(weights * other.wrench) * (1 + 1e-9)


def test_the_efforts_are_least_in_the_same_way():
    chain, motion, _ = moving(five_bar(), 3)
    joints = [str(name) for name in list(chain.model.names)[1:]]
    forces = chain.inverse_dynamics(*motion, actuated=joints, objective="efforts")
    # Efforts are tau - Jᵀ λ, for any λ.
    q, v, a = motion
    tau, J = pin.rnea(chain.model, chain.model.createData(), q, v, a), chain.constraint_jacobian(q)
    expected = tau - J.T @ np.linalg.lstsq(J.T, tau, rcond=1e-10)[0]
    np.testing.assert_allclose(forces.tau, expected, atol=1e-6 * np.abs(tau).max())
