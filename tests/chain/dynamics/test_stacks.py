"""Forces of many samples at once are those of each alone, and a bad sample spoils no other."""

import numpy as np
import pinocchio as pin
import pytest
from moving_chains import ALL, moving
from rubbing_chains import slide, with_friction
from spatial_mechanisms import delta

from exo_pin import InvalidInput, LoopNotClosed, UndrivenMotion, UnknownName
from exo_pin.chain import ClosedChain, ClosedForcesStack, Closures, JointProperties
from exo_pin.core import errors

small = pytest.mark.usefixtures("plain")
SMALL = ("four-bar", "five-bar", "parallelogram")


def moved(name, count=3, seed=0):
    """Closed configurations of a chain near one, motions of them, and its joints."""
    case, rng = moving(name, seed), np.random.default_rng(seed)
    chain, nv = case.chain, case.chain.model.nv
    q = chain.close(np.array([pin.integrate(chain.model, case.q, rng.uniform(-0.1, 0.1, nv)) for _ in range(count)]))
    v = chain.project_velocity(q, rng.normal(size=(count, nv)))
    a = chain.project_acceleration(q, v, rng.normal(size=(count, nv)))
    return chain, q, v, a, [str(name) for name in list(chain.model.names)[1:]]


def near(one, other):
    """To a billionth of the largest: a stack and a sample alone round differently only where SciPy closes again."""
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-9 * max(1e-3, np.abs(np.asarray(other)).max(initial=0.0)))


def same(stack, each):
    assert isinstance(stack, ClosedForcesStack)
    assert set(stack.status) == {"ok"}
    for kind in ("tau", "multipliers", "friction", "effort_is_unique", "undetermined"):
        near(np.array(getattr(stack, kind), dtype=float), np.array([getattr(one, kind) for one in each], dtype=float))


@small
@pytest.mark.parametrize("name", SMALL)
@pytest.mark.parametrize("metric", ["reactions", "closures"])
def test_small_stacks_are_each_sample_alone(name, metric):
    check(name, metric)


@pytest.mark.full
@pytest.mark.parametrize("name", ALL)
def test_stacks_are_each_sample_alone(name):
    check(name, "reactions")


def check(name, metric):
    chain, q, v, a, joints = moved(name)
    loops = [closure for closure in chain.closures if closure.polynomial is None]
    load = {closure.frame_a: np.outer([1.0, -2.0, 0.5], np.arange(1.0, 7.0)) for closure in loops[:1]}
    options = {"actuated": joints, "metric": metric}
    each = [
        chain.inverse_dynamics(*one, external={name: w[k] for name, w in load.items()}, **options)
        for k, one in enumerate(zip(q, v, a, strict=True))
    ]
    stack = chain.inverse_dynamics(q, v, a, external=load, **options)
    same(stack, each)
    assert len(stack) == 3
    assert stack.undetermined.tolist() == [each[0].undetermined] * 3
    assert "3 samples, 3 with an answer" in str(stack)
    for joint in (joints[0], joints[-1], *(closure.name for closure in loops[:1])):
        for frame in ("world", "local"):
            found = stack.joint_reaction(joint, in_frame=frame)
            alone = [forces.joint_reaction(joint, in_frame=frame) for forces in each]
            near(found.wrench, [one.wrench for one in alone])
            np.testing.assert_array_equal(found.unique, [one.unique for one in alone])
            ranges = [one.interval for one in alone]
            np.testing.assert_array_equal(np.isinf(found.interval), np.isinf(ranges))
            for k, one in enumerate(alone):
                size = one.directions.shape[1]
                directions = found.directions[k][:, :size]
                near(directions @ directions.T, one.directions @ one.directions.T)
                assert not found.directions[k][:, size:].any()
    body = str(chain.model.frames[chain.model.nframes - 1].name)
    near(stack.wrench_on(body).wrench, [forces.wrench_on(body).wrench for forces in each])
    np.testing.assert_array_equal(stack.effort(joints[1]), stack.tau[:, chain.velocity_slice(joints[1])])


@small
@pytest.mark.parametrize(("v", "a"), [(True, True), (True, False), (False, True), (False, False)])
def test_what_is_left_out_is_zero_and_one_row_serves_all(v, a):
    chain, q, speeds, _, joints = moved("four-bar")
    q = np.repeat(q[:1], 2, axis=0)
    given = {"v": speeds[0]} if v else {}
    if a or v:
        given["a"] = chain.project_acceleration(q[0], speeds[0] if v else np.zeros(3), np.ones(3))
    if v and not a:
        # A velocity alone needs loops that keep it closed without an acceleration.
        chain, q, given = slide_chain()
        joints = ["slide"]
    alone = chain.inverse_dynamics(q[0], actuated=joints, **given)
    same(chain.inverse_dynamics(q, actuated=joints, **given), [alone, alone])


