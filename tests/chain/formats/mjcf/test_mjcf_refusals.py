"""What of MJCF is refused, and that nothing of MuJoCo's model is forgotten."""

import fnmatch

import mujoco
import pytest
from mjcf_arm import arm, fixed_tendon, flag, motor
from mujoco_fields import IRRELEVANT, REFUSED

from exo_pin.chain import ClosedChain
from exo_pin.chain.formats.mjcf.mjcf_refusals import READ
from exo_pin.core.errors import FileFormatError, InvalidInput


def fields():
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    names = [name for name in dir(model) if not name.startswith("_") and not callable(getattr(model, name))]
    return [name for name in names if name != "opt"] + [f"opt.{x}" for x in dir(model.opt) if not x.startswith("_")]


def test_every_field_of_mujocos_model_is_read_irrelevant_or_refused():
    there = fields()
    assert len(there) > 500
    assert set(READ) <= set(there)
    for name in there:
        groups = [any(fnmatch.fnmatchcase(name, item) for item in group) for group in (READ, REFUSED, IRRELEVANT)]
        assert any(groups), f"{name} is in no group"
        assert not (groups[0] and groups[1]), f"{name} is read and refused"
    for item in (*REFUSED, *IRRELEVANT):
        # Plastic springs came with MuJoCo 4.
        known = item in ("buffer", "jnt_springyield", "jnt_plasticadr") or fnmatch.filter(there, item)
        assert known, f"{item} is no field"


REFUSALS = [
    ({"option": '<option density="1.2"/>'}, "density = 1.2"),
    ({"option": '<option density="nan"/>'}, "opt.density number 0 is not finite"),
    (
        {"world": '<flexcomp name="x" type="grid" count="3 3 1" spacing="1 1 1" mass="1" dim="2"/>'},
        "1 flexes",
    ),
    (
        {
            "more": '<extension><plugin plugin="mujoco.pid"><instance name="p"/></plugin></extension>'
            '<actuator><plugin joint="ja" plugin="mujoco.pid" instance="p"/></actuator>'
        },
        "it has 1 plugins",
    ),
    ({"option": '<option viscosity="0.1" wind="1 0 0"/>'}, "viscosity = 0.1"),
    ({"option": '<option gravity="nan 0 0"/>'}, "gravity number 0 is not finite"),
    ({"jb": 'ref="1e200"'}, "qpos0 has 1e.200"),
    ({"world": '<site name="far" pos="0 -1e11 0"/>'}, "site_pos has 1e.11"),
    ({"option": '<option gravity="1e200 0 0"/>'}, "gravity"),
    (
        {"jb": 'actuatorfrcrange="1 2"'},
        "joint 'jb' exert a force without control, .* is 1 to 2",
    ),
    ({"jb": 'ref="nan"'}, "qpos0 number 1 is not finite"),
    ({"ina": '<inertial pos="0 inf 0" mass="1" diaginertia="1 1 1"/>'}, "not finite"),
    ({"world": '<body name="hand" mocap="true"/>'}, "mocap bodies .* 'hand'"),
    ({"world": '<body name="light" gravcomp="0.5"><joint/><geom size="0.1"/></body>'}, "'light' has gravcomp = 0.5"),
    ({"ja": 'stiffness="3 1"'}, "spring of joint 'ja' is not linear"),
    *(
        [({"ja": 'stiffness="3" springyield="1"'}, "spring of joint 'ja' is not linear")]
        if hasattr(mujoco.MjModel, "jnt_springyield")
        else []
    ),
    ({"jb": 'damping="1 0.5"'}, "damping of joint 'jb' is not linear"),
    ({"jb": 'armature="-1"'}, "armature of zero or more for joint 'jb', got -1"),
    ({"ja": 'frictionloss="-2"'}, "frictionloss of zero or more for joint 'ja', got -2"),
    ({"jc": 'range="0 1"'}, "'jc' is a ball"),
    ({"ja": 'range="0 1" margin="0.1"'}, "limits of joint 'ja' have a margin, 0.1"),
    *(
        (
            {"world": f'<body><joint name="f" type="free" {key}="1"/><geom size="0.1"/></body>'},
            f"{key} of free joint 'f'",
        )
        for key in ("armature", "frictionloss")
    ),
    (
        {"more": fixed_tendon() + '<equality><tendon tendon1="t"/></equality>'},
        "number 0 .unnamed. is a tendon coupling",
    ),
    (
        {"more": '<equality><weld name="w" body1="a" body2="c"/></equality>', "option": flag("equality")},
        "flag equality",
    ),
    ({"more": '<equality><weld name="w" body1="a"/></equality>', "option": flag("constraint")}, "flag constraint"),
    (
        {
            "inb": '<body name="fixed" pos="0 0 1"/>',
            "more": '<equality><weld name="w" body1="b" body2="fixed"/></equality>',
        },
        "'w' joins 'b' and 'fixed', which are one rigid body",
    ),
    *(
        (
            {"more": f'<tendon><fixed name="t" {given}><joint joint="ja" coef="1"/></fixed></tendon>'},
            f"tendon 't' has {key}",
        )
        for key, given in {
            "stiffness": 'stiffness="2"',
            "damping": 'damping="2"',
            "frictionloss": 'frictionloss="2"',
            "armature": 'armature="2"',
            "limited": 'range="0 1" limited="true"',
        }.items()
    ),
    ({"more": '<actuator><motor site="s"/></actuator>'}, "does not act on a joint"),
    ({"more": '<actuator><adhesion body="a" ctrlrange="0 1"/></actuator>'}, "does not act on a joint"),
    ({"more": motor("", "jc")}, "'m' acts along one direction of joint 'jc'"),
    ({"more": motor('gear="0"')}, "gear of 0"),
    ({"more": motor(""), "option": flag("actuation")}, "flag actuation"),
    ({"more": motor('group="2"'), "option": '<option actuatorgroupdisable="2"/>'}, "group 2, which is disabled"),
    ({"more": '<actuator><position name="p" joint="ja" kp="2"/></actuator>'}, "'p' exerts a force without control"),
    (
        {"more": '<actuator><muscle name="p" joint="ja" ctrllimited="false" lengthrange="0 1"/></actuator>'},
        "type muscle",
    ),
    ({"more": motor('forcerange="1 2"')}, "its forcerange is 1 to 2"),
    ({"more": motor('ctrlrange="-2 -1"')}, "its ctrlrange is -2 to -1"),
    ({"more": motor('damping="1 2"')}, "damping of actuator 'm' is not linear"),
]


