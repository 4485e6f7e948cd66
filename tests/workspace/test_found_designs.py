"""The presets that a search has found do what the documentation says."""

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import SolverFailed
from exo_pin.workspace import Criteria, recheck
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
    check = recheck(cables.mechanism, cables.reaction, LIMITS, finer_step=6.0)
    assert check.works
    assert check.workspace.index == pytest.approx(0.856, abs=5e-4)
    assert check.finer_index > 0.84
    assert np.nanmax(check.flexion.magnitude) < 82.0
    assert np.nanmax(check.abduction.magnitude) < 49.0
    assert check.flexion.margins["forces"].min() > 21.0
    assert check.abduction.margins["forces"].min() > 15.0
    assert check.pinocchio_poses == 78
    assert check.pinocchio_difference < 1e-9
    assert min(check.persons.values()) > 0.82
    assert set(check.beyond_elbow) == {"woman, 5th percentile", "man, 5th percentile"}
    assert f"woman, 5th percentile: 89.1 %; {check.beyond_elbow['woman, 5th percentile']}" in str(check)
    assert min(check.offsets.values()) > 0.875
    # In one region, which holds the pose of the grid nearest to rest.
    np.testing.assert_array_equal(check.workspace.region, check.workspace.inside)
    assert check.workspace.region[check.workspace.nearest_to_rest]
    assert np.nanmax(check.workspace.tensions[check.workspace.inside]) < 152.0


def test_recheck_refuses_what_pinocchio_does_not_confirm(cables):
    heavier = cables.replace(arm=cables.arm + ep.Arm(0.1, [0.0, 0.0, -0.5], np.zeros((3, 3))))
    with pytest.raises(SolverFailed, match="difference"):
        recheck(cables.mechanism, heavier.reaction, LIMITS, finer_step=12.0)


@pytest.mark.parametrize(
    ("name", "limit", "index", "lifting", "moment", "persons", "offsets", "forces"),
    [
        ("three-linear-actuators", 150.0, 0.9073, 42.0, 5.0, 0.92, 0.85, (-328.1, 289.6)),
        ("four-linear-actuators", 120.0, 0.984, 37.5, 21.0, 0.96, 0.85, (-334.3, 345.6)),
    ],
)
def test_linear_actuators_work(name, limit, index, lifting, moment, persons, offsets, forces):
    exo = ep.load(name)
    check = recheck(exo.mechanism, exo.reaction, OTHERS.replace(largest_shoulder_force=limit), finer_step=6.0)
    assert check.works
    assert check.workspace.index == pytest.approx(index, abs=6e-4)
    assert check.finer_index > index - 0.02
    for line in (check.flexion, check.abduction):
        assert np.nanmax(line.magnitude) < lifting
        assert line.margins["forces"].min() > moment
    assert check.pinocchio_difference < 1e-9
    assert min(check.persons.values()) > persons
    assert min(check.offsets.values()) > offsets
    np.testing.assert_array_equal(check.workspace.region, check.workspace.inside)
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
    check = recheck(exo.mechanism, exo.reaction, limits, finer_step=6.0)
    assert check.works
    assert check.workspace.index == pytest.approx(0.808, abs=5e-4)
    assert np.nanmax(check.flexion.magnitude) < 114.0
    assert np.nanmax(check.abduction.magnitude) < 83.0
    assert min(line.margins["forces"].min() for line in (check.flexion, check.abduction)) > 3.6
    assert check.pinocchio_difference < 1e-9
    assert min(check.persons.values()) > 0.73
    assert min(check.offsets.values()) > 0.775
    np.testing.assert_array_equal(check.workspace.region, check.workspace.inside)
    # Each limb gets by with the travel of its muscle.
    used = check.workspace.lengths[check.workspace.inside]
    assert (np.ptp(used, axis=0) <= 0.275).all()
    for limb in exo.limbs:
        assert (limb.stroke.longest - limb.stroke.shortest) * limb.stroke.nominal_length <= 0.275 + 1e-6
    assert np.linalg.norm(exo.geometry.base_points, axis=1).max() < 0.45


def test_worn_cables_work_where_the_shoulder_moves(man):
    exo = ep.load("four-cables-worn")
    path = man.centre_path()
    check = recheck(exo.mechanism, exo.reaction, LIMITS, finer_step=6.0, centre_offset=path)
    assert check.works
    assert check.workspace.index == pytest.approx(0.836, abs=6e-4)
    assert np.nanmax(check.flexion.magnitude) < 75.5
    assert np.nanmax(check.abduction.magnitude) < 57.5
    assert min(line.margins["forces"].min() for line in (check.flexion, check.abduction)) > 12.0
    assert check.pinocchio_poses == 78
    assert check.pinocchio_difference < 1e-9
    assert min(check.persons.values()) > 0.80
    assert min(check.offsets.values()) > 0.86
    np.testing.assert_array_equal(check.workspace.region, check.workspace.inside)
    assert check.workspace.region[check.workspace.nearest_to_rest]
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
