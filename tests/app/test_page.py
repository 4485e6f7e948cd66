"""Tasks in the page, by a headless browser; set EXO_PIN_PICTURES to a folder to keep what it looks like."""

import contextlib
import json
import os
import re
import socket
import time
from dataclasses import replace
from pathlib import Path

import pytest
from app_window import AppWindow, served
from places import REPOSITORY

import exo_pin as ep
from exo_pin.app.asked import Asked
from exo_pin.app.dimensions import dimensions_of
from exo_pin.app.following import answered
from exo_pin.core.errors import BrowserNotFound
from exo_pin.view import find_browser

pytestmark = pytest.mark.full
WIDE, NARROW = (1280, 900), (420, 860)
LIFT = REPOSITORY / "examples" / "lift.csv"
VERDICT, SLIDER = ".verdict b", "[role=slider][aria-label^={}] [tabindex='0']"


@pytest.fixture(scope="module")
def window():
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    try:
        find_browser()
    except BrowserNotFound as missing:
        pytest.skip(str(missing))
    # A first answer on a busy machine may wait for compilers.
    with AppWindow(WIDE, timeout=240.0) as opened:
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
        window.settled("document.querySelector('.pose .value').innerText === '65'")
        moved = answered(replace(asked, flexion=65.0))
        window.settled(f"document.querySelector('.drives').innerText.includes('{moved.parts.drives[0][1]}')")
        assert "exo.pose(65, 0, 0)" in window.text(".call")
        # What is behind a slider moves along: the frame holds the package's own scene.
        frame = "document.querySelector('.scene iframe').contentDocument"
        window.wait_for(f"{frame}.getElementById('pose').textContent.includes('flexion\N{NO-BREAK SPACE}65°')")


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


def downloaded(folder, name):
    """The content of a file that the browser is writing."""
    end = time.monotonic() + 240.0
    while not (folder / name).is_file():
        assert time.monotonic() < end, list(folder.iterdir())
        time.sleep(0.1)
    return (folder / name).read_bytes()


def test_the_cuff_is_raised_and_the_design_saved_and_given_again(window, tmp_path):
    asked = Asked("four-cables", flexion=60.0)
    (height,) = (each.value for each in dimensions_of(asked.exo.device) if each.name == "cuff_height_mm")
    raised = asked.changed("cuff_height_mm", height - 5.0)
    with served(asked.design, "--flexion", "60") as url:
        window.open(url)
        window.downloads_to(tmp_path)
        before = window.text(".drives")
        window.focus(SLIDER.format("Cuff"))
        window.press("ArrowLeft", 10)
        window.settled(f"document.querySelector('.call').innerText.includes('{raised.changes[0][1]:.9g}')")
        window.wait_for(f"document.querySelector('.drives').innerText !== {json.dumps(before)}")
        assert answered(raised).parts.drives[0][1] in window.text(".drives")
        keep(window, "raised_cuff")
        window.click(".top button")
        (tmp_path / "given").mkdir()
        (tmp_path / "given" / "raised.toml").write_bytes(downloaded(tmp_path, "four-cables.toml"))
        again = ep.load(tmp_path / "given" / "raised.toml").geometry
        assert again.platform_points[:, 2].mean() == pytest.approx(1e-3 * (5.0 - height))
        window.give(".device input[type=file]", tmp_path / "given" / "raised.toml")
        window.settled("document.querySelector('.call').innerText.includes('ep.load(\"raised.toml\"')")
        assert answered(raised).parts.drives[0][1] in window.text(".drives")


