"""The presets that a search has found do what the documentation says."""

from dataclasses import replace

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.load_case import RangeOfMotion
from exo_pin.muscle import Muscle, muscle_model
from exo_pin.workspace import Criteria, optimisation, recheck
from exo_pin.wrist import BodyShape

BODY = BodyShape.of(ep.Wearer(1.75, 75, "male"))
OTHERS = Criteria(largest_shoulder_force=150.0, body=BODY, least_gap=0.01)
LIMITS = Criteria(least_tension=5.0, largest_shoulder_force=120.0, body=BODY, least_gap=0.012)


@pytest.fixture(scope="module")
def cables():
    return ep.load("four-cables")


@pytest.fixture(scope="module")
def man():
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    return ep.Person(1.75, 75.0, "male")


def test_four_cables_work(cables):
    check = recheck(cables.mechanism, LIMITS, finer_step=6.0)
    assert check.works
    assert check.workspace.index == pytest.approx(0.856, abs=5e-4)
    assert check.finer_index > 0.84
    assert np.nanmax(check.flexion.magnitude) < 82.0
    assert np.nanmax(check.abduction.magnitude) < 49.0
    assert check.flexion.margins["forces"].min() > 21.0
    assert check.abduction.margins["forces"].min() > 15.0
    assert min(check.persons.values()) > 0.82
    assert set(check.beyond_elbow) == {"woman, 5th percentile", "man, 5th percentile"}
    assert f"woman, 5th percentile: 89.1 %; {check.beyond_elbow['woman, 5th percentile']}" in str(check)
    assert min(check.offsets.values()) > 0.875
    assert np.nanmax(check.workspace.tensions[check.workspace.inside]) < 152.0


def test_six_cables_work():
    exo = ep.load("six-cables")
    body = BodyShape.of(ep.Wearer(1.755, 85.0, "male"))
    limits = Criteria(least_tension=5.0, largest_shoulder_force=140.0, body=body, least_gap=0.012)
    found = exo.workspace(criteria=limits)
    assert found.index == pytest.approx(0.6625, abs=5e-4)
    assert np.nanmax(found.magnitude[found.inside]) < 129.0


def test_four_cables_hold_flexion_and_abduction_together(cables):
    box = RangeOfMotion("lifting", (0.0, 90.0), (0.0, 60.0), (0.0, 0.0))
    found = cables.workspace(box.poses(10.0), LIMITS)
    assert found.inside.all()
    assert found.magnitude.max() < 82.0


def test_other_shoulder_works_as_well(cables):
    right = cables.mirrored()
    limits = LIMITS.replace(body=BodyShape.of(ep.Wearer(1.75, 75, "male"), "right"))
    for poses, line in zip(optimisation.lifting_lines("right"), optimisation.lifting_lines("left"), strict=True):
        np.testing.assert_allclose(
            right.workspace(poses, limits).magnitude, cables.workspace(line, LIMITS).magnitude, rtol=1e-6
        )


def test_design_that_does_not_lift_does_not_work(cables):
    weak = cables.replace(
        limbs=[
            ep.Limb("SPS", stroke=limb.stroke, actuator=ep.Actuator("cable", pull_limit=40.0)) for limb in cables.limbs
        ]
    )
    assert not recheck(weak.mechanism, LIMITS, finer_step=12.0).works
    # Nor does one of which a criterion was not checked.
    unknown = cables.replace(arm=replace(cables.mechanism.arm, wearer=None))
    assert not recheck(unknown.mechanism, LIMITS.replace(body=None), finer_step=12.0).works


@pytest.mark.parametrize(
    ("name", "limit", "index", "lifting", "moment", "persons", "offsets", "forces"),
    [
        ("three-linear-actuators", 150.0, 0.9073, 42.0, 5.0, 0.92, 0.85, (-328.1, 289.6)),
        ("four-linear-actuators", 120.0, 0.984, 37.5, 21.0, 0.96, 0.85, (-334.3, 345.6)),
    ],
)
def test_linear_actuators_work(name, limit, index, lifting, moment, persons, offsets, forces):
    exo = ep.load(name)
    check = recheck(exo.mechanism, OTHERS.replace(largest_shoulder_force=limit), finer_step=6.0)
    assert check.works
    assert check.workspace.index == pytest.approx(index, abs=6e-4)
    assert check.finer_index > index - 0.02
    for line in (check.flexion, check.abduction):
        assert np.nanmax(line.magnitude) < lifting
        assert line.margins["forces"].min() > moment
    assert min(check.persons.values()) > persons
    assert min(check.offsets.values()) > offsets
    inside = check.workspace.tensions[check.workspace.inside]
    assert (inside.min(), inside.max()) == pytest.approx(forces, abs=0.1)
    # Every actuator is one that its family can be, and no joint is further from the shoulder than the frame reaches.
    for limb in exo.limbs:
        stroke = limb.stroke
        short, long = (
            stroke.end_fitting + ratio * stroke.nominal_length for ratio in (stroke.shortest, stroke.longest)
        )
        # Retracted, an actuator holds its stroke and 0.1 m of motor, gear and rod ends.
        assert short >= (long - short) + 0.1 - 1e-6
    assert np.linalg.norm(exo.geometry.base_points, axis=1).max() <= 0.506


