"""Joints of three coordinates in a written MJCF: where the keyframe puts their bodies, and what their joints do."""

import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import random_loop
from rubbing_chains import slide
from scipy.spatial.transform import Rotation
from written_robots import text_of

from exo_pin import InvalidInput
from exo_pin.chain import ClosedChain, Closures, JointProperties, Placement

pytestmark = pytest.mark.usefixtures("plain")

KINDS = {
    "ball": (pin.JointModelSpherical(), np.array([0.1, -0.5, 0.3, 0.8]) / np.linalg.norm([0.1, -0.5, 0.3, 0.8])),
    "planar": (pin.JointModelPlanar(), np.array([0.3, -0.2, np.cos(2.2), np.sin(2.2)])),
    "translation": (pin.JointModelTranslation(), np.array([0.3, -0.2, 0.7])),
    "free": (pin.JointModelFreeFlyer(), np.array([0.3, -0.2, 0.7, 0.5, -0.5, 0.5, 0.5])),
    "hinge": (pin.JointModelRevoluteUnaligned(np.array([0.6, 0.0, 0.8])), np.array([0.4])),
    "endless": (pin.JointModelRUBZ(), np.array([np.cos(-2.0), np.sin(-2.0)])),
    "slide": (pin.JointModelPY(), np.array([-0.4])),
}