@pytest.mark.parametrize(("parts", "said"), REFUSALS, ids=[said[:40] for _, said in REFUSALS])
def test_what_a_chain_cannot_hold_is_refused_by_name(parts, said, tmp_path):
    path = tmp_path / "arm.xml"
    path.write_text(arm(**parts))
    with pytest.raises(FileFormatError, match=said) as caught:
        ClosedChain.from_mjcf(path)
    assert "arm.xml" in str(caught.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, "no such file"),
        ("", "not an MJCF: its XML is not well-formed"),
        ("hinge", "not an MJCF: its XML is not well-formed"),
        ("<mujoco>", "not an MJCF: its XML is not well-formed"),
        ("<sdf/>", "MuJoCo cannot read it"),
        ("<?xml version='1.0'?><!-- a --><robot name='r'><link name='l'/></robot>", "from_urdf"),
    ],
)
def test_text_that_is_not_mjcf_is_refused(text, said, tmp_path):
    path = tmp_path / "some.xml"
    if text is not None:
        path.write_text(text)
    with pytest.raises(FileFormatError, match=said):
        ClosedChain.from_mjcf(path)
    with pytest.raises(FileFormatError, match="no such file"):
        ClosedChain.from_mjcf(tmp_path)
    with pytest.raises(FileFormatError, match="no such file"):
        ClosedChain.from_mjcf("x" * 5000)
    with pytest.raises(InvalidInput, match="got 5"):
        ClosedChain.from_mjcf(5)
