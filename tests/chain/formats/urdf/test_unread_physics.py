"""What other programs add to a URDF that may change the motion, and the mass of the root link."""

import pytest

from exo_pin import FileFormatError
from exo_pin.chain import ClosedChain, Closures

LINK = """<link name="{}"{}>{}<inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>
</inertial></link>"""
JOINT = """<joint name="j" type="continuous"><parent link="a"/><child link="b"/><axis xyz="1 0 0"/>
<limit effort="1" velocity="1"/>{}</joint>"""


def robot(link="", inside="", joint=""):
    return f'<robot name="r">{LINK.format("a", "", "")}{LINK.format("b", link, inside)}{JOINT.format(joint)}</robot>'


def loaded(text):
    return ClosedChain.from_urdf(text, Closures("r"))


@pytest.mark.parametrize(
    ("made", "named"),
    [
        ({"joint": '<dynamics damping="0" friction="0" K="50"/>'}, 'K="50"'),
        ({"joint": '<dynamics mu_viscous="7"/>'}, 'mu_viscous="7"'),
        ({"inside": "<gravity>false</gravity>"}, "<gravity>false</gravity>"),
    ],
)
def test_what_is_not_read_is_said(made, named):
    with pytest.warns(RuntimeWarning, match=named):
        assert loaded(robot(**made)).model.nv == 1


def test_zeros_of_other_programs_need_no_word():
    assert loaded(robot(joint='<dynamics K="0" mu_viscous="0.0"/>')).model.nv == 1


def test_a_link_that_another_program_ignores_is_refused():
    with pytest.raises(FileFormatError, match="drake_ignore"):
        loaded(robot(link=' drake_ignore="true"'))


def test_the_root_link_keeps_its_mass_through_a_file(tmp_path):
    again = ClosedChain.from_urdf(loaded(robot()).to_urdf(tmp_path), root_joint="free_flyer")
    assert again.model.inertias[1].mass == 2.0
    assert sum(inertia.mass for inertia in again.model.inertias) == 4.0
