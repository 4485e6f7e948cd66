"""Sliders in a notebook."""

import builtins

import numpy as np
import pytest
from scenes import panel, pose

from exo_pin.core import errors
from exo_pin.view import Sliders


def test_sliders_move_the_scene_and_the_numbers(exo):
    sliders = Sliders(exo, human=False)
    answer = sliders.set(flexion=60, abduction=30, r_A=0.15)
    changed = exo.replace(geometry=exo.geometry.replace(r_A=0.15))
    expected = changed.reaction(pose(60, 30, 0))
    np.testing.assert_allclose(answer.shoulder_force, expected.shoulder_force, rtol=1e-9)
    assert panel(sliders.scene, "numbers")["values"][0]["value"] == f"{expected.magnitude:.1f} N"
    # What cannot be leaves everything as it was.
    before = sliders.values, sliders.reaction
    with pytest.raises(errors.ExoPinError):
        sliders.set(r_A=-0.1, flexion=10)
    assert (sliders.values, sliders.reaction) == before
    assert sliders.exo.geometry.circles.r_A == 0.15


def test_widgets_drive_the_sliders(exo):
    widgets = pytest.importorskip("ipywidgets")
    sliders = Sliders(exo, dimensions=["r_B"], human=False)
    box = sliders.widget()
    found = {}

    def collect(widget):
        for child in getattr(widget, "children", ()):
            collect(child)
        if isinstance(widget, widgets.FloatSlider):
            found[widget.description] = widget

    collect(box)
    assert list(found) == ["flexion, °", "abduction, °", "internal rotation, °", "platform radius r_B, mm"]
    found["flexion, °"].value = 45.0
    found["platform radius r_B, mm"].value = 130.0
    assert sliders.values == {"flexion": 45.0, "abduction": 0.0, "internal_rotation": 0.0, "r_B": pytest.approx(0.13)}
    expected = exo.replace(geometry=exo.geometry.replace(r_B=0.13)).reaction(pose(45, 0, 0)).magnitude
    assert sliders.reaction.magnitude == pytest.approx(expected)
    assert box.children[1].value == ""
    static = Sliders(exo, dimensions=[], live=False, human=False).widget()
    first = static.children[2].value
    static.children[0].children[0].children[0].value = 30.0
    assert "srcdoc" in first
    assert static.children[2].value != first


def test_without_widgets_the_missing_extra_is_named(exo, monkeypatch):
    sliders = Sliders(exo, human=False)
    real = builtins.__import__

    def no_widgets(name, *rest):
        if name == "ipywidgets":
            raise ImportError(name)
        return real(name, *rest)

    monkeypatch.setattr(builtins, "__import__", no_widgets)
    with pytest.raises(errors.MissingExtra, match="notebooks"):
        sliders.widget()
