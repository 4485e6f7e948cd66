"""Answers of public names as plain data: what differs from the stored ones, and how to store them anew.

    python tests/oracles/answers.py tests/study/test_answers.py sweep          prints what differs in one
    python tests/oracles/answers.py tests/study/test_answers.py sweep --store  stores it as it is now; read it before
    ... --store --steady  and does so again as other processors round: what differs may be anything, and is stored as …

A file ``test_answers.py`` has a mapping ``ASKED`` of questions by name, functions without arguments. In the folder
``answers`` beside it there is a file for each: all public data of what the function returns, or the error that it
raises, and its warnings. What an answer has besides, such as a new column or a new name in a list, changes none.
"""

import argparse
import dataclasses
import enum
import importlib.util
import json
import os
import re
import subprocess
import sys
import warnings
from collections.abc import Callable, Mapping
from functools import cached_property
from pathlib import Path

import numpy as np
import pytest
from descriptions import differences, numbers, rounded, written
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.core.results import Result

#: Digits that are stored, and the share by which a number may differ.
DIGITS, CLOSE = 8, 1e-4
#: Records within records within an answer that are described.
_DEPTH = 3
#: What comes before all names that there are, which may become more.
_LISTS = re.compile(r"there are: |presets with all of it: ")
#: Stands for any value, where it hangs on how a machine rounds.
ANY = "…"
#: Processors whose kernels of OpenBLAS round otherwise, and what NumPy leaves out with them.
_KERNELS = ("Prescott", "Nehalem", "Haswell", "Zen", "SkylakeX")
_NARROW = {"NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4", "OMP_NUM_THREADS": "1"}
#: What says where an answer comes from, and not what it is.
_ABOUT = {"provenance", "notes"}


def described(value, depth=0):
    """Plain data of a value; of objects of the package all that is public and is data."""
    if value is None or isinstance(value, bool | int):
        return value
    if isinstance(value, float):
        return rounded(value, DIGITS)
    if isinstance(value, enum.Enum):
        return value.name
    if isinstance(value, str):
        lines = value.splitlines()
        return value if len(lines) < 2 else lines
    if isinstance(value, Path):
        return value.name
    if isinstance(value, Rotation):
        return numbers(value.as_matrix(), DIGITS)
    if isinstance(value, np.ndarray | np.generic):
        return _array(np.asarray(value), depth)
    if _is_ours(value) and not hasattr(value, "_asdict"):
        return _record(value, depth + 1) if depth < _DEPTH else f"<{type(value).__name__}>"
    if isinstance(value, Mapping):
        return {str(key): described(item, depth) for key, item in value.items()}
    if isinstance(value, tuple) and hasattr(value, "_asdict"):
        return described(value._asdict(), depth)
    if isinstance(value, list | tuple):
        flat = all(isinstance(item, float | int) and not isinstance(item, bool) for item in value)
        return numbers(value, DIGITS) if flat and value else [described(item, depth) for item in value]
    if isinstance(value, set | frozenset):
        return sorted(map(str, value))
    return f"<{type(value).__name__}>"


def _is_ours(value):
    return type(value).__module__.startswith("exo_pin") and not isinstance(value, type)


def _array(value, depth):
    if value.dtype.kind in "fiu":
        return numbers(value, DIGITS)
    if value.dtype.kind == "c":
        return {"real": numbers(value.real, DIGITS), "imaginary": numbers(value.imag, DIGITS)}
    return [described(item, depth) for item in value.tolist()] if value.ndim else described(value.item(), depth)


def _record(value, depth):
    """What an object says of itself, its public fields and its public properties."""
    kind, found = type(value), {}
    if not isinstance(value, Result) or kind.__str__ is not object.__str__:
        said = str(value)
        # Where an object is in memory is no answer.
        found = (
            {}
            if re.search(r"0x[0-9a-f]{6}", said) or said.startswith(f"{kind.__name__}(")
            else {"says": described(said)}
        )
    names = [field.name for field in dataclasses.fields(value)] if dataclasses.is_dataclass(value) else []
    names += [name for name in dir(kind) if isinstance(getattr(kind, name), property | cached_property)]
    for name in dict.fromkeys(names):
        if name.startswith("_") or name in _ABOUT:
            continue
        try:
            part = getattr(value, name)
        except ep.ExoPinError as error:
            part = f"raises {type(error).__name__}: {error}"
        if isinstance(part, Callable) or (depth > 1 and isinstance(part, Result)):
            continue
        found[name] = described(part, depth)
    return (
        found | {"entries": {str(key): described(value[key], depth) for key in value}}
        if isinstance(value, Mapping)
        else found
    )


