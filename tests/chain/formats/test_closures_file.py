"""Data of joints in a closures file: read, refused, and back bit for bit."""

import re

import numpy as np
from places import page

from exo_pin.chain import ClosedChain

SLIDER_CRANK = """<robot name="robot"><link name="base"/>
<link name="crank"/><link name="rod"/><link name="slider"/>
<joint name="crank_hinge" type="continuous"><parent link="base"/><child link="crank"/><axis xyz="0 1 0"/></joint>
<joint name="rod_hinge" type="continuous"><parent link="crank"/><child link="rod"/><origin xyz="0 0 0.1"/>
<axis xyz="0 1 0"/></joint>
<joint name="slide" type="prismatic"><parent link="base"/><child link="slider"/><axis xyz="1 0 0"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""


def test_the_closures_file_of_the_documentation_closes_a_slider_crank(tmp_path):
    text = next(block for block in re.findall(r"```toml\n(.*?)```", page("formats"), re.DOTALL) if "schema" in block)
    (tmp_path / "robot.urdf").write_text(SLIDER_CRANK)
    tree = ClosedChain.from_urdf(tmp_path / "robot.urdf")
    assert tree.closures == ()
    (said,) = tree.description.left_out
    assert said.startswith("closures: there is no robot.closures.toml: read as a tree (no effect: ")
    (tmp_path / "robot.closures.toml").write_text(text)
    chain = ClosedChain.from_urdf(tmp_path / "robot.urdf")
    assert chain.roles.actuated == ("crank_hinge",)
    q = chain.close(chain.neutral())
    assert chain.mobility(q).degrees_of_freedom == 1
    start = 0.1 * chain.placement(q, "crank").rotation[:, 2]
    np.testing.assert_allclose(np.linalg.norm(chain.placement(q, "slider").translation - start), 0.3, atol=1e-12)
