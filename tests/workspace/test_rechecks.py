"""A check of a design: two grids, two lines, other persons and places, and what Pinocchio confirms."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import SolverFailed
from exo_pin.workspace import Criteria, optimisation, recheck

LIMITS = Criteria(names=("stroke", "connected", "forces"), least_tension=5.0)
OWN = ep.CentreOffset.together([0.0, 0.003, 0.0])


def asked_of(exo, change=lambda answer: {}):
    """The design's reaction, whose answers are changed, and the questions that it gets."""
    questions = []

    def reaction(poses, **options):
        answer = exo.reaction(poses, **options)
        questions.append((poses, options, answer))
        names = ("magnitude", "status", "can_hold", "unknown")
        return SimpleNamespace(**({name: getattr(answer, name) for name in names} | change(answer)))

    return reaction, questions


def lines_of(exo):
    """Lifting forward and sideways from 0 to 90° in steps of 5°."""
    angles = np.linspace(0.0, 90.0, 19)
    return exo.pose(flexion=angles), exo.pose(abduction=angles)


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_design_is_checked_on_two_grids_and_two_lines(side):
    exo = ep.load("four-cables", side=side)
    reaction, questions = asked_of(exo)
    found = recheck(exo.mechanism, reaction, LIMITS, 12.0, seed=5, centre_offset=OWN)
    whole = exo.workspace(4.0, LIMITS, centre_offset=OWN)
    np.testing.assert_array_equal(found.workspace.inside, whole.inside)
    assert (found.finer_index, found.finer_step) == (exo.workspace(12.0, LIMITS, centre_offset=OWN).index, 12.0)
    rows = LIMITS.replace(names=("stroke", "forces"))
    for part, poses in zip((found.flexion, found.abduction), lines_of(exo), strict=True):
        assert (part.poses * poses.inv()).magnitude().max() < 1e-12
        own = exo.workspace(poses, rows, centre_offset=OWN)
        assert set(part.margins) == {"stroke", "forces"}
        np.testing.assert_array_equal(part.margins["forces"], own.margins["forces"])
    # Pinocchio is asked about what is held of the lines, and about forty poses of the grid, in order, each once.
    parts = found.flexion, found.abduction, found.workspace
    assert len(questions) == 3
    for (poses, options, answer), part in zip(questions, parts, strict=True):
        known = part.poses.as_quat().reshape(-1, 4)
        chosen = [int(np.abs(known - q).max(axis=1).argmin()) for q in poses.as_quat()]
        assert chosen == sorted(set(chosen))
        held = np.isfinite(part.magnitude.ravel())
        assert chosen == np.flatnonzero(held).tolist() if part is not found.workspace else len(chosen) == 40
        assert held[chosen].all()
        assert (options["split"], options["constraint_bounds"]) == ("minimal", (0.0, 0.0))
        low, high = options["limits"]
        assert (np.all(low == 5.0), np.all(high == 400.0)) == (True, True)
        np.testing.assert_array_equal(options["centre_offset"].cuff, np.tile(OWN.cuff, (len(chosen), 1)))
        np.testing.assert_allclose(answer.magnitude, part.magnitude.ravel()[chosen], atol=1e-6)
    assert found.pinocchio_poses == sum(len(poses) for poses, *_ in questions)
    # Other poses of the grid with another seed, and the same ones again.
    again, others = asked_of(exo)
    recheck(exo.mechanism, again, LIMITS, 30.0, seed=6, centre_offset=OWN)
    recheck(exo.mechanism, again, LIMITS, 30.0, seed=5, centre_offset=OWN)
    samples = [questions[2][0].as_quat(), others[2][0].as_quat(), others[5][0].as_quat()]
    assert np.abs(samples[0] - samples[1]).max() > 1e-3
    np.testing.assert_array_equal(samples[0], samples[2])


