"""Inverse kinematics by weighted tasks: closed forms, SciPy, limits, what is reported and refused."""

import numpy as np
import pinocchio as pin
import pytest
from closed_chains import CHAINS, off
from posture_programs import least_by_scipy, weighted_error
from spatial_mechanisms import stewart

from exo_pin import BeyondLimits, InvalidInput, UnknownName
from exo_pin.chain import ComTask, FrameTask, PostureTask

ALL = ("five_bar", "four_bar_link", "3rrr", "delta", "delta-universal", "stewart", "loop-rigid", "loop-spherical")
ALL += ("loop-revolute", "loop-universal", "wrist-whole")


def cases(name, seed=1):
    """A target that the chain reaches, one that it does not with a posture beside it, and a centre of mass."""
    chain, q = CHAINS[name]
    q, rng = chain.close(q), np.random.default_rng(seed)
    frame = "platform" if name in ("delta", "stewart") else chain.roles.arm or chain.closures[0].frame_a
    place, size = chain.placement(q, frame), chain.characteristic_length
    near = chain.placement(chain.close(off(chain, q, rng, 0.2), respect_limits=True), frame)
    far = place * pin.exp6(rng.normal(size=6) * np.repeat([size, 0.5], 3))
    return (
        chain,
        q,
        {
            "reached": [("frame", frame, near, np.ones(6))],
            "far": [
                ("frame", frame, far, np.repeat([1.0, 0.1], 3)),
                ("posture", None, q, np.full(chain.model.nv, 0.01)),
            ],
            "com": [("com", None, 2.0 * size * rng.normal(size=3), np.array([1.0, 2.0, 3.0]))],
        },
    )


def given(tasks):
    make = {
        "frame": lambda what, target, c: FrameTask(what, target, c[:3], c[3:]),
        "com": lambda what, target, c: ComTask(target, c),
        "posture": lambda what, target, c: PostureTask(target, c[0]),
    }
    return [make[kind](*rest) for kind, *rest in tasks]


def compare(name, case, starts, restarts):
    """The weighted error is no larger than SciPy's least, and that of Pinocchio's placements."""
    chain, q, tasks = cases(name)
    answer = chain.inverse_kinematics(given(tasks[case]), q, restarts=restarts)
    error = weighted_error(chain.model, tasks[case], answer.q)
    assert answer.error == pytest.approx(np.linalg.norm(error), abs=1e-12)
    np.testing.assert_allclose(
        np.concatenate(answer.errors) * np.concatenate([t[3] for t in tasks[case]]), error, atol=1e-12
    )
    assert np.abs(chain.residual(answer.q)).max() <= 1e-12
    assert not chain.beyond_limits(answer.q)
    assert answer.kkt <= 1e-8
    assert answer.cautions == ()
    assert answer.reached == (case == "reached")
    least = least_by_scipy(chain, lambda at: 0.5 * np.sum(weighted_error(chain.model, tasks[case], at) ** 2), q, starts)
    assert np.isfinite(least)
    assert answer.error <= np.sqrt(2.0 * least) + 1e-7


@pytest.mark.full
@pytest.mark.parametrize("case", ["reached", "far", "com"])
@pytest.mark.parametrize("name", ["five_bar", "delta", "loop-spherical", "delta-universal"])
def test_the_error_is_no_larger_than_scipys(name, case):
    compare(name, case, 2, 0 if case == "reached" else 4)


@pytest.mark.parametrize("most", [pytest.param(20, marks=pytest.mark.full), pytest.param(60, marks=pytest.mark.long)])
@pytest.mark.parametrize("case", ["reached", "far", "com"])
@pytest.mark.parametrize("name", ALL)
def test_the_error_is_no_larger_than_scipys_from_many_starts(name, case, most):
    # SciPy takes seconds a start with the two largest.
    starts = 6 if most == 20 and name in ("stewart", "wrist-whole") else most
    compare(name, case, 3 if name in ("stewart", "wrist-whole") else 8, starts)


def test_a_target_out_of_reach_gives_the_nearest_point_of_a_circle():
    chain, q = CHAINS["four_bar"]
    tip, pivot = "coupler", chain.placement(q, "crank").translation
    place = chain.placement(q, tip).translation
    radius = np.linalg.norm((place - pivot)[:2])
    target = pivot + (place - pivot) * 3.0
    answer = chain.inverse_kinematics(FrameTask(tip, pin.SE3(np.eye(3), target), orientation_cost=0.0), q)
    found = chain.placement(answer.q, tip).translation
    np.testing.assert_allclose(found, pivot + (target - pivot) * radius / np.linalg.norm(target - pivot), atol=1e-9)
    assert answer.error == pytest.approx(2.0 * radius)
    assert "restarts=" in str(answer)


