"""What a check of a design asks on which grid and of which arm, and how designs and studies are told apart."""

from dataclasses import replace
from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import SolverFailed
from exo_pin.design.holding_frame import device_mass
from exo_pin.workspace import Criteria, recheck, starting_design
from exo_pin.workspace.optimisation import ranking
from exo_pin.workspace.optimisation.design_variables import DesignVariables
from exo_pin.workspace.optimisation.merit import Merit, _digest, _rounded, study_description
from exo_pin.workspace.optimisation.ranking import FullGrid
from exo_pin.workspace.optimisation.recheck import PERSONS, _offset_of, _persons, _through_pinocchio
from exo_pin.workspace.optimisation.search_poses import SearchPoses, lifting_lines

pytestmark = pytest.mark.usefixtures("plain")

NAN = np.nan
module = import_module("exo_pin.workspace.optimisation.recheck")
ARM = ep.Arm.from_anthropometry(1.75, 75, sex="male")
WEARERS = ep.Wearer(1.6, 60.0, "female"), ep.Wearer(1.8, 80.0, "male")


@pytest.fixture
def asked(monkeypatch):
    """Questions of a check, each with a number of its own as answer, and what Pinocchio is asked."""
    found = SimpleNamespace(grids=[], pinocchio=[], margins={"forces": None, "stroke": None})

    def workspace(mechanism, poses=None, criteria=None, load=None, centre_offset=None):
        found.grids.append(SimpleNamespace(poses=poses, criteria=criteria, load=load, offset=centre_offset))
        return SimpleNamespace(index=len(found.grids) / 100.0, margins=found.margins)

    monkeypatch.setattr(module, "workspace", workspace)
    monkeypatch.setattr(module, "_through_pinocchio", lambda *given: found.pinocchio.append(given) or (7, 1e-9))
    monkeypatch.setattr(module, "_persons", lambda *given: {"persons": given[2]})
    monkeypatch.setattr(module, "_offsets", lambda *given: {"offsets": given[2]})
    return found


def lines_of(grids, side):
    """Whether two questions are about lifting forward and sideways, in this order."""
    for question, line in zip(grids, lifting_lines(side), strict=True):
        assert (question.poses * line.inv()).magnitude().max() < 1e-12
        assert question.load is None


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_design_is_asked_on_two_grids_and_two_lines(asked, side):
    mechanism, own = ep.load("four-cables", side=side).mechanism, ep.CentreOffset.together([0.0, 0.003, 0.0])
    limits = Criteria(names=("stroke", "connected", "forces"))
    found = recheck(mechanism, "reaction", limits, 6.0, seed=5, centre_offset=own)
    full, *lines, finer = asked.grids
    assert (full.poses, full.criteria, finer.poses, finer.criteria) == (4.0, limits, 6.0, limits)
    lines_of(lines, side)
    assert [line.criteria.names for line in lines] == [("stroke", "forces")] * 2
    assert {id(question.offset) for question in asked.grids} == {id(own)}
    # In the order in which they were asked: the grid, forward, sideways, the finer grid.
    parts = found.workspace, found.flexion, found.abduction
    assert [part.index for part in parts] == [0.01, 0.02, 0.03]
    assert (found.finer_index, found.finer_step) == (0.04, 6.0)
    assert (found.pinocchio_poses, found.pinocchio_difference) == (7, 1e-9)
    assert (found.persons, found.offsets, found.centre_offset) == ({"persons": own}, {"offsets": own}, own)
    ((_, whole, along, reaction, criteria, seed),) = asked.pinocchio
    assert (whole, along, reaction, seed) == (parts[0], list(parts[1:]), "reaction", 5)
    assert (criteria.names, criteria.wearers) == (limits.names, ())


