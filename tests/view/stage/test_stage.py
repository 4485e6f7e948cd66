"""What a page gets: closed skins that face outwards, and what changes but no more."""

import numpy as np
import pytest
from described_scenes import commands, read, skin
from drawn_scenes import SCENES
from scipy.spatial.transform import Rotation

from exo_pin.view.stage.shapes import frustum, placement
from exo_pin.view.stage.stage import Stage


def is_closed(vertices, faces):
    """Whether every edge between two places has a triangle on either side; triangles without area do not count."""
    places = {tuple(np.round(vertex, 5)): k for k, vertex in enumerate(vertices)}
    names = np.array([places[tuple(np.round(vertex, 5))] for vertex in vertices])
    edges = [(names[t[k]], names[t[(k + 1) % 3]]) for t in faces for k in range(3)]
    counts = {}
    for a, b in edges:
        if a != b:
            counts[a, b] = counts.get((a, b), 0) + 1
    return all(counts.get((b, a), 0) == count for (a, b), count in counts.items())


@pytest.mark.parametrize("name", ["wrist", "wrist_muscles", "serial_roped", "chain"])
def test_skins_are_closed_and_face_outwards(name):
    count = 0
    for item in commands(SCENES[name]()):
        data = item["object"]["geometries"][0].get("data") if item["type"] == "set_object" else None
        # The ground is a disc, the sleeve a ring that begins where it ends.
        if isinstance(data, dict) and "ground" not in item["path"]:
            points, corners = skin(data)
            a, b, c = (points[corners[:, k]] for k in range(3))
            assert np.einsum("ki,ki->", a, np.cross(b, c)) > 0.0, item["path"]
            assert is_closed(points, corners), item["path"]
            count += 1
    assert count > 0


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
    kinds = [item["type"] for item in read(stage.snapshot())]
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
