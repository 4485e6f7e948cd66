"""The help texts: every command and option says what it takes, and they fit the terminal."""

import pytest
from answers import changes, each_of
from command_line import options_of, run

from exo_pin.cli import COMMANDS
from exo_pin.cli.command import command, examples, notes

#: What stands in the help or the metavar of an option that takes numbers.
UNITS = (
    " N", "mm", "(m,", " m,", "kg", "degrees", "bar", " s", "share", "pixels", "number", "rad", "dimensionless",
    "PERCENT", "percent", "NM", "det X", "port", "designs", "stature in m", "N/m", "seed", "Seed", "0 to 1", "random",
    "bytes", "MB",
)  # fmt: skip


@pytest.mark.parametrize("name", COMMANDS)
def test_no_option_has_two_meanings(name):
    names = [each for option in options_of(name) for each in option.names]
    assert len(names) == len(set(names))


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_and_option_is_described(name, capsys):
    out = run(capsys, *name.split(), "--help")[1]
    assert "examples:" in out
    assert "usage: exo-pin COMMAND" not in out
    for option in options_of(name):
        where = f"{name} {option.names}"
        text = " ".join((option.parameter.help or "").split())
        assert text[:1].isupper(), where
        assert text.endswith((".", "...")), where
        if option.hint in (float, int):
            assert any(unit in f"{text} {option.parameter.metavar}" for unit in UNITS), where


@pytest.mark.parametrize("columns", [60, 100])
def test_help_fits_the_terminal(capsys, monkeypatch, columns):
    monkeypatch.setenv("COLUMNS", str(columns))
    for arguments in (["--help"], ["reaction", "--help"]):
        _, out, _ = run(capsys, *arguments)
        text = out.partition("examples:")[0] if arguments[0] == "reaction" else out
        assert max(map(len, text.splitlines())) <= columns


def helps():
    """What commands and options say of themselves, with the commands that do; how it is laid out is no part of it."""
    found = {}
    for name in COMMANDS:
        options = [option.parameter.help or "" for option in options_of(name)]
        for part in (*command(name).help.split("\n\n"), *options, *examples(name), *notes(name).splitlines()):
            found.setdefault(" ".join(part.split()), []).append(name)
    return {part: ", ".join(dict.fromkeys(names)) for part, names in found.items() if part}


ASKED = {"helps": helps}


@each_of(ASKED)
def test_a_help_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
