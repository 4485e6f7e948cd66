"""``exo-pin view``: what it writes, serves and refuses."""

import signal
import subprocess
import sys
import urllib.request

import pytest

from exo_pin.cli import main
from exo_pin.view import Scene
from exo_pin.view.figure import figure as human_module

BARE = ["view", "prototype", "--no-human", "--flexion", "30"]


def run(capsys, *arguments):
    status = main([*arguments])
    return status, *capsys.readouterr()


def test_a_page_is_written(capsys, tmp_path):
    target = tmp_path / "scene.html"
    options = ["--limbs", "muscles", "--person", "1.75,75,male", "--plot", str(target)]
    status, out, _ = run(capsys, *BARE, *options)
    assert status == 0
    clash, path = out.splitlines()
    assert "passes through the wearer" in clash
    assert path == str(target)
    text = target.read_text()
    assert text.startswith("<!DOCTYPE html>")
    assert 'src="' not in text.split("<script>")[0]
    assert "play(JSON" not in text


def test_a_motion_is_written(capsys, tmp_path):
    target = tmp_path / "motion.html"
    status, _, _ = run(capsys, *BARE, "--to", "60,20,0", "--seconds", "0.2", "--plot", str(target))
    assert status == 0
    assert "play(JSON" in target.read_text()


def test_a_missing_figure_is_a_message(capsys, tmp_path, monkeypatch):
    monkeypatch.setattr(human_module, "_shares", lambda: iter(()))
    status, out, _ = run(capsys, "view", "prototype", "--plot", str(tmp_path / "scene.html"))
    assert status == 0
    assert "needs the extra 'human'" in out.splitlines()[0]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["view", "prototyp"], "did you mean 'prototype'"),
        ([*BARE, "--to", "1,2"], "--to F,A,I"),
        ([*BARE, "--to", "a,b,c", "--plot", "x.html"], "--to F,A,I"),
        ([*BARE, "--to", "1,2,3", "--seconds", "0", "--plot", "x.html"], "--seconds"),
        ([*BARE, "--to", "1,2,3", "--seconds", "1e9", "--plot", "x.html"], "--seconds of at most 1000 s, got 1e+09"),
        ([*BARE, "--plot", "x.png", "--size", "big"], "--size"),
        ([*BARE, "--plot", "/proc/none/x.html"], "cannot write"),
        ([*BARE, "--port", "70000"], "65535"),
        ([*BARE, "--scale", "0"], "--scale"),
    ],
)
def test_invalid_arguments_give_one_line_and_status_2(capsys, arguments, message):
    status, out, err = run(capsys, *arguments)
    assert status == 2
    assert out == ""
    assert err.startswith("exo-pin: ")
    assert err.count("\n") == 1
    assert message in err


def test_without_a_browser_a_picture_is_refused_in_one_line(capsys, monkeypatch, tmp_path):
    monkeypatch.setenv("EXO_PIN_BROWSER", "no-such-browser")
    status, _, err = run(capsys, *BARE, "--plot", str(tmp_path / "x.png"))
    assert status == 2
    assert "no-such-browser" in err
    assert not (tmp_path / "x.png").exists()


@pytest.mark.full
def test_the_live_page_is_served_until_it_is_interrupted():
    # A job in the background starts with SIGINT ignored; this one is to hear it wherever the tests run.
    program = "import signal, sys, exo_pin.cli; signal.signal(signal.SIGINT, signal.default_int_handler); "
    program += "sys.exit(exo_pin.cli.main(sys.argv[1:]))"
    command = [sys.executable, "-c", program, *BARE, "--port", "0", "--to", "31,0,0", "--seconds", "0.1"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            address = process.stdout.readline().split()[0]
            with urllib.request.urlopen(address, timeout=10) as answer:
                assert b"viewer.js" in answer.read()
            process.send_signal(signal.SIGINT)
            assert process.wait(20) == 0
            assert process.stderr.read() == ""
        finally:
            process.kill()


@pytest.mark.full
def test_person_is_drawn_with_bones_and_muscles_where_the_extra_is_installed(capsys, tmp_path, monkeypatch):
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    target = tmp_path / "scene.html"
    query = ["view", "prototype", "--person", "1.75,75,male", "--flexion", "30", "--plot", str(target)]
    drawn = []
    monkeypatch.setattr(Scene, "save_html", lambda scene, path: drawn.append(scene._stage.placements().keys()))
    for more in ([], ["--bare"], ["--mannequin"], ["--no-human"]):
        assert main([*query, *more]) == 0
    has_bones = ["/meshcat/wearer/bones/humerus" in paths for paths in drawn]
    assert has_bones == [True, True, False, False]
    monkeypatch.setitem(sys.modules, "clarabel", None)
    assert main(query) == 0
    assert "/meshcat/wearer/bones/humerus" not in drawn[-1]
    capsys.readouterr()
    assert main(["view", "prototype", "--bare"]) == 2
    assert "--person" in capsys.readouterr().err
