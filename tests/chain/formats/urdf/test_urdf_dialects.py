"""Loops that other programs' elements state in a URDF, on a four-bar, against the same one with a closures file."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import FileFormatError, LoopNotClosed
from exo_pin.chain import ClosedChain, Closure, Closures, Placement
from exo_pin.cli import main

#: A kite whose loop is closed where its joints are zero; the coupler's end meets the rocker's.
P, Q, R = np.array([0.05, 0.0, 0.3]), np.array([0.5, 0.0, 0.35]), np.array([0.6, 0.0, 0.0])
AT_COUPLER, AT_ROCKER, OUT = Q - P, Q - R, np.array([0.0, 0.1, 0.0])


def text(values):
    return " ".join(map(repr, map(float, values)))


LINK = """<link name="{0}"><inertial><origin xyz="0 0 0.1"/><mass value="1"/>
<inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>"""
HINGE = """<joint name="{0}_hinge" type="revolute"><parent link="{1}"/><child link="{0}"/><origin xyz="{2}"/>
<axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="9" velocity="9"/></joint>"""
TREE = '<link name="base"/>' + "".join(LINK.format(name) for name in ("crank", "coupler", "rocker"))
TREE += HINGE.format("crank", "base", "0 0 0") + HINGE.format("coupler", "crank", text(P))
TREE += HINGE.format("rocker", "base", text(R))


def frame(name, link, xyz):
    joint = f'<joint name="{name}_frame" type="fixed"><parent link="{link}"/><child link="{name}"/>'
    return f'<link name="{name}"/>{joint}<origin xyz="{text(xyz)}" rpy="-1.5707963267948966 0 0"/></joint>'


def pair(*more):
    found = [frame("closing_pin_1", "coupler", AT_COUPLER), frame("closing_pin_2", "rocker", AT_ROCKER), *more]
    return "".join(found)


SDF = '<joint name="pin" type="{}"><parent>rocker</parent><child>coupler</child><pose>{} 0 0 0</pose>{}</joint>'
AXIS = "<axis><xyz>0 1 0</xyz>{}</axis>"
BALL = (
    '<drake:ball_constraint><drake:ball_constraint_body_A name="coupler"/><drake:ball_constraint_body_B name="rocker"/>'
)
BALL += '<drake:ball_constraint_p_AP value="{}"/><drake:ball_constraint_p_BQ value="{}"/></drake:ball_constraint>'
LOOP = '<loop_joint name="pin" type="{}"><link1 link="coupler" xyz="{}" rpy="0 0 0"/>'
LOOP += '<link2 link="rocker" xyz="{}"/></loop_joint>'
PLUGIN = (
    '<plugin filename="gz-sim-detachable-joint-system" name="gz::sim::systems::DetachableJoint"><parent_link>coupler'
)
PLUGIN += "</parent_link><child_model>{}</child_model><child_link>rocker</child_link></plugin>"
EQUALITY = "<mujoco><compiler/><equality>{}</equality></mujoco>"
BOTH = 'name="pin" body1="coupler" body2="rocker"'

#: Type of the closure, and what states it.
STATED = {
    "gazebo": ("revolute", f"<gazebo>{SDF.format('revolute', text(AT_COUPLER), AXIS.format(''))}</gazebo>"),
    "gazebo ball": ("spherical", f"<gazebo>{SDF.format('ball', text(AT_COUPLER), '')}</gazebo>"),
    "gazebo fixed": ("rigid", f"<gazebo>{SDF.format('fixed', text(AT_COUPLER), '')}</gazebo>"),
    "detachable": ("rigid", f"<gazebo>{PLUGIN.format('robot')}</gazebo>"),
    "drake": ("spherical", BALL.format(text(AT_COUPLER), text(AT_ROCKER))),
    "closing ball": ("spherical", pair()),
    "closing hinge": (
        "revolute",
        pair(
            frame("closing_pin_1_z", "coupler", AT_COUPLER + OUT), frame("closing_pin_2_z", "rocker", AT_ROCKER + OUT)
        ),
    ),
    "closing frames": (
        "spherical",
        f'<frame name="closing_pin_1" link="coupler" xyz="{text(AT_COUPLER)}"/>'
        f'<frame name="closing_pin_2" link="rocker" xyz="{text(AT_ROCKER)}" rpy="0 0 0"/>',
    ),
    "connect": ("spherical", EQUALITY.format(f'<connect {BOTH} anchor="{text(AT_COUPLER)}"/>')),
    "weld": ("rigid", EQUALITY.format(f"<weld {BOTH}/>")),
    "weld with a pose": ("rigid", EQUALITY.format(f'<weld {BOTH} relpose="{text(R - P)} 1 0 0 0"/>')),
    "weld of a point": ("spherical", EQUALITY.format(f'<weld {BOTH} torquescale="0" anchor="{text(AT_ROCKER)}"/>')),
    "isaac": ("spherical", LOOP.format("spherical", text(AT_COUPLER), text(AT_ROCKER))),
}


def robot(more):
    return f'<robot name="robot" xmlns:drake="d">{TREE}{more}</robot>'


def stated(kind):
    axis = (0.0, 1.0, 0.0) if kind == "revolute" else None
    at = [Placement(tuple(map(float, each))) for each in (AT_COUPLER, AT_ROCKER)]
    return Closures("robot", closures=(Closure("pin", kind, "coupler", "rocker", *at, axis=axis),))


@pytest.mark.parametrize("name", STATED)
def test_a_dialect_states_the_loop_that_a_closures_file_would(name):
    kind, more = STATED[name]
    chain, other = ClosedChain.from_urdf(robot(more)), ClosedChain.from_urdf(robot(""), stated(kind))
    assert [closure.type for closure in chain.closures] == [kind]
    assert not any(entry.startswith("closures: ") for entry in chain.description.left_out)
    np.testing.assert_allclose(chain.residual(chain.neutral()), 0.0, atol=1e-12)
    free = {"rigid": 0, "revolute": 1, "spherical": 1}[kind]
    assert chain.mobility(chain.neutral()).degrees_of_freedom == free
    assert other.mobility(other.neutral()).degrees_of_freedom == free
    if not free:
        return
    for crank in (-0.2, 0.15, 0.4):
        found = [each.close(each.neutral(), hold={"crank_hinge": crank}) for each in (chain, other)]
        np.testing.assert_allclose(*found, atol=1e-9)
        # In closed form: both points are one, in the plane of the loop.
        angles = [found[0][0], found[0][0] + found[0][1], found[0][2]]
        turns = Rotation.from_rotvec(np.outer(angles, [0.0, 1.0, 0.0]))
        ends = turns[0].apply(P) + turns[1].apply(AT_COUPLER), R + turns[2].apply(AT_ROCKER)
        np.testing.assert_allclose(*ends, atol=1e-9)


def test_a_closures_file_counts_more_than_a_dialect():
    for name, (kind, more) in STATED.items():
        chain = ClosedChain.from_urdf(robot(more), stated("revolute"))
        assert chain.closures == stated("revolute").closures, (name, kind)
        assert any(entry.startswith("restated: ") for entry in chain.description.left_out)


def test_a_loop_of_two_dialects_is_refused_by_name():
    with pytest.raises(
        FileFormatError, match=r"loop_joint 'pin': the loop between 'coupler' and 'rocker' is stated"
    ) as caught:
        ClosedChain.from_urdf(robot(STATED["gazebo"][1] + STATED["isaac"][1]))
    assert "gazebo: joint 'pin'" in str(caught.value)
    assert '[[closures]]\nname = "pin"' in str(caught.value)
    chain = ClosedChain.from_urdf(robot(STATED["gazebo"][1] + STATED["isaac"][1]), stated("spherical"))
    assert [closure.type for closure in chain.closures] == ["spherical"]


BUSHING = '<drake:linear_bushing_rpy><drake:bushing_frameA name="a"/></drake:linear_bushing_rpy>'
#: What no closure holds: its name in leave_out, and what the error says.
UNREADABLE = [
    ("loops", LOOP.format("revolute", "0 0 0", "0 0 0"), "balls alone, not revolute"),
    ("loops", LOOP.format("spherical", "0 0 0", "0 0 0").replace("coupler", "copler"), "no link 'copler'"),
    ("loops", f"<gazebo>{SDF.format('screw', '0 0 0', AXIS.format(''))}</gazebo>", "of this type are not read"),
    ("loops", f"<gazebo>{PLUGIN.format('other')}</gazebo>", "it holds model 'other'"),
    (
        "loops",
        f"<gazebo>{PLUGIN.format('robot').replace('<child_link>rocker</child_link>', '')}</gazebo>",
        "a link is missing",
    ),
    ("loops", frame("closing_pin_1", "coupler", AT_COUPLER), "no frame 'closing_pin_2'"),
    ("loops", pair(frame("closing_pin_1_z", "coupler", AT_COUPLER)), "do not both stand"),
    ("loops", EQUALITY.format('<tendon name="pin" tendon1="a"/>'), "connect and weld of bodies, and joint, are read"),
    ("loops", '<gazebo><link name="more"/></gazebo>', "a body that Gazebo adds"),
    ("bushings", BUSHING, "a spring between two frames"),
    (
        "loop_forces",
        "<gazebo>"
        + SDF.format("revolute", text(AT_COUPLER), AXIS.format("<dynamics><damping>2</damping></dynamics>"))
        + "</gazebo>",
        "no closure has springs, damping",
    ),
]


@pytest.mark.parametrize(("name", "more", "said"), UNREADABLE)
def test_what_no_closure_holds_is_refused_with_a_text_to_paste(name, more, said, tmp_path):
    with pytest.raises(FileFormatError, match=said) as caught:
        ClosedChain.from_urdf(robot(more))
    assert f'leave_out=["{name}"]' in str(caught.value)
    chain = ClosedChain.from_urdf(robot(more), leave_out=[name])
    (entry,) = (each for each in chain.description.left_out if each.startswith(f"{name}: "))
    assert said in entry
    assert ("changes the mechanism" if name == "loops" else "may change forces") in entry
    assert len(chain.closures) == (name == "loop_forces")
    if name == "bushings" or "adds" in said:
        return
    # The text is one that the closures file reads.
    pasted = str(caught.value).partition("[[closures]]")[2]
    assert pasted
    pasted = pasted.replace('"?"', '"rocker"', 1).replace('"?"', '"coupler"')
    (tmp_path / "robot.urdf").write_text(robot(more))
    (tmp_path / "robot.closures.toml").write_text(f'schema = 1\nname = "robot"\n[[closures]]{pasted}\n')
    (closure,) = ClosedChain.from_urdf(tmp_path / "robot.urdf").closures
    assert closure.type in ("spherical", "revolute")


#: What is left out, of each class.
CLASSES = [
    ("programs", "no effect", '<gazebo reference="crank"><material>Red</material></gazebo><transmission/>'),
    ("unread", "may change forces", '<gazebo><plugin name="push" filename="push.so"/></gazebo>'),
    ("loops", "changes the mechanism", LOOP.format("revolute", "0 0 0", "0 0 0")),
]


@pytest.mark.parametrize(("name", "effect", "more"), CLASSES)
def test_every_print_says_what_was_left_out_and_its_effect(name, effect, more, tmp_path, capsys):
    path = tmp_path / "robot.urdf"
    path.write_text(robot(more))
    more = ["--leave-out", "loops"] if name == "loops" else []
    efforts = ["--actuated", "crank_hinge,coupler_hinge,rocker_hinge"]
    for command in (["check"], ["mobility"], ["forces", *efforts]):
        status = main([command[0], str(path), *command[1:], *more])
        said = " ".join(capsys.readouterr().out.split())
        assert status == 0, said
        assert f"{name}: " in said
        assert f"({effect}: " in said
    if name == "loops":
        assert main(["check", str(path)]) == 2
        assert "it changes the mechanism" in " ".join(capsys.readouterr().err.split())


def test_hinges_that_end_keep_their_loop_and_their_ends_are_said():
    limits = AXIS.format("<limit><lower>-1</lower><upper>1</upper></limit>")
    chain = ClosedChain.from_urdf(robot(f"<gazebo>{SDF.format('revolute', text(AT_COUPLER), limits)}</gazebo>"))
    assert chain.mobility(chain.neutral()).degrees_of_freedom == 1
    assert any(entry.startswith("loop_limits: ") for entry in chain.description.left_out)


def test_a_loop_within_one_body_has_its_places_together():
    inside = LOOP.replace('link="rocker"', 'link="coupler"')
    chain = ClosedChain.from_urdf(robot(inside.format("spherical", text(AT_COUPLER), text(AT_COUPLER))))
    assert chain.closures == ()
    assert any(entry.startswith("rigid: ") for entry in chain.description.left_out)
    with pytest.raises(FileFormatError, match="two places of one rigid body that are apart"):
        ClosedChain.from_urdf(robot(inside.format("spherical", text(AT_COUPLER), text(AT_ROCKER))))


@pytest.mark.parametrize(("second", "powers"), [('joint2="crank_hinge"', (0.1, 2.0, 0.3, 0.0, 0.0)), ("", (0.1,))])
def test_a_joint_equality_of_mujoco_is_a_coupling(second, powers):
    given = '<joint name="gear" joint1="rocker_hinge" {} polycoef="0.1 2 0.3 0 0"/>'
    urdf = '<robot name="robot">{}</robot>'
    chain = ClosedChain.from_urdf(urdf.format(TREE + EQUALITY.format(given.format(second))))
    (gear,) = chain.closures
    leader = "crank_hinge" if second else "universe"
    assert (gear.name, gear.type, gear.frame_a, gear.frame_b) == ("gear", "coupling", leader, "rocker_hinge")
    assert gear.polynomial == powers
    stated = Closures(
        "robot", closures=(Closure("own", "coupling", leader, "rocker_hinge", polynomial=(0.0, 1.0)[: len(powers)]),)
    )
    both = ClosedChain.from_urdf(urdf.format(TREE + EQUALITY.format(given.format(second))), stated)
    assert [closure.name for closure in both.closures] == ["own"]
    assert any(text.startswith("restated: ") for text in both.description.left_out)
    with pytest.raises(FileFormatError, match=r"no hinge or slide 'nobody'.*\n\n\[\[closures"):
        ClosedChain.from_urdf(urdf.format(TREE + EQUALITY.format('<joint joint1="nobody" joint2="crank_hinge"/>')))


def test_what_was_left_out_stands_in_errors_and_in_the_answers_of_a_device(tmp_path, capsys):
    bushing = "<gazebo><damping_of_air/></gazebo>"
    chain = ClosedChain.from_urdf(
        f'<robot name="robot">{TREE}{BALL.format(text(AT_COUPLER), text(AT_ROCKER))}{bushing}</robot>'
    )
    (doubt,) = chain.description.doubts
    assert "unread: <damping_of_air> in <gazebo> (may change forces" in doubt
    with pytest.raises(LoopNotClosed) as caught:
        chain.close([3.0, 0.0, 0.0], hold=["crank_hinge", "rocker_hinge"])
    assert caught.value.__notes__ == [doubt]
    files = ep.load(Path(__file__).parents[4] / "urdf" / "spring-support.urdf").export(tmp_path / "support.urdf")
    files[0].write_text(files[0].read_text().replace("</robot>", f"{bushing}</robot>"))
    main(["reaction", str(files[-1]), "--flexion", "30", "--explain"])
    said = " ".join(capsys.readouterr().out.split())
    assert "Left out of the robot's file: unread: <damping_of_air> in <gazebo>" in said