def test_of_several_arms_pinocchio_is_asked_about_the_designs_own(asked):
    mechanism = ep.load("four-cables-worn").mechanism
    limits = Criteria(names=("stroke", "connected", "forces"), wearers=WEARERS, elbow_range=(0.0, 1.0))
    recheck(mechanism, "reaction", limits)
    full, *lines = asked.grids[:3]
    grid, *again = asked.grids[3:6]
    assert full.criteria is limits
    lines_of(lines, "left")
    lines_of(again, "left")
    assert grid.poses == 8.0
    assert asked.grids[6].poses == 2.0
    ((_, whole, along, _, criteria, seed),) = asked.pinocchio
    assert (whole.index, [part.index for part in along], seed) == (0.04, [0.05, 0.06], 0)
    assert grid.criteria is criteria
    assert (criteria.wearers, criteria.elbow_range) == ((), None)
    assert [line.criteria.names for line in again] == [("stroke", "forces")] * 2
    assert all(line.criteria.wearers == () for line in again)
    # The body is still that of the wearers.
    np.testing.assert_array_equal(criteria.body.arm, limits.body_of(mechanism).arm)
    # Two arms are several. A single wearer has one, which is asked about as it is.
    asked.grids.clear()
    recheck(mechanism, "reaction", limits.replace(elbow_range=None))
    assert len(asked.grids) == 7
    asked.grids.clear()
    recheck(mechanism, "reaction", limits.replace(wearers=WEARERS[:1], elbow_range=None))
    assert len(asked.grids) == 4


def test_without_forces_pinocchio_is_not_asked_and_without_an_arm_nobody_else(asked):
    asked.margins = {"stroke": None}
    bare = ep.load("four-cables").replace(arm=None).mechanism
    found = recheck(bare, "reaction", Criteria(names=("stroke",)))
    assert asked.pinocchio == []
    assert found.pinocchio_poses == 0
    assert np.isnan(found.pinocchio_difference)
    assert found.persons == {}
    assert found.offsets == {"offsets": None}
    assert set(found.beyond_elbow) <= set(PERSONS)


def test_the_persons_of_a_check_are_those_of_the_population(monkeypatch):
    """Each is at a percentile of stature and of mass of the persons that are drawn for a population."""
    people, asked = ep.Wearer.drawn(1200, seed=3), []
    monkeypatch.setattr(
        module, "workspace", lambda *given: asked.extend(given[2].wearers) or SimpleNamespace(index=len(asked))
    )
    # Of a design that nobody wears their arms are straight.
    unworn = ep.load("four-cables").replace(arm=ep.Arm(3.0, [0.0, 0.0, -0.3])).mechanism
    shares = _persons(unworn, Criteria(), None)
    for (words, number), person in zip(shares.items(), asked, strict=True):
        assert person is asked[number - 1]
        name, rank = words.split(", ")
        percentile = float(rank.split("th")[0])
        assert person.sex == {"woman": "female", "man": "male"}[name]
        alike = [each for each in people if each.sex == person.sex]
        assert np.percentile([each.height for each in alike], percentile) == pytest.approx(person.height, rel=0.01)
        assert np.percentile([each.mass for each in alike], percentile) == pytest.approx(person.mass, rel=0.04)
        assert person.elbow_flexion == 0.0
    assert list(shares) == list(PERSONS)
    assert len(shares) == 4


def part_of(mechanism, count, offset=False, **changes):
    """Poses of a workspace, with numbers of their own."""
    rng = np.random.default_rng(count)
    fields = {
        "poses": Rotation.random(count, rng=rng), "magnitude": rng.uniform(10.0, 90.0, count),
        "lengths": rng.uniform(0.2, 0.4, (count, mechanism.limb_count)),
        "tensions": rng.uniform(5.0, 200.0, (count, mechanism.limb_count)),
        "inside": np.ones(count, dtype=bool), "margins": {"forces": None, "stroke": None},
        "centre_offset": ep.CentreOffset(*rng.uniform(-0.01, 0.01, (2, count, 3))) if offset else None,
    }  # fmt: skip
    return SimpleNamespace(**(fields | changes))


def confirmed(parts, questions, gap=0.0, **changes):
    """A reaction that knows the poses of these parts, and notes what it is asked."""
    known = {tuple(np.round(q, 9)): size for part in parts for q, size in
             zip(part.poses.as_quat().reshape(-1, 4), part.magnitude.ravel(), strict=True)}  # fmt: skip

    def reaction(poses, **options):
        questions.append((poses, options))
        count = len(poses)
        answer = {
            "magnitude": np.array([known[tuple(np.round(q, 9))] for q in poses.as_quat()]) + gap,
            "status": np.full(count, "ok"), "can_hold": np.ones(count, dtype=bool),
            "unknown": np.zeros(count, dtype=bool),
        }  # fmt: skip
        return SimpleNamespace(**(answer | {key: change(count) for key, change in changes.items()}))

    return reaction


