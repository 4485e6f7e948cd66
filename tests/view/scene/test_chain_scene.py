"""Robots that are not wrists: drawn from their URDF, or by their joints, with what closes their loops."""

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import five_bar, four_bar, planar_3rrr
from scenes import commands, moved_nodes, panel, place, placements, pose
from spatial_mechanisms import delta, stewart

import exo_pin as ep
from exo_pin.chain import write_closures
from exo_pin.cli import main
from exo_pin.core import errors
from exo_pin.view import ChainScene, Scene
from exo_pin.wrist_chain import mechanism_urdf

ROBOTS = {"four-bar": four_bar, "five-bar": five_bar, "delta": delta, "stewart": stewart, "3rrr": planar_3rrr}


def written(named, folder):
    (folder / "mine.urdf").write_text(named.urdf)
    write_closures(named.closures, folder / "mine.closures.toml")
    return folder / "mine.urdf"


VISUAL = pin.GeometryType.VISUAL


def bare(exo):
    """Model and XML of the wrist with the same points that are on no circles."""
    geometry = ep.WristGeometry(exo.geometry.base_points, exo.geometry.platform_points)
    xml, _ = mechanism_urdf(exo.replace(geometry=geometry).mechanism)
    return pin.buildModelFromXML(xml), xml


def drawn(scene):
    return {item["path"] for item in commands(scene) if item["type"] == "set_object"}


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


@pytest.mark.parametrize("name", ROBOTS)
def test_any_robot_is_viewed(name, tmp_path):
    named = ROBOTS[name]()
    scene = ep.load(written(named, tmp_path)).view()
    assert isinstance(scene, ChainScene)
    assert scene.messages == ()
    chain = named.chain()
    # Closed as it opens, with as many freedoms as Pinocchio counts, and its joints by name.
    assert np.abs(chain.residual(scene.q)).max() < 1e-8
    numbers = panel(scene, "numbers")
    assert numbers["title"] == named.closures.name
    assert numbers["values"][0]["value"] == f"{chain.mobility(scene.q).degrees_of_freedom}"
    for joint in named.closures.roles.actuated:
        assert joint in numbers["pose"]
    # A ball at every joint, in Pinocchio's place.
    placements = chain.placements(scene.q)
    for joint in chain.model.names[1:]:
        ball = place(scene, f"/meshcat/chain/visuals/{joint}_joint")
        np.testing.assert_allclose(ball[:3, 3], placements[joint].translation, atol=1e-9)


@pytest.mark.parametrize("name", ["four-bar", "five-bar", "3rrr"])
def test_closures_are_marked_where_they_are(name):
    named = ROBOTS[name]()
    scene = ChainScene(named.chain(), q=named.q)
    for index, (a, b) in enumerate(closure_places(named, named.q)):
        np.testing.assert_allclose(place(scene, f"/meshcat/closures/chain_{index}/a")[:3, 3], a, atol=1e-9)
        np.testing.assert_allclose(place(scene, f"/meshcat/closures/chain_{index}/b")[:3, 3], b, atol=1e-9)
        assert np.linalg.norm(place(scene, f"/meshcat/closures/chain_{index}/gap")[:3, :3]) < 1e-5


def test_an_open_loop_shows_its_gap_and_says_so():
    named = four_bar()
    scene = ChainScene(named.chain(), q=named.q)
    assert not any("open" in note["text"] for note in panel(scene, "numbers")["notes"])
    assert [item["text"] for item in panel(scene, "legend")["items"]] == ["actuated joint", "joint", "closes a loop"]
    ajar = named.q + np.array([0.1, -0.2, 0.15])
    scene.show(ajar)
    ((a, b),) = closure_places(named, ajar)
    gap = place(scene, "/meshcat/closures/chain_0/gap")
    np.testing.assert_allclose(gap[:3, 3], a, atol=1e-9)
    np.testing.assert_allclose(gap[:3, 3] + gap[:3, 2], b, atol=1e-9)
    size = np.abs(named.chain().residual(ajar)).max()
    assert f"gap of {size:.2g}" in " ".join(note["text"] for note in panel(scene, "numbers")["notes"])
    assert panel(scene, "legend")["items"][-1]["text"] == "gap of an open loop"
    # What no closed configuration has is not told.
    assert panel(scene, "numbers")["values"] == []


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


