"""Shapes of the scene: closed skins of the right volume, arrows as long as what they stand for, colours on a scale."""

import numpy as np
import pytest
import umsgpack
from scipy.spatial.transform import Rotation

from exo_pin.view.colours import CIVIDIS, channels, hexadecimal, number, scale_colours
from exo_pin.view.stage.shapes import (
    Arrow,
    TurningArrow,
    along,
    coil,
    draw_ground,
    flat_material,
    frustum,
    lathe,
    matt_material,
    mesh_of,
    placement,
    segment,
    skin_of,
    trimmed,
    tube,
)
from exo_pin.view.stage.stage import Stage, seen_along, widened


def skin(mesh):
    """Corners and triangles of a mesh."""
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


def volume(vertices, faces):
    """Volume within a skin, m³: positive where its triangles run anticlockwise as seen from outside."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.einsum("ki,ki->", a, np.cross(b, c)) / 6.0)


def is_closed(vertices, faces):
    """Whether every edge between two places has a triangle on either side; triangles without area do not count."""
    places = {tuple(np.round(vertex, 9)): k for k, vertex in enumerate(vertices)}
    names = np.array([places[tuple(np.round(vertex, 9))] for vertex in vertices])
    edges = [(names[t[k]], names[t[(k + 1) % 3]]) for t in faces for k in range(3)]
    counts = {}
    for a, b in edges:
        if a != b:
            counts[a, b] = counts.get((a, b), 0) + 1
    return all(counts.get((b, a), 0) == count for (a, b), count in counts.items())


def polygon(corners, radius=1.0):
    """Area of a regular polygon within a circle."""
    return 0.5 * corners * radius**2 * np.sin(2.0 * np.pi / corners)


def test_cones_and_bodies_of_revolution():
    for bottom, top in ((1.0, 1.0), (1.0, 1e-6), (0.5, 2.0)):
        own = skin(frustum(bottom, top))
        share = (bottom**2 + bottom * top + top**2) / 3.0
        assert volume(*own) == pytest.approx(polygon(28) * share, rel=1e-4)
        assert (own[0][:, 2].min(), own[0][:, 2].max()) == (0.0, 1.0)
    ring = np.array([(0.2, 0.0), (0.3, 0.0), (0.3, 0.5), (0.2, 0.5), (0.2, 0.0)])
    own = skin(lathe(ring, 48))
    assert is_closed(*own)
    assert abs(volume(*own)) == pytest.approx((polygon(48, 0.3) - polygon(48, 0.2)) * 0.5)
    assert volume(*own) > 0.0


def test_bars_follow_their_lines():
    straight = np.linspace([0.1, 0.2, 0.3], [0.4, 0.6, 0.3], 5)
    own = tube(straight, 0.02, 16)
    assert volume(*own) == pytest.approx(polygon(16, 0.02) * 0.5, rel=1e-9)
    assert is_closed(*own)
    turn = np.linspace(0.0, np.pi, 60)
    arc = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    own = tube(arc, 0.05)
    assert volume(*own) == pytest.approx(polygon(12, 0.05) * np.pi, rel=2e-3)
    far = np.abs(np.hypot(np.hypot(own[0][:, 0], own[0][:, 1]) - 1.0, own[0][:, 2]) - 0.05)
    assert far[12:-12].max() < 2e-3  # but for the ends, which close on the line
    np.testing.assert_allclose(own[0][:12], np.tile(arc[0], (12, 1)))
    both = mesh_of([tube(straight, 0.02, 16), own])
    assert volume(*skin(both)) == pytest.approx(volume(*tube(straight, 0.02, 16)) + volume(*own))
    assert np.asarray(both.faces).max() == len(both.vertices) - 1
    box = np.array([[[x, y, z] for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))] for z in (0.0, 2.0)])
    vertices, faces = skin_of(box)
    assert (len(vertices), len(faces)) == (8, 8)
    normals = np.cross(vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]])
    assert (np.einsum("ki,ki->k", normals, vertices[faces].mean(axis=1) - [0.5, 0.5, 1.0]) > 0.0).all()


def test_a_coil_has_its_turns():
    vertices, _ = skin(coil(6, 0.4, 0.011, 0.002))
    assert (vertices[:, 2].min(), vertices[:, 2].max()) == pytest.approx((0.0, 1.0), abs=0.01)
    wide = np.hypot(vertices[:, 0], vertices[:, 1])
    assert wide.max() == pytest.approx(0.013, abs=3e-4)
    middle = vertices[(vertices[:, 2] > 0.2) & (vertices[:, 2] < 0.8)]
    assert np.hypot(middle[:, 0], middle[:, 1]).min() == pytest.approx(0.009, abs=3e-4)
    # Rings of the wire go round the axis six times, by the right hand.
    rings = vertices.reshape(-1, 8, 3)[1:-1].mean(axis=1)
    turns = np.unwrap(np.arctan2(rings[2:-2, 1], rings[2:-2, 0]))
    assert (turns[-1] - turns[0]) / (2.0 * np.pi) == pytest.approx(6.0, abs=0.4)
    assert np.hypot(*rings[0, :2]) < 0.002


def test_places_and_directions():
    rng = np.random.default_rng(3)
    for direction in (*np.eye(3), -np.eye(3)[2], *rng.normal(size=(5, 3))):
        unit = direction / np.linalg.norm(direction)
        frame = along(unit)
        np.testing.assert_allclose(frame.T @ frame, np.eye(3), atol=1e-12)
        assert np.linalg.det(frame) == pytest.approx(1.0)
        np.testing.assert_allclose(frame[:, 2], unit)
    start, end = rng.normal(size=(2, 3))
    placed = segment(start, end, 0.02)
    np.testing.assert_allclose(placed @ [0, 0, 0, 1], [*start, 1.0])
    np.testing.assert_allclose(placed @ [0, 0, 1, 1], [*end, 1.0])
    np.testing.assert_allclose(np.linalg.norm(placed[:3, :2], axis=0), 0.02)
    assert np.linalg.det(segment(start, start)[:3, :3]) > 0.0
    np.testing.assert_allclose(
        placement([1.0, 2.0, 3.0], start)[:3], np.column_stack([np.diag([1.0, 2.0, 3.0]), start])
    )
    np.testing.assert_allclose(placement(2.0), np.diag([2.0, 2.0, 2.0, 1.0]))
    vector, cut = trimmed(np.array([3.0, 4.0, 0.0]), 2.5)
    np.testing.assert_allclose(vector, [1.5, 2.0, 0.0])
    assert cut
    assert not trimmed(vector, 2.5 + 1e-12)[1]


def shown(stage, path):
    return stage.placements()[path]


@pytest.mark.parametrize(("heads", "tail"), [(1, False), (2, True)])
def test_an_arrow_is_as_long_as_its_vector(heads, tail):
    stage, radius = Stage(), 0.006
    arrow = Arrow(stage, "/meshcat/one", "#0072B2", radius, heads, tail)
    names = ["shaft", *(f"head_{k}" for k in range(heads)), *(["tail"] if tail else [])]
    assert set(stage.placements()) == {f"/meshcat/one/{name}" for name in names}
    assert all(np.linalg.norm(each[:3, :3]) < 1e-5 for each in stage.placements().values())
    # Drawn after the translucent arm, which would tint them.
    orders = {
        item["path"]: item["value"]
        for item in map(umsgpack.unpackb, runs(stage))
        if item.get("property") == "renderOrder"
    }
    assert orders == {f"/meshcat/one/{name}": 10 for name in names}
    start = np.array([0.1, -0.2, 0.3])
    for vector in np.array([[0.12, 0.16, 0.0], [0.0, 0.0, -0.01]]):
        arrow.show(start, vector)
        size = np.linalg.norm(vector)
        head = min(4.6 * radius, size / heads)
        foot = start
        for k, name in enumerate(("shaft", *(f"head_{k}" for k in range(heads)))):
            placed = shown(stage, f"/meshcat/one/{name}")
            tip = placed[:3, 3] + placed[:3, 2]
            want = size - heads * head if k == 0 else head
            np.testing.assert_allclose(placed[:3, 3], foot, atol=2e-6)
            assert np.linalg.norm(tip - foot) == pytest.approx(want, abs=2e-6)
            wide = np.linalg.norm(placed[:3, 0])
            if k:
                assert wide == pytest.approx(2.4 * head / 4.6)
            else:
                assert wide == pytest.approx(radius if want > 1e-6 else 1e-6)
            foot = tip
        np.testing.assert_allclose(foot, start + vector, atol=4e-6)
        if tail:
            disc = shown(stage, "/meshcat/one/tail")
            np.testing.assert_allclose(disc[:3, 3], start)
            assert np.linalg.norm(disc[:3, 2]) == pytest.approx(0.5 * radius)
            assert np.linalg.norm(disc[:3, 0]) == pytest.approx(2.2 * radius)
    arrow.show(start, np.zeros(3))
    assert all(np.linalg.norm(each[:3, :3]) < 1e-5 for each in stage.placements().values())


def test_a_moment_turns_by_the_right_hand():
    stage = Stage()
    arrow = TurningArrow(stage, "/meshcat/turn", "#0072B2", 0.045)
    at, moment = np.array([0.1, 0.2, 0.3]), np.array([0.0, -2.0, 1.0])
    arrow.show(at, moment)
    placed = shown(stage, "/meshcat/turn/round")
    np.testing.assert_allclose(placed[:3, 3], at)
    np.testing.assert_allclose(placed[:3, 2], 0.045 * moment / np.linalg.norm(moment))
    data = next(item for item in (umsgpack.unpackb(each) for each in runs(stage)) if item["type"] == "set_object")
    array = data["object"]["geometries"][0]["data"]["attributes"]["position"]["array"]
    vertices = np.frombuffer(array.data, dtype=np.float32).reshape(-1, 3)
    # Most of a circle of radius 1 about z; its head is ahead of the end, anticlockwise.
    turns = np.mod(np.degrees(np.arctan2(vertices[:, 1], vertices[:, 0])), 360.0)
    assert ((turns < 300.0) | (turns > 352.0)).all()
    assert turns[turns < 352.0].max() == pytest.approx(255.0 + np.degrees(np.arctan(2.2 * 0.26)), abs=1.0)
    head = vertices[(turns > 256.0) & (turns < 300.0)]
    assert np.linalg.norm(
        head - [np.cos(np.radians(255.0)), np.sin(np.radians(255.0)), 0.0], axis=1
    ).max() == pytest.approx(2.2 * 0.26, abs=0.01)
    arrow.hide()
    assert np.linalg.norm(shown(stage, "/meshcat/turn/round")[:3, :3]) < 1e-5


def runs(stage):
    """Commands of a scene, one by one."""
    data, found = stage.snapshot(), []
    while data:
        size = int.from_bytes(data[:4], "little")
        found.append(data[4 : 4 + size])
        data = data[4 + size :]
    return found


def test_the_ground_is_a_level_disc():
    stage = Stage()
    draw_ground(stage, -1.2, 2.0)
    inner, edge = shown(stage, "/meshcat/ground/inner"), shown(stage, "/meshcat/ground/edge")
    np.testing.assert_allclose(inner[:3, 3], [0.0, 0.0, -1.2])
    assert -1.21 < edge[2, 3] < -1.2
    np.testing.assert_allclose(inner[:3, :3], np.eye(3))


def test_colours_are_read_and_written():
    assert number("#0A0B0C") == 0x0A0B0C
    np.testing.assert_allclose(channels("#FF8000"), [1.0, 128.0 / 255.0, 0.0])
    assert hexadecimal(channels("#12AB3F")) == "#12AB3F"
    scale = scale_colours(np.array([-1.0, 0.0, 1.0, 5.0, np.nan]), 0.0, 1.0)
    np.testing.assert_allclose(scale[0], channels(CIVIDIS[0]))
    np.testing.assert_allclose(scale[0], scale[1])
    np.testing.assert_allclose(scale[2], channels(CIVIDIS[-1]))
    np.testing.assert_allclose(scale[2], scale[3])
    np.testing.assert_allclose(scale[4], 0.85)
    steps = scale_colours(np.arange(10.0) / 9.0, 0.0, 1.0)
    np.testing.assert_allclose(steps, [channels(each) for each in CIVIDIS], atol=1e-12)
    between = scale_colours(np.array([4.0, 4.5, 5.0]), 4.0, 5.0, ("#000000", "#FFFFFF"))
    np.testing.assert_allclose(between, [[0.0] * 3, [0.5] * 3, [1.0] * 3])
    np.testing.assert_allclose(
        scale_colours(np.array([2.0, 3.0]), 2.0, 2.0, ("#000000", "#FFFFFF")), [[0.0] * 3, [1.0] * 3]
    )
    # A flat colour is the sum of its light and its own glow.
    flat = flat_material("#FF8000", 0.5, on_top=True)
    own, glow = (
        np.array([value >> 16, value >> 8 & 255, value & 255]) for value in (flat.color, flat.properties["emissive"])
    )
    np.testing.assert_allclose(own + glow, [255, 128, 0], atol=1)
    assert flat.opacity == 0.5
    assert (flat.properties["depthTest"], flat.transparent) == (False, True)
    assert "depthTest" not in flat_material("#FF8000").properties
    matt = matt_material((1.0, 0.5, 0.0), 0.3)
    assert (matt.color, matt.opacity, matt.transparent) == (0xFF8000, 0.3, True)
    assert not matt_material((1.0, 0.5, 0.0)).transparent


def test_a_view_is_widened_until_all_is_in_it():
    away = np.array([2.0, 1.0, 0.5])
    right, up = seen_along(away / np.linalg.norm(away))
    assert right[2] == 0.0
    assert up[2] > 0.0
    np.testing.assert_allclose(np.cross(right, up), away / np.linalg.norm(away), atol=1e-12)
    target, extent = np.array([0.1, 0.0, -0.2]), (0.4, 0.3)
    inside = target + np.array([[0.0, 0.0, 0.1], [0.0, 0.1, 0.0]])
    same, size = widened(inside, target, away, extent)
    np.testing.assert_allclose(same, target)
    np.testing.assert_allclose(size, extent)
    # A point at the target's depth, to the right: the view grows to that side alone, with 6 % of room.
    moved, size = widened((target + 0.8 * right)[None], target, away, extent)
    np.testing.assert_allclose(size, [(0.4 + 1.06 * 0.8) / 2.0, 0.3])
    np.testing.assert_allclose(moved, target + (1.06 * 0.8 - 0.4) / 2.0 * right)
    # Half way to the camera it looks twice as large.
    near = target + 0.3 * up + 0.5 * away
    np.testing.assert_allclose(widened(near[None], target, away, extent)[1][1], (0.3 + 1.06 * 0.6) / 2.0)


def test_a_stage_sends_what_changes_and_no_more():
    stage, got = Stage(), []
    whole = stage.attach(got.append)
    stage.set_transform("/meshcat/a", np.eye(4))
    stage.set_transform("/meshcat/a", np.eye(4) + 1e-12)
    assert (len(got), stage.serial) == (1, 1)
    stage.set_colour("/meshcat/a", [1.0, 0.0, 0.0, 1.0])
    stage.set_colour("/meshcat/a", (1.0, 0.0, 0.0, 1.0))
    stage.set_property("/meshcat/a", "visible", False)
    stage.set_property("/meshcat/a", "visible", False)
    stage.set_panel("numbers", {"a": 1})
    stage.set_panel("numbers", {"a": 1})
    assert (len(got), stage.panel("numbers"), stage.panel("none")) == (4, {"a": 1}, None)
    with stage.update():
        with stage.update():
            stage.set_transform("/meshcat/a/b", 2.0 * np.eye(4))
        stage.set_property("/meshcat/a", "visible", True)
        assert len(got) == 4
    assert len(got) == 5
    with stage.update():
        pass
    assert len(got) == 5
    moved = Rotation.from_rotvec([0.0, 0.0, 1.0]).as_matrix()
    placed = placement(moved, [1.0, 2.0, 3.0])
    stage.viewer["c"].set_transform(placed)
    np.testing.assert_allclose(stage.placements()["/meshcat/c"], placed)
    assert stage.colours() == {"/meshcat/a": (1.0, 0.0, 0.0, 1.0)}
    kinds = [umsgpack.unpackb(each)["type"] for each in runs(stage)]
    assert kinds.count("set_transform") == 3
    assert kinds[-1] == "serial"
    assert whole().endswith(stage.snapshot())
    stage.viewer["a"].delete()
    assert set(stage.placements()) == {"/meshcat/c"}
    assert not stage.colours()
    # A new object has no colour of its own yet.
    stage.set_colour("/meshcat/c", (0.0, 1.0, 0.0, 1.0))
    stage.viewer["c"].set_object(frustum(1.0, 1.0))
    assert not stage.colours()
    count = len(got)
    stage.close()
    stage.set_panel("numbers", {"a": 2})
    assert len(got) == count
