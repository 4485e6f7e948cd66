"""Plots of contact forces: what is drawn is what was computed."""

import matplotlib

matplotlib.use("agg")

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import InvalidInput

pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")

from exo_pin.view.plots.contact_plots import contact_over_box, contact_over_elevation, relief_scale

DEGREES = np.array([30.0, 60.0, 90.0])


def test_contact_force_is_drawn_in_percent_of_body_weight_with_gaps():
    person = ep.Person(1.75, 75, "male")
    poses = ep.shoulder_rotation(0, DEGREES, 0, degrees=True)
    contact = ep.load("prototype").joint_contact(poses, person)
    axes = contact_over_elevation(DEGREES, contact)
    lines = {line.get_label(): line for line in axes.get_lines()}
    drawn = lines["contact force with the device"].get_ydata()
    assert np.allclose(drawn[:2], contact.percent_body_weight[:2])
    assert np.isnan(drawn[2])
    assert lines["no result with the device"].get_xdata().tolist() == [90.0]
    assert np.allclose(
        lines["contact force without the device"].get_ydata(), contact.without_device.percent_body_weight
    )
    bare = contact_over_elevation(DEGREES, contact.without_device)
    assert [line.get_label() for line in bare.get_lines()] == ["contact force", "shear"]
    with pytest.raises(InvalidInput, match="shape"):
        contact_over_elevation(DEGREES[:2], contact)


BOX = (np.array([0.0, 40.0, 80.0]), np.array([0.0, 50.0]), np.array([-10.0, 10.0, 20.0]))


def over_box(person):
    grid = np.meshgrid(*BOX, indexing="ij")
    return person.joint_contact(ep.shoulder_rotation(*grid, degrees=True), outside="mark")


def test_a_cell_of_the_box_is_the_median_over_the_internal_rotations():
    contact = over_box(ep.Person(1.75, 75, "male"))
    (axes, _) = contact_over_box(BOX, contact).axes
    assert axes.get_xlabel() == "flexion, °"
    drawn = np.asarray(axes.collections[0].get_array()).reshape(len(BOX[1]), len(BOX[0]))
    for j, i in np.ndindex(drawn.shape):
        assert drawn[j, i] == pytest.approx(np.nanmedian(contact.percent_body_weight[i, j]), rel=1e-12)
    with pytest.raises(InvalidInput, match="shape"):
        contact_over_box((BOX[1], BOX[0], BOX[2]), contact)


def test_a_box_without_any_result_is_drawn_white():
    contact = over_box(ep.Person(1.75, 75, "male", strength=0.01))
    assert not contact.has_result.any()
    axes = contact_over_box(BOX, contact).axes[0]
    assert np.ma.getmaskarray(np.ma.masked_invalid(axes.collections[0].get_array())).all()


def test_the_scale_of_the_relief_spans_its_values_and_red_is_added_force():
    lowered = np.array([[40.0, np.nan], [62.0, 97.0]])
    colours, bar = relief_scale(lowered)
    assert (colours["vmin"], colours["vmax"], bar["extend"]) == (40.0, 97.0, "neither")
    assert "red" not in bar["label"]
    for added, cut in ((-30.0, "neither"), (-250.0, "min")):
        colours, bar = relief_scale(np.where(lowered == 40.0, added, lowered))
        # White lies at 0: a cell is red if, and only if, the device adds force there.
        assert colours["vmin"] == -colours["vmax"]
        assert colours["vmax"] == (97.0 if cut == "neither" else 100.0)
        assert (bar["extend"], "red" in bar["label"]) == (cut, True)
    assert relief_scale(np.full((2, 2), np.nan))[0]["vmax"] == 100.0


@pytest.mark.filterwarnings("ignore:All-NaN slice:RuntimeWarning")
def test_a_box_with_a_device_has_both_forces_and_the_relief():
    exo, person = ep.load("prototype"), ep.Person(1.75, 75, "male")
    grid = np.meshgrid(*BOX, indexing="ij")
    contact = exo.joint_contact(exo.pose(*grid), person, outside="mark")
    figure = contact_over_box(BOX, contact)
    panels = [ax for ax in figure.axes if ax.get_xlabel() == "flexion, °"]
    assert [ax.get_title() for ax in panels] == ["without the device", "with the device", "relief"]
    values = (contact.without_device.percent_body_weight, contact.percent_body_weight, contact.relief_percent)
    layers = []
    for ax, each in zip(panels, values, strict=True):
        (mesh,) = ax.collections
        drawn = np.ma.filled(mesh.get_array(), np.nan).reshape(len(BOX[1]), len(BOX[0]))
        layers.append(np.nanmedian(each, axis=-1).T)
        np.testing.assert_allclose(drawn, layers[-1], rtol=1e-12)
        edges = mesh.get_coordinates()
        np.testing.assert_allclose((edges[0, 1:, 0] + edges[0, :-1, 0]) / 2.0, BOX[0])
        assert list(ax.get_xticks()) == [0.0, 30.0, 60.0]
        assert list(ax.get_yticks()) == [0.0, 30.0]
    top = np.nanmax(layers[:2])
    assert [ax.collections[0].get_clim() for ax in panels[:2]] == [(0.0, pytest.approx(top))] * 2
    look, bar = relief_scale(layers[2].T)
    assert panels[2].collections[0].get_clim() == (look["vmin"], look["vmax"])
    assert [ax.get_ylabel() for ax in figure.axes if ax not in panels] == ["% of body weight", bar["label"]]
    assert panels[0].get_ylabel() == "abduction, °"
    lost = any(np.isnan(layer).any() for layer in layers[:2])
    assert ("grey: no result" in str(figure.get_supxlabel())) == lost
    curve = contact_over_elevation(DEGREES, exo.joint_contact(exo.pose(0.0, DEGREES), person, outside="mark"))
    curve.figure.canvas.draw()
    (newton,) = curve.child_axes
    np.testing.assert_allclose(np.array(newton.get_ylim()), np.array(curve.get_ylim()) * 0.75 * 9.80665, rtol=2e-3)
    assert (curve.get_ylim()[0], newton.get_ylabel()) == (0.0, "force, N")
    shear = next(line for line in curve.get_lines() if line.get_label() == "shear with the device")
    found = exo.joint_contact(exo.pose(0.0, DEGREES), person, outside="mark")
    np.testing.assert_allclose(shear.get_ydata(), 100.0 * found.shear / found.body_weight)
