"""Figures of whole answers: what is drawn is what was answered, and no word covers another."""

import sys

import matplotlib

matplotlib.use("agg")

import numpy as np
import pytest
from matplotlib.figure import Figure
from words_apart import assert_words_are_apart

import exo_pin as ep
from exo_pin.core import errors
from exo_pin.load_case import Movement
from exo_pin.study import StudyTable
from exo_pin.view.plots import angle_maps, determinant_map
from exo_pin.view.plots.plot_style import force_scale, new_figure

FLEXION, ABDUCTION = np.arange(20.0, 80.0, 10.0), np.arange(20.0, 60.0, 10.0)
PERSON = ep.Arm.from_anthropometry(1.75, 75, "male")


@pytest.fixture(scope="module")
def exo():
    return ep.load("prototype").worn_by(PERSON)


@pytest.fixture(scope="module")
def pose(exo):
    return exo.reaction(
        ep.shoulder_rotation(60, 30, 0, degrees=True), split="minimal", constraint_bounds=(-80, 80), limits="none"
    )


@pytest.fixture(scope="module")
def stack(exo):
    return exo.reaction(ep.shoulder_rotation(np.arange(0.0, 91.0, 3.0), 30, 0, degrees=True), limits="none")


@pytest.fixture(scope="module")
def movement(exo):
    times = np.linspace(0.0, 1.0, 21)
    return exo.follow(Movement.from_samples(times, ep.shoulder_rotation(30 + 40 * times, 30, 0, degrees=True)))


@pytest.fixture(scope="module")
def table():
    rows = [{"r_A": r, "h_B": h, "peak_F_s_N": 100 * r + h, "error": ""} for r in (0.1, 0.15) for h in (0.1, 0.2)]
    return StudyTable(rows)


def heights(axes):
    return [bar.get_height() for bar in axes.patches]


def test_a_pose_is_bars_with_limits(pose):
    figure = pose.plot(limits=(0.0, [400.0, 300.0, np.inf]))
    assert isinstance(figure, Figure)
    limbs, shoulder = figure.axes
    np.testing.assert_allclose(heights(limbs), [*pose.actuator_forces, *pose.constraint_forces])
    np.testing.assert_allclose(heights(shoulder), [pose.magnitude, *pose.shoulder_force, pose.cuff_pull])
    # Equilibrium determines f, and neither g nor F_s.
    assert [bool(bar.get_hatch()) for bar in limbs.patches] == [False] * 3 + [True] * 3
    assert all(bar.get_hatch() for bar in shoulder.patches)
    marks = np.vstack([segment for lines in limbs.collections for segment in lines.get_segments()])
    assert sorted(set(marks[:, 1])) == [0.0, 300.0, 400.0]
    assert "% of body weight" in shoulder.get_title()
    assert "limits were left out" in figure.get_suptitle().replace("\n", " ")
    figure.canvas.draw()
    for ax in figure.axes:
        title = ax.title.get_window_extent()
        assert 0.0 <= title.x0 <= title.x1 <= figure.bbox.width
    assert_words_are_apart(figure)


def test_a_pose_without_answer_says_so(exo):
    answer = exo.reaction(exo.pose(0, 90))
    assert not answer.has_answer
    figure = answer.plot()
    assert "No forces: the pose is singular" in figure.get_suptitle()
    assert [text.get_text() for text in figure.axes[0].texts] == ["none"] * 3


def test_a_stack_is_curves_along_what_is_given(stack):
    angles = np.arange(0.0, 91.0, 3.0)
    figure = stack.plot(angles, "flexion, °", limits=(0, 400))
    top, bottom = figure.axes[:2]
    drawn = {line.get_label(): line for line in [*top.get_lines(), *bottom.get_lines()]}
    np.testing.assert_array_equal(drawn["|F_s|"].get_xdata(), angles)
    np.testing.assert_array_equal(drawn["limb 2"].get_ydata(), stack.actuator_forces[:, 1])
    assert bottom.get_xlabel() == "flexion, °"
    assert_words_are_apart(figure)
    # A peak beside a singular pose does not press the rest flat, and is named.
    assert top.get_ylim()[1] < 0.5 * stack.peak
    assert f"up to {float(f'{stack.peak:.3g}'):.0f} N" in top.get_title(loc="right")
    # An angle may fall, where time may not.
    assert isinstance(stack.plot(angles[::-1], "flexion, °"), Figure)


