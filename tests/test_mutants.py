"""The tool that asks whether tests notice a change: it finds places, changes one, and tells dead from alive."""

import ast
import subprocess
import sys
import tomllib
import types
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1] / "benchmarks"
pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason="benchmarks are not here")

SOURCE = '''
def f(x: float = 1.0) -> bool:
    """A docstring with 3."""
    if x > 0.5 and not x == 2:
        raise ValueError("got 7", 7)
    return max(x + 1, -x) < 3 or True
'''


@pytest.fixture(scope="module")
def places():
    sys.path.insert(0, str(FOLDER))
    try:
        import mutant_places
    finally:
        sys.path.remove(str(FOLDER))
    return mutant_places


def changed(places, number):
    return ast.unparse(places.Places(number).visit(ast.parse(SOURCE)))


def test_every_place_is_one_change_that_is_said(places):
    found = places.Places()
    assert ast.unparse(found.visit(ast.parse(SOURCE))) == ast.unparse(ast.parse(SOURCE))
    texts = [changed(places, number) for number in range(len(found.found))]
    assert len({*texts, ast.unparse(ast.parse(SOURCE))}) == len(texts) + 1
    said = [change for _, change, _ in found.found]
    assert "x > 0.5  ->  LtE" in said  # numbers of a continuum: reversed
    assert "max(x + 1, -x) < 3  ->  LtE" in said  # a whole number: the bound itself
    assert "x + 1  ->  Sub" in said
    assert "1.0  ->  3.0" in said
    assert not any("got 7" in change or change.startswith("7 ") for change in said)
    assert changed(places, said.index("x > 0.5  ->  LtE")).count("x <= 0.5") == 1
    # What runs at loading belongs to no statement; the rest to the one that runs it.
    assert {statement for _, _, statement in found.found} == {0, 4, 6}


def test_loaded_functions_take_the_changed_code(places, tmp_path):
    file = tmp_path / "loaded.py"
    file.write_text("def double(x):\n    return (lambda y: 2 * y)(x)\n")
    space = {}
    exec(compile(file.read_text(), file, "exec", dont_inherit=True), space)
    places.replace_code(file, places.Places(1).visit(places.parsed(file)))
    assert (space["double"](5), places.parsed(file).body[0].name) == (15, "double")


def test_a_sample_of_small_functions_is_noticed(places):
    """A change as a module is loaded, judged by a sentence of vector algebra."""
    every = places.mutants("muscle/laws")
    assert len(every) > 100
    cross = [each for each in places.mutants("numerics") if each.path.name == "vectors.py"]
    check = "from exo_pin.numerics.vectors import cross; assert cross((1., 2., 3.), (4., 5., 6.)) == (-3., 6., -3.)"
    place = next(each for each in cross if "u[1] * v[2] - u[2] * v[1]  ->  Add" in each.change)
    own = {"EXO_PIN_MUTANT": f"{place.module}:{place.number}", "PYTHONPATH": f"{places.ROOT}:{FOLDER}"}
    done = subprocess.run(
        [sys.executable, "-c", f"import changed_module; {check}"],
        env={**own, "PATH": "", "EXO_PIN_COMPILE": "plain"}, capture_output=True, check=False, text=True,
    )  # fmt: skip
    assert "AssertionError" in done.stderr


def test_a_change_that_no_test_runs_is_alive(places, monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER))
    from mutants import Judge

    judge = object.__new__(Judge)
    judge._by_place, judge._failed = {}, False
    unseen = next(each for each in places.mutants("muscle/laws") if each.statement)
    judge._forked = lambda job, limit: job()
    monkeypatch.setattr("mutants.replace_code", lambda *_: None)
    assert judge._is_alive(unseen)


def test_modules_are_loaded_before_tests_are_traced(places, monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER))
    from mutants import Judge

    judge = object.__new__(Judge)
    judge._chosen = places.mutants("muscle/laws")
    judge.tally, loaded = types.SimpleNamespace(room="muscle/laws"), []
    judge._forked = lambda job, limit: not loaded
    monkeypatch.setattr("mutants.importlib.import_module", loaded.append)
    with pytest.raises(RuntimeError, match="fail without a mutant"):
        judge.pytest_runtestloop(types.SimpleNamespace(items=[]))
    monkeypatch.undo()
    assert sorted(loaded) == sorted({mutant.module for mutant in judge._chosen})


@pytest.mark.parametrize("change", ["edit", "add", "remove"])
def test_a_source_that_changes_ends_the_run(places, tmp_path, change):
    module, note = tmp_path / "exo_pin" / "room" / "module.py", tmp_path / "exo_pin" / "note.txt"
    module.parent.mkdir(parents=True)
    module.write_text("x = 1\n")
    sources = places.Unchanged(tmp_path)
    note.write_text("no source")
    sources.check()
    if change == "edit":
        module.write_text("x = 2\n")
    elif change == "add":
        (tmp_path / "tests").mkdir()
        module = tmp_path / "tests" / "test_more.py"
        module.write_text("")
    else:
        module.unlink()
    with pytest.raises(SystemExit, match=f"changed.*{module.name}.*begin again"):
        sources.check()


def test_listed_equivalents_are_changes_that_the_tool_makes(places):
    """Two lists that are merged lose a heading easily, and lines that are listed change."""
    found = {}
    for one in tomllib.loads((FOLDER / "equivalent_mutants.toml").read_text(encoding="utf-8"))["mutant"]:
        assert set(one) == {"file", "line", "change", "proof"}
        path = places.ROOT / "exo_pin" / one["file"]
        if path not in found:
            walk, lines = places.Places(), path.read_text(encoding="utf-8").splitlines()
            walk.visit(places.parsed(path))
            found[path] = [(lines[line - 1], change) for line, change, _ in walk.found]
        assert any(change == one["change"] and one["line"] in line for line, change in found[path]), one


@pytest.mark.full
def test_tests_of_velocities_notice_changes():
    """A seeded sample of one small room, by the command of the long run."""
    command = [sys.executable, str(FOLDER / "mutants.py"), "wrist/velocity", "--count", "12", "--least", "75"]
    done = subprocess.run(command, capture_output=True, check=False, text=True)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    assert "| wrist/velocity |" in done.stdout
