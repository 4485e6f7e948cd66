"""Joints of three coordinates in a written MJCF: where the keyframe puts their bodies, and what their joints do."""

import xml.etree.ElementTree as ET
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import random_loop
from rubbing_chains import slide
from scipy.spatial.transform import Rotation

from exo_pin import InvalidInput
from exo_pin.chain import ClosedChain, Closures, JointProperties, Placement
from exo_pin.chain.formats.joint_data import NO_LIMIT
from exo_pin.chain.formats.mjcf.mjcf_joints import write_inertial
from exo_pin.chain.formats.mjcf.mjcf_writing import _tension, mjcf_text

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
    written = ClosedChain.from_mjcf(mjcf_text(chain._state, q))
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
    text = mjcf_text(carried(kind, damping)._state, np.concatenate([KINDS[kind][1], [0.0]]))
    joints = ET.fromstring(text).findall("worldbody//joint")[:3]
    assert " ".join(joint.get("type") for joint in joints) == types
    assert [joint.get("name") for joint in joints] == ["first_x", "first_y", "first_z"]
    for k, joint in enumerate(joints):
        np.testing.assert_array_equal(np.array(joint.get("axis").split(), dtype=float), np.eye(3)[k])
        assert float(joint.get("damping")) == damping[k]


def test_damping_that_a_joint_cannot_hold_is_refused():
    for kind, damping in (("planar", [1.0, 2.0, 3.0]), ("ball", [1.0, 1.0, 2.0])):
        with pytest.raises(InvalidInput, match="damping"):
            mjcf_text(carried(kind, np.array(damping))._state, np.concatenate([KINDS[kind][1], [0.0]]))
    text = mjcf_text(carried("ball", np.full(3, 1.5))._state, np.array([0, 0, 0, 1.0, 0.0]))
    joint = ET.fromstring(text).find("worldbody//joint")
    assert (joint.get("type"), joint.get("damping")) == ("ball", "1.5")


@pytest.mark.parametrize("damping", [0.0, 0.7])
def test_a_free_body_is_damped_as_it_was(damping):
    text = mjcf_text(carried("free", np.full(6, damping))._state, np.concatenate([KINDS["free"][1], [0.0]]))
    assert ("<freejoint" in text) == (damping == 0.0)
    np.testing.assert_array_equal(ClosedChain.from_mjcf(text).model.damping, [*[damping] * 6, 0.5])


@pytest.mark.parametrize(("limit", "said"), [(np.inf, False), (3.0, True)])
def test_limits_of_velocity_are_left_out_and_said(limit, said):
    chain = carried("hinge")
    model = chain.model
    model.upperVelocityLimit, model.lowerVelocityLimit = np.array([np.inf, limit]), np.array([-np.inf, -limit])
    text = mjcf_text(ClosedChain(model, Closures("two"))._state, np.array([0.4, 0.9]))
    assert ("no limits of velocity" in text) == said


