"""What is drawn of a chain: visuals of the URDF, meshes, or the joints themselves."""

from mechanisms import four_bar
from scenes import commands, panel

import exo_pin as ep
from exo_pin.chain import write_closures


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
