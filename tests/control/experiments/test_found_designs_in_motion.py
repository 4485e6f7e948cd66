"""The designs of the search in motion: named experiments, tracking without options, faults, what a run writes."""

import csv
import json

import numpy as np
import pytest
from command_line import run
from experiment_runs import tracked

import exo_pin as ep
from exo_pin import InvalidInput, control

MOTORS = ["four-cables", "four-linear-actuators", "three-linear-actuators"]
FOUND_DESIGNS = [*MOTORS, "four-muscle-cables"]


def test_every_design_has_an_experiment_for_every_movement():
    assert set(FOUND_DESIGNS) < set(ep.presets())
    for design in FOUND_DESIGNS:
        for movement in ("abduction", "flexion", "hand-to-mouth"):
            assert ep.experiment(f"{design}-{movement}").mechanism.name == design


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


def test_forces_along_a_run_of_four_cables_are_the_reaction_query_s():
    tracking = tracked("four-cables-abduction")
    answer = tracking.run.reaction()
    np.testing.assert_allclose(answer.actuator_forces, tracking.run.tensions, atol=1e-9)
    np.testing.assert_allclose(answer.shoulder_force, tracking.shoulder_force, atol=1e-7)


@pytest.mark.full
def test_muscles_over_tackles_carry_it_too_when_air_comes_ahead():
    tracking = tracked("four-muscle-cables-abduction")
    numbers = tracking.summary()
    assert numbers["rms_error_deg"] < 4.0
    assert numbers["end_deg"] == pytest.approx(90.0, abs=3.0)
    late = tracking.experiment.replace(feedback=control.FeedbackGains(stiffness=12.0, damping=1.2)).run()
    assert late.rms_error() > 3.0 * tracking.rms_error()
    assert "electric_energy_J" not in numbers
    assert numbers["air_energy_J"] > 20.0 * numbers["tension_work_J"]


@pytest.mark.parametrize("design", FOUND_DESIGNS)
@pytest.mark.parametrize("controller", ["pi", "model"])
def test_tracking_needs_no_option(design, controller):
    tracking = ep.load(design).track("flexion", controller, duration=0.3)
    assert tracking.run.status == "completed"
    # The first test of Section 5.4.1 starts with a jump of the speed.
    assert np.degrees(tracking.error.max()) < 15.0
    assert "|F_s| up to" in tracking.verdict


@pytest.mark.full
def test_the_page_of_plots_and_the_table_show_motors(tmp_path, capsys):
    table, picture, page = (tmp_path / name for name in ("run.csv", "run.png", "run.html"))
    asked = ("track", "--experiment", "four-cables-flexion", "--no-progress")
    assert run(capsys, *asked, "--out", str(table), "--plot", str(picture))[0] == 0
    assert run(capsys, *asked, "--plot", str(page))[0] == 0
    with table.open() as handle:
        rows = list(csv.DictReader(line for line in handle if not line.startswith("#")))
    assert {"drive_position_4_m", "motor_force_1_N", "electric_power_2_W", "energy_in_J"} <= set(rows[0])
    assert "pressure_1_Pa" not in rows[0]
    tracking = tracked("four-cables-flexion")
    assert float(rows[-1]["F_s_N"]) == pytest.approx(np.linalg.norm(tracking.shoulder_force[-1]), rel=1e-6)
    assert picture.stat().st_size > 50_000
    assert page.stat().st_size > 500_000
    axes = tracking.plot().axes
    assert "motor force" in axes[3].get_ylabel()


@pytest.mark.full
def test_a_movement_of_the_thesis_on_another_design(capsys):
    arguments = ["four-linear-actuators", "--controller", "model", "--json", "--no-progress"]
    status, out, _ = run(capsys, "track", *arguments)
    assert status == 0
    data = json.loads(out)
    assert "abduction, four-linear-actuators: abduction ends at 90° of 90°" in data["verdict"]
    assert data["numbers"]["peak_push_N"] > 5.0
    assert data["numbers"]["electric_energy_J"] > 10.0


