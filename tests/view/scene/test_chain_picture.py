"""What is drawn of a chain: visuals of the URDF, meshes, or the joints themselves."""

import numpy as np
import pytest
from mechanisms import four_bar
from scenes import URDF, commands, panel, place
from spatial_mechanisms import delta

import exo_pin as ep
from exo_pin.chain import write_closures
from exo_pin.view import ChainScene


def written(named, folder):
    (folder / "mine.urdf").write_text(named.urdf)
    write_closures(named.closures, folder / "mine.closures.toml")
    return folder / "mine.urdf"


def drawn(scene):
    return {item["path"] for item in commands(scene) if item["type"] == "set_object"}


def test_a_missing_mesh_is_told_and_the_joints_are_drawn(tmp_path):
    named = four_bar()
    mesh = '<visual><geometry><mesh filename="nowhere.stl"/></geometry></visual>'
    xml = named.urdf.replace('<link name="crank">', f'<link name="crank">{mesh}', 1)
    path = written(named._replace(urdf=xml), tmp_path)
    scene = ep.load(path).view()
    assert "nowhere.stl" in scene.messages[0]
    assert "/meshcat/chain/visuals/crank_hinge_joint" in drawn(scene)
    assert any("nowhere.stl" in note["text"] for note in panel(scene, "numbers")["notes"])


def test_meshes_beside_the_urdf_are_found(tmp_path):
    named = four_bar()
    corners = "".join(f"vertex {x} {y} 0\n" for x, y in ((0, 0), (1, 0), (0, 1)))
    shape = f"solid a\nfacet normal 0 0 1\nouter loop\n{corners}endloop\nendfacet\nendsolid a\n"
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes/tri.stl").write_text(shape)
    mesh = f'<visual><geometry><mesh filename="package://{tmp_path.name}/meshes/tri.stl"/></geometry></visual>'
    xml = named.urdf.replace('<link name="crank">', f'<link name="crank">{mesh}', 1)
    scene = ep.load(written(named._replace(urdf=xml), tmp_path)).view()
    assert scene.messages == ()
    assert "/meshcat/chain/visuals/crank_0" in drawn(scene)


def test_a_wrists_missing_mesh_is_told(tmp_path):
    path = ep.load("prototype").to_urdf(tmp_path, assumed=None)
    mesh = '<visual><geometry><mesh filename="nowhere.stl"/></geometry></visual>'
    text = path.read_text()
    assert '<link name="arm">' in text
    path.write_text(text.replace('<link name="arm">', f'<link name="arm">{mesh}', 1))
    scene = ep.load(path).view(human=False)
    assert "nowhere.stl" in scene.messages[0]
    assert "/meshcat/exo/visuals/arm_0" in drawn(scene)


def test_a_distance_closure_is_a_line():
    named = delta()
    scene = ChainScene(named.chain(), q=named.q)
    assert {closure.type for closure in named.closures.closures} == {"distance"}
    for index, closure in enumerate(named.closures.closures):
        line = place(scene, f"/meshcat/closures/chain_{index}/gap")[:3, 2]
        assert np.linalg.norm(line) == pytest.approx(closure.distance)
        assert f"{closure.name}: {closure.distance:g} m apart" in [item["text"] for item in panel(scene, "labels")]


def test_the_dummys_shoulder_has_no_closures_and_is_drawn():
    scene = ep.load(URDF / "dummy-shoulder.urdf").view()
    assert not any("closures" in path for path in drawn(scene))
    assert panel(scene, "numbers")["values"][0]["value"] == "3"