def test_a_movement_is_drawn_over_time_or_an_angle(movement):
    for against, expected in (
        ("time", movement.movement.times),
        ("flexion", 30 + 40 * movement.movement.times),
    ):
        figure = movement.plot(against)
        np.testing.assert_allclose(figure.axes[0].get_lines()[0].get_xdata(), expected, atol=1e-9)
        assert_words_are_apart(figure)
    with pytest.raises(errors.UnknownName, match="abduction"):
        movement.plot("elbow")


def test_a_study_is_curves_or_bars(table):
    figure = table.plot()
    (axes,) = figure.axes
    assert [line.get_label() for line in axes.get_lines()] == ["h_B, m: 0.1", "h_B, m: 0.2"]
    np.testing.assert_allclose(axes.get_lines()[0].get_ydata(), [10.1, 15.1])
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("r_A, m", "peak of the shoulder force |F_s|, N")
    assert_words_are_apart(figure)
    named = StudyTable([{"design": "a", "holdable": 0.5}, {"design": "b", "holdable": 1.0}])
    (axes,) = named.plot("holdable").axes
    assert [bar.get_width() for bar in axes.patches] == [0.5, 1.0]
    assert [text.get_text() for text in axes.get_yticklabels()] == ["a", "b"]
    with pytest.raises(errors.InvalidInput, match="column of numbers"):
        named.plot("design")
    with pytest.raises(errors.UnknownName, match="peak_F_s_N"):
        named.plot()


def test_designs_that_hold_nothing_are_named_and_designs_with_names_stand_beside_each_other():
    lost = StudyTable([{"cuff_height_mm": 100.0 + k, "peak_F_s_N": np.nan} for k in range(3)])
    (axes,) = lost.plot().axes
    assert "hold no pose" in axes.get_title(loc="right")
    np.testing.assert_array_equal(axes.get_lines()[-1].get_xdata(), [100.0, 101.0, 102.0])
    assert axes.get_xlabel() == "cuff height, mm"
    # A comparison has numbers before its figures, which are no parameters of its designs.
    rows = [("a", 200.0), ("b", np.nan), ("c", 90.0)]
    (axes,) = StudyTable([{"design": n, "common_peak_F_s_N": v / 2, "peak_F_s_N": v} for n, v in rows]).plot().axes
    assert [bar.get_width() for bar in axes.patches][::2] == [200.0, 90.0]
    assert [(text.get_text(), text.xy[1]) for text in axes.texts] == [("no pose is held", 1)]


def test_curves_say_whose_they_are_and_where_nothing_is_held():
    exo = ep.load("three-linear-actuators")
    poses = exo.pose(np.linspace(0.0, 120.0, 13), 95.0)
    answer = exo.reaction(poses)
    lost = ~answer.can_hold
    assert 0 < lost.sum() < lost.size
    figure = answer.plot()
    assert figure.get_suptitle().replace("\n", " ") == f"{exo.name} {answer.verdict}"
    for axes in figure.axes:
        (marks,) = [line for line in axes.get_lines() if line.get_label().startswith("not held")]
        np.testing.assert_array_equal(marks.get_xdata(), np.flatnonzero(lost & answer.has_answer))


@pytest.mark.parametrize("preset", ["three-linear-actuators", "four-linear-actuators-worn"])
def test_long_names_stay_on_the_figure(preset):
    exo = ep.load(preset)
    if exo.mechanism.limb_count == 3:
        assert_words_are_apart(determinant_map(exo, step=20.0).figure)
    title = angle_maps.shoulder_force_map(exo, internal_rotation=-3e-15, step=20.0).get_title()
    assert "internal rotation 0°" in title  # and not -3e-15°
    figure = exo.reaction(exo.pose([0.0, 60.0], 30.0)).plot()
    figure.canvas.draw()
    box = figure._suptitle.get_window_extent()
    assert 0.0 <= box.x0 < box.x1 <= figure.bbox.width


