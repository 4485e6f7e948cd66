"""What a check of a design says and asks, and when it refuses, of answers that are given."""

from dataclasses import replace
from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import SolverFailed
from exo_pin.workspace import CRITERIA, Criteria
from exo_pin.workspace.optimisation.contact_objective import ContactObjective
from exo_pin.workspace.optimisation.recheck import PERSONS, Recheck, _offsets, _persons, _through_pinocchio
from exo_pin.workspace.pose_offsets import PoseOffsets

NAN = np.nan


def lifting(inside, magnitude, moment):
    return SimpleNamespace(inside=np.array(inside), magnitude=np.array(magnitude), margins={"forces": np.array(moment)})


def some_check(index=0.8, blocked=False, left_out=(), lifts=(True, True), region=(True, False), **changes):
    vital = [name for name, each in CRITERIA.items() if each.is_vital and name not in left_out]

    class Grid(SimpleNamespace):
        def __str__(self):
            return "the grid"

    grid = Grid(
        index=index, margins=dict.fromkeys(vital), blocks_elbow=blocked, region=np.array(region), region_distance=0.5
    )
    lines = [lifting([True, lift], [30.0, NAN], [2.0, -1.0]) for lift in lifts]
    fields = {
        "pinocchio_poses": 78, "pinocchio_difference": 2.5e-9, "persons": {"woman": 0.5}, "offsets": {"up": 0.25},
        "beyond_elbow": {"woman": "limb 1"},
    }  # fmt: skip
    return Recheck(grid, 0.75, 2.0, *lines, **(fields | changes))


def test_which_designs_work():
    assert some_check().works
    assert not some_check(index=0.7999).works
    assert not some_check(blocked=True).works
    for lifts in ((False, True), (True, False)):
        assert not some_check(lifts=lifts).works
    for name, each in CRITERIA.items():
        if each.is_vital:
            assert not some_check(left_out=(name,)).works


def test_words_of_a_check():
    assert str(some_check()).splitlines() == [
        "the grid",
        "",
        "On the grid of 2°: 75.0 %.",
        "Largest connected region on one side of det X = 0: 50.0 % of the poses, the nearest 29° from rest.",
        "Flexion 0 to 90°: 2 of 2 poses inside, shoulder force at most 30 N, least moment margin -1.0 N m.",
        "Abduction 0 to 90°: 2 of 2 poses inside, shoulder force at most 30 N, least moment margin -1.0 N m.",
        "Checked with Pinocchio: 78 poses, |F_s| differs by at most 2.5e-09 N.",
        "woman: 50.0 %; limb 1",
        "up: 25.0 %",
    ]
    bare = str(
        some_check(pinocchio_poses=0, region=(False, False), centre_offset=ep.CentreOffset.together(np.zeros(3)))
    )
    assert bare.startswith("The device's centre is off the shoulder's by (0, 0, 0) mm")
    assert "Pinocchio" not in bare
    assert "region" not in bare
    # Lines without forces, or on which no pose is held, say nothing of them.
    for line in (SimpleNamespace(magnitude=np.array([30.0]), margins={}), lifting([False], [NAN], [-1.0])):
        assert "0 to 90°" not in str(replace(some_check(), flexion=line, abduction=line))


