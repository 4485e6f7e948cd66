"""Every combination of split, offset, limits, cone, limb masses and limbs answers, or is refused for a reason."""

import itertools

import numpy as np
import pytest
from guided_limbs import GUIDE, STIFFNESS
from scipy.spatial.transform import Rotation
from sockets import following
from wrists import random_mechanism, regular_poses

import exo_pin as ep

SPLITS = ("spherical", "minimal", "elastic", "standalone")
TINY = 1e-10  # m: what it strains the guides by makes less than a thousandth of a newton


class Muscle:
    """Pulls up to 900 N, less as it shortens; takes lengths of 5 to 60 cm."""

    def force_limits(self, length):
        reach = (length > 0.05) & (length < 0.6)
        return np.where(reach, 0.0, np.nan), np.where(reach, 300.0 + 1000.0 * length, np.nan)


OFFSETS = {
    "none": None,
    "base": ep.CentreOffset([0.012, -0.008, 0.01], [0.0, 0.0, 0.0]),
    "cuff": ep.CentreOffset([0.0, 0.0, 0.0], [-0.009, 0.011, 0.008]),
    "moving": ep.CentrePath(
        np.radians([0.0, 90.0, 180.0]), np.array([[0, 0, 0], [0, -0.004, 0.012], [0, -0.01, 0.02]])
    ),
}
LIMITS = {"none": "none", "pull": "pull", "range": (-150.0, 700.0), "actuators": Muscle()}
SIDES = {"none": None, "numbers": (-80.0, 60.0), "actuator": "actuator"}
CONES = {
    "none": None,
    "hard": following(muscle_compression=800.0, faces=8),
    "soft": following(muscle_compression=100.0, faces=8, penalty=10.0),
}
MASSES = ("none", "UPU", "mixed")
COUNTS = (3, 4, 5)
CELLS = list(itertools.product(SPLITS, OFFSETS, LIMITS, SIDES, CONES, MASSES, COUNTS))


def build(masses, n):
    """A wrist of n limbs with guides, and a stiff shoulder."""
    kinds = ["UPU"] * n if masses != "mixed" else [("UPU", "SPS")[i % 2] for i in range(n)]
    mechanism = random_mechanism(np.random.default_rng(70 + n), n, kinds)
    half = None if masses == "none" else ep.LimbBody.rod(0.2, 0.12, 0.012)
    limbs = tuple(ep.Limb(kind, half, half, guide=GUIDE) for kind in kinds)
    return ep.ShoulderExo.from_mechanism(mechanism.replace(limbs=limbs, shoulder=ep.Shoulder(stiffness=STIFFNESS)))


@pytest.fixture(scope="module")
def designs():
    """Each design with poses away from its singular surface, and a motion and load of each pose."""
    found = {}
    for masses, n in itertools.product(MASSES, COUNTS):
        exo, rng = build(masses, n), np.random.default_rng(80 + n)
        poses = regular_poses(exo.mechanism, rng, 2, margin=0.05)
        found[masses, n] = exo, poses, ep.Motion(*rng.normal(size=(2, 2, 3))), ep.Load(rng.normal(size=(2, 3)) * 20)
    return found


def refusal(split, limits, sides, cone, masses, n):
    """Why a combination has no meaning; None where it has one."""
    upu = n if masses != "mixed" else (n + 1) // 2
    if sides != "none" and split != "minimal":
        return "belong to"  # nothing else chooses side forces
    if cone != "none" and split == "standalone":
        return "sets to zero"  # no shoulder, no cone
    if split == "standalone" and n + upu < 6:
        return "six components"
    if sides == "actuator" and n > 3 and limits not in ("pull", "actuators"):
        return "either sign"  # |g| <= |f| is not convex
    return None


def ask(designs, cell, **changes):
    split, offset, limits, sides, cone, masses, n = cell
    exo, poses, motion, load = designs[masses, n]
    options = {
        "split": split,
        "centre_offset": OFFSETS[offset],
        "limits": LIMITS[limits],
        "constraint_bounds": SIDES[sides],
        "cone": CONES[cone],
    }
    return exo, poses, exo.reaction(poses, motion, load, **(options | changes))


