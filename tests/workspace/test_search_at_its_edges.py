"""Objectives, variables and stored runs of a search at the edges of what they may be."""

from types import SimpleNamespace

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.workspace import CRITERIA, Criteria, free_joints, starting_design
from exo_pin.workspace.device_values import mass_words
from exo_pin.workspace.optimisation import contact_objective, merit
from exo_pin.workspace.optimisation.descent import GENERATION, Descent
from exo_pin.workspace.optimisation.design_variables import DesignVariables
from exo_pin.workspace.optimisation.merit import check_objectives
from exo_pin.workspace.optimisation.optimised import Optimised
from exo_pin.workspace.optimisation.ranking import reported
from exo_pin.workspace.optimisation.search_poses import SearchPoses
from exo_pin.workspace.optimisation.starting_designs import joints_and_variables
from exo_pin.workspace.optimisation.stored_study import SearchRun
from exo_pin.workspace.optimisation.stroke_fitting import fitted_strokes, stroke_windows, window_margin

pytestmark = pytest.mark.usefixtures("plain")

ARM = ep.Arm.from_anthropometry(1.75, 75, sex="male")
CABLE = ep.Actuator("cable", pull_limit=400.0)


@pytest.mark.parametrize("seed", range(4))
def test_poses_of_the_contact_force_are_drawn_evenly(seed):
    """At the middles of twelve equal parts of the weight; each pose once, and none of no weight."""
    weights = np.random.default_rng(seed).uniform(size=40) * (np.arange(40) % 3 > 0)
    total = np.cumsum(weights)
    expected = [int(np.flatnonzero(total >= (2 * k + 1) / 24 * total[-1])[0]) for k in range(12)]
    found = contact_objective._evenly(weights)
    assert found.tolist() == sorted(set(expected))
    assert (weights[found] > 0.0).all()
    nothing = contact_objective._evenly(np.zeros(5))
    assert (nothing.size, nothing.dtype.kind) == (0, "i")
    assert contact_objective._evenly(np.array([0.0, 2.0, 0.0])).tolist() == [1]


def space(bounds, actuator=CABLE):
    return DesignVariables(starting_design(actuator, ARM, 3), bounds)


def test_points_of_values_just_outside_are_those_of_the_bounds():
    own = space({"A[1].radius": (0.1, 0.3)})
    for value, point in ((0.1 - 1e-12, 0.0), (0.1, 0.0), (0.15, 1.0 / 3.0), (0.3, 1.0), (0.3 + 1e-12, 1.0)):
        assert own.point({"A[1].radius": value}) == pytest.approx([point], abs=1e-6)


def test_a_value_that_the_design_has_not_begins_in_the_middle():
    own = space({"nominal_length[1]": (0.3, 0.5), "A[1].radius": (0.1, 0.3)})
    assert own.of_design() == {
        "nominal_length[1]": pytest.approx(0.4),
        "A[1].radius": pytest.approx(np.hypot(0.15, 0.1)),
    }
    own.require_design_inside()