@pytest.mark.full
def test_faults_are_reported_with_the_shoulder_force_that_is_reached(capsys):
    whole, torn = tracked("four-cables-abduction"), tracked("four-cables-torn")
    assert torn.run.status == "completed"
    assert np.diff(torn.times).max() < 1.1e-3
    assert torn.summary()["peak_F_s_N"] > 3.0 * whole.summary()["peak_F_s_N"]
    said = next(text for text in torn.findings if "torn" in text)
    assert f"|F_s| reaches {torn.summary()['peak_F_s_N']:.0f} N" in said
    braked, slipping = tracked("four-cables-no-current"), tracked("four-cables-slipping-brake")
    # A brake that holds keeps the arm higher than one that slips, and neither lets it drop as a broken cable does.
    lowest = [t.angles()[t.times >= 3.5, 1].min() for t in (torn, slipping, braked)]
    assert lowest == sorted(lowest)
    assert max(t.summary()["peak_F_s_N"] for t in (braked, slipping)) < 60.0
    arguments = ["--experiment", "four-cables-flexion", "--fault", "no-current,2,1", "--no-progress"]
    status, out, _ = run(capsys, "track", *arguments)
    assert status == 0
    assert "cable 2: no current from 1 s on" in out
    figure = torn.plot()
    assert "dotted: limb 1, torn from 2.5 s on" in figure.get_supxlabel()
    for ax in figure.axes:
        assert [2.5, 2.5] in [list(line.get_xdata()) for line in ax.lines]


@pytest.mark.parametrize("design", ["four-cables", "three-linear-actuators"])
@pytest.mark.full
def test_an_animation_has_the_forces_of_the_run(design):
    from exo_pin.view import Scene
    from exo_pin.view.scene.scene_recording import record_run

    tracking = tracked(f"{design}-abduction")
    made = tracking.run
    scene = Scene(ep.ShoulderExo.from_mechanism(tracking.experiment.mechanism), human=False)
    recording = record_run(scene, made, 3.0)
    rows = np.searchsorted(made.times, recording.times)
    np.testing.assert_array_equal(made.times[rows], recording.times)
    np.testing.assert_allclose(recording.reaction.actuator_forces, made.tensions[rows], atol=1e-6)
    np.testing.assert_allclose(recording.reaction.shoulder_force, made.shoulder_force[rows], atol=1e-6)


def test_a_start_beyond_a_stroke_is_refused():
    exo = ep.load("four-linear-actuators")
    far = control.Turn(ep.shoulder_rotation(-60.0, 0.0, 80.0, degrees=True), [0.0, 0.0, 0.1], duration=1.0)
    with pytest.raises(InvalidInput, match=r"limb \d would have to be \d+ mm long"):
        exo.track(far)


def test_poses_beyond_a_stroke_are_marked():
    exo = ep.load("four-linear-actuators")
    path = control.AnglePath([0.0, 1.0], np.radians([[0.0, 0.0, 0.0], [-60.0, 0.0, 80.0]]))
    tracking = exo.track(path, "model")
    assert tracking.reachable[0]
    assert not tracking.reachable.all()
    assert any("stroke" in text or "longer" in text or "shorter" in text for text in tracking.findings)


def test_limbs_through_the_wearer_are_in_the_verdict(tmp_path):
    """The joints of four-cables on the arm lie at the elbow: bent, the forearm is in their way."""
    run = "time_s,flexion_deg,abduction_deg,internal_rotation_deg\n"
    run += "".join(f"{t},{20 * t},20,0\n" for t in (0.0, 0.5, 1.0, 1.5, 2.0))
    (tmp_path / "lift.csv").write_text(run)
    verdicts = []
    for bend in (0.0, 2.2):
        exo = ep.load("four-cables").worn_by(ep.Wearer(1.75, 75, "male", elbow_flexion=bend))
        reference = control.reference_of(tmp_path / "lift.csv", exo.side)
        options = control.options_for(exo.mechanism)
        verdicts.append(control.Experiment("lift", "lift", exo.mechanism, reference, options=options).run().verdict)
    assert "pass through" not in verdicts[0]
    assert "limbs pass through the wearer's arm" in verdicts[1]
