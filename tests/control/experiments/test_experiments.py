"""The named experiments: what the thesis saw, for the reasons that it gives, and what differs."""

import json

import numpy as np
import pytest
from experiment_runs import tracked
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import InvalidInput, MissingData, UnknownName
from exo_pin.control import (
    Experiment,
    Imu,
    flexion,
    missing_moments,
)
from exo_pin.control.experiments.tracking_report import greatest_ratios, out_of_stroke
from exo_pin.load_case import Load
from exo_pin.muscle import muscle_model


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


def test_abduction_fails_on_the_wrong_side_of_the_singular_pose():
    tracking, exo = tracked("abduction"), ep.load("prototype")
    assert tracking.summary()["furthest_deg"] < 0.0
    sides = np.sign(exo.singularity(tracking.run.rotations).determinant)
    assert set(sides) == {-1.0}
    beyond = exo.singularity(tracked("abduction-outward").run.rotations).determinant
    assert beyond[0] > 0.0


def test_abduction_from_beyond_it_falls_short_by_the_stroke():
    tracking = tracked("abduction-outward")
    numbers = tracking.summary()
    # Printed: it slows down at 60° and ends at 75°.
    assert 55.0 < numbers["end_deg"] < 75.0
    times = out_of_stroke(tracking)
    assert np.isnan(times[0])
    # No wanted pose can be held: a dash, not a number.
    assert "rms error reachable, °     -\n" in str(tracking)
    assert 2.0 < times[2] < 3.0
    # At the end the limbs 2 and 3 are wanted far beyond what their muscles can do.
    assert (tracking.wanted_ratios[-1, 1:] > greatest_ratios(tracking)[1:] + 0.15).all()
    assert any("runs out of stroke" in text for text in tracking.findings)


def test_flexion_stalls_when_muscle_1_is_as_short_as_it_gets():
    tracking = tracked("flexion")
    length = tracking.run.lengths[-1, 0] - 0.126
    # Printed: about 110 mm.
    assert length == pytest.approx(0.110, abs=0.004)
    assert tracking.summary()["end_deg"] < 45.0
    assert tracking.run.pressures[-1, 0] == pytest.approx(4e5, rel=0.01)
    assert any(text.startswith("flexion stands still") for text in tracking.findings)


@pytest.mark.full
@pytest.mark.parametrize(("name", "gain"), [("held-abduction", 5.0), ("held-abduction-four-long", 5.0)])
def test_model_controller_tracks_better_on_the_reachable_part(name, gain):
    pi, model = (tracked(name, controller) for controller in ("pi", "model"))
    assert pi.reachable.mean() > 0.4
    assert np.array_equal(pi.reachable, model.reachable)
    assert np.degrees(model.rms_error(model.reachable)) < 3.0
    assert pi.rms_error(pi.reachable) > gain * model.rms_error(model.reachable)


@pytest.mark.full
def test_shoulder_force_is_that_of_the_reaction_query_for_the_same_motion():
    tracking = tracked("held-abduction", "model")
    run, rows = tracking.run, slice(20, None, 60)
    given = run.load()
    answer = ep.ShoulderExo.from_mechanism(tracking.experiment.mechanism).reaction(
        run.rotations[rows],
        ep.Motion(run.angular_velocity[rows], run.angular_acceleration[rows]),
        Load(np.asarray(given.force)[rows], np.asarray(given.moment)[rows], given.at),
    )
    np.testing.assert_allclose(answer.actuator_forces, run.tensions[rows], atol=1e-6)
    np.testing.assert_allclose(answer.shoulder_force, tracking.shoulder_force[rows], atol=1e-6)


@pytest.mark.full
@pytest.mark.parametrize(
    ("name", "controller"),
    [
        ("held-abduction-burst", "pi"),
        pytest.param("held-abduction-lost-imu", "model", marks=pytest.mark.full),
        pytest.param("held-abduction-stuck-valve", "model", marks=pytest.mark.full),
        pytest.param("held-abduction-lost-imu", "pi", marks=pytest.mark.full),
        pytest.param("held-abduction-burst", "model", marks=pytest.mark.full),
        pytest.param("held-abduction-stuck-valve", "pi", marks=pytest.mark.full),
    ],
)  # fmt: skip
def test_faults_do_not_stop_the_simulation(name, controller):
    tracking = tracked(name, controller)
    assert tracking.run.status == "completed"
    numbers = tracking.summary()
    assert all(np.isfinite(value) for value in numbers.values())
    assert 5.0 < numbers["peak_F_s_N"] < 200.0
    healthy = tracked("held-abduction", controller).summary()
    if name.endswith("burst"):
        assert numbers["end_deg"] < healthy["end_deg"] - 20.0
        # What is left is the weight of the arm.
        weight = 9.81 * tracking.experiment.mechanism.arm.mass
        assert np.linalg.norm(tracking.shoulder_force[-1]) < 2.0 * weight
    if name.endswith("imu"):
        assert "sensor is lost from 3 to 4 s" in tracking.findings[-1]


def test_verdict_table_and_file(tmp_path):
    tracking = tracked("held-abduction", "model")
    text = str(tracking)
    assert text.startswith(tracking.verdict)
    assert "abduction ends at 56° of 55°" in text
    path = tmp_path / "run.csv"
    tracking.to_csv(path)
    lines = path.read_text().splitlines()
    assert json.loads(path.with_suffix(".json").read_text())["verdict"] == tracking.verdict
    table = lines
    assert table[0].split(",")[:3] == ["time_s", "wanted_flexion_deg", "wanted_abduction_deg"]
    assert len(table) == 1 + len(tracking.times)
    values = dict(zip(table[0].split(","), table[-1].split(","), strict=True))
    assert float(values["tension_3_N"]) == pytest.approx(tracking.run.tensions[-1, 2], rel=1e-8)
    assert float(values["F_s_N"]) == pytest.approx(np.linalg.norm(tracking.shoulder_force[-1]), rel=1e-8)


