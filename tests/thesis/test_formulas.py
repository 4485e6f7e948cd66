"""The page from formula to code: complete and true."""

import importlib.util
import re
import sys
from collections import Counter
from pathlib import Path

import pytest
from places import REPOSITORY, SCRIPTS

import exo_pin as ep


def script():
    """``docs/scripts/formulas.py`` as a module."""
    spec = importlib.util.spec_from_file_location("formulas_page", SCRIPTS / "formulas.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


formulas = script()
ITEMS = {item.label: item for item in formulas.items()}

#: How many equations and figures each chapter of the thesis numbers, from 1 without a gap.
EQUATIONS = {"2": 1, "3": 31, "4": 37, "5": 4, "A": 6, "C": 2, "D": 36}
FIGURES = {"2": 12, "3": 4, "4": 6, "5": 21, "A": 5, "C": 3, "D": 4}
TABLES = [
    *("2-1", "2-2", "2-3", "2-4", "3-1", "3-2", "3-3a", "3-3b", "3-3c", "3-4"),
    *("5-1", "5-2", "5-3", "5-4", "5-5", "5-6", "5-7", "A-1", "A-2", "A-3", "B-1", "C-1", "C-2"),
]


@pytest.fixture(scope="module")
def carriers():
    """The functions that carry each label."""
    return formulas.carriers()


@pytest.fixture(scope="module")
def page(ledger_rows):
    return formulas.page(ledger_rows)


def test_nothing_that_the_thesis_numbers_is_missing(page):
    expected = {f"({part}-{k})" for part, last in EQUATIONS.items() for k in range(1, last + 1)}
    expected |= {f"Figure {part}-{k}" for part, last in FIGURES.items() for k in range(1, last + 1)}
    expected |= {f"Table {name}" for name in TABLES}
    assert set(ITEMS) == expected
    lines = Counter(re.findall(r"^\| (\([^|]*?\)|Table [^|]*?|Figure [^|]*?) \|", page, re.MULTILINE))
    without = re.findall(r"Figures that are [^:]*: ([^:]*)\.(?= Figures|\n)", page.replace("-\n", "-"))
    lines.update(f"Figure {label}" for labels in without for label in re.split(r",\s+", labels))
    assert lines == Counter(expected)


@pytest.mark.parametrize("label", ITEMS)
def test_every_label_has_code_or_data_or_a_reason_why_not(label, carriers):
    item = ITEMS[label]
    assert item.about
    assert bool(item.not_computed) != bool(carriers.get(label) or item.data)
    for path in item.data:
        assert (REPOSITORY / path).is_file()


def test_docstrings_carry_no_label_that_the_thesis_lacks(carriers):
    assert set(carriers) <= set(ITEMS)


def test_default_path_of_reaction_carries_the_labels_of_appendix_d(carriers):
    """The functions that one default question passes through, compiled ones aside, carry its steps up to (D-30)."""
    exo = ep.load("prototype")
    pose = ep.shoulder_rotation(20, 30, 0, degrees=True)
    exo.reaction(pose)  # what is set up once is not part of the path
    called, package = set(), Path(ep.__file__).parents[1]  # the package may be installed elsewhere than it is written

    def note(frame, event, _):
        if event == "call":
            called.add((Path(frame.f_code.co_filename), frame.f_code.co_qualname))

    sys.setprofile(note)
    try:
        exo.reaction(pose)
    finally:
        sys.setprofile(None)
    passed = {
        label
        for label, code in carriers.items()
        if any((package / carrier.path, carrier.name) in called for carrier in code)
    }
    steps = (1, 2, 4, 11, 12, 14, 15, 17, 18, 19, 20, 21, 22, 26, 27, 28, 29, 30)
    assert {f"(D-{k})" for k in steps} <= passed
