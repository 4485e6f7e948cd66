"""Older layouts of robot.yaml: the same robots as in the present one, and refusals."""

import numpy as np
import pinocchio as pin
import pytest
from exported_robots import exported

from exo_pin.chain import ClosedChain
from exo_pin.core.errors import FileFormatError, InvalidInput, UnknownName

PRESENT = "closed_loop: [['loop1_A', 'loop1_B']]\ntype: ['6d']\n"
SEARCHED = 'name_closedloop: "loop"\nclosed_loop_number: 1\ntype: "6D"\n'
MOTORS = 'name_mot: "mot"\n'


def same(one, other):
    """Whether two chains have the same joints, loops, actuated joints and residuals."""
    q = pin.integrate(one.model, one.neutral(), np.linspace(0.1, 0.5, one.model.nv))
    return (
        list(one.model.names) == list(other.model.names)
        and [closure.type for closure in one.closures] == [closure.type for closure in other.closures]
        and one.roles.actuated == other.roles.actuated
        and np.array_equal(one.residual(one.close(q)), other.residual(other.close(q)))
        and np.array_equal(one.close(q), other.close(q))
    )


@pytest.mark.parametrize(
    ("older", "more", "loops", "balls"),
    [
        (SEARCHED, "", PRESENT, ""),
        (SEARCHED.replace("6D", "3D"), "", PRESENT.replace("6d", "3d"), ""),
        (SEARCHED.replace("6D", "planar"), "", PRESENT, ""),
        (SEARCHED.replace("1\n", "-1\n"), "", PRESENT, ""),
        (SEARCHED.replace("closed_loop_number: 1\n", ""), "", PRESENT, ""),
        (SEARCHED.replace("1\n", "0\n"), "", "closed_loop: []\ntype: []\n", ""),
        (SEARCHED, "rotule_name: free2\n", PRESENT, "joint_name: ['free2']\njoint_type: ['SPHERICAL']\n"),
        (PRESENT, "Lidmot: [0, 3]\nLidvmot: [0, 3]\n", PRESENT, ""),
        (
            PRESENT,
            "rotule_name: free1\nLidmot: [0, 6]\nLidvmot: [0, 5]\n",
            PRESENT,
            "joint_name: ['free1']\njoint_type: ['SPHERICAL']\n",
        ),
    ],
)
def test_an_older_layout_is_the_same_robot(older, more, loops, balls, tmp_path):
    for name in ("older", "present"):
        (tmp_path / name).mkdir()
    chain = ClosedChain.from_parallel_robot(exported(tmp_path / "older", older, more, MOTORS))
    assert same(chain, ClosedChain.from_parallel_robot(exported(tmp_path / "present", loops, balls)))
    assert chain.roles.actuated == ("mot1", "mot2")


@pytest.mark.parametrize(
    ("older", "more", "error", "said"),
    [
        (SEARCHED.replace('"loop"', '"lop"'), "", FileFormatError, "contain lop1, got none"),
        (SEARCHED.replace(": 1", ": 2"), "", FileFormatError, "contain loop2, got none"),
        (SEARCHED.replace(": 1", ": -2"), "", FileFormatError, "whole number"),
        (SEARCHED.replace(": 1", ": true"), "", FileFormatError, "whole number"),
        (SEARCHED.replace("6D", "4D"), "", UnknownName, "planar"),
        (SEARCHED.replace('"6D"', "['6D']"), "", UnknownName, "closed loops"),
        (SEARCHED.replace('"loop"', '""'), "", FileFormatError, "to be a text"),
        (SEARCHED, PRESENT.splitlines()[0], FileFormatError, "got both"),
        (SEARCHED.replace('name_closedloop: "loop"\n', ""), "", FileFormatError, "beside it"),
        (SEARCHED, "rotule_name: rotule\n", UnknownName, "spherical joint"),
        (SEARCHED, "rotule_name: free1\njoint_name: ['free2']\n", FileFormatError, "got both"),
        (PRESENT, "Lidmot: [0, 4]\n", FileFormatError, r"expected \[0, 3\]"),
        (PRESENT, "Lidvmot: 0\n", FileFormatError, r"expected \[0, 3\]"),
        (PRESENT.replace("6d", "planar"), "", UnknownName, "3d, 6d"),
    ],
)
def test_a_bad_older_layout_is_refused(older, more, error, said, tmp_path):
    with pytest.raises(error, match=said):
        ClosedChain.from_parallel_robot(exported(tmp_path, older, more, MOTORS))