@pytest.mark.parametrize("name", ["prototype", "optimised-table-5-3", "optimised-table-c-2"])
@pytest.mark.parametrize("found", ["three-linear-actuators", "four-linear-actuators"])
def test_linear_actuators_leave_less_force_than_a_design_of_the_thesis_where_that_one_holds(found, name):
    """Of one peak each: over the poses that both hold, with the same arm and the same actuators."""
    ours = ep.load(found)
    limb = ep.Limb("SPS", actuator=ours.limbs[0].actuator)
    theirs = ep.load(name).replace(arm=ours.arm, limbs=[limb] * 3)
    known = Criteria(names=("singularity", "forces"))
    held, reached = theirs.workspace(criteria=known), ours.workspace(criteria=OTHERS)
    both = held.inside & reached.inside
    assert both.mean() > 0.01
    assert reached.magnitude[both].max() < 0.5 * held.magnitude[both].max()
    assert reached.magnitude[reached.inside].max() < held.magnitude[held.inside].max()


@pytest.mark.parametrize("name", ["prototype", "optimised-table-5-3", "optimised-table-c-2"])
@pytest.mark.parametrize("found", ["four-cables", "four-muscle-cables"])
def test_cables_leave_less_force_than_a_design_of_the_thesis_where_that_one_holds(found, name):
    """The thesis's geometries with three cables of 400 N hold 0.2 to 1.4 % of the poses; on those that both hold."""
    ours = ep.load(found)
    limb = ep.Limb("SPS", actuator=ep.Actuator("cable", pull_limit=400.0))
    theirs = ep.load(name).replace(arm=ours.arm, limbs=[limb] * 3)
    held = theirs.workspace(criteria=["forces"])
    reached = ours.workspace(criteria=OTHERS.replace(least_tension=5.0))
    both = held.inside & reached.inside
    assert both.mean() > 0.001
    assert reached.magnitude[both].max() < 0.3 * held.magnitude[both].max()


def test_four_muscle_cables_work():
    exo, limits = ep.load("four-muscle-cables"), OTHERS.replace(least_tension=5.0)
    check = recheck(exo.mechanism, limits, finer_step=6.0)
    assert check.works
    assert check.workspace.index == pytest.approx(0.808, abs=5e-4)
    assert np.nanmax(check.flexion.magnitude) < 114.0
    assert np.nanmax(check.abduction.magnitude) < 83.0
    assert min(line.margins["forces"].min() for line in (check.flexion, check.abduction)) > 3.6
    assert min(check.persons.values()) > 0.73
    assert min(check.offsets.values()) > 0.775
    # Each limb gets by with the travel of its muscle.
    used = check.workspace.lengths[check.workspace.inside]
    assert (np.ptp(used, axis=0) <= 0.275).all()
    for limb in exo.limbs:
        assert (limb.stroke.longest - limb.stroke.shortest) * limb.stroke.nominal_length <= 0.275 + 1e-6
    assert np.linalg.norm(exo.geometry.base_points, axis=1).max() < 0.45


def test_worn_cables_work_where_the_centre_is_fixed():
    exo = ep.load("four-cables-worn")
    check = recheck(exo.mechanism, LIMITS, finer_step=6.0)
    assert check.works
    assert check.workspace.index == pytest.approx(0.834, abs=6e-4)
    assert np.nanmax(check.flexion.magnitude) < 75.0
    assert np.nanmax(check.abduction.magnitude) < 39.0
    assert min(check.persons.values()) > 0.84
    assert min(check.offsets.values()) > 0.85


