"""The tool that asks whether tests notice a change: it finds places, changes one, and tells dead from alive."""

import ast
import subprocess
import sys
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
def mutants():
    sys.path.insert(0, str(FOLDER))
    try:
        import mutants as tool
    finally:
        sys.path.remove(str(FOLDER))
    return tool


def changed(tool, number):
    return ast.unparse(tool._Places(number).visit(ast.parse(SOURCE)))


def test_every_place_is_one_change_that_is_said(mutants):
    places = mutants._Places()
    assert ast.unparse(places.visit(ast.parse(SOURCE))) == ast.unparse(ast.parse(SOURCE))
    texts = [changed(mutants, number) for number in range(len(places.found))]
    assert len({*texts, ast.unparse(ast.parse(SOURCE))}) == len(texts) + 1
    said = [change for _, change in places.found]
    assert "x > 0.5  ->  GtE" in said
    assert "x + 1  ->  Sub" in said
    assert "1.0  ->  1.5" in said
    assert not any("got 7" in change or change.startswith("7 ") for change in said)
    assert changed(mutants, said.index("x > 0.5  ->  GtE")).count("x >= 0.5") == 1


def test_a_sample_of_small_functions_is_noticed(mutants):
    """Changes of the vectors' kernels, judged by the tests that stand beside them."""
    assert mutants.tests_of(mutants.ROOT / "exo_pin" / "numerics" / "bounded" / "x.py").name == "bounded"
    assert mutants.tests_of(mutants.ROOT / "exo_pin" / "wrist" / "limbs.py").name == "wrist"
    every = mutants.mutants("muscle/laws")
    assert len(every) > 100
    cross = [each for each in mutants.mutants("numerics") if each.path.name == "vectors.py"]
    check = "from exo_pin.numerics.vectors import cross; assert cross((1., 2., 3.), (4., 5., 6.)) == (-3., 6., -3.)"
    place = next(each for each in cross if "u[1] * v[2] - u[2] * v[1]  ->  Add" in each.change)
    own = {"EXO_PIN_MUTANT": f"{place.module}:{place.number}", "PYTHONPATH": f"{mutants.ROOT}:{FOLDER}"}
    done = subprocess.run(
        [sys.executable, "-c", f"import mutants; {check}"],
        env={**own, "PATH": "", "EXO_PIN_COMPILE": "plain"}, capture_output=True, check=False, text=True,
    )  # fmt: skip
    assert "AssertionError" in done.stderr
