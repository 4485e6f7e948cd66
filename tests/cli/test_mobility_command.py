"""``exo-pin mobility`` and ``exo-pin check`` on robots of any kind."""

import pytest
from closed_chains import CHAINS
from mechanisms import four_bar, planar_3rrr
from spatial_mechanisms import delta, stewart

import exo_pin as ep
from exo_pin.chain import ClosedChain
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
    settings = [f"--set=motor_{i}={angle}rad" for i, angle in enumerate((0.2, -0.1, 0.3))]
    status, out, _ = run(capsys, "mobility", path, *settings, "--part", "position")
    assert status == 0
    assert "N m per N on platform" in out
    assert "N m per N m" not in out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--set", "motor_0=much"], "JOINT=VALUE"),
        (["--set", "motor_0=1"], "with a unit"),
        (["--set", "motor_0=20mm"], "in deg or rad"),
        (["--set", "motor_0=nandeg"], "finite"),
        (["--set", "motor_9=1deg"], "did you mean"),
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
    status, _, err = run(capsys, "mobility", robot(four_bar()), "--set", "crank_hinge=0deg")
    assert status == 2
    assert "stay open" in err


def test_a_closed_form_of_a_robot_that_is_no_wrist_is_one_line(capsys, robot):
    status, _, err = run(capsys, "reaction", robot(stewart()))
    assert status == 2
    assert "expected the arm" in err


UNIVERSAL = """<mujoco model="swinging"><worldbody><body name="rod" pos="0 0 1">
<joint name="swing_x" axis="1 0 0"/><joint name="swing_y" axis="0 1 0"/>
<geom type="capsule" size="0.01" fromto="0 0 0 0 0 -0.5"/><site name="end" pos="0 0 -0.5"/></body>
<body name="post" pos="0 0 -0.2"><freejoint/><geom type="sphere" size="0.1"/><site name="top" pos="0 0 0.7"/></body>
</worldbody><equality><connect name="pin" site1="end" site2="top"/></equality></mujoco>"""


@pytest.mark.parametrize("ending", ["xml", "sdf"])
def test_robots_are_read_from_mjcf_and_sdf(ending, capsys, tmp_path):
    chain, q = CHAINS["four_bar"]
    path = {"xml": chain.to_mjcf, "sdf": chain.to_sdf}[ending](tmp_path, q)
    assert path.suffix == f".{ending}"
    _, out, _ = run(capsys, "mobility", path)
    assert "degrees of freedom   1" in out
    _, out, _ = run(capsys, "check", path)
    assert "consistent" in out
    _, out, _ = run(capsys, "forces", path)
    assert f"{chain.closures[0].name} on " in out
    for target in ("urdf", "xml", "sdf"):
        status, out, _ = run(capsys, "export", path, "--out", tmp_path / f"again.{target}")
        assert status == 0
        again = ep.load(out.splitlines()[0]).chain
        assert sorted(again.model.names) == sorted(chain.model.names)
        assert again.mobility(again.close(again.neutral())).degrees_of_freedom == 1


def test_a_ball_joint_cannot_be_written_as_urdf(capsys, tmp_path):
    (tmp_path / "b.xml").write_text(
        """<mujoco model="b"><worldbody><body><joint/><geom size="0.1"/><body pos="0 0 1">
        <joint name="hip" type="ball"/><geom size="0.1"/></body></body></worldbody></mujoco>"""
    )
    status, _, err = run(capsys, "export", tmp_path / "b.xml", "--out", tmp_path / "b.urdf")
    assert status == 2
    assert "'hip', which is ball: write MJCF or SDF" in err


def test_massless_bodies_between_two_hinges_leave_no_motion_without_inertia(capsys, tmp_path):
    (tmp_path / "swinging.xml").write_text(UNIVERSAL)
    assert 0.0 in [inertia.mass for inertia in list(ClosedChain.from_mjcf(UNIVERSAL).model.inertias)[1:]]
    _, out, _ = run(capsys, "check", tmp_path / "swinging.xml")
    assert "every motion has inertia" in out


def test_a_massless_link_at_the_end_moves_no_mass(capsys, tmp_path):
    (tmp_path / "end.urdf").write_text(
        """<robot name="end"><link name="base"/><link name="tip"/><joint name="wrist" type="continuous">
        <parent link="base"/><child link="tip"/><axis xyz="0 0 1"/></joint></robot>"""
    )
    (tmp_path / "end.closures.toml").write_text('schema = 1\nname = "end"\n')
    _, out, _ = run(capsys, "check", tmp_path / "end.urdf")
    assert "moving wrist moves no mass" in out
