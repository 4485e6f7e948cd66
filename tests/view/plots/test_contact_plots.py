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
