"""Commands whose output cannot be written: one line at most, and a status that says so."""

import os
import signal
import subprocess
import sys

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import cli, control

COMMAND = [sys.executable, "-m", "exo_pin.cli"]


def run(arguments, **options):
    # Without a buffer Python's argparse does not notice that its help was not read.
    own = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    return subprocess.run([*COMMAND, *arguments], stderr=subprocess.PIPE, text=True, check=False, env=own, **options)


@pytest.mark.parametrize(
    "arguments",
    [["reaction", "--json"], pytest.param(["presets"], marks=pytest.mark.full), ["--help"]],
    ids=lambda a: a[0],
)
def test_a_reader_that_has_ended(arguments):
    reading, writing = os.pipe()
    os.close(reading)
    ended = run(arguments, stdout=writing)
    os.close(writing)
    assert ended.returncode == 128 + signal.SIGPIPE
    assert ended.stderr == ""


@pytest.mark.full
def test_a_full_disk():
    with open("/dev/full", "w") as full:
        ended = run(["presets"], stdout=full)
    assert ended.returncode == 2
    assert ended.stderr == "exo-pin: [Errno 28] No space left on device\n"


def test_ctrl_c(monkeypatch):
    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("exo_pin.cli.design.design_commands.presets", stop)
    assert cli.main(["presets"]) == 128 + signal.SIGINT


@pytest.mark.full
def test_a_table_through_standard_output(tmp_path):
    """``--out /dev/stdout`` adds the table to what is printed, in a file and in a pipe alike."""
    arguments = ["sweep", "--vary", "r_A_mm=100,110", "--step", "60", "--out", "/dev/stdout"]
    with (tmp_path / "out").open("w") as out:
        assert run(arguments, stdout=out).returncode == 0
    text = (tmp_path / "out").read_text()
    assert "r_A_mm,peak_F_s_N" in text
    assert text.endswith("/dev/stdout\n")
    assert run(arguments, stdout=subprocess.PIPE).stdout == text


@pytest.mark.full
def test_a_warning_is_one_line(tmp_path):
    exo = ep.load("prototype")
    orientations = exo.pose(flexion=[0, 20, 40, 10, 50, 30, 60], abduction=[10, 0, 30, 50, 20, 60, 40])
    lengths = exo.inverse_kinematics(orientations).lengths[:, [1, 0, 2]] + 1e-4 * np.sin(np.arange(21)).reshape(7, 3)
    control.write_run(control.MeasuredRun(orientations, lengths), tmp_path / "swapped.csv")
    done = run(["calibrate", str(tmp_path / "swapped.csv")], stdout=subprocess.PIPE)
    assert done.returncode == 0
    assert done.stderr.startswith("exo-pin: changes of the lengths differ")
    assert "column 2 is limb 1" in done.stderr
    assert ".py" not in done.stderr