def test_which_poses_go_through_pinocchio():
    """All that are held of the lines, and of the grid forty drawn at random, in order, each with its own offset."""
    mechanism = ep.load("four-cables").mechanism
    lines = [part_of(mechanism, 5, True), part_of(mechanism, 6, True)]
    lines[0].magnitude[[1, 3]] = NAN
    lines[0].tensions[[1, 3]] = NAN
    lines[1].magnitude[:] = NAN
    full = part_of(mechanism, 60, True)
    shape = (3, 4, 5)
    for name in ("magnitude", "inside"):
        setattr(full, name, getattr(full, name).reshape(shape))
    for name in ("lengths", "tensions"):
        setattr(full, name, getattr(full, name).reshape(*shape, 4))
    full.poses = Rotation.from_quat(full.poses.as_quat().reshape(*shape, 4))
    full.centre_offset = ep.CentreOffset(*(side.reshape(*shape, 3) for side in vars(full.centre_offset).values()))
    questions = []
    limits = Criteria(least_tension=7.0)
    count, worst = _through_pinocchio(mechanism, full, lines, confirmed([*lines, full], questions), limits, 1)
    assert (count, worst) == (3 + 40, 0.0)
    (first, options), (sample, others) = questions
    assert (first * lines[0].poses[[0, 2, 4]].inv()).magnitude().max() < 1e-12
    np.testing.assert_array_equal(options["centre_offset"].cuff, lines[0].centre_offset.cuff[[0, 2, 4]])
    assert (options["split"], options["constraint_bounds"]) == ("minimal", (0.0, 0.0))
    for low, high in (options["limits"], others["limits"]):
        assert (np.all(low == 7.0), np.all(high == 400.0)) == (True, True)
    assert others["limits"][0].shape == (40, 4)
    # In the order of the grid, each once, and other ones with another seed.
    flat = full.poses.as_quat().reshape(-1, 4)
    rows = [int(np.abs(flat - q).sum(axis=1).argmin()) for q in sample.as_quat()]
    assert rows == sorted(set(rows))
    np.testing.assert_array_equal(others["centre_offset"].base, full.centre_offset.base.reshape(-1, 3)[rows])
    assert rows != list(range(40))
    questions.clear()
    _through_pinocchio(mechanism, full, lines, confirmed([*lines, full], questions), limits, 2)
    assert np.abs(questions[1][0].as_quat() - sample.as_quat()).max() > 1e-3
    assert _offset_of(part_of(mechanism, 3), np.array([0])) is None


def test_what_counts_as_agreement_of_pinocchio():
    mechanism = ep.load("four-cables").mechanism
    parts = [part_of(mechanism, count) for count in (4, 5, 6)]
    full, lines = parts[2], parts[:2]

    def through(**answer):
        return _through_pinocchio(mechanism, full, lines, confirmed(parts, [], **answer), Criteria(), 0)

    # Relative to the largest tension, and to no less than 1 N.
    assert through(gap=4e-6) == (15, pytest.approx(4e-6))
    for part in parts:
        part.tensions *= 1e-3
    assert through(gap=0.9e-6)[1] == pytest.approx(0.9e-6)
    with pytest.raises(SolverFailed, match="difference"):
        through(gap=1.1e-6)
    # Forces of poses out of their strokes are others, and say nothing.
    out = {"status": lambda count: np.full(count, "out_of_stroke")}
    assert through(gap=5.0, **out) == (15, 0.0)
    # Whether a pose inside can be held may be unknown; one outside need not be.
    none, every = (lambda count: np.zeros(count, dtype=bool)), (lambda count: np.ones(count, dtype=bool))
    assert through(can_hold=none, unknown=every)[0] == 15
    with pytest.raises(SolverFailed, match="cannot be held"):
        through(can_hold=lambda count: np.arange(count) > 0)
    for part in parts:
        part.inside[0] = False
    assert through(can_hold=lambda count: np.arange(count) > 0)[0] == 15
    for part in parts:
        part.inside[0], part.margins = True, {"forces": None}
    assert through(can_hold=none)[0] == 15