@pytest.mark.parametrize("laws", [False, True])
@pytest.mark.parametrize("fit", [False, True])
@pytest.mark.parametrize("names", [("stroke", "singularity"), ("singularity",)])
def test_strokes_of_a_design_that_is_judged(monkeypatch, laws, fit, names):
    """Its own, or those that fit; of muscles with a law they are part of the design before it is judged."""
    seen, own = {}, merit.judged

    def judged(margins, *rest):
        seen.update(margins)
        return own(margins, *rest)

    asked = []
    monkeypatch.setattr(merit, "judged", judged)
    monkeypatch.setattr(merit, "stroke_windows", lambda *given: asked.append(given) or stroke_windows(*given))
    law = ep.Actuator("pneumatic muscle", force_law="best", supply_pressure=4e5)
    # A cable's drum takes more than the lengths that occur; what counts is these.
    drum = ep.Actuator("cable", pull_limit=400.0, travel_limit=0.5)
    mechanism = starting_design(law if laws else drum, ARM, 3)
    stroke = ep.Stroke(0.3, 0.75, 1.0, 0.1)
    mechanism = mechanism.replace(
        limbs=[ep.Limb("SPS", actuator=each.actuator, stroke=stroke) for each in mechanism.limbs]
    )
    variables = DesignVariables(mechanism, {"A[1].radius": (0.15, 0.2)})
    poses = SearchPoses.of(ep.load("four-cables").pose([0.0, 40.0, 80.0, 90.0]))
    judge = merit.Merit(variables, poses, Criteria(names=names), fit)
    judge.evaluate(variables.point(variables.of_design()), {})
    assert set(seen) == set(names)
    if "stroke" not in names:
        return
    lengths = judge.lengths(variables.design(variables.of_design()))
    given = np.minimum(lengths - 0.325, 0.4 - lengths).min(axis=1)
    if not fit:
        np.testing.assert_allclose(seen["stroke"], given)
    else:
        assert (seen["stroke"] > given).all()
        # A cable takes all lengths that occur. A muscle with a law has its stroke before it is judged: it pulls by it.
        made = fitted_strokes(mechanism, lengths, judge.poses.weights)
        ends = np.array([limb.length_range for limb in made.limbs])
        whole = np.minimum(lengths - ends[:, 0], ends[:, 1] - lengths).min(axis=1)
        window = window_margin(stroke_windows(mechanism, lengths, judge.poses.weights), lengths)
        np.testing.assert_allclose(seen["stroke"], whole if laws else window, atol=1e-12)
    assert len(asked) == int(fit and not laws)


def test_moving_mass_is_what_is_not_the_persons():
    exo = ep.load("four-linear-actuators-worn")
    arm = exo.mechanism.arm
    text = mass_words(exo)
    assert f"Moving mass besides the arm: {arm.mass - arm.person.mass:.2f} kg." in text
    assert arm.mass - arm.person.mass > 0.1
    for other in (None, ep.Arm(3.0, [0.0, 0.0, -0.3])):
        bare = exo.replace(arm=other).mechanism
        assert mass_words(bare).startswith("Moving mass besides the arm: 0.00 kg.")


def test_the_first_run_is_no_start():
    exo = ep.load("four-cables")
    check = SimpleNamespace(works=False, workspace=SimpleNamespace(index=0.5))
    one = SimpleNamespace(
        design=exo,
        run=SearchRun(0, [0.5], 0.1, {}, 24),
        checks=(check,),
        objectives={"index": 0.5},
        works=False,
        index=0.5,
    )
    assert "\nRun 0 (index 0.5 on the full grid)." in str(Optimised((one,), (one.run,), ("index",), ({"index": 0.5},)))


def test_a_state_holds_no_numbers_that_were_never_set():
    pytest.importorskip("cmaes", reason="needs the extra optimise: pip install '.[optimise]'")
    judge = SimpleNamespace(variables=SimpleNamespace(count=2))
    assert not np.any(Descent(judge, {}, (1, 0)).stored()["recent_values"])


def test_every_generation_of_every_run_has_random_numbers_of_its_own(monkeypatch):
    """The same of the same run and generation, and no others alike."""
    pytest.importorskip("cmaes", reason="needs the extra optimise: pip install '.[optimise]'")
    own = space({"A[1].radius": (0.1, 0.3), "A[2].radius": (0.1, 0.3)})
    judge = SimpleNamespace(variables=own, generation=lambda points, weights: [float(p @ p) for p in points])

    def seeds(*seed):
        run, drawn = Descent(judge, {}, seed), []
        reseed = run._search.reseed_rng
        monkeypatch.setattr(run._search, "reseed_rng", lambda number: drawn.append(number) or reseed(number))
        run.run(8 * GENERATION)
        return drawn

    first, second = seeds(1, 0), seeds(1, 1)
    assert len({*first, *second}) == 16
    assert seeds(1, 0) == first