def test_a_better_design_is_found_by_a_search_that_is_stopped(window, tmp_path):
    pytest.importorskip("optuna")
    low = ep.load("four-cables").device.with_dimensions(cuff_height_mm=250.0)
    ep.ShoulderExo.from_device(low).save(tmp_path / "low.toml")
    asked = Asked(str(tmp_path / "low.toml"), flexion=60.0)
    with served(asked.design, "--flexion", "60") as url:
        window.open(url)
        window.click(".device .row-of-buttons button")
        window.wait_for("document.querySelector('.found').innerText.includes('designs tried')")
        keep(window, "search")
        assert window.text(".device .row-of-buttons button").lower() == "stop the search"
        window.wait_for("document.querySelector('.device .row-of-buttons button:last-child').offsetParent")
        window.click(".device .row-of-buttons button:last-child")
        window.settled("document.querySelector('.call').innerText.includes('cuff_height_mm')")
        height = re.search(r'"cuff_height_mm": ([\d.]+)', window.text(".call"))[1]
        found = answered(asked.changed("cuff_height_mm", float(height)))
        window.wait_for(f"document.querySelector('.drives').innerText.includes('{found.parts.drives[0][1]}')")
        assert window.text(".device .row-of-buttons button").lower() == "search within sliders"
        keep(window, "better_design")


def test_a_clinician_sets_up_a_light_person_with_a_flaccid_arm_and_gets_the_report(window, tmp_path):
    asked = Asked(flexion=60.0, mass=45.0, height=1.55, sex="female", strength=0.0)
    with served("--flexion", "60") as url:
        window.open(url)
        window.downloads_to(tmp_path)
        window.focus("[aria-label=Sex]")
        window.press("ArrowDown", 2)
        window.press("Enter")
        for label, text in (("Height, m", "1.55"), ("Mass, kg", "45"), ("Strength, %", "0")):
            window.write(f"[aria-label='{label}']", text)
        window.settled("document.querySelector('.call').innerText.includes('1.55, 45, \"female\", strength=0.0')")
        found = answered(asked)
        window.wait_for(f"document.querySelector('.verdict b').innerText === {json.dumps(found.parts.verdict)}")
        for label, text in found.parts.lines:
            assert label in window.text(".lines")
            assert " ".join(text.split()) in " ".join(window.text(".lines").split())
        keep(window, "clinician")
        window.click(".top button:nth-of-type(2)")
        assert downloaded(tmp_path, f"{asked.exo.device.name}-report.pdf").startswith(b"%PDF-")


def test_two_designs_stand_side_by_side(window):
    asked = Asked("four-linear-actuators-worn", flexion=60.0)
    with served("--flexion", "60") as url:
        window.open(url)
        window.choose("Beside it", "four-cables")
        window.wait_for("document.querySelectorAll('[data-moving=no]').length === 2")
        texts = window.evaluate("[...document.querySelectorAll('.drives')].map((each) => each.innerText)")
        for text, design in zip(texts, (asked.design, "four-cables"), strict=True):
            assert answered(replace(asked, design=design)).parts.drives[0][1] in text
        drawn = "[...document.querySelectorAll('.scene iframe')].map((each) => each.contentDocument.body.dataset.state)"
        window.wait_for(f"{drawn}.join() === 'drawn,drawn'")
        keep(window, "side_by_side")
        window.resize(NARROW)
        window.wait_for(f"document.documentElement.scrollWidth === {NARROW[0]}")
        window.resize(WIDE)
        window.choose("Beside it", "nothing")
        window.wait_for("document.querySelectorAll('.verdict').length === 1")


def test_a_recorded_movement_is_played_and_scrubbed(window):
    movement = ep.read_movement(LIFT)
    exo = Asked().exo
    largest = exo.follow(movement)
    with served() as url:
        window.open(url)
        window.give(".pose input[type=file]", LIFT)
        window.wait_for(f"document.querySelector('.words').innerText.includes('{largest.peak:.1f} N')")
        window.click(".strip button")
        window.wait_for("document.querySelector('.clock').innerText === '4.00 of 4.00 s'")
        keep(window, "played")
        window.focus(SLIDER.format("Time"))
        window.press("ArrowLeft", 200)
        window.settled("document.querySelector('.clock').innerText === '2.00 of 4.00 s'")
        window.settled("document.querySelector('.call').innerText.includes('ep.Motion')")
        own = movement.motion
        motion = ep.Motion(own.angular_velocity[100], own.angular_acceleration[100])
        size = float(exo.reaction(movement.poses[100], motion).magnitude)
        window.wait_for(f"document.querySelector('.figures').innerText.includes('{size:.0f}')")
        keep(window, "scrubbed")
        window.focus(SLIDER.format("Flexion"))
        window.press("ArrowRight")
        window.settled("!document.querySelector('.call').innerText.includes('ep.Motion')")


