"""What is said of a run before it and after it where lengths do not place the arm, and which controller is taken."""

from dataclasses import replace

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.control import Turn
from exo_pin.load_case.case import beyond_motion

NAME = "four-linear-actuators-worn"


def lift(exo, controller=None, angle=90.0, duration=5.0):
    reference = Turn(exo.pose(), exo.pose(angle).as_rotvec(), duration)
    return ep.control.Experiment("lift", "lift", exo.mechanism, reference, controller)


def test_the_default_controller_is_that_of_what_a_design_measures(tmp_path):
    """The arm's sensor of a redundant design, unless it says that it has none."""
    exo = ep.load(NAME)
    assert lift(exo).controller == "model"
    assert lift(exo.replace(measures=["lengths", "arm"])).controller == "model"
    blind = exo.replace(measures=["lengths"])
    blind.save(tmp_path / "blind.toml")
    again = ep.load(tmp_path / "blind.toml")
    assert again.mechanism.measures == ("lengths",)
    assert lift(again).controller == "pi"
    assert lift(ep.load("three-linear-actuators")).controller == lift(ep.load("prototype")).controller == "pi"
    with pytest.raises(ep.InvalidInput, match="measures"):
        exo.replace(measures=["forces"])


def test_it_is_said_before_the_run_that_lengths_do_not_place_the_arm():
    """At 80° another pose 18.5° away has the same lengths to 0.34 mm (test_pose_accuracy has it from the file)."""
    exo = ep.load(NAME)
    reference = Turn(exo.pose(80.0), np.zeros(3), 1.0)
    (text,) = replace(lift(exo, "pi"), reference=reference).foreseen
    assert "lengths alone do not place the arm in 100 % of the wanted poses; at flexion 80°" in text
    assert "a pose 18.5° away has the same positions to 0.34 mm" in text
    assert "--controller model" in text
    assert lift(exo).foreseen == ()
    assert lift(ep.load("four-cables-worn"), "pi", 60.0).foreseen == ()
    (blind,) = lift(exo.replace(measures=["lengths"]), "model").foreseen
    assert "measures" in blind
    (weak,) = lift(ep.load("prototype"), "model").foreseen
    assert weak.startswith("the drives cannot hold 100 % of the wanted poses")


@pytest.mark.full
def test_the_default_controller_ends_where_it_should_and_lengths_alone_do_not():
    exo = ep.load(NAME)
    good = exo.track("flexion")
    assert np.degrees(good.error[-1]) < 1.0
    assert not good.findings
    bad = exo.track("flexion", "pi")
    off = np.degrees(bad.error[-1])
    assert off > 20.0
    assert bad.summary()["end_error_deg"] == off
    assert f"the arm {off:.1f}° off" in bad.verdict
    wrong = 1e3 * np.abs(bad.run.lengths[-1] - exo.inverse_kinematics(bad.wanted[-1]).lengths).max()
    assert any(f"within {wrong:.1f} mm of those wanted and the arm {off:.1f}° off" in text for text in bad.findings)
    assert any("lengths alone do not place the arm" in text for text in bad.cautions)


@pytest.mark.full
def test_an_arm_beyond_its_range_of_motion_is_named():
    """All limbs torn: nothing holds the arm, and nothing of a joint stops it."""
    exo = ep.load(NAME)
    torn = [ep.Fault("torn", limb, 4.0) for limb in range(4)]
    run = replace(lift(exo), faults=tuple(torn), duration=5.0).run()
    beyond = [text for text in run.findings if "beyond a shoulder's range of motion" in text]
    assert len(beyond) == beyond_motion(run.run.rotations.as_matrix(), "left").any()
    assert len(beyond) == 1
