"""Tasks in the page, by a headless browser; set EXO_PIN_PICTURES to a folder to keep what it looks like."""

import os
from dataclasses import replace
from http.client import HTTPConnection
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from app_window import AppWindow, served

import exo_pin as ep
from exo_pin.app.asked import Asked
from exo_pin.app.following import answered
from exo_pin.core.errors import BrowserNotFound
from exo_pin.view import find_browser

pytestmark = pytest.mark.full
WIDE, NARROW = (1280, 900), (420, 860)
VERDICT, SLIDER = ".verdict b", "[role=slider][aria-label^={}] [tabindex='0']"


@pytest.fixture(scope="module")
def window():
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    try:
        find_browser()
    except BrowserNotFound as missing:
        pytest.skip(str(missing))
    with AppWindow(WIDE) as opened:
        yield opened


def keep(window, name):
    """A picture of the page for who looks at it."""
    if folder := os.environ.get("EXO_PIN_PICTURES"):
        Path(folder, f"{name}.png").write_bytes(window.screenshot())


def test_a_design_of_ones_own_is_checked_by_keyboard(window, tmp_path):
    ep.load("four-cables").save(tmp_path / "mine.toml")
    asked = Asked(str(tmp_path / "mine.toml"), flexion=60.0)
    with served(asked.design, "--flexion", "60") as url:
        window.open(url)
        assert window.text(VERDICT) == answered(asked).parts.verdict
        assert "python" not in window.text(".title").lower()
        keep(window, "own_design")
        window.focus(SLIDER.format("Flexion"))
        window.press("ArrowRight", 5)
        window.settled("document.querySelector('.angle .value').innerText === '65°'")
        moved = answered(replace(asked, flexion=65.0))
        window.settled(f"document.querySelector('.drives').innerText.includes('{moved.parts.drives[0][1]}')")
        assert "exo.pose(65, 0, 0)" in window.text(".call")
        # What is behind a slider moves along: the frame holds the package's own scene.
        frame = "document.querySelector('.scene iframe').contentDocument"
        assert "flexion\N{NO-BREAK SPACE}65°" in window.evaluate(f"{frame}.getElementById('pose').textContent")


def test_the_page_fits_a_telephone_and_says_what_is_refused(window):
    with served("urdf/spring-support.urdf", "--person", "1.6,55,female", "--flexion", "60") as url:
        window.open(url)
        window.resize(NARROW)
        window.wait_for(f"document.documentElement.scrollWidth === {NARROW[0]}")
        keep(window, "narrow")
        window.write("[aria-label='Mass, kg']", "1")
        window.wait_for("document.querySelector('.verdict').innerText.includes('a body mass of 3 to 400 kg')")
        window.write("[aria-label='Mass, kg']", "60")
        window.settled("document.querySelector('.verdict b').innerText.startsWith('IT SUPPORTS')")
        window.resize(WIDE)


def test_only_who_has_the_address_sees_the_page():
    with served() as url:
        place = urlsplit(url)
        for path, host, origin, status in (
            (place.path, place.netloc, None, 200),
            (place.path, place.netloc, f"http://{place.netloc}", 200),
            ("/", place.netloc, None, 403),
            (place.path, "evil.example", None, 403),
            (place.path, place.netloc, "http://evil.example", 403),
            (f"{place.path}scene/unknown/", place.netloc, None, 200),
        ):
            connection = HTTPConnection(place.netloc, timeout=30)
            connection.request("GET", path, headers={"Host": host} | ({"Origin": origin} if origin else {}))
            assert connection.getresponse().status == status, (path, host, origin)
            connection.close()