def test_what_counts_as_one_in_a_search():
    """Of the criteria that a search weighs: margins that miss their aim by as much as this, in their units."""
    counted = {
        "joint_angles": (0.5, "rad"), "shoulder_range": (np.inf, "rad"), "stroke": (0.05, "m"),
        "singularity": (0.08, ""), "connected": (0.08, ""), "forces": (5.0, "N m"), "socket": (100.0, "N"),
        "cuff_pull": (100.0, "N"), "cuff_slip": (0.05, "m"), "elbow": (0.05, "m"), "limb_loss": (5.0, "N m"),
        "clearance": (0.03, "m"),
    }  # fmt: skip
    # What a search of cables with a wearer weighs where no limits are given.
    asked = ("stroke", "singularity", "connected", "forces", "clearance")
    mechanism = ep.load("four-cables-worn").mechanism
    share, others = np.array([1.0]), {"contact_force": np.nan, "device_mass": 0.0}
    for name, (scale, unit) in counted.items():
        item = CRITERIA[name]
        assert item.unit == unit
        assert bool(item.missing(mechanism, Criteria(), True)) == (name not in asked)
        if np.isinf(scale):
            continue
        aims = {"joint_angles": 0.05, "singularity": 0.03, "forces": 1.0, "clearance": 0.003}
        least = aims.get(name, 0.0) - 0.5 * scale
        found = merit.judged({name: np.array([least])}, np.array([np.nan]), share, Criteria(), others, {})
        assert found.merit == pytest.approx(0.5 + 0.3 * (least < 0.0)), name
    held = Criteria(largest_shoulder_force=80.0)
    found = merit.judged({"shoulder_force": np.array([-40.0])}, np.array([120.0]), share, held, others, {})
    assert found.merit == pytest.approx(0.5 + 0.3)
    # Without a limit a newton counts as one.
    found = merit.judged({"shoulder_force": np.array([-0.5])}, np.array([1.0]), share, Criteria(), others, {})
    assert found.merit == pytest.approx(0.5 + 0.3)


@pytest.mark.parametrize("name", [name for name in merit.OBJECTIVES if name != "index"])
def test_which_of_two_designs_of_one_index_is_on_the_front(name):
    """More room for moments and a larger worst margin are better; less of forces and of mass is."""
    designs = [merit.Evaluation(1.0, {"index": 0.5, name: value}) for value in (2.0, 1.0)]
    more = name in ("median_moment_margin", "worst_margin")
    wanted = check_objectives(["index", name])
    assert reported(designs, wanted, False) == [0 if more else 1]
    better = [merit.Evaluation(1.0, {"index": index, name: 1.0}) for index in (0.5, 0.6)]
    assert reported(better, wanted, False) == [1]


def test_what_a_merit_does_unless_it_is_told_otherwise():
    """Strokes are fitted, of designs that have none too; the contact force is exact; the cuff is that of the design."""
    own = space({"A[1].radius": (0.1, 0.3)})
    judge = merit.Merit(own, SearchPoses.of(ep.load("four-cables").pose([0.0, 40.0])), Criteria(names=("stroke",)))
    assert judge.names == ("stroke",)
    point = own.point(own.of_design())
    assert judge.evaluate(point, {}).objectives["index"] == 1.0
    assert own.design(own.of_design()).arm is own.device.arm
    judge.contact = SimpleNamespace(exact=lambda _: 300.0, surrogate=lambda _: 200.0)
    assert judge.evaluate(point, {}).objectives["contact_force"] == 300.0
    assert judge.evaluate(point, {}, False).objectives["contact_force"] == 200.0
    assert starting_design(CABLE, ARM).limb_count == 4


def test_a_search_reaches_beyond_its_bounds_only_to_refine():
    mechanism = starting_design(CABLE, ARM, 3)
    wide = mechanism.replace(
        geometry=ep.WristGeometry(2.0 * mechanism.geometry.base_points, mechanism.geometry.platform_points)
    )
    assert joints_and_variables(wide, {}) == free_joints(3)
    assert joints_and_variables(wide, {}, True) != free_joints(3)