def test_the_full_grid_counts_every_centre_once(monkeypatch):
    """Two poses with one centre and two with another: means over the four, and the index of the worse centre."""
    mechanism = ep.load("four-cables").mechanism
    shift, asked = ep.CentreOffset.together([0.0, 0.0, 0.01]), []
    answers = iter([
        SimpleNamespace(index=0.5, margins={"forces": np.array([[3.0, -4.0]])}, magnitude=np.array([[40.0, NAN]])),
        SimpleNamespace(index=1.0, margins={"forces": np.array([[2.0, 6.0]])}, magnitude=np.array([[10.0, 70.0]])),
    ])  # fmt: skip
    monkeypatch.setattr(ranking, "workspace", lambda *given, **more: asked.append((given, more)) or next(answers))
    contact = SimpleNamespace(exact=lambda own: 123.0 if own is mechanism else NAN)
    limits = Criteria(names=("forces",))
    grid = FullGrid(limits, (None, shift), {"contact_force": 1.0}, contact)
    found = grid.evaluate(mechanism)
    assert [more["centre_offset"] for _, more in asked] == [None, shift]
    assert all(given == (mechanism, 4.0, limits) for given, _ in asked)
    assert found.objectives == pytest.approx({
        "index": 0.5, "mean_shoulder_force": 40.0, "peak_shoulder_force": 70.0, "median_moment_margin": 3.0,
        "worst_margin": 0.4, "contact_force": 123.0, "device_mass": device_mass(mechanism),
    })  # fmt: skip
    # A quarter each: 4 N m too little and 1 N m of aim are one unit of 5 N m; not to be inside costs 0.3.
    assert found.merit == pytest.approx(0.25 * (1.0 + 0.3) + 1.23)
    answers = iter([SimpleNamespace(index=1.0, margins={"forces": np.ones(2)}, magnitude=np.ones(2))])
    assert np.isnan(FullGrid(limits, (None,), {}).evaluate(mechanism).objectives["contact_force"])


def described(by_geometry=False, poses=(0.0, 40.0), centres=(None,), refine=False, contact=None, **changes):
    mechanism = starting_design(ep.Actuator("cable", pull_limit=400.0), ARM, 3).replace(**changes)
    space = DesignVariables(mechanism, {"A[1].radius": (0.1, 0.3)}, by_geometry)
    turns = Rotation.from_rotvec(np.radians(poses)[:, None] * [0.0, 1.0, 0.0])
    merit = Merit(space, SearchPoses.of(turns), Criteria(names=("singularity",)), False, contact)
    return study_description(merit, ("index",), 3, 24, refine, centres)


def test_studies_are_told_apart_by_what_they_search():
    plain = described()
    assert {key: plain[key] for key in ("objectives", "limbs", "poses", "seed", "run_length", "start")} == {
        "objectives": ("index",), "limbs": 3, "poses": 2, "seed": 3, "run_length": 24, "start": "random",
    }  # fmt: skip
    assert plain["variables"] == {"A[1].radius": [0.1, 0.3]}
    assert {"cuff", "centre_offset", "contact"}.isdisjoint(plain)
    assert described(title="another", sources={"arm": "elsewhere"}) == plain
    assert described(refine=True)["start"] == {"A[1].radius": pytest.approx(np.hypot(0.15, 0.1))}
    assert described(by_geometry=True)["cuff"] == "by geometry"
    moved = described(centres=(None, ep.CentreOffset.together([0.0, 0.0, 0.01])))["centre_offset"]
    assert moved == [None, {"base": [0.0, 0.0, 0.01], "cuff": [0.0, 0.0, 0.01]}]
    contact = SimpleNamespace(description=lambda: "of a person")
    assert described(contact=contact) == {**plain, "contact": "of a person"}
    for other, key in (
        (described(poses=(0.0, 41.0)), "data of the poses"),
        (described(arm=replace(ARM, mass=5.0)), "data of the design"),
    ):
        assert [name for name in plain if other[name] != plain[name]] == [key]


def test_data_are_told_apart_to_nine_decimals():
    given = {"a": [1.00000000041, -0.0], "b": ("x", 3, True), "c": np.array([0.12345678949])}
    rounded = {"a": [1.0, 0.0], "b": ["x", 3, True], "c": [0.123456789]}
    assert repr(_rounded(given)) == repr(rounded)
    assert _digest(given) == _digest(rounded)
    assert len(_digest(given)) == 12
    assert len({_digest(0.1 + 1e-9 * k) for k in range(50)}) == 50
