"""Every freedom of a device is in balance, or the answer says which is not: random devices against own virtual work."""

import numpy as np
import pytest
from idle_devices import VirtualWork, random_device
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import UndrivenMotion

#: Largest miss of a row that a linear program finds where efforts hold a pose, and where none do; between them rounding
#: decides.
HOLDS, FAILS = 1e-8, 1e-5


def asked(seed, count):
    """A random device, poses, its configurations there, and its answers without limits and within those of drives."""
    device, kind = random_device(seed)
    poses = Rotation.from_rotvec(np.random.default_rng(1000 + seed).uniform(-0.8, 0.8, (count, 3)))
    # Which joints settle by themselves depends on what holds them.
    exo = ep.ShoulderExo.from_chain(device.chain).replace(
        drives=device.drives, brakes=device.brakes, springs=device.springs
    )
    q = exo.configurations(poses)
    free, held = (ep.solve(device, ep.Case(poses), ep.Assumptions(limits=limits)) for limits in ("none", "design"))
    return device, kind, q, free, held


def efforts_of(device, answer, k):
    """Efforts of drives and brakes, and the moment of the wearer."""
    f = answer.actuator_forces[k]
    n = len(device.drives) + len(device.brakes)
    return f[:n], f[n:] if len(f) > n else np.zeros(3)


def assert_balanced(seed, count=2):
    device, kind, q, free, held = asked(seed, count)
    seen = []
    for k in np.flatnonzero(np.isfinite(q).all(axis=1)):
        name, work = f"device {seed} ({kind}), pose {k}", VirtualWork(device, q[k])
        w = work.least_moment()
        seen.append("none" if w is None else "wearer" if np.abs(w).max() > 1e-6 else "device")
        if w is None:
            assert free.equilibrium_status[k] == "no_equilibrium", name
            assert not held.can_hold[k], name
            continue
        assert free.has_answer[k], name
        f, own = efforts_of(device, free, k)
        assert work.residual(f, own) < 1e-8, name
        np.testing.assert_allclose(own, w, atol=1e-6 * max(1.0, np.abs(w).max()), err_msg=name)
        lower, upper = np.array([(effort.lower, effort.upper) for effort in device.efforts]).T.reshape(2, -1)
        miss = work.worst_within(lower, upper)
        assert held.can_hold[k] == (miss < HOLDS) or HOLDS <= miss <= FAILS, name
        if held.can_hold[k]:
            assert work.residual(*efforts_of(device, held, k)) < 1e-8, name
        assert_same_as_the_chain(device, q[k], work, f, name)
    return seen


def assert_same_as_the_chain(device, q, work, f, name):
    """The chain counts the same motions, and its inverse dynamics has the same efforts.

    It has none where the wearer has to add a moment.
    """
    best, joints = work.shortest(), [effort.joint for effort in device.efforts]
    chain, structure = device.chain, device.structure
    left = chain.mobility(q, locked=joints).degrees_of_freedom
    assert left == 3 - structure.moments + structure.idle - structure.held, name
    if best is None:
        with pytest.raises(UndrivenMotion):
            chain.inverse_dynamics(q, actuated=joints)
        return
    np.testing.assert_allclose(f, best, atol=2e-6 * max(1.0, np.abs(best).max()), err_msg=name)
    tau = chain.inverse_dynamics(q, actuated=joints, objective="efforts").tau
    own = np.array([tau[chain.velocity_slice(joint)][0] for joint in joints])
    if not device.brakes and len({device.unit_of(drive) for drive in device.drives}) < 2:
        np.testing.assert_allclose(own, f, atol=1e-6 * max(1.0, np.abs(f).max()), err_msg=name)
    else:
        assert work.residual(own, np.zeros(3)) < 1e-7, name


def test_every_freedom_of_random_devices_is_in_balance():
    seen = [case for seed in range(0, 20, 2) for case in assert_balanced(seed)]
    assert all(seen.count(case) >= 4 for case in ("device", "wearer", "none"))


def test_other_questions_hold_the_same_poses():
    """Least |F_s|, what is missing, and the moment that is held besides, on the rows of all freedoms."""
    short, beside = 0, 0
    for seed in range(0, 28, 2):
        device, kind, q, _, held = asked(seed, 2)
        least = ep.solve(device, ep.Case(held.case.poses), ep.Assumptions("minimal"))
        np.testing.assert_array_equal(least.held, held.held, err_msg=f"device {seed} ({kind})")
        margins = ep.ShoulderExo.from_device(device).workspace(held.case.poses, ["forces"]).margins["forces"]
        missing = held.infeasibility
        for k in np.flatnonzero(held.has_answer):
            work = VirtualWork(device, q[k])
            lower, upper = np.array([(effort.lower, effort.upper) for effort in device.efforts]).T
            if held.held[k]:
                f, own = efforts_of(device, least, k)
                assert work.residual(f, own) < 1e-8
                assert least.magnitude[k] <= held.magnitude[k] + 1e-7
            if held.held[k] and device.holds_alone:
                beside += 1
                assert_margin(work, lower, upper, margins[k])
            elif held.status[k] == "infeasible":
                # With the closest efforts within limits and the missing moment, every row is in balance.
                short += 1
                closest = missing.closest_actuator_forces[k][: len(lower)]
                assert (closest >= lower - 1e-9).all()
                assert (closest <= upper + 1e-9).all()
                assert work.residual(closest, missing.missing_wrench[k, 3:]) < 1e-6
                assert missing.required[k] > missing.available[k]
                assert margins[k] < 1e-9
    assert short > 1
    assert beside > 1


def assert_margin(work, lower, upper, margin):
    """The moment of any direction that is held besides: no direction of many, each a linear program, takes less."""
    found = []
    directions = np.random.default_rng(0).normal(size=(60, 3))
    for direction in directions / np.linalg.norm(directions, axis=1)[:, None]:
        A = np.column_stack([work.efforts, work.turns @ direction])
        cost, bounds = np.append(np.zeros(len(lower)), -1.0), [*zip(lower, upper, strict=True), (0.0, None)]
        answer = linprog(cost, A_eq=A, b_eq=work.load, bounds=bounds, method="highs")
        found.append(answer.x[-1] if answer.status == 0 else np.inf)
    assert margin <= min(found) * (1.0 + 1e-5)
    assert min(found) < 1.5 * margin


@pytest.mark.full
def test_every_freedom_of_many_random_devices_is_in_balance():
    for seed in range(20, 400):
        assert_balanced(seed, 3)
