"""Writing a chain as MJCF: the tree as bodies, the closures as equalities.

======= ====================================================================================================
form    equality
======= ====================================================================================================
weld    weld of two sites
connect connect of two sites
hinge   two connects, on the axis
tendon  the length of a tendon between two sites
joint   joint equality
body    a part of the body of frame a (of frame b, if a is on the world), welded to the rest of it, which moves on the
        other body as the closure allows. Parts of a body have equal shares of its inertia: a small share would spoil
        the scaling of MuJoCo's equations.
======= ====================================================================================================

MuJoCo needs mass and moments of inertia everywhere. A massless body at the end of a joint, which a rigid closure welds
to another, gets a millionth of that one's; a body with mass and without moments, its mass times a millionth of the
square of the robot's characteristic length.

MuJoCo's equalities, friction and limits of joints are compliant. They are written as stiff as its time step allows, and
hold better with a shorter one: MuJoCo makes the time constant of ``solref`` at least two steps. Whatever the step, they
give way by a ten-thousandth of their own scale (its impedance is at most 0.9999). Near a singular configuration loops
hold some motion by less than that; such a file says so, and what helps. Other data of joints
than their motion are written as in :mod:`exo_pin.chain.formats.mjcf.mjcf_joints`; limits of velocity are left out. An
actuated joint has a motor. The control of a limb's slide (:class:`LimbRole`) is the limb's tension, positive where it
pulls, within the limits of the slide's effort; that of any other joint is the effort itself.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections import Counter

import numpy as np
import pinocchio as pin

from ....core.errors import InvalidInput
from ....core.validation import FloatArray
from ...kinematics.loops import residual, scaled_jacobian
from ...structure.chain_state import ChainState
from ...structure.closures import COEFFICIENTS, Closure
from ...structure.description import Cable
from ...structure.projection import LINEAR
from ..bodies import (
    LINKS_AND_SITES,
    JoinedBody,
    TreeBody,
    free_name,
    joined_bodies,
    loose_ends,
    tree_bodies,
    welded_to_arm,
    without,
    world_link,
)
from ..joint_data import NO_LIMIT
from ..xml_elements import as_numbers
from .mjcf_joints import pose_of, write_inertial, write_joints
from .mjcf_shapes import ShapeWriter

#: Joints of a helper that let it turn, by the rule of the closure's rows in radians: kind and axis.
_TURNS = {"": (("ball", "z"),), "xy": (("hinge", "z"),), "cross": (("hinge", "y"), ("hinge", "x")), "xyz": ()}
#: Forms of closures by the rules of their types, see the module.
FORMS = {(linear, angular): "body" for linear in LINEAR if linear != "length" for angular in _TURNS} | {
    ("xyz", "xyz"): "weld",
    ("xyz", ""): "connect",
    ("xyz", "xy"): "hinge",
    ("length", ""): "tendon",
    ("", "joints"): "joint",
}
_AXES = dict(zip("xyz", np.eye(3), strict=True))
#: The least time constant, s, which MuJoCo lengthens to two of its steps, and its largest impedance. Critically damped
#: limits throw a joint back at any stiffness.
_HEAD = """<mujoco><compiler angle="radian" autolimits="true"/><default>
<equality solref="0.0001 1" solimp="0.9999 0.9999 0.001 0.5 2"/><joint solreffriction="0.0001 1"
solimpfriction="0.9999 0.9999 0.001 0.5 2" solreflimit="0.0001 20" solimplimit="0.9999 0.9999 0.001 0.5 2"/>
</default></mujoco>"""
_HELPER_SHARE = 1e-6
#: Least over greatest inertia of a motion.
_MASSLESS = 1e-14
#: What MuJoCo's equalities give way by, and how much more the loops have to hold each motion by.
_COMPLIANCE, _STIFFER = 1e-4, 10.0


def mjcf_document(chain: ChainState, q: FloatArray) -> tuple[str, tuple[str, ...]]:
    """The XML of a chain with a keyframe "closed", and the joints of bodies that only stand for closures.

    Parameters
    ----------
    chain : ChainState
        The chain; every body needs mass, but for those between the hinges and slides of one body and welded ends.
    q : ndarray
        Shape (nq,), closed.

    Raises
    ------
    InvalidInput
        If a body has no mass, a joint or closure is of a kind that MuJoCo does not have, or has data that MJCF cannot
        hold.
    """
    bodies = tree_bodies(chain)
    joined = joined_bodies(bodies, set(chain.topology.joints.ravel().tolist()))
    ends = loose_ends(chain, bodies)
    light = [each.body.name for each in joined if each.body.index not in ends and each.body.inertia.mass <= 0.0]
    if light:
        raise InvalidInput(
            f"MuJoCo needs mass for every body; {', '.join(light)} {'has' if len(light) == 1 else 'have'} "
            "none: give them some, or join them to their neighbours"
        )
    root = ET.fromstring(_HEAD)
    root.set("model", chain.description.name)
    option = ET.SubElement(root, "option", gravity=as_numbers(chain.model.gravity.linear))
    world = ET.SubElement(root, "worldbody")
    first = [each.body for each in joined if each.parent == 0]
    if len(first) > 1 and all(body.kind != "free" for body in first):
        # One fixed body on the world, for readers that take no more than one; a free body has to be on the world.
        world = ET.SubElement(world, "body", name=_allowed(world_link(chain), {each.body.name for each in joined}))
    writer = _Writer(chain, q, joined, world, {index: other for index, (_, other) in ends.items()})
    writer.add_bodies(0)
    writer.add_frames({each.body.name for each in joined} | {part.name for part in writer.welded})
    if writer.shapes.touches:
        ET.SubElement(option, "flag", contact="disable")
    for c, closure in enumerate(chain.closures):
        writer.add_closure(c, closure)
    actuators = ET.Element("actuator")
    if chain.roles.limbs or chain.description.cables:
        actuators.append(ET.Comment(" Controls of limbs' and cables' motors are tensions, N: positive pulls. "))
    # MuJoCo holds every control within its range: a limb that only pulls has none below zero, and zero leaves it free.
    pulls = {body.joint: -body.data.effort[0, ::-1] for body in bodies if body.is_limb}
    tensions = {joint: _pull(min(least, 0.0), greatest) for joint, (least, greatest) in pulls.items()}
    for name in chain.roles.actuated:
        ET.SubElement(actuators, "motor", {"name": name, "joint": name, **tensions.get(name, {})})
    for cable in chain.description.cables:
        writer.add_cable(cable, actuators)
    root.extend(part for part in (writer.shapes.meshes, writer.tendons, writer.equalities, actuators) if len(part))
    key = ET.SubElement(root, "keyframe")
    ET.SubElement(key, "key", name="closed", qpos=as_numbers(writer.qpos))
    ET.indent(root)
    note = f"<!-- {len(joined)} bodies, {len(chain.closures)} closures. Written by exo_pin. -->"
    if any("velocity limits" in body.data.present for body in bodies):
        note += "\n<!-- MJCF has no limits of velocity; those of the joints are left out. -->"
    if writer.heavier:
        named = ", ".join(dict.fromkeys(writer.heavier))
        note += f"\n<!-- MuJoCo needs inertia everywhere; a millionth was added to {named}. -->"
    held = _least_held(chain, q)
    if held < _STIFFER * _COMPLIANCE:
        note += (
            f"\n<!-- MuJoCo's equalities give way by {_COMPLIANCE:g} of their scale, and near a singular configuration "
            f"these loops hold a motion by {held:.1g} of it: it moves otherwise there. Write another configuration, or "
            "set model.body_invweight0 *= 1e-4 once the file is loaded. -->"
        )
    if writer.shapes.touches:
        note += "\n<!-- A chain has no contact: take the flag away to let shapes touch. -->"
    if writer.shapes.left_out:
        lost = ", ".join(dict.fromkeys(writer.shapes.left_out)).replace("--", "- -")
        note += f"\n<!-- Meshes that are not there, or that MuJoCo does not read: {lost}. -->"
    return f"{note}\n{ET.tostring(root, encoding='unicode')}\n", tuple(writer.helper_joints)


def parts_of(chain: ChainState) -> dict[int, int]:
    """Of closures that MJCF has no equality for, the end, 0 or 1, of whose body a part stands for the closure."""
    forms = [closure.form_in(FORMS, "MJCF has no equality") for closure in chain.closures]
    return {c: int(chain.topology.joints[c, 0] == 0) for c, form in enumerate(forms) if form == "body"}


class _Writer:
    """Writer of the bodies and closures of a file."""

    def __init__(
        self, chain: ChainState, q: FloatArray, joined: list[JoinedBody], world: ET.Element, ends: dict[int, int]
    ) -> None:
        self._chain, self._q, self._joined, self._data = chain, q, joined, chain.model.createData()
        self._ends, self.heavier, self.welded = ends, list[str](), welded_to_arm(chain)
        pin.forwardKinematics(chain.model, self._data, q)
        self._elements = {0: world}
        self._parts = parts_of(chain)
        self._shares = Counter(int(chain.topology.joints[c, end]) for c, end in self._parts.items())
        self._taken = {*(closure.name for closure in chain.closures), *chain.model.names}
        self._taken |= {each.body.name for each in joined}
        self._helper_sites: dict[str, str] = {}
        self.helper_joints: list[str] = []
        self.qpos: list[float] = []
        self.tendons, self.equalities = ET.Element("tendon"), ET.Element("equality")
        self.shapes = ShapeWriter(chain)
        self.shapes.add(world, 0)

    def _free_name(self, closure: Closure, part: str) -> str:
        """A name for a part of a closure: its own name and the part, or one like it if that is taken."""
        return free_name(f"{closure.name}_{part}", self._taken)

    def add_bodies(self, parent: int) -> None:
        """Add the bodies that a body carries, depth first, as MuJoCo orders its coordinates."""
        chain = self._chain
        for c, end in self._parts.items():
            if chain.topology.joints[c, 1 - end] == parent:
                self._add_helper(c, chain.closures[c], end)
        for each in self._joined:
            if each.parent != parent:
                continue
            body = each.body
            name = _allowed(body.name, self._taken)
            element = ET.SubElement(self._elements[parent], "body", {"name": name, **pose_of(each.placement)})
            self._elements[body.index] = element
            for joint, place in each.before:
                self.qpos += write_joints(element, joint, self._q[chain.configuration_slice(joint.joint)], place)
            self.qpos += write_joints(element, body, self._q[chain.configuration_slice(body.joint)])
            write_inertial(element, body.name, self._share(body))
            for part in (part for part in self.welded if part.on == body.index):
                place = {"name": _allowed(part.name, self._taken), **pose_of(part.placement)}
                write_inertial(ET.SubElement(element, "body", place), part.name, part.inertia)
            self.shapes.add(element, body.index)
            self.add_bodies(body.index)

    def add_frames(self, bodies: set[str]) -> None:
        """Add a site for every link and site of the chain that is no body here."""
        for frame in self._chain.model.frames:
            on = self._elements.get(int(frame.parentJoint)) if frame.type in LINKS_AND_SITES else None
            if on is not None and frame.name not in bodies:
                ET.SubElement(on, "site", {"name": free_name(frame.name, self._taken), **pose_of(frame.placement)})

    def _inertia(self, body: TreeBody) -> pin.Inertia:
        """A body's inertia, with what MuJoCo cannot do without; such bodies are listed in ``heavier``."""
        inertia = own = without(body.inertia, body.index, self.welded)
        if body.index in self._ends:
            other = self._ends[body.index]
            whole, here = self._chain.model.inertias[other], self._data.oMi[body.index]
            share = pin.Inertia(whole.mass * _HELPER_SHARE, whole.lever, whole.inertia * _HELPER_SHARE)
            inertia = here.actInv(self._data.oMi[other]).act(share)
        least = float(np.linalg.eigvalsh(inertia.inertia)[0])
        if least <= 0.0:
            more = inertia.mass * _HELPER_SHARE * self._chain.characteristic_length**2
            if least < -more:
                raise InvalidInput(
                    f"no body has a negative principal moment of inertia; {body.name} has {least:.6g} kg m²: "
                    "mend its inertia"
                )
            inertia = pin.Inertia(inertia.mass, inertia.lever, inertia.inertia + more * np.eye(3))
        if inertia is not own:
            self.heavier.append(body.name)
        return inertia

    def _share(self, body: TreeBody) -> pin.Inertia:
        """A body's inertia, or that of each of the parts that it is written as, by their number."""
        whole, parts = self._inertia(body), 1 + self._shares[body.index]
        return pin.Inertia(whole.mass / parts, whole.lever, whole.inertia / parts)

    def _add_helper(self, c: int, closure: Closure, end: int) -> None:
        """A part of the body of one end that moves on the other end's as the closure allows, with the site of its weld.

        From frame b it turns first, and then slides along the axes of frame a; from frame a it is the other way round.
        """
        topology, name = self._chain.topology, self._free_name(closure, "helper")
        joints = topology.joints[c].tolist()
        a, b = (self._data.oMi[joints[k]] * topology.frame(c, k) for k in (0, 1))
        moved = b.actInv(a)
        R, apart = moved.rotation, moved.rotation.T @ moved.translation
        x, y, z, w = pin.Quaternion(R).normalized().coeffs()
        # Ry(α) Rx(β): about frame b's y, then about frame a's x.
        angles = {"y": np.arctan2(-R[2, 0], R[0, 0]), "x": np.arctan2(-R[1, 2], R[1, 1])}
        angles["z"] = np.arctan2(R[1, 0], R[0, 0])
        moves = [
            (kind, axis, [x, y, z] if kind == "ball" else [angles[axis]]) for kind, axis in _TURNS[closure.kind.angular]
        ]
        moves += [("slide", axis, [apart["xyz".index(axis)]]) for axis in "xyz" if axis not in closure.kind.linear]
        forward = end == 0
        base = self._elements[joints[1 - end]]
        element = ET.SubElement(base, "body", {"name": name, **pose_of(topology.frame(c, 1 - end))})
        for k, (kind, axis, values) in enumerate(moves if forward else reversed(moves)):
            joint = self._free_name(closure, f"helper_{k}")
            self.helper_joints.append(joint)
            ET.SubElement(element, "joint", name=joint, type=kind, axis=as_numbers(_AXES[axis]))
            self.qpos += [w] if kind == "ball" else []
            self.qpos += [float(value if forward else -value) for value in values]
        body = next(each.body for each in self._joined if each.body.index == joints[end])
        write_inertial(element, name, topology.frame(c, end).actInv(self._share(body)))
        self._helper_sites[closure.name] = self._free_name(closure, "helper_site")
        ET.SubElement(element, "site", name=self._helper_sites[closure.name])

    def add_closure(self, c: int, closure: Closure) -> None:
        """Add sites at the closure's frames and the equalities between them, or the equality of a coupling's joints."""
        chain, name, form = self._chain, closure.name, closure.form_in(FORMS, "MJCF has no equality")
        if form == "joint":
            element = ET.SubElement(self.equalities, "joint", name=name, joint1=closure.frame_b)
            if closure.frame_a != "universe":
                element.set("joint2", closure.frame_a)
            element.set("polycoef", as_numbers(_from_zero(closure)))
            return
        sites = [self._add_site(c, closure, end) for end in ((self._parts[c],) if form == "body" else (0, 1))]
        sites += [self._helper_sites[name]] if form == "body" else []
        if form == "tendon":
            tendon = ET.SubElement(self.tendons, "spatial", name=name)
            for site in sites:
                ET.SubElement(tendon, "site", site=site)
            # The equality counts from the length that the tendon has with all joints at zero.
            rest = float(residual(chain, chain.neutral())[chain.rows(name)][0])
            ET.SubElement(self.equalities, "tendon", name=name, tendon1=name, polycoef=as_numbers(-rest))
            return
        equality = "weld" if form in ("weld", "body") else "connect"
        ET.SubElement(self.equalities, equality, name=name, site1=sites[0], site2=sites[1])
        if form == "hinge":
            along = pin.SE3(np.eye(3), np.array([0.0, 0.0, chain.characteristic_length]))
            one, other = (self._add_site(c, closure, end, along, "_2") for end in (0, 1))
            ET.SubElement(self.equalities, "connect", name=self._free_name(closure, "2"), site1=one, site2=other)

    def _add_site(self, c: int, closure: Closure, end: int, off: pin.SE3 | None = None, more: str = "") -> str:
        """Add a site at a closure's frame, or off it, and return its name."""
        place, element = self._chain.topology.frame(c, end), self._elements[int(self._chain.topology.joints[c, end])]
        name = self._free_name(closure, "ab"[end] + more)
        ET.SubElement(element, "site", {"name": name, **pose_of(place if off is None else place * off)})
        return name

    def add_cable(self, cable: Cable, actuators: ET.Element) -> None:
        """Add a cable as a tendon over sites, with its spring, and a motor whose control is the tension.

        A spring in a joint is a tendon of that joint, and one of constant force an actuator with a bias and no gain.
        """
        name = free_name(cable.name, self._taken)
        tendon = ET.SubElement(self.tendons, "spatial" if cable.joint is None else "fixed", name=name)
        if cable.joint is not None:
            ET.SubElement(tendon, "joint", joint=cable.joint, coef="1")
        if cable.stiffness:
            low = 0.0 if cable.only_pulls else cable.slack
            tendon.set("stiffness", as_numbers(cable.stiffness))
            tendon.set("springlength", as_numbers([low, cable.slack]))
        for k, (link, point) in enumerate(cable.points):
            frame, site = self._chain.model.frames[self._chain.frame_index(link)], free_name(f"{name}_{k}", self._taken)
            at = as_numbers(frame.placement.act(np.array(point)))
            ET.SubElement(self._elements[int(frame.parentJoint)], "site", name=site, pos=at)
            ET.SubElement(tendon, "site", site=site)
        if cable.constant:
            force = {"gainprm": "0", "biastype": "affine", "biasprm": as_numbers([-cable.constant, 0.0, 0.0])}
            ET.SubElement(actuators, "general", {"name": name, "tendon": name} | force)
        if cable.tension is not None:
            pull = _pull(*np.clip(cable.tension, 0.0, np.inf))
            ET.SubElement(actuators, "motor", {"name": name, "tendon": name} | pull)


