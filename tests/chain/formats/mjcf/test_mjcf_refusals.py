"""What of MJCF is refused or left out, and that nothing of MuJoCo's model is forgotten."""

import fnmatch

import mujoco
import numpy as np
import pytest
from joint_arrays import ARRAYS
from mjcf_arm import arm, fixed_tendon, flag, motor, read
from mujoco_fields import IRRELEVANT, REFUSED

from exo_pin import FileFormatError, InvalidInput, UnknownName
from exo_pin.chain import ClosedChain
from exo_pin.chain.formats.leaving_out import LEAVE_OUT
from exo_pin.chain.formats.mjcf.mjcf_settling import READ


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
    for item in (*REFUSED, *IRRELEVANT):
        # Plastic springs came with MuJoCo 4.
        known = item in ("buffer", "jnt_springyield", "jnt_plasticadr") or fnmatch.filter(there, item)
        assert known, f"{item} is no field"


REFUSALS = [
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
    ({"option": '<option gravity="nan 0 0"/>'}, "gravity number 0 is not finite"),
    ({"jb": 'ref="1e200"'}, "qpos0 has 1e.200"),
    ({"world": '<site name="far" pos="0 -1e11 0"/>'}, "site_pos has 1e.11"),
    ({"option": '<option gravity="1e200 0 0"/>'}, "gravity"),
    ({"jb": 'ref="nan"'}, "qpos0 number 1 is not finite"),
    ({"ina": '<inertial pos="0 inf 0" mass="1" diaginertia="1 1 1"/>'}, "not finite"),
    ({"jb": 'armature="-1"'}, "armature of zero or more for joint 'jb', got -1"),
    ({"ja": 'frictionloss="-2"'}, "frictionloss of zero or more for joint 'ja', got -2"),
    ({"ja": 'range="0 1" margin="0.6"'}, "margin of the limits of joint 'ja' leaves it no range"),
]


@pytest.mark.parametrize(("parts", "said"), REFUSALS, ids=[said[:40] for _, said in REFUSALS])
def test_what_a_chain_cannot_hold_is_refused_by_name(parts, said, tmp_path):
    path = tmp_path / "arm.xml"
    path.write_text(arm(**parts))
    with pytest.raises(FileFormatError, match=said) as caught:
        ClosedChain.from_mjcf(path, leave_out=LEAVE_OUT)
    assert "arm.xml" in str(caught.value)


