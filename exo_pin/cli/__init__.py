"""The command ``exo-pin``: parse, call, print. A command is a function with types and a docstring, which make its help.

This file names the commands, in groups, and has what needs neither physics nor parser, so that ``exo-pin --help`` and
``--version`` come at once. A command's module is imported when it is called.
"""

from __future__ import annotations

import codecs
import contextlib
import io
import os
import re
import shutil
import signal
import sys
import textwrap
import unicodedata
import warnings
from collections.abc import Sequence
from importlib import import_module
from typing import Any, NamedTuple

from .. import __version__

#: Control characters but for tab and the ends of lines: a name in a file may hold them.
_CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069]")
#: Signs of this package's texts whose parts are no ASCII.
_ASCII = (
    {"°": " deg", "±": "+-", "×": "x", "·": "*", "→": "->", "≤": "<=", "≥": ">=", "−": "-", "–": "-", "—": "-"}
    | {"∞": "inf", "≈": "~", "√": "sqrt", "∂": "d", "Δ": "Delta", "θ": "theta", "φ": "phi", "Φ": "Phi", "α": "alpha"}
    | {"β": "beta", "λ": "lambda", "τ": "tau", "ω": "omega", "σ": "sigma", "µ": "u", "μ": "u", "⊥": "perpendicular"}
)
_HANDLER = "exo_pin.plain_signs"
#: A shell adds this to the number of the signal that has ended a program.
_SIGNALLED = 128
_HELP = {"-h", "--help"}
_QUESTION = "What force does a parallel shoulder exoskeleton put on the shoulder joint?"
_BEGIN = """\
Begin with: exo-pin reaction four-cables --flexion 60
Each command has examples: exo-pin COMMAND --help"""
#: What ``exo-pin`` alone prints.
_START = f"""\
{_QUESTION}

  exo-pin reaction four-cables --flexion 60       the forces of a device in a pose
  exo-pin person four-cables --flexion 60         the force in the joint with the wearer's own muscles
  exo-pin view four-cables --flexion 60 --open    the same as a picture
  exo-pin presets                                 designs to try; a file of your own stands in the same place
  exo-pin --help                                  all commands"""
#: Most columns of a help text.
_WIDEST = 120


class Command(NamedTuple):
    """A command: the module of :mod:`exo_pin.cli` that has its function, and its line in the list of commands."""

    module: str
    help: str

    def load(self, name: str) -> Any:
        """The function of the command."""
        module = import_module(f".{self.module}", __name__)
        return getattr(module, name.replace(" ", "_").replace("-", "_"))


