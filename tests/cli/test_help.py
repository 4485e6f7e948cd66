"""The help texts: every command says what it answers, every option what it takes, and the examples are commands."""

import argparse
import shlex

import pytest
from command_line import run

from exo_pin.cli import _AS_THEY_ARE, _KINDS, COMMANDS, _parser, _subcommands, _table

#: What stands in the help, the metavar or the name of an option that takes numbers.
UNITS = (
    " N", "mm", "(m,", " m,", "kg", "degrees", "bar", " s ", " s,", "share", "pixels", "number", "rad", "dimensionless",
    "PERCENT", "percent", "NM", "det X", "port", "designs", "stature in m", "N/m", "seed", "0 to 1", "random",
)  # fmt: skip


def options_of(parser, path=()):
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for name, inner in action.choices.items():
                yield from options_of(inner, (*path, name))
        elif action.dest != "help":
            yield " ".join(path), action


def parser_of(name):
    return next(
        action for action in _parser([name])._actions if isinstance(action, argparse._SubParsersAction)
    ).choices[name]


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_and_option_is_described(name):
    parser = parser_of(name)
    assert parser.description.endswith(".")
    assert "examples:" in parser.epilog
    for command, action in options_of(parser):
        where = f"{name} {command} {action.option_strings or action.dest}"
        assert action.help, where
        text = f"{action.help} {action.metavar or ''} {action.dest}"
        if action.type in (float, int):
            assert any(unit in text for unit in UNITS), where
        takes_a_value = action.nargs != 0 and not isinstance(action, argparse._StoreConstAction)
        if takes_a_value and action.default not in (None, [], argparse.SUPPRESS):
            assert "default" in action.help, where


def test_every_word_of_the_table_of_options_is_read():
    of_a_command = {
        "help", "shared", "out", "plot", "pages", "pictures", "needs", "moved", "one_of", "options",
    }  # fmt: skip
    of_an_option = {*_KINDS, *_AS_THEY_ARE, "help", "names", "repeated", "yes_or_no"}
    table = dict(_table())
    groups = table.pop("shared")
    for name, command in table.items():
        assert set(command) <= of_a_command, name
        assert set(command.get("shared", ())) <= set(groups), name
        assert set(command.get("one_of", ())) <= set(command.get("options", ())), name
        assert name in COMMANDS or any(name in _subcommands(each) for each in COMMANDS), name
    options = [*groups.values(), *(command.get("options", {}) for command in table.values())]
    assert all(set(entry) <= of_an_option for group in options for entry in group.values())
    used = {group for command in table.values() for group in command.get("shared", ())}
    assert used == set(groups)


@pytest.mark.parametrize("line", [line for command in COMMANDS.values() for line in command.examples])
def test_examples_are_commands(line):
    program, *words = shlex.split(line)
    assert program == "exo-pin"
    assert callable(_parser(words).parse_args(words).run)


def test_help_is_given_wherever_it_is_asked_for(capsys):
    with pytest.raises(SystemExit) as ended:
        run(capsys, "reaction", "prototype", "--trajectory", "--help")
    assert ended.value.code == 0
    text = capsys.readouterr().out
    for column in ("time_s", "flexion_deg, abduction_deg, internal_rotation_deg", "theta_x_deg", "qx, qy, qz, qw"):
        assert column in text
