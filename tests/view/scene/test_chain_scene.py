"""Robots that are not wrists: drawn from their URDF, or by their joints, with what closes their loops."""

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import five_bar, four_bar, planar_3rrr
from scenes import commands, panel, place
from spatial_mechanisms import delta, stewart

import exo_pin as ep
from exo_pin.chain import write_closures
from exo_pin.cli import main
from exo_pin.core import errors
from exo_pin.view import ChainScene

ROBOTS = {"four-bar": four_bar, "five-bar": five_bar, "delta": delta, "stewart": stewart, "3rrr": planar_3rrr}


def written(named, folder):
    (folder / "mine.urdf").write_text(named.urdf)
    write_closures(named.closures, folder / "mine.closures.toml")
    return folder / "mine.urdf"


def closure_places(named, q):
    """Where both frames of each closure stand, from Pinocchio's own frames."""
    model = pin.buildModelFromXML(named.urdf)
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    for closure in named.closures.closures:
        yield [
            data.oMf[model.getFrameId(frame)].act(np.array(placement.translation))
            for frame, placement in ((closure.frame_a, closure.placement_a), (closure.frame_b, closure.placement_b))
        ]


@pytest.mark.parametrize("name", ["four-bar", "five-bar", "3rrr"])
def test_closures_are_marked_where_they_are(name):
    named = ROBOTS[name]()
    scene = ChainScene(named.chain(), q=named.q)
    for index, (a, b) in enumerate(closure_places(named, named.q)):
        np.testing.assert_allclose(place(scene, f"/meshcat/closures/chain_{index}/a")[:3, 3], a, atol=1e-9)
        np.testing.assert_allclose(place(scene, f"/meshcat/closures/chain_{index}/b")[:3, 3], b, atol=1e-9)
        assert np.linalg.norm(place(scene, f"/meshcat/closures/chain_{index}/gap")[:3, :3]) < 1e-5


def test_a_joint_moves_and_the_others_follow():
    scene = ChainScene(four_bar().chain())
    before = scene.q
    q = scene.move({"crank_hinge": 1.2})
    assert q[0] == 1.2
    np.testing.assert_array_equal(scene.q, q)
    assert np.abs(scene.chain.residual(q)).max() < 1e-8
    assert np.abs(q - before)[1:].max() > 0.01
    # The tip is above what the others reach: nothing moves.
    kept = commands(scene)
    with pytest.raises(errors.LoopNotClosed):
        scene.move({"crank_hinge": 1.2, "coupler_hinge": 0.0})
    assert commands(scene) == kept
    with pytest.raises(errors.UnknownName, match="crank_hinge"):
        scene.move({"crank": 1.0})


@pytest.mark.parametrize(
    ("act", "kind", "message"),
    [
        (lambda s: ChainScene("robot.urdf"), errors.InvalidInput, "ClosedChain"),
        (lambda s: s.show([0.0, 1.0]), errors.InvalidInput, "q"),
        (lambda s: s.show([0.0, np.nan, 1.0]), errors.InvalidInput, "finite"),
        (lambda s: s.move({"crank_hinge": [0.0, 1.0]}), errors.InvalidInput, "crank_hinge"),
        (lambda s: s.record([s.q], [0.0, 1.0]), errors.InvalidInput, "a time for every configuration"),
        (lambda s: s.record([s.q, s.q], [1.0, 1.0]), errors.InvalidInput, "rise"),
    ],
)
def test_bad_input_is_refused(act, kind, message):
    with pytest.raises(kind, match=message):
        act(ChainScene(four_bar().chain()))


def test_command_shows_a_robot_that_is_no_wrist(tmp_path, capsys):
    path = written(four_bar(), tmp_path)
    page = tmp_path / "page.html"
    assert main(["view", str(path), "--set", "crank_hinge=1.2rad", "--plot", str(page)]) == 0
    told = capsys.readouterr().out
    assert "drawn as a closed chain" in told
    assert str(page) in told
    assert "MeshCat" in page.read_text()
    for arguments, said in (
        (["--set", "crank_hinge"], "JOINT=VALUE"),
        (["--set", "crank=1rad"], "crank_hinge"),
        (["--flexion", "30"], "--flexion"),
        (["--scale", "20"], "--scale"),
    ):
        assert main(["view", str(path), *arguments, "--plot", str(page)]) == 2
        assert said in capsys.readouterr().err
    assert main(["view", "prototype", "--set", "limb_1_slide=0m", "--plot", str(page)]) == 2
    assert "--flexion" in capsys.readouterr().err


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
