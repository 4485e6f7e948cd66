"""``exo-pin view``: the live page, and a browser that is not there."""

import signal
import subprocess
import sys
import urllib.request

import pytest

from exo_pin.cli import main

BARE = ["view", "prototype", "--no-human", "--flexion", "30"]


def run(capsys, *arguments):
    status = main([*arguments])
    return status, *capsys.readouterr()


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
