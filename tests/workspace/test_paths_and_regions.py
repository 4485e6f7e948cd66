"""Ways from rest over a grid and largest regions, by floods."""

from types import MappingProxyType

import numpy as np
import pytest
from scipy import ndimage
from scipy.spatial.transform import Rotation

from exo_pin.workspace import CRITERIA, Criteria, Workspace
from exo_pin.workspace.kernels import (
    widest_path,
)
from exo_pin.workspace.optimisation.recheck import Recheck

pytestmark = pytest.mark.usefixtures("plain")

FACES = ndimage.generate_binary_structure(3, 1)


def by_floods(value, start):
    """The greatest level at which each node is in one piece with the start."""
    found = np.full(value.shape, -np.inf)
    for level in np.unique(value[np.isfinite(value)]):
        labels, _ = ndimage.label(value >= level, FACES)
        if labels[start]:
            found[labels == labels[start]] = level
    return found


@pytest.mark.parametrize("shape", [(2, 3, 4), (1, 5, 3), (4, 1, 6), (3, 4, 1), (1, 1, 7)])
def test_widest_paths_go_through_faces_and_not_around_the_edges(shape):
    rng = np.random.default_rng(sum(shape))
    value = rng.integers(0, 6, shape).astype(float) + 1e-3 * rng.random(shape)
    value[tuple(rng.integers(0, side) for side in shape)] = -np.inf
    for _ in range(4):
        start = tuple(int(rng.integers(0, side)) for side in shape)
        if not np.isfinite(value[start]):
            continue
        flat, out = value.ravel(), np.full(value.size, np.nan)
        widest_path(flat, np.argsort(-flat), shape, int(np.ravel_multi_index(start, shape)), out)
        np.testing.assert_array_equal(out.reshape(shape), by_floods(value, start))


NAN = np.nan


def some_workspace(margins, poses=None, force=None, **changes):
    """Of margins by criterion; forces along z, determinants 1 and limbs of 0.3 m unless they are given."""
    margins = {name: np.array(values, dtype=float) for name, values in margins.items()}
    shape = next(iter(margins.values())).shape
    turns = Rotation.from_rotvec(np.linspace(0.2, 1.0, int(np.prod(shape)))[:, None] * [0.0, 1.0, 0.0]).as_quat()
    fields = {
        "name": "mine",
        "side": "left",
        "poses": Rotation.from_quat(turns.reshape(*shape, 4)) if poses is None else poses,
        "criteria": Criteria(),
        "margins": MappingProxyType(margins),
        "not_checked": MappingProxyType({}),
        "lengths": np.full((*shape, 4), 0.3),
        "margin": np.ones(shape),
        "tensions": np.full((*shape, 4), 10.0),
        "shoulder_force": np.stack(
            [np.zeros(shape)] * 2 + [np.full(shape, NAN) if force is None else np.array(force)], -1
        ),
        "gaps": np.full((*shape, 3), 0.1),
    }
    return Workspace(**(fields | changes))


def grown(inside, sign):
    """The largest set of neighbours, by growing each from one of its poses."""
    left, best = {tuple(node) for node in np.argwhere(inside & (sign != 0.0))}, set()
    while left:
        part, edge = set(), [left.pop()]
        while edge:
            node = edge.pop()
            part.add(node)
            for axis in range(3):
                for step in (-1, 1):
                    other = tuple(np.array(node) + step * (np.arange(3) == axis))
                    if other in left and sign[other] * sign[node] > 0.0:
                        left.remove(other)
                        edge.append(other)
        best = part if len(part) > len(best) else best
    return best


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("limbs", [3, 4])
def test_region_is_the_largest_set_of_neighbours(seed, limbs):
    rng = np.random.default_rng(seed)
    shape = (4, 3, 5)
    inside, sign = rng.uniform(size=shape) < 0.7, rng.choice([-1.0, 1.0], shape) if limbs == 3 else np.ones(shape)
    poses = Rotation.from_rotvec(rng.normal(0.0, 0.5, (*shape, 3)))
    found = some_workspace(
        {"stroke": np.where(inside, 1.0, -1.0)}, poses=poses, margin=sign, lengths=np.ones((*shape, limbs))
    )
    expected = grown(inside, sign)
    # Of two that are as large either will do.
    assert found.region.sum() == len(expected)
    part = {tuple(node) for node in np.argwhere(found.region)}
    assert len(grown(found.region, sign)) == len(part)
    assert inside[found.region].all()
    angles = poses.magnitude()
    assert found.region_distance == angles[found.region].min()


def works(share=0.8, flexion=3, abduction=3, without="", **not_checked):
    """Of ten poses, and so many of three on the way to 90°; with all vital criteria but one."""
    inside = np.arange(10) < round(10 * share)
    vital = [name for name, each in CRITERIA.items() if each.is_vital and name != without]
    full = some_workspace(
        {name: np.where(inside, 1.0, -1.0) for name in vital}, not_checked=MappingProxyType(not_checked)
    )
    lifts = [some_workspace({"stroke": np.where(np.arange(3) < count, 1.0, -1.0)}) for count in (flexion, abduction)]
    return Recheck(full, 0.9, 2.0, *lifts, 0, NAN, {}, {}, {}).works


def test_a_design_works_that_lifts_both_ways_on_four_fifths_by_all_vital_criteria():
    assert works()
    assert works(0.9)
    assert not works(0.7)
    assert not works(flexion=2)
    assert not works(abduction=2)
    for name in ("stroke", "singularity", "connected", "forces", "shoulder_force", "clearance"):
        assert not works(without=name)
    # A cuff that leaves the elbow free was not asked, or was not checked because of where its joints are.
    assert works(elbow="no limit given (least_above_elbow)")
    assert works(elbow="not chosen")
    assert not works(elbow="joints beyond the elbow")