def carried(kind, damping=None):
    """A body on a joint, and a hinge on it."""
    model, rng = pin.Model(), np.random.default_rng(7)
    place = pin.SE3(Rotation.random(rng=rng).as_matrix(), rng.normal(size=3))
    model.addJoint(0, KINDS[kind][0], place, "first")
    model.addJoint(1, pin.JointModelRX(), pin.SE3(np.eye(3), np.array([0.0, 0.3, 0.1])), "second")
    for joint in (1, 2):
        moments = np.diag([0.3, 0.4, 0.5])
        model.appendBodyToJoint(joint, pin.Inertia(1.0 + joint, rng.normal(size=3), moments), pin.SE3.Identity())
        model.addFrame(pin.Frame(f"body_{joint}", joint, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    if damping is not None:
        model.damping = np.concatenate([damping, [0.5]])
    return ClosedChain(model, Closures("two"))


@pytest.mark.parametrize("kind", KINDS)
def test_the_keyframe_puts_bodies_where_they_were(kind):
    chain = carried(kind)
    q = np.concatenate([KINDS[kind][1], [0.9]])
    written = ClosedChain.from_mjcf(text_of(chain, "mjcf", q))
    there = written.reference_configuration("closed")
    for body in ("body_1", "body_2"):
        one, other = chain.placement(q, body), written.placement(there, body)
        np.testing.assert_allclose(other.homogeneous, one.homogeneous, atol=1e-12)
    energies = []
    for each, at in ((chain, q), (written, there)):
        energies.append(pin.computePotentialEnergy(each.model, each.model.createData(), at))
    assert energies[0] == pytest.approx(energies[1])
    assert sum(body.mass for body in written.model.inertias.tolist()[1:]) == pytest.approx(5.0)


@pytest.mark.parametrize(("kind", "types"), [("planar", "slide slide hinge"), ("translation", "slide slide slide")])
def test_joints_of_three_coordinates_are_three_joints_with_their_damping(kind, types):
    damping = np.array([2.0, 2.0, 3.0]) if kind == "planar" else np.array([1.0, 2.0, 3.0])
    text = text_of(carried(kind, damping), "mjcf", np.concatenate([KINDS[kind][1], [0.0]]))
    joints = ET.fromstring(text).findall("worldbody//joint")[:3]
    assert " ".join(joint.get("type") for joint in joints) == types
    assert [joint.get("name") for joint in joints] == ["first_x", "first_y", "first_z"]
    for k, joint in enumerate(joints):
        np.testing.assert_array_equal(np.array(joint.get("axis").split(), dtype=float), np.eye(3)[k])
        assert float(joint.get("damping")) == damping[k]


def test_damping_that_a_joint_cannot_hold_is_refused():
    for kind, damping in (("planar", [1.0, 2.0, 3.0]), ("ball", [1.0, 1.0, 2.0])):
        with pytest.raises(InvalidInput, match="damping"):
            text_of(carried(kind, np.array(damping)), "mjcf", np.concatenate([KINDS[kind][1], [0.0]]))
    text = text_of(carried("ball", np.full(3, 1.5)), "mjcf", np.array([0, 0, 0, 1.0, 0.0]))
    joint = ET.fromstring(text).find("worldbody//joint")
    assert (joint.get("type"), joint.get("damping")) == ("ball", "1.5")


@pytest.mark.parametrize("damping", [0.0, 0.7])
def test_a_free_body_is_damped_as_it_was(damping):
    text = text_of(carried("free", np.full(6, damping)), "mjcf", np.concatenate([KINDS["free"][1], [0.0]]))
    assert ("<freejoint" in text) == (damping == 0.0)
    np.testing.assert_array_equal(ClosedChain.from_mjcf(text).model.damping, [*[damping] * 6, 0.5])


@pytest.mark.parametrize(("limit", "said"), [(np.inf, False), (3.0, True)])
def test_limits_of_velocity_are_left_out_and_said(limit, said):
    chain = carried("hinge")
    model = chain.model
    model.upperVelocityLimit, model.lowerVelocityLimit = np.array([np.inf, limit]), np.array([-np.inf, -limit])
    text = text_of(ClosedChain(model, Closures("two")), "mjcf", np.array([0.4, 0.9]))
    assert ("no limits of velocity" in text) == said


@pytest.mark.parametrize(("least", "heavier"), [(0.0, True), (1e-9, False), (0.3, False)])
def test_a_thin_rod_gets_a_millionth_of_inertia_for_mujoco(least, heavier):
    model = pin.Model()
    for k in range(2):
        model.addJoint(k, pin.JointModelRX(), pin.SE3(np.eye(3), np.array([0.0, 0.5 * k, 0.0])), f"hinge_{k}")
        moments = np.diag([0.3, least if k else 0.3, 0.3])
        model.appendBodyToJoint(k + 1, pin.Inertia(2.0, np.zeros(3), moments), pin.SE3.Identity())
        model.addFrame(pin.Frame(f"rod_{k}", k + 1, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    text = text_of(ClosedChain(model, Closures("rods")), "mjcf", np.zeros(2))
    assert ("a millionth was added to rod_1." in text) == heavier
    assert "rod_0" not in text.partition("<mujoco")[0]
    written = ClosedChain.from_mjcf(text).model.inertias[2]
    more = 2.0 * 1e-6 * 0.5**2 if heavier else 0.0
    np.testing.assert_allclose(np.sort(np.linalg.eigvalsh(written.inertia))[0], min(least, 0.3) + more, rtol=1e-6)


@pytest.mark.parametrize("reference", [None, (0.3,)])
@pytest.mark.parametrize("written", ["mjcf", "urdf"])
def test_springs_are_slack_where_they_were(reference, written, tmp_path):
    chain = slide(0.4)
    spring = JointProperties("slide", 50.0, reference)
    chain = ClosedChain(chain.model, replace(chain.description, joints=(spring,)))
    if written == "mjcf":
        again = ClosedChain.from_mjcf(text_of(chain, "mjcf", np.zeros(1)))
    else:
        again = ClosedChain.from_urdf(chain.to_urdf(tmp_path))
    slack = 0.0 if reference is None else 0.3
    for q in (-0.2, 0.5):
        expected = 0.5 * 50.0 * (q - slack) ** 2
        assert chain._state.passive.energy(np.array([q])) == pytest.approx(expected)
        assert again._state.passive.energy(np.array([q])) == pytest.approx(expected)


def test_a_model_keeps_its_name():
    text = text_of(carried("hinge"), "mjcf", np.array([0.4, 0.9]))
    assert ClosedChain.from_mjcf(text).model.name == "two"
    unnamed = ClosedChain.from_mjcf("<mujoco><worldbody><body><joint/><geom size='1'/></body></worldbody></mujoco>")
    assert unnamed.model.name


@pytest.mark.parametrize("on_world", [False, True])
def test_the_parts_of_a_body_sum_up_to_it(on_world):
    named = random_loop("cylindrical")
    chain = named.chain()
    q = chain.close(named.q)
    if on_world:
        # Frame a of a closure on the world, where frame b's body is parted.
        (loop,) = chain.description.closures
        frame = chain.placement(q, "left_3") * pin.XYZQUATToSE3(
            np.array([*loop.placement_a.translation, *loop.placement_a.quaternion])
        )
        at = Placement(tuple(frame.translation), tuple(pin.Quaternion(frame.rotation).coeffs()))
        loop = replace(loop, frame_a="universe", placement_a=at)
        chain = ClosedChain(chain.model, replace(chain.description, closures=(loop,)))
    again = ClosedChain.from_mjcf(text_of(chain, "mjcf", q))
    there = again.reference_configuration("closed")
    assert np.abs(again.residual(there)).max() < 1e-12
    parted = "right_2" if on_world else "left_3"
    places = again.placements(there)
    total = pin.Inertia.Zero()
    for name in (parted, "loop_helper"):
        frame = again.model.frames[again.model.getFrameId(name)]
        own = again.model.inertias[frame.parentJoint]
        total += (places[name] * frame.placement.inverse()).act(own)
        assert own.mass == pytest.approx(0.5)
    joint = chain.model.getJointId(f"{parted}_joint")
    data = chain.model.createData()
    pin.forwardKinematics(chain.model, data, q)
    assert total.isApprox(data.oMi[joint].act(chain.model.inertias[joint]), 1e-9)


def test_the_spring_of_a_translation_is_slack_where_it_was():
    chain = carried("translation")
    spring = JointProperties("first", 40.0, (0.1, -0.2, 0.3))
    chain = ClosedChain(chain.model, replace(chain.description, joints=(spring,)))
    q = np.concatenate([KINDS["translation"][1], [0.9]])
    written = ClosedChain.from_mjcf(text_of(chain, "mjcf", q))
    there = written.reference_configuration("closed")
    expected = 0.5 * 40.0 * np.sum((q[:3] - [0.1, -0.2, 0.3]) ** 2)
    for each, at in ((chain, q), (written, there)):
        assert each._state.passive.energy(at) == pytest.approx(expected)


def test_principal_axes_are_right_handed():
    rng = np.random.default_rng(5)
    for _ in range(20):
        spread = rng.normal(size=(3, 3))
        inertia = np.trace(spread @ spread.T) * np.eye(3) - spread @ spread.T
        model = pin.Model()
        model.addJoint(0, pin.JointModelRX(), pin.SE3.Identity(), "hinge")
        model.appendBodyToJoint(1, pin.Inertia(2.0, np.array([0.1, 0.2, 0.3]), inertia), pin.SE3.Identity())
        element = ET.fromstring(text_of(ClosedChain(model, Closures("one")), "mjcf", np.zeros(1))).find(".//inertial")
        axes = Rotation.from_quat([float(w) for w in element.get("quat").split()], scalar_first=True).as_matrix()
        moments = np.array(element.get("diaginertia").split(), dtype=float)
        np.testing.assert_allclose(axes @ np.diag(moments) @ axes.T, inertia, atol=1e-12)
        assert element.get("pos") == "0.1 0.2 0.3"
