"""A scene as plain data, from the commands that a page of it gets: shapes, places, colours and panels."""

import base64
import gzip
import json
import re
import struct

import numpy as np
import umsgpack
from descriptions import numbers, rounded

#: What is scaled to less is hidden, m.
_HIDDEN = 1e-5


def commands(scene):
    """Commands that make the whole scene."""
    return list(read(scene.attach(lambda _: None)()))


def read(data):
    """Commands of a run, one by one."""
    at = 0
    while at < len(data):
        (size,) = struct.unpack_from("<I", data, at)
        yield umsgpack.unpackb(data[at + 4 : at + 4 + size])
        at += 4 + size


def scene_description(scene):
    """What a page shows of it."""
    return _described(commands(scene)) | {"messages": [message[:60] for message in scene.messages]}


def film_description(film):
    """What the page of a recording shows at first, and how it moves."""
    return page_description(film.html())


def page_description(text):
    """The same of a page's text, or of a page that does not move what it shows; None of any other page."""
    parts = [gzip.decompress(base64.b64decode(part)) for part in re.findall(r'inflate\("([^"]+)"\)', text)]
    if not parts:
        return None
    return _film(parts[0], json.loads(parts[1])) if len(parts) > 1 else _described(list(read(parts[0])))


def _film(scene, frames):
    count = len(frames["times"])
    moves, colours = (
        np.frombuffer(base64.b64decode(frames[name]), "<f4").reshape(count, -1, size)
        for name, size in (("transforms", 16), ("colours", 4))
    )
    found = {"times": numbers(frames["times"]), "frames": count}
    for names, values in (("moving", moves), ("coloured", colours)):
        paths = [path.removeprefix("/meshcat/") for path in frames[names]]
        found |= {f"{names} {path}": part for path, part in _together(
            {path: numbers(values[:, k].mean(axis=0)) for k, path in enumerate(paths)}).items()}  # fmt: skip
    panels = frames["panels"]
    found |= {"first": _plain(panels[0]), "last": _plain(panels[-1])}
    return found | _described(list(read(scene)))


def _described(every):
    parts, panels = {}, {}
    for item in every:
        path = item.get("path", "").removeprefix("/meshcat/")
        if item["type"] == "panel":
            panels[item["name"]] = _panel(item["name"], item["data"])
        elif item["type"] == "set_object":
            parts.setdefault(path, {})["is"] = _shape(item["object"])
        elif item["type"] == "set_transform":
            parts.setdefault(path, {})["at"] = _place(np.reshape(item["matrix"], (4, 4)).T)
        elif item["type"] == "set_property":
            value = item["value"]
            parts.setdefault(path, {})[item["property"]] = numbers(value) if isinstance(value, list) else value
    hidden = {path for path, part in parts.items() if part.get("at") == "hidden"}
    parts = {
        path: part for path, part in parts.items() if not any(path == h or path.startswith(h + "/") for h in hidden)
    }
    return _together(parts) | {"hidden": len(hidden), "panels": panels}


def _place(matrix):
    """Where a node is, and where it takes x, y and z."""
    if np.linalg.norm(matrix[:3, :3], axis=0).max() < _HIDDEN:
        return "hidden"
    return [rounded(value) if abs(value) > 1e-9 else 0.0 for value in matrix[:3, [3, 0, 1, 2]].T.ravel().tolist()]


def _together(parts):
    """Of parts that are numbered, more than four, three; of the many parts of muscles, twelve."""
    groups = {}
    for path in parts:
        groups.setdefault(re.sub(r"(?<=muscles/)\w+/\d+$|\d+$", "", path), []).append(path)
    left_out = set()
    for each in (each for each in groups.values() if len(each) > 4):
        kept = np.linspace(0, len(each) - 1, 3 if len(each) < 100 else 12).astype(int)
        left_out |= set(each) - {each[k] for k in kept}
    found = {path: part for path, part in parts.items() if path not in left_out}
    return found | ({"left out": len(left_out)} if left_out else {})


def _shape(data):
    """Kind, sizes and looks."""
    (geometry,), (material,) = data["geometries"], data["materials"]
    looks = [f"{name} #{material[name]:06x}" for name in ("color", "emissive") if material.get(name) is not None]
    names = ("opacity", "transparent", "side", "depthTest")
    looks += [f"{name} {material[name]:g}" for name in names if name in material]
    sizes = [value for name, value in sorted(geometry.items()) if isinstance(value, int | float)]
    if "data" in geometry:
        sizes += _mesh(geometry["data"])
    return [f"{geometry['type']}, {material['type']} {', '.join(looks)}", *map(rounded, sizes)]


def skin(data):
    """Corners, shape (n, 3), m, and triangles, shape (m, 3), of a mesh."""
    points = np.frombuffer(data["attributes"]["position"]["array"].data, np.float32).reshape(-1, 3).astype(float)
    return points, np.frombuffer(data["index"]["array"].data, np.uint32).reshape(-1, 3)


def _mesh(data):
    """A skin: how many corners and triangles, its middle and spread, its volume and area."""
    if not isinstance(data, dict):
        return [len(getattr(data, "data", data))]
    points, corners = skin(data)
    a, b, c = (points[corners[:, k]] for k in range(3))
    area = np.cross(b - a, c - a)
    whole = [np.einsum("ki,ki->", a, area) / 6.0, np.linalg.norm(area, axis=1).sum() / 2.0]
    box = (points.min(axis=0), points.max(axis=0), points.mean(axis=0), points.std(axis=0))
    return [len(points), len(corners), *np.concatenate(box).tolist(), *whole]


def _panel(name, data):
    if name == "camera":
        sides = {side["name"]: [*side["position"], *side["target"], *side["extent"]] for side in data["sides"]}
        data = data | {"sides": sides}
    return _plain(data)


def _plain(value):
    """Content of a panel, with numbers of five digits."""
    if isinstance(value, dict):
        return {name: _plain(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    return rounded(value) if isinstance(value, float) else value if isinstance(value, str | int | None) else str(value)
