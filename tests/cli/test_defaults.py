"""What is taken where nothing is given: the defaults of all public functions, records and commands."""

import dataclasses
import inspect
import runpy

from answers import changes, each_of
from command_line import options_of
from places import REPOSITORY

from exo_pin.cli import COMMANDS

NAMES = runpy.run_path(str(REPOSITORY / "docs" / "scripts" / "public_names.py"))
PLAIN = (bool, int, float, str, type(None))


def worded(default):
    """A number or text as it is, and the fields of a record."""
    if isinstance(default, PLAIN):
        return default
    if isinstance(default, tuple | list):
        return [worded(each) for each in default]
    if dataclasses.is_dataclass(default) and not isinstance(default, type):
        return {each.name: worded(getattr(default, each.name)) for each in dataclasses.fields(default)}
    return type(default).__name__


def of_functions():
    """Defaults of each public function, class and method."""
    found = {}
    for path, thing in NAMES["callables"]().items():
        try:
            taken = inspect.signature(thing).parameters.values()
        except ValueError:  # an exception made in C
            continue
        own = {each.name: worded(each.default) for each in taken if each.default is not each.empty}
        if own:
            found[path] = own
    return found


def of_commands():
    """Defaults of each option of each command."""
    return {
        name: {option.names[0]: worded(option.field_info.default) for option in options_of(name)} for name in COMMANDS
    }


ASKED = {each.__name__: each for each in (of_functions, of_commands)}


@each_of(ASKED)
def test_defaults_are_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
