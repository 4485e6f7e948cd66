"""Commands asked of devices that are not wrists."""

import json

import numpy as np
import pytest
from places import REPOSITORY, URDF

import exo_pin as ep
from exo_pin.cli import main
from exo_pin.workspace import task_reach

SERIAL, SUPPORT = str(URDF / "serial-y-x-z.urdf"), str(URDF / "spring-support.urdf")


def test_reaction_says_what_the_drives_give(capsys):
    assert main(["reaction", SERIAL, "--flexion", "60", "--abduction", "30"]) == 0
    text = capsys.readouterr().out
    assert "YES, it holds." in text
    assert "flexion" in text
    assert "N m" in text
    assert "a cuff that puts no couple on the arm" in text
    assert main(["reaction", SERIAL, "--flexion", "60", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["spherical"]["can_hold"] is True
    assert told["report"]["drive_units"][2] == ["flexion", "N m"]


def test_a_passive_support_says_what_the_wearer_must_add(capsys):
    assert main(["reaction", SUPPORT, "--abduction", "60"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "IT SUPPORTS, and the wearer holds." in text
    assert "It leaves the wearer's muscles 6.3 N m about the forward axis" in text
    assert "No pose within" not in text


@pytest.mark.full
def test_drives_that_cannot_turn_the_arm_about_itself_do_not_hold_it(capsys):
    # With the forearm across, the arm's weight turns it about itself, and the cuff of the 3RPS turns freely there.
    words = ["--flexion", "90", "--internal-rotation", "45", "--person", "1.755,85,male", "--elbow-flexion", "90"]
    assert main(["reaction", str(URDF / "3rps-passive-ball.urdf"), *words]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "NO, it cannot hold." in text
    assert "The wearer's own muscles would have to add 2.41 N m about the arm." in text
    assert "springs" not in text


@pytest.mark.parametrize(
    "words",
    [
        ["reaction", SERIAL, "--to", "90,0,0"],
        ["singularity", SERIAL, "--flexion", "30"],
        ["workspace", SERIAL, "--step", "30"],
        ["compare", "four-cables", SERIAL, "--step", "30"],
        ["check", SERIAL],
        ["mobility", SERIAL],
    ],
    ids=lambda words: words[0],
)
def test_other_questions_have_an_answer(words, capsys):
    assert main(words) == 0
    assert "serial-y-x-z" in capsys.readouterr().out


def test_what_is_of_wrists_alone_is_refused_in_a_sentence(capsys):
    assert main(["kinematics", SERIAL, "--lengths", "300,300,300"]) == 2
    assert "of wrists: leave out --lengths" in capsys.readouterr().err


def test_kinematics_lists_the_joints_of_each_assembly_mode(capsys):
    # The hinges of a serial device are the angles of the pose; the second mode turns each of them by half a turn.
    assert main(["kinematics", SERIAL, "--flexion=40", "--abduction=20", "--internal-rotation=10", "--json"]) == 0
    modes = np.degrees(json.loads(capsys.readouterr().out)["modes"])
    exo = ep.load(SERIAL)
    at = [
        exo.chain.model.idx_qs[exo.chain.model.getJointId(name)]
        for name in ("internal_rotation", "abduction", "flexion")
    ]
    turn = np.diff(modes[:, at], axis=0).ravel()
    assert len(modes) == 2
    assert np.abs(turn[[0, 2]] % 360.0) == pytest.approx([180.0, 180.0])
    assert main(["kinematics", SUPPORT]) == 0
    assert "It has no joints" in capsys.readouterr().out
    assert main(["kinematics", str(URDF / "3rps-passive-ball.urdf"), "--flexion", "10"]) == 0
    assert "1 freedom leaves the arm where it is" in " ".join(capsys.readouterr().out.split())


def test_tasks_say_how_fast_the_drives_of_a_hinge_turn(capsys):
    # Flexion alone turns the flexion hinge as fast as the arm.
    exo = ep.load(SERIAL)
    times = np.linspace(0.0, 1.0, 11)
    swing = ep.Movement.from_samples(times, exo.pose(flexion=60.0 * times), smoothing=None)
    table = task_reach(exo.device, {"swing": swing}, ranges=())
    assert table["fastest_joint_rad_s"][0] == pytest.approx(np.radians(60.0), rel=1e-3)
    efforts = exo.reaction(swing.poses).actuator_forces[:, 2]
    assert table["largest_power_W"][0] == pytest.approx(efforts.max() * np.radians(60.0), rel=2e-2)
    assert main(["tasks", SUPPORT, "--no-ranges", "--movement", f"lift={REPOSITORY / 'examples' / 'lift.csv'}"]) == 0
    assert "lift" in capsys.readouterr().out


def test_muscles_make_what_a_passive_support_leaves(capsys):
    assert main(["person", SUPPORT, "--flexion", "60"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "less than without the device" in text
    assert "wearer about" not in text
    exo = ep.load(SUPPORT)
    pose, man = exo.pose(60), ep.Person(1.75, 75, "male")
    answers = [exo.joint_contact(pose, man, forces=exo.reaction(pose, limits=each)) for each in ("design", "none")]
    assert answers[0].magnitude == pytest.approx(float(answers[1].magnitude), rel=1e-9)
    assert all(np.isfinite(each.relief_percent) for each in answers)


def test_ten_millimetres_in_every_direction_by_one_command(capsys):
    only = [f"--uncertain={name}=0" for name in ("pose_deg", "mass_percent", "centre_of_mass_mm", "spring_mm")]
    assert main(["uncertainty", SUPPORT, "--abduction=60", "--uncertain=offset_mm=10", "--limits=none", *only]) == 0
    exo = ep.load(SUPPORT)
    there = float(exo.reaction(exo.pose(0, 60), limits="none", centre_offset=[0.0, 0.01, 0.0]).magnitude)
    printed = capsys.readouterr().out
    row = next(line.split() for line in printed.splitlines() if line.startswith("  left "))
    assert row[2] == f"{there:.1f}"
    assert "Worst offset within 10 mm" in printed


def test_kinematics_of_a_wrist_that_is_heavier_than_its_record(capsys):
    cables = str(URDF / "six-cables.urdf")
    assert main(["kinematics", cables, "--flexion=40"]) == 0
    exo = ep.load(cables)
    first = exo.inverse_kinematics(exo.pose(40)).lengths[0]
    assert f"{1e3 * first:.3f}" in capsys.readouterr().out


@pytest.mark.full
def test_track_moves_a_device_that_is_no_wrist(capsys, tmp_path):
    table = tmp_path / "run.csv"
    assert main(["track", SERIAL, "--trajectory", "flexion", "--out", str(table)]) == 0
    assert "flexion ends at" in capsys.readouterr().out
    assert "tension_3_N" in table.read_text().splitlines()[0]
