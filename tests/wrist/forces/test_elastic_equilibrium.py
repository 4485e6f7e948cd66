"""The elastic device at the displaced geometry, against maximal coordinates, exact rods and its own limits."""

import numpy as np
import pytest
from exact_rod import RodDevice
from guided_limbs import SOFT_JOINTS, guided
from maximal_elastic import Device
from scipy.spatial.transform import Rotation
from wrists import PERSON, random_mechanism, regular_poses

import exo_pin as ep

SOFT = ep.Interfaces(ep.Interface.of(3e4, 500.0, [0, 0.05, 0]), ep.Interface.upper_arm_cuff(0.2, 4.0))
#: Stiffness of the shoulder, N/m, and EI and GJ of the guides, N m².
RANGE = ((1e4, 30.0, 20.0), (2e4, 60.0, 50.0), (3e4, 100.0, 80.0))


@pytest.fixture(scope="module")
def worn():
    return ep.load("prototype").worn_by(PERSON)


def designs(worn):
    yield worn
    yield ep.ShoulderExo.from_mechanism(random_mechanism(np.random.default_rng(20), 3))
    yield ep.ShoulderExo.from_mechanism(random_mechanism(np.random.default_rng(21), 4))
    kinds = ["UPU", "SPS", "UPU", "UPU", "SPS"]
    yield ep.ShoulderExo.from_mechanism(random_mechanism(np.random.default_rng(22), 5, kinds))


def offsets(rng, count, largest=0.025):
    direction = rng.normal(size=(count, 3))
    return direction * (largest * rng.random(count) / np.linalg.norm(direction, axis=1))[:, None]


def compare(exo, poses, rng, split, load=None, every=False):
    """Compare poses one by one; returns how many were compared, and how many only one of the two solves.

    Poses without an answer are left out of the comparison, unless ``every`` is set: to find none takes long.
    """
    base, cuff = offsets(rng, len(poses)), offsets(rng, len(poses))
    answer = exo.reaction(poses, load=load, split=split, centre_offset=ep.CentreOffset(base, cuff))
    compared = alone = 0
    for k, pose in enumerate(poses):
        if not (every or answer.has_answer[k]):
            continue
        extra = () if load is None else (load.force[k], load.moment[k])
        device = Device(exo, pose, base[k], cuff[k], *extra, locked=split == "elastic_locked")
        z = device.solve()
        if (z is None) or not answer.has_answer[k]:
            alone += (z is None) == bool(answer.has_answer[k])
            continue
        if np.abs(z[:3] - answer.centre_displacement[k]).max() > 1e-5:
            z = device.solve(steps=100)  # its long steps may jump to another branch
        if z is None:
            alone += 1
            continue
        device.residual(z, 1.0)
        force = -device.K @ z[:3]
        scale = max(np.abs(force).max(), np.abs(device.tensions).max())
        np.testing.assert_allclose(answer.shoulder_force[k], force, rtol=0, atol=1e-6 * scale)
        np.testing.assert_allclose(answer.actuator_forces[k], device.tensions, rtol=0, atol=1e-6 * scale)
        np.testing.assert_allclose(answer.centre_displacement[k], z[:3], rtol=0, atol=1e-6 * np.abs(z[:3]).max())
        compared += 1
    return compared, alone


def walk(worn, count, seed, split, every=False):
    """Compare ``count`` poses of every design: in one row of the range each, or in every row if ``every`` is set."""
    rng, compared, alone = np.random.default_rng(seed), 0, 0
    for n, exo in enumerate(designs(worn)):
        for m, (K, EI, GJ) in enumerate(RANGE):
            if not every and m != n % len(RANGE):
                continue
            stiff = guided(exo, SOFT_JOINTS if (n + m) % 4 == 3 else ep.LimbGuide(EI, GJ), K)
            poses = regular_poses(stiff.mechanism, rng, count, margin=0.05)
            load = ep.Load(rng.normal(size=(count, 3)) * 10.0, rng.normal(size=(count, 3)))
            found = compare(stiff, poses, rng, split, load, every)
            compared, alone = compared + found[0], alone + found[1]
    return compared, alone


