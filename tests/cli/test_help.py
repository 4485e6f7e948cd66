"""The help texts: every command says what it answers, every option what it takes, and the examples are commands."""

import shlex

import pytest
from command_line import called, options_of, run, shown

from exo_pin.cli import COMMANDS
from exo_pin.cli.command import command, examples, help_text

#: What stands in the help or the metavar of an option that takes numbers.
UNITS = (
    " N", "mm", "(m,", " m,", "kg", "degrees", "bar", " s", "share", "pixels", "number", "rad", "dimensionless",
    "PERCENT", "percent", "NM", "det X", "port", "designs", "stature in m", "N/m", "seed", "Seed", "0 to 1", "random",
    "bytes", "MB",
)  # fmt: skip


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_and_option_is_described(name):
    assert examples(name)
    assert "usage: exo-pin COMMAND" not in help_text(name)
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


@pytest.mark.parametrize("line", shown())
def test_examples_are_commands(line):
    if "--help" not in line:
        words = shlex.split(line)[1 + len(called(line).split()) :]
        command(called(line)).parse_args(words, exit_on_error=False, print_error=False)
