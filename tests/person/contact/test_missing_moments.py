"""Least contact forces, and the moments that a pose misses, against SciPy."""

from dataclasses import replace

import numpy as np
import pytest
import scipy

pytest.importorskip("clarabel", reason="needs the extra person: pip install '.[person]'")

from muscle_poses import some_pose

from exo_pin.person.contact.activation import least_effort, least_missing


@pytest.mark.parametrize("seed", range(2))
def test_least_contact_is_that_of_another_solver(seed):
    pose = some_pose(seed, limbs=3, rim=False)
    pose = replace(pose, least="contact", rest=pose.rest + np.array([2e3, 300.0, -200.0]))
    chosen = least_effort(pose)
    unit = np.where(np.arange(15) < 12, 1.0, 100.0)
    start = np.clip(chosen.z, pose.low, pose.high) / unit
    found = scipy.optimize.minimize(
        lambda x: float(((pose.pull * unit @ x + pose.rest) ** 2).sum()) / 1e6,
        start,
        jac=lambda x: 2e-6 * (pose.pull * unit).T @ (pose.pull * unit @ x + pose.rest),
        bounds=list(zip(pose.low / unit, pose.high / unit, strict=True)),
        constraints={"type": "eq", "fun": lambda x: (pose.rows * unit @ x + pose.constant) / 10.0},
        method="SLSQP",
        options={"ftol": 1e-15, "maxiter": 400},
    )
    size = np.linalg.norm(pose.pull @ chosen.z + pose.rest)
    assert chosen.is_optimal
    assert size <= 1e3 * np.sqrt(found.fun) * (1.0 + 1e-7)
    np.testing.assert_allclose(pose.rows @ chosen.z + pose.constant, 0.0, atol=1e-5)


def needed(pose):
    """The least moment from outside, by non-negative least squares, of a pose without a socket."""
    A, b = pose.rows, -pose.constant
    low, high = pose.low, pose.high
    if pose.stopped:
        # The stop's own moment, which extends no further, is one more variable.
        A, low, high = np.column_stack([A, np.eye(5)[3]]), np.append(low, 0.0), np.append(high, np.inf)
    found = scipy.optimize.lsq_linear(A, b, (low, high), tol=1e-14)
    return b - A @ found.x


@pytest.mark.parametrize("stopped", [True, False])
def test_missing_moments_are_the_least_ones_of_every_axis(stopped):
    extending = 0
    for seed in range(8):
        pose = some_pose(seed, rim=False, stopped=stopped, limbs=2 * (seed % 2))
        weak = replace(pose, high=np.concatenate([np.full(12, 0.05), pose.high[12:]]))
        missing, proved = least_missing(weak, in_socket=False)
        assert proved
        np.testing.assert_allclose(missing, needed(weak), atol=1e-5)
        extending += abs(missing[3]) < 1e-6
    assert stopped == (extending > 0)


def test_missing_moment_in_the_socket_holds_the_force_inside():
    """No moment would do where no activation brings the force into the socket; else it is found by SciPy, too."""
    pose = some_pose(3)
    out = replace(pose, rest=np.array([-1e5, 0.0, 0.0]))
    missing, proved = least_missing(out, in_socket=True)
    assert proved
    assert np.isnan(missing).all()
    assert np.isfinite(least_missing(out, in_socket=False)[0]).all()
    shear = replace(pose, rest=pose.rest + np.array([0.0, 1200.0, 400.0]))
    missing, proved = least_missing(shear, in_socket=True)
    free, _ = least_missing(shear, in_socket=False)
    assert proved
    assert np.linalg.norm(missing) > np.linalg.norm(free) + 1e-3

    def inside(a):
        v = shear.socket @ (shear.pull @ a + shear.rest) / 500.0
        return v[0] - np.hypot(v[1], v[2])

    best = scipy.optimize.minimize(
        lambda a: float(((shear.rows @ a + shear.constant) ** 2).sum()) / 100.0,
        np.full(12, 0.5),
        jac=lambda a: 0.02 * shear.rows.T @ (shear.rows @ a + shear.constant),
        bounds=[(0.0, 1.0)] * 12,
        constraints={"type": "ineq", "fun": inside},
        method="SLSQP",
        options={"ftol": 1e-15, "maxiter": 400},
    )
    assert np.linalg.norm(missing) == pytest.approx(10.0 * np.sqrt(best.fun), rel=1e-5)
