import dataclasses
import threading
import tomllib

import numpy as np
import pytest
from mechanisms import four_bar, random_loop
from scipy.spatial.transform import Rotation

from exo_pin import FileFormatError, UnknownName
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

GOOD = """
schema = 1
name = "robot"
[[closures]]
name = "loop"
type = "point"
frame_a = "hand"
frame_b = "universe"
translation_b_mm = [400.0, 0.0, 0.0]
"""


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


def test_units_aliases_and_defaults(tmp_path):
    path = tmp_path / "robot.toml"
    path.write_text(GOOD)
    closures = read_closures(path)
    assert closures.root == Root("fixed", "root_joint", (0.0, 0.0, -9.81))
    assert closures.closures == (Closure("loop", "spherical", "hand", "universe", placement_b=Placement((0.4, 0, 0))),)
    assert closures.rows == 3
    assert closures.roles == Roles()


@pytest.mark.parametrize("axis", [(0, 0, 2.0), (0, 0, -1.0), (1.0, 0, 0), (0.3, -0.4, 0.5), (1e-9, 0, -1.0)])
def test_an_axis_is_the_z_axis_of_a_turned_frame(axis):
    # A revolute closure about its axis leaves turning about it free, and nothing else.
    named = random_loop("revolute")
    (given,) = named.closures.closures
    other = dataclasses.replace(given, axis=axis)
    chain = ClosedChain.from_urdf(named.urdf, dataclasses.replace(named.closures, closures=(other,)))
    (pose,) = chain._state.topology.local[:, 0]
    carrier = Rotation.from_quat(given.placement_a.quaternion)
    expected = carrier.apply(np.array(axis) / np.linalg.norm(axis))
    np.testing.assert_allclose(pose[2], expected, atol=1e-12)
    np.testing.assert_allclose(pose[:3] @ pose[:3].T, np.eye(3), atol=1e-14)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(FileFormatError, match="nowhere"):
        read_closures(tmp_path / "nowhere.toml")


def test_a_urdf_that_is_none_is_refused(tmp_path):
    named = four_bar()
    with pytest.raises(FileFormatError, match="URDF"):
        ClosedChain.from_urdf("<robot", named.closures)
    with pytest.raises(FileFormatError, match="nowhere"):
        ClosedChain.from_urdf(tmp_path / "nowhere.urdf", named.closures)
    (said,) = ClosedChain.from_urdf(named.urdf).description.left_out
    assert said.startswith("closures: there is no closures file: read as a tree (no effect: ")
    with pytest.raises(UnknownName, match="spherical"):
        ClosedChain.from_urdf(named.urdf, named.closures, root_joint="hinge")
    mimic = named.urdf.replace("</joint>", '<mimic joint="coupler"/></joint>', 1)
    with pytest.raises(FileFormatError, match="mimic"):
        ClosedChain.from_urdf(mimic, named.closures)


def test_the_closures_file_beside_the_urdf_is_found(tmp_path):
    named = four_bar()
    (tmp_path / "four.urdf").write_text(named.urdf)
    write_closures(named.closures, tmp_path / "four.closures.toml")
    assert tomllib.loads((tmp_path / "four.closures.toml").read_text())["name"] == "four_bar"
    chain = ClosedChain.from_urdf(tmp_path / "four.urdf")
    assert chain.description == named.closures


def test_root_joint_and_gravity_of_the_file_are_applied():
    named = four_bar()
    leaning = dataclasses.replace(named.closures, root=Root("free_flyer", "float", (1.0, 2.0, -9.0)))
    chain = ClosedChain.from_urdf(named.urdf, leaning)
    assert chain.model.names[1] == "float"
    np.testing.assert_array_equal(chain.model.gravity.linear, [1.0, 2.0, -9.0])
    assert ClosedChain.from_urdf(named.urdf, leaning, root_joint="fixed").model.nv == 3


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
