"""Figures of tasks, runs and searches: curves and cells are the samples of what is drawn."""

import matplotlib

matplotlib.use("agg")

from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.colors import to_hex

import exo_pin as ep
from exo_pin.view.plots import day_figure, elbow_paths_figure, task_status_figure
from exo_pin.view.plots.angle_maps import front_figure
from exo_pin.view.plots.contact_plots import elevation_in_plane, relief_scale
from exo_pin.view.plots.muscle_plots import plot_loop
from exo_pin.view.plots.plot_style import scale_top, wrapped
from exo_pin.workspace import CRITERIA


def test_tasks_are_steps_one_below_the_other():
    inside = {"mouth": [1, 1, 0, 1], "hair": [0, 1, 0, 0]}
    (ax,) = task_status_figure(inside).axes
    for k, (line, values) in enumerate(zip(ax.get_lines(), inside.values(), strict=True)):
        np.testing.assert_allclose(line.get_ydata(), np.array(values) - 1.6 * k)
        np.testing.assert_allclose(line.get_xdata(), [0.0, 100.0 / 3.0, 200.0 / 3.0, 100.0])
        assert line.get_drawstyle() == "steps-mid"
    np.testing.assert_allclose(ax.get_yticks(), [0.0, 1.0, -1.6, -0.6])
    assert [text.get_text() for text in ax.get_yticklabels()] == ["mouth 0", "mouth 1", "hair 0", "hair 1"]
    assert ax.get_xlim() == (0.0, 100.0)
    assert ax.get_ylim() == pytest.approx((-1.75, 1.15))
    (ax,) = task_status_figure({"mouth": [1, 0, 1]}, {"mouth": [2.0, 3.0, 6.0]}).axes
    np.testing.assert_allclose(ax.get_lines()[0].get_xdata(), [0.0, 25.0, 100.0])
    for draw in (task_status_figure, elbow_paths_figure):
        with pytest.raises(ep.InvalidInput, match="at least one"):
            draw({})


def test_paths_of_the_elbow_are_on_the_unit_ball():
    times = np.linspace(0.0, 1.0, 9)
    moves = {
        "lift": ep.Movement.from_samples(times, ep.shoulder_rotation(60 * times, 0, 0, degrees=True)),
        "side": ep.Movement.from_samples(times, ep.shoulder_rotation(0, 60 * times, 0, degrees=True)),
    }
    (ax,) = elbow_paths_figure(moves).axes
    end = [np.sin(np.radians(60.0)), -0.5]
    for line, last in zip(ax.get_lines(), ([end[0], 0.0, end[1]], [0.0, end[0], end[1]]), strict=True):
        path = np.array(line.get_data_3d()).T
        np.testing.assert_allclose(np.linalg.norm(path, axis=1), 1.0)
        np.testing.assert_allclose(path[[0, -1]], [[0.0, 0.0, -1.0], last], atol=1e-6)
    starts = [np.array(each._offsets3d).T[0] for each in ax.collections]
    np.testing.assert_allclose(starts, [[0.0, 0.0, -1.0]] * 2 + [[0.0] * 3], atol=1e-9)
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["lift", "side"]
    assert ax.get_xlim() == ax.get_ylim() == ax.get_zlim() == (-1.0, 1.0)
    assert (ax.get_xlabel(), ax.get_ylabel(), ax.get_zlabel()) == ("forward", "left", "up")
    assert list(ax.get_xticks()) == list(ax.get_yticks()) == list(ax.get_zticks()) == [-0.5, 0.0, 0.5]


def test_a_day_has_a_cell_for_each_swivel():
    day = ep.workspace.day_reach(ep.load("four-linear-actuators-worn"), ["forces", "stroke"], step=45.0)
    figure = day_figure(day)
    (ax,) = figure.axes
    step = 45.0
    grey, cells = ax.patches[: len(day.tasks)], ax.patches[len(day.tasks) :]
    for k, bar in enumerate(grey):
        assert (bar.get_x(), bar.get_width()) == (-180.0 - step / 2.0, 360.0)
        assert bar.get_y() + bar.get_height() / 2.0 == k
    drawn = {(round(bar.get_y() + 0.4), round(bar.get_x() + step / 2.0)): bar for bar in cells}
    assert all(bar.get_width() == pytest.approx(step) for bar in cells)
    colours = {name: to_hex(each.colour) for name, each in CRITERIA.items()}
    count = 0
    for task in range(len(day.tasks)):
        for k, swivel in enumerate(np.degrees(day.swivels)):
            bar = drawn.get((task, round(swivel)))
            reason = str(day.reasons[task, k]).split(", ")[0]
            assert (bar is not None) == (bool(day.inside[task, k]) or bool(reason))
            if reason:
                assert to_hex(bar.get_facecolor()) == colours[reason]
            count += bar is not None
    assert count == len(cells)
    labels = [text.get_text() for text in ax.get_yticklabels()]
    assert labels == [f"{name}: {can}" for name, can in zip(day.tasks, day.table["can_do"], strict=True)]
    assert ax.get_ylim() == (len(labels) - 0.5, -0.5)
    assert ax.get_xlim() == (-202.5, 157.5)
    done = day.summary()
    assert f"{done['done']} of {done['tasks']} tasks of a day" in figure.get_suptitle()
    named = [text.get_text() for text in figure.legends[0].get_texts()]
    assert set(named) <= {"inside", *(f"not met: {each.words}" for each in CRITERIA.values())}
    assert ("inside" in named) == bool(day.inside.any())


