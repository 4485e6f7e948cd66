"""Links that are welded to the arm's: their mass stays theirs, through a file of each kind."""

import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin
import pytest
from written_robots import urdf_of

from exo_pin.chain import ClosedChain, Closures, Roles

LINK = """<link name="{0}"><inertial><origin xyz="{2}" rpy="0.3 -0.2 0.5"/><mass value="{1}"/>
<inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
JOINT = """<joint name="{0}" type="{1}"><parent link="{2}"/><child link="{3}"/><origin xyz="{4}" rpy="{5}"/>
<axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>"""


def chain_of(arm="arm", masses=None):
    """Upper arm, forearm on it by a hinge; a cuff with mass and a mark without are welded to the upper arm."""
    masses = {"trunk": 0.0, "arm": 2.0, "forearm": 1.0, "cuff": 0.3, "mark": 0.0} | (masses or {})
    links = [
        LINK.format(name, mass, f"0.{k} -0.1 0.2") if mass else f'<link name="{name}"/>'
        for k, (name, mass) in enumerate(masses.items())
    ]
    joints = [
        JOINT.format("shoulder", "revolute", "trunk", "arm", "0 0 0", "0 0 0"),
        JOINT.format("elbow", "revolute", "arm", "forearm", "0 0 -0.3", "0 0 0"),
        JOINT.format("cuff_weld", "fixed", "arm", "cuff", "0.1 -0.05 -0.2", "0.4 0.1 -0.7"),
        JOINT.format("mark_weld", "fixed", "arm", "mark", "0 0.1 -0.1", "0 0 0.5"),
    ]
    roles = Roles(arm=arm) if arm else Roles()
    return ClosedChain.from_urdf(f'<robot name="arms">{"".join(links + joints)}</robot>', Closures("arms", roles=roles))


def masses_in_file(chain):
    links = ET.fromstring(urdf_of(chain)[0]).iter("link")
    return {link.get("name"): float(mass.get("value")) for link in links for mass in link.iter("mass")}


@pytest.mark.parametrize(
    ("arm", "masses", "expected"),
    [
        ("arm", {}, {"arm": 2.0, "forearm": 1.0, "cuff": 0.3}),
        ("arm", {"mark": 0.2}, {"arm": 2.0, "forearm": 1.0, "cuff": 0.3, "mark": 0.2}),
        ("arm", {"arm": 1e-3}, {"arm": 1e-3, "forearm": 1.0, "cuff": 0.3}),
        # Then there is no wearer's arm to tell the device's link from.
        ("arm", {"arm": 0.0}, {"arm": 0.3, "forearm": 1.0}),
        (None, {}, {"arm": 2.3, "forearm": 1.0}), ("forearm", {}, {"arm": 2.3, "forearm": 1.0}),
        ("trunk", {}, {"arm": 2.3, "forearm": 1.0}),
    ],
)  # fmt: skip
def test_what_is_welded_to_the_arm_keeps_its_mass(arm, masses, expected):
    found = masses_in_file(chain_of(arm, masses))
    assert {name: mass for name, mass in found.items() if mass} == pytest.approx(expected)


@pytest.mark.parametrize("kind", ["urdf", "mjcf", "sdf"])
def test_a_file_keeps_the_mass_of_the_link_apart(kind, tmp_path):
    chain = chain_of()
    again = getattr(ClosedChain, f"from_{kind}")(getattr(chain, f"to_{kind}")(tmp_path))
    q = np.array([0.3, -0.8])
    masses = [pin.crba(one.model, one.model.createData(), q) for one in (chain, again)]
    np.testing.assert_allclose(masses[1], masses[0], rtol=1e-9)
    if kind == "urdf":
        assert masses_in_file(again)["cuff"] == pytest.approx(0.3)
        places = [one.placement(q, "cuff").homogeneous for one in (chain, again)]
        np.testing.assert_allclose(*places, atol=1e-9)
