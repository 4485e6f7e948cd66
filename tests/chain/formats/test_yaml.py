"""YAML as robot.yaml has it: texts, lists and mappings, and nothing else."""

import functools
import random

import pytest

from exo_pin import ExoPinError, FileFormatError
from exo_pin.chain.formats.parallel_robots import parse_yaml

TOKENS = [
    *"[]{},:-?&*!|>'\"%@`#~ \n\t\\aé",
    *("- ", "? ", ": ", "&a ", "*a", "!!int ", "!<x> ", "%YAML 1.1\n", "%TAG ! x\n", "---\n", "...\n", '"\\UFFFFFFFF"'),
    *('"\\uD800"', "<<: ", "2001-13-45", "0x1F", "9" * 5000, "null", "\x1b", "\x85", "\u2028", "\ufeff", "|2\n"),
    *("|99999\n", ">-\n", "b: c\n", "\U0001f600"),
]


@pytest.mark.parametrize("count", [500, pytest.param(40_000, marks=pytest.mark.long)])
def test_random_yaml_is_a_value_or_a_typed_error(count):
    rng, refused = random.Random(28), 0
    for _ in range(count):
        text = "".join(rng.choice(TOKENS) for _ in range(rng.randint(1, 40)))
        try:
            parse_yaml(text)
        except ExoPinError:
            refused += 1
    assert 0.5 * count < refused < count


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("a: [1, -2, +3, 010, 1_0, 1.5, yes, 0x10]", {"a": ["1", "-2", "+3", "010", "1_0", "1.5", "yes", "0x10"]}),
        ("a: '1'\nb: \"null\"\nc: null\nd: ~\ne:", {"a": "1", "b": "null", "c": None, "d": None, "e": None}),
        ("a: {b: [c, {d: e}]}\nf: &g h", {"a": {"b": ["c", {"d": "e"}]}, "f": "h"}),
        ("- a\n- - b\n  - c\n- |\n  d\n  e\n", ["a", ["b", "c"], "d\ne\n"]),
        ("1: 2", {"1": "2"}),
        ("", None),
        ("[" * 32 + "]" * 32, functools.reduce(lambda value, _: [value], range(31), [])),
    ],
)
def test_values_of_yaml(text, value):
    assert parse_yaml(text) == value


def test_nesting_ends_at_thirty_two_levels():
    with pytest.raises(FileFormatError, match="line 1: nested deeper than 32 levels"):
        parse_yaml("[" * 33 + "]" * 33)