@pytest.mark.parametrize("names", [("index", "mean_shoulder_force"), ("index",)])
def test_a_search_is_its_runs_and_their_front(names):
    values = [
        dict(zip(("index", "mean_shoulder_force"), pair, strict=True))
        for pair in ((0.5, 40.0), (0.8, 60.0), (0.6, 70.0))
    ]
    runs = [SimpleNamespace(merit=-0.1 * k) for k in range(3)]
    front = [SimpleNamespace(run=runs[k], objectives=values[k]) for k in (1, 0)]
    start = SimpleNamespace(run=runs[2], objectives=values[2])
    found = SimpleNamespace(objectives=names, runs=runs, values=values, front=front, start=start, evaluations=30)
    (ax,) = front_figure(found).axes
    places = [(each["index"], each["mean_shoulder_force"] if len(names) > 1 else run.merit)
              for each, run in zip(values, runs, strict=True)]  # fmt: skip
    every, best, first = ax.get_lines()
    np.testing.assert_allclose(every.get_xydata(), places)
    np.testing.assert_allclose(best.get_xydata(), sorted([places[1], places[0]]))
    np.testing.assert_allclose(first.get_xydata(), [places[2]])
    assert [line.get_label() for line in (every, best, first)] == [
        "runs",
        "front" if len(names) > 1 else "reported",
        "start",
    ]
    assert ax.get_xlabel() == "share of the poses inside"
    assert ax.get_ylabel() == ("mean |F_s| inside, N" if len(names) > 1 else "merit of the search, smaller is better")
    assert ax.get_title() == "3 runs of a search, 30 designs"
    alone = SimpleNamespace(
        **(vars(found) | {"start": None, "runs": runs[:1], "values": values[:1], "front": front[1:]})
    )
    (ax,) = front_figure(alone).axes
    assert ax.get_title() == "1 run of a search, 30 designs"
    assert len(ax.get_lines()) == 2


def test_a_muscle_under_control_is_its_columns():
    names = ("time_s", "wanted_mm", "contraction_mm", "pressure_bar", "duty")
    columns = {name: np.arange(5.0) + k for k, name in enumerate(names)}
    figure = plot_loop(columns)
    drawn = [line for ax in figure.axes for line in ax.get_lines()]
    for line, name in zip(drawn, names[1:], strict=True):
        np.testing.assert_array_equal(line.get_xdata(), columns["time_s"])
        np.testing.assert_allclose(line.get_ydata(), columns[name] * (100.0 if name == "duty" else 1.0))
    assert [ax.get_ylabel() for ax in figure.axes] == ["contraction, mm", "pressure, bar", "valve fills,\n% of time"]
    assert all(ax.get_ylim()[0] == 0.0 for ax in figure.axes)
    assert figure.axes[2].get_xlabel() == "time, s"
    assert [text.get_text() for text in figure.axes[0].get_legend().get_texts()] == ["wanted", "reached"]