def check(cell, exo, poses, answer):
    """Balance, limits, and what the split promises, from the answer alone."""
    split, _, limits, sides, cone, _, _ = cell
    good = answer.held
    assert np.isin(
        answer.status, ("ok", "near_singular", "singular", "infeasible", "out_of_stroke", "beyond_limits")
    ).all(), answer.status
    assert (answer.residual[good] < 1e-9).all()
    assert (answer.optimum.kkt[good] <= 1e-8).all()
    f, g, force = answer.actuator_forces[good], answer.constraint_forces[good], answer.shoulder_force[good]
    size = np.maximum(np.abs(answer.limb_wrenches[good]).max(axis=(1, 2)), 1.0)
    assert (answer.optimum.gap[good] <= 1e-8 * size).all()
    slack = 1e-9 * size[:, None]
    if limits != "none":
        low, high = {"range": LIMITS["range"]}.get(limits, (0.0, np.inf))
        # With three limbs f is what balances, checked against the limits to rounding.
        assert (f >= low - slack).all()
        assert (f <= high + slack).all()
    if sides == "numbers":
        assert (g >= SIDES[sides][0] - slack).all()
        assert (g <= SIDES[sides][1] + slack).all()
    if sides == "actuator" and limits in ("pull", "actuators"):
        assert (np.abs(g) <= f + slack).all()
    if cone == "hard":
        N, h = CONES[cone].half_spaces(exo.side, poses)
        assert (np.einsum("kij,kj->ki", N[good], force) <= h + slack).all()
    if split == "spherical":
        assert not g.any()
    if split == "standalone":
        assert (np.abs(force) <= slack).all()
    if split == "elastic":
        delta = answer.centre_displacement[good]
        assert (np.abs(force + delta @ STIFFNESS) <= slack).all()
        upu = exo.mechanism.is_upu
        assert (answer.side_stiffness[good][:, upu] > 0.0).all()


def walk(designs, cells):
    """Try cells; returns how many were held, infeasible and refused."""
    counts = {"held": 0, "infeasible": 0, "refused": 0}
    for cell in cells:
        split, _, limits, sides, cone, masses, n = cell
        reason = refusal(split, limits, sides, cone, masses, n)
        if reason is not None:
            with pytest.raises(ep.InvalidInput, match=reason):
                ask(designs, cell)
            counts["refused"] += 1
            continue
        exo, poses, answer = ask(designs, cell)
        check(cell, exo, poses, answer)
        counts["held"] += int(answer.held.sum())
        counts["infeasible"] += int((answer.has_answer & ~answer.held).sum())
    return counts


@pytest.mark.full
def test_a_part_of_all_combinations(designs):
    """Every 61st: prime to the lengths of all options, so that it meets every value of each."""
    counts = walk(designs, CELLS[::61])
    assert min(counts.values()) >= 4, counts


@pytest.mark.long
def test_a_seventh_of_all_combinations(designs):
    counts = walk(designs, CELLS[::7])
    assert min(counts.values()) >= 40, counts


def near(cells, designs):
    """Compare cells without offset with those a tenth of a nanometre off."""
    compared = 0
    for cell in cells:
        if refusal(cell[0], *cell[2:]) is not None:
            continue
        _, _, a = ask(designs, cell)
        _, _, b = ask(designs, cell, centre_offset=[TINY, -TINY, TINY])
        both = a.held & b.held
        # Side forces without bounds can make any moment with so short a lever arm: infeasible poses may change.
        assert (both | ~a.held).all(), (cell, a.status, b.status)
        size = np.abs(a.limb_wrenches[both]).max(initial=1.0)
        assert np.abs(a.shoulder_force - b.shoulder_force)[both].max(initial=0.0) <= 1e-6 * size, cell
        sure = both & a.optimum.unique & b.optimum.unique
        for name in ("actuator_forces", "constraint_forces"):
            assert np.abs(getattr(a, name) - getattr(b, name))[sure].max(initial=0.0) <= 1e-6 * size, cell
        compared += int(both.sum())
    return compared


def test_hardly_any_offset_changes_nothing_in_a_part(designs):
    assert near([cell for cell in CELLS if cell[1] == "none"][::59], designs) >= 7


@pytest.mark.long
def test_hardly_any_offset_changes_nothing(designs):
    assert near([cell for cell in CELLS if cell[1] == "none"][::5], designs) >= 80


def test_a_split_of_ones_own(designs):
    """A class beside the package's own: side forces that halve the shoulder force of limbs without any."""

    class Half(type(ep.reaction.SPLITS["minimal"])):
        name = "half"
        assumption = "side forces that carry half of the load at the shoulder"

        def choose(self, poses, rows, answer):
            super().choose(poses, rows, answer)
            g = 0.5 * answer.g[rows]
            answer.put_determined(rows, poses.tensions.f[rows], g)

    exo, poses, motion, load = designs["none", 3]
    spherical = exo.reaction(poses, motion, load)
    answer = exo.reaction(poses, motion, load, split=Half())
    assert answer.split == "half"
    np.testing.assert_allclose(answer.shoulder_force, 0.5 * spherical.shoulder_force, rtol=1e-9)
    assert "half of the load" in str(answer.certificate)
    with pytest.raises(ep.InvalidInput, match="spherical"):
        exo.reaction(Rotation.identity(), split="half")
