"""Every link of every mechanism is in balance: Newton and Euler with accelerations from positions alone."""

from math import comb

import numpy as np
import pinocchio as pin
import pytest
from closed_motion import MAKERS, closed_motion, loops, some_load

#: Central differences of tenth order: weights of f(k h), k = -5 .. 5, for h² f''.
_ORDER, _STEP = 5, 0.03


def second_difference_weights():
    """w_k = 2 (-1)^(k+1) (m!)² / (k² (m-k)! (m+k)!), and what makes their sum zero."""
    m = _ORDER
    weights = {k: 2 * (-1) ** (k + 1) * comb(2 * m, m - k) / comb(2 * m, m) / k**2 for k in range(1, m + 1)}
    return weights | {0: -2 * sum(weights.values())} | {-k: weight for k, weight in weights.items()}


def accelerations(chain, q, v, a):
    """Of every body: second derivatives of its origin and of its rotation matrix along q ⊕ (v t + a t²/2).

    That curve has velocity v and acceleration a at t = 0, whatever the joints. Only positions are asked of Pinocchio.
    The error is of the order of (h ω)^10 ω²/3000 in truncation and 1e-15/h² in rounding, ω being a rate of the motion,
    with h ω < 0.1: below 1e-11 of the accelerations' size.
    """
    data, model = chain.model.createData(), chain.model
    step = _STEP / max(1.0, np.abs(v).max(), np.sqrt(np.abs(a).max()))
    points, turns = np.zeros((model.njoints, 3)), np.zeros((model.njoints, 3, 3))
    for k, weight in second_difference_weights().items():
        t = k * step
        pin.forwardKinematics(model, data, pin.integrate(model, q, v * t + a * t**2 / 2))
        for body in range(model.njoints):
            points[body] += weight * data.oMi[body].translation / step**2
            turns[body] += weight * data.oMi[body].rotation / step**2
    return points, turns


def vee(matrix):
    """Twice the axial part: Σ ρ × ρ̈ of Σ ρ̈ ρᵀ."""
    return np.array([matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]])


def needed(chain, q, body, point, turn):
    """Rate of linear momentum, and of moment of momentum about the world's origin, that a body's acceleration takes."""
    data = chain.model.createData()
    pin.forwardKinematics(chain.model, data, q)
    inertia, place = chain.model.inertias[body], data.oMi[body]
    centre = place.translation + place.rotation @ inertia.lever
    rate = inertia.mass * (point + turn @ inertia.lever)
    # ∫ ρ ρᵀ dm about the centre of mass, in the body, from the moments of inertia.
    second = np.trace(inertia.inertia) / 2 * np.eye(3) - inertia.inertia
    return rate, vee(turn @ second @ place.rotation.T) + np.cross(centre, rate), centre


def body_of(chain, frame):
    return chain.model.frames[chain.model.getFrameId(frame)].parentJoint


def summed(chain, forces):
    """Wrenches about the world's origin that joints and closures put on every body, in a book of our own."""
    book = np.zeros((chain.model.njoints, 6))
    for index in range(1, chain.model.njoints):
        wrench = forces.joint_reaction(chain.model.names[index], at=np.zeros(3), intervals=False).wrench
        book[index] += wrench
        book[chain.model.parents[index]] -= wrench
    for closure in loops(chain):
        expressed = forces.joint_reaction(closure.name, on=closure.frame_a, at=np.zeros(3), intervals=False)
        back = forces.joint_reaction(closure.name, on=closure.frame_b, at=np.zeros(3), intervals=False)
        np.testing.assert_array_equal(expressed.wrench, -back.wrench)
        book[body_of(chain, closure.frame_a)] += expressed.wrench
        book[body_of(chain, closure.frame_b)] += back.wrench
    return book


def outside(chain, q, load):
    """Weights' and load's wrenches on every body, about the world's origin."""
    book = np.zeros((chain.model.njoints, 6))
    data = chain.model.createData()
    pin.forwardKinematics(chain.model, data, q)
    for body in range(1, chain.model.njoints):
        inertia = chain.model.inertias[body]
        weight = inertia.mass * chain.model.gravity.linear
        book[body] += np.concatenate([weight, np.cross(data.oMi[body].act(inertia.lever), weight)])
    for frame, wrench in load.items():
        at = chain.placement(q, frame).translation
        wrench = np.asarray(wrench)
        book[body_of(chain, frame)] += np.concatenate([wrench[:3], wrench[3:] + np.cross(at, wrench[:3])])
    return book


@pytest.fixture(params=[pytest.param(seed, marks=() if seed < 2 else pytest.mark.full) for seed in range(4)])
def seed(request):
    return request.param


@pytest.fixture(params=MAKERS)
def moving(request, seed):
    name = request.param
    chain, q, v, a = closed_motion(name, 20 + seed)
    chain.model.gravity.linear = np.array([1.0, -2.0, -9.0])
    load = some_load(chain, seed)
    forces = chain.inverse_dynamics(q, v, a, external=load)
    return chain, (q, v, a), load, forces


def test_joints_and_closures_carry_and_accelerate_every_link(moving):
    chain, (q, v, a), load, forces = moving
    points, turns = accelerations(chain, q, v, a)
    book, given = summed(chain, forces), outside(chain, q, load)
    size = np.abs(book).max()
    for body in range(1, chain.model.njoints):
        rate, turning, _ = needed(chain, q, body, points[body], turns[body])
        total = book[body] + given[body]
        np.testing.assert_allclose(total[:3], rate, rtol=0, atol=1e-9 * size)
        np.testing.assert_allclose(total[3:], turning, rtol=0, atol=1e-9 * size)


def test_the_wrench_on_a_body_is_the_sum_of_its_joints_and_closures(moving):
    chain, _, _, forces = moving
    book = summed(chain, forces)
    size = np.abs(book).max()
    links = {body_of(chain, frame.name): frame.name for frame in chain.model.frames if frame.type == pin.FrameType.BODY}
    for body, link in ({0: "universe"} | {key: name for key, name in links.items() if key}).items():
        total = forces.wrench_on(link, at=np.zeros(3), intervals=False)
        np.testing.assert_allclose(total.wrench, book[body], rtol=0, atol=1e-9 * size)
        # It carries and accelerates the body, so equilibrium knows it; the world's is known with the others'.
        assert total.unique.all()
        assert total.undetermined == 0