def test_a_name_that_no_joint_contains_is_refused(tmp_path):
    with pytest.raises(UnknownName, match="actuated joint"):
        ClosedChain.from_parallel_robot(exported(tmp_path, SEARCHED, "", 'name_mot: "motor"\n'))


def test_a_loop_with_three_ends_is_refused(tmp_path):
    folder = exported(tmp_path, SEARCHED, "", MOTORS)
    text = (folder / "robot.urdf").read_text().replace('"ball_2"', '"loop1_C"')
    (folder / "robot.urdf").write_text(text)
    with pytest.raises(FileFormatError, match="two frames"):
        ClosedChain.from_parallel_robot(folder)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('rpy="1e-40 -3e-40 0"/><parent link="rod"/>', 'rpy="0.01 0 0"/><parent link="rod"/>'),  # a tilted axis
        ('xyz="-0.2 0.1 0"', 'xyz="-0.2 0.1 0.02"'),  # an end beside the plane
        ('<axis xyz="0 0 1"/>', '<axis xyz="0 1 0"/>'),  # an axis in the plane
    ],
)
def test_a_planar_loop_that_is_not_plane_is_refused(old, new, tmp_path):
    # A rigid closure would hold such a loop, and a planar one would let it move.
    folder = exported(tmp_path, SEARCHED.replace("6D", "planar"), "", MOTORS)
    text = (folder / "robot.urdf").read_text()
    assert old in text
    (folder / "robot.urdf").write_text(text.replace(old, new, 1))
    with pytest.raises(FileFormatError, match="leaves its plane"):
        ClosedChain.from_parallel_robot(folder)


def test_rounded_right_angles_of_a_planar_loop(tmp_path):
    # The tilt of 1.5708 in place of pi/2 is no plane loop; read as a right angle it is.
    folder = exported(tmp_path, SEARCHED.replace("6D", "planar"), "", MOTORS)
    text = (folder / "robot.urdf").read_text()
    text = text.replace('rpy="1e-40 -3e-40 0"/><parent link="base"/>', 'rpy="3.14159 0 0"/><parent link="base"/>')
    text = text.replace('0.3 0.4 0" rpy="1e-40 -3e-40 0"', '0.3 0.4 0" rpy="3.14159 0 0"')
    (folder / "robot.urdf").write_text(text)
    with pytest.raises(FileFormatError, match="right_angle_tolerance"):
        ClosedChain.from_parallel_robot(folder)
    chain = ClosedChain.from_parallel_robot(folder, right_angle_tolerance=2e-5)
    q = chain.close(np.linspace(0.1, 0.5, chain.model.nq))
    assert chain.mobility(q).degrees_of_freedom == 3


def test_a_link_and_a_joint_of_one_name_in_two_places(tmp_path):
    """Exporters write links and joints of one name that are not each other's."""
    folder = exported(tmp_path, PRESENT)
    plain = ClosedChain.from_parallel_robot(folder)
    text = (folder / "robot.urdf").read_text()
    (folder / "robot.urdf").write_text(text.replace('"rod_3"', '"mot1"'))
    chain = ClosedChain.from_parallel_robot(folder)
    assert same(chain, plain)
    q = chain.close(np.linspace(0.1, 0.5, chain.model.nq))
    assert "mot1" not in chain.placements(q)
    # Joints are found by their names; a frame of that name could be either.
    forces, theirs = (item.inverse_dynamics(q, actuated=["mot1", "mot2", "free1"]) for item in (chain, plain))
    assert forces.effort("mot1") == theirs.effort("mot1")
    for call in (
        lambda: chain.placement(q, "mot1"),
        lambda: chain.inverse_dynamics(q, external={"mot1": np.zeros(6)}),
        lambda: forces.wrench_on("mot1"),
        lambda: forces.joint_reaction("free1", in_frame="mot1"),
        lambda: ClosedChain.from_parallel_robot(exported_with(folder, "closed_loop: [['mot1', 'loop1_B']]")),
    ):
        with pytest.raises(InvalidInput, match="two frames in different places have the name 'mot1'"):
            call()


def exported_with(folder, loops):
    """The same folder with another loop."""
    (folder / "robot.yaml").write_text(f"{loops}\ntype: ['6d']\nname_mot: ['mot1']\n")
    return folder