def slide_chain():
    return slide(0.4), np.array([[0.2], [0.2]]), {"v": np.array([0.3])}


@small
@pytest.mark.parametrize("name", SMALL)
def test_projections_of_stacks_are_those_of_each_and_least(name):
    chain, q, _, _, _ = moved(name)
    rng, nv = np.random.default_rng(1), chain.model.nv
    v, a = rng.normal(size=(2, 3, nv))
    speeds = chain.project_velocity(q, v)
    np.testing.assert_allclose(speeds, [chain.project_velocity(*one) for one in zip(q, v, strict=True)], atol=1e-12)
    rates = chain.project_acceleration(q, speeds, a)
    each = [chain.project_acceleration(*one) for one in zip(q, speeds, a, strict=True)]
    np.testing.assert_allclose(rates, each, atol=1e-12)
    for k in range(3):
        # By least squares: what is left off is in the row space.
        J = chain.constraint_jacobian(q[k])
        np.testing.assert_allclose(speeds[k], v[k] - np.linalg.pinv(J, rcond=1e-10) @ (J @ v[k]), atol=1e-9)
        drift = chain.constraint_drift(q[k], speeds[k])
        np.testing.assert_allclose(rates[k], a[k] - np.linalg.pinv(J, rcond=1e-10) @ (J @ a[k] + drift), atol=1e-9)
    wrong = q.copy()
    wrong[1] += 0.1
    with pytest.raises(errors.SamplesFailed) as failed:
        chain.project_velocity(wrong, v)
    assert list(failed.value.failures) == [1]
    assert isinstance(failed.value.failures[1], LoopNotClosed)
    assert np.isnan(failed.value.result[1]).all()
    np.testing.assert_array_equal(failed.value.result[[0, 2]], speeds[[0, 2]])
    with pytest.raises(errors.SamplesFailed) as failed:
        chain.project_acceleration(wrong, speeds, a)
    np.testing.assert_array_equal(failed.value.result[[0, 2]], rates[[0, 2]])


@small
def test_projections_of_a_stack_have_a_row_for_each_sample():
    chain, q, v, a, _ = moved("five-bar")
    for name, ask in (
        ("v", lambda: chain.project_velocity(q, v[:, :2])),
        ("a", lambda: chain.project_acceleration(q, v, a[:2])),
    ):
        with pytest.raises(InvalidInput, match=f"expected {name} to have shape"):
            ask()


@small
def test_closing_and_projecting_a_stack_is_doing_so_with_each():
    chain, q, v, a, joints = moved("five-bar")
    rng = np.random.default_rng(2)
    off = q + rng.uniform(-0.02, 0.02, q.shape)
    for speeds, rates in ((v + 0.1, a + 0.1), (None, a + 0.1), (v + 0.1, None), (None, None)):
        stack = chain.inverse_dynamics(off, speeds, rates, actuated=joints, close=True)
        each = [
            chain.inverse_dynamics(
                off[k],
                None if speeds is None else speeds[k],
                None if rates is None else rates[k],
                actuated=joints,
                close=True,
            )
            for k in range(3)
        ]
        same(stack, each)
        np.testing.assert_allclose(stack.q, chain.close(off), atol=1e-12)
        if speeds is None and rates is None:
            assert not stack.v.any()
            assert not stack.a.any()


@small
@pytest.mark.parametrize("size", [0.1, 3.0, 1e4])
@pytest.mark.parametrize(("share", "opens"), [(0.9, False), (1.2, True)])
def test_motions_open_the_loops_by_no_more_than_a_millionth_of_their_size(size, share, opens):
    """Of the velocity, or of the acceleration and the square of the velocity; alone and in stacks."""
    chain, q, v, a, joints = moved("five-bar", 1)
    state, still = chain._state, np.zeros(4)
    J = chain.constraint_jacobian(q[0])
    out = np.linalg.pinv(J, rcond=1e-10) @ np.array([0.6, -0.8, 0.0])
    out /= np.abs(state.topology.row_scale * (J @ out)).max()  # opens the loops by one, scaled

    def largest(x):
        return np.abs(x / state.topology.column).max()

    speed, rate = size / largest(v[0]) * v[0], size / largest(a[0]) * chain.project_acceleration(q[0], still, a[0])
    moving = chain.project_acceleration(q[0], speed, still)
    for given in (
        (speed + share * 1e-6 * size * out, still),
        (still, rate + share * 1e-6 * largest(rate) * out),
        (speed, moving + share * 1e-6 * (largest(moving) + size**2) * out),
    ):
        if given[0] is not still and given[1] is still:
            given = (given[0], chain.project_acceleration(q[0], *given))
        stack = chain.inverse_dynamics(np.tile(q[0], (2, 1)), *(np.tile(x, (2, 1)) for x in given), actuated=joints)
        assert (stack.status != "ok").all() == opens
        if opens:
            with pytest.raises(InvalidInput, match="opens the loops"):
                chain.inverse_dynamics(q[0], *given, actuated=joints)
        else:
            np.testing.assert_array_equal(chain.inverse_dynamics(q[0], *given, actuated=joints).tau, stack.tau[0])


