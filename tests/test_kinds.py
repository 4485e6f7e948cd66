"""No question outside the room of devices asks for the kind of one: whatever the classes are called."""

import ast
import inspect
import textwrap
import types
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages

import pytest

import exo_pin
from exo_pin.device import Device, DeviceKind

FOLDER = Path(exo_pin.__file__).parent
#: Where kinds are at home.
HOME = "exo_pin.device"
NAMES = frozenset(name for name in vars(Device) if not name.startswith("_"))
#: What an object says of its own kind.
FLAGS = {"is_wrist", "is_chain", "is_mechanism"}


@cache
def modules():
    """Every module of the package, imported."""
    names = [each.name for each in walk_packages(exo_pin.__path__, "exo_pin.")]
    return [exo_pin, *(import_module(name) for name in names if not name.endswith("__main__"))]


def own_names(cls):
    """Attributes and annotated fields of a class and its bases."""
    return {name for base in cls.__mro__ for name in (*vars(base), *inspect.get_annotations(base))}


@cache
def kinds():
    """Classes that fulfil the protocol, and their bases that no other class has."""
    everything = {
        cls
        for module in modules()
        for cls in vars(module).values()
        if inspect.isclass(cls) and cls.__module__.startswith("exo_pin")
    }
    found = {cls for cls in everything if cls is not Device and own_names(cls) >= NAMES}
    bases = {base for cls in found for base in cls.__mro__ if base in everything}
    others = {base for cls in everything - found - bases for base in cls.__mro__}
    return frozenset(found | (bases - others - {Device}))


@cache
def telling():
    """Public names that some kinds have and others have not."""
    each = [{name for name in own_names(cls) if not name.startswith("_")} for cls in kinds()]
    return set().union(*each) - NAMES - set.intersection(*each) | {"mechanism"}


def resolved(node, names):
    """Classes that an expression names."""
    if isinstance(node, ast.Name):
        value = names.get(node.id)
    elif isinstance(node, ast.Attribute):
        owners = resolved(node.value, names)
        value = getattr(owners[0], node.attr, None) if owners else None
    elif isinstance(node, ast.Tuple | ast.List | ast.Set):
        return [found for part in node.elts for found in resolved(part, names)]
    elif isinstance(node, ast.BinOp):
        return resolved(node.left, names) + resolved(node.right, names)
    else:
        return []
    if isinstance(value, tuple | list | set | frozenset):
        return list(value)
    return list(getattr(value, "__args__", ())) if isinstance(value, types.UnionType) else [value]


def names_in(tree, module):
    """What names of a module stand for, those that functions import included."""
    names = dict(vars(module))
    package = module.__name__ if hasattr(module, "__path__") else module.__name__.rpartition(".")[0]
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            above = package.split(".")
            base = (
                ".".join([*above[: len(above) - node.level + 1], *filter(None, [node.module])])
                if node.level
                else node.module
            )
            if base and base.startswith("exo_pin"):
                for alias in node.names:
                    names.setdefault(alias.asname or alias.name, getattr(import_module(base), alias.name, None))
    return names


def questions(tree, module):
    """Lines that ask for a kind."""
    names, kind_names = names_in(tree, module), {cls.__name__ for cls in kinds()}

    def of_kind(node):
        return any(inspect.isclass(cls) and cls in kinds() for cls in resolved(node, names))

    found = []
    for node in ast.walk(tree):
        asks = False
        if isinstance(node, ast.Call):
            called = node.func.id if isinstance(node.func, ast.Name) else getattr(node.func, "attr", "")
            if called in ("isinstance", "issubclass", "register") and node.args:
                asks = any(of_kind(part) for part in node.args[-1:])
            elif called == "hasattr" or (called == "getattr" and len(node.args) == 3):
                asks = isinstance(node.args[1], ast.Constant) and node.args[1].value in telling()
        elif isinstance(node, ast.Compare):
            parts = [node.left, *node.comparators]
            asks = any(of_kind(part) for part in parts) or any(
                isinstance(leaf, ast.Constant) and leaf.value in kind_names for part in parts for leaf in ast.walk(part)
            )
        elif isinstance(node, ast.MatchClass):
            asks = of_kind(node.cls)
        elif isinstance(node, ast.Attribute):
            asks = node.attr in FLAGS
        if asks:
            found.append(f"{module.__name__}:{node.lineno if hasattr(node, 'lineno') else node.cls.lineno}")
    return found


def test_kinds_are_found_by_what_they_answer():
    found = {cls.__name__ for cls in kinds()}
    assert {"ChainDevice", "WristDevice", "DeviceKind", "Mechanism"} <= found
    assert not found & {"Device", "Record", "ShoulderExo", "Arm", "Limb"}
    assert {"mechanism", "geometry", "structure", "brakes"} - {"brakes"} <= telling()
    assert not telling() & NAMES


@pytest.mark.parametrize(
    "text",
    [
        "isinstance(x, ChainDevice)",
        "isinstance(x, (int, Own))",
        "isinstance(x, int | room.Mechanism)",
        "isinstance(x, SOME)",
        "issubclass(type(x), Own)",
        "type(x) is Own",
        "x.__class__ == ChainDevice",
        "type(x).__name__ == 'WristDevice'",
        "type(x).__name__ in ('ChainDevice',)",
        "hasattr(x, 'geometry')",
        "hasattr(x, 'mechanism')",
        "getattr(x, 'structure', None) is None",
        "x.is_wrist",
        "match x:\n    case Own():\n        pass",
        "from exo_pin.device import ChainDevice as Late\nisinstance(x, Late)",
        "choose.register(Own)",
    ],
)
def test_a_question_is_found(text):
    module = types.ModuleType("exo_pin.somewhere")
    own = {cls.__name__: cls for cls in kinds()}
    vars(module).update(
        ChainDevice=own["ChainDevice"], Own=own["WristDevice"], room=types.SimpleNamespace(Mechanism=own["Mechanism"]),
        SOME=(own["Mechanism"], DeviceKind),
    )  # fmt: skip
    assert questions(ast.parse(textwrap.dedent(text)), module)


@pytest.mark.parametrize(
    "text", ["isinstance(x, Device)", "exo.wrist is not None", "hasattr(x, 'replace')", "isinstance(x, int)",
             "device.accelerate('map') is None"]
)  # fmt: skip
def test_what_may_be_asked(text):
    module = types.ModuleType("exo_pin.somewhere")
    module.Device = Device
    assert not questions(ast.parse(text), module)


def test_no_question_of_kind_is_left():
    found = []
    for module in modules():
        if module.__name__ != HOME and not module.__name__.startswith(f"{HOME}."):
            tree = ast.parse(Path(module.__file__).read_text(encoding="utf-8"))
            found += questions(tree, module)
    assert not found
