"""Everything uncertain at once: spreads with a known answer, and forces of single draws asked again."""

from dataclasses import replace

import numpy as np
import pytest
from places import URDF

import exo_pin as ep

#: All that is uncertain of the design below, taken as certain.
CERTAIN = {"offset_mm": 0, "pose_deg": 0, "A_mm": 0, "B_mm": 0, "mass_percent": 0, "centre_of_mass_mm": 0}


@pytest.fixture(scope="module")
def exo():
    return ep.load("four-linear-actuators-worn")


def test_weight_alone_spreads_the_force_as_itself(exo):
    found = exo.total_uncertainty(exo.pose(60, 30), uncertainties=CERTAIN | {"mass_percent": 5}, draws=200)
    assert found.magnitude == pytest.approx(float(exo.reaction(exo.pose(60, 30)).magnitude))
    share = found.shoulder_forces / found.magnitude - 1.0
    assert np.abs(share).max() <= 0.05 + 1e-9
    assert share.std() == pytest.approx(0.05 / np.sqrt(3.0), rel=0.1)
    low, middle, high = found.quantiles["F_s_N"]
    assert [low, middle, high] == pytest.approx(found.magnitude * np.array([0.955, 1.0, 1.045]), rel=0.01)
    (only,) = found.explained
    assert only.name == "mass_percent"
    assert only.of_F_s == pytest.approx(1.0, abs=0.25)
    assert np.isnan(only.of_joint)
    assert [line.split()[-1] for line in str(found).splitlines() if "mass_percent ±5" in line] == ["-"]
    assert np.isnan(found.joint_forces).all()
    assert found.held.all()


def test_draws_fill_a_ball_evenly_and_those_that_are_not_held_are_counted():
    """Three limbs: a linear |F_s| spreads by R |gradient| / sqrt(5), and with the arm's mass tensions grow alike."""
    exo = ep.load("prototype").worn_by(ep.Wearer(1.755, 85, "male"))
    pose, steps = exo.pose(60, 30), 1e-4 * np.concatenate([np.eye(3), -np.eye(3)])
    f, certain = exo.reaction(pose).actuator_forces, dict.fromkeys([*CERTAIN, "lean_deg"], 0)
    sizes = exo.reaction(exo.pose([60] * 6, 30), centre_offset=steps).magnitude
    limit = ep.Actuator("linear", pull_limit=float(f.max()), push_limit=1e4)
    exo = exo.replace(limbs=[replace(limb, actuator=limit, stroke=None) for limb in exo.limbs])
    found = exo.total_uncertainty(pose, uncertainties=certain | {"offset_mm": 0.1}, draws=100)
    slope = np.linalg.norm(sizes[:3] - sizes[3:]) / 2.0
    assert found.shoulder_forces.std() == pytest.approx(slope / np.sqrt(5.0), rel=0.1)
    assert 0.8 * slope < np.abs(found.shoulder_forces - found.magnitude).max() <= 1.01 * slope
    found = exo.total_uncertainty(pose, uncertainties=certain | {"mass_percent": 5}, draws=40)
    assert found.held.tolist() == (found.shoulder_forces <= found.magnitude).tolist()
    assert f"does not hold the arm in {(~found.held).sum()} of 40." in str(found)


def test_the_centre_dominates_and_stays_within_the_worst_offset(exo):
    pose = exo.pose(60, 30)
    found = exo.total_uncertainty(pose, uncertainties=CERTAIN | {"offset_mm": 15, "mass_percent": 1}, draws=100)
    worst = exo.uncertainty(pose, uncertainties=CERTAIN | {"offset_mm": 15}).effects[0]
    assert [each.name for each in found.explained] == ["offset_mm", "mass_percent"]
    assert worst.least * 0.99 <= found.shoulder_forces.min()
    assert found.shoulder_forces.max() <= worst.greatest * 1.01
    assert found.shoulder_forces.max() - found.shoulder_forces.min() > 0.5 * (worst.greatest - worst.least)


@pytest.mark.parametrize("name", ["four-linear-actuators-worn", pytest.param("serial", marks=pytest.mark.full)])
def test_a_right_arm_spreads_as_the_left_one(name):
    """Also what has no effect explains the same: nothing."""
    left = ep.load(URDF / "serial-y-x-z.urdf") if name == "serial" else ep.load(name)
    left = left.worn_by(ep.Wearer(1.755, 85, "male"))
    stated = {"offset_mm": 0} if name == "serial" else {"offset_mm": 10}
    one, other = (
        each.total_uncertainty(each.pose(60, 30), uncertainties=stated, draws=8) for each in (left, left.mirrored())
    )
    np.testing.assert_allclose(other.shoulder_forces, one.shoulder_forces, rtol=1e-6)
    shares = [{each.name: each.of_F_s for each in found.explained} for found in (one, other)]
    assert shares[1] == pytest.approx(shares[0], rel=1e-5, abs=1e-9)