def test_other_persons_and_places_are_checked():
    """On 8° with their own bodies, the elbow of the wearer and no gap; the centre 10 mm further off in six ways."""
    exo = ep.load("four-cables-worn")
    bent = replace(exo.mechanism.arm.wearer, elbow_flexion=0.7)
    limits = LIMITS.replace(wearers=(bent,), least_gap=0.01)
    found = recheck(exo.mechanism, exo.reaction, limits, 30.0, centre_offset=OWN)
    assert list(found.persons) == list(optimisation.PERSONS)
    for name, person in optimisation.PERSONS.items():
        own = limits.replace(wearers=(replace(person, elbow_flexion=0.7),), least_gap=0.0, body=None)
        assert found.persons[name] == exo.workspace(8.0, own, centre_offset=OWN).index
    ways = {"forward": 0, "to the left": 1, "up": 2}
    assert list(found.offsets) == [f"centre {sign}10 mm {way}" for way in ways for sign in "+-"]
    for name, share in found.offsets.items():
        shift = (0.01 if "+" in name else -0.01) * np.eye(3)[ways[name.split("mm ")[1]]]
        offset = ep.CentreOffset(OWN.base + shift, OWN.cuff + shift)
        assert share == exo.workspace(8.0, limits.replace(least_gap=0.0), centre_offset=offset).index
    # Nobody else is asked about where there is no arm, and Pinocchio where there are no forces.
    bare = exo.replace(arm=None)
    reaction, questions = asked_of(bare)
    without = recheck(bare.mechanism, reaction, Criteria(names=("stroke",)), 30.0)
    assert (without.persons, without.pinocchio_poses, questions) == ({}, 0, [])
    assert np.isnan(without.pinocchio_difference)
    assert set(without.beyond_elbow) <= set(optimisation.PERSONS)


def test_the_persons_of_a_check_are_those_of_the_population():
    """Each is at a percentile of stature and of mass of the persons that are drawn for a population."""
    people = ep.Wearer.drawn(1200, seed=3)
    assert len(optimisation.PERSONS) == 4
    for words, person in optimisation.PERSONS.items():
        name, rank = words.split(", ")
        percentile = float(rank.split("th")[0])
        assert person.sex == {"woman": "female", "man": "male"}[name]
        alike = [each for each in people if each.sex == person.sex]
        assert np.percentile([each.height for each in alike], percentile) == pytest.approx(person.height, rel=0.01)
        assert np.percentile([each.mass for each in alike], percentile) == pytest.approx(person.mass, rel=0.04)


def test_of_several_wearers_pinocchio_is_asked_about_the_designs_own_arm():
    """On a grid of 8°: its answer knows one arm, and the least of several is the workspace's."""
    exo = ep.load("four-cables-worn")
    wearers = ep.Wearer(1.6, 60.0, "female"), ep.Wearer(1.8, 80.0, "male")
    reaction, questions = asked_of(exo)
    found = recheck(exo.mechanism, reaction, LIMITS.replace(wearers=wearers, elbow_range=(0.0, 1.0)), 30.0)
    own = exo.workspace(8.0, LIMITS)
    known = own.poses.as_quat().reshape(-1, 4)
    chosen = [int(np.abs(known - q).max(axis=1).argmin()) for q in questions[2][0].as_quat()]
    assert np.abs(known[chosen] - questions[2][0].as_quat()).max() < 1e-12
    np.testing.assert_allclose(questions[2][2].magnitude, own.magnitude.ravel()[chosen], atol=1e-6)
    assert found.pinocchio_poses == sum(len(poses) for poses, *_ in questions)
    # The index is that of all wearers together.
    assert found.workspace.index < own.index
    # A single other wearer is not the design's own either.
    alone = recheck(exo.mechanism, exo.reaction, LIMITS.replace(wearers=wearers[:1]), 30.0)
    assert alone.pinocchio_difference < 1e-6


@pytest.mark.parametrize(
    ("change", "error"),
    [
        (lambda answer: {"magnitude": answer.magnitude + 1e-7}, None),
        (lambda answer: {"magnitude": answer.magnitude + 1.0}, "difference of"),
        (lambda answer: {"magnitude": np.where(np.arange(answer.magnitude.size) == 2, np.nan, answer.magnitude)},
         "difference of"),
        # Forces of poses out of their strokes are others, and say nothing.
        (lambda answer: {"magnitude": answer.magnitude + 1.0, "status": np.full(answer.status.shape, "out_of_stroke")},
         None),
        (lambda answer: {"can_hold": answer.can_hold & (np.arange(answer.can_hold.size) != 2)}, "cannot be held"),
        # Whether a pose inside can be held may be unknown.
        (lambda answer: {"can_hold": answer.can_hold & False, "unknown": answer.unknown | True}, None),
    ],
)  # fmt: skip
def test_what_pinocchio_does_not_confirm_is_refused(change, error):
    exo = ep.load("four-cables")
    reaction, _ = asked_of(exo, change)
    if error is None:
        assert recheck(exo.mechanism, reaction, LIMITS, 45.0).pinocchio_difference < 1e-6
        return
    with pytest.raises(SolverFailed, match=error):
        recheck(exo.mechanism, reaction, LIMITS, 45.0)
