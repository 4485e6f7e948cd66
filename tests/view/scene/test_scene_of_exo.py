"""The scene without a browser: what moves, what is said, what is refused."""

import sys
from contextlib import closing
from urllib.request import urlopen

import numpy as np
import pinocchio as pin
import pytest
from described_scenes import read
from scenes import URDF, commands, has_human, moved_nodes, panel, place, placements, pose

import exo_pin as ep
from exo_pin.core import errors
from exo_pin.view import Scene, find_browser
from exo_pin.wrist_chain import mechanism_urdf


def test_the_scene_uses_the_mechanisms_own_visuals(exo):
    scene = Scene(exo, human=False)
    scene.show(pose(60, 30, 0))
    xml, _ = mechanism_urdf(exo.mechanism)
    model = exo.chain.model
    visuals = pin.buildGeomFromUrdfString(model, xml, pin.GeometryType.VISUAL)
    drawn = {item["path"] for item in commands(scene) if item["type"] == "set_object"}
    # Harness and cuff take the place of the rods between the joints.
    names = [shape.name for shape in visuals.geometryObjects]
    assert all(f"/meshcat/exo/visuals/{name}" in drawn for name in names if "body" in name or "cross" in name)
    assert {"/meshcat/exo/harness/frame", "/meshcat/exo/cuff/sleeve"} <= drawn
    # The limb's halves start at A and B of the closed form and point along the limb.
    state = exo.inverse_kinematics(pose(60, 30, 0))
    for i in range(3):
        matrix = place(scene, f"/meshcat/exo/visuals/limb_{i + 1}_platform_body_0")
        np.testing.assert_allclose(np.abs(matrix[:3, 2] @ state.directions[i]), 1.0, atol=1e-9)
        away = matrix[:3, 3] - state.platform_points[i]
        np.testing.assert_allclose(np.cross(away, state.directions[i]), 0.0, atol=1e-9)


def test_the_viewer_needs_no_tunnel(exo, monkeypatch):
    """Meshcat requires pyngrok, and its users may remove it."""
    for name in ("pyngrok", "pyngrok.conf", "pyngrok.ngrok"):
        monkeypatch.setitem(sys.modules, name, None)
    with closing(exo.view(human=False)) as scene, urlopen(scene.url, timeout=20) as page:
        assert b"meshcat" in page.read().lower()


def test_a_pose_moves_only_what_moves(exo):
    scene = Scene(exo, human=has_human() or None)
    scene.show(pose(20, 10, 0))
    old = placements(scene)
    scene.show(pose(30, 15, 0))
    new = placements(scene)
    moved = moved_nodes(old, new)
    assert "/meshcat/exo/harness" in new
    assert not any("harness" in path or "bust" in path or "ground" in path for path in moved)
    assert "/meshcat/exo/cuff" in moved
    assert any("platform_body" in path for path in moved)
    assert any(path.startswith("/meshcat/forces/shoulder") for path in moved)
    assert not any("human/visuals/middle" in path or "human/visuals/right" in path for path in moved)
    before = scene.serial
    scene.show(pose(30, 15, 0))
    assert not moved_nodes(new, placements(scene))
    assert scene.serial == before


def test_a_pose_sends_only_what_moves(exo):
    """In one piece: a placement for every shape that moves, and the panels; benchmarks/view.py tells the time."""
    scene = Scene(exo)
    sent = []
    scene.attach(sent.append)
    for k in range(1, 30):
        before = placements(scene)
        scene.show(pose(k, 10 + k / 2, 0))
        after = placements(scene)
        assert len(sent) == 1
        got = list(read(sent.pop()))
        assert {item["type"] for item in got} <= {"set_transform", "panel", "serial"}
        paths = [item["path"] for item in got if item["type"] == "set_transform"]
        assert len(paths) == len(set(paths))
        assert set(paths) == {path for path in after if np.abs(after[path] - before[path]).max() > 1e-9}
        assert len(paths) < len(after)


@pytest.mark.parametrize("side", ["left", "right"])
def test_harness_and_cuff_carry_the_joints_of_any_design(exo, side):
    """Every joint is on the frames' skins, and the cuff turns with the arm; on circles or from points."""
    circles = exo if side == "left" else exo.mirrored()
    geometry = circles.geometry
    shift = np.array([[0.01, 0, 0], [0, 0.02, 0], [0, 0, -0.01]])
    points = circles.replace(geometry=ep.WristGeometry(geometry.base_points + shift, geometry.platform_points - shift))
    for design in (circles, points):
        scene = Scene(design, human=False)
        scene.show(pose(60, 30, 0, side=side))
        for name, joints in (("harness", design.geometry.base_points), ("cuff", design.geometry.platform_points)):
            skin = vertices(scene, f"/meshcat/exo/{name}/frame")
            near = np.linalg.norm(skin[:, None] - joints, axis=-1).min(axis=0)
            assert (near < 0.008).all(), (name, near)
        turned = place(scene, "/meshcat/exo/cuff")
        np.testing.assert_allclose(turned[:3, :3], scene.orientation.as_matrix(), atol=1e-12)


def vertices(scene, path):
    """Corners of a mesh, shape (k, 3), as a browser reads them."""
    data = next(item for item in commands(scene) if item["type"] == "set_object" and item["path"] == path)
    array = data["object"]["geometries"][0]["data"]["attributes"]["position"]["array"]
    return np.frombuffer(array.data, dtype=np.float32).reshape(-1, 3)


