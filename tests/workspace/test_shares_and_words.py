"""Shares, medians, words and regions of a workspace whose margins are given."""

from types import MappingProxyType

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import InvalidInput, UnknownName
from exo_pin.workspace import CRITERIA, Criteria, Workspace

NAN = np.nan
NO_LIMIT = "no limit given"
ANN, BOB = ep.Wearer(1.63, 67.0, "female", elbow_flexion=1.0), ep.Wearer(1.84, 90.4, "male")


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


FOUR = {"stroke": [0.01, -0.02, 0.0, -0.03], "singularity": [0.1, 0.2, -0.1, -0.2], "forces": [1.0, 2.0, 3.0, NAN]}


def test_shares_of_four_poses():
    found = some_workspace(FOUR, force=[30.0, 90.0, 5.0, NAN])
    assert found.inside.tolist() == [True, False, False, False]
    assert found.index == 0.25
    assert found.fractions == {"stroke": 0.5, "singularity": 0.5, "forces": 0.75}
    # The fourth pose fails by three, so that none of them alone costs it.
    assert found.lost_to == {"stroke": 0.25, "singularity": 0.25, "forces": 0.0}
    assert found.median_margins == pytest.approx({"stroke": -0.01, "singularity": 0.0, "forces": 2.0})
    assert found.reasons.tolist() == ["", "stroke", "singularity", "stroke, singularity, forces"]
    assert found.force_inside == {"mean": 30.0, "largest": 30.0}
    assert found.volume_share is None
    table = found.one_by_one(["singularity", "stroke"])
    assert table["alone"].tolist() == [0.5, 0.5]
    assert table["together"].tolist() == [0.5, 0.25]
    assert table["cost"].tolist() == [0.5, 0.25]
    with pytest.raises(UnknownName):
        found.one_by_one(["clearance"])
    summary = found.summary()
    assert (summary["poses"], summary["index"], summary["unknown"]) == (4, 0.25, 0.0)
    assert summary["volume_share"] is summary["volume_share_error"] is None
    with pytest.raises(ValueError, match="read-only"):
        found.margins["stroke"][0] = 1.0


def test_poses_whose_forces_are_not_known_are_unknown_where_all_else_is_met():
    margins = {
        "stroke": [0.1, -0.1, 0.1, 0.1, 0.1],
        "forces": [NAN, NAN, NAN, 1.0, -1.0],
        "shoulder_force": [NAN, NAN, NAN, 1.0, NAN],
    }
    margin = np.array([1.0, 1.0, 1e-12, 1.0, 1.0])
    found = some_workspace(margins, margin=margin)
    assert found.unknown.tolist() == [True, False, False, False, False]
    assert "20.0 % more depend on force limits that are not known." in str(found)
    without = some_workspace({"stroke": [0.1, -0.1]})
    assert not without.unknown.any()
    assert "not known" not in str(without)
    assert without.force_inside == {}
    assert "Shoulder force" not in str(without)
    assert np.isnan(some_workspace({"forces": [NAN, NAN]}).median_margins["forces"])


def test_words_of_a_workspace():
    given = {"clearance": f"{NO_LIMIT} x", "socket": f"{NO_LIMIT} (largest_pull_out)", "connected": "not chosen"}
    found = some_workspace(
        FOUR,
        force=[30.0, 90.0, 5.0, NAN],
        not_checked=MappingProxyType(given),
        wearers=(ANN, BOB),
        centre_offset=ep.CentreOffset(np.array([0.0, 0.003, 0.004]), np.array([0.0, 0.0, 0.012])),
    )
    lines = str(found).splitlines()
    assert lines[0] == "mine: 25.0 % of 4 poses are inside; not checked: clearance, connected."
    assert lines[1] == (
        "Worn by a person of 1.63 m and 67 kg (female) and by a person of 1.84 m and 90 kg (male), elbow at 0° and 57°."
    )
    assert lines[2].endswith("in these poses by at most 5 mm at the base and 12 mm at the cuff.")
    assert lines[3] == "Shoulder force inside: mean 30 N, largest 30 N (tensions chosen for the least)."
    assert lines[4] == ""
    assert lines[5].split() == ["criterion", "met", "only", "this", "median", "margin"]
    assert lines[6].split() == ["stroke", "50.0", "%", "25.0", "%", "-0.01", "m"]
    assert lines[7].split()[:5] == ["singularity", "50.0", "%", "25.0", "%"]
    assert lines[8].split() == ["forces", "75.0", "%", "0.0", "%", "2", "N", "m"]
    # All columns end at the same place.
    assert len({line.index(" %") for line in lines[6:9]}) == 1
    assert len(lines[5]) == 55
    assert lines[9] == "connected: not checked, not chosen"
    assert lines[10] == "Without a limit: clearance (), socket (largest_pull_out)."
    bent = some_workspace(FOUR, wearers=(BOB,), criteria=Criteria(elbow_range=(0.0, np.pi / 2)))
    assert "(male), while the elbow bends from 0 to 90°." in str(bent)
    assert str(some_workspace(FOUR)).splitlines()[1] == ""
    assert some_workspace(FOUR).largest_offsets == {}


@pytest.mark.parametrize(
    ("why", "blocks"),
    [(None, False), ("not chosen", False), (f"{NO_LIMIT} (x)", False), ("joints lie beyond it", True)],
)
def test_a_cuff_beyond_the_elbow_is_said(why, blocks):
    found = some_workspace(FOUR, not_checked=MappingProxyType({} if why is None else {"elbow": why}))
    assert found.blocks_elbow == blocks
    assert ("not checked: elbow" in str(found).splitlines()[0]) == blocks


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
    assert found.nearest_to_rest == np.unravel_index(angles.argmin(), shape)


def test_a_region_needs_a_grid_and_a_pose():
    with pytest.raises(InvalidInput, match="grid of three angles"):
        _ = some_workspace(FOUR).region
    none = some_workspace({"stroke": -np.ones((2, 2, 2))})
    assert not none.region.any()
    assert np.isnan(none.region_distance)


def test_criteria_are_told_apart():
    for criterion in CRITERIA.values():
        assert criterion.most in (1.0, 2.0)
        assert criterion.aim >= 0.0
    vital = {name for name, criterion in CRITERIA.items() if criterion.is_vital}
    assert vital == {"stroke", "singularity", "connected", "forces", "shoulder_force", "clearance"}


@pytest.mark.parametrize("name", ["wide", "a_criterion_of_a_name_that_is_long"])
def test_columns_stand_below_each_other_whatever_the_names(name, monkeypatch):
    monkeypatch.setitem(CRITERIA, name, CRITERIA["stroke"])
    lines = str(some_workspace({name: [0.1, -0.2, 0.3], "singularity": [0.2, 0.3, -0.1]})).splitlines()
    head = next(line for line in lines if line.startswith("criterion"))
    rows = [line for line in lines if line.startswith((f"{name} ", "singularity "))]
    assert len(rows) == 2
    # Two places after the longest name, 16 at least.
    assert len(head) == max(16, len(name) + 2) + 39
    for row in rows:
        assert row.index(" %") == head.index("met") + 1
        assert row.split()[1:3] == ["66.7", "%"]
