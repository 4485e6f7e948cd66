"""Pictures of robots on the other shoulder: every drawn part is at the mirrored place, meshes are mirrored meshes."""

import numpy as np
import pytest
from places import URDF
from scenes import commands, placements

import exo_pin as ep

S = np.diag([1.0, -1.0, 1.0])
#: An asymmetric tetrahedron.
OBJ = "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def scenes(path):
    """Both sides in the same clinical pose."""
    found = []
    for side in ("left", "right"):
        exo = ep.load(path, side=side)
        scene = exo.view(human=False)
        scene.show(exo.pose(40, 30, 10))
        found.append(scene)
    return found


@pytest.mark.parametrize("name", ["serial-y-x-z", "spherical-3rrr", "spring-support", "six-cables", "prototype"])
def test_every_part_is_drawn_at_the_mirrored_place(name):
    left, right = (placements(scene) for scene in scenes(URDF / f"{name}.urdf"))
    assert left.keys() == right.keys()
    shapes = [path for path in left if "/visuals/" in path]
    assert len(shapes) > 5
    for path in left:
        if "_rod_" in path:
            # Rods of a body are numbered by their places.
            others = [right[other][:3, 3] for other in right if other.startswith(path.rstrip("0123456789"))]
            assert np.abs(np.array(others) - S @ left[path][:3, 3]).max(axis=1).min() < 1e-9, path
        else:
            np.testing.assert_allclose(S @ left[path][:3, 3], right[path][:3, 3], atol=1e-9, err_msg=path)
    for path in (path for path in shapes if "_rod_" not in path):
        # Drawn shapes are their own mirror images in their own axes, and so may be turned by any of them.
        one, two = S @ left[path][:3, :3], right[path][:3, :3]
        np.testing.assert_allclose(one @ one.T, two @ two.T, atol=1e-9, err_msg=path)


def corners(scene):
    """Vertices of the drawn mesh in the base frame, shape (4, 3), m."""
    (made,) = (item for item in commands(scene) if item["type"] == "set_object" and "link_1" in item["path"])
    placed = next(item for item in reversed(commands(scene))
                  if item["type"] == "set_transform" and item["path"] == made["path"])  # fmt: skip
    matrix = np.array(placed["matrix"]).reshape(4, 4).T
    points = np.array([line.split()[1:] for line in OBJ.splitlines() if line.startswith("v")], dtype=float)
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def test_a_mesh_is_mirrored(tmp_path):
    text = (URDF / "serial-y-x-z.urdf").read_text()
    shape = '<geometry><mesh filename="part.obj" scale="0.1 0.1 0.1"/></geometry>'
    mesh = f'<visual><origin xyz="0.02 0.05 0.01" rpy="0.3 0.2 0.1"/>{shape}</visual>'
    start = text.index('<link name="link_1">') + len('<link name="link_1">')
    end = text.index("</link>", start)
    inertial = text[text.index("<inertial>", start) : text.index("</inertial>", start) + len("</inertial>")]
    (tmp_path / "serial-y-x-z.urdf").write_text(text[:start] + inertial + mesh + text[end:])
    (tmp_path / "serial-y-x-z.closures.toml").write_bytes((URDF / "serial-y-x-z.closures.toml").read_bytes())
    (tmp_path / "part.obj").write_text(OBJ)
    left, right = (corners(scene) for scene in scenes(tmp_path / "serial-y-x-z.urdf"))
    np.testing.assert_allclose(left @ S, right, atol=1e-9)
