"""Calls of every public name: good ones, recorded while questions of every kind are answered, and one thing wrong."""

import enum
import importlib
import inspect
import pkgutil
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

import exo_pin as ep

#: Good calls of one name that are kept.
MOST = 2
#: They open a window, a server or a browser that the test would have to close.
APART = {"find_browser", "ShoulderExo.view", "ClosedChain.view", "Scene", "ChainScene", "human_urdf"}


class _Plain:
    """A class that is nothing to the package."""

    def __init__(self, *_, **__):
        pass


#: Makers of values that are wrong nearly everywhere; made anew for each call, so that none can be changed for the next.
HOSTILE = {
    "None": lambda: None,
    "list": list,
    "dict": dict,
    "tuple": tuple,
    "set": lambda: {"x"},
    "texts": lambda: ["x", "y"],
    "text": lambda: "x",
    "empty": lambda: "",
    "blank": lambda: " \n",
    "parent": lambda: "..",
    "zero": lambda: "a\0b",
    "escape": lambda: "\x1b[2J",
    "surrogate": lambda: "\udcff",
    "huge": lambda: "x" * 100_000,
    "formula": lambda: "=1+1",
    "bytes": lambda: b"x",
    "path": lambda: Path("nowhere") / "x",
    "three": lambda: 3,
    "minus": lambda: -1,
    "big": lambda: 10**400,
    "zero_d": lambda: np.array(2.0),
    "true": lambda: True,
    "nan": lambda: float("nan"),
    "inf": lambda: float("inf"),
    "complex": lambda: 1j,
    "object": object,
    "class": lambda: _Plain,
    "instance": _Plain,
    "function": lambda: lambda *_: None,
    "nans": lambda: np.full((2, 3), np.nan),
    "objects": lambda: np.array([None, 1.0], dtype=object),
    "cube": lambda: np.ones((2, 3, 4)),
    "nested": lambda: [[1], [2, 3]],
    "rotation": lambda: Rotation.identity(0),
    "exo": lambda: ep.load("prototype"),
}


class Call(NamedTuple):
    """A public function, class or method, and arguments by name; ``owner`` is the first of a method."""

    name: str
    function: object
    arguments: dict

    def __call__(self, **changed):
        arguments = {**self.arguments, **changed}
        kinds = inspect.signature(self.function).parameters
        values, named = [], {}
        for name, parameter in kinds.items():
            if name not in arguments:
                continue
            if parameter.kind is parameter.VAR_POSITIONAL:
                values += arguments[name] or () if name not in changed else [arguments[name]]
            elif parameter.kind is parameter.VAR_KEYWORD:
                named |= arguments[name] or {} if name not in changed else {"unknown": arguments[name]}
            elif parameter.kind is parameter.KEYWORD_ONLY or (
                parameter.kind is not parameter.POSITIONAL_ONLY and named
            ):
                named[name] = arguments[name]
            else:
                values.append(arguments[name])
        return self.function(*values, **named)


def public_callables():
    """Each public function, class and method of the rooms that have a list of public names, by name, once."""
    rooms = ["exo_pin", *(each.name for each in pkgutil.walk_packages(ep.__path__, "exo_pin.") if each.ispkg)]
    found = {}
    for room in map(importlib.import_module, rooms):
        if not hasattr(room, "__all__") or room.__name__ in ("exo_pin.core.errors", "exo_pin.core.files"):
            continue
        for thing in (getattr(room, name) for name in room.__all__):
            if inspect.isfunction(thing):
                # Two rooms may have a function of one name.
                is_other = found.get(thing.__name__, thing) is not thing
                found[f"{room.__name__}.{thing.__name__}" if is_other else thing.__name__] = thing
            elif inspect.isclass(thing) and thing.__module__.startswith("exo_pin") and not _is_apart(thing):
                found[thing.__name__] = thing
                found |= dict(_methods(thing))
    return {name: thing for name, thing in found.items() if name not in APART}


def _is_apart(kind):
    """Whether a class is described to be written by others, or made by Python."""
    return issubclass(kind, Exception | enum.Enum) or getattr(kind, "_is_protocol", False)


def _methods(kind):
    for name, member in inspect.getmembers(kind, callable):
        if not name.startswith("_") and (getattr(member, "__module__", None) or "").startswith("exo_pin"):
            yield f"{kind.__name__}.{name}", member


class Recorder:
    """Keeps arguments of some calls of public names within a ``with`` block."""

    def __init__(self):
        self.calls = {}
        self._codes = {}
        for name, thing in public_callables().items():
            function = inspect.unwrap(thing.__init__ if inspect.isclass(thing) else thing)
            code = getattr(getattr(function, "__func__", function), "__code__", None)
            if code is not None:
                self._codes.setdefault(code, []).append((name, thing))

    def __enter__(self):
        sys.setprofile(self._look)
        return self

    def __exit__(self, *_):
        sys.setprofile(None)

    def _look(self, frame, event, _):
        if event != "call" or frame.f_code not in self._codes:
            return
        code = frame.f_code
        count = code.co_argcount + code.co_kwonlyargcount
        count += bool(code.co_flags & inspect.CO_VARARGS) + bool(code.co_flags & inspect.CO_VARKEYWORDS)
        given = {name: frame.f_locals[name] for name in code.co_varnames[:count]}
        first = next(iter(given.values()), None)
        for name, thing in self._codes[code]:
            kept = self.calls.setdefault(name, [])
            if len(kept) == MOST:
                continue
            if inspect.isclass(thing):
                if type(first) is thing:
                    kept.append(Call(name, thing, dict(list(given.items())[1:])))
            elif inspect.ismethod(thing):
                kept.append(Call(name, thing, dict(list(given.items())[1:])))
            elif "." not in name or type(first).__name__ == name.split(".")[0]:
                kept.append(Call(name, thing, dict(given)))
