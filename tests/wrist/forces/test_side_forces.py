"""The side force g_i is the force across the limb, with and without a centre offset, against limbs as free bodies."""

import numpy as np
import pytest
from guided_limbs import guided
from limb_bodies import FreeBodies
from wrists import PERSON, random_mechanism, regular_poses

import exo_pin as ep


def device(name, side):
    if name == "prototype":
        return ep.load("prototype", side=side).worn_by(PERSON)
    exo = ep.ShoulderExo.from_mechanism(random_mechanism(np.random.default_rng(int(name)), 3))
    return exo if side == "left" else exo.mirrored()


def offsets(rng, count):
    """Of base and cuff, up to 30 mm each."""
    return ep.CentreOffset(*(rng.uniform(-0.03, 0.03, (2, count, 3)) / np.sqrt(3)))


@pytest.mark.filterwarnings("ignore::exo_pin.OutsideHumanRange")
@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize(
    "name", ["prototype", "60", *(pytest.param(str(k), marks=pytest.mark.full) for k in range(61, 71))]
)
def test_side_force_and_its_bound_are_those_of_free_bodies(name, side):
    exo, rng = device(name, side), np.random.default_rng(62)
    poses = regular_poses(exo.mechanism, rng, 30, margin=0.03)
    offset = offsets(rng, len(poses))
    given = exo.reaction(poses, split="minimal", constraint_bounds=20.0, centre_offset=offset, limits="none")
    by_f = exo.reaction(poses, split="minimal", constraint_bounds="actuator", centre_offset=offset, limits="none")
    bare = exo.reaction(poses, centre_offset=offset, limits="none")
    least = 1.0
    for k, R in enumerate(poses.as_matrix()):
        bodies = FreeBodies(exo.mechanism, R, offset.base[k], offset.cuff[k])
        for answer, bound in ((given, np.full(3, 20.0)), (by_f, np.abs(bare.actuator_forces[k]))):
            f, g = answer.actuator_forces[k], answer.constraint_forces[k]
            scale = max(np.abs(f).max(), np.abs(g).max(), np.linalg.norm(bodies.load[:3]))
            tensions, shoulder = bodies.solve(g)
            np.testing.assert_allclose(f, tensions, atol=1e-9 * scale)
            np.testing.assert_allclose(answer.shoulder_force[k], shoulder, atol=1e-9 * scale)
            on_arm = bodies.pull * f + bodies.side * g
            np.testing.assert_allclose(answer.limb_wrenches[k], on_arm.T, atol=1e-9 * scale)
            assert (np.abs(g) <= bound * (1 + 1e-12)).all()
            assert answer.magnitude[k] == pytest.approx(bodies.least(bound), abs=1e-8 * scale)
        misaligned = np.abs(np.einsum("ij,ij->j", bodies.side[:3], normals(exo, R, offset, k)))
        least = min(least, misaligned.min())
    # The part of a side force along the middle of the two cross axes is less than the force.
    assert least < 0.998


def normals(exo, R, offset, k):
    """Middles of the two cross axes of each limb, shape (3, n)."""
    A, B = exo.geometry.base_points, exo.geometry.platform_points @ R.T
    span = B + R @ offset.cuff[k] - A - offset.base[k]
    X = [np.cross(y, span) / np.linalg.norm(np.cross(y, span), axis=1)[:, None] for y in (A, B)]
    return ((X[0] + X[1]) / np.linalg.norm(X[0] + X[1], axis=1)[:, None]).T


@pytest.mark.filterwarnings("ignore::exo_pin.OutsideHumanRange")
@pytest.mark.parametrize(
    ("split", "side"),
    [
        ("minimal", "left"),
        ("standalone", "right"),
        ("elastic", "left"),
        ("elastic_locked", "right"),
        *(pytest.param(*case, marks=pytest.mark.full) for case in (("elastic", "right"), ("elastic_locked", "left"))),
    ],
)
def test_a_limb_carries_f_along_and_g_across(split, side):
    exo, rng = guided(device("prototype", side)), np.random.default_rng(63)
    poses = regular_poses(exo.mechanism, rng, 25, margin=0.05)
    shift = 1.0 if split in ("minimal", "standalone", "elastic") else 0.3
    offset = offsets(rng, len(poses))
    offset = ep.CentreOffset(shift * offset.base, shift * offset.cuff)
    answer = exo.reaction(poses, split=split, centre_offset=offset, limits="none")
    held = answer.has_answer
    assert held.mean() > 0.8
    f, g = answer.actuator_forces[held], answer.constraint_forces[held]
    size = np.linalg.norm(answer.limb_wrenches[held][..., :3], axis=-1)
    np.testing.assert_allclose(np.hypot(f, g), size, rtol=1e-9)
    assert np.abs(g).max() > 10.0
