"""Which criteria are checked and why others are not, starts of a search, and numbers of a workspace by hand."""

from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest
from places import URDF
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.workspace import Criteria, Workspace
from exo_pin.workspace.optimisation.merit import Evaluation
from exo_pin.workspace.optimisation.optimised import reported
from exo_pin.workspace.optimisation.starting_designs import starting_actuator

pytestmark = pytest.mark.usefixtures("plain")


def test_extremes_and_means_of_a_workspace_by_hand():
    """Of forces inside alone, and of offsets the furthest."""
    base = np.array([[0.0, 0.003, 0.004], [0.0, 0.0, 0.001], [0.0, 0.012, 0.005]])
    found = Workspace(
        "mine", "left", Rotation.from_rotvec(0.1 * np.eye(3)), Criteria(),
        MappingProxyType({"stroke": np.array([0.1, 0.2, 0.0]), "forces": np.array([1.0, 2.0, np.nan])}),
        MappingProxyType({}), np.ones((3, 4)), np.array([0.5, 2e-9, 0.5]), np.ones((3, 4)),
        np.array([[30.0, 0.0, 40.0], [0.0, 20.0, 0.0], [900.0, 0.0, 0.0]]), np.ones((3, 3)),
        ep.CentreOffset(base, base[::-1] / 2.0),
    )  # fmt: skip
    assert found.force_inside == {"mean": 35.0, "largest": 50.0}
    assert found.largest_offsets == pytest.approx({"base": 0.013, "cuff": 0.0065})
    assert found.unknown.tolist() == [False, False, True]
    np.testing.assert_array_equal(found.magnitude, [50.0, 20.0, 900.0])
    summary = found.summary()
    assert summary["unknown"] == pytest.approx(1.0 / 3.0)
    assert summary["largest_offsets"] == found.largest_offsets
    assert summary["one_by_one"]["together"].tolist() == pytest.approx([1.0, 2.0 / 3.0])
    for values, text in (([1e-10, 0.5, 0.5], [False, False, True]), ([0.5, 0.5, 5e-10], [False, False, False])):
        again = Workspace(**(vars_of(found) | {"margin": np.array(values)}))
        assert again.unknown.tolist() == text


def test_forces_of_several_persons_are_those_of_the_worst():
    persons, exo = (ep.Wearer(1.6, 55, "female"), ep.Wearer(1.9, 110, "male")), ep.load(URDF / "serial-y-x-z.urdf")
    poses = exo.pose([20.0, 75.0, 40.0], [35.0, 10.0, 70.0])
    both = exo.workspace(poses, Criteria(("forces",), wearers=persons))
    each = [exo.worn_by(person).workspace(poses, ["forces"]) for person in persons]
    np.testing.assert_allclose(both.margins["forces"], np.min([one.margins["forces"] for one in each], axis=0))
    largest = np.argmax([one.magnitude for one in each], axis=0)
    for name in ("shoulder_force", "tensions"):
        values = [getattr(one, name) for one in each]
        np.testing.assert_allclose(getattr(both, name), [values[k][row] for row, k in enumerate(largest)])


def test_a_load_in_the_hand_counts_for_devices_of_any_kind():
    load = ep.Load([3.0, -2.0, -9.0], at=[0.0, 0.0, -0.4])
    for exo in (ep.load(URDF / "serial-y-x-z.urdf"), ep.load("four-linear-actuators")):
        poses = exo.pose([20.0, 55.0], [35.0, 10.0])
        found = exo.workspace(poses, ["forces"], load=load)
        answer = exo.reaction(poses, load=load, split="minimal", constraint_bounds=(0.0, 0.0))
        np.testing.assert_allclose(found.tensions, answer.actuator_forces, atol=1e-6)
        assert np.abs(found.tensions - exo.workspace(poses, ["forces"]).tensions).max() > 0.1


@pytest.mark.parametrize("up", [1.0, -1.0])
def test_a_joint_that_is_straight_along_its_axis_bends_as_one_that_nearly_is(up):
    exo, margins = ep.load("prototype"), []
    for aside in (0.0, 1e-7):
        straight = (0.0, aside, up * np.sqrt(1.0 - aside**2))
        own = exo.replace(limbs=[replace(limb, joint_straight=straight) for limb in exo.limbs])
        margins.append(own.workspace(own.pose([5.0, 50.0], [10.0, 30.0]), ["joint_angles"]).margins["joint_angles"])
    np.testing.assert_allclose(margins[0], margins[1], atol=1e-6)


def test_actuators_of_new_designs():
    assert starting_actuator("linear") == ep.Actuator("linear", 400.0, 400.0)
    assert starting_actuator("linear", 90.0) == ep.Actuator("linear", 90.0, 90.0)
    assert starting_actuator("linear", 90.0, 20.0, travel=0.1) == ep.Actuator("linear", 90.0, 20.0, travel_limit=0.1)
    assert starting_actuator() == ep.Actuator("cable", 400.0)
    assert starting_actuator("cable", 70.0) == ep.Actuator("cable", 70.0)
    muscle = {"family": "pneumatic muscle", "force_law": "best"}
    assert starting_actuator(**muscle) == ep.Actuator(**muscle, supply_pressure=4e5)
    assert starting_actuator(**muscle, supply=6e5) == ep.Actuator(**muscle, supply_pressure=6e5)


def test_which_designs_are_reported():
    def design(index, merit, force):
        return Evaluation(merit, {"index": index, "peak_shoulder_force": force})

    found = [design(0.5, 0.2, 90.0), design(0.7, 0.9, 70.0), design(0.7, 0.8, 80.0), design(0.4, 0.1, 60.0)]
    assert reported(found, ("index",), False) == [2]
    assert reported(found, ("peak_shoulder_force",), False) == [3]
    assert reported(found, ("index", "peak_shoulder_force"), False) == [1, 3]
    # A start goes before a run that is as good.
    assert reported([design(0.5, 0.2, 9.0)] * 2, ("index",), True) == [0]
    unknown = [design(0.0, 0.9, np.nan), design(0.0, 0.8, np.nan)]
    assert reported(unknown, ("index", "peak_shoulder_force"), False) == [1]


def vars_of(found):
    return {name: getattr(found, name) for name in type(found).__dataclass_fields__}
