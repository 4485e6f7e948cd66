"""The package as a whole: names, doctest, layering."""

import ast
import doctest
from pathlib import Path

import exo_pin.muscle as package

FOLDER = Path(package.__file__).parent


def test_public_names_are_sorted_and_there():
    assert package.__all__ == sorted(package.__all__)
    for name in package.__all__:
        assert getattr(package, name).__doc__


def test_the_example_runs():
    result = doctest.testmod(package)
    assert result.attempted >= 5
    assert result.failed == 0


def imports(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return {
        node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.level == 1 and node.module
    }


def test_modules_depend_one_way():
    graph = {path.stem: imports(path) for path in FOLDER.glob("*.py") if path.stem != "__init__"}
    done = set()
    while graph:
        free = {name for name, needs in graph.items() if needs <= done}
        assert free, f"a circle among {sorted(graph)}"
        done |= free
        graph = {name: needs for name, needs in graph.items() if name not in free}


def test_plots_do_not_load_matplotlib_on_import():
    tree = ast.parse((FOLDER / "plots.py").read_text(encoding="utf-8"))
    top = {n.module.split(".")[0] for n in tree.body if isinstance(n, ast.ImportFrom) and n.level == 0}
    assert "matplotlib" not in top


def test_printing_is_left_to_the_command_line():
    for path in FOLDER.glob("*.py"):
        calls = [n for n in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(n, ast.Call)]
        prints = [n for n in calls if isinstance(n.func, ast.Name) and n.func.id in ("print", "input")]
        assert not prints or path.stem in ("cli", "cli_identify")
