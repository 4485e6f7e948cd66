"""Each file of data that is shipped has its source in NOTICE, and each foreign licence its text."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
NOTICE = (ROOT / "NOTICE").read_text(encoding="utf-8")

#: Written here, and no data: stubs of public names, grammars of formats, tables of options, pages and their looks.
OWN = (
    ".py",
    ".pyi",
    "py.typed",
    "_grammar.toml",
    "options/options.toml",
    "options/commands.toml",
    "page.html",
    "page.css",
)


def is_named(path: Path) -> bool:
    patterns = [word.rstrip(",:.") for word in re.findall(r"(?:exo_pin|urdf)/\S+", NOTICE)]
    return any(path.match(pattern) for pattern in patterns if not pattern.endswith("/"))


def test_each_file_of_data_has_a_source():
    files = [path.relative_to(ROOT) for path in (ROOT / "exo_pin").rglob("*") if path.is_file()]
    data = [path for path in files if "__pycache__" not in path.parts and not str(path).endswith(OWN)]
    assert len(data) > 20
    assert [str(path) for path in data if not is_named(path)] == []


@pytest.mark.parametrize("path", sorted((ROOT / "urdf").iterdir()), ids=lambda path: path.name)
def test_a_robot_file_that_takes_from_a_repository_is_named(path):
    foreign = re.findall(r"([\w.-]+/[\w.-]+) \((MIT|BSD-3)\)", path.read_text(encoding="utf-8"))
    for repository, _ in foreign:
        assert repository.split("/")[-1] in NOTICE
        assert is_named(path.relative_to(ROOT))


@pytest.mark.parametrize(
    ("holder", "sentence"),
    [("Zachary Manchester", "Permission is hereby granted"), ("Artificial and Mechanical", "Neither the name of the")],
)
def test_the_text_of_a_licence_stands_with_its_holder(holder, sentence):
    assert sentence in NOTICE.split(holder)[1]
