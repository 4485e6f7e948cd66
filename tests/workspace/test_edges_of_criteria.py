"""Margins and limits at their edges, the sign at rest, and what a check of a design says, of numbers that are given."""

from types import SimpleNamespace

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import InvalidInput, UnknownName
from exo_pin.workspace import CRITERIA, Criteria, limb_loss
from exo_pin.workspace import criterion as needs

NAN = np.nan
LIMITS = Criteria(
    least_margin=0.1, least_moment=2.0, largest_shoulder_force=50.0, largest_pull_out=30.0, largest_cuff_pull=20.0,
    largest_cuff_slip=0.01, least_moment_without_limb=1.5, least_gap=0.004,
)  # fmt: skip


@pytest.mark.parametrize(
    ("name", "values", "expected"),
    [
        ("joint_angles", {"bend": [0.2, -0.1]}, [0.2, -0.1]),
        ("singularity", {"margin": [0.5, -0.05]}, [0.4, -0.15]),
        ("connected", {"connection": lambda: np.array([0.3, -np.inf])}, [0.2, -np.inf]),
        ("forces", {"moment": [5.0, 1.0, NAN]}, [3.0, -1.0, NAN]),
        ("shoulder_force", {"shoulder": [[30.0, 0.0, 40.0], [0.0, 60.0, 0.0], [NAN] * 3]}, [0.0, -10.0, NAN]),
        ("socket", {"pull_out": [-100.0, 40.0]}, [130.0, -10.0]),
        ("cuff_pull", {"cuff_pull": [5.0, 25.0]}, [15.0, -5.0]),
        ("cuff_slip", {"cuff_slip": [0.002, 0.02]}, [0.008, -0.01]),
        ("limb_loss", {"moment_without_limb": [4.0, 1.0]}, [2.5, -0.5]),
        ("clearance", {"gaps": [[0.01, 0.02, 0.03], [0.5, 0.001, 0.2], [0.5, 0.4, 0.0]]}, [0.006, -0.003, -0.004]),
        ("shoulder_range", {"shoulder_range": lambda: np.array([0.3])}, [0.3]),
    ],
)
def test_margins_by_hand(name, values, expected):
    at = {key: np.array(value) if isinstance(value, list) else value for key, value in values.items()}
    found = CRITERIA[name].margin(SimpleNamespace(criteria=LIMITS, **at))
    np.testing.assert_allclose(found, expected, atol=1e-15)


def test_limits_at_their_edges():
    edge = Criteria(elbow_range=(-0.3, 2.8), least_margin=0.0, least_moment=0.0, largest_pull_out=0.0, least_gap=-0.01)
    assert edge.elbow_range == (-0.3, 2.8)
    for change in (
        {"elbow_range": (-0.31, 1.0)}, {"elbow_range": (0.0, 2.81)}, {"elbow_range": (1.0, 0.5)},
        {"least_margin": -0.1},
        {"least_tension": -1.0}, {"least_moment": NAN}, {"largest_shoulder_force": 0.0}, {"limb_radius": 0.0},
        {"largest_cuff_pull": -1.0}, {"largest_cuff_slip": 0.0}, {"largest_pull_out": -1.0}, {"least_gap": np.inf},
        {"least_above_elbow": -0.01}, {"least_moment_without_limb": -1.0}, {"names": "stroke"}, {"names": 3},
        {"wearers": ("a",)}, {"body": 1}, {"socket": 2},
    ):  # fmt: skip
        with pytest.raises(InvalidInput):
            Criteria(**change)
    with pytest.raises(UnknownName):
        Criteria(names=("stroke", "size"))
    with pytest.raises(UnknownName):
        Criteria(stroke_rule="all")
    plain = Criteria()
    assert (plain.least_margin, plain.least_tension, plain.least_moment, plain.least_gap) == (0.05, 0.0, 0.0, 0.0)


def diamond(half, centre):
    return SimpleNamespace(half_diagonal=half, abduction_centre=centre)


def record(**fields):
    """A mechanism that has no more than what is asked for."""
    plain = {"limbs": (), "arm": None, "shoulder": diamond(None, None), "accelerate": lambda question: fields}
    return SimpleNamespace(**(plain | fields))