def test_costs_of_components_are_along_the_targets_axes():
    named = stewart()
    chain = named.chain()
    target = chain.placement(named.q, "platform") * pin.exp6(np.array([0.03, 0.01, 0.02, 0.1, 0.2, -0.1]))
    # The origin on the target's z axis, that axis along the platform's own: two freedoms are left.
    task = FrameTask("platform", target, position_cost=(1.0, 1.0, 0.0), orientation_cost=(1.0, 1.0, 0.0))
    answer = chain.inverse_kinematics(task, named.q)
    place = chain.placement(answer.q, "platform")
    np.testing.assert_allclose(place.rotation[:, 2], target.rotation[:, 2], atol=1e-9)
    np.testing.assert_allclose(target.actInv(place).translation[:2], 0.0, atol=1e-9)
    assert np.linalg.norm(answer.errors[0]) > 1e-3
    assert answer.reached
    assert answer.idle


def test_held_joints_do_not_move_and_limits_are_kept():
    named = stewart()
    chain = named.chain()
    place = chain.placement(named.q, "platform")
    target = place * pin.exp6(np.array([0.01, 0.0, 0.02, 0.0, 0.0, 0.2]))
    point = FrameTask("platform", target, orientation_cost=0.0)
    slide = chain.configuration_slice("slide_0")
    answer = chain.inverse_kinematics(point, named.q, hold=["slide_0"])
    np.testing.assert_array_equal(answer.q[slide], named.q[slide])
    assert answer.reached
    assert not chain.inverse_kinematics(FrameTask("platform", target), named.q, hold="slide_0").reached
    above = pin.SE3(place.rotation, place.translation + np.array([0.0, 0.0, 5.0]))
    high = FrameTask("platform", above, orientation_cost=0.0)
    stopped = chain.inverse_kinematics(high, named.q)
    assert stopped.at_limits == tuple(f"slide_{k}" for k in range(6))
    assert stopped.kkt <= 1e-8
    assert not chain.beyond_limits(stopped.q)
    beyond = chain.inverse_kinematics(high, named.q, respect_limits=False)
    assert beyond.error < stopped.error
    with pytest.raises(BeyondLimits):
        chain.inverse_kinematics(point, beyond.q, hold=[f"slide_{k}" for k in range(6)])


def test_a_posture_may_be_given_by_joints():
    chain, q = CHAINS["five_bar"]
    wanted = {"left_crank_hinge": q[0] + 0.1, "right_crank_hinge": [q[2] - 0.1]}
    answer = chain.inverse_kinematics(PostureTask(wanted, cost=2.0), q)
    there = [answer.q[chain.configuration_slice(name)][0] for name in wanted]
    np.testing.assert_allclose(there, [q[0] + 0.1, q[2] - 0.1], atol=1e-9)
    assert answer.reached


def test_bad_tasks_are_refused():
    chain, q = CHAINS["five_bar"]
    for call, error, match in (
        (lambda: chain.inverse_kinematics("tip", pin.SE3.Identity(), q), InvalidInput, "FrameTask"),
        (lambda: chain.inverse_kinematics([], q), InvalidInput, "tasks"),
        (lambda: chain.inverse_kinematics(FrameTask("top", pin.SE3.Identity()), q), UnknownName, "top"),
        (lambda: chain.inverse_kinematics(PostureTask({"crank": 0.0}), q), UnknownName, "crank"),
        (lambda: chain.inverse_kinematics(PostureTask(q, cost=0.0), q), InvalidInput, "zero"),
        (lambda: chain.inverse_kinematics(PostureTask(q), q, restarts=-1), InvalidInput, "restarts"),
        (lambda: chain.inverse_kinematics(PostureTask(q), q, tolerance=0.0), InvalidInput, "tolerance"),
        (lambda: FrameTask("tip", np.eye(4)), InvalidInput, "SE3"),
        (lambda: FrameTask("tip", pin.SE3(np.eye(3), np.full(3, np.nan))), InvalidInput, "finite"),
        (lambda: FrameTask("tip", pin.SE3.Identity(), position_cost=-1.0), InvalidInput, "zero or more"),
        (lambda: FrameTask("tip", pin.SE3.Identity(), orientation_cost=(1.0, 2.0)), InvalidInput, "shape"),
        (lambda: ComTask([0.0, 0.0]), InvalidInput, "shape"),
    ):
        with pytest.raises(error, match=match):
            call()