#: What changes the motion: under its name, what is said, and the robot without it.
NAMED = [
    ("fluid", {"option": '<option density="1.2"/>'}, "density = 1.2", {}),
    ("fluid", {"option": '<option viscosity="0.1" wind="1 0 0"/>'}, "viscosity = 0.1", {}),
    (
        "gravcomp",
        {"world": '<body name="light" gravcomp="0.5"><joint/><geom size="0.1"/></body>'},
        "'light' has gravcomp = 0.5",
        {"world": '<body name="light"><joint/><geom size="0.1"/></body>'},
    ),
    ("idle_forces", {"jb": 'actuatorfrcrange="1 2"'}, "joint 'jb' exert a force without control, .* is 1 to 2", {}),
    ("idle_forces", {"more": motor('forcerange="1 2"')}, "its forcerange is 1 to 2", {"more": motor("")}),
    ("idle_forces", {"more": motor('ctrlrange="-2 -1"')}, "its ctrlrange is -2 to -1", {"more": motor("")}),
    ("nonlinear_springs", {"ja": 'stiffness="3 1"'}, "spring of joint 'ja' is not linear", {"ja": 'stiffness="3"'}),
    *(
        [
            (
                "nonlinear_springs",
                {"ja": 'stiffness="3" springyield="1"'},
                "spring of joint 'ja' is not linear",
                {"ja": 'stiffness="3"'},
            )
        ]
        if hasattr(mujoco.MjModel, "jnt_springyield")
        else []
    ),
    ("nonlinear_springs", {"jb": 'damping="1 0.5"'}, "damping of joint 'jb' is not linear", {"jb": 'damping="1"'}),
    (
        "nonlinear_springs",
        {"more": motor('damping="1 2"')},
        "damping of actuator 'm' is not linear",
        {"more": motor('damping="1"')},
    ),
    ("ball_limits", {"jc": 'range="0 1"'}, "'jc' is a ball", {}),
    *(
        (
            "free_joint_rotors",
            {"world": f'<body><joint name="f" type="free" {key}="1"/><geom size="0.1"/></body>'},
            f"{key} of free joint 'f'",
            {"world": '<body><joint name="f" type="free"/><geom size="0.1"/></body>'},
        )
        for key in ("armature", "frictionloss")
    ),
    (
        "tendons",
        {"more": fixed_tendon() + '<equality><tendon tendon1="t"/></equality>'},
        "number 0 .unnamed. is a tendon coupling",
        {},
    ),
    *(
        (
            "tendons",
            {"more": f'<tendon><fixed name="t" {given}><joint joint="ja" coef="2"/></fixed></tendon>'},
            f"tendon 't' has {key}",
            {},
        )
        for key, given in {
            "stiffness": 'stiffness="2"',
            "damping": 'damping="2"',
            "frictionloss": 'frictionloss="2"',
            "armature": 'armature="2"',
            "limited": 'range="0 1" limited="true"',
            "stiffnesspoly": 'stiffness="0 1"',
            "dampingpoly": 'damping="0 1"',
        }.items()
    ),
    ("actuator_rotors", {"more": motor('armature="1"', "jc")}, "'m' acts on no hinge or slide", {}),
]


def _accelerations(chain):
    rng = np.random.default_rng(0)
    q = chain.neutral() if chain.model.nq > 7 else chain.close(chain.neutral())
    return chain.forward_dynamics(q, rng.normal(size=chain.model.nv), rng.normal(size=chain.model.nv)).a


@pytest.mark.parametrize(("name", "parts", "said", "without"), NAMED, ids=[said[:40] for _, _, said, _ in NAMED])
def test_what_changes_the_motion_is_left_out_by_name_alone(name, parts, said, without):
    with pytest.raises(FileFormatError, match=said) as caught:
        read(**parts)
    assert f'leave_out=["{name}"]' in str(caught.value)
    others = [other for other in LEAVE_OUT if other != name]
    with pytest.raises(FileFormatError, match=said):
        ClosedChain.from_mjcf(arm(**parts), others)
    chain, plain = ClosedChain.from_mjcf(arm(**parts), [name]), read(**without)
    report = [text for text in chain.description.left_out if text.startswith(f"{name}: ")]
    assert len(report) == 1
    assert not any(text.startswith(f"{name}: ") for text in plain.description.left_out)
    np.testing.assert_allclose(_accelerations(chain), _accelerations(plain), rtol=1e-12, atol=1e-12)
    assert chain.closures == plain.closures
    for array in ARRAYS:
        np.testing.assert_array_equal(getattr(chain.model, array), getattr(plain.model, array), array)


def test_every_name_of_what_can_be_left_out_of_mjcf_is_tried():
    assert {name for name, *_ in NAMED} <= set(LEAVE_OUT)
    with pytest.raises(UnknownName, match=r"unknown thing to leave out 'tendon' \(did you mean 'tendons'"):
        ClosedChain.from_mjcf(arm(), ["tendon"])
    with pytest.raises(InvalidInput, match="leave_out"):
        ClosedChain.from_mjcf(arm(), "tendons")


