"""Which criteria are checked and why others are not, starts of a search, and numbers of a workspace by hand."""

from types import MappingProxyType

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import InvalidInput, MissingData
from exo_pin.workspace import CRITERIA, Criteria, Workspace, starting_design

pytestmark = pytest.mark.usefixtures("plain")

ARM = ep.Arm.from_anthropometry(1.75, 75, sex="male")
NO_BODY = "not known: who wears it (worn_by, --person)"


def test_what_is_checked_of_cables_and_why_not_the_others():
    """All that the data allow, in the order of the list; of the others each says what it lacks."""
    worn, bare = ep.load("four-cables-worn").mechanism, ep.load("four-cables").replace(arm=ARM.mirrored()).mechanism
    checked, others = Criteria().chosen(worn, True)
    assert checked == ("stroke", "singularity", "connected", "forces", "clearance")
    assert others["joint_angles"] == "does not apply: no limb has universal joints"
    assert others["shoulder_range"] == "not known: range of motion of the shoulder ([shoulder])"
    assert others["shoulder_force"] == "no limit given (largest_shoulder_force)"
    assert others["elbow"] == "no limit given (least_above_elbow)"
    assert list(others) == [name for name in CRITERIA if name not in checked]
    assert Criteria().chosen(worn, False)[1]["connected"] == "not known: poses on a grid of three angles"
    nobody = Criteria().chosen(bare.replace(arm=ep.Arm(3.0, [0.0, 0.0, -0.3])), True)[1]
    assert nobody["clearance"] == NO_BODY
    some, left = Criteria(names=("forces", "stroke")).chosen(worn, True)
    assert some == ("stroke", "forces")
    assert left["singularity"] == left["clearance"] == "not chosen"
    assert left["joint_angles"] == "does not apply: no limb has universal joints"
    limits = Criteria(largest_shoulder_force=100.0, least_above_elbow=0.0, least_moment_without_limb=0.0)
    assert limits.chosen(worn, False)[0] == (
        "stroke", "singularity", "forces", "shoulder_force", "elbow", "limb_loss", "clearance"
    )  # fmt: skip
    with pytest.raises(MissingData, match="no limb with universal joints"):
        Criteria(names=("joint_angles",)).chosen(worn, True)
    prototype = ep.load("prototype").mechanism
    assert Criteria().chosen(prototype, True)[1]["joint_angles"] == (
        "not known: straight direction of the universal joints (joint_straight)"
    )


def test_an_elbow_below_the_joints_is_said_unless_its_criterion_is_checked():
    exo, woman = ep.load("four-cables"), ep.Wearer(1.525, 51, "female")
    for limits, words in (
        (Criteria(wearers=(woman,)), "joints on the upper arm lie beyond the wearer's elbow"),
        (Criteria(wearers=(woman,), names=("stroke",)), "joints on the upper arm lie beyond the wearer's elbow"),
        (Criteria(wearers=(ep.Wearer(1.87, 111, "male"),)), "no limit given"),
    ):
        assert words in limits.chosen(exo.mechanism, False)[1]["elbow"]
    beyond = Criteria(wearers=(woman,)).chosen(exo.mechanism, False)[1]["elbow"]
    assert beyond.endswith("(least_above_elbow)")
    assert "elbow" in Criteria(wearers=(woman,), least_above_elbow=0.0).chosen(exo.mechanism, False)[0]


def test_criteria_of_a_grid_are_left_out_of_other_poses():
    assert Criteria(names=("connected", "forces")).off_grid().names == ("forces",)
    every = Criteria(least_gap=0.01)
    assert every.off_grid() is every
    assert Criteria.of(every) is every
    assert Criteria.of(None).names is None
    assert Criteria.of(iter(["forces"])).names == ("forces",)
    for wrong in ("stroke", 3):
        with pytest.raises(InvalidInput, match="names to be a sequence of criteria"):
            Criteria(names=wrong)


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_start_carries_the_moving_part_of_a_device(side):
    """The device of the same side, whatever its own; its arm is that of the person who is asked."""
    cable = ep.Actuator("cable", pull_limit=400.0)
    device = ep.load("four-linear-actuators-worn").mechanism
    made = starting_design(cable, ARM, 4, side, device=device)
    moved = device.arm.mass - device.arm.person.mass
    assert moved > 0.1
    assert made.side == side
    assert made.arm.mass == pytest.approx(ARM.mass + moved)
    assert starting_design(cable, ARM, 4, side).arm.mass == ARM.mass
    for other in (device.replace(arm=None), device.replace(arm=ARM)):
        with pytest.raises(InvalidInput, match="has no moving part"):
            starting_design(cable, ARM, 4, side, device=other)


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


def vars_of(found):
    return {name: getattr(found, name) for name in type(found).__dataclass_fields__}
