"""What is said of robots' files that cannot be read, and of tolerated oddities, format by format, as it is stored."""

import numpy as np
import pinocchio as pin
from answers import changes, each_of
from asked_chains import tried
from asked_files import brief, read, said
from caspr_robots import ARM as CABLE_ARM
from caspr_robots import ROUTES, cables, link, motion, system
from sdf_arm import ARM, ELBOW, SHOULDER
from urdf_knee import BARE, GOOD

from exo_pin import ClosedChain
from exo_pin.chain import Closures, Root

TWO = GOOD.replace("</robot>", '<link name="c"/>{}</robot>')
BALL = (
    '<drake:ball_constraint xmlns:drake="http://drake.mit.edu" name="ball">{}</drake:ball_constraint>',
    '<drake:ball_constraint_body_A name="b"/>',
    '<drake:ball_constraint_body_B name="world"/>',
    '<drake:ball_constraint_p_AP xyz="0 0 0.4"/>',
    '<drake:ball_constraint_p_BQ xyz="1 2 3.4"/>',
)


def chains(text, *more):
    return read("urdf", text, *more or (BARE,))


def of_urdf():
    deep = "".join(
        f'<link name="l{k + 1}"/><joint name="j{k}" type="fixed"><parent link="l{k}"/><child link="l{k + 1}"/></joint>'
        for k in range(1200)
    )
    floats = "".join(
        f'<link name="l{k + 1}"/><joint name="j{k}" type="floating"><parent link="l0"/><child link="l{k + 1}"/></joint>'
        for k in range(700)
    )
    mimic = '<joint name="more" type="{}"><parent link="b"/><child link="c"/>{}<mimic joint="knee"/></joint>'
    return {
        "no robot": chains(GOOD.replace("<robot", "<machine").replace("robot>", "machine>")),
        "no name": chains(GOOD.replace('name="r"', 'name=""')),
        "deep": chains(f'<robot name="r"><link name="l0"/>{deep}</robot>'),
        "many freedoms": chains(f'<robot name="r"><link name="l0"/>{floats}</robot>'),
        "mimic of a ball": chains(TWO.format(mimic.format("floating", ""))),
        "no mass": chains(GOOD.replace('<mass value="2"/>', "<mass/>")),
        "root of a joint's name": chains(GOOD, Closures("r", Root("spherical", "knee"))),
    }


def of_dialects():
    """Loops that other programs state in a URDF."""
    whole, *parts = BALL

    def ball(*left):
        return TWO.format(FIXED + whole.format("".join(each for k, each in enumerate(parts) if k not in left)))

    loop = '<loop_joint name="loop" type="{}">{}</loop_joint>'
    ends = '<link1 link="b" xyz="0 0 0.4"/><link2 link="{}" xyz="0 0 0.4"/>'
    equality = '<mujoco><equality><weld name="held" body1="b" body2="c" active="{}"/></equality></mujoco>'
    sdf = '<gazebo><joint name="loop" type="{}"><parent>a</parent><child>c</child>{}</joint></gazebo>'
    cross = "<axis><xyz>1 0 0</xyz></axis><axis2><xyz>{}</xyz></axis2>"
    return {
        "ball": chains(ball()),
        "ball without a body": [chains(ball(k)) for k in (0, 1)],
        "ball without a point": [chains(ball(k)) for k in (2, 3)],
        "world": chains(TWO.format(FIXED + loop.format("spherical", ends.format("world")))),
        "one link": chains(TWO.format(FIXED + loop.format("spherical", '<link1 link="b"/>'))),
        "no such link": chains(TWO.format(FIXED + loop.format("spherical", ends.format("nobody")))),
        "hinge": chains(TWO.format(FIXED + loop.format("revolute", ends.format("c")))),
        "inactive": [chains(TWO.format(FIXED + equality.format(word))) for word in ("true", "false", "maybe")],
        "skew universal joint": [
            chains(TWO.format(FIXED + sdf.format("universal", cross.format(second)))) for second in ("0 1 0", "1 1 0")
        ],
        "damped loop": chains(
            TWO.format(
                FIXED + sdf.format("ball", "<axis><xyz>1 0 0</xyz><dynamics><damping>2</damping></dynamics></axis>")
            )
        ),
    }


FIXED = '<joint name="weld" type="fixed"><parent link="a"/><child link="c"/></joint>'


def of_sdf():
    def changed(old, new):
        return read("sdf", ARM.replace(old, new, 1))

    mimic = '<axis><xyz>1 0 0</xyz><mimic joint="{}" axis="{}"><multiplier>2</multiplier></mimic></axis>'
    inner = '<model name="hand"><link name="palm"/></model></model>'
    held = '<joint name="grip" type="fixed"><parent>fore</parent><child>{}</child></joint>'
    return {
        "follower": [
            changed(ELBOW, mimic.format(*row))
            for row in (("shoulder", "axis"), ("nobody", "axis"), ("upper", "axis"), ("shoulder", "axis3"))
        ],
        "two models": changed("</sdf>", '<model name="other"><link name="l"/></model></sdf>'),
        "no model": read("sdf", '<sdf version="1.9"></sdf>'),
        "inner link": changed("</model>", held.format("hand::palm") + inner),
        "inner link of no model": changed("</model>", held.format("foot::palm") + inner),
        "inner model's name": changed("</model>", held.format("hand") + inner),
        "outermost": changed('<model name="arm">', '<model name="arm"><pose relative_to="upper">0 0 1 0 0 0</pose>'),
        "frame": changed("<pose>", '<pose frame="base">'),
        "other version": [changed("1.9", version) for version in ("1.6", "1.2", "9")],
        "axis in a frame": changed(SHOULDER, '<axis><xyz expressed_in="fore">0 1 0</xyz></axis>'),
    }


def of_caspr():
    routes = cables(*ROUTES)

    def asked(bodies, routes=routes):
        return said(tried(lambda: brief(ClosedChain.from_caspr(bodies, routes))))

    given = motion("R_AXIS", 1, 'axis="0 0 0"')
    return {
        "two of one name": asked(CABLE_ARM.replace("forearm", "upper arm")),
        "the base's name": asked(CABLE_ARM.replace("forearm", "universe")),
        "no axis": asked(system(link(1, "a", given, 0, "0 0 0")), cables()),
        "no start": asked(CABLE_ARM.replace('q_initial="0 0"', "")),
        "no least": asked(CABLE_ARM.replace('q_min="-3 -3"', "")),
        "pulley": asked(
            CABLE_ARM, routes.replace("<attachment>", "<pulley>", 1).replace("</attachment>", "</pulley>", 1)
        ),
        "one end": asked(CABLE_ARM, cables(((0, "0.2 0 0.1"),))),
        "cables of one name": asked(CABLE_ARM, routes.replace("cable 1", "cable 0")),
    }


def of_models():
    """Models made by hand."""
    model = pin.Model()
    for name in ("one", "one"):
        model.addJoint(0, pin.JointModelRX(), pin.SE3.Identity(), name)
    other = pin.Model()
    other.addJoint(0, pin.JointModelHX(0.1), pin.SE3.Identity(), "screw")
    screw = ClosedChain(other, Closures("r"))
    return {
        "two of one name": tried(lambda: ClosedChain(model, Closures("r"))),
        "mirrored screw": tried(lambda: screw.mirrored().model.joints[1].shortname()),
        "screw": screw.close(np.zeros(1)),
    }


ASKED = {
    "refused_urdf": of_urdf,
    "refused_loops": of_dialects,
    "refused_sdf": of_sdf,
    "refused_caspr": of_caspr,
    "refused_models": of_models,
}


@each_of(ASKED, ())
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
