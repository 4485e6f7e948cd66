"""Range of |F_s| over the allowed forces, against free-body balances, linear programs and Qhull."""

import numpy as np
import pytest
import scipy
from scipy.spatial import HalfspaceIntersection
from scipy.spatial.transform import Rotation

import exo_pin as ep

ARM = ep.Arm(3.0, [0.02, 0.0, -0.25])


def made(count, rng, kind="SPS", pull_limit=250.0):
    angles = rng.uniform(0.0, 5.0, count)
    geometry = ep.WristGeometry.from_circles(0.2, 0.1, 0.1, 0.15, angles, angles + rng.uniform(-0.8, 0.8, count))
    limb = ep.Limb(kind, actuator=ep.Actuator("cable", pull_limit=pull_limit))
    return ep.ShoulderExo(geometry, ARM, limbs=[limb] * count)


def free_body(exo, pose):
    """Directions of pull on the arm (3, n), their moments about O (3, n), weight and its moment, written anew."""
    on_arm = pose.apply(np.array(exo.geometry.platform_points))
    pull = (exo.geometry.base_points - on_arm) / np.linalg.norm(exo.geometry.base_points - on_arm, axis=1)[:, None]
    weight = 3.0 * np.array([0.0, 0.0, -9.81])
    return pull.T, np.cross(on_arm, pull).T, weight, np.cross(pose.apply(np.array([0.02, 0.0, -0.25])), weight)


def held(count, rng, poses=40):
    exo = made(count, rng)
    found = exo.reaction(Rotation.random(poses, random_state=count))
    return exo, found, np.flatnonzero(found.held)


@pytest.mark.parametrize("count", [4, 5, 6, 8])
def test_range_of_cables_is_that_of_the_polytope_of_tensions(count):
    rng = np.random.default_rng(count)
    exo, found, rows = held(count, rng)
    allowed, checked = found.range(), 0
    assert np.isnan(allowed.greatest[~found.held]).all()
    for row in rows:
        pull, moment, weight, turning = free_body(exo, found.case.poses[int(row)])
        start = np.linalg.lstsq(moment, -turning, rcond=None)[0]
        free = scipy.linalg.null_space(moment)
        d = free.shape[1]
        rows_of_limits = np.vstack([-free, free])
        ends = np.concatenate([start, 250.0 - start])
        # The centre of the largest ball within the polytope; Qhull needs a point inside and two dimensions.
        centre = scipy.optimize.linprog(
            np.append(np.zeros(d), -1.0),
            np.column_stack([rows_of_limits, np.linalg.norm(rows_of_limits, axis=1)]),
            ends,
            bounds=[(None, None)] * d + [(0.0, None)],
        ).x
        if centre[-1] < 1e-3:
            continue
        if d == 1:
            low = (-start / free[:, 0])[free[:, 0] > 0].max(initial=-np.inf)
            vertices = [[y] for y in (*(-start / free[:, 0]), *((250.0 - start) / free[:, 0]))]
            vertices = [v for v in vertices if (rows_of_limits @ v <= ends + 1e-7).all()]
            assert np.isfinite(low) or len(vertices) == 2
        else:
            vertices = HalfspaceIntersection(np.column_stack([rows_of_limits, -ends]), centre[:-1]).intersections
        forces = -(weight + pull @ start)[:, None] - pull @ free @ np.transpose(vertices)
        greatest = np.linalg.norm(forces, axis=0).max()
        assert allowed.greatest[row] == pytest.approx(greatest, rel=1e-8)
        assert allowed.found[row] == allowed.greatest[row]
        # Least by another solver.
        best = scipy.optimize.minimize(
            lambda y, F=-(weight + pull @ start), E=-pull @ free: float(np.sum((F + E @ y) ** 2)),
            centre[:-1],
            jac=lambda y, F=-(weight + pull @ start), E=-pull @ free: 2.0 * E.T @ (F + E @ y),
            constraints=[scipy.optimize.LinearConstraint(rows_of_limits, -np.inf, ends)],
            method="SLSQP",
            options={"ftol": 1e-14, "maxiter": 300},
        )
        assert allowed.least[row] == pytest.approx(np.sqrt(best.fun), rel=1e-4, abs=1e-3)
        assert allowed.least[row] <= found.magnitude[row] * (1.0 + 1e-12)
        checked += 1
    assert checked >= 3


def test_many_side_forces_are_bounded_from_both_sides():
    rng = np.random.default_rng(3)
    exo = made(7, rng, "UPU")
    found = exo.reaction(Rotation.random(30, random_state=4), split="minimal", constraint_bounds=20.0)
    row = int(np.flatnonzero(found.held)[0])
    one = exo.reaction(found.case.poses[row], split="minimal", constraint_bounds=20.0)
    allowed = one.range()
    assert allowed.found < allowed.greatest < 1.2 * allowed.found
    assert "at most" in str(allowed)
    state = one.source.poses.state.row(0)
    M, S = np.hstack([state.moment_of_f, state.moment_of_g]), np.hstack([state.shoulder_of_f, state.shoulder_of_g])
    bounds = [(0.0, 250.0)] * 7 + [(-20.0, 20.0)] * 7
    largest = 0.0
    for axis in rng.normal(size=(100, 3)):
        z = scipy.optimize.linprog(-axis @ S, A_eq=M, b_eq=state.moment, bounds=bounds).x
        largest = max(largest, float(np.linalg.norm(state.shoulder + S @ z)))
    assert 0.97 * allowed.found <= largest <= allowed.greatest