def test_sensors_move_the_arm_and_lost_samples_are_said(window):
    connect = pytest.importorskip("websockets.sync.client").connect
    from websockets.exceptions import ConnectionClosed

    with served() as url:
        window.open(url)
        window.click(".sensors")
        window.wait_for("document.querySelector('.where pre')")
        lines = [line.split(None, 1) for line in window.text(".where").splitlines()]
        (_, address), (_, udp), (_, opening), _ = lines
        with connect(address) as stream:
            stream.send(opening)
            assert json.loads(stream.recv())["opened"] == "pose"
            for seq in (0, 1, 4):
                stream.send(json.dumps({"seq": seq, "t": 0.01 * seq, "flexion": 50.0 + seq, "abduction": 20.0}))
            window.settled("document.querySelector('.call').innerText.includes('exo.pose(54, 20, 0)')")
        words = window.evaluate("document.querySelector('.live .words').innerText")
        assert "2 lost" in words or "No sample for" in words
        keep(window, "sensors")
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
            link.connect(("127.0.0.1", int(udp.split()[-1])))
            link.settimeout(30.0)
            link.send(opening.encode())
            assert json.loads(link.recv(65536))["opened"] == "pose"
            link.send(b'{"t": 0.0, "flexion": 35.0}')
            window.settled("document.querySelector('.call').innerText.includes('exo.pose(35, 0, 0)')")
        window.click(".live button")
        window.wait_for("!document.querySelector('.live').offsetParent")
        # The page may have closed it before anything is sent.
        with connect(address) as stream:
            with contextlib.suppress(ConnectionClosed):
                stream.send(opening)
            with pytest.raises(ConnectionClosed, match="1008"):
                stream.recv()


def middle_of_handle(window, title):
    """Where a handle of the scene is on the page."""
    frame = "document.querySelector('.scene iframe')"
    handle = f"[...{frame}.contentDocument.querySelectorAll('.handle')].find((each) => each.title === '{title}')"
    window.wait_for(handle)
    return window.evaluate(
        f"(() => {{ const outer = {frame}.getBoundingClientRect(), inner = {handle}.getBoundingClientRect();"
        "return [outer.left + inner.left + inner.width / 2, outer.top + inner.top + inner.height / 2]; })()"
    )


def test_the_hand_is_dragged_in_the_picture(window):
    with served("--flexion", "60") as url:
        window.open(url)
        window.drag_from(*middle_of_handle(window, "Drag the hand"), (0, -60), 6)
        window.settled("Number(document.querySelector('.pose .value').innerText) > 62")
        shown = "document.querySelector('.pose .value').innerText"
        window.wait_for(f"document.querySelector('.call').innerText.includes('exo.pose(' + Number({shown}) + ', ')")
        keep(window, "dragged_hand")


def test_a_joint_centre_is_dragged_in_the_picture(window):
    with served("four-cables", "--flexion", "60") as url:
        window.open(url)
        window.click(".joints")
        window.drag_from(*middle_of_handle(window, "Drag the A[2]"), (30, -40), 6)
        window.settled("document.querySelector('.device').innerText.includes('Changed: A[2]')")
        radius = float(re.search(r'"A\[2\].radius_mm": ([\d.]+)', window.text(".call"))[1])
        assert radius > 260.0  # 249.87 as designed; up and away from the shoulder
        keep(window, "dragged_joint")
        window.choose("Design", "prototype")
        window.settled("!document.querySelector('.call').innerText.includes('with_dimensions')")