def answer(question):
    """Plain data of what a question is answered with: what it returns or raises, and what it warns of."""
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        try:
            found = described(question())
        except ep.ExoPinError as error:
            found = {"raises": type(error).__name__, "says": str(error).splitlines()}
    said = sorted(
        {f"{one.category.__name__}: {one.message}" for one in warned if issubclass(one.category, ep.ExoPinWarning)}
    )
    return json.loads(written({"warns": said, "answer": found} if said else {"answer": found}))


def changes(file, name, found):
    """What differs from the stored answer of a test file, a line each; of a question, its answer is computed."""
    stored, found = _stored(file, name), answer(found) if isinstance(found, Callable) else found
    if not stored:
        return [f"nothing is stored in {_path(file, name)}"]
    warned, warns = ({"warns": one.get("warns")} for one in (stored, found))
    return [*differences(warned, _named_in(warned, warns)), *differences(stored, _named_in(stored, found), close=CLOSE)]


def each_of(asked, longer=()):
    """Give a test the name of each question, of longer ones in the full run."""
    assert {*longer} <= {*asked}
    return pytest.mark.parametrize(
        "name", [pytest.param(name, marks=[pytest.mark.full] * (name in longer)) for name in asked]
    )


def steady(stored, found):
    """What is stored, with :data:`ANY` where another answer to the same question differs."""
    if isinstance(stored, dict) and isinstance(found, dict):
        return {name: steady(stored[name], found[name]) for name in stored if name in found}
    if isinstance(stored, list) and isinstance(found, list) and len(stored) == len(found):
        size = max((abs(each) for each in stored if isinstance(each, float | int)), default=0.0)
        if [*differences([*stored, size], [*found, size], close=0.1 * CLOSE)]:
            return [*map(steady, stored, found)]
        return stored
    return ANY if [*differences(stored, found, close=0.1 * CLOSE)] else stored


def _named_in(stored, found):
    """What is found, without names that nothing is stored of, and without what may be anything."""
    if stored == ANY:
        return ANY
    if isinstance(stored, dict) and isinstance(found, dict):
        return {name: _named_in(stored[name], found[name]) for name in stored if name in found}
    if isinstance(stored, list) and isinstance(found, list) and len(stored) == len(found):
        return [*map(_named_in, stored, found)]
    if isinstance(stored, str) and isinstance(found, str):
        ends = [part.end() if (part := _LISTS.search(text)) else len(text) for text in (stored, found)]
        known = stored[ends[0] :].split(", ")
        return found[: ends[1]] + ", ".join(name for name in found[ends[1] :].split(", ") if name in known)
    return found


def _path(file, name):
    return Path(file).parent / "answers" / f"{name}.json"


def _stored(file, name):
    path = _path(file, name)
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def _as_on(kernel, file, name):
    """The answer to a question in a process of its own that rounds as another processor does."""
    own = {"OPENBLAS_CORETYPE": kernel} | _NARROW
    asked = [sys.executable, __file__, str(file), name, "--json"]
    said = subprocess.run(asked, env={**os.environ, **own}, check=True, capture_output=True, text=True).stdout
    return json.loads(said.rpartition("\0")[2])


def main():
    """Ask the questions of a file, print what differs, and store it."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("file", type=Path, help="that has the questions")
    parser.add_argument("names", nargs="*", help="of questions; all if left out")
    parser.add_argument("--store", action="store_true", help="store the answers as they are now")
    parser.add_argument("--steady", action="store_true", help="and leave open what other processors round otherwise")
    parser.add_argument("--json", action="store_true", help="print the answers, and no more")
    options = parser.parse_intermixed_args()
    spec = importlib.util.spec_from_file_location("asked", options.file)
    module = importlib.util.module_from_spec(spec)
    sys.modules["asked"] = module
    spec.loader.exec_module(module)
    for name in options.names or module.ASKED:
        found = answer(module.ASKED[name])
        if options.json:
            print(f"\0{json.dumps(found)}")
            continue
        for kernel in _KERNELS if options.steady else ():
            found = steady(found, _as_on(kernel, options.file, name))
        print(name, *changes(options.file, name, found), sep="\n    ", flush=True)
        if options.store:
            _path(options.file, name).parent.mkdir(exist_ok=True)
            _path(options.file, name).write_text(written(found) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
