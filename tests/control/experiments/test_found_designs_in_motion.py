"""The designs of the search in motion: the work of lifting, and the forces of the workspace search."""

import numpy as np
import pytest
from experiment_runs import tracked

import exo_pin as ep

MOTORS = ["four-cables", "four-linear-actuators", "three-linear-actuators"]


@pytest.mark.full
@pytest.mark.parametrize(
    ("design", "movement"),
    [
        ("four-cables", "abduction"),
        *((design, "flexion") for design in MOTORS),
        *(pytest.param(design, "abduction", marks=pytest.mark.full) for design in MOTORS if design != "four-cables"),
    ],
)
def test_motor_drives_carry_a_man_s_arm_through_ninety_degrees(design, movement):
    tracking = tracked(f"{design}-{movement}")
    numbers = tracking.summary()
    assert tracking.run.status == "completed"
    assert tracking.reachable.all()
    assert numbers["rms_error_deg"] < 0.5
    assert numbers["end_deg"] == pytest.approx(90.0, abs=1.0)
    assert tracking.findings == () or all("stroke" in text for text in tracking.findings)
    # The work of lifting is m g h of the centre of mass, and the motors take several times that.
    arm = tracking.experiment.mechanism.arm
    lifted = tracking.run.rotations[-1].apply(np.array(arm.centre_of_mass))[2] - arm.centre_of_mass[2]
    assert numbers["tension_work_J"] == pytest.approx(arm.mass * 9.81 * lifted, abs=0.2)
    assert 2.0 * numbers["tension_work_J"] < numbers["electric_energy_J"] < 5.0 * numbers["tension_work_J"]


@pytest.mark.parametrize("design", MOTORS)
@pytest.mark.full
def test_the_shoulder_force_on_the_way_is_near_that_of_the_workspace_search(design):
    """A slow motion asks little more of the shoulder than holding the same poses with the same least tension."""
    tracking = tracked(f"{design}-flexion")
    force = np.linalg.norm(tracking.shoulder_force, axis=1)
    limits = ep.Criteria(least_tension=5.0) if design == "four-cables" else ep.Criteria()
    holding = ep.load(design).workspace(tracking.wanted[::20], limits).magnitude
    assert np.abs(force[::20] - holding).max() < 12.0
