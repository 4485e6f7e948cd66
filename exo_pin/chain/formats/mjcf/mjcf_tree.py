"""The tree of a compiled MuJoCo model as a Pinocchio model.

MuJoCo moves a body from its place at its parent by its joints, one after the other: a hinge or a ball turns it about
the point ``jnt_pos``, a slide shifts it, all in the body's own axes and counted from ``qpos0``. Here every joint is a
Pinocchio joint at ``jnt_pos`` with axes parallel to the body's at ``qpos0``; bodies between the joints of one MuJoCo
body have no mass. So hinges and slides have MuJoCo's coordinates.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin

from ....core.validation import FloatArray
from ...structure.description import JointProperties
from ...structure.motion_axes import q_slice, v_slice
from ..bodies import add_frame, add_joint, axis_joint, free_name
from .mjcf_compiling import Compiled


@dataclass(frozen=True, eq=False)
class MjcfTree:
    """A Pinocchio model and where MuJoCo's objects are in it.

    Attributes
    ----------
    model : pinocchio.Model
        The tree.
    joints : list of int
        For every joint of MuJoCo its index in the model.
    carriers : dict of int to (int, pinocchio.SE3)
        For every body of MuJoCo the joint that carries it, and the body's frame in the joint's.
    frames : dict of int to str
        For every body of MuJoCo its frame.
    properties : tuple of JointProperties
        The joints' springs.
    inertias : dict of int to pinocchio.Inertia
        Of every body of MuJoCo that moves, in its own frame.
    """

    model: pin.Model
    joints: list[int] = field(default_factory=list)
    carriers: dict[int, tuple[int, pin.SE3]] = field(default_factory=dict)
    frames: dict[int, str] = field(default_factory=dict)
    properties: tuple[JointProperties, ...] = ()
    inertias: dict[int, pin.Inertia] = field(default_factory=dict)


def build_tree(source: Compiled) -> MjcfTree:
    """Build joints, bodies, frames, inertias, limits, friction, damping and springs."""
    theirs = source.model
    model = pin.Model()
    model.name = theirs.names[: theirs.names.index(b"\0")].decode(errors="replace") or "unnamed"
    model.gravity.linear = np.zeros(3) if source.disabled("GRAVITY") else theirs.opt.gravity.copy()
    tree = MjcfTree(model, [0] * theirs.njnt, {0: (0, pin.SE3.Identity())}, {0: "universe"})
    names = _joint_names(source)
    # MuJoCo numbers bodies depth first, the order that Pinocchio's mass matrix needs.
    for body in range(1, theirs.nbody):
        _add_body(source, tree, body, names)
    _add_frames(source, tree)
    _fill_coordinates(source, tree)
    return MjcfTree(model, tree.joints, tree.carriers, tree.frames, _springs(source, tree))


def addresses(source: Compiled, tree: MjcfTree) -> np.ndarray:
    """Where the coordinates q are in MuJoCo's qpos, shape (nq,), int: there the scalar of a quaternion comes first."""
    found = np.zeros(tree.model.nq, dtype=np.int64)
    orders = {4: [1, 2, 3, 0], 7: [0, 1, 2, 4, 5, 6, 3]}
    for joint, index in enumerate(tree.joints):
        order = np.array(orders.get(tree.model.nqs[index], [0]))
        found[q_slice(tree.model, index)] = source.model.jnt_qposadr[joint] + order
    return found


def _own_configuration(source: Compiled, tree: MjcfTree, qpos: FloatArray) -> FloatArray:
    """MuJoCo's qpos as q: the same numbers, joint by joint, with quaternions (x, y, z, w)."""
    return np.asarray(pin.normalize(tree.model, qpos[addresses(source, tree)]))


