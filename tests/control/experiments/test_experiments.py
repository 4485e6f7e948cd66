"""The named experiments: what the thesis saw, for the reasons that it gives, and what differs."""

import numpy as np
import pytest
from experiment_runs import tracked
from places import URDF
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import control
from exo_pin.core.errors import InvalidInput


def test_rest_is_off_zero_because_muscle_1_does_not_stretch():
    tracking = tracked("abduction")
    start = tracking.angles(convention="thesis")[0]
    # Printed: (8.8, -13.4, -8.8). Muscle 1 sets the second angle; the others follow the centre of mass.
    assert start[1] == pytest.approx(-13.4, abs=1.0)
    assert start[0] == pytest.approx(-5.6, abs=0.5)
    assert tracking.run.tensions[0, 0] > 1.0
    assert tracking.ratios[0, 0] == pytest.approx(0.0, abs=0.02)
    assert tracking.wanted_ratios[0, 0] < -0.15
    assert "muscle 1 would have to be 19 % longer" in tracking.findings[0]


def test_abduction_from_beyond_it_falls_short_by_the_stroke():
    tracking = tracked("abduction-outward")
    numbers = tracking.summary()
    # Printed: it slows down at 60° and ends at 75°.
    assert 55.0 < numbers["end_deg"] < 75.0
    # No wanted pose can be held: a dash, not a number.
    assert "rms error reachable, °     -\n" in str(tracking)
    assert any("runs out of stroke" in text for text in tracking.findings)


def test_flexion_stalls_when_muscle_1_is_as_short_as_it_gets():
    tracking = tracked("flexion")
    length = tracking.run.lengths[-1, 0] - 0.126
    # Printed: about 110 mm.
    assert length == pytest.approx(0.110, abs=0.004)
    assert tracking.summary()["end_deg"] < 45.0
    assert tracking.run.pressures[-1, 0] == pytest.approx(4e5, rel=0.01)
    assert any(text.startswith("flexion stands still") for text in tracking.findings)


def test_page_of_plots():
    pytest.importorskip("matplotlib")
    tracking = tracked("held-abduction", "model")
    figure = tracking.plot()
    assert len(figure.axes) == 6
    assert "abduction ends" in figure.get_suptitle().replace("\n", " ")
    figure.draw_without_rendering()
    legends = {ax: ax.get_legend() for ax in figure.axes if ax.get_legend()}
    assert len(legends) == 5
    for legend in legends.values():
        assert not any(legend.get_window_extent().overlaps(ax.get_window_extent()) for ax in figure.axes)


@pytest.mark.full
@pytest.mark.parametrize(
    ("name", "controller"),
    [
        (name, kind)
        for name in ep.experiments()
        # The long tasks with their own controller alone.
        for kind in ([None] if "hand-to-mouth" in name else ["pi", "model"])
    ],
)
def test_every_experiment_runs(name, controller):
    tracking = tracked(name, controller)
    assert tracking.run.status == "completed"
    assert np.abs(tracking.run.energy_residual).max() < 1e-5


def test_the_mounting_of_the_sensor_is_named_with_its_effect():
    tracking = tracked("flexion")
    (known,) = tracking.known
    exo, last, step = ep.load("prototype"), tracking.run.rotations[-1], 0.05
    slopes = []
    for axis in np.radians(step) * np.eye(3):
        ahead, behind = (Rotation.from_rotvec(sign * axis) * last for sign in (1, -1))
        sizes = [float(exo.reaction(pose, limits="none").magnitude) for pose in (ahead, behind)]
        slopes.append((sizes[0] - sizes[1]) / (2.0 * step))
    size = float(exo.reaction(last, limits="none").magnitude)
    assert known.effects["F_s_percent"] == pytest.approx(100.0 * np.linalg.norm(slopes) / size, rel=0.02)
    assert str(tracking).startswith(f"Taken as known: {known}. ")


def test_drives_in_joints_have_names_and_units_of_their_own():
    serial = ep.load(URDF / "serial-y-x-z.urdf")
    reference = control.AnglePath([0.0, 0.2], [[0.1, 0.0, -0.4], [0.3, 0.1, -0.9]], "left")
    tracking = serial.track(reference, "model", duration=0.12)
    columns, numbers = tracking.columns(), tracking.summary()
    assert {"angle_1_rad", "moment_1_N_m", "drive_position_1_rad", "motor_moment_1_N_m"} < set(columns)
    assert not {"length_1_m", "tension_1_N", "motor_force_1_N"} & set(columns)
    assert "peak_tension_N" not in numbers
    assert numbers["peak_drive_moment_N_m"] == pytest.approx(np.abs(tracking.run.tensions).max())
    assert "peak drive moment, N m" in str(tracking)
    assert tracking.findings[0].startswith("the reference needs motor 1 beyond the end of its range from 0.08 s on")
    with pytest.raises(InvalidInput, match="motor 1 would have to be at -52° at the start"):
        serial.track(control.AnglePath([0.0, 1.0], [[0.0, 0.0, -0.9], [0.0, 0.0, 0.0]], "left"))
    full = serial.track(control.flexion(), lambda t, seen: [0.0, 0.0, -1.0], duration=0.02)
    assert full.findings == ("motor 3 is at its limit for 100.0 % of the time",)
    nesm = ep.load(URDF / "nesm.urdf")
    motors = ep.PlantOptions(joint_motor=control.JointMotor(limit=30.0))
    # Two of its joints begin at an end of their ranges.
    assert nesm.track("flexion", duration=0.05, options=motors).findings == ()


def test_the_power_of_a_motor_in_a_joint_is_the_rate_of_its_energy():
    serial = ep.load(URDF / "serial-y-x-z.urdf")
    plant = ep.Plant(serial)
    run = plant.simulate(lambda t, seen: [0.0, 0.0, 0.4], 0.2, plant.state(serial.pose(flexion=20)), sample_rate=1000.0)
    took = np.trapezoid(np.maximum(run.electric_power, 0.0), run.times, axis=0)
    assert run.electric_energy[-1, 2] > 1.0
    np.testing.assert_allclose(took, run.electric_energy[-1], rtol=1e-4, atol=1e-6)


def test_gains_go_to_the_controller_that_suits_the_design():
    gains = control.FeedbackGains(stiffness=20.0)
    tracking = ep.load("four-cables").track("flexion", duration=0.01, feedback=gains)
    assert (tracking.experiment.controller, tracking.experiment.feedback.stiffness) == ("model", 20.0)


def test_a_run_that_goes_on_from_another_has_numbers_of_its_own():
    experiment = ep.experiment("four-cables-abduction").replace(duration=0.2, controller=lambda t, seen: [0.1] * 4)
    plant, start = experiment.plant, experiment.start(experiment.plant)
    whole, first = (plant.simulate(experiment.controller, span, start) for span in (0.2, 0.1))
    runs = [whole, first, plant.simulate(experiment.controller, 0.1, first.state(0.1))]
    whole, first, second = (control.Tracking.of(experiment, run).summary() for run in runs)
    for name in ("tension_work_J", "electric_energy_J"):
        assert first[name] + second[name] == pytest.approx(whole[name], rel=1e-9)
    assert first["mean_power_W"] + second["mean_power_W"] == pytest.approx(2.0 * whole["mean_power_W"], rel=1e-9)