def test_page_of_plots_and_animation(tmp_path):
    pytest.importorskip("matplotlib")
    from exo_pin.view import Scene
    from exo_pin.view.scene.scene_recording import record_run

    tracking = tracked("held-abduction", "model")
    figure = tracking.plot()
    assert len(figure.axes) == 6
    assert "abduction ends" in figure.get_suptitle().replace("\n", " ")
    figure.draw_without_rendering()
    legends = {ax: ax.get_legend() for ax in figure.axes if ax.get_legend()}
    assert len(legends) == 5
    for legend in legends.values():
        assert not any(legend.get_window_extent().overlaps(ax.get_window_extent()) for ax in figure.axes)
    exo = ep.ShoulderExo.from_mechanism(tracking.experiment.mechanism)
    recording = record_run(Scene(exo, human=False), tracking.run, 5.0)
    assert len(recording.times) == 31
    path = tmp_path / "run.html"
    recording.save(path)
    assert path.stat().st_size > 100_000


def test_an_animation_of_four_muscles_has_the_tensions_of_the_run(monkeypatch):
    from exo_pin.view import Scene
    from exo_pin.view.scene.scene_recording import record_run

    shown = []
    plan = Scene._plan
    monkeypatch.setattr(Scene, "_plan", lambda self, forces: (shown.append(forces), plan(self, forces))[1])
    study = ep.experiment("held-abduction-four-long", "model").replace(duration=2.0)
    run = study.run().run
    scene = Scene(ep.ShoulderExo.from_mechanism(study.mechanism), human=False)
    recording = record_run(scene, run, 3.0)
    rows = np.searchsorted(run.times, recording.times)
    np.testing.assert_array_equal(run.times[rows], recording.times)
    assert len(rows) == 7
    shown = [frame.forces for frame in shown[-1]]
    tensions = np.array([forces.tensions for forces in shown])
    np.testing.assert_allclose(tensions, run.tensions[rows], atol=1e-6)
    np.testing.assert_allclose([f.shoulder for f in shown], run.shoulder_force[rows], atol=1e-6)
    with pytest.raises(InvalidInput, match="two samples"):
        record_run(scene, study.replace(duration=1e-10).run().run)


def test_a_function_of_ones_own_is_a_controller():
    exo, asked = ep.load("prototype"), []

    def hold_one_bar(t, measurement):
        asked.append(t)
        return (1e5 - measurement.pressures) / 2e4

    tracking = exo.track("flexion", hold_one_bar, duration=1.0, title="one bar in every muscle")
    assert ". one bar in every muscle: " in tracking.verdict
    assert len(asked) == 100
    np.testing.assert_allclose(tracking.run.pressures[-1], 1e5, rtol=0.1)


def test_track_is_the_experiment():
    exo = ep.load("prototype")
    direct = exo.track("flexion", duration=1.0)
    named = ep.experiment("flexion").replace(duration=1.0).run()
    np.testing.assert_array_equal(direct.run.rotations.as_quat(), named.run.rotations.as_quat())
    again = ep.experiment("flexion").replace(duration=1.0, imu=Imu(noise=0.002, seed=3)).run()
    other = ep.experiment("flexion").replace(duration=1.0, imu=Imu(noise=0.002, seed=3)).run()
    np.testing.assert_array_equal(again.run.pressures, other.run.pressures)
    assert not np.array_equal(again.run.pressures, direct.run.pressures)


def test_held_poses_are_those_that_statics_allows():
    tracking = tracked("held-abduction", "model")
    plant, exo = tracking.run.plant, ep.ShoulderExo.from_mechanism(tracking.experiment.mechanism)
    poses = tracking.wanted[::50]
    missing = missing_moments(plant, poses)
    # Where no muscle is stretched and statics asks of each a pull that it has, nothing is missing.
    forces, ratios = exo.reaction(poses).actuator_forces, tracking.wanted_ratios[::50]
    laws = [muscle_model("tang-optimised", nominal) for nominal in (0.15, 0.25, 0.25)]
    pulls = np.stack([law.unchecked_force(law.length * r, 4e5) for law, r in zip(laws, ratios.T, strict=True)], axis=1)
    fine = ((ratios > 0.0) & (forces > 0.0) & (forces < pulls)).all(axis=1)
    assert fine.sum() > 2
    assert (missing[fine] < 1e-9).all()
    assert (missing[(forces < -0.5).any(axis=1)] > 1e-4).all()


def test_bad_input_is_refused():
    exo = ep.load("prototype")
    with pytest.raises(UnknownName, match="abduction"):
        ep.experiment("abductoin")
    with pytest.raises(UnknownName):
        ep.experiment("abduction", "pid")
    with pytest.raises(UnknownName):
        ep.experiment("abduction").replace(second_flang=True)
    with pytest.raises(InvalidInput):
        exo.track(3.0)
    with pytest.raises(InvalidInput):
        exo.track("flexion", feedback=ep.control.FeedbackGains())
    with pytest.raises(MissingData):
        ep.load("appendix-d").track(flexion())
    with pytest.raises(InvalidInput):
        Experiment("x", "x", exo, flexion(), options=ep.PlantOptions())


def test_every_experiment_is_made():
    names = ep.experiments()
    assert len(set(names)) == len(names) >= 19
    for name in names:
        made = ep.experiment(name)
        assert made.name == name
        assert made.title
        assert made.source


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