def test_other_persons_and_places_are_asked_about(monkeypatch):
    module, asked = import_module("exo_pin.workspace.optimisation.recheck"), []

    def workspace(_mechanism, step, criteria, load, offset):
        asked.append((step, criteria, load, offset))
        return SimpleNamespace(index=len(asked) / 100.0)

    monkeypatch.setattr(module, "workspace", workspace)
    mechanism = ep.load("four-cables-worn").mechanism
    bent = replace(mechanism.arm.wearer, elbow_flexion=0.7)
    shares = _persons(mechanism, Criteria(wearers=(bent,), least_gap=0.01), None)
    assert shares == {name: (k + 1) / 100.0 for k, name in enumerate(PERSONS)}
    for (step, criteria, load, offset), person in zip(asked, PERSONS.values(), strict=True):
        assert (step, load, offset, criteria.least_gap) == (8.0, None, None, 0.0)
        (wearer,) = criteria.wearers
        assert vars(wearer) == vars(replace(person, elbow_flexion=0.7))
    asked.clear()
    own = ep.CentreOffset.together([0.001, 0.0, 0.0])
    assert len(_offsets(mechanism, Criteria(least_gap=-0.002), own)) == 6
    signs = [(axis, sign) for axis in range(3) for sign in (1.0, -1.0)]
    for (step, criteria, load, offset), (axis, sign) in zip(asked, signs, strict=True):
        assert (step, load, criteria.least_gap) == (8.0, None, -0.002)
        np.testing.assert_allclose(offset.base, [0.001, 0.0, 0.0] + 0.01 * sign * np.eye(3)[axis])
    assert list(_offsets(mechanism, Criteria(), None)) == [
        f"centre {sign}10 mm {way}" for way in ("forward", "to the left", "up") for sign in "+-"
    ]


@pytest.fixture(scope="module")
def cables():
    exo = ep.load("four-cables")
    poses = exo.pose([20.0, 40.0, 60.0, 30.0], [30.0, 40.0, 20.0, 60.0])
    return exo, exo.workspace(poses, ["forces", "stroke"])


@pytest.mark.parametrize(
    ("off", "holds", "error"),
    [
        (0.0, True, None),
        (0.5e-6, True, None),
        (2.5e-6, True, "difference of"),
        (NAN, True, "difference of"),
        (0.0, False, "cannot be held"),
    ],
)
def test_what_pinocchio_does_not_confirm_is_refused(cables, off, holds, error):
    exo, part = cables
    assert part.inside.all()
    largest = float(np.abs(part.tensions).max())
    count = []

    def reaction(poses, **_):
        count.append(len(poses))
        # One pose of four is off.
        sizes = part.magnitude + np.where(np.arange(4) == 2, off * largest, 0.0)
        nothing = np.zeros(len(poses), dtype=bool)
        return SimpleNamespace(
            magnitude=sizes, status=np.full(len(poses), "ok"), can_hold=nothing | holds, unknown=nothing
        )

    arguments = (exo.mechanism, part, [part, part], reaction, Criteria(), 0)
    if error:
        with pytest.raises(SolverFailed, match=error):
            _through_pinocchio(*arguments)
        return
    # The sample is sorted, and of four poses all.
    assert _through_pinocchio(*arguments) == (12, pytest.approx(off * largest, abs=1e-12))
    assert count == [4, 4, 4]


def test_mean_contact_force_takes_the_bare_arm_where_it_is_better_or_nothing_is_found(monkeypatch):
    from exo_pin.workspace.optimisation import contact_objective as module

    fake = SimpleNamespace(
        bare=np.array([100.0, 40.0, 80.0]), poses=None, _matrices=np.zeros((3, 3, 3)), _criteria=Criteria(),
        _offsets=PoseOffsets.none(), _person="wearer",
    )  # fmt: skip
    shoulder = np.array([[30.0, 0.0, 40.0], [0.0, 60.0, 0.0], [NAN] * 3])
    monkeypatch.setattr(module, "PoseValues", lambda *_, **__: SimpleNamespace(shoulder=shoulder))
    assert ContactObjective.surrogate(fake, None) == pytest.approx((50.0 + 40.0 + 80.0) / 3.0)
    monkeypatch.setattr(module, "require_massless", lambda _: None)
    monkeypatch.setattr(module, "limb_lengths", lambda *_: None)
    monkeypatch.setattr(module, "tension_limits", lambda *_: "limits")
    found = SimpleNamespace(magnitude=np.array([70.0, 50.0, NAN]))
    fake._kind = SimpleNamespace(from_mechanism=lambda _: SimpleNamespace(joint_contact=lambda *_, **__: found))
    assert ContactObjective.exact(fake, None) == pytest.approx((70.0 + 50.0 + 80.0) / 3.0)