#: The commands by group, in the order of the help.
GROUPS = {
    "Ask what a device does": {
        "reaction": Command("reaction_command", "forces on shoulder, limbs, cuff and torso in a pose or movement"),
        "person": Command("person_command", "force in the shoulder joint with the wearer's own muscles"),
        "kinematics": Command(
            "kinematics_commands", "lengths and joint angles in a pose, or poses that fit measured ones"
        ),
        "singularity": Command(
            "kinematics_commands", "distance of a pose from singular ones, and the poses beyond them"
        ),
        "view": Command("view_command", "the design on a person, with its forces, in three dimensions"),
        "app": Command("pages.app_command", "all of this on one page in the browser, which answers while one drags"),
    },
    "Judge a design": {
        "workspace": Command("search_commands", "which poses a design reaches, holds and keeps safe"),
        "tasks": Command("recordings.tasks_command", "share of daily tasks that a design reaches"),
        "parts": Command("designs.parts_command", "drives, frame and cuff for a workshop: strokes, forces, masses"),
        "compare": Command("design_commands", "designs of any kind over the same poses, ranked by what they hold"),
        "report": Command("pages.report_command", "two pages on a design and a person: forces, drives, fit, hazards"),
        "batch": Command("documents.batch_command", "questions in JSON lines, an answer a line"),
        "serve": Command("pages.serve_command", "the same questions over HTTP, for programs in any language"),
        "uncertainty": Command("reaction_command", "how tolerances, fit, pose and masses change the shoulder force"),
    },
    "Design": {
        "presets": Command("design_commands", "designs that come with the package, and their files"),
        "sweep": Command("design_commands", "vary parameters of a design, and rank the results"),
        "optimise": Command("search_commands", "search for a design that reaches and holds as many poses as it can"),
        "calibrate": Command("design_commands", "joint centres and offsets from measured poses and limb lengths"),
        "export": Command("design_commands", "write a design as URDF with its closures file, as MJCF or as SDF"),
    },
    "Any robot with closed loops": {
        "check": Command("design_commands", "kinematic consistency of a design or a robot"),
        "mobility": Command("robot_commands", "freedoms, redundant closures and singular kinds"),
        "forces": Command("robot_commands", "efforts and joint reactions at rest, and which are determined"),
    },
    "Thesis and motion": {
        "track": Command("motion_commands", "the built machine in motion: experiments of the thesis, or your movement"),
        "record": Command("recordings.record_command", "what a recording holds, checked against an arm, and converted"),
        "muscle force": Command("muscle_commands", "force of a pneumatic muscle at a contraction and a pressure"),
        "muscle pressure": Command("muscle_commands", "pressure that makes a muscle pull a force at a contraction"),
        "muscle identify": Command("muscle_commands", "parameters of a muscle from measurements"),
        "muscle step": Command("muscle_commands", "response of a hung mass to a step of pressure"),
        "muscle loop": Command("muscle_commands", "step of one muscle under its PI controller"),
        "thesis": Command("motion_commands", "numbers of the thesis beside computed ones"),
        "schema": Command("documents.schema_command", "what the documents of --json hold, as JSON schemas"),
        "warm-up": Command("motion_commands", "compile the kernels ahead of time (once, some minutes)"),
    },
}
COMMANDS = {name: command for group in GROUPS.values() for name, command in group.items()}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Without the program's name; those of the process if left out.

    Returns
    -------
    int
        Exit status: 0; 1 for a design that a check finds inconsistent, and for an export of which something is in no
        file; 2 for wrong input and for what cannot be read or written; 130 after Ctrl-C; 141 if the reader of the
        answer has ended (``exo-pin ... | head -1``). The last two are what a shell reports of programs that these
        signals end.
    """
    if arguments is None:
        warnings.showwarning = _show_warning
        make_output_printable()
    try:
        try:
            return _run(sys.argv[1:] if arguments is None else list(arguments))
        finally:
            # Here, because an error at the end of the program could not be reported any more.
            if sys.stdout is not None:
                sys.stdout.flush()
    except KeyboardInterrupt:
        return _SIGNALLED + signal.SIGINT
    except BrokenPipeError:
        _drop_output()
        return _SIGNALLED + signal.SIGPIPE
    except Exception as error:
        from ..core.errors import ExoPinError  # here, because --help needs no NumPy

        if not isinstance(error, (ExoPinError, OSError)):
            raise
        _drop_output()
        with contextlib.suppress(OSError):
            for text in (str(error), *getattr(error, "__notes__", ())):
                print(f"exo-pin: {' '.join(text.split())}", file=sys.stderr)
        return 2


def _run(given: list[str]) -> int:
    """Answer a command, or a question about the commands, and return the exit status."""
    if given[:1] == ["help"]:
        given = [*given[1:], "--help"]
    if given == ["--version"]:
        print(__version__)
    elif not given:
        print(_START)
    elif given[0] in _HELP:
        print(overview())
    elif (family := _family(given[0])) and set(given[1:2]) <= _HELP:
        print("\n".join(_lines(family)))
    else:
        count = 2 if family else 1
        return int(import_module(".command", __name__).answer(" ".join(given[:count]), given[count:]))
    return 0


def _family(word: str) -> dict[str, Command]:
    """The commands of two words that begin with one."""
    return {name: command for name, command in COMMANDS.items() if name.startswith(f"{word} ")}


def width() -> int:
    """Columns of a text for people: those of the terminal."""
    return min(shutil.get_terminal_size().columns, _WIDEST)


def overview() -> str:
    """The help of ``exo-pin``: the commands by group."""
    parts = ["usage: exo-pin COMMAND [DESIGN] [options]", textwrap.fill(_QUESTION, width())]
    parts += ["\n".join([f"{title}:", *_lines(commands)]) for title, commands in GROUPS.items()]
    return "\n\n".join([*parts, _BEGIN])


def _lines(commands: dict[str, Command]) -> list[str]:
    wide = max(map(len, COMMANDS)) + 4
    indent = " " * wide
    return [
        textwrap.fill(f"  {name:{wide - 2}}{one.help}", width(), subsequent_indent=indent)
        for name, one in commands.items()
    ]


def _show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    """Print a warning as one line, without the place in the code where it was raised."""
    with contextlib.suppress(OSError):
        print(f"exo-pin: {' '.join(str(message).split())}", file=sys.stderr)


def _drop_output() -> None:
    """Give up what has not been printed if it cannot be: Python would try again, and fail, at its end."""
    try:
        if sys.stdout is not None:
            sys.stdout.flush()
    except OSError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)


class _Printable(io.TextIOWrapper):
    def write(self, text: str) -> int:
        return super().write(_CONTROL.sub(lambda sign: repr(sign[0])[1:-1], text))


def make_output_printable() -> None:
    """Replace standard output by one that shows control characters as escapes and other signs as the terminal can."""
    out = sys.stdout
    if not isinstance(out, io.TextIOWrapper):
        return
    codecs.register_error(_HANDLER, _plain_signs)
    with contextlib.suppress(OSError):
        out.flush()
    sys.stdout = _Printable(out.buffer, out.encoding, _HANDLER, line_buffering=out.line_buffering)


def _plain_signs(error: UnicodeError) -> tuple[str, int]:
    """The handler of signs that an encoding lacks: in ASCII words, or as escapes."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(map(_plain_sign, error.object[error.start : error.end])), error.end


def _plain_sign(sign: str) -> str:
    if sign in _ASCII:
        return _ASCII[sign]
    parts = unicodedata.normalize("NFKD", sign).encode("ascii", "ignore").decode()
    return parts or sign.encode("ascii", "backslashreplace").decode()
