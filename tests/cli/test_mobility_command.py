"""``exo-pin mobility`` and ``exo-pin check`` on robots of any kind."""

import pytest
from mechanisms import delta, four_bar, planar_3rrr, stewart

from exo_pin.cli import main


def run(capsys, *arguments):
    status = main([str(argument) for argument in arguments])
    return status, *capsys.readouterr()


def test_mobility_of_a_preset(capsys):
    status, out, _ = run(capsys, "mobility", "prototype", "--flexion", "40", "--part", "orientation")
    assert status == 0
    assert "degrees of freedom   3" in out
    assert "rank 15 of 18 rows" in out
    assert "3: limb_1_base (1), limb_2_base (1), limb_3_base (1)" in out
    assert "singular             no" in out
    assert "N per N m" in out


def test_mobility_of_a_singular_pose(capsys):
    # thesis_rotation(90, 0, 0) is abduction by 90 degrees: both plates parallel.
    _, out, _ = run(capsys, "mobility", "prototype", "--abduction", "90")
    assert "singular             output" in out
    assert "inf N per N m" in out


@pytest.mark.parametrize(("make", "freedoms"), [(delta, 3), (stewart, 6), (planar_3rrr, 3)])
def test_mobility_and_check_of_any_robot(make, freedoms, capsys, robot):
    path = robot(make())
    status, out, _ = run(capsys, "mobility", path)
    assert status == 0
    assert f"degrees of freedom   {freedoms}" in out
    status, out, _ = run(capsys, "check", path)
    assert status == 0
    assert "consistent" in out
    assert f"{freedoms} degrees of freedom" in out


def test_joints_can_be_set(capsys, robot):
    path = robot(delta("rigid"))
    settings = [f"--set=motor_{i}={angle}" for i, angle in enumerate((0.2, -0.1, 0.3))]
    status, out, _ = run(capsys, "mobility", path, *settings, "--part", "position")
    assert status == 0
    assert "N m per N on platform" in out
    assert "N m per N m" not in out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--set", "motor_0=much"], "JOINT=VALUE"),
        (["--set", "motor_0=nan"], "finite"),
        (["--set", "motor_9=1"], "did you mean"),
        (["--flexion", "20"], "no arm to put into a pose"),
        (["--frame", "hand"], "unknown frame"),
    ],
)
def test_invalid_arguments_give_one_line(arguments, said, capsys, robot):
    status, out, err = run(capsys, "mobility", robot(delta("rigid")), *arguments)
    assert status == 2
    assert out == ""
    assert said in err
    assert err.count("\n") == 1


def test_a_pose_that_does_not_close_is_one_line(capsys, robot):
    # With the crank along the ground the coupler's and the rocker's lengths differ by more than what is left.
    status, _, err = run(capsys, "mobility", robot(four_bar()), "--set", "crank_hinge=0")
    assert status == 2
    assert "stay open" in err


def test_a_closed_form_of_a_robot_that_is_no_wrist_is_one_line(capsys, robot):
    status, _, err = run(capsys, "reaction", robot(stewart()))
    assert status == 2
    assert "no wrist's closed form" in err
