"""``exo-pin reaction --to``: forces in poses on a way."""

import numpy as np
import pytest
from command_line import run

import exo_pin as ep


def test_table_has_the_forces_of_each_pose(capsys):
    status, out, _ = run(capsys, "reaction", "four-cables", "--flexion", "30", "--to", "110,90,0", "--poses", "3")
    assert status == 0
    cables = ep.load("four-cables")
    lines = out.splitlines()
    first = next(k for k, line in enumerate(lines) if line.startswith("flexion, °"))
    assert cables.reaction(cables.pose([30, 70, 110], [0, 45, 90])).verdict in " ".join(lines[3:5])
    for line, flexion, abduction in zip(lines[first + 1 : first + 4], (30, 70, 110), (0, 45, 90), strict=True):
        answer = cables.reaction(cables.pose(flexion, abduction))
        *numbers, held = line.split()
        expected = [flexion, abduction, 0, answer.magnitude, answer.percent_body_weight, *answer.actuator_forces]
        np.testing.assert_allclose([float(number) for number in numbers], expected, atol=0.051)
        assert held == ("yes" if answer.can_hold else "no")
    assert "would have to supply" in out


def test_exit_status_and_missing_numbers(capsys):
    status, out, _ = run(capsys, "reaction", "prototype", "--to", "0,90,0", "--poses", "2", "--require-hold")
    assert status == 1
    assert out.count(" - ") >= 3  # singular at 90° of abduction
    assert "-0.0" not in out


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["--table"], "--table"),
        (["--poses", "1"], "from 2"),
        (["--to", "90"], "F,A,I"),
        (["--out", "x.txt"], "--out"),
    ],
)
def test_wrong_arguments_are_one_line(capsys, arguments, word):
    status, _, err = run(capsys, "reaction", "four-cables", "--to", "90,0,0", *arguments)
    assert status == 2
    assert len(err.splitlines()) == 1
    assert word in err
