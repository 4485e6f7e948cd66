"""Forces of many samples at once are those of each alone, and a bad sample spoils no other."""

import numpy as np
import pinocchio as pin
import pytest
from closed_motion import loops
from mechanisms import five_bar
from moving_chains import ALL, moving
from rubbing_chains import with_friction
from spatial_mechanisms import delta

from exo_pin import UndrivenMotion
from exo_pin.chain import ClosedChain, ClosedForcesStack, Closures, JointProperties

#: They compile kernels of their own.
pytestmark = pytest.mark.full

SAMPLES = 12
#: Of the largest number of its kind: a stack and a sample alone round differently only where SciPy closes again.
SAME = 1e-9


def trajectory(name, count=SAMPLES, seed=5):
    """A chain, configurations near a closed one, and velocities and accelerations of any kind."""
    case, rng = moving(name, seed), np.random.default_rng(seed)
    chain, nv = case.chain, case.chain.model.nv
    q = np.array([pin.integrate(chain.model, case.q, rng.uniform(-0.05, 0.05, nv)) for _ in range(count)])
    return chain, q, rng.normal(size=(count, nv)), rng.normal(size=(count, nv))


def closed(name, count=SAMPLES):
    chain, q, v, a = trajectory(name, count)
    q = chain.close(q)
    v = chain.project_velocity(q, v)
    return chain, q, v, chain.project_acceleration(q, v, a)


def same(one, other):
    np.testing.assert_allclose(one, other, rtol=0, atol=SAME * max(1e-3, np.abs(np.asarray(other)).max(initial=0.0)))


def every_driver(chain):
    return [str(name) for name in list(chain.model.names)[1:]]


@pytest.mark.full
@pytest.mark.parametrize("name", ALL)
def test_a_trajectory_in_one_call_is_every_sample_alone(name):
    chain, q, v, a = trajectory(name)
    everywhere = np.random.default_rng(1).normal(size=6)
    load = {chain.closures[0].frame_a: np.outer(np.arange(SAMPLES), everywhere)} if loops(chain) else None
    drivers = every_driver(chain)
    found = chain.inverse_dynamics(q, v, a, external=load, actuated=drivers, close=True)
    assert isinstance(found, ClosedForcesStack)
    assert not found.failures
    assert set(found.status) == {"ok"}
    alone = []
    for k in range(SAMPLES):
        here = chain.close(q[k])
        speed = chain.project_velocity(here, v[k])
        rate = chain.project_acceleration(here, speed, a[k])
        same(found.q[k], here)
        same(found.v[k], speed)
        same(found.a[k], rate)
        own = None if load is None else {frame: wrench[k] for frame, wrench in load.items()}
        alone.append(chain.inverse_dynamics(here, speed, rate, external=own, actuated=drivers))
    for kind in ("tau", "multipliers", "effort_is_unique", "undetermined", "friction"):
        same(getattr(found, kind), np.array([getattr(forces, kind) for forces in alone], dtype=float))
    names = [*list(chain.model.names)[1:], *(closure.name for closure in loops(chain))]
    for joint in names:
        for options in ({}, {"at": (0.1, 0.2, 0.3)}, {"in_frame": "local"}):
            stack = found.joint_reaction(joint, **options)
            each = [forces.joint_reaction(joint, **options) for forces in alone]
            same(stack.wrench, [one.wrench for one in each])
            np.testing.assert_array_equal(stack.unique, [one.unique for one in each])
            np.testing.assert_array_equal(np.isinf(stack.interval), [np.isinf(one.interval) for one in each])
            for k, one in enumerate(each):
                # The same directions, in any basis.
                size = one.directions.shape[1]
                same(stack.directions[k][:, :size] @ stack.directions[k][:, :size].T, one.directions @ one.directions.T)
                assert not stack.directions[k][:, size:].any()
    total = found.wrench_on("universe")
    same(total.wrench, [forces.wrench_on("universe").wrench for forces in alone])
    assert total.on == "universe"


def test_a_motion_without_actuators_is_refused_sample_by_sample():
    chain, q, v, a = closed("five-bar", 3)
    one = [chain.roles.actuated[0]]
    found = chain.inverse_dynamics(q, v, a, actuated=one)
    assert found.status.tolist() == ["undriven_motion"] * 3
    assert all(isinstance(error, UndrivenMotion) for error in found.failures.values())


def test_springs_dampers_and_friction_count_in_stacks():
    sprung = delta("rods")
    model = sprung.chain().model
    joints = tuple(
        JointProperties(str(name), stiffness=3.0, unit=None if model.nvs[k] > 1 else "rad")
        for k, name in list(enumerate(model.names))[1:]
    )
    description = sprung.closures
    chain = ClosedChain(
        model, Closures(description.name, closures=description.closures, roles=description.roles, joints=joints)
    )
    chain.model.damping[:] = 0.2
    rng = np.random.default_rng(0)
    q = chain.close(np.array([pin.integrate(model, sprung.q, rng.uniform(-0.05, 0.05, model.nv)) for _ in range(3)]))
    v = chain.project_velocity(q, np.random.default_rng(1).normal(size=(3, model.nv)))
    a = chain.project_acceleration(q, v, v)
    assert (np.array(model.nqs) > np.array(model.nvs)).any()  # a spring that turns about all axes
    same(chain.inverse_dynamics(q, v, a).tau, [chain.inverse_dynamics(*one).tau for one in zip(q, v, a, strict=True)])
    rubbing, q, v, a = closed("five-bar", 3)
    rubbing = with_friction(rubbing, np.full(rubbing.model.nv, 0.3))
    v[1] = 0.0
    a = rubbing.project_acceleration(q, v, a)
    found = rubbing.inverse_dynamics(q, v, a)
    each = [rubbing.inverse_dynamics(*one) for one in zip(q, v, a, strict=True)]
    same(found.tau, [forces.tau for forces in each])
    same(found.friction, [forces.friction for forces in each])


def test_a_rounded_geometry_in_a_stack():
    named = five_bar()
    chain = named.chain().with_tolerance(1e-7)
    q = chain.close(np.repeat([named.q], 2, axis=0))
    found = chain.inverse_dynamics(q)
    assert not found.failures
    same(found.tau, [chain.inverse_dynamics(row).tau for row in q])


def test_progress_is_shown_on_request(capsys):
    chain, q, v, a = closed("five-bar", 3)
    quiet = chain.inverse_dynamics(q, v, a)
    assert not capsys.readouterr().err
    shown = chain.inverse_dynamics(q, v, a, progress=True)
    assert "forces" in capsys.readouterr().err
    np.testing.assert_array_equal(quiet.tau, shown.tau)