def test_worn_cables_work_where_the_shoulder_moves(man):
    exo = ep.load("four-cables-worn")
    path = man.centre_path()
    check = recheck(exo.mechanism, LIMITS, finer_step=6.0, centre_offset=path)
    assert check.works
    assert check.workspace.index == pytest.approx(0.836, abs=6e-4)
    assert np.nanmax(check.flexion.magnitude) < 75.5
    assert np.nanmax(check.abduction.magnitude) < 57.5
    assert min(line.margins["forces"].min() for line in (check.flexion, check.abduction)) > 12.0
    assert min(check.persons.values()) > 0.80
    assert min(check.offsets.values()) > 0.86
    assert check.workspace.tensions[check.workspace.inside].max() < 177.5


def test_worn_cables_hold_in_pinocchio_what_four_cables_lose(man, cables):
    """Abduction of the whole quarter through :meth:`exo_pin.ShoulderExo.reaction`, with the limits of the design."""
    path, bounds = man.centre_path(), (5.0, 400.0)
    options = {"split": "minimal", "constraint_bounds": (0.0, 0.0), "limits": bounds, "centre_offset": path}
    poses = cables.pose(abduction=np.arange(0.0, 91.0, 5.0))
    lost = cables.reaction(poses, **options)
    assert lost.status.tolist()[-2:] == ["ok", "infeasible"]
    held = ep.load("four-cables-worn").reaction(poses, **options)
    assert held.can_hold.all()
    assert held.magnitude.max() == pytest.approx(56.9, abs=0.1)


def test_worn_cables_relieve_the_joint_of_a_shoulder_that_moves(man, cables):
    pytest.importorskip("clarabel")
    path = man.centre_path()
    poses = cables.pose(abduction=[60.0, 90.0])
    contact = [
        exo.joint_contact(poses, man, "least_effort", limits=(0.0, 400.0), centre_offset=path)
        for exo in (cables, ep.load("four-cables-worn"))
    ]
    assert contact[0].magnitude == pytest.approx([79.0, 209.0], abs=1.0)
    assert contact[1].magnitude == pytest.approx([31.0, 69.0], abs=1.0)
    assert contact[1].without_device.magnitude == pytest.approx([489.0, 438.0], abs=1.0)


@pytest.mark.parametrize(
    ("name", "limits", "index", "abduction"),
    [
        ("four-cables", LIMITS, 0.689, (0, 66)),
        ("four-linear-actuators", OTHERS.replace(largest_shoulder_force=120.0), 0.821, (0, 53)),
        ("three-linear-actuators", OTHERS, 0.694, (0, 71)),
        ("four-muscle-cables", OTHERS.replace(least_tension=5.0), 0.548, (0, 39)),
    ],
)
def test_what_is_left_of_the_other_designs_where_the_shoulder_moves(man, name, limits, index, abduction):
    exo, path = ep.load(name), man.centre_path()
    assert exo.workspace(criteria=limits, centre_offset=path).index == pytest.approx(index, abs=6e-4)
    line = exo.workspace(exo.pose(abduction=np.arange(91.0)), limits, centre_offset=path)
    assert line.inside[abduction[0] : abduction[1] + 1].all()
    assert not line.inside[abduction[1] + 1]
    flexion = exo.workspace(exo.pose(flexion=np.arange(90.0)), limits, centre_offset=path)
    assert flexion.inside.all()


def test_what_the_muscles_of_the_cables_have_to_pull():
    """A muscle of 0.55 m and a tackle of 2 : 1: twice the cable's tension, at half its travel."""
    exo, limits = ep.load("four-muscle-cables"), OTHERS.replace(least_tension=5.0)
    found = exo.workspace(criteria=limits)
    model = muscle_model("tang-optimised", 0.55)
    muscle = Muscle(model=model, end_fitting=0.0, supply_pressure=4e5)
    strongest, late, bundles = [], [], []
    for i, limb in enumerate(exo.limbs):
        contraction = 0.5 * (limb.stroke.nominal_length - found.lengths[found.inside][:, i])
        assert contraction.max() <= 0.25 * 0.55 + 1e-9
        pull = 2.0 * found.tensions[found.inside][:, i]
        strongest.append(pull.max())
        late.append(pull[contraction > 0.2 * 0.55].max())
        if i == 0:
            assert 0.15 * 0.55 < contraction[pull.argmax()] < 0.2 * 0.55
        # The law is known from 4 % of contraction on; a muscle that is longer pulls no less.
        most = muscle.force_limits(0.55 - np.maximum(contraction, 0.051 * 0.55))[1]
        bundles.append(int(np.ceil((pull / most).max())))
    assert max(strongest) == pytest.approx(223.6, abs=0.5)
    assert max(late) == pytest.approx(213.0, abs=1.0)
    # So many of the thesis's muscles side by side, at 4 bar.
    assert bundles == [15, 7, 8, 3]
