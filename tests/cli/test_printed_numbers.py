"""Each number that a command prints is one of its answer's, which ``--json`` prints with more digits."""

import itertools
import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from command_line import called, options_of, run, shown
from scipy.spatial.transform import Rotation

import exo_pin as ep

ROOT = Path(__file__).parents[2]
#: A printed unit over that of the answer: mm, degrees, percent, bar, ms and their inverses.
FACTORS = (1.0, 1e3, 1e-3, 100.0, 180.0 / np.pi, np.pi / 180.0, 1e-5, np.degrees(1e-3), 1e6)
#: What takes minutes, prints a list of names, or writes a page and no answer.
LEFT = ("optimise", "warm-up", "view ", "--draw", "identify", "--list", "--fault burst")
#: What takes more than a second or two.
SLOW = ("track ", "thesis", "uncertainty", "examples/device.toml")
#: Printed as zero to rounding.
ROUNDING = 1e-12
NUMBER = re.compile(r"(?<![\w.#])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w])")


def lines_with_json():
    for line in shown():
        if "--help" in line or any(word in line for word in LEFT):
            continue
        if any("--json" in option.names for option in options_of(called(line))):
            yield pytest.param(line, marks=pytest.mark.full if any(word in line for word in SLOW) else ())


def numbers_of(value):
    """All numbers of a JSON answer, and the angles of the rotations in it."""
    if isinstance(value, dict):
        turns = value.get("quaternions_xyzw")
        if turns:
            for side in ("left", "right"):
                yield from ep.shoulder_angles(Rotation.from_quat(turns), side).ravel()
            yield from ep.thesis_angles(Rotation.from_quat(turns)).ravel()
        yield from itertools.chain.from_iterable(map(numbers_of, value.values()))
        yield len(value)
    elif isinstance(value, list):
        yield len(value)
        yield from itertools.chain.from_iterable(map(numbers_of, value))
        if value and all(isinstance(item, int | float) for item in value):
            # A force's size and its direction; the force and the moment of a wrench.
            for part in (value, value[:3], value[3:]) if len(value) == 6 else (value,):
                size = float(np.linalg.norm(part))
                yield from (size, *(item / size for item in part if size))
    elif isinstance(value, str):
        yield from (float(word) for word in NUMBER.findall(value))
    elif isinstance(value, int | float):
        yield float(value)


def answered(text):
    """What a command prints, but for two paragraphs that say again what was asked: the head and the wearer."""
    parts = text.split("\n\n")
    return "\n\n".join(part for part in parts[1 if len(parts) > 1 else 0 :] if not part.startswith("Person\n"))


def missing(text, answer, given):
    """Printed numbers that are none of the answer's, to the printed digits, nor of the command."""
    known = np.array([*numbers_of(answer), *(float(word) for word in NUMBER.findall(given.replace(",", " ")))])
    known = np.abs(np.unique(known[np.isfinite(known)])[:, None] * np.array(FACTORS)).ravel()
    lost = []
    for word in NUMBER.findall(text):
        mantissa, _, power = word.partition("e")
        digit = 10.0 ** (int(power or 0) - len(mantissa.partition(".")[2]))
        if abs(float(word)) > ROUNDING and not (np.abs(known - abs(float(word))) <= 0.5001 * digit).any():
            lost.append(word)
    return lost


@pytest.mark.full
@pytest.mark.parametrize("line", list(lines_with_json()))
def test_a_printed_number_is_a_field_of_the_answer(line, capsys, monkeypatch, tmp_path):
    if "person" in line:
        pytest.importorskip("myo_sim", reason="needs the extra person")
    for name in ("examples", "urdf"):
        (tmp_path / name).symlink_to(ROOT / name)
    monkeypatch.chdir(tmp_path)
    # A coarse grid of devices prints what a fine one does.
    _, *words = shlex.split(line.replace("--step 20", "--step 45") if line.startswith("exo-pin compare") else line)
    for option in ("--out", "--plot"):
        if option in words:
            del words[words.index(option) : words.index(option) + 2]
    words = [word for word in words if word != "--json"]
    _, text, _ = run(capsys, *words)
    # The text counts the wearer's muscles where their model is installed; JSON where they are asked for.
    muscles = ["--muscles"] if words[0] == "reaction" and "--person" in words and "--trajectory" not in words else []
    _, data, _ = run(capsys, *words, "--json", *muscles)
    assert missing(answered(text), json.loads(data), " ".join(words)) == []


def test_a_number_that_no_answer_has_is_found():
    answer = {"force": [3.0, 4.0], "share": 0.125}
    assert missing("5.0 N, 12.5 %, 3 N along (0.60, 0.80)", answer, "") == []
    assert missing("5.13 N, 12.7 %", answer, "") == ["5.13", "12.7"]
