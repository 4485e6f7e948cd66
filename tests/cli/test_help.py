"""The help texts: every command says what it answers, every option what it takes, and the examples are commands."""

import shlex

import pytest
from command_line import called, options_of, run, shown

from exo_pin.cli import COMMANDS, GROUPS
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


def test_commands_stand_in_five_groups_and_exo_pin_alone_shows_where_to_begin(capsys):
    assert len(GROUPS) == 5
    status, out, _ = run(capsys, "--help")
    assert status == 0
    assert all(f"\n{title}:" in out for title in GROUPS)
    assert all(f"\n  {name} " in out for name in COMMANDS)
    for arguments in ((), ("muscle",)):
        status, out, _ = run(capsys, *arguments)
        assert status == 0
        assert "muscle force" in out or "exo-pin reaction" in out


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


def test_help_is_given_wherever_it_is_asked_for(capsys):
    texts = []
    for arguments in (("reaction", "prototype", "--trajectory", "--help"), ("help", "reaction"), ("reaction", "-h")):
        status, out, _ = run(capsys, *arguments)
        assert status == 0
        texts.append(out)
    assert texts[0] == texts[1] == texts[2]
    for column in ("time_s", "flexion_deg, abduction_deg, internal_rotation_deg", "theta_x_deg", "qx, qy, qz, qw"):
        assert column in texts[0]


@pytest.mark.parametrize(
    ("arguments", "meant"),
    [
        (("reacton",), "did you mean 'reaction'"),
        (("muscle", "forc"), "did you mean 'muscle force'"),
        (("reaction", "--flexon", "60"), "Did you mean --flexion?"),
        (("reaction", "--split", "minmal"), "did you mean 'minimal'?"),
        (("reaction", "--person", "75,1.75,m"), "did you mean 1.75,75,male?"),
        (("reaction", "--person", "1.75,female,60"), "did you mean 1.75,60,female?"),
        (("workspace", "--fits", "75,1.75,male"), "did you mean 1.75,75,male?"),
    ],
)
def test_the_nearest_word_is_named(capsys, arguments, meant):
    status, out, err = run(capsys, *arguments)
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
    assert meant in err