def _joint_names(source: Compiled) -> list[str]:
    """MuJoCo's names; joints without one are called after their number, and none is called "universe"."""
    given = [source.name("JOINT", joint) for joint in range(source.model.njnt)]
    taken = {"universe", *given}
    names = []
    for joint, name in enumerate(given):
        if not name or name == "universe":
            name = free_name("universe_joint" if name else f"joint_{joint}", taken)
        names.append(name)
    return names


def _add_body(source: Compiled, tree: MjcfTree, body: int, names: list[str]) -> None:
    """The joints of one body of MuJoCo and its mass."""
    theirs, model = source.model, tree.model
    carrier, place = tree.carriers[int(theirs.body_parentid[body])]
    place = place * pose(theirs.body_pos[body], theirs.body_quat[body])
    first = int(theirs.body_jntadr[body])
    for joint in range(first, first + int(theirs.body_jntnum[body])):
        kind, moving, zero = _joint(source, joint)
        point = pin.SE3(np.eye(3), theirs.jnt_pos[joint].copy())
        if kind == "free":
            place = point = pin.SE3.Identity()
        carrier = add_joint(model, carrier, moving, place * point * zero, names[joint])
        tree.joints[joint] = carrier
        place = point.inverse()
    tree.carriers[body] = (carrier, place)
    if carrier:
        # In principal axes the inertia is exactly positive, as Pinocchio needs it.
        principal = pin.Inertia(float(theirs.body_mass[body]), np.zeros(3), np.diag(theirs.body_inertia[body]))
        centre = pose(theirs.body_ipos[body], theirs.body_iquat[body])
        # MuJoCo's own rounding: an inertial frame this near the body's is the body's.
        same = source.kind("mjtSameFrame", theirs.body_sameframe[body])
        if same in ("body", "bodyrot"):
            centre = pin.SE3(np.eye(3), np.zeros(3) if same == "body" else centre.translation)
        model.appendBodyToJoint(carrier, principal, place * centre)
        tree.inertias[body] = centre.act(principal)


def pose(position: FloatArray, quaternion: FloatArray) -> pin.SE3:
    """A placement from a position and a quaternion with its scalar first."""
    w, x, y, z = quaternion
    return pin.SE3(pin.Quaternion(w, x, y, z).normalized(), np.array(position))


def _joint(source: Compiled, joint: int) -> tuple[str, pin.JointModel, pin.SE3]:
    """Kind and model of a joint, and its placement at q = 0, from that at qpos0."""
    theirs = source.model
    kind, axis = source.kind("mjtJoint", theirs.jnt_type[joint]), theirs.jnt_axis[joint].copy()
    if kind in ("free", "ball"):
        return kind, pin.JointModelFreeFlyer() if kind == "free" else pin.JointModelSpherical(), pin.SE3.Identity()
    start = float(theirs.qpos0[theirs.jnt_qposadr[joint]])
    if kind == "slide":
        return kind, axis_joint(True, axis), pin.SE3(np.eye(3), -start * axis)
    return kind, axis_joint(False, axis), pin.SE3(pin.AngleAxis(-start, axis).toRotationMatrix(), np.zeros(3))


def _add_frames(source: Compiled, tree: MjcfTree) -> None:
    """Frames of bodies and named sites; a name that another frame has already gets "_body" or "_site"."""
    theirs, model = source.model, tree.model
    there = {frame.name: (frame.parentJoint, frame.placement) for frame in model.frames}
    bodies = {body: source.name("BODY", body) for body in range(1, theirs.nbody)}
    sites = {site: source.name("SITE", site) for site in range(theirs.nsite)}
    taken = {*bodies.values(), *sites.values()}

    def add(name: str, what: str, carrier: int, place: pin.SE3) -> pin.Frame:
        known = there.get(name)
        if known is not None and not (known[0] == carrier and known[1].isApprox(place, 1e-12)):
            name = free_name(f"{name}_{what}", {*there, *taken})
        there[name] = (carrier, place)
        kind = pin.FrameType.BODY if what == "body" else pin.FrameType.OP_FRAME
        return add_frame(model, name, carrier, place, kind)

    for body, given in bodies.items():
        frame = add(given or free_name(f"body_{body}", {*there, *taken}), "body", *tree.carriers[body])
        tree.frames[body] = frame.name
        if body in tree.inertias:
            # Of bodies without a joint between them it says which has what, as a cuff on an arm.
            frame.inertia = tree.inertias[body]
    for site, name in sites.items():
        if name:
            carrier, place = tree.carriers[int(theirs.site_bodyid[site])]
            add(name, "site", carrier, place * pose(theirs.site_pos[site], theirs.site_quat[site]))


