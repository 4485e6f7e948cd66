"""Forces of many samples at once are those of each alone, and a bad sample spoils no other."""

import pickle

import numpy as np
import pinocchio as pin
import pytest
from closed_motion import loops
from mechanisms import five_bar
from moving_chains import ALL, moving
from rubbing_chains import with_friction
from spatial_mechanisms import delta

from exo_pin import InvalidInput, UndrivenMotion, UnknownName
from exo_pin.chain import PULL, ClosedChain, ClosedForcesStack, Closures, JointProperties
from exo_pin.core.errors import SamplesFailed

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


def test_a_stack_at_rest_and_one_velocity_for_all():
    chain, q, v, _ = closed("delta with rods", 4)
    found = chain.inverse_dynamics(q)
    same(found.tau, [chain.inverse_dynamics(row).tau for row in q])
    assert not found.v.any()
    assert not found.a.any()
    again = np.repeat(q[:1], 3, axis=0)
    a = chain.project_acceleration(q[0], v[0], v[0])
    same(chain.inverse_dynamics(again, v[0], a).tau, np.repeat([chain.inverse_dynamics(q[0], v[0], a).tau], 3, axis=0))
    reaction = chain.joint_reaction(chain.closures[0].name, q, in_frame="local")
    same(reaction.wrench, found.joint_reaction(chain.closures[0].name, in_frame="local").wrench)


def test_projections_of_stacks_are_those_of_each():
    for name in ("five-bar", "Stewart platform", "parallelogram", "coupling loop"):
        chain, q, v, a = trajectory(name, 5)
        q = chain.close(q)
        speeds = chain.project_velocity(q, v)
        same(speeds, [chain.project_velocity(*one) for one in zip(q, v, strict=True)])
        rates = chain.project_acceleration(q, speeds, a)
        same(rates, [chain.project_acceleration(*one) for one in zip(q, speeds, a, strict=True)])
    with pytest.raises(SamplesFailed) as failed:
        chain.project_velocity(np.vstack([q, q[:1] + 0.3]), np.vstack([v, v[:1]]))
    assert list(failed.value.failures) == [5]
    same(failed.value.result[:5], speeds)
    assert np.isnan(failed.value.result[5]).all()
    with pytest.raises(InvalidInput, match=r"expected v to have shape \(5, "):
        chain.project_velocity(q, v[:4])


def test_a_bad_sample_marks_itself_and_spoils_no_other():
    chain, q, v, a = closed("delta with rods", 8)
    good = chain.inverse_dynamics(q, v, a)
    drivers = list(chain.roles.actuated)
    bad_q, bad_v, bad_a = q.copy(), v.copy(), a.copy()
    bad_q[1] = pin.integrate(chain.model, q[1], np.full(chain.model.nv, 0.2))  # open
    bad_v[3] += 0.5  # opens the loops
    bad_q[5, 0] = np.nan
    bad_a[6, 0] = np.inf
    bad_a[2, 0] = 1e15  # no acceleration in SI units
    found = chain.inverse_dynamics(bad_q, bad_v, bad_a)
    expected = [
        "ok",
        "loop_not_closed",
        "invalid_input",
        "invalid_input",
        "ok",
        "invalid_input",
        "invalid_input",
        "ok",
    ]
    assert found.status.tolist() == expected
    assert list(found.failures) == [1, 2, 3, 5, 6]
    fine = [0, 4, 7]
    np.testing.assert_array_equal(found.tau[fine], good.tau[fine])
    reaction, whole = (each.joint_reaction(drivers[0], in_frame="local") for each in (found, good))
    np.testing.assert_array_equal(reaction.wrench[fine], whole.wrench[fine])
    np.testing.assert_array_equal(reaction.unique[fine], whole.unique[fine])
    for k in found.failures:
        assert np.isnan(found.tau[k]).all()
        assert np.isnan(found.multipliers[k]).all()
        assert np.isnan(found.residual[k])
        assert np.isnan(reaction.wrench[k]).all()
        assert not reaction.unique[k].any()
        assert found.undetermined[k] == -1
        assert np.isnan(reaction.interval[k]).all()
    text = str(found)
    assert "8 samples, 3 with an answer" in text
    assert "sample 1: the loops are open" in text
    assert "8 samples" in str(reaction)


