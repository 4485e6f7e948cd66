"""Commands whose output cannot be written: one line at most, and a status that says so."""

import functools
import os
import re
import signal
import subprocess
import sys

import numpy as np
import pytest
from command_line import options_of

import exo_pin as ep
from exo_pin import cli, control
from exo_pin.cli import COMMANDS

COMMAND = [sys.executable, "-m", "exo_pin.cli"]


def run(arguments, **options):
    # Without a buffer Python's argparse does not notice that its help was not read.
    own = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    return subprocess.run([*COMMAND, *arguments], stderr=subprocess.PIPE, text=True, check=False, env=own, **options)


@pytest.mark.full
@pytest.mark.parametrize(
    "arguments",
    [["reaction", "prototype", "--json"], pytest.param(["presets"], marks=pytest.mark.full), ["--help"]],
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

    monkeypatch.setattr("exo_pin.cli.design_commands.names_of_presets", stop)
    assert cli.main(["presets"]) == 128 + signal.SIGINT


@pytest.mark.full
def test_a_table_through_standard_output(tmp_path):
    """``--out /dev/stdout`` adds the table to what is printed, in a file and in a pipe alike."""
    arguments = ["sweep", "prototype", "--vary", "r_A_mm=100,110", "--step", "60", "--out", "/dev/stdout"]
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
    done = run(["calibrate", "prototype", str(tmp_path / "swapped.csv")], stdout=subprocess.PIPE)
    assert done.returncode == 0
    assert done.stderr.startswith("exo-pin: changes of the lengths differ")
    assert "column 2 is limb 1" in done.stderr
    assert ".py" not in done.stderr


@pytest.mark.full
def test_orientations_are_doubted_where_they_are_those_of_an_arm(tmp_path):
    exo, path = ep.load("prototype"), tmp_path / "turned.csv"
    orientations = exo.pose([0, 20, 40, 10, 50, 30, 60], [10, 0, 30, 50, 20, 60, 40], [0, 0, 0, 0, 0, 0, 150])
    lengths = exo.inverse_kinematics(orientations).lengths + 1e-4 * np.sin(np.arange(21)).reshape(7, 3)
    control.write_run(control.MeasuredRun(orientations, lengths), path)
    asked = ["calibrate", "prototype", str(path), "--length-noise", "0.3", "--unknowns"]
    with pytest.warns(ep.SuspectMeasurements, match="outside the range of a left shoulder"):
        assert cli.main([*asked, "length_scale"]) == 0
    # Sensors may be mounted in any way.
    assert cli.main([*asked, "length_scale,arm_mounting"]) == 0


def outputs():
    """Every command with every file that it can write, and words for what it needs."""
    for name in COMMANDS:
        options = {option.name: option for option in options_of(name)}
        needed = [option for option in options.values() if option.required]
        given = [word for option in needed for word in (*[option.name][: option.name.startswith("--")], "1")]
        for option in {"--out", "--plot"} & set(options):
            said = options[option].parameter.help or ""
            yield from ((name.split() + given, option, ending) for ending in re.findall(r"\.[a-z]{3,}\b", said))


def test_outputs_are_checked_before_any_work(monkeypatch, tmp_path, capsys):
    """No folder, a folder that takes no file, another ending: of every command and every file that it can write."""
    count = 0
    monkeypatch.setattr(cli.Command, "load", _without_work(cli.Command.load))
    for words, option, ending in outputs():
        for path, said in (
            (tmp_path / "none" / f"file{ending}", "make its folder first"),
            (tmp_path / "file.xyz", f"{option} to end in"),
            (f"/proc/file{ending}", "cannot write"),
        ):
            assert cli.main([*words, option, str(path)]) == 2, (words, option)
            assert said in capsys.readouterr().err
            count += 1
    assert count > 100
    assert list(tmp_path.iterdir()) == []


def _without_work(load):
    """Commands with their options, of which none begins its work."""

    def loaded(command, name):
        found = load(command, name)

        @functools.wraps(found)
        def without_work(*_, **__):
            raise AssertionError("a command has begun its work")

        return without_work

    return loaded


def test_a_missing_extra_is_told_before_any_work(monkeypatch, tmp_path, capsys):
    for package in ("matplotlib", "myo_sim", "optuna"):
        monkeypatch.setitem(sys.modules, package, None)
    monkeypatch.setattr("exo_pin.cli.person_command.load", _no_work)
    monkeypatch.setattr("exo_pin.cli.options.load", _no_work)
    for arguments, extra in (
        (["reaction", "--plot", str(tmp_path / "a.png")], "plot"),
        (["person"], "person"),
        (["workspace", "--moving-centre"], "person"),
        (["optimise"], "optimise"),
    ):
        assert cli.main(arguments) == 2
        assert f".[{extra}]" in capsys.readouterr().err
    # Without a person no command asks for the muscles.
    assert cli.main(["track", "abduction"]) == 2
    assert "--experiment abduction" in capsys.readouterr().err


def test_pictures_need_no_screen(tmp_path, monkeypatch):
    pyplot = pytest.importorskip("matplotlib.pyplot", reason="needs the extra plot")
    pyplot.close(pyplot.figure())  # a backend that is only named is switched to by the first figure
    before, chosen = pyplot.get_backend(), []
    monkeypatch.setattr(pyplot, "switch_backend", lambda name: chosen.append(name))
    assert (
        cli.main(
            ["muscle", "force", "--contraction-mm", "20", "--pressure-bar", "2", "--plot", str(tmp_path / "a.png")]
        )
        == 0
    )
    assert chosen == ["agg"]
    assert pyplot.get_backend() == before


def _no_work(*_, **__):
    raise AssertionError("a command has begun its work")
