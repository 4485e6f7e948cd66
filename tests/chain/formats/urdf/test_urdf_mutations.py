"""Two thousand changed URDFs: each is the same robot, the robot that another reader reads, or a typed error."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import five_bar
from urdf_mutations import REFUSED, SAME, damaged, mutated, seeded
from urdf_oracle import Tree, coordinates, reordering
from urdf_trees import random_tree

from exo_pin import ExoPinError, FileFormatError
from exo_pin.chain import ClosedChain, Closures

CASES, PARTS = 2000, 40
BARE = Closures("bare")
PICTURE = """<visual><origin xyz="0 0 0.1" rpy="0 0 0"/><geometry><sphere radius="0.1"/></geometry>
  <material name="red"><color rgba="1 0 0 1"/></material></visual></link>"""
BASES = [
    random_tree(seed, 5).replace("</link>", PICTURE, 1) for seed in range(4)
] + [five_bar().urdf, (Path(__file__).parents[4] / "urdf" / "prototype-wrist.urdf").read_text()]  # fmt: skip


def chain_of(file, folder):
    """Text is read as text, bytes from a file."""
    if isinstance(file, str):
        return ClosedChain.from_urdf(file, BARE)
    path = folder / "robot.urdf"
    path.write_bytes(file)
    return ClosedChain.from_urdf(path, BARE)


def compare(chain, tree):
    """Joints, places, masses, gravity, limits, damping and friction are the tree's."""
    model = chain.model
    assert sorted(list(model.names)[1:]) == sorted(tree.moving)
    order, rng = reordering(model, tree), np.random.default_rng(1)
    q = pin.integrate(model, pin.neutral(model), rng.normal(size=model.nv))
    named, rest = coordinates(model, q), np.zeros(tree.width)
    states = tree.motion(named, tree.rates(rest), tree.rates(rest))
    size = 1.0 + max(np.abs(state[1]).max() for state in states.values())
    places = chain.placements(q)
    for link, state in states.items():
        np.testing.assert_allclose(places[link].rotation, state[0], atol=1e-12)
        np.testing.assert_allclose(places[link].translation, state[1], atol=1e-12 * size)
    M = pin.crba(model, model.createData(), q)
    M = (np.triu(M) + np.triu(M, 1).T)[np.ix_(order, order)]
    theirs = tree.mass_matrix(named)
    np.testing.assert_allclose(M, theirs, rtol=1e-9, atol=1e-11 * max(1e-300, np.abs(theirs).max(initial=0.0)))
    gravity = pin.computeGeneralizedGravity(model, model.createData(), q)[order]
    owed = tree.forces(named, rest, rest)
    weight = 10.0 * size * sum(link.mass for link in tree.links.values())
    np.testing.assert_allclose(gravity, owed, rtol=1e-9, atol=1e-12 * weight)
    for name in tree.moving:
        part, joint = chain.velocity_slice(name), tree.joints[name]
        if joint.kind in ("floating", "planar"):
            continue  # a file with such values is refused
        for array, values, key, default in (
            (model.damping, joint.dynamics, "damping", 0.0),
            (model.upperDryFrictionLimit, joint.dynamics, "friction", 0.0),
            (model.upperEffortLimit, joint.limit, "effort", np.inf),
            (model.upperVelocityLimit, joint.limit, "velocity", np.inf),
        ):
            told = values.get(key, default)
            # The largest number stands for none.
            np.testing.assert_array_equal(array[part], told if told < np.finfo(float).max else np.inf)
        if joint.kind != "continuous":
            span = chain.configuration_slice(name)
            np.testing.assert_array_equal(model.lowerPositionLimit[span], joint.limit.get("lower", 0.0))
            np.testing.assert_array_equal(model.upperPositionLimit[span], joint.limit.get("upper", 0.0))


def check(case, folder):
    """Whether the changed file was read or refused, after holding it against what is owed."""
    rng = seeded(case)
    base = BASES[case % len(BASES)]
    file, owed, change, plain = mutated(rng, base)
    chain, refusal = None, None
    try:
        chain = chain_of(file, folder)
    except ExoPinError as error:
        refusal = error
    if owed == SAME:
        assert refusal is None, f"{change}: {refusal}"
    if owed == REFUSED:
        assert isinstance(refusal, FileFormatError), f"{change} was read"
        assert str(refusal)
    if chain is not None:
        compare(chain, Tree(base if owed == SAME else plain))
    return refusal is None


@pytest.mark.parametrize(
    "part", [0, *(pytest.param(k, marks=pytest.mark.full if k < 12 else pytest.mark.long) for k in range(1, PARTS))]
)
def test_a_changed_urdf_is_read_as_it_is_or_refused(part, tmp_path):
    were_read = sum(check(case, tmp_path) for case in range(part, CASES, PARTS))
    assert 0.2 < were_read / (CASES / PARTS) < 0.6


@pytest.mark.parametrize("part", [0, *[pytest.param(part, marks=pytest.mark.full) for part in range(1, 10)]])
def test_a_damaged_file_is_an_error_or_the_same(part, tmp_path):
    refused = 0
    for case in range(part, 400, 10):
        base = BASES[case % 5]
        file = damaged(seeded([7, case]), base)
        try:
            chain = chain_of(file, tmp_path)
        except FileFormatError:
            refused += 1
            continue
        # A byte changed in a comment or a name.
        assert len(file) >= len(base)
        assert chain.model.njoints == ClosedChain.from_urdf(base, BARE).model.njoints
    assert refused >= 30