@small
def test_bad_samples_are_marked_and_spoil_no_other():
    chain, q, v, a, joints = moved("four-bar", 3)
    q, v, a = (np.repeat(part[:1], 6, axis=0) for part in (q, v, a))
    q[1], q[2], v[3], a[4] = q[1] + 0.3, np.nan, np.inf, np.nan
    load = np.zeros((6, 6))
    load[5] = np.nan
    body = chain.closures[0].frame_a
    stack = chain.inverse_dynamics(q, v, a, external={body: load}, actuated=joints)
    good = chain.inverse_dynamics(q[0], v[0], a[0], actuated=joints)
    assert stack.status[:2].tolist() == ["ok", "loop_not_closed"]
    assert (stack.status[2:] != "ok").all()
    assert list(stack.failures) == [1, 2, 3, 4, 5]
    assert isinstance(stack.failures[1], LoopNotClosed)
    np.testing.assert_allclose(stack.tau[0], good.tau, atol=1e-12)
    for kind in ("tau", "multipliers", "friction", "residual"):
        assert np.isnan(getattr(stack, kind)[1:]).all()
    assert stack.undetermined.tolist() == [good.undetermined] + 5 * [-1]
    assert not stack.effort_is_unique[1:].any()
    reaction = stack.joint_reaction(joints[0])
    assert not reaction.unique[1:].any()
    assert np.isnan(reaction.interval[1:]).all()
    assert np.isfinite(reaction.wrench[0]).all()
    text = str(stack)
    assert "6 samples, 1 with an answer" in text
    assert text.endswith("...")
    assert [text.count(f"sample {k}:") for k in range(6)] == [0, 1, 1, 1, 0, 0]
    # With closing, what does not close stays as it is and is named; the others are closed.
    closed = chain.inverse_dynamics(q[:3], v[:3], a[:3], actuated=joints, close=True)
    assert closed.status.tolist()[:1] + closed.status.tolist()[2:] == ["ok", stack.status[2]]
    assert np.isnan(closed.q[2]).all()


@small
def test_questions_that_no_sample_can_answer_are_raised():
    chain, q, v, a, joints = moved("four-bar")
    for wrong in (q[:, :-1], q[None], q[:, :, None]):
        if wrong.ndim == 2:
            with pytest.raises(InvalidInput, match=r"q to have shape \(n, 3\)"):
                chain.inverse_dynamics(wrong, actuated=joints)
    with pytest.raises(InvalidInput, match=r"v to have shape \(3, 3\)"):
        chain.inverse_dynamics(q, v[:2], a, actuated=joints)
    with pytest.raises(InvalidInput, match="a to have shape"):
        chain.inverse_dynamics(q, v, a[:, :2], actuated=joints)
    with pytest.raises(UnknownName, match="elbow"):
        chain.inverse_dynamics(q, actuated=joints, external={"elbow": np.zeros(6)})
    with pytest.raises(UnknownName, match="least"):
        chain.inverse_dynamics(q, actuated=joints, metric="least")
    empty = chain.inverse_dynamics(q[:0], actuated=joints)
    assert (len(empty), empty.tau.shape, empty.joint_reaction(joints[0]).wrench.shape) == (0, (0, 3), (0, 6))


