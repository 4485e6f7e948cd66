"""The linear elastic split within limits, against active sets tried one by one in f, g and δ together."""

import itertools

import numpy as np
import pytest
from guided_limbs import GUIDE, STIFFNESS, guided, unit_side_wrench
from sockets import following
from wrists import random_mechanism, regular_poses

import exo_pin as ep

#: Loads, limits and offsets so much smaller displace little: what is left is linear in them, to this error.
FEATHER, LEFT = 1e-5, 2e-5


def enumerated(exo, pose, offset, low, high, cone=None):
    """Least self-stress of f with all springs' equations as equalities, by trying every active set; None if none fits.

    Variables are f, g and δ; nothing is eliminated, and nothing is shared but the geometry of the side wrenches.
    """
    n = exo.mechanism.limb_count
    sides = [unit_side_wrench(exo.geometry, pose.as_matrix(), offset, i, GUIDE) for i in range(n)]
    s, arms, S, M = (np.array(vectors).T for vectors in list(zip(*sides, strict=True))[:4])
    k = np.array([side[4] for side in sides])
    misfit = (pose.as_matrix() @ offset.cuff - offset.base) @ S / FEATHER
    weight = exo.arm.mass * exo.mechanism.gravity
    moment = np.cross(pose.as_matrix() @ exo.arm.centre_of_mass, weight)
    unit = 1e-3  # m: δ in mm, so that all unknowns are of like size
    A = np.zeros((6 + n, 2 * n + 3))
    b = np.concatenate([moment, weight, k * misfit])
    A[:3, :n], A[:3, n : 2 * n] = arms, M
    A[3:6, :n], A[3:6, n : 2 * n], A[3:6, 2 * n :] = s, S, STIFFNESS * unit
    A[6:, n : 2 * n], A[6:, 2 * n :] = np.eye(n), -k[:, None] * S.T * unit
    N = np.linalg.svd(arms)[2][3:]
    E = np.hstack([N, np.zeros((n - 3, n + 3))])
    C, c = np.zeros((0, 2 * n + 3)), np.zeros(0)
    if cone is not None:
        normals, c = cone.half_spaces(exo.side, pose)
        C = np.hstack([np.zeros((len(c), 2 * n)), -normals @ STIFFNESS * unit])
    best, found = np.inf, None
    faces = [rows for size in range(2 if cone is None else 3) for rows in itertools.combinations(range(len(c)), size)]
    for pattern in itertools.product((-1, 0, 1), repeat=n):
        pattern = np.array(pattern)
        fixed = np.flatnonzero(pattern)
        if len(fixed) > n - 3:
            continue
        value = np.where(pattern < 0, low, high)[fixed]
        if not np.isfinite(value).all():
            continue
        for rows in faces:
            if len(fixed) + len(rows) > n - 3:
                continue
            held = np.vstack([A, np.eye(2 * n + 3)[fixed], C[list(rows)]])
            right = np.concatenate([b, value, c[list(rows)]])
            K = np.block([[E.T @ E, held.T], [held, np.zeros((len(held), len(held)))]])
            z = np.linalg.lstsq(K, np.concatenate([np.zeros(2 * n + 3), right]), rcond=1e-14)[0][: 2 * n + 3]
            size = max(np.abs(z[: 2 * n]).max(), 1.0)
            inside = (z[:n] >= low - 1e-8 * size).all() and (z[:n] <= high + 1e-8 * size).all()
            if inside and np.abs(A @ z - b).max() < 1e-7 * size and (C @ z <= c + 1e-8 * size).all():
                cost = float(np.linalg.norm(E @ z))
                if cost < best:
                    best, found = cost, z
    return found


@pytest.mark.parametrize("limits", [(0.0, np.inf), (-40.0, 60.0)], ids=["pull", "range"])
@pytest.mark.parametrize(
    ("n", "with_cone"),
    [
        (3, False),
        *(pytest.param(*case, marks=pytest.mark.full) for case in ((4, False), (5, False), (3, True), (4, True))),
        pytest.param(5, True, marks=pytest.mark.long),
    ],
)
def test_equals_enumeration(n, limits, with_cone):
    exo = guided(ep.ShoulderExo.from_mechanism(random_mechanism(np.random.default_rng(90 + n), n)))
    light = exo.replace(gravity=FEATHER * exo.mechanism.gravity)
    low, high = (np.full(n, value) for value in limits)
    cones = [following(muscle_compression=400.0 * size, faces=6) if with_cone else None for size in (1.0, FEATHER)]
    base, cuff = np.array([0.002, -0.001, 0.002]), np.array([-0.001, 0.002, 0.001])
    offset = ep.CentreOffset(FEATHER * base, FEATHER * cuff)
    poses = regular_poses(exo.mechanism, np.random.default_rng(91), 25, margin=0.03)
    small = tuple(FEATHER * np.array(limits))
    answer = light.reaction(poses, split="elastic", centre_offset=offset, limits=small, cone=cones[1])
    without = light.reaction(poses, split="elastic", centre_offset=offset)
    seen = {"held": 0, "infeasible": 0, "at a limit": 0}
    for k, pose in enumerate(poses):
        if not answer.has_answer[k]:
            continue
        expected = enumerated(exo, pose, offset, low, high, cones[0])
        assert (expected is None) == (not answer.held[k]), (k, answer.status[k])
        if expected is None:
            seen["infeasible"] += 1
            continue
        seen["held"] += 1
        scale = np.abs(expected[: 2 * n]).max()
        f, g = answer.actuator_forces[k] / FEATHER, answer.constraint_forces[k] / FEATHER
        np.testing.assert_allclose(f, expected[:n], atol=LEFT * scale)
        np.testing.assert_allclose(g, expected[n : 2 * n], atol=LEFT * scale)
        delta = 1e-3 * expected[2 * n :]
        np.testing.assert_allclose(answer.centre_displacement[k] / FEATHER, delta, atol=LEFT * np.abs(delta).max())
        seen["at a limit"] += bool(np.abs(f - without.actuator_forces[k] / FEATHER).max() > LEFT * scale)
    assert seen["infeasible"] >= 1, seen
    assert seen["held"] >= 1, seen
    assert n == 3 or seen["at a limit"] >= 1, seen
