"""Closures files: saved and loaded, as the documentation has them, and in many threads."""

import re
import threading

import numpy as np
import pytest
from mechanisms import four_bar
from places import page

from exo_pin.chain import (
    ClosedChain,
    Closure,
    Closures,
    LimbRole,
    Placement,
    Roles,
    Root,
    read_closures,
    write_closures,
)

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


def random_closures(seed):
    rng = np.random.default_rng(seed)

    def place():
        quaternion = rng.normal(size=4)
        return Placement(tuple(rng.normal(size=3)), tuple(quaternion / np.linalg.norm(quaternion)))

    closures = (
        Closure("one", "rigid", 'a "quoted" link', "universe", place(), place()),
        Closure("zwei ü", "spherical", "b", "c", placement_b=place()),
        Closure("hinge", "revolute", "c", "d", place(), place(), axis=tuple(rng.normal(size=3))),
        Closure("rod", "distance", "d", "e", place(), distance=0.1 + rng.random()),
    )
    limb = LimbRole("limb_1", "UPU", "slide", "hip", "one")
    roles = Roles(("slide", "other"), "ball", "arm", "centre", (limb,), "cuff")
    return Closures("robot", Root("spherical", "ball", tuple(rng.normal(size=3))), closures, roles)


@pytest.mark.parametrize("seed", range(5))
def test_saving_and_loading_is_exact(tmp_path, seed):
    closures = random_closures(seed)
    path = tmp_path / "robot.closures.toml"
    write_closures(closures, path, "for a test")
    again = read_closures(path)
    assert again == closures
    write_closures(again, tmp_path / "again.toml", "for a test")
    assert path.read_bytes() == (tmp_path / "again.toml").read_bytes()


def test_one_chain_serves_many_threads():
    named = four_bar()
    chain = named.chain()
    rng = np.random.default_rng(3)
    poses = named.q + rng.uniform(-0.5, 0.5, (4, 200, 3))
    alone = [[chain.residual(q) for q in stack] for stack in poses]
    found: list = [None] * 4

    def work(index):
        found[index] = [chain.residual(q) for q in poses[index]]

    threads = [threading.Thread(target=work, args=(index,)) for index in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    np.testing.assert_array_equal(found, alone)