@pytest.mark.parametrize(("least", "heavier"), [(0.0, True), (1e-9, False), (0.3, False)])
def test_a_thin_rod_gets_a_millionth_of_inertia_for_mujoco(least, heavier):
    model = pin.Model()
    for k in range(2):
        model.addJoint(k, pin.JointModelRX(), pin.SE3(np.eye(3), np.array([0.0, 0.5 * k, 0.0])), f"hinge_{k}")
        moments = np.diag([0.3, least if k else 0.3, 0.3])
        model.appendBodyToJoint(k + 1, pin.Inertia(2.0, np.zeros(3), moments), pin.SE3.Identity())
        model.addFrame(pin.Frame(f"rod_{k}", k + 1, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    text = mjcf_text(ClosedChain(model, Closures("rods"))._state, np.zeros(2))
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
        again = ClosedChain.from_mjcf(mjcf_text(chain._state, np.zeros(1)))
    else:
        again = ClosedChain.from_urdf(chain.to_urdf(tmp_path))
    slack = 0.0 if reference is None else 0.3
    for q in (-0.2, 0.5):
        expected = 0.5 * 50.0 * (q - slack) ** 2
        assert chain._state.passive.energy(np.array([q])) == pytest.approx(expected)
        assert again._state.passive.energy(np.array([q])) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("effort", "control"),
    [
        ((-5.0, 2.0), (-2.0, 5.0)), ((-5.0, np.inf), (-NO_LIMIT, 5.0)), ((-np.inf, 0.0), (0.0, NO_LIMIT)),
        ((-np.inf, np.inf), None), ((0.0, 0.0), None), ((-3.0, 0.0), (0.0, 3.0)),
    ],
)  # fmt: skip
def test_tensions_of_limbs_are_efforts_the_other_way_round(effort, control):
    found = _tension(np.array(effort))
    assert found["gear"] == "-1"
    assert ("ctrlrange" in found) == (control is not None)
    if control is not None:
        assert tuple(float(word) for word in found["ctrlrange"].split()) == control


def test_a_model_keeps_its_name():
    text = mjcf_text(carried("hinge")._state, np.array([0.4, 0.9]))
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
    again = ClosedChain.from_mjcf(mjcf_text(chain._state, q))
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
    written = ClosedChain.from_mjcf(mjcf_text(chain._state, q))
    there = written.reference_configuration("closed")
    expected = 0.5 * 40.0 * np.sum((q[:3] - [0.1, -0.2, 0.3]) ** 2)
    for each, at in ((chain, q), (written, there)):
        assert each._state.passive.energy(at) == pytest.approx(expected)


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize(
    ("given", "written"),
    [
        # By a third of the miss each; none below zero.
        ((1.0, 1.0, 2.003), (1.001, 1.001, 2.002)), ((1.0, 1.0, 2.0 + 3e-9), (1.0 + 1e-9, 1.0 + 1e-9, 2.0 + 2e-9)),
        ((-0.01, 1.0, 1.0), (0.0, 1.0, 1.0)), ((1.0, 1.0, 2.0), None), ((0.0, 1.0, 1.0), None),
        # A tenth of the largest is the most.
        ((1.0, 1.0, 2.7), (1.0 + 0.7 / 3, 1.0 + 0.7 / 3, 2.7 - 0.7 / 3)), ((1.0, 1.0, 2.8), "refused"),
        ((-0.09, 1.0, 1.0), (0.0, 1.0, 1.0)), ((-0.11, 1.0, 1.0), "refused"),
    ],
)  # fmt: skip
def test_moments_that_miss_the_rules_are_mended_and_said_whatever_their_size(given, written, size):
    # As of a URDF; Pinocchio makes none of them itself.
    element, inertia = ET.Element("body"), SimpleNamespace(mass=1.0, lever=np.zeros(3), inertia=np.diag(given) * size)
    if written == "refused":
        with pytest.raises(InvalidInput, match="of link are"):
            write_inertial(element, "link", inertia)
        return
    if written is None:
        write_inertial(element, "link", inertia)
        (inertial,) = element
    else:
        with pytest.warns(RuntimeWarning, match=r"body link: Principal moments of inertia mended: .* before, ") as told:
            write_inertial(element, "link", inertia)
        # At the line that asked for the file.
        assert told[0].filename == __file__
        comment, inertial = element
        assert "kg m² after" in comment.text
    moments = np.array(inertial.get("diaginertia").split(), dtype=float) / size
    np.testing.assert_allclose(moments, given if written is None else written, atol=1e-14)


def test_principal_axes_are_right_handed():
    rng = np.random.default_rng(5)
    for _ in range(20):
        spread = rng.normal(size=(3, 3))
        inertia = np.trace(spread @ spread.T) * np.eye(3) - spread @ spread.T
        element = ET.Element("body")
        write_inertial(element, "link", pin.Inertia(2.0, np.array([0.1, 0.2, 0.3]), inertia))
        axes = Rotation.from_quat([float(w) for w in element[0].get("quat").split()], scalar_first=True).as_matrix()
        moments = np.array(element[0].get("diaginertia").split(), dtype=float)
        np.testing.assert_allclose(axes @ np.diag(moments) @ axes.T, inertia, atol=1e-12)
        assert element[0].get("pos") == "0.1 0.2 0.3"
