"""Every command on either shoulder, with a robot's file and with a preset: the same numbers up to the mirror image."""

import itertools
import json
import math
import re

import pytest
from places import REPOSITORY, URDF

from exo_pin.cli import COMMANDS, main

SERIAL, NESM = str(URDF / "serial-y-x-z.urdf"), str(URDF / "nesm.urdf")
DESIGNS = {"robot": SERIAL, "preset": "four-cables"}
MAN = ["--person", "1.75,75,male"]
POSE = ["--flexion", "50", "--abduction", "30", "--internal-rotation", "10"]
LIFT = ["--trajectory", str(REPOSITORY / "examples" / "lift.csv")]
#: Words of each command after the design.
QUESTIONS = {
    "reaction": [*POSE, *MAN, "--elbow-flexion", "60", "--payload", "1", "--json"],
    "reaction on a way": [*POSE, *MAN, "--to", "80,10,0", "--poses", "4", "--json"],
    "reaction of a movement": [*MAN, *LIFT, "--json"],
    "person": [*POSE, *MAN, "--json"],
    "uncertainty": [*POSE, *MAN, "--json"],
    "compare": [NESM, *MAN, "--step", "30", "--json"],
    "kinematics": [*POSE, "--json"],
    "singularity": [*POSE, "--json"],
    "check": ["--json"],
    "mobility": [],
    "forces": ["--json"],
    "workspace": [*MAN, "--step", "30", "--json"],
    "tasks": [*MAN, "--step", "30", "--json"],
    "parts": [*MAN, "--step", "30", "--json"],
    "report": [*MAN, "--json"],
}
#: Answered by wrists alone.
OF_WRISTS = {
    "sweep": ["--vary", "scale=0.9,1", *MAN, "--step", "45", "--json"],
    "track": ["--experiment", "abduction", "--no-progress", "--json"],
}
#: What has its own value for each design, and what random numbers of a fixed seed estimate.
APART = ("sha256", "design_hash", "force_noise", "versions")


#: Lists by fixed directions of the base frame, which the mirror exchanges.
DIRECTIONS = (".worst_offset.magnitudes", ".worst_offset.directions")


def told(capsys, *words):
    """What a command prints, as data where it is JSON."""
    status = main(list(words))
    printed = capsys.readouterr()
    assert status == 0, printed.err
    return json.loads(printed.out) if "--json" in words else printed.out


def differences(one, two, path=""):
    """Places where two answers differ by more than a sign, rounding, or the name of a side."""
    if isinstance(one, dict):
        assert one.keys() == two.keys(), path
        return [found for key in one if key not in APART for found in differences(one[key], two[key], f"{path}.{key}")]
    if isinstance(one, list):
        assert len(one) == len(two), path
        if path.endswith(DIRECTIONS):
            one, two = (sorted(each, key=lambda item: (item is None, item or 0.0)) for each in (one, two))
        pairs = enumerate(zip(one, two, strict=True))
        return [found for k, pair in pairs for found in differences(*pair, f"{path}[{k}]")]
    if isinstance(one, float) and isinstance(two, float):
        same = math.isclose(abs(one), abs(two), rel_tol=1e-5, abs_tol=1e-6) or (math.isnan(one) and math.isnan(two))
    elif isinstance(one, str) and isinstance(two, str):
        # Sizes of rounding errors say nothing.
        one, two = (re.sub(r"\d\.\de[-+]\d\d", "rounding", text) for text in (one, two))
        same = one in (two, two.replace("right", "left"))
    else:
        same = one == two
    return [] if same else [(path, one, two)]


#: Questions that take seconds of a robot.
SLOW = {"reaction", "reaction on a way", "reaction of a movement", "uncertainty", "compare", "tasks", "parts", "report"}
ASKED = [
    pytest.param(
        design,
        question,
        marks=pytest.mark.full if question in SLOW and (design == "robot" or question == "report") else (),
    )
    for design, question in itertools.product(DESIGNS, QUESTIONS)
]


@pytest.mark.parametrize(("design", "question"), ASKED)
def test_a_command_has_the_same_numbers_on_both_shoulders(question, design, capsys):
    command = question.split()[0], DESIGNS[design], *QUESTIONS[question]
    one, two = (told(capsys, *command, "--side", side) for side in ("left", "right"))
    assert differences(one, two) == []


@pytest.mark.parametrize("command", ["sweep", pytest.param("track", marks=pytest.mark.full)])
def test_a_command_of_wrists_has_the_same_numbers_on_both_shoulders(command, capsys):
    words = command, DESIGNS["preset"], *OF_WRISTS[command]
    one, two = (told(capsys, *words, "--side", side) for side in ("left", "right"))
    assert differences(one, two) == []


@pytest.mark.parametrize("design", ["preset", pytest.param("robot", marks=pytest.mark.full)])
def test_what_is_written_on_the_right_is_the_mirror_image(design, tmp_path, capsys):
    name = DESIGNS[design]
    for side in ("left", "right"):
        assert main(["export", name, "--side", side, "--out", str(tmp_path / f"{side}.urdf")]) == 0
        assert main(["view", name, "--side", side, *POSE, "--plot", str(tmp_path / f"{side}.html")]) == 0
    capsys.readouterr()
    question = "reaction", POSE, "--limits", "none"
    one, two, back = (
        told(capsys, "reaction", str(tmp_path / f"{file}.urdf"), *POSE, "--limits", "none", "--json", *more)
        for file, more in (("left", []), ("right", []), ("right", ["--side", "left"]))
    )
    assert (one["side"], two["side"], back["side"]) == ("left", "right", "left"), question
    forces = [each["spherical"]["shoulder_force"] for each in (one, two, back)]
    size = max(map(abs, forces[0]))
    assert forces[1] == pytest.approx([forces[0][0], -forces[0][1], forces[0][2]], abs=1e-8 * size)
    assert forces[2] == pytest.approx(forces[0], abs=1e-8 * size)


def test_every_command_with_a_side_is_asked_on_both(capsys):
    """A new command belongs into a table above."""
    asked = {question.split()[0] for question in (*QUESTIONS, *OF_WRISTS)} | {"export", "view"}
    having = set()
    for name in COMMANDS:
        assert main([*name.split(), "--help"]) == 0
        if "--side CHOICE" in capsys.readouterr().out:
            having.add(name)
    # A search on either side takes its time; a calibration and a record are of one; a page has the answers of reaction.
    assert having - asked <= {"optimise", "calibrate", "record", "app"}
