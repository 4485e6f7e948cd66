"""Single elements of MJCF: what is written of closures, and limits with a margin, against MuJoCo's own numbers."""

import xml.etree.ElementTree as ET

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from mechanisms import random_loop
from scipy.spatial.transform import Rotation
from written_robots import text_of

from exo_pin import FileFormatError
from exo_pin.chain import ClosedChain, Closures

pytestmark = pytest.mark.usefixtures("plain")


@pytest.fixture(scope="module")
def written():
    """Chains with one closure, the file that is written of each, and its configuration."""
    found = {}

    def of(kind):
        if kind not in found:
            named = random_loop(kind)
            chain = named.chain()
            q = chain.close(named.q)
            found[kind] = chain, q, text_of(chain, "mjcf", q)
        return found[kind]

    return of


def test_a_distance_is_the_length_of_a_tendon(written):
    chain, q, text = written("distance")
    model = mujoco.MjModel.from_xml_string(text)
    # MuJoCo holds a tendon at its length with all joints at zero and the first coefficient.
    (closure,) = chain.closures
    assert model.tendon_length0[0] + model.eq_data[0, 0] == pytest.approx(closure.distance, rel=1e-12)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    assert data.ten_length[0] == pytest.approx(closure.distance, rel=1e-9)
    np.testing.assert_allclose(data.efc_pos[data.efc_type == 0], 0.0, atol=1e-9)
    assert [key.get("name") for key in ET.fromstring(text).iter("key")] == ["closed"]
    assert len(q) == len(data.qpos)


def test_a_hinge_is_held_at_two_points_of_its_axis(written):
    chain, _, text = written("revolute")
    root = ET.fromstring(text)
    sites = {site.get("name"): site for site in root.iter("site")}
    for end in "ab":
        one, other = sites[f"loop_{end}"], sites[f"loop_{end}_2"]
        places = [np.array(site.get("pos").split(), dtype=float) for site in (one, other)]
        quaternions = [np.array(site.get("quat").split(), dtype=float) for site in (one, other)]
        along = Rotation.from_quat(quaternions[0], scalar_first=True).apply([0.0, 0.0, chain.characteristic_length])
        np.testing.assert_allclose(places[1] - places[0], along, atol=1e-12)
        np.testing.assert_array_equal(quaternions[0], quaternions[1])
    pairs = [(item.tag, item.get("site1"), item.get("site2")) for item in root.find("equality")]
    assert pairs == [("connect", "loop_a", "loop_b"), ("connect", "loop_a_2", "loop_b_2")]


@pytest.mark.parametrize(
    ("kind", "joints"),
    [
        ("cylindrical", ["hinge 0.0 0.0 1.0", "slide 0.0 0.0 1.0"]),
        ("universal", ["hinge 0.0 1.0 0.0", "hinge 1.0 0.0 0.0"]),
        ("prismatic", ["slide 0.0 0.0 1.0"]),
    ],
)
def test_a_helper_moves_as_the_closure_allows(written, kind, joints):
    _, _, text = written(kind)
    (helper,) = (body for body in ET.fromstring(text).iter("body") if body.get("name").endswith("_helper"))
    assert [f"{joint.get('type')} {joint.get('axis')}" for joint in helper.findall("joint")] == joints
    # Where the loop is closed the helper is at frame a, in MuJoCo's own kinematics.
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_kinematics(model, data)
    one, other = (data.site(name) for name in ("loop_a", "loop_helper_site"))
    np.testing.assert_allclose(other.xpos, one.xpos, atol=1e-9)
    np.testing.assert_allclose(other.xmat, one.xmat, atol=1e-9)


LIMITED = """<mujoco><worldbody><body><joint name="j" type="slide" range="{}" margin="{}"/><geom size="0.1"/></body>
</worldbody></mujoco>"""


@pytest.mark.parametrize(
    ("limits", "margin", "held"),
    [
        ("-1 3", "0.5", (-0.5, 2.5)),
        ("-1 1", "1", (0.0, 0.0)),
        ("2 3", "0.25", (2.25, 2.75)),
        ("-3 -2", "0", (-3.0, -2.0)),
    ],
)
def test_a_margin_is_taken_from_both_ends(limits, margin, held):
    model = ClosedChain.from_mjcf(LIMITED.format(limits, margin)).model
    assert (model.lowerPositionLimit[0], model.upperPositionLimit[0]) == held


def test_a_margin_beyond_the_middle_leaves_no_range():
    for limits, margin in (("-1 1", "1.0001"), ("2 3", "0.75"), ("-3 -2", "0.75")):
        with pytest.raises(FileFormatError, match="leaves it no range"):
            ClosedChain.from_mjcf(LIMITED.format(limits, margin))


@pytest.mark.parametrize("bodies", [1, 2])
def test_links_and_sites_that_are_no_bodies_are_sites_where_they_are(bodies):
    model = pin.Model()
    place = pin.SE3(Rotation.from_euler("x", 0.3).as_matrix(), np.array([0.1, 0.2, 0.3]))
    for k in range(bodies):
        model.addJoint(0, pin.JointModelRX(), place, f"hinge_{k}")
        model.appendBodyToJoint(k + 1, pin.Inertia(1.0, np.zeros(3), np.eye(3)), pin.SE3.Identity())
        model.addFrame(pin.Frame(f"link_{k}", k + 1, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    model.addFrame(pin.Frame("tip", 1, 0, place, pin.FrameType.OP_FRAME))
    model.addFrame(pin.Frame("table", 0, 0, place, pin.FrameType.BODY))
    model.addFrame(pin.Frame("mark", 0, 0, place * place, pin.FrameType.OP_FRAME))
    chain = ClosedChain(model, Closures("sites"))
    theirs = mujoco.MjModel.from_xml_string(text_of(chain, "mjcf", np.full(bodies, 0.4)))
    assert sorted(theirs.site(k).name for k in range(theirs.nsite)) == ["mark", "table", "tip"]
    # Several bodies on the world are on one that is fixed to it.
    assert theirs.nbody == 2 + (bodies if bodies > 1 else 0)
    data = mujoco.MjData(theirs)
    mujoco.mj_resetDataKeyframe(theirs, data, 0)
    mujoco.mj_kinematics(theirs, data)
    for name in ("tip", "table", "mark"):
        there = chain.placement(np.full(bodies, 0.4), name)
        np.testing.assert_allclose(data.site(name).xpos, there.translation, atol=1e-15)
        np.testing.assert_allclose(data.site(name).xmat.reshape(3, 3), there.rotation, atol=1e-15)
