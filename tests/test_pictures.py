"""Pictures of the pages: each has a recorded command, stands in a page, and can be drawn again."""

import re
import runpy
import struct
import sys

import pytest
from places import DOCS, PAGES, REPOSITORY, SCRIPTS
from scenes import has_human

from exo_pin.core.errors import BrowserNotFound
from exo_pin.view import find_browser

FOLDER = DOCS / "pictures"
#: Too long for a test: a map with the wearer's muscles in every pose, a grid of 19,656 poses, runs of a plant.
LONG = {"person_map", "workspace_slices", "control"}


@pytest.fixture(scope="module")
def script():
    pytest.importorskip("matplotlib")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "path", [str(SCRIPTS), *sys.path])
        return runpy.run_path(str(SCRIPTS / "pictures.py"))


def has_browser():
    try:
        return bool(find_browser())
    except BrowserNotFound:
        return False


def size(path):
    """Width and height of a PNG, pixels."""
    return struct.unpack(">II", path.read_bytes()[16:24])


def test_every_picture_has_a_command_and_a_page(script):
    names = {path.stem for path in FOLDER.glob("*.png")}
    parts = [script[part] for part in ("COMMANDS", "SCENES", "OTHERS", "DRAWN")]
    assert sorted(names) == sorted(name for part in parts for name in part)
    text = "".join(path.read_text(encoding="utf-8") for path in [*PAGES.values(), REPOSITORY / "README.md"])
    assert {name for name in names if f"pictures/{name}.png" not in text} == set()
    for command in script["OTHERS"].values():
        assert (REPOSITORY / command.split()[1]).exists()


def test_pages_show_the_commands_that_draw(script):
    ours = script["COMMANDS"] | script["SCENES"]
    text = "".join(path.read_text(encoding="utf-8") for path in PAGES.values()).replace("\\\n", "")
    shown = re.findall(r"exo-pin (.*?)\s+--plot docs/pictures/(\w+)\.png", text)
    assert len(shown) > 5
    assert {name: " ".join(command.split()) for command, name in shown}.items() <= ours.items()


@pytest.mark.full
def test_pictures_are_drawn_as_they_are_committed(script, tmp_path):
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    names = [name for name in [*script["COMMANDS"], *script["DRAWN"]] if name not in LONG]
    names += list(script["SCENES"]) if has_human() and has_browser() else []
    script["draw"](names, tmp_path)
    for name in names:
        drawn, committed = size(tmp_path / f"{name}.png"), size(FOLDER / f"{name}.png")
        assert drawn == committed, f"{name}.png: draw it again by docs/scripts/pictures.py {name}"
