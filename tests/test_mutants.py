"""The tool that asks whether tests notice a change: it finds places, changes one, and tells dead from alive."""

import ast
import os
import re
import signal
import subprocess
import sys
import time
import types
import weakref
from functools import partial
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
    said = [each.change for each in found.found]
    assert "x > 0.5  ->  LtE" in said  # numbers of a continuum: reversed
    assert "max(x + 1, -x) < 3  ->  LtE" in said  # a whole number: the bound itself
    assert "x + 1  ->  Sub" in said
    assert "1.0  ->  3.0" in said
    assert not any("got 7" in change or change.startswith("7 ") for change in said)
    assert places.Place("f", "BinOp", "Add -> Sub", 0) in [each.place for each in found.found]
    assert changed(places, said.index("x > 0.5  ->  LtE")).count("x <= 0.5") == 1
    # What runs at loading belongs to no statement; the rest to the one that runs it.
    assert {each.statement for each in found.found} == {0, 4, 6}


FORGETFUL = """
def f(x):
    for part in sorted(x):
        part.place = abs(part.place)
        part.turn(by=3.0)
    if part:
        keep = lambda y: y
        x[0] += 1
    return 1 if part else g(x)
"""


def test_statements_keywords_calls_and_conditions_are_lost(places):
    found = places.Places()
    found.visit(ast.parse(FORGETFUL))
    texts = [ast.unparse(places.Places(k).visit(ast.parse(FORGETFUL))) for k in range(len(found.found))]
    changes = [each.change for each in found.found]
    for words, text in {
        "sorted(x)  ->  its argument": "for part in x:",
        "part.place = abs(part.place)  ->  dropped": "    for part in sorted(x):\n        pass\n",
        "part.turn(by=3.0)  ->  without by=": "part.turn()",
        "3.0  ->  times 1.2": f"by={1.2 * 3.0!r}",
        "if part  ->  never": "if False:",
        "if part  ->  always": "if True:",
        "x[0] += 1  ->  dropped": "lambda y: y\n        pass",
        "1 if part else g(x)  ->  never": "return g(x)",
    }.items():
        assert text in texts[changes.index(words)], words


def test_loaded_functions_take_the_changed_code(places, tmp_path):
    file = tmp_path / "loaded.py"
    file.write_text("def double(x):\n    return (lambda y: 2 * y)(x)\n")
    space = {}
    exec(compile(file.read_text(), file, "exec", dont_inherit=True), space)
    walk = places.Places()
    walk.visit(places.parsed(file))
    number = [each.place.change for each in walk.found].index("2 -> 3")
    places.replace_code(file, places.Places(number).visit(places.parsed(file)))
    assert (space["double"](5), places.parsed(file).body[0].name) == (15, "double")


def test_names_and_lines_play_no_part_in_a_place(places):
    walks = [places.Places() for _ in range(3)]
    for walk, text in zip(walks, (SOURCE, "\n\n" + SOURCE.replace("x", "y"), SOURCE.replace("f(", "g(")), strict=True):
        walk.visit(ast.parse(text))
    same, renamed, other = ([each.place for each in walk.found] for walk in walks)
    assert (same == renamed, len(set(same))) == (True, len(same))
    assert {place.function for place in other} == {"g"}


def test_a_module_changes_as_it_is_loaded(places, tmp_path):
    (tmp_path / "loaded.py").write_text("def difference(x, y):\n    return x - y\n")
    own = {"EXO_PIN_MUTANT": "loaded:0", "PYTHONPATH": f"{tmp_path}:{FOLDER}", "PATH": ""}
    command = [sys.executable, "-c", "import loaded; print(loaded.difference(2, 1))"]
    assert subprocess.run(command, env=own, capture_output=True, check=True, text=True).stdout == "3\n"


def test_a_change_that_no_test_runs_is_alive(places, monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER))
    from mutants import Judge

    judge = object.__new__(Judge)
    judge._by_place, judge._failed, judge._budget, judge._children = {}, False, 1.0, False
    unseen = next(each for each in places.mutants("muscle/laws") if each.statement)
    monkeypatch.setattr("mutants.replace_code", lambda *_: None)
    assert judge._job("muscle", unseen)[0]()


