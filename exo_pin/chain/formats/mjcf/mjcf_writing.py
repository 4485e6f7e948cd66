"""Writing a chain as MJCF: the tree as bodies, the closures as equalities.

=========== ================================================================================================
closure     equality
=========== ================================================================================================
rigid       weld of two sites
spherical   connect of two sites
revolute    two connects, on the axis
distance    the length of a tendon between two sites
coupling    joint equality
universal,  a small body on the body of frame b that moves as the closure allows, welded to frame a. Its mass, a
prismatic,  millionth of the robot's, is the price of a format that has no such equality.
cylindrical
=========== ================================================================================================

MuJoCo's equalities are compliant; they have its default stiffness. Other data of joints than their motion are written
as in :mod:`exo_pin.chain.formats.mjcf.mjcf_joints`; limits of velocity are left out.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin

from ....core.validation import FloatArray
from ...kinematics.loops import residual
from ...structure.chain_state import ChainState
from ...structure.closures import COEFFICIENTS, Closure
from ..bodies import refuse_massless, tree_bodies, world_link
from .mjcf_joints import JoinedBody, as_numbers, joined_bodies, write_joints

__all__ = ["mjcf_text"]

_HELPED = {"universal": ("hinge", "hinge"), "prismatic": ("slide",), "cylindrical": ("slide", "hinge")}
_HELPER_SHARE = 1e-6


def mjcf_text(chain: ChainState, q: FloatArray) -> str:
    """The XML of a chain, with a keyframe "closed" at a closed configuration.

    Parameters
    ----------
    chain : ChainState
        The chain; every body needs mass and inertia, but for those between the hinges and slides of one body.
    q : ndarray
        Shape (nq,), closed.

    Raises
    ------
    InvalidInput
        If a body has no mass, a joint is of a kind that MuJoCo does not have, or has data that MJCF cannot hold.
    """
    bodies = tree_bodies(chain)
    held = {
        int(joint)
        for c, closure in enumerate(chain.closures)
        if closure.polynomial is None
        for joint in chain.topology.joints[c]
    }
    joined = joined_bodies(bodies, held)
    refuse_massless([each.body for each in joined], "MuJoCo")
    model = chain.model
    root = ET.Element("mujoco", model=chain.description.name)
    ET.SubElement(root, "compiler", angle="radian", autolimits="true")
    ET.SubElement(root, "option", gravity=as_numbers(model.gravity.linear))
    world = ET.SubElement(root, "worldbody")
    first = [each.body for each in joined if each.parent == 0]
    if len(first) > 1 and all(body.kind != "free" for body in first):
        # One fixed body on the world, for readers that take no more than one; a free body has to be on the world.
        world = ET.SubElement(world, "body", name=world_link(chain))
    elements, qpos = {0: world}, list[float]()
    by_parent: dict[int, list[JoinedBody]] = {}
    for each in joined:
        by_parent.setdefault(each.parent, []).append(each)
    helpers = _helpers(chain, q)
    _write_children(0, by_parent, elements, chain, q, qpos, helpers)
    equalities, tendons = ET.Element("equality"), ET.Element("tendon")
    for c, closure in enumerate(chain.closures):
        _write_closure(chain, c, closure.name, closure.type, elements, equalities, tendons)
    for part in (tendons, equalities):
        if len(part):
            root.append(part)
    actuators = ET.Element("actuator")
    for name in chain.roles.actuated:
        ET.SubElement(actuators, "motor", name=name, joint=name)
    if len(actuators):
        root.append(actuators)
    key = ET.SubElement(root, "keyframe")
    ET.SubElement(key, "key", name="closed", qpos=as_numbers(qpos))
    ET.indent(root)
    note = f"<!-- {len(joined)} bodies, {len(chain.closures)} closures. Written by exo_pin. -->"
    if any("velocity limits" in body.data.present for body in bodies):
        note += "\n<!-- MJCF has no limits of velocity; those of the joints are left out. -->"
    return f"{note}\n{ET.tostring(root, encoding='unicode')}\n"


def _write_children(
    parent: int,
    by_parent: dict[int, list[JoinedBody]],
    elements: dict[int, ET.Element],
    chain: ChainState,
    q: FloatArray,
    qpos: list[float],
    helpers: dict[int, list[_Helper]],
) -> None:
    """Bodies depth first, as MuJoCo orders its coordinates."""
    for helper in helpers.get(parent, []):
        helper.write(elements[parent], qpos)
    for each in by_parent.get(parent, []):
        body = each.body
        element = ET.SubElement(elements[parent], "body", {"name": body.name, **_pose(each.placement)})
        elements[body.index] = element
        for joint, place in each.before:
            qpos += write_joints(element, joint, q[chain.configuration_slice(joint.joint)], place)
        qpos += write_joints(element, body, q[chain.configuration_slice(body.joint)])
        _inertial(element, body.inertia)
        _write_children(body.index, by_parent, elements, chain, q, qpos, helpers)


def _inertial(element: ET.Element, inertia: pin.Inertia) -> None:
    tensor = inertia.inertia
    six = [tensor[entry] for entry in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    ET.SubElement(
        element, "inertial", pos=as_numbers(inertia.lever), mass=repr(float(inertia.mass)), fullinertia=as_numbers(six)
    )


class _Helper:
    """A small body that moves on frame b of a closure as the closure allows."""

    def __init__(self, chain: ChainState, c: int, name: str, kind: str, q: FloatArray, mass: float) -> None:
        self.name, self.kind, self.mass = f"{name}_helper", kind, mass
        self.inertia = mass * chain.characteristic_length**2
        local = chain.topology.local[c, 1]
        self.place = pin.SE3(local[:3].T.copy(), local[3].copy())
        data = chain.model.createData()
        pin.forwardKinematics(chain.model, data, q)
        poses = []
        for end in (0, 1):
            at = chain.topology.local[c, end]
            poses.append(data.oMi[int(chain.topology.joints[c, end])] * pin.SE3(at[:3].T.copy(), at[3].copy()))
        moved = poses[1].actInv(poses[0])
        R = moved.rotation
        turn, slide = float(np.arctan2(R[1, 0], R[0, 0])), float(moved.translation[2])
        # Ry(α) Rx(β): about frame b's y, then about frame a's x.
        swings = [float(np.arctan2(-R[2, 0], R[0, 0])), float(np.arctan2(-R[1, 2], R[1, 1]))]
        self.values = {"universal": swings, "prismatic": [slide], "cylindrical": [slide, turn]}[kind]

    def write(self, parent: ET.Element, qpos: list[float]) -> None:
        """Add the body, with the site that is welded to frame a."""
        element = ET.SubElement(parent, "body", {"name": self.name, **_pose(self.place)})
        axes = [np.eye(3)[1], np.eye(3)[0]] if self.kind == "universal" else [np.eye(3)[2]] * 2
        for k, kind in enumerate(_HELPED[self.kind]):
            ET.SubElement(element, "joint", name=f"{self.name}_{k}", type=kind, axis=as_numbers(axes[k]))
        ET.SubElement(
            element, "inertial", pos="0 0 0", mass=repr(self.mass), diaginertia=as_numbers([self.inertia] * 3)
        )
        ET.SubElement(element, "site", name=f"{self.name}_site")
        qpos += self.values


def _helpers(chain: ChainState, q: FloatArray) -> dict[int, list[_Helper]]:
    """Helpers by the joint whose body carries them."""
    mass = _HELPER_SHARE * sum(inertia.mass for inertia in chain.model.inertias)
    found: dict[int, list[_Helper]] = {}
    for c, closure in enumerate(chain.closures):
        if closure.type in _HELPED:
            helper = _Helper(chain, c, closure.name, closure.type, q, mass)
            found.setdefault(int(chain.topology.joints[c, 1]), []).append(helper)
    return found


def _write_closure(
    chain: ChainState,
    c: int,
    name: str,
    kind: str,
    elements: dict[int, ET.Element],
    equalities: ET.Element,
    tendons: ET.Element,
) -> None:
    """Sites at the closure's frames, and what joins them; the joints of a coupling."""
    closure, sites = chain.closures[c], []
    if closure.polynomial is not None:
        element = ET.SubElement(equalities, "joint", name=name, joint1=closure.frame_b)
        if closure.frame_a != "universe":
            element.set("joint2", closure.frame_a)
        element.set("polycoef", as_numbers(_from_zero(closure)))
        return
    for end, letter in enumerate("ab"):
        if end == 1 and kind in _HELPED:
            sites.append(f"{name}_helper_site")
            continue
        local = chain.topology.local[c, end]
        place = pin.SE3(local[:3].T.copy(), local[3].copy())
        element = elements[int(chain.topology.joints[c, end])]
        sites.append(f"{name}_{letter}")
        ET.SubElement(element, "site", {"name": sites[-1], **_pose(place)})
        if kind == "revolute":
            along = place * pin.SE3(np.eye(3), np.array([0.0, 0.0, chain.characteristic_length]))
            ET.SubElement(element, "site", {"name": f"{sites[-1]}_2", **_pose(along)})
    if kind == "rigid" or kind in _HELPED:
        ET.SubElement(equalities, "weld", name=name, site1=sites[0], site2=sites[1])
    elif kind in ("spherical", "revolute"):
        ET.SubElement(equalities, "connect", name=name, site1=sites[0], site2=sites[1])
        if kind == "revolute":
            ET.SubElement(equalities, "connect", name=f"{name}_2", site1=f"{sites[0]}_2", site2=f"{sites[1]}_2")
    else:
        tendon = ET.SubElement(tendons, "spatial", name=name)
        for site in sites:
            ET.SubElement(tendon, "site", site=site)
        # The equality counts from the length that the tendon has with all joints at zero.
        rest = float(residual(chain, chain.neutral())[chain.rows(name)][0])
        ET.SubElement(equalities, "tendon", name=name, tendon1=name, polycoef=as_numbers([-rest, 1, 0, 0, 0]))


def _from_zero(closure: Closure) -> FloatArray:
    """A coupling's coefficients, shape (5,), for positions that count from zero, as in the file that is written."""
    shift = np.polynomial.Polynomial([-closure.references[0], 1.0])
    moved = np.polynomial.Polynomial(closure.polynomial or (0.0,))(shift) + closure.references[1]
    return np.pad(moved.coef, (0, COEFFICIENTS - len(moved.coef)))


def _pose(place: pin.SE3) -> dict[str, str]:
    x, y, z, w = pin.Quaternion(place.rotation).normalized().coeffs()
    return {"pos": as_numbers(place.translation), "quat": as_numbers([w, x, y, z])}