@small
def test_friction_springs_bounds_and_slips_go_one_by_one_or_count_in_stacks():
    rubbing = with_friction(slide(0.3), [1.0])
    q, v = np.zeros((2, 1)), np.array([[0.5], [-0.5]])
    found = rubbing.inverse_dynamics(q, v, actuated=["slide"])
    np.testing.assert_array_equal(found.friction, [[-1.0], [1.0]])
    weight = 2.0 * 9.81 * np.sin(0.3)
    np.testing.assert_allclose(found.tau, [[weight + 1.0], [weight - 1.0]])
    free = slide(0.3)
    np.testing.assert_allclose(free.inverse_dynamics(q, actuated=["slide"]).tau, weight)
    damped = free.model.copy()
    damped.damping = np.array([4.0])
    damped = ClosedChain(damped, free.description)
    np.testing.assert_allclose(damped.inverse_dynamics(q, v, actuated=["slide"]).tau, [[weight + 2.0], [weight - 2.0]])
    # A bound narrows what a stack says of a redundant loop.
    chain, q, v, a, joints = moved("four-bar", 2)
    tight = {joints[0]: (-0.25, 0.25)}
    found = chain.inverse_dynamics(q, v, a, actuated=joints, effort_bounds=tight)
    each = [chain.inverse_dynamics(*one, actuated=joints, effort_bounds=tight) for one in zip(q, v, a, strict=True)]
    np.testing.assert_allclose(found.tau, [forces.tau for forces in each], atol=1e-9)
    # Names that can be gone through once alone are kept for all samples.
    once = chain.inverse_dynamics(q, v, a, actuated=iter(joints), effort_bounds=tight)
    np.testing.assert_array_equal(once.tau, found.tau)
    ranges = [forces.joint_reaction(joints[0]).interval for forces in each]
    np.testing.assert_allclose(found.joint_reaction(joints[0]).interval, ranges, atol=1e-7)
    np.testing.assert_allclose(
        found.wrench_on("universe").interval, [forces.wrench_on("universe").interval for forces in each], atol=1e-7
    )
    without = found.joint_reaction(joints[0], intervals=False).interval
    for forces in each:
        reaction = forces.joint_reaction(joints[0], intervals=False)
        assert np.isinf(reaction.interval[~reaction.unique]).all()
    assert np.isinf(without[~found.joint_reaction(joints[0]).unique]).all()


@small
def test_a_chain_without_roles_has_stacks_of_trees():
    model = pin.Model()
    model.addJoint(0, pin.JointModelRY(), pin.SE3.Identity(), "hinge")
    model.appendBodyToJoint(1, pin.Inertia(2.0, np.array([0.0, 0.0, -0.5]), 0.1 * np.eye(3)), pin.SE3.Identity())
    model.addFrame(pin.Frame("rod", 1, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    chain = ClosedChain(model, Closures("rod"))
    q = np.array([[0.0], [0.5], [np.pi / 2]])
    found = chain.inverse_dynamics(q, actuated=["hinge"])
    np.testing.assert_allclose(found.tau[:, 0], 2.0 * 9.81 * 0.5 * np.sin(q[:, 0]), atol=1e-12)
    assert found.undetermined.tolist() == [0, 0, 0]
    push = {"rod": np.array([[3.0, 0, 0, 0, 0, 0], [0, 0, 3.0, 0, 0, 0], [0, 0, 0, 0, 3.0, 0]])}
    pushed = chain.inverse_dynamics(q, actuated=["hinge"], external=push)
    # At the joint's own origin only the moment counts.
    np.testing.assert_allclose(pushed.tau - found.tau, [[0.0], [0.0], [-3.0]], atol=1e-12)


@small
def test_a_motion_without_actuators_is_refused_sample_by_sample():
    chain, q, v, a, _ = moved("five-bar")
    one = [chain.roles.actuated[0]]
    found = chain.inverse_dynamics(q, v, a, actuated=one)
    assert found.status.tolist() == ["undriven_motion"] * 3
    assert all(isinstance(error, UndrivenMotion) for error in found.failures.values())


@small
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
    near(chain.inverse_dynamics(q, v, a).tau, [chain.inverse_dynamics(*one).tau for one in zip(q, v, a, strict=True)])
    rubbing, q, v, a, _ = moved("five-bar")
    rubbing = with_friction(rubbing, np.full(rubbing.model.nv, 0.3))
    v[1] = 0.0
    a = rubbing.project_acceleration(q, v, a)
    found = rubbing.inverse_dynamics(q, v, a)
    each = [rubbing.inverse_dynamics(*one) for one in zip(q, v, a, strict=True)]
    near(found.tau, [forces.tau for forces in each])
    near(found.friction, [forces.friction for forces in each])


@small
def test_a_rounded_geometry_in_a_stack():
    chain, q, *_ = moved("five-bar")
    chain = chain.with_tolerance(1e-7)
    found = chain.inverse_dynamics(q)
    assert not found.failures
    near(found.tau, [chain.inverse_dynamics(row).tau for row in q])


@small
def test_progress_is_shown_on_request(capsys):
    chain, q, v, a, _ = moved("five-bar")
    quiet = chain.inverse_dynamics(q, v, a)
    assert not capsys.readouterr().err
    shown = chain.inverse_dynamics(q, v, a, progress=True)
    assert "forces" in capsys.readouterr().err
    np.testing.assert_array_equal(quiet.tau, shown.tau)
