"""Files that are written to harm: each is one typed error with a short message, without the work that it asks for."""

import numpy as np
import pytest
from mechanisms import five_bar
from said_of_files import ROWS

from exo_pin import FileFormatError, UnknownName
from exo_pin.chain import ClosedChain, Closures

YAML = """closed_loop: [["left_forearm", "right_forearm"]]
type: ["3d"]
name_mot: ["left_crank_hinge", "right_crank_hinge"]
"""


BOMBS = ROWS["yaml_refused"] + [
    ["closed_loop: " + "9" * 5000, "expected closed_loop to be a list"],
    ["%YAML " + "9" * 5000 + ".1\n---\nx", "not YAML"],
    *(["closed_loop: " * (key == "[") + key * 100_000, "nested deeper than 32"] for key in ("[", "{a: ", "- ", "? ")),
    ["x" * 1_000_000 + ": 1", "not YAML|unknown key"],
    ["".join(f"k{i}: \n" for i in range(4000)) + "k0: ", "line 4001: 'k0' is given twice"],
]


@pytest.mark.parametrize(("text", "said"), BOMBS, ids=range(len(BOMBS)))
def test_hostile_robot_yaml(text, said, tmp_path):
    (tmp_path / "robot.urdf").write_text(five_bar().urdf)
    (tmp_path / "robot.yaml").write_text(text.replace("GOOD", YAML))
    with pytest.raises((FileFormatError, UnknownName), match=said) as caught:
        ClosedChain.from_parallel_robot(tmp_path)
    message = str(caught.value)
    assert len(message) <= 2000
    assert "\x1b" not in message
    assert "robot.yaml" in message or "there are: " in message


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