def test_jobs_run_at_once_and_answer_in_order(monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER))
    from mutants import at_once

    class Gone:
        """Its proxy answers no question any more."""

    gone = weakref.proxy(Gone())

    def late():
        time.sleep(0.1)
        return True

    jobs = [(late, None), (lambda: False, 60.0), (lambda: True, 60.0), (lambda: time.sleep(60.0), 0.2)]
    jobs += [(lambda: os.kill(os.getpid(), signal.SIGKILL) is None, 60.0)]
    assert list(at_once(iter(jobs), 2)) == [True, False, True, False, False]
    assert type(gone) is weakref.ProxyType


@pytest.mark.full
def test_a_run_notes_what_its_tests_come_by(tmp_path):
    """Two processes run the tests of laws of muscles; a sample of changes there is judged by what they have noted."""
    asked = [sys.executable, str(FOLDER / "mutants.py"), "muscle/laws", "--count", "8", "--without-kernels"]
    run = partial(subprocess.run, capture_output=True, text=True, cwd=FOLDER.parent)
    (tmp_path / "modules.txt").write_text(run([*asked, "--modules"], check=True).stdout)
    own = {"EXO_PIN_NOTED": str(tmp_path), "PYTHONPATH": os.pathsep.join([str(FOLDER.parent), str(FOLDER)])}
    command = [sys.executable, "-m", "pytest", "-q", "-n", "2", "-p", "noted_tests", "tests/muscle/laws"]
    assert " passed" in run(command, env=os.environ | own, check=True).stdout
    done = run([*asked, "--noted", str(tmp_path), "--least", "50"])
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    assert len(list(tmp_path.glob("*.json"))) == 2
    assert re.search(r"^\| muscle/laws \| [4-8] of 8", done.stdout, re.MULTILINE)


def test_share_and_its_lower_bound(places, monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER))
    from mutants import Tally

    # Of Clopper and Pearson, from one side: 95 % ** (1 / n) where all are killed.
    assert Tally("room", 21, [], ["one"]).least == pytest.approx(100.0 * 0.05 ** (1 / 20))
    assert str(Tally("room", 60, ["one"] * 5, [])) == "| room | 55 of 60 | 92 % | 83 % | 0 |"


def test_modules_are_loaded_before_tests_are_traced(places, monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER))
    from mutants import Judge

    judge = object.__new__(Judge)
    judge._folder, judge._jobs = None, 1
    judge._chosen = [("muscle", each) for each in places.mutants("muscle/laws")]
    loaded = []
    judge._trace = lambda items, file: bool(loaded) and False
    monkeypatch.setattr("mutants.importlib.import_module", loaded.append)
    with pytest.raises(RuntimeError, match="could not be run"):
        judge.pytest_runtestloop(types.SimpleNamespace(items=[]))
    monkeypatch.undo()
    assert sorted(loaded) == sorted({mutant.module for _, mutant in judge._chosen} | {"numba"})


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


def test_listed_equivalents_are_changes_that_the_tool_makes(places, monkeypatch):
    monkeypatch.syspath_prepend(str(FOLDER))
    from mutants import known_equivalents

    listed, found = known_equivalents(), {}
    for file in {file for file, _ in listed}:
        walk = places.Places()
        walk.visit(places.parsed(places.ROOT / "exo_pin" / file))
        found[file] = {each.place for each in walk.found}
    assert listed
    assert [(file, place) for file, place in listed if place not in found[file]] == []
    assert all(listed.values())


@pytest.mark.full
def test_tests_of_velocities_notice_changes():
    """A seeded sample of one small room, by the command of the long run."""
    command = [sys.executable, str(FOLDER / "mutants.py"), "wrist/velocity", "--count", "12", "--least", "75"]
    done = subprocess.run(command, capture_output=True, check=False, text=True)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    assert "| wrist/velocity |" in done.stdout
