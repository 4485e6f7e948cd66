"""Loops that other programs' elements state in a URDF, on a four-bar, against the same one with a closures file."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from exo_pin import FileFormatError
from exo_pin.chain import ClosedChain, Closure, Closures, Placement

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


@pytest.mark.parametrize(("turn", "said"), [("0 0 0 0", "length 1, got length 0"), ("nan 0 0 1", "expected a decimal")])
def test_a_quaternion_that_turns_nothing_is_refused(turn, said):
    loop = LOOP.format("spherical", text(AT_COUPLER), text(AT_ROCKER)).replace('rpy="0 0 0"', f'quat_xyzw="{turn}"')
    with pytest.raises(FileFormatError, match=said):
        ClosedChain.from_urdf(robot(loop))


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
