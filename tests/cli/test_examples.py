"""Every command that a help text shows is run, on files that ship; and those files are what their script writes."""

import re
import runpy
import shlex
import webbrowser
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from command_line import called, run, shown

import exo_pin as ep
from exo_pin.cli import COMMANDS

ROOT = Path(__file__).parents[2]
#: Commands that take less than a second.
QUICK = ("presets", "kinematics", "mobility", "muscle")
#: What the answer to an example of each command says.
ANSWERS = {
    "reaction": r"YES, it holds|NO, it cannot|The device can(not)? hold this pose|(\d+) poses|\d+ samples",
    "person": r"The joint carries \d+ N|\d+ samples|as given +\d+",
    "kinematics": r"\d+ poses? fits?",
    "singularity": r"nearest singular pose +\d|singular",
    "view": r"The device can|http://",
    "workspace": r"\d+\.\d % of \d+ poses are inside",
    "parts": r"Mass of these parts: \d",
    "tasks": r"published range +\d+|does \d+ of 14 tasks of a day",
    "compare": r"ranks first|Equal first",
    "report": r"It holds (none|\d)",
    "uncertainty": r"shoulder force|offset|draws of all",
    "presets": r"four-(cables|linear-actuators)",
    "sweep": r"ranks first|Equal first|No design holds",
    "optimise": r"Checked with Pinocchio",
    "calibrate": r"All \d+ unknowns are determined",
    "export": r"(four-cables\.xml|device\.urdf|worn\.xml Limbs are tendons)",
    "check": r": consistent",
    "record": r"can have moved like this",
    "mobility": r"degrees of freedom +\d",
    "forces": r"effort of limb_1_slide +-?\d+(\.\d+)? N",
    "track": r"abduction test|peak F_s, N \d+",
    "muscle force": r"force_N",
    "muscle pressure": r"30\.00 +20\.00 +\d\.\d+",
    "muscle identify": r"\d+ of \d+ measurements",
    "muscle step": r"settling time +\d",
    "muscle loop": r"steady error +-?\d",
    "thesis": r"reproduced [-\d]",
    "exo-pin thesis": r" --section LABEL shows one section, --reasons the numbers that have no row$",
    "app": r"http://127\.0\.0\.1:\d+/\S+/ \(Ctrl-C ends it\)",
    "batch": r'"id": "raised".*"can_hold": true.*"index": 0',
    "serve": r"answers at http://127",
    "schema": r"exo_pin\.reaction/1|joint_contact",
    "warm-up": r"kernels are ready",
}


def test_every_command_shows_some():
    assert {called(line) for line in shown() if "--help" not in line} == set(COMMANDS)
    assert len(shown()) > 40


def marked(line):
    return pytest.param(line, marks=() if line.split()[1] in QUICK else pytest.mark.full)


@pytest.mark.parametrize("line", [marked(line) for line in shown() if "--help" not in line])
def test_examples_run(line, capsys, monkeypatch, tmp_path, request):
    if "person" in line:
        pytest.importorskip("myo_sim", reason="needs the extra person")
    if "optimise" in line:
        pytest.importorskip("optuna", reason="needs the extra optimise")
        line = line.replace("--budget 20000", "--budget 60 --run-length 60")
    if line.startswith("exo-pin compare"):
        line = line.replace("--step 20", "--step 45")
    if "--open" in line:
        # Nobody looks, and the live page ends as by Ctrl-C.
        monkeypatch.setattr(webbrowser, "open", lambda url: True)
        ended = SimpleNamespace(Event=lambda: SimpleNamespace(wait=_ctrl_c))
        monkeypatch.setattr("exo_pin.cli.view_command.threading", ended)
    if line.startswith("exo-pin app"):
        pytest.importorskip("nicegui", reason="needs the extra app")
    if line.startswith(("exo-pin app", "exo-pin serve")):
        # Processes start, and it ends before the first question.
        server = pytest.importorskip("uvicorn", reason="needs the extra service").Server
        monkeypatch.setattr(server, "run", lambda *_, **__: None)
        monkeypatch.setenv("EXO_PIN_TOKEN", "a-token-of-some-length")
    if line.startswith("exo-pin thesis"):
        rows = request.getfixturevalue("ledger_rows")
        monkeypatch.setattr("exo_pin.thesis.ledger", lambda: rows)
    for name in ("examples", "urdf"):
        (tmp_path / name).symlink_to(ROOT / name)
    monkeypatch.chdir(tmp_path)
    program, *words = shlex.split(line)
    assert program == "exo-pin"
    status, out, err = run(capsys, *words)
    assert status == 0, err
    assert re.search(ANSWERS.get(line, ANSWERS[called(line)]), " ".join(out.split())), out
    for word in ("Traceback", "nan", "None"):
        assert re.search(rf"\b{word}\b", out) is None
    for option in ("--out", "--plot"):
        if option in words:
            assert (tmp_path / words[words.index(option) + 1]).stat().st_size > 20


def _ctrl_c():
    raise KeyboardInterrupt


def test_files_that_ship_are_those_of_their_script(tmp_path):
    runpy.run_path(str(ROOT / "examples" / "write_examples.py"))["write"](tmp_path)
    written = sorted(path.name for path in tmp_path.iterdir())
    assert written == sorted(path.name for path in (ROOT / "examples").iterdir() if path.suffix in (".csv", ".toml"))
    for name in written:
        old, new = ROOT / "examples" / name, tmp_path / name
        if name.endswith(".toml"):
            assert old.read_text() == new.read_text()
            continue
        tables = [np.genfromtxt(path, delimiter=",", names=True) for path in (old, new)]
        assert tables[0].dtype == tables[1].dtype
        np.testing.assert_allclose(*(table.tolist() for table in tables), rtol=1e-9, atol=1e-9)
    assert ep.load(ROOT / "examples" / "device.toml").reaction(ep.shoulder_rotation(0, 0, 0)).can_hold
