"""What cannot be drawn is refused."""

import sys

import numpy as np
import pytest
from drawn_figures import lift, movement, prototype, table, worn

import exo_pin as ep
from exo_pin.core import errors
from exo_pin.muscle import muscle_model, steady_states
from exo_pin.study import StudyTable
from exo_pin.view import plots

DESIGNS = StudyTable([{"design": "a", "holdable": 0.5}, {"design": "b", "holdable": 1.0}])


def one():
    return prototype().reaction(prototype().pose(60, 30))


def grid(*angles):
    return ep.load("four-cables").workspace(prototype().pose(*angles), ["singularity"])


@pytest.mark.parametrize(
    ("draw", "message"),
    [
        (lambda: lift().plot([0.0, 1.0]), "a place for every pose"),
        (lambda: lift().plot(limits=([0, 0], [1, 1])), "broadcast"),
        (lambda: lift().plot(limits=(0.0, np.nan)), "lower <= upper"),
        (lambda: one().plot(limits=(0.0, [1.0, 2.0])), "broadcast"),
        (lambda: one().plot(limits=(2.0, 1.0)), "lower <= upper"),
        (lambda: worn().reaction(worn().pose([[0.0, 20.0]], [[10.0], [20.0], [30.0]])).plot(), r"\(3, 2\)"),
        (lambda: movement().plot("elbow"), "abduction"),
        (lambda: DESIGNS.plot("design"), "column of numbers"),
        (lambda: DESIGNS.plot(), "peak_F_s_N"),
        (lambda: plots.overview(prototype(), prototype().pose([10, 20])), "single rotation"),
        (lambda: plots.shoulder_force_map(prototype(), step=0.0), "step"),
        (lambda: plots.shoulder_force_map(prototype(), step=np.nan), "step"),
        (lambda: plots.overview(3, prototype().pose()), "exo to be a"),
        (lambda: plots.shoulder_force_map(3), "exo to be a"),
        (lambda: plots.determinant_map(3), "exo to be a"),
        (lambda: plots.rotation_ball(3), "found to be a Workspace"),
        (lambda: plots.workspace_slices(3), "found to be a Workspace"),
        (lambda: plots.workspace_slices(grid([0.0, 10.0])), "grid of three angles"),
        (lambda: plots.design_drawing(ep.load("prototype").replace(arm=None), prototype().pose()), "wearer"),
        (lambda: plots.posture_drawing(worn(), worn().pose([10.0]), ["a", "b"]), r"titles .* got 2 of \(1,\)"),
        (lambda: plots.posture_drawing(worn(), worn().pose(10.0), ["a"]), "flat stack"),
        (lambda: plots.task_status_figure({}), "at least one"),
        (lambda: plots.elbow_paths_figure({}), "at least one"),
        (lambda: plots.plot_force_map(muscle_model("best", 0.15), steady_states()), "scaled"),
    ],
)
def test_what_cannot_be_drawn_is_refused(draw, message):
    with pytest.raises(errors.ExoPinError, match=message):
        draw()


def test_contact_forces_of_another_shape_are_refused():
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    contact = ep.Person(1.75, 75, "male").joint_contact(prototype().pose([30.0, 60.0]))
    with pytest.raises(ep.InvalidInput, match="shape"):
        plots.contact_over_elevation([30.0], contact)
    with pytest.raises(ep.InvalidInput, match="shape"):
        plots.contact_over_box((np.zeros(1), np.zeros(2), np.zeros(1)), contact)


def test_without_matplotlib_the_missing_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", None)
    for draw in (one().plot, lift().plot, movement().plot, lambda: table("r_A", rows=[(1.0, 2.0), (2.0, 3.0)])):
        with pytest.raises(errors.MissingExtra, match=r"\.\[plot\]"):
            draw()