#: What is no part of a chain, or has no effect: it is said.
SAID = [
    ({}, "contact: 3 geoms collide"),
    ({"world": '<body name="hand" mocap="true"/>'}, "mocap: body 'hand', which is moved from outside, stands still"),
    (
        {"more": '<equality><weld name="w" body1="a" body2="c"/></equality>', "option": flag("equality")},
        "inactive: equality 'w'",
    ),
    ({"more": '<equality><weld name="w" body1="a"/></equality>', "option": flag("constraint")}, "inactive: equality"),
    (
        {
            "inb": '<body name="fixed" pos="0 0 1"/>',
            "more": '<equality><weld name="w" body1="b" body2="fixed"/></equality>',
        },
        "rigid: equality 'w' joins two frames of one rigid body",
    ),
    ({"more": '<actuator><motor site="s"/></actuator>'}, "actuators: actuator number 0 (unnamed) acts on a site"),
    ({"more": '<actuator><adhesion body="a" ctrlrange="0 1"/></actuator>'}, "acts on a body"),
    ({"more": fixed_tendon() + '<actuator><motor name="m" tendon="t"/></actuator>'}, "'m' acts on a tendon"),
    ({"more": motor("", "jc")}, "'m' acts along one direction of joint 'jc'"),
    ({"more": motor('gear="0"')}, "gear of 0"),
    ({"more": '<actuator><general name="m" joint="ja" gainprm="0"/></actuator>'}, "gain of 0"),
    ({"more": motor(""), "option": flag("actuation")}, "flag actuation"),
    ({"more": motor('group="2"'), "option": '<option actuatorgroupdisable="2"/>'}, "group 2, which is disabled"),
]


@pytest.mark.parametrize(("parts", "said"), SAID, ids=[said[:40] for _, said in SAID])
def test_what_has_no_effect_or_is_no_part_of_a_chain_is_said(parts, said):
    chain = read(**parts)
    assert any(said in text for text in chain.description.left_out), chain.description.left_out
    assert chain.roles.actuated == ()


SERVOS = [
    '<position name="p" joint="ja" kp="2" ctrlrange="1 2"/>',
    '<velocity name="p" joint="ja" kv="2"/>',
    '<general name="p" joint="ja" gaintype="affine" biastype="affine" biasprm="1 2 3"/>',
    '<muscle name="p" joint="ja" ctrllimited="false" lengthrange="0 1"/>',
]


@pytest.mark.parametrize("servo", SERVOS)
def test_a_joint_with_a_servo_is_actuated_and_its_law_left_out(servo):
    chain = read(more=f"<actuator>{servo}</actuator>")
    assert chain.roles.actuated == ("ja",)
    assert any("control_laws: actuator 'p'" in text for text in chain.description.left_out)
    assert np.isinf(chain.model.upperEffortLimit[0])
    np.testing.assert_array_equal(_accelerations(chain), _accelerations(read()))


def test_a_limit_with_a_margin_is_where_mujoco_holds_the_joint():
    """A pendulum falls against its limit and comes to rest there; MuJoCo's limit gives way by its softness alone."""
    text = """<mujoco><compiler angle="radian"/><option gravity="0 0 -9.81" timestep="0.001"/><worldbody><body>
    <joint name="j" axis="0 1 0" range="0.2 2" margin="0.3" damping="2" limited="true" ref="1"/>
    <geom size="0.05" pos="-0.4 0 0.4"/></body></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(text)
    model.jnt_solimp[0] = [0.999, 0.9999, 0.001, 0.5, 2.0]
    data = mujoco.MjData(model)
    for _ in range(10000):
        mujoco.mj_step(model, data)
    low, high = (
        ClosedChain.from_mjcf(text).model.lowerPositionLimit[0],
        ClosedChain.from_mjcf(text).model.upperPositionLimit[0],
    )
    assert (low, high) == pytest.approx((0.5, 1.7))
    assert data.qpos[0] == pytest.approx(low, abs=2e-3) or data.qpos[0] == pytest.approx(high, abs=2e-3)
    assert abs(data.qvel[0]) < 1e-6


def test_many_things_are_said_in_a_few_words():
    bodies = "".join(f'<body name="m{k}" mocap="true"/>' for k in range(9))
    (text,) = [x for x in read(world=bodies).description.left_out if x.startswith("mocap")]
    assert "; and 4 more (may change forces" in text


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