def test_a_sample_that_does_not_close_keeps_what_was_given():
    chain, q, v, a = trajectory("five-bar", 4)
    far = q.copy()
    far[2, 0] = np.nan
    found = chain.inverse_dynamics(far, v, a, close=True)
    assert found.status.tolist() == ["ok", "ok", "invalid_input", "ok"]
    whole = chain.inverse_dynamics(q, v, a, close=True)
    np.testing.assert_array_equal(found.tau[[0, 1, 3]], whole.tau[[0, 1, 3]])
    alone = chain.inverse_dynamics(q[0], v[0], a[0], close=True)
    same(alone.tau, whole.tau[0])


def test_a_motion_without_actuators_is_refused_sample_by_sample():
    chain, q, v, a = closed("five-bar", 3)
    one = [chain.roles.actuated[0]]
    found = chain.inverse_dynamics(q, v, a, actuated=one)
    assert found.status.tolist() == ["undriven_motion"] * 3
    assert all(isinstance(error, UndrivenMotion) for error in found.failures.values())


def test_mistakes_of_the_question_are_raised():
    chain, q, v, _ = closed("five-bar", 3)
    with pytest.raises(UnknownName):
        chain.inverse_dynamics(q, metric="links")
    with pytest.raises(UnknownName):
        chain.inverse_dynamics(q, actuated=["nobody"])
    with pytest.raises(UnknownName):
        chain.inverse_dynamics(q, external={"nobody": np.zeros(6)})
    with pytest.raises(UnknownName):
        chain.inverse_dynamics(q, effort_bounds={"nobody": PULL})
    with pytest.raises(InvalidInput, match=r"expected q to have shape \(n, "):
        chain.inverse_dynamics(q[:, :-1])
    with pytest.raises(InvalidInput, match=r"expected v to have shape \(3, "):
        chain.inverse_dynamics(q, v[:2])
    with pytest.raises(UnknownName):
        chain.inverse_dynamics(q).joint_reaction("nobody")


def test_no_samples_are_no_forces():
    chain, q, *_ = closed("five-bar", 3)
    found = chain.inverse_dynamics(q[:0])
    assert len(found) == 0
    assert found.tau.shape == (0, chain.model.nv)
    assert found.joint_reaction(chain.closures[0].name).wrench.shape == (0, 6)


def test_bounds_and_objectives_hold_in_every_sample():
    chain, q, v, a = closed("parallelogram", 3)
    drivers = every_driver(chain)
    problem = {
        "actuated": drivers,
        "effort_bounds": dict.fromkeys(drivers, (-30.0, 30.0)),
        "objective": "efforts",
    }
    found = chain.inverse_dynamics(q, v, a, **problem)
    each = [chain.inverse_dynamics(*one, **problem) for one in zip(q, v, a, strict=True)]
    np.testing.assert_array_equal(found.tau, [forces.tau for forces in each])
    stack = found.joint_reaction(drivers[0])
    np.testing.assert_array_equal(stack.interval, [forces.joint_reaction(drivers[0]).interval for forces in each])
    assert np.isinf(found.joint_reaction(drivers[0], intervals=False).interval).sum() > np.isinf(stack.interval).sum()
    again = pickle.loads(pickle.dumps(found))
    np.testing.assert_array_equal(again.joint_reaction(drivers[0]).wrench, stack.wrench)


def test_springs_dampers_and_friction_count_in_stacks():
    sprung = delta("rods")
    model = sprung.chain().model
    joints = tuple(
        JointProperties(str(name), stiffness=3.0, unit=None if model.nvs[k] > 1 else "rad")
        for k, name in list(enumerate(model.names))[1:]
    )
    description = sprung.closures
    chain = ClosedChain(
        model,
        Closures(description.name, closures=description.closures, roles=description.roles, joints=joints),
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


def test_a_stack_of_a_tree_without_loops():
    rod = '<joint name="hinge" axis="0 1 0"/><inertial mass="2" pos="0 0 -0.5" diaginertia="0.1 0.1 0.1"/>'
    chain = ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{rod}</body></worldbody></mujoco>")
    q, v, a = np.random.default_rng(7).normal(size=(3, 4, 1))
    forces = chain.inverse_dynamics(q, v, a, actuated=["hinge"])
    np.testing.assert_allclose(forces.tau, 2.0 * 9.81 * 0.5 * np.sin(q) + (0.1 + 2.0 * 0.5**2) * a, rtol=1e-12)
    pinocchio = [pin.rnea(chain.model, chain.model.createData(), *each) for each in zip(q, v, a, strict=True)]
    np.testing.assert_allclose(forces.tau, pinocchio, rtol=1e-12)
    assert forces.multipliers.shape == (4, 0)
