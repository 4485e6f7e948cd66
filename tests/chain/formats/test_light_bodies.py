"""Bodies without mass in written files, and joints that no format has."""

import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from written_robots import text_of

from exo_pin import InvalidInput
from exo_pin.chain import ClosedChain, Closure, Closures, Placement


def square(masses, closures):
    """Two hinges on the world with a hinge on each: bodies 1 and 2, then 3 and 4."""
    model = pin.Model()
    for k, parent in enumerate((0, 1, 0, 3)):
        place = pin.SE3(np.eye(3), np.array([0.0, 0.1 * k, 0.2]))
        model.addJoint(parent, pin.JointModelRX(), place, f"joint_{k}")
        mass = masses[k]
        inertia = pin.Inertia(mass, np.zeros(3), mass * np.eye(3)) if mass else pin.Inertia.Zero()
        model.appendBodyToJoint(k + 1, inertia, pin.SE3.Identity())
        model.addFrame(pin.Frame(f"link_{k}", k + 1, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    made = tuple(Closure(f"c{k}", kind, a, b) for k, (kind, a, b) in enumerate(closures))
    return ClosedChain(model, Closures("square", closures=made))


LIGHT_ENDS = (1.0, 0.0, 1.0, 0.0)


@pytest.mark.parametrize("closures", [[("rigid", "link_1", "link_3")], [
    ("spherical", "link_0", "universe"), ("rigid", "link_1", "link_2"), ("rigid", "link_3", "link_0")
]])  # fmt: skip
def test_loops_that_massless_ends_close_come_back(closures):
    chain, made = square(LIGHT_ENDS, closures), []
    q = chain.neutral()
    for closure in chain.closures:
        place = chain.placement(q, closure.frame_b).actInv(chain.placement(q, closure.frame_a))
        made.append(replace(closure, placement_b=Placement(tuple(place.translation.tolist()))))
    chain = ClosedChain(chain.model, Closures("square", closures=tuple(made)))
    freedoms = chain.mobility(q, actuated=()).degrees_of_freedom
    again = ClosedChain.from_sdf(text_of(chain, "sdf", q))
    assert again.mobility(again.neutral(), actuated=()).degrees_of_freedom == freedoms == (1 if len(made) == 1 else 0)
    if len(made) == 1:
        # Neither end has mass to share.
        with pytest.raises(InvalidInput, match="needs mass for every body; link_3 has none"):
            text_of(chain, "mjcf", q)
        return
    again = ClosedChain.from_mjcf(text_of(chain, "mjcf", q))
    assert again.mobility(again.neutral(), actuated=()).degrees_of_freedom == freedoms


@pytest.mark.parametrize(("masses", "said"), [
    ((1.0, 0.0, 0.5, 0.0), "needs mass for every body; link_1, link_3 have none"),
    ((1.0, 0.0, 0.5, 1.0), "needs mass for every body; link_1 has none"),
])  # fmt: skip
def test_bodies_without_mass_are_named(masses, said):
    chain = square(masses, [])
    with pytest.raises(InvalidInput, match=said):
        text_of(chain, "mjcf", chain.neutral())


@pytest.mark.parametrize(
    "screw", [pin.JointModelHZ(0.1), pin.JointModelHelicalUnaligned(np.array([0.6, 0.0, 0.8]), 0.1)]
)
@pytest.mark.parametrize("kind", ["sdf", "mjcf", "urdf"])
def test_a_screw_is_neither_hinge_nor_slide(screw, kind):
    model = pin.Model()
    model.addJoint(0, screw, pin.SE3.Identity(), "joint_0")
    model.appendBodyToJoint(1, pin.Inertia(1.0, np.zeros(3), np.eye(3)), pin.SE3.Identity())
    with pytest.raises(InvalidInput, match=r"'joint_0'"):
        text_of(ClosedChain(model, Closures("screw")), kind)


def test_the_link_of_a_joint_is_the_first_in_its_frame():
    model = pin.Model()
    model.addJoint(0, pin.JointModelRX(), pin.SE3.Identity(), "one")
    model.addJoint(1, pin.JointModelRX(), pin.SE3.Identity(), "two")
    off = pin.SE3(np.eye(3), np.array([1e-3, 0.0, 0.0]))
    for joint in (1, 2):
        model.appendBodyToJoint(joint, pin.Inertia(1.0, np.zeros(3), np.eye(3)), pin.SE3.Identity())
    for name, joint, place, kind in (
        ("site", 1, pin.SE3.Identity(), pin.FrameType.OP_FRAME), ("off", 1, off, pin.FrameType.BODY),
        ("own", 1, pin.SE3.Identity(), pin.FrameType.BODY), ("more", 1, pin.SE3.Identity(), pin.FrameType.BODY),
        ("far", 2, off, pin.FrameType.BODY), ("ground", 0, pin.SE3.Identity(), pin.FrameType.BODY),
    ):  # fmt: skip
        model.addFrame(pin.Frame(name, joint, 0, place, kind))
    # A body without a link in its joint's frame is called after the joint.
    text = text_of(ClosedChain(model, Closures("links")), "mjcf", np.zeros(2))
    assert [body.get("name") for body in ET.fromstring(text).iter("body")] == ["own", "two"]
