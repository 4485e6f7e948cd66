"""What commands print, write and end with, in a folder of their own beside the examples."""

import contextlib
import io
import json
import shlex
import tempfile
from pathlib import Path
from unittest import mock

from asked_in_turn import in_digits
from described_scenes import page_description
from places import REPOSITORY

from exo_pin.cli import main

POSE = "--flexion 50 --abduction 30 --internal-rotation -10"
MAN, WOMAN = "--person 1.82,83,male --elbow-flexion 35 --payload 1.2", "--person 1.6,55,female"
#: Half a second of a movement.
QUICK = "time_s,flexion_deg,abduction_deg,internal_rotation_deg\n" + "".join(
    f"{0.02 * k:.2f},{20.0 + 0.5 * k:.1f},{30.0 + 0.01 * k * k:.2f},{0.2 * k:.1f}\n" for k in range(26)
)

#: Of a document, and of the comments of a table, what says where it comes from.
_ABOUT = {"provenance", "notes", "sha256"}


def _write_words(figure, stream, **_):
    """A picture as its words and the numbers of its curves, not drawn."""
    words = [[axis.get_title(loc="left"), axis.get_title(), axis.get_xlabel(), axis.get_ylabel(),
              *(text.get_text() for text in axis.texts), len(axis.lines), len(axis.collections), len(axis.patches)]
             for axis in figure.axes]  # fmt: skip
    legends = (each.get_legend() for each in figure.axes)
    named = [text.get_text() for legend in (*figure.legends, *filter(None, legends)) for text in legend.get_texts()]
    stream.write(json.dumps([figure.get_suptitle(), words, named]).encode())


def _written(path):
    """Text of a file without its comments; of a document what is asked and answered; of others that they are there."""
    if path.suffix == ".png" and path.read_bytes()[:1] == b"[":
        return json.loads(path.read_text(encoding="utf-8"))
    if path.suffix not in {".csv", ".json", ".toml", ".sto", ".mot", ".urdf", ".html"}:
        return path.stat().st_size > 0
    if path.suffix == ".html":
        return page_description(path.read_text(encoding="utf-8")) or path.stat().st_size > 0
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".json":
        return _said(text)
    lines = in_digits(text).splitlines()
    return [line for line in lines if not line.lstrip("<!- ").startswith("#")][:40]


def _said(text):
    """Lines of a text, of each document in it what is answered."""
    if not text.startswith("{"):
        return in_digits(text).splitlines()
    try:
        documents = [json.loads(text)]
    except json.JSONDecodeError:
        documents = [json.loads(line) for line in text.splitlines()]
    return _without_source(documents)


def _without_source(value):
    if isinstance(value, list):
        return [_without_source(each) for each in value]
    if isinstance(value, dict):
        return {key: _without_source(each) for key, each in value.items() if key not in _ABOUT}
    return value


def answered(line):
    """Code, output and errors of a command, and what it writes."""
    out, err = io.StringIO(), io.StringIO()
    before = {path.name for path in Path().iterdir()}
    pictures = mock.patch("matplotlib.figure.Figure.savefig", _write_words)
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), pictures:
        code = main(shlex.split(line))
    files = sorted(path for path in Path().iterdir() if path.name not in before)
    # Whether anything is compiled for it depends on what was asked before.
    said = [line for line in err.getvalue().splitlines() if "compiling, once" not in line]
    found = {"code": code, "out": _said(out.getvalue()), "err": said}
    return found | {path.name: _written(path) for path in files}


def answered_in_turn(lines, **files):
    """The same of several commands one after the other, in a folder with the examples and with files of their own."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        for name in ("examples", "urdf"):
            Path(name).symlink_to(REPOSITORY / name)
        for name, text in files.items():
            Path(name.replace("_", ".")).write_text(text, encoding="utf-8")
        return {line: answered(line) for line in lines}