@pytest.mark.full
def test_equals_maximal_coordinates(worn):
    compared, alone = walk(worn, 1, 30, "elastic")
    assert compared >= 3
    assert alone <= 1


@pytest.mark.full
@pytest.mark.parametrize("split", ["elastic", "elastic_locked"])
def test_soft_interfaces_equal_maximal_coordinates(worn, split):
    exo = guided(worn, ep.LimbGuide(60.0, 50.0), 2e4).replace(interfaces=SOFT)
    rng = np.random.default_rng(34)
    compared, _ = compare(exo, regular_poses(exo.mechanism, rng, 1, margin=0.15), rng, split)
    assert compared == 1


@pytest.mark.full
def test_another_branch_beyond_two_folds_is_no_answer(worn):
    """Long steps would arrive at an equilibrium of 211 N that no path from the unloaded device leads to."""
    exo = guided(worn, ep.LimbGuide(60.0, 50.0), 2e4)
    pose, base, cuff = Rotation.from_rotvec([-0.112, 1.886, -0.046]), [-2e-3, -6.9e-3, 1.5e-3], [0.0179, -9e-4, 0.0131]
    load = ep.Load([-1.6, 9.0, -11.6], [1.03, -0.02, -0.6])
    answer = exo.reaction(pose, load=load, split="elastic_locked", centre_offset=ep.CentreOffset(base, cuff))
    assert answer.status == "no_equilibrium"
    assert 0.36 < answer.load_share < 0.38
    device = Device(exo, pose, base, cuff, load.force, load.moment, locked=True)
    assert device.solve(steps=50) is None


def rod_errors(worn, guide, K, count, size, seed):
    """Relative error of F_s against exact rods, bending of the rods and its error."""
    exo, rng = guided(worn, guide, K), np.random.default_rng(seed)
    found = []
    for pose in regular_poses(exo.mechanism, rng, count, margin=0.15):
        offset = size * rng.normal(size=3) / np.sqrt(3)
        answer = exo.reaction(pose, split="elastic", centre_offset=offset)
        if not answer.has_answer:
            continue
        rods = RodDevice(exo, pose, offset, offset)
        solved = rods.solve(rods.guess(answer))
        if solved is not None:
            error = np.linalg.norm(answer.shoulder_force - solved[0]) / np.linalg.norm(solved[0])
            found.append((error, solved[1].max(), np.abs(answer.guide_bending - solved[1]).max()))
    return np.array(found).T


@pytest.mark.parametrize(
    ("guide", "K", "size"),
    [
        pytest.param((1e4, 50.0), 2e4, 0.015, id="stiff", marks=pytest.mark.full),
        pytest.param((65.0, 50.0), 2e4, 0.015, id="tube"),
        pytest.param((5.0, 4.0), 1e5, 0.03, id="soft", marks=pytest.mark.full),
    ],
)
def test_guides_equal_exact_rods(worn, guide, K, size):
    """The error is of third order, and below 2 % up to a bending of 5 %."""
    finite, bending, wrong = rod_errors(worn, ep.LimbGuide(*guide), K, 3, size, 35)
    assert len(finite) >= 2
    assert bending.max() < 0.05
    assert finite.max() < 2.0 * bending.max() ** 2 + 1e-4
    assert wrong.max() < 0.02 * bending.max()


@pytest.mark.full
@pytest.mark.parametrize("size", [0.005, 0.015, 0.025])
@pytest.mark.parametrize(("K", "EI", "GJ"), RANGE)
def test_tubes_are_exact_rods(worn, size, K, EI, GJ):
    finite, bending, wrong = rod_errors(worn, ep.LimbGuide(EI, GJ), K, 10, size, 36)
    assert len(finite) >= 7
    assert bending.max() < 0.05
    assert finite.max() < 0.02
    assert np.median(finite) < 1e-3
    assert wrong.max() < 0.01 * bending.max()