@pytest.mark.parametrize("faults", [False, True])
def test_a_run_is_drawn_with_its_reference(faults):
    exo = ep.load("four-cables")
    more = {"faults": [ep.control.Fault("torn", 1, start=0.2)]} if faults else {}
    tracking = exo.track("flexion", "model", duration=0.4, **more)
    figure = tracking.plot()
    angles, error, ratios, drive, tension, shoulder = figure.axes[:6]
    run, t, n = tracking.run, tracking.times, 4
    reached, wanted = tracking.angles(), tracking.angles(wanted=True)
    for k in range(3):
        np.testing.assert_allclose(angles.get_lines()[k].get_xydata(), np.stack([t, reached[:, k]], axis=1))
        np.testing.assert_allclose(angles.get_lines()[3 + k].get_ydata(), wanted[:, k])
    for k in range(n):
        np.testing.assert_allclose(ratios.get_lines()[k].get_ydata(), 100.0 * tracking.ratios[:, k])
        np.testing.assert_allclose(ratios.get_lines()[n + k].get_ydata(), 100.0 * tracking.wanted_ratios[:, k])
        np.testing.assert_allclose(drive.get_lines()[k].get_ydata(), run.motor_forces[:, k])
        np.testing.assert_allclose(tension.get_lines()[k].get_ydata(), run.tensions[:, k])
        assert tension.get_lines()[k].get_label() == f"limb {k + 1}"
    np.testing.assert_allclose(error.get_lines()[0].get_ydata(), np.degrees(tracking.error))
    for k in range(3):
        np.testing.assert_allclose(shoulder.get_lines()[k].get_ydata(), tracking.shoulder_force[:, k])
    whole = next(line for line in shoulder.get_lines() if line.get_label() == "|F_s|")
    np.testing.assert_allclose(whole.get_ydata(), np.linalg.norm(tracking.shoulder_force, axis=1))
    assert drive.get_ylabel() == "motor force along the limb, N"
    assert (tension.get_xlabel(), shoulder.get_xlabel()) == ("time, s", "time, s")
    assert angles.get_xlim() == (t[0], t[-1])
    assert error.get_ylim()[0] == 0.0
    notes = figure.get_supxlabel()
    dotted = [line for line in error.get_lines() if line.get_linestyle() == ":"]
    assert len(dotted) == faults
    assert ("dotted: limb 2" in notes) == faults
    assert not faults or dotted[0].get_xdata()[0] == 0.2
    assert ("grey" in notes) == (not tracking.reachable.all())


def test_planes_of_elevation_and_scales_of_relief():
    """A pose is on its own curve: lifted in its plane and turned about the arm as it is."""
    asked = {}

    def joint_contact(poses, **query):
        asked.update(poses=poses, query=query)
        return "answer"

    subject = SimpleNamespace(joint_contact=joint_contact)
    for side in ("left", "right"):
        pose = ep.shoulder_rotation(40.0, 50.0, 15.0, side=side, degrees=True)
        elevation, answer, azimuth = elevation_in_plane(subject, pose, side, limits="none")
        assert (answer, asked["query"]) == ("answer", {"limits": "none", "outside": "mark"})
        np.testing.assert_allclose(elevation, np.arange(5.0, 121.0, 5.0))
        down = asked["poses"].apply([0.0, 0.0, -1.0])
        np.testing.assert_allclose(np.degrees(np.arccos(-down[:, 2])), elevation)
        lifted = pose.apply([0.0, 0.0, -1.0])
        flat = lifted[:2] / np.linalg.norm(lifted[:2])
        np.testing.assert_allclose(down[:, :2], np.sin(np.radians(elevation))[:, None] * flat, atol=1e-12)
        outward = 1.0 if side == "left" else -1.0
        assert azimuth == pytest.approx(np.degrees(np.arctan2(outward * flat[1], flat[0])))
        own = np.degrees(np.arccos(-lifted[2]))
        below, above = (asked["poses"][k] for k in (int(own // 5) - 1, int(own // 5)))
        assert np.degrees((below.inv() * pose).magnitude()) == pytest.approx(own % 5.0, abs=1e-6)
        assert np.degrees((above.inv() * pose).magnitude()) == pytest.approx(5.0 - own % 5.0, abs=1e-6)
        assert elevation_in_plane(subject, ep.shoulder_rotation(0, 0, 0), side)[2] == 90.0
    assert relief_scale(np.array([10.0, np.nan, 60.0]))[0] == {"cmap": "YlGnBu", "vmin": 10.0, "vmax": 60.0}
    assert relief_scale(np.array([np.nan]))[0]["vmax"] == 100.0
    look, bar = relief_scale(np.array([-30.0, 20.0]))
    assert (look["vmin"], look["vmax"], bar["extend"]) == (-30.0, 30.0, "neither")
    look, bar = relief_scale(np.array([-300.0, 20.0]))
    assert (look["vmin"], look["vmax"], bar["extend"]) == (-100.0, 100.0, "min")


def test_titles_are_broken_evenly_and_scales_end_above_what_is_usual():
    text = "one two three four five six seven eight nine ten eleven twelve thirteen fourteen"
    lines = wrapped(text, 4.0, 11.0).split("\n")
    most = int(4.0 * 72.0 / (0.56 * 11.0))
    assert max(map(len, lines)) <= most
    assert len(lines) == 2
    assert abs(len(lines[0]) - len(lines[1])) <= 8
    assert wrapped("short", 4.0, 11.0) == "short"
    assert scale_top(np.array([1.0, 2.0, np.nan, 3.0])) == pytest.approx(3.15)
    far = np.concatenate([np.linspace(1.0, 10.0, 99), [1e4]])
    assert scale_top(far) == pytest.approx(1.5 * np.percentile(far, 95.0))
    assert scale_top(np.array([np.nan])) == scale_top(np.zeros(2)) == 1.0
