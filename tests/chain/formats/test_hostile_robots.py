"""Files that are written to harm: each is one typed error with a short message, without the work that it asks for."""

import random

import numpy as np
import pytest
from mechanisms import five_bar

from exo_pin import ExoPinError, FileFormatError, UnknownName
from exo_pin.chain import ClosedChain, Closures
from exo_pin.chain.formats.mjcf.mjcf_compiling import outline
from exo_pin.chain.formats.parallel_robots import parse_yaml

YAML = """closed_loop: [["left_forearm", "right_forearm"]]
type: ["3d"]
name_mot: ["left_crank_hinge", "right_crank_hinge"]
"""


def laughs(depth, width):
    """A list of lists of lists, width ** depth texts long, in 30 characters a level."""
    levels = ["&a0 [x]", *(f"&a{k} [{','.join([f'*a{k - 1}'] * width)}]" for k in range(1, depth))]
    return f"name_mot: [{','.join(levels)}]\nclosed_loop: [*a{depth - 1}]\ntype: [6d]\n"


BOMBS = {
    "52 MB": (laughs(7, 10), "line 1: the alias \\*a0"),
    "memory": (laughs(9, 9), "line 1: the alias \\*a0"),
    "itself": ("closed_loop: &a [*a]", "the alias \\*a"),
    "as a key": ("&a x: 1\n*a : 2", "line 2: the alias"),
    "merge": ("a: &a {b: 1}\nc:\n  <<: *a", "line 3: the alias"),
    "a merge key": (YAML + "<<: {type: [6d]}", "unknown key '<<'"),
    "a date": ("closed_loop: 2001-13-45", "expected closed_loop to be a list, got '2001-13-45'"),
    "a date as motor": (YAML.replace('"left_crank_hinge"', "2001-01-01"), "no such|unknown joint '2001-01-01'"),
    "int": ('closed_loop: !!int "abc"', "the tag tag:yaml.org,2002:int"),
    "bool": ('closed_loop: !!bool "abc"', "the tag tag:yaml.org,2002:bool"),
    "timestamp": ("closed_loop: !!timestamp x", "the tag"),
    "set": ("closed_loop: !!set {a, b}", "the tag"),
    "omap": ("closed_loop: !!omap [a: 1]", "the tag"),
    "object": ("closed_loop: !!python/object/apply:os.system [ls]", "the tag"),
    "own tag": ("closed_loop: !x y", "the tag !x"),
    "long integer": ("closed_loop: " + "9" * 5000, "expected closed_loop to be a list"),
    "version": ("%YAML " + "9" * 5000 + ".1\n---\nx", "not YAML"),
    "no character": ('closed_loop: "\\UFFFFFFFF"', "not YAML"),
    "half a character": (YAML.replace("right_forearm", "\\uD800"), "ud800"),
    "deep": ("closed_loop: " + "[" * 100_000, "nested deeper than 32"),
    "deep mappings": ("{a: " * 100_000, "nested deeper than 32"),
    "deep blocks": ("- " * 100_000, "nested deeper than 32"),
    "deep keys": ("? " * 100_000, "nested deeper than 32"),
    "a mapping as key": ("? {a: b}\n: 1", "expected a text as a key"),
    "list as key": ("[a, b]: 1", "expected a text as a key"),
    "a long key": ("x" * 1_000_000 + ": 1", "not YAML|unknown key"),
    "twice": ("type: 1\n'type': 2", "line 2: 'type' is given twice"),
    "twice within": ("closed_loop: [{a: 1, a: 2}]", "'a' is given twice"),
    "many keys": ("".join(f"k{i}: \n" for i in range(4000)) + "k0: ", "line 4001: 'k0' is given twice"),
    "two documents": (YAML + "---\nx", "one YAML document"),
    "a terminal's escape": ("closed_loop: \x1b[2J", "not YAML"),
    "an escaped escape": ('"\\e[2J": 1', r"unknown key '\\x1b\[2J'"),
    "a text": ("x", "expected keys"),
    "nothing": ("", "expected keys"),
}


@pytest.mark.parametrize("kind", BOMBS)
def test_hostile_robot_yaml(kind, tmp_path):
    text, said = BOMBS[kind]
    (tmp_path / "robot.urdf").write_text(five_bar().urdf)
    (tmp_path / "robot.yaml").write_text(text)
    with pytest.raises((FileFormatError, UnknownName), match=said) as caught:
        ClosedChain.from_parallel_robot(tmp_path)
    message = str(caught.value)
    assert len(message) <= 2000
    assert "\x1b" not in message
    assert "robot.yaml" in message or "there are: " in message


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
    ],
)
def test_values_of_yaml(text, value):
    assert parse_yaml(text) == value