def test_the_overview_says_what_its_panels_assume(monkeypatch):
    # The map of a coarse grid shows the same.
    fine = angle_maps.shoulder_force_map
    monkeypatch.setattr(angle_maps, "shoulder_force_map", lambda *a, **query: fine(*a, step=10.0, **query))
    exo = ep.load("prototype").worn_by(PERSON)
    figure = angle_maps.overview(exo, ep.shoulder_rotation(-0.2, 10, 25, degrees=True))
    limbs, shoulder, chart, _ = figure.axes
    assert figure.subfigs[0].get_suptitle() == "prototype:\nflexion 0°, abduction 10°, internal rotation 25°"
    assert "cannot hold" in figure.get_suptitle()
    assert "without side force" in chart.get_title()
    answer = exo.reaction(ep.shoulder_rotation(-0.2, 10, 25, degrees=True))
    np.testing.assert_allclose(heights(limbs), answer.actuator_forces)
    np.testing.assert_allclose(heights(shoulder), [answer.magnitude, *answer.shoulder_force, answer.cuff_pull])
    assert_words_are_apart(figure)


def test_map_of_cables_has_tensions_within_their_limits():
    cables = ep.load("four-cables")
    axes = angle_maps.shoulder_force_map(cables, step=10.0)
    shown = axes.collections[0].get_array().reshape(11, 14)
    row, column = 3, 8  # abduction 26°, flexion 60°
    pose = cables.pose(60, 26)
    held = cables.reaction(pose)
    assert cables.reaction(pose, limits="none").actuator_forces.min() < 0.0
    assert shown[row, column] == pytest.approx(held.percent_body_weight)
    assert np.ma.getmaskarray(shown)[10, 13]  # no tensions hold flexion 110°, abduction 96°
    assert "cannot be held" in axes.get_legend_handles_labels()[1][0]


@pytest.mark.parametrize(
    ("draw", "message"),
    [
        (lambda p, s: s.plot([0.0, 1.0]), "a place for every pose"),
        (lambda p, s: p.plot(limits=(0.0, [1.0, 2.0])), "broadcast"),
        (lambda p, s: p.plot(limits=(2.0, 1.0)), "lower <= upper"),
    ],
)
def test_bad_input_is_refused(pose, stack, draw, message):
    with pytest.raises(errors.InvalidInput, match=message):
        draw(pose, stack)


def test_a_stack_of_two_dimensions_is_no_curve(exo):
    answer = exo.reaction(ep.shoulder_rotation(FLEXION[:2, None], ABDUCTION[:3], 0, degrees=True))
    with pytest.raises(errors.InvalidInput, match=r"\(2, 3\)"):
        answer.plot()


def test_without_matplotlib_the_missing_extra_is_named(pose, stack, movement, table, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", None)
    for answer in (pose, stack, movement, table):
        with pytest.raises(errors.MissingExtra, match=r"\.\[plot\]"):
            answer.plot()


@pytest.mark.parametrize(
    "forces",
    [
        [0.0, 0.0, 0.0],
        [1e-300, 2e-300, 3e-300],
        [3.0, 3.0, 3.0],
        [1.0, 2.0, 1e9],
        [1e-200, 1.0, 1e200],
        [np.nan, np.nan, np.nan],
        [1550.0, 20.0, np.nan],
    ],
)
def test_colours_of_a_map_have_few_steps_whatever_the_range(forces, tmp_path):
    norm, _ = force_scale(np.array([forces, forces]))
    figure, ax = new_figure(4.0, 3.0)
    ax.pcolormesh(np.array([forces, forces]), norm=norm)
    figure.savefig(tmp_path / "map.png", dpi=40)
    steps = norm.boundaries
    assert 2 <= len(steps) <= 13
    assert (np.diff(steps) > 0.0).all()
    known = np.array(forces)[np.isfinite(forces)]
    if known.size and known.max() < 1e3 * np.median(known):
        assert steps[-1] >= known.max()
