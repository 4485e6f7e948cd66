"""The presets that a search has found do what the documentation says."""

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.core.errors import SolverFailed
from exo_pin.load_case.ranges_of_motion import RangeOfMotion
from exo_pin.workspace import BodyShape, Criteria, recheck
from exo_pin.workspace.optimisation import lifting_lines

LIMITS = Criteria(least_tension=5.0, largest_shoulder_force=120.0, body=BodyShape.from_height(1.75), least_gap=0.012)


@pytest.fixture(scope="module")
def cables():
    return ep.load("four-cables")


def test_four_cables_work(cables):
    check = recheck(cables.mechanism, cables.reaction, LIMITS, finer_step=6.0)
    assert check.works
    assert check.workspace.index == pytest.approx(0.861, abs=5e-4)
    assert check.finer_index > 0.84
    assert np.nanmax(check.flexion.magnitude) < 82.0
    assert np.nanmax(check.abduction.magnitude) < 49.0
    assert check.flexion.margins["forces"].min() > 21.0
    assert check.abduction.margins["forces"].min() > 15.0
    assert check.pinocchio_poses == 78
    assert check.pinocchio_difference < 1e-9
    assert min(check.persons.values()) > 0.86
    assert min(check.offsets.values()) > 0.87
    # In one region, which holds the pose of the grid nearest to rest.
    np.testing.assert_array_equal(check.workspace.region, check.workspace.inside)
    assert check.workspace.region[check.workspace.nearest_to_rest]
    assert np.nanmax(check.workspace.tensions[check.workspace.inside]) < 152.0


def test_four_cables_hold_flexion_and_abduction_together(cables):
    box = RangeOfMotion("lifting", (0.0, 90.0), (0.0, 60.0), (0.0, 0.0))
    found = cables.workspace(box.poses(10.0), LIMITS)
    assert found.inside.all()
    assert found.magnitude.max() < 82.0


def test_other_shoulder_works_as_well(cables):
    right = cables.mirrored()
    limits = LIMITS.replace(body=BodyShape.from_height(1.75, "right"))
    for poses, line in zip(lifting_lines("right"), lifting_lines("left"), strict=True):
        np.testing.assert_allclose(
            right.workspace(poses, limits).magnitude, cables.workspace(line, LIMITS).magnitude, rtol=1e-6
        )


def test_design_that_does_not_lift_does_not_work(cables):
    weak = cables.replace(
        limbs=[
            ep.Limb("SPS", stroke=limb.stroke, actuator=ep.Actuator("cable", pull_limit=40.0)) for limb in cables.limbs
        ]
    )
    assert not recheck(weak.mechanism, weak.reaction, LIMITS, finer_step=12.0).works
    # Nor does one of which a criterion was not checked.
    assert not recheck(cables.mechanism, cables.reaction, LIMITS.replace(body=None), finer_step=12.0).works


def test_recheck_refuses_what_pinocchio_does_not_confirm(cables):
    heavier = cables.replace(arm=cables.arm + ep.Arm(0.1, [0.0, 0.0, -0.5], np.zeros((3, 3))))
    with pytest.raises(SolverFailed, match="difference"):
        recheck(cables.mechanism, heavier.reaction, LIMITS, finer_step=12.0)
