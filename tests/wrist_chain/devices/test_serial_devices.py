"""Serial devices: angles of the joints are the arm's clinical angles, moments are those of hand statics."""

import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin
import pytest
from device_files import loaded
from places import URDF
from published_devices.serial_devices import NESM_LINKS
from scipy.spatial.transform import Rotation

ANGLES = [(30.0, 0.0, 0.0), (0.0, 70.0, 0.0), (25.0, 40.0, 35.0), (80.0, 15.0, -20.0)]
#: The body's axes: y left, x forward; a positive angle of each joint turns the outer links about this.
AXES = {"flexion": [0.0, -1.0, 0.0], "abduction": [1.0, 0.0, 0.0], "internal_rotation": [0.0, 0.0, -1.0]}
ORDERS = {
    "serial-y-x-z": ("flexion", "abduction", "internal_rotation"),
    "nesm": ("abduction", "flexion", "internal_rotation"),
}
#: Links that each joint of the series carries besides those beyond it.
CARRIED = (("link_1",), ("link_2",), ("cuff", "arm"))


def turns(name, angles):
    """Rotation of the links after each joint of the series, the torso first."""
    given = dict(zip(ORDERS["serial-y-x-z"], np.radians(angles), strict=True))
    found = [Rotation.identity()]
    for joint in ORDERS[name]:
        found.append(found[-1] * Rotation.from_rotvec(given[joint] * np.array(AXES[joint])))
    return found


def configuration(chain, name, angles):
    q = chain.neutral()
    q[chain.configuration_slice("root_joint")] = turns(name, angles)[-1].as_quat()
    for joint, angle in zip(ORDERS["serial-y-x-z"], np.radians(angles), strict=True):
        q[chain.configuration_slice(joint)] = angle
    return q


def masses(name):
    """Mass and centre of every link as the file has them with the arm hanging; all links have their origin at O."""
    found = {}
    for link in ET.parse(URDF / f"{name}.urdf").findall("link"):
        inertial = link.find("inertial")
        if inertial is None:
            continue
        centre = [float(x) for x in inertial.find("origin").get("xyz").split()]
        found[link.get("name")] = float(inertial.find("mass").get("value")), np.array(centre)
    return found


@pytest.mark.parametrize("angles", ANGLES)
@pytest.mark.parametrize("name", ORDERS)
def test_moments_are_those_of_hand_statics(name, angles):
    chain = loaded(name)
    forces = chain.inverse_dynamics(configuration(chain, name, angles))
    links, poses = masses(name), turns(name, angles)
    for place, joint in enumerate(ORDERS[name]):
        axis = poses[place].apply(AXES[joint])
        moment = np.zeros(3)
        for beyond in range(place, 3):
            for link in CARRIED[beyond]:
                mass, centre = links[link]
                moment += np.cross(poses[beyond + 1].apply(centre), [0.0, 0.0, -9.81 * mass])
        # The motor makes up for what the weight turns.
        assert forces.effort(joint)[0] == pytest.approx(-axis @ moment, abs=1e-9)
        assert forces.effort_is_unique[chain.velocity_slice(joint)].all()


@pytest.mark.parametrize("name", ORDERS)
def test_the_masses_are_the_published_ones_outside_of_their_motors(name):
    links = masses(name)
    assert [links[link][0] for link in ("link_1", "link_2", "cuff")] == [6.712, 3.487, 1.663]
    first, second = (np.array(AXES[joint]) for joint in ORDERS[name][:2])
    # The first link's centre is 128 mm outside along its own axis and 130 mm towards the second motor.
    assert abs(links["link_1"][1] @ first) == pytest.approx(0.1279)
    assert abs(links["link_1"][1] @ second) == pytest.approx(0.1301)
    assert links["link_1"][1] @ [-1.0, 1.0, 0.0] == pytest.approx(0.1279 + 0.1301)  # behind and beside a left shoulder
    assert links["link_2"][1][2] == pytest.approx(-0.1051)
    assert links["cuff"][1][2] == pytest.approx(-0.3087 + 0.03)


#: Placements of NESM's joints as dojo-sim/Dojo.jl has them (m; roll, pitch, yaw, rad), each about its own z. At zero
#: the right arm is forward.
NESM = (
    ((0.0, 0.0, 0.0), (np.pi / 2, 0.0, np.pi / 2)),
    ((0.0, 0.0, 0.0), (np.pi / 2, 0.0, 0.0)),
    ((0.0, 0.3087, 0.0), (-np.pi / 2, 0.0, 0.0)),
)


def published_nesm():
    """Its first three links on the torso."""
    model, joint = pin.Model(), 0
    for (place, angles), (mass, centre, (xx, xy, xz, yy, yz, zz)) in zip(NESM, NESM_LINKS, strict=True):
        joint = model.addJoint(joint, pin.JointModelRZ(), pin.SE3(pin.rpy.rpyToMatrix(*angles), np.array(place)), "j")
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        model.appendBodyToJoint(joint, pin.Inertia(mass, np.array(centre), tensor), pin.SE3.Identity())
    return model


def own_nesm():
    """The same links as the file has them, on the torso."""
    model, joint = pin.Model(), 0
    links = {link.get("name"): link.find("inertial") for link in ET.parse(URDF / "nesm.urdf").findall("link")}
    for name, link in zip(ORDERS["nesm"], ("link_1", "link_2", "cuff"), strict=True):
        kind = pin.JointModelRevoluteUnaligned(np.array(AXES[name]))
        joint = model.addJoint(joint, kind, pin.SE3.Identity(), name)
        entry = {key: float(value) for key, value in links[link].find("inertia").attrib.items()}
        rows = [[entry["i" + "".join(sorted(a + b))] for b in "xyz"] for a in "xyz"]
        mass, centre = masses("nesm")[link]
        model.appendBodyToJoint(joint, pin.Inertia(mass, centre, np.array(rows)), pin.SE3.Identity())
    return model


@pytest.mark.parametrize("angles", ANGLES)
def test_nesm_moves_its_links_as_the_published_robot_does(angles):
    flexion, abduction, internal = np.radians(angles)
    theirs, ours = published_nesm(), own_nesm()
    # Hanging is 90° of its first two joints, and the third one turns a right arm outwards: all senses are opposite.
    there = np.array([np.pi / 2 - abduction, np.pi / 2 - flexion, -internal])
    here = np.array([abduction, flexion, internal])
    weights = [pin.computeGeneralizedGravity(m, m.createData(), q) for m, q in ((theirs, there), (ours, here))]
    np.testing.assert_allclose(weights[1], -weights[0], atol=1e-9)
    inertias = [np.triu(pin.crba(m, m.createData(), q)) for m, q in ((theirs, there), (ours, here))]
    np.testing.assert_allclose(inertias[1], inertias[0], atol=1e-9)
