"""The benchmarks are run by hand, so that what they import is checked here: they go stale without a word otherwise."""

import ast
import importlib
import importlib.util
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1] / "benchmarks"
#: Peers that a benchmark compares with and that the extra "test" does not hold.
PEERS = {"pymoo", "toolbox_parallel_robots"}


def imports(path):
    """All (module, name or None) of a script, inside functions too."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from ((each.name, None) for each in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from ((node.module, each.name) for each in node.names)


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.py")), ids=lambda path: path.stem)
def test_what_a_benchmark_imports_exists(path, monkeypatch):
    oracles = FOLDER.parent / "tests" / "oracles"
    monkeypatch.setattr(sys, "path", [str(FOLDER), *(each for each in sys.path if each != str(oracles))])
    if '"tests" / "oracles"' in path.read_text() or "import peer" in path.read_text():
        sys.path.insert(0, str(oracles))
    found = list(imports(path))
    assert len(found) > 2
    for module, name in found:
        if module.split(".")[0] in PEERS and importlib.util.find_spec(module.split(".")[0]) is None:
            continue
        loaded = importlib.import_module(module)
        if name is not None and not hasattr(loaded, name):
            importlib.import_module(f"{module}.{name}")
