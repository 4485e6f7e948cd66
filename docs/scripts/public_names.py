"""The public names of exo_pin: what the reference of the site lists, module by module.

A name is public if a stub file (``__init__.pyi``) of the package or of a module exports it. It stands once, under the
module that defines it, and under the shortest path by which a script imports it.
"""

from __future__ import annotations

import ast
import inspect
import json
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import exo_pin as ep

PACKAGE = Path(ep.__file__).parent
#: Rooms in the order in which a reader meets them, and what each is for.
ROOMS = {
    "exo": "The object that a user holds: a device and all that can be computed of it",
    "design": "What a device is: geometry, limbs, actuators, arm, wearer",
    "device": "Devices that are not wrists: closed chains with drives, springs and routed cables",
    "load_case": "The case: poses, motion, load, centre offset, movements",
    "reaction": "From a case and assumptions to the answer",
    "uncertainty": "How sure an answer is",
    "person": "The wearer's muscles and the contact force of the joint",
    "workspace": "Which poses a design holds, and the search for better designs",
    "study": "Sweeps and comparisons of designs",
    "wrist": "The wrist in closed form: kinematics, singularities, clearances",
    "wrist_chain": "The wrist as a closed chain and as URDF",
    "chain": "Closed kinematic chains of any robot",
    "muscle": "Pneumatic muscles: laws, identification, simulation, valves",
    "control": "Plant, controllers, reference trajectories, experiments",
    "calibration": "Where the joints of a built device are",
    "consistency": "Kinematic consistency checks",
    "view": "The viewer and plots",
    "report": "Two pages on a design and a person",
    "service": "Questions over HTTP, live streams",
    "thesis": "The ledger of printed numbers",
    "core": "Angles, errors and warnings",
}

#: Methods for the package itself: of solvers, of formats, and of records that are made without checks.
HIDDEN = ("costs", "form_in", "linearised", "made_of", "unchecked_force")


class Public(NamedTuple):
    """A public name: the path that a script imports, and what it is."""

    path: str
    item: Any


def public_names() -> dict[str, list[Public]]:
    """Public names by room, in the order of their stubs."""
    found: dict[str, dict[int, Public]] = {room: {} for room in ROOMS}
    for module, name in _exports(PACKAGE / "__init__.pyi"):
        _put(found, module.split(".")[0], "exo_pin", name)
    for room in ROOMS:
        for _, name in _exports(PACKAGE / room / "__init__.pyi"):
            _put(found, room, f"exo_pin.{room}", name)
    return {room: list(names.values()) for room, names in found.items() if names}


def without_place() -> list[str]:
    """Paths of public names that stand in no page, notebook or command: a user misses them, or they go."""
    root = Path(__file__).parents[2]
    places = [root / "README.md", *(root / "docs").rglob("*.md"), *(PACKAGE / "cli").rglob("*.py")]
    texts = [path.read_text(encoding="utf-8") for path in places if not {"api", "build"} & set(path.parts)]
    for path in (root / "notebooks").glob("*.ipynb"):
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        texts += ["".join(cell["source"]) for cell in cells]
    words = set(re.findall(r"\w+", "\n".join(texts)))
    found = (public.path for names in public_names().values() for public in names)
    return [path for path in found if path.rpartition(".")[2] not in words]


def _put(found: dict[str, dict[int, Public]], room: str, holder: str, name: str) -> None:
    item = getattr(import_module(holder), name)
    if callable(item) and room in found and not any(id(item) in names for names in found.values()):
        found[room][id(item)] = Public(f"{holder}.{name}", item)


def _exports(stub: Path) -> Iterator[tuple[str, str]]:
    """Module and name of each import of a stub, without whole rooms."""
    if not stub.exists():
        return
    for node in ast.parse(stub.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ImportFrom) and node.module:
            yield from ((node.module, alias.name) for alias in node.names)


def callables() -> dict[str, Any]:
    """Public functions, classes and their public methods by path: what has examples in its docstring.

    Methods of an interface are left out: a class of one's own fills them in, and the package calls them.
    """
    found: dict[str, Any] = {}
    for names in public_names().values():
        for path, item in names:
            if not inspect.isclass(item) and not inspect.isroutine(item):
                continue  # a name of several types
            found[path] = item
            is_interface = inspect.isabstract(item) or getattr(item, "_is_protocol", False)
            if inspect.isclass(item) and not issubclass(item, Exception) and not is_interface:
                for name, method in inspect.getmembers(item):
                    function = inspect.unwrap(getattr(method, "__func__", method))
                    ours = (getattr(function, "__module__", "") or "").startswith("exo_pin")
                    if not name.startswith("_") and name not in HIDDEN and inspect.isfunction(function) and ours:
                        found[f"{path}.{name}"] = function
    return found
