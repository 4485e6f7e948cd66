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
from exo_pin.view.plots.plot_style import WIDEST

FOLDER = DOCS / "pictures"


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


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.png")), ids=lambda path: path.stem)
def test_pictures_have_two_pixels_for_each_of_a_page(path):
    """A drawing of 6 inches is 576 pixels of a page wide, the text of the site 736."""
    assert size(path)[0] >= 2 * 576


def test_print_of_drawings_can_be_read_on_a_page(script):
    """A page is 7.7 inches wide: it makes the print of what is much wider too small."""
    widths = {path.stem: size(path)[0] / script["DPI"] for path in FOLDER.glob("*.png")}
    assert not {name: width for name, width in widths.items() if width > WIDEST and name not in script["SCENES"]}


#: Drawn from one pose by a test of its page (tests/study/test_which_kind.py): its own poses take a minute and a half.
ELSEWHERE = {"which_kind"}


@pytest.mark.full
@pytest.mark.parametrize("name", sorted({path.stem for path in FOLDER.glob("*.png")} - ELSEWHERE))
def test_pictures_are_drawn_as_they_are_committed(name, script, tmp_path):
    """Each by its command, those that take minutes with fewer poses."""
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    if name in script["SCENES"] and not (has_human() and has_browser()):
        pytest.skip("needs the extra human (example-robot-data) and a browser")
    script["draw"]([name], tmp_path, coarse=True)
    drawn, committed = size(tmp_path / f"{name}.png"), size(FOLDER / f"{name}.png")
    assert drawn == committed, f"{name}.png: draw it again by docs/scripts/pictures.py {name}"