def test_a_motion_is_recorded():
    scene = ChainScene(four_bar().chain())
    path = np.array([scene.move({"crank_hinge": angle}) for angle in (1.5, 1.6, 1.7)])
    recording = scene.record(path, [0.0, 0.2, 0.4])
    assert recording.reaction is None
    assert "/meshcat/chain/visuals/universe_rod_0" not in recording._frames["moving"]
    assert "/meshcat/chain/visuals/coupler_hinge_joint" in recording._frames["moving"]
    poses = [frame["numbers"]["pose"] for frame in recording._frames["panels"]]
    assert poses == [f"crank_hinge {angle:.1f}°" for angle in np.degrees([1.5, 1.6, 1.7])]
    assert "data:" in recording.html()
    scene.play(path, [0.0, 0.01, 0.02])
    np.testing.assert_array_equal(scene.q, path[-1])


def test_a_configuration_moves_only_what_moves():
    scene = ChainScene(four_bar().chain())
    old = placements(scene)
    q = scene.move({"crank_hinge": 1.4})
    new = placements(scene)
    moved = moved_nodes(old, new)
    assert "/meshcat/chain/visuals/coupler_hinge_joint" in moved
    assert not any("universe" in path for path in moved)
    serial = scene.serial
    scene.show(q)
    assert not moved_nodes(new, placements(scene))
    assert scene.serial == serial


def test_a_view_refuses_what_a_robot_without_an_arm_has_not(tmp_path):
    robot = ep.load(written(four_bar(), tmp_path))
    for option in ({"limbs": "muscles"}, {"human": True}, {"metres_per_newton": 0.01}, {"device": True}):
        with pytest.raises(ep.InvalidInput, match=next(iter(option))):
            robot.view(**option)


def test_a_wrist_whose_links_carry_mass_is_drawn_as_a_wrist_with_its_forces(tmp_path, capsys):
    prototype = ep.load("prototype")
    path = prototype.to_urdf(tmp_path)
    heavy = ep.load(path)
    scene = Scene(heavy, human=False)
    assert scene.messages == ()
    answer = scene.show(pose(60, 30, 0))
    np.testing.assert_allclose(answer.shoulder_force, heavy.reaction(pose(60, 30, 0)).shoulder_force)
    assert panel(scene, "numbers")["values"][0]["value"] == f"{answer.magnitude:.1f} N"
    assert f"shoulder {answer.magnitude:.0f} N" in [label["text"] for label in panel(scene, "labels")]
    # It stands where the prototype stands.
    other = Scene(prototype, human=False)
    other.show(pose(60, 30, 0))
    for i in range(3):
        body = f"/meshcat/exo/visuals/limb_{i + 1}_platform_body_0"
        np.testing.assert_allclose(place(scene, body), place(other, body), atol=1e-9)
    # Its looks are its own: the rings' arcs, which points alone do not tell.
    shapes = {
        shape.name
        for shape in pin.buildGeomFromUrdf(pin.buildModelFromUrdf(str(path)), str(path), VISUAL).geometryObjects
    }
    assert {f"/meshcat/exo/visuals/{name}" for name in shapes} <= drawn(scene)
    assert len(shapes) > len(pin.buildGeomFromUrdfString(*bare(prototype), VISUAL).geometryObjects)
    # One whose masses the record holds has its forces.
    scene.replace_exo(ep.load(prototype.to_urdf(tmp_path / "light", assumed=None)))
    assert scene.messages == ()
    assert scene.show(pose(60, 30, 0)) is not None
    page = tmp_path / "page.html"
    assert main(["view", str(path), "--flexion", "60", "--no-human", "--plot", str(page)]) == 0
    assert "no forces" not in capsys.readouterr().out
    assert ep.load(written(four_bar(), tmp_path)).wrist is None


def seen(scene, points, aspect=1.4):
    """Which points a picture of that width over height holds; a pinhole camera, z upwards."""
    camera = panel(scene, "camera")
    eye, target = np.array(camera["position"]), np.array(camera["target"])
    ahead = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    up, away, edge = np.cross(right, ahead), points - eye, np.tan(np.radians(camera["angle"] / 2))
    depth = away @ ahead
    return (np.abs(away @ up) < edge * depth) & (np.abs(away @ right) < aspect * edge * depth)


@pytest.mark.parametrize("name", ROBOTS)
def test_all_of_it_is_in_the_picture(name):
    named = ROBOTS[name]()
    scene = ChainScene(named.chain(), q=named.q)
    joints = [place.translation for place in named.chain().placements(named.q).values()]
    assert seen(scene, np.array(joints)).all()


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
