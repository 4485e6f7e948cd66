"""Plots of answers: what is drawn is what was answered."""

import matplotlib

matplotlib.use("agg")

import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from places import URDF

import exo_pin as ep
from exo_pin.core import errors
from exo_pin.view import plots

TIMES = np.linspace(0.0, 1.0, 41)


@pytest.fixture(scope="module")
def exo():
    return ep.load("prototype").worn_by(ep.Arm.from_anthropometry(1.75, 75, "male"))


@pytest.fixture(scope="module")
def crossing(exo):
    """Straight up: det X changes its sign on the way."""
    return exo.reaction(ep.shoulder_rotation(90 * TIMES, 0, 0, degrees=True))


def lines(ax):
    return {line.get_label(): line for line in ax.get_lines()}


def test_curves_of_forces_show_the_answer_with_units(crossing):
    ax = crossing.plot(TIMES, "time, s").axes[0]
    drawn = lines(ax)
    np.testing.assert_array_equal(drawn["|F_s|"].get_ydata(), crossing.magnitude)
    for part, name in enumerate(("F_s x forward", "F_s y left", "F_s z up")):
        np.testing.assert_array_equal(drawn[name].get_ydata(), crossing.shoulder_force[:, part])
    assert len({str(line.get_linestyle()) + str(line._dash_pattern) for line in drawn.values()}) > 3
    assert ax.figure.axes[1].get_xlabel() == "time, s"
    assert ax.get_ylabel().endswith(", N")
    (percent,) = (child for child in ax.child_axes if "%" in child.get_ylabel())
    ax.figure.canvas.draw()
    np.testing.assert_allclose(
        np.array(percent.get_ylim()), np.array(ax.get_ylim()) * 100 / crossing.body_weight, rtol=1e-9
    )
    places = [after for (after,) in crossing.crossings()]
    assert len(places) == 1
    dotted = [line for line in ax.get_lines() if line.get_linestyle() == ":" and len(set(line.get_xdata())) == 1]
    assert [line.get_xdata()[0] for line in dotted] == [(TIMES[places[0]] + TIMES[places[0] + 1]) / 2]


def test_drives_of_a_device_have_their_names_and_units():
    exo = ep.load(URDF / "serial-y-x-z.urdf")
    answer = exo.reaction(exo.pose(flexion=[0, 20, 40]))
    ax = answer.plot([0.0, 20.0, 40.0], "flexion, °").axes[1]
    assert ax.get_ylabel() == "effort, N m"
    assert {"internal_rotation", "abduction", "flexion"} <= set(lines(ax))


def test_curves_of_tensions_mark_what_is_beyond_limits(crossing):
    ax = crossing.plot(TIMES, limits=(0.0, 200.0)).axes[1]
    drawn = lines(ax)
    for i in range(3):
        force = crossing.actuator_forces[:, i]
        np.testing.assert_array_equal(drawn[f"limb {i + 1}"].get_ydata(), force)
        beyond = (force < 0) | (force > 200)
        assert beyond.any()
        np.testing.assert_array_equal(drawn[f"limb {i + 1} beyond limits"].get_xdata(), TIMES[beyond])
    own = crossing.plot(TIMES, limits=([-1e9, -1e9, -1e9], [1e9, 2e9, 3e9])).axes[1]
    assert not any("beyond" in label for label in lines(own))
    assert not any("limits" in label for label in lines(crossing.plot(TIMES).axes[1]))


def test_determinant_map_is_one_of_the_plots(exo):
    ax = plots.determinant_map(exo, step=5.0)
    (image,) = [each for each in ax.collections if isinstance(each, QuadMesh)]
    corners = np.ma.getdata(image.get_coordinates())
    flexion, abduction = np.unique(corners[..., 0]), np.unique(corners[..., 1])
    assert len(flexion) > 20
    assert len(abduction) > 20
    # Cells are centred on the grid; what each shows is det X of its pose.
    drawn = np.ma.getdata(image.get_array()).reshape(len(abduction) - 1, len(flexion) - 1)
    at = np.meshgrid(0.5 * (flexion[1:] + flexion[:-1]), 0.5 * (abduction[1:] + abduction[:-1]))
    poses = ep.shoulder_rotation(*at, 0.0, side=exo.side, degrees=True)
    np.testing.assert_allclose(drawn, exo.singularity(poses).determinant, atol=1e-9)
    assert (drawn > 0).any()
    assert (drawn < 0).any()
    assert "flexion" in ax.get_xlabel()
    assert "abduction" in ax.get_ylabel()


@pytest.mark.parametrize("suffix", ["png", "svg"])
def test_pictures_can_be_saved(crossing, tmp_path, suffix):
    figure = crossing.plot(TIMES)
    target = tmp_path / f"picture.{suffix}"
    figure.savefig(target)
    assert target.stat().st_size > 5000


@pytest.mark.parametrize(
    ("draw", "message"),
    [
        (lambda r: r.plot(TIMES[:-1]), "a place for every pose"),
        (lambda r: r.plot(TIMES, limits=([0, 0], [1, 1])), "broadcast"),
        (lambda r: r.plot(TIMES, limits=(5.0, 1.0)), "lower <= upper"),
        (lambda r: r.plot(TIMES, limits=(0.0, np.nan)), "lower <= upper"),
    ],
)
def test_bad_input_is_refused(crossing, draw, message):
    with pytest.raises(errors.InvalidInput, match=message):
        draw(crossing)


def test_plots_refuse_what_they_cannot_draw():
    exo = ep.load("prototype")
    several = ep.shoulder_rotation([10, 20], 20, 0, degrees=True)
    with pytest.raises(errors.InvalidInput, match="single rotation"):
        plots.overview(exo, several)
    for step in (0.0, -1.0, np.nan):
        with pytest.raises(errors.InvalidInput, match="step"):
            plots.shoulder_force_map(exo, step=step)
    for draw in (
        lambda: plots.overview(3, several[0]),
        lambda: plots.shoulder_force_map(3),
        lambda: plots.determinant_map(3),
    ):
        with pytest.raises(errors.InvalidInput, match=r"expected (exo|reaction) to be a"):
            draw()
