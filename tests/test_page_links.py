"""Links, paths and extras that pages name, and the length of the README."""

import re
import tomllib
from pathlib import Path

import pytest
from places import PAGES, REPOSITORY
from places import page as site_page

README = (REPOSITORY / "README.md").read_text(encoding="utf-8")


def anchors(text):
    """Anchors of the headings of a page."""
    heads = re.findall(r"^#+ (.*)$", re.sub(r"```.*?```", "", text, flags=re.DOTALL), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.strip().lower()).replace(" ", "-") for head in heads}


@pytest.mark.parametrize("page", PAGES, ids=str)
def test_links_of_a_page_lead_somewhere(page):
    folder = PAGES[page].parent
    for target, anchor in re.findall(r"\]\((?!https?:|#)([^)#]+)#?([^)]*)\)", site_page(page)):
        found = folder / target
        assert found.exists() or "api" in found.parts or found.parent.name == "notebooks", target
        assert not anchor or anchor in anchors(found.read_text(encoding="utf-8")), (target, anchor)
    for anchor in re.findall(r"\]\(#([^)]+)\)", site_page(page)):
        assert anchor in anchors(site_page(page)), anchor


def test_paths_of_the_page_for_contributors_exist():
    paths = re.findall(r"`((?:exo_pin|tests|benchmarks|docs)/[^`]*)`", site_page("contributing"))
    assert len(paths) > 20
    for path in paths:
        assert (REPOSITORY / path).exists(), path


def test_extras_are_named():
    extras = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    assert {name for name in extras if f"| `{name}` |" not in site_page("start")} == set()


def test_the_readme_is_short():
    assert len(README.splitlines()) <= 120


def test_pictures_and_files_exist():
    root = Path(__file__).parents[1]
    for target in re.findall(r"\]\((?!https?:)([^)#]+)\)", README):
        assert (root / target).exists(), target
