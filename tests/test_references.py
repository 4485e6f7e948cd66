"""Names that docstrings and pages point to are there."""

import re
from importlib import import_module
from pathlib import Path

import pytest
from places import PAGES as SITE
from places import REPOSITORY

import exo_pin as ep

FOLDER = Path(ep.__file__).parent
ROOT = REPOSITORY
PAGES = [ROOT / "README.md", *SITE.values()]
#: Cross-references of docstrings with a full name, or to a module from the folder of the one that speaks.
REFERENCE = re.compile(r":(?:(?:mod|class|func|meth|attr|data|exc):`~?(?=exo_pin)|mod:`)([A-Za-z_.]+)`")
#: Names in code style on a page, as a reader types them after ``import exo_pin as ep``.
TYPED = re.compile(r"`(?:ep|exo_pin)((?:\.[A-Za-z_]+)+)")


def is_there(holder, names):
    """Whether attributes or fields of these names follow each other."""
    for name in names:
        if not hasattr(holder, name):
            return isinstance(holder, type) and name in getattr(holder, "__dataclass_fields__", {})
        holder = getattr(holder, name)
    return True


def is_module_or_in_one(full):
    parts = full.split(".")
    for end in range(len(parts), 0, -1):
        try:
            return is_there(import_module(".".join(parts[:end])), parts[end:])
        except ImportError:
            continue
    return False


def test_docstrings_point_to_what_is_there():
    missing = []
    for path in FOLDER.rglob("*.py"):
        package = ".".join([FOLDER.name, *path.relative_to(FOLDER).parent.parts])
        for name in REFERENCE.findall(path.read_text(encoding="utf-8")):
            up = len(name) - len(name.lstrip("."))
            base = package.split(".")
            full = name if not up else ".".join([*base[: len(base) - up + 1], name[up:]])
            if not is_module_or_in_one(full):
                missing.append(f"{path.relative_to(FOLDER)}: {name}")
    assert not missing


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.stem)
def test_names_on_a_page_work_after_one_import(page):
    text = page.read_text(encoding="utf-8")
    assert [name for name in TYPED.findall(text) if not is_there(ep, name[1:].split("."))] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.stem)
def test_files_that_a_page_names_are_there(page):
    text = page.read_text(encoding="utf-8")
    # Modules are named from some folder of the package on.
    parts = ("exo_pin", "tests", "benchmarks", "docs", "notebooks", "examples")
    code = {path.relative_to(ROOT).as_posix() for part in parts
            for path in (ROOT / part).rglob("*.py")}  # fmt: skip
    named = re.findall(r"`([a-z_0-9/]+/[a-z_0-9]+\.py)`", text)
    assert [name for name in named if not any(f"/{path}".endswith(f"/{name}") for path in code)] == []