ENTITIES = (
    '<!DOCTYPE m [<!ENTITY a0 "lol">' + "".join(f'<!ENTITY a{k} "{f"&a{k - 1};" * 10}">' for k in range(1, 10)) + "]>"
)
READERS = {
    "URDF": lambda text: ClosedChain.from_urdf(text, Closures("x")),
    "SDF": ClosedChain.from_sdf,
    "MJCF": ClosedChain.from_mjcf,
}


@pytest.mark.parametrize("kind", READERS)
@pytest.mark.parametrize("head", [ENTITIES, '<!DOCTYPE m SYSTEM "file:///etc/passwd">', "<!DOCTYPE m>"])
def test_entities_are_not_expanded(kind, head, tmp_path):
    text = f'{head}<robot name="&a9;"><link name="a"/></robot>'
    (tmp_path / "robot").write_text(text)
    for source in (text, tmp_path / "robot"):
        with pytest.raises(FileFormatError, match="document type"):
            READERS[kind](source)


BODY = '<worldbody><body><joint/><geom size="1"/></body></worldbody>'
LARGE = {
    "replicate": "<worldbody>"
    + '<replicate count="100">' * 5
    + '<geom size="1"/>'
    + "</replicate>" * 5
    + "</worldbody>",
    "one replicate": '<worldbody><replicate count="1e9"><geom size="1"/></replicate></worldbody>',
    "negative": '<worldbody><replicate count="-1000000000"><geom size="1"/></replicate></worldbody>',
    "composite": '<worldbody><composite type="cable" curve="s" count="300000 1 1" size="1"/></worldbody>',
    "flexcomp": '<worldbody><flexcomp type="grid" name="f" count="900 900 900" spacing="1 1 1"/></worldbody>',
    "texture": f'<asset><texture name="t" type="2d" builtin="flat" width="60000" height="60000"/></asset>{BODY}',
    "height field": f'<asset><hfield name="h" nrow="60000" ncol="60000" size="1 1 1 1"/></asset>{BODY}',
    "user data": f'<size nuser_body="500000000"/>{BODY}',
}


@pytest.mark.parametrize("kind", LARGE)
def test_mjcf_that_asks_for_memory(kind, tmp_path):
    text = f"<mujoco>{LARGE[kind]}</mujoco>"
    (tmp_path / "large.xml").write_text(text)
    (tmp_path / "scene.xml").write_text('<mujoco><include file="large.xml"/></mujoco>')
    for source in (text, tmp_path / "large.xml", tmp_path / "scene.xml"):
        with pytest.raises(FileFormatError, match="bytes of elements"):
            ClosedChain.from_mjcf(source)


def test_what_robots_replicate_is_read():
    text = (
        '<mujoco><worldbody><body><joint type="slide"/><geom size="1"/><replicate count="3" offset="1 0 0">'
        '<body><joint/><geom size="0.1"/></body></replicate></body></worldbody></mujoco>'
    )
    assert ClosedChain.from_mjcf(text).model.nv == 4
    assert outline(text, None)[0] == "mujoco"


def test_control_characters_in_an_mjcf_do_not_reach_a_terminal(tmp_path):
    for name in ("\x1b[2J", "&#27;[2J", "\x9b2J"):
        with pytest.raises(FileFormatError) as caught:
            ClosedChain.from_mjcf(
                f'<mujoco><worldbody><body name="{name}"><freejoint/><joint/></body></worldbody></mujoco>'
            )
        assert str(caught.value).replace("\n", "").isprintable()
        assert caught.value.__cause__ is None


def test_texts_in_pieces_are_joined_once():
    # Every piece is an event: joined one by one they took the square of their number.
    text = five_bar().urdf.replace("</robot>", "x&#10;<!-- -->" * 100_000 + "</robot>")
    with pytest.raises(FileFormatError, match="expected no text in <robot>, got 'x"):
        READERS["URDF"](text)


def test_a_long_name_is_compared_with_no_other():
    # difflib's comparison takes the product of both lengths.
    rng = np.random.default_rng(0)
    one, other = ("".join(rng.choice(list("abcdefgh"), 200_000)) for _ in range(2))
    with pytest.raises(UnknownName, match="cut"):
        raise UnknownName("joint", one, [other])