def test_mirrored_scene_is_the_mirror_image(exo):
    left, right = Scene(exo, human=False), Scene(exo.mirrored(), human=False)
    left.show(pose(50, 30, 20))
    right.show(pose(50, 30, 20, side="right"))
    mirror = np.diag([1.0, -1.0, 1.0])
    for path in ("/meshcat/exo/visuals/limb_2_platform_body_0", "/meshcat/forces/shoulder/head_0"):
        np.testing.assert_allclose(place(right, path)[:3, 3], mirror @ place(left, path)[:3, 3], atol=1e-9)


def test_muscles_swell_as_they_shorten(exo):
    scene = Scene(exo, human=False, limbs="muscles")

    def radius_and_length(index):
        matrix = place(scene, f"/meshcat/exo/muscles/limb_{index + 1}/braid")[:3, :3]
        return np.linalg.norm(matrix[:, 0]), np.linalg.norm(matrix[:, 2])

    scene.show(pose(0, 0, 0))
    thin, long = radius_and_length(0)
    scene.show(pose(60, 30, 0))
    fat, short = radius_and_length(0)
    assert short < long
    assert fat > thin
    # The threads of the braid keep their length: axial part squared and turns of the circle squared add up.
    nominal, cosine = exo.limbs[0].stroke.nominal_length, np.cos(np.radians(25.0))
    for radius, length in ((thin, long), (fat, short)):
        if length < nominal:
            left = (length / nominal * cosine) ** 2 + (radius / 0.011 * np.sin(np.radians(25.0))) ** 2
            assert left == pytest.approx(1.0)


def test_cables_run_from_joint_to_joint_and_have_no_rods():
    exo = ep.load("four-cables")
    linear = exo.replace(limbs=[*exo.limbs[:3], ep.load("four-linear-actuators").limbs[3]])
    scene, orientation = Scene(linear, human=False), pose(60, 30, 0)
    scene.show(orientation)
    state = linear.inverse_kinematics(orientation)
    drawn = {item["path"] for item in commands(scene) if item["type"] == "set_object"}
    for i in range(3):
        ends = place(scene, f"/meshcat/exo/cables/limb_{i + 1}")[:3, 2:] @ [[0.0, 1.0], [1.0, 1.0]]
        np.testing.assert_allclose(ends.T, [linear.geometry.base_points[i], state.platform_points[i]], atol=1e-9)
        assert not any(f"limb_{i + 1}_" in path and "body" in path for path in drawn)
    assert "/meshcat/exo/cables/limb_4" not in drawn
    assert "/meshcat/exo/visuals/limb_4_base_body_0" in drawn


def test_another_design_gets_the_same_query(exo):
    scene = Scene(exo, human=False)
    query = {"split": "minimal", "constraint_bounds": (-50, 50), "load": ep.Load([0.0, 0.0, -10.0], at=(0, 0, -0.3))}
    scene.show(pose(60, 30, 0), **query)
    wider = exo.replace(geometry=exo.geometry.replace(r_A=0.15))
    scene.replace_exo(wider)
    expected = wider.reaction(pose(60, 30, 0), **query).magnitude
    assert panel(scene, "numbers")["values"][0]["value"] == f"{expected:.1f} N"
    # A design that cannot be drawn leaves everything as it is.
    before = commands(scene)
    with pytest.raises(errors.InvalidInput, match="on a spherical joint"):
        scene.replace_exo(ep.load(URDF / "dummy-shoulder.urdf"))
    assert commands(scene) == before


@pytest.mark.parametrize(
    ("act", "kind", "message"),
    [
        (lambda s: s.show(pose([0, 1], 0, 0)), errors.InvalidInput, "single rotation"),
        (lambda s: Scene("prototype"), errors.InvalidInput, "ShoulderExo"),
        (lambda s: s.show([0, 0, 0]), errors.InvalidInput, "scipy Rotation"),
        (lambda s: s.record(pose([0, 1], 0, 0), [0.0]), errors.InvalidInput, "a time for every pose"),
        (lambda s: s.record(pose([0, 1], 0, 0), [1.0, 1.0]), errors.InvalidInput, "rise"),
        (lambda s: s.camera(position=[0, 0, 0], target=[0, 0, 0]), errors.InvalidInput, "differs from its target"),
        (lambda s: s.camera(field_of_view=200), errors.InvalidInput, "below 180"),
        (lambda s: s.replace_exo(3), errors.InvalidInput, "exo to be a ShoulderExo"),
        (lambda s: s.serve("7000"), errors.InvalidInput, "port"),
        (lambda s: s.serve(True), errors.InvalidInput, "port"),
        (lambda s: s.serve(-1), errors.InvalidInput, "port"),
        (lambda s: s.serve(65536), errors.InvalidInput, "port"),
        (lambda s: s.save_png("/tmp/none.png", size=(4, 4)), errors.InvalidInput, "16 to 8192"),
        (lambda s: s.save_png("/tmp/none.png", browser="no-such"), errors.BrowserNotFound, "no-such"),
        (lambda s: Scene(s.exo, limbs="ropes"), errors.UnknownName, "muscles, rods"),
    ],
)
def test_bad_input_is_refused(exo, act, kind, message):
    with pytest.raises(kind, match=message):
        act(Scene(exo, human=False))


def test_no_browser_is_a_clear_error(monkeypatch):
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("EXO_PIN_BROWSER", raising=False)
    with pytest.raises(errors.BrowserNotFound, match="chromium") as caught:
        find_browser()
    assert "chromium" in caught.value.programs
    monkeypatch.setenv("EXO_PIN_BROWSER", "/no/such/browser")
    with pytest.raises(errors.BrowserNotFound, match="/no/such/browser"):
        find_browser()