def _least_held(chain: ChainState, q: FloatArray) -> float:
    """By which share of the rows' own scale the loops hold the motion that they hold least; 1 of massless motions.

    It is the smallest eigenvalue of J M⁻¹ Jᵀ, with ones on its diagonal, that is not of a redundant row.
    """
    J, zero = scaled_jacobian(chain, q)
    M = pin.crba(chain.model, chain.model.createData(), q)
    M = (np.triu(M) + np.triu(M, 1).T) * chain.topology.column[:, None] * chain.topology.column
    rank = int(np.count_nonzero(np.linalg.svd(J, compute_uv=False) > zero))
    if not rank or np.linalg.cond(M) > 1.0 / _MASSLESS:
        return 1.0
    A = J @ np.linalg.solve(M, J.T)
    size = np.sqrt(np.diag(A))
    size[size == 0.0] = 1.0
    return float(np.linalg.eigvalsh(A / size[:, None] / size)[-rank])


def _allowed(name: str, taken: set[str]) -> str:
    """A body's name in MJCF, where "world" is the world's."""
    return free_name("world_link", taken) if name == "world" else name


def _pull(least: float, greatest: float) -> dict[str, str]:
    """Of a motor whose control is a tension, N: sign, and range if there is one."""
    has_range = least < greatest and np.isfinite([least, greatest]).any()
    limits = np.clip([least, greatest], -NO_LIMIT, NO_LIMIT)
    return {"gear": "-1"} | ({"ctrlrange": as_numbers(limits)} if has_range else {})


def _from_zero(closure: Closure) -> FloatArray:
    """A coupling's coefficients, shape (5,), for positions that count from zero, as in the file that is written."""
    assert closure.polynomial is not None
    shift = np.polynomial.Polynomial([-closure.references[0], 1.0])
    moved = np.polynomial.Polynomial(closure.polynomial)(shift) + closure.references[1]
    return np.pad(moved.coef, (0, COEFFICIENTS - len(moved.coef)))