def _fill_coordinates(source: Compiled, tree: MjcfTree) -> None:
    """Limits, friction, damping and armature, coordinate by coordinate, and the configurations of the file."""
    theirs, model = source.model, tree.model
    lower, upper = np.full(model.nq, -np.inf), np.full(model.nq, np.inf)
    damping, friction, armature = np.zeros((3, model.nv))
    kinds = source.mujoco.mjtTrn
    on_joints = np.isin(theirs.actuator_trntype, [int(kinds.mjTRN_JOINT), int(kinds.mjTRN_JOINTINPARENT)])
    for joint, index in enumerate(tree.joints):
        own, first = v_slice(model, index), int(theirs.jnt_dofadr[joint])
        dofs = slice(first, first + model.nvs[index])
        armature[own], damping[own] = theirs.dof_armature[dofs], theirs.dof_damping[dofs]
        # Motors' rotors and their friction, before the gear.
        for actuator in np.flatnonzero(on_joints & (theirs.actuator_trnid[:, 0] == joint)).tolist():
            ratio = float(theirs.actuator_gear[theirs.actuator_outadr[actuator], 0]) ** 2
            armature[own] += ratio * theirs.actuator_armature[actuator]
            damping[own] += ratio * theirs.actuator_damping[actuator]
        if source.disabled("DAMPER"):
            damping[own] = 0.0
        rubs = not (source.disabled("FRICTIONLOSS") or source.disabled("CONSTRAINT"))
        friction[own] = theirs.dof_frictionloss[dofs] if rubs else 0.0
        stops = not (source.disabled("LIMIT") or source.disabled("CONSTRAINT"))
        if theirs.jnt_limited[joint] and stops:
            # MuJoCo holds a joint away from its range's ends by the margin.
            (low, high), margin = theirs.jnt_range[joint], theirs.jnt_margin[joint]
            lower[model.idx_qs[index]], upper[model.idx_qs[index]] = low + margin, high - margin
    model.lowerPositionLimit, model.upperPositionLimit = lower, upper
    model.damping, model.armature = damping, armature
    model.upperDryFrictionLimit, model.lowerDryFrictionLimit = friction, -friction
    given = {source.name("KEY", key) for key in range(theirs.nkey)}
    taken = {"qpos0", *given}
    for key in range(theirs.nkey):
        name = source.name("KEY", key)
        if not name or name == "qpos0":
            name = free_name(f"key_{key}", taken)
        model.referenceConfigurations[name] = _own_configuration(source, tree, theirs.key_qpos[key])
    model.referenceConfigurations["qpos0"] = _own_configuration(source, tree, theirs.qpos0)


def _springs(source: Compiled, tree: MjcfTree) -> tuple[JointProperties, ...]:
    """Springs of the joints. That of a free joint is in the world's axes in MuJoCo and here."""
    if source.disabled("SPRING"):
        return ()
    model, found = tree.model, []
    slack = _own_configuration(source, tree, source.model.qpos_spring)
    for joint, index in enumerate(tree.joints):
        stiffness = float(source.model.jnt_stiffness[joint])
        if stiffness:
            rest = tuple(slack[q_slice(model, index)].tolist())
            found.append(JointProperties(model.names[index], stiffness, rest))
    return tuple(found)