@pytest.mark.parametrize(
    ("need", "mechanism", "criteria", "lacking"),
    [
        ("shoulder", {}, {}, ["range of motion of the shoulder ([shoulder])"]),
        ("shoulder", {"shoulder": diamond(1.0, None)}, {}, ["range of motion of the shoulder ([shoulder])"]),
        ("shoulder", {"shoulder": diamond(None, 0.5)}, {}, ["range of motion of the shoulder ([shoulder])"]),
        ("shoulder", {"shoulder": diamond(1.0, 0.5)}, {}, []),
        ("joints", {"limbs": [SimpleNamespace(kind="SPS")]}, {}, ["no limb has universal joints"]),
        ("joints", {"limbs": [SimpleNamespace(kind="UPU", joint_limit=None, joint_straight=None)]}, {}, [
            "range of the universal joints (joint_limit)",
            "straight direction of the universal joints (joint_straight)"]),
        ("joints", {"limbs": [SimpleNamespace(kind="UPU", joint_limit=1.0, joint_straight=(0, 0, 1))]}, {}, []),
        ("strokes", {"limbs": [SimpleNamespace(length_range=(0.1, 0.2))]}, {}, []),
        ("strokes", {"limbs": [SimpleNamespace(length_range=(0.1, NAN))]}, {}, ["stroke or end fitting of limbs"]),
        ("socket", {}, {"socket": None}, ["where the socket faces (socket, --person)"]),
        ("socket", {}, {"socket": SimpleNamespace(orientation=None)}, ["where the socket faces (socket, --person)"]),
        ("socket", {}, {"socket": SimpleNamespace(orientation=1)}, []),
        ("own_arm", {}, {"wearers": ()}, ["a person's arm"]),
        ("own_arm", {"arm": SimpleNamespace(person=None)}, {"wearers": ()}, ["a person's arm"]),
        ("own_arm", {"arm": SimpleNamespace(person=1)}, {"wearers": ()}, []),
        ("own_arm", {}, {"wearers": (1,)}, []),
        ("cuff", {"interfaces": SimpleNamespace(cuff=None)}, {}, ["stiffness of the cuff (interfaces)"]),
        ("cuff", {"interfaces": SimpleNamespace(cuff=1)}, {}, []),
        ("limbs", {}, {}, []),
        ("wearers", {}, {"wearers_of": lambda _: ()}, ["who wears it (worn_by, --person)"]),
        ("wearers", {}, {"wearers_of": lambda _: (1,)}, []),
    ],
)  # fmt: skip
def test_what_criteria_lack(need, mechanism, criteria, lacking):
    assert getattr(needs, need)(record(**mechanism), SimpleNamespace(**criteria), True) == lacking
    assert needs.grid(None, None, True) == []
    assert needs.grid(None, None, False) == ["poses on a grid of three angles"]


def test_limbs_of_a_loss_count_from_one_and_force_is_that_of_the_held():
    exo = ep.load("four-linear-actuators")
    grid = exo.workspace(30.0, ["forces", "stroke"])
    found = exo.workspace(grid.poses[grid.inside], ["forces"])
    table = limb_loss(exo.mechanism, found)
    assert table["limb"].tolist() == [1, 2, 3, 4]
    for row, lost in enumerate(range(4)):
        low = np.where(np.arange(4) == lost, 0.0, -np.array([limb.actuator.push_limit for limb in exo.limbs]))
        high = np.where(np.arange(4) == lost, 0.0, [limb.actuator.pull_limit for limb in exo.limbs])
        answer = exo.reaction(found.poses, split="minimal", limits=(low, high), constraint_bounds=(0.0, 0.0))
        assert table["held"][row] == pytest.approx(np.mean(answer.held))
        force = answer.magnitude[answer.held]
        np.testing.assert_allclose(table["shoulder_force_N"][row], force.max() if force.size else NAN, rtol=1e-6)
    # What is missing as a share of the moment of the arm's weight, pose by pose.
    arm = exo.mechanism.arm
    weight = np.linalg.norm(
        np.cross(found.poses.as_matrix() @ arm.centre_of_mass, arm.mass * exo.mechanism.gravity), axis=1
    )
    assert (table["missing_share"] * weight.min() <= table["missing_Nm"] + 1e-9).all()
    assert (table["missing_share"] * weight.max() >= table["missing_Nm"] - 1e-9).all()
    assert table["missing_Nm"].max() > 0.0
