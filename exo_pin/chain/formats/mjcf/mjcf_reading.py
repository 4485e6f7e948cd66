"""Reading MJCF: MuJoCo compiles the file, and its compiled model becomes a Pinocchio tree with closures.

Read are: bodies, also several on the world; hinges, slides, balls and free joints, several on one body too; inertias,
armature, gravity; position limits; springs, damping and dry friction of joints; limits of effort; sites, as frames;
the equalities connect, weld and joint; tendons over sites, as cables and springs of a device. Friction, springs and
damping of the file count with MuJoCo's flags: a flag that is disabled takes its forces away.

**Contact is not read**: geoms give bodies their masses, as in MuJoCo, and are carried along as shapes. The softness of
MuJoCo's constraints, its solver and its time step are not read: closures are exact here. How a control becomes a force
is not read either; efforts are given as forces.

Anything else that changes the motion is an error that names it, unless the caller leaves it out by name
(:mod:`exo_pin.chain.formats.mjcf.mjcf_settling`). What was built is compared with MuJoCo's own mass matrix, bias and
passive forces, without what was left out, before it is returned. What was left out stands in the ``left_out`` of the
closures, among it equalities that are not active at the start, actuators that act on no hinge or slide, and control
laws. A mocap body stands still.

=================== ===========================================================================================
name                of what
=================== ===========================================================================================
a joint's           its own, or ``joint_3`` by MuJoCo's number
a body's frame      the body's own (type BODY), or ``body_3``; the world is "universe"
a site's frame      the site's own (type OP_FRAME); sites without a name have no frame
a closure's         the equality's own, or ``equality_3``
=================== ===========================================================================================

Two frames in different places cannot have one name: the joint has it, then the body, which otherwise gets "_body"
after its name, then the site, which gets "_site". A closure called as a joint gets "_closure".

The comparison of a tree that was built from MJCF with MuJoCo's own equations of motion.

At one seeded state the mass matrix, the forces of gravity and velocity, and the passive forces have to be the same.
This finds everything in a file that changes the motion and is not read, except contact, equalities and actuators, whose
control is not read.

The two have different coordinates v: MuJoCo's free joint has its linear velocity in the world's axes,
v_theirs = T v, so that M = Tᵀ M_theirs T, and forces are Tᵀ times theirs. The acceleration that belongs to a = 0 is
T' v there, in which M_theirs T' v is added to their bias.

A compiled MuJoCo model with other places and directions that its file would have written with the same digits.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable
from dataclasses import replace
from os import PathLike
from typing import Any

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from ....core.files.toml_tables import naming_file
from ....core.validation import FloatArray
from ...structure.closures import COEFFICIENTS, Closure
from ...structure.description import Cable, Closures, Roles, Root
from ...structure.frames import Placement, placement_of
from ...structure.motion_axes import q_slice
from ...structure.passive import PassiveForces
from ..bodies import free_name
from ..digits import Redrawn, rounding_of, with_digits
from ..leaving_out import LeftOut
from .mjcf_compiling import Compiled, compile_mjcf, mujoco_warnings
from .mjcf_settling import cables, distance, drives, effort_range, settle
from .mjcf_shapes import mjcf_shapes
from .mjcf_tree import MjcfTree, addresses, build_tree, pose

#: Fields that are places, which the compiled model has as they are written.
_PLACES = ("body_pos", "jnt_pos", "site_pos")
#: Fields that are quaternions.
_TURNS = ("body_quat", "site_quat")
#: Largest error of a quaternion that is meant to be a multiple of a right angle about an axis.
_SQUARE = 1e-14


#: Largest difference, relative to MuJoCo's largest entry: both sides round a few hundred times.
_AGREES = 1e-9
#: Places that are the same, m.
_SAME = 1e-9


def redrawn(model: Any, digits: Redrawn, rounding: float) -> Any:
    """A copy of a mjModel with its bodies, joints, sites and equalities moved.

    How a direction was written is lost: it is turned by up to the rounding about any axis, unless it is along the axes.

    Parameters
    ----------
    model : mujoco.MjModel
        Not changed.
    digits : Redrawn
        Moves places.
    rounding : float
        Half a unit of the last decimal of the file, m and rad.
    """
    other = copy.copy(model)
    for name in _PLACES:
        values = getattr(other, name)
        values[:] = [[float(digits.number(repr(value))) for value in row] for row in values.tolist()]
    for name in _TURNS:
        for row in getattr(other, name):
            row[:] = _turned(row, digits, rounding)
    for axis in other.jnt_axis:
        if np.count_nonzero(axis) > 1:
            axis[:] = _turn(digits, rounding).apply(axis)
    for row in other.eq_data:
        row[:6] = [float(digits.number(repr(value))) for value in row[:6].tolist()]
    return other


def _turn(digits: Redrawn, rounding: float) -> Rotation:
    return Rotation.from_rotvec(digits.rng.uniform(-rounding, rounding, 3))


def _turned(quaternion: FloatArray, digits: Redrawn, rounding: float) -> FloatArray:
    """A quaternion with its scalar first, turned; as it is if it is a multiple of a right angle about an axis."""
    squares = np.square(quaternion)
    if np.abs(squares * (squares - 0.5) * (squares - 1.0)).max() < _SQUARE:
        return quaternion
    turned = _turn(digits, rounding) * Rotation.from_quat(quaternion, scalar_first=True)
    return np.asarray(turned.as_quat(scalar_first=True))


def refuse_disagreement(source: Compiled, tree: MjcfTree) -> None:
    """Raise FileFormatError if MuJoCo's equations of motion are others than the tree's."""
    if not tree.model.nv:
        return
    data, rng = source.mujoco.MjData(source.model), np.random.default_rng(0)
    q = np.asarray(pin.integrate(tree.model, pin.neutral(tree.model), rng.standard_normal(tree.model.nv)))
    v = rng.standard_normal(tree.model.nv)
    T, rate = _put(source, tree, data, q, v)
    with mujoco_warnings(source.mujoco, source.messages):
        M = _evaluate(source, data)
    bias = T.T @ (data.qfrc_bias + M @ (rate @ v))
    ours = tree.model.createData()
    upper = np.triu(np.reshape(pin.crba(tree.model, ours, q), (tree.model.nv, tree.model.nv)))
    pairs = {
        "mass matrix": (upper + np.triu(upper, 1).T, T.T @ M @ T),
        "forces of gravity and velocity": (pin.nonLinearEffects(tree.model, ours, q, v), bias),
        "passive forces": (PassiveForces(tree.model, tree.properties).force(q, v), T.T @ data.qfrc_passive),
    }
    for what, (one, other) in pairs.items():
        size = float(np.abs(other).max())
        if what.startswith("forces of gravity"):
            # They may cancel. Velocities are of size one, so that single terms are of the size of M.
            size = max(size, float(np.abs(M).max()))
        if not np.isfinite(size):
            raise source.error(f"its {what} are not finite: some number is far too large. Check its units")
        if not np.abs(one - other).max() <= _AGREES * size:
            raise source.error(
                f"MuJoCo computes other {what} than the chain that was read from the file. Something in the file is "
                "not understood: please report it"
            )


def _put(source: Compiled, tree: MjcfTree, data: Any, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Give MuJoCo the state; return T and its rate, shape (nv, nv)."""
    theirs, model = source.model, tree.model
    T, rate = np.zeros((2, model.nv, model.nv))
    data.qpos[addresses(source, tree)] = q
    for joint, index in enumerate(tree.joints):
        at, count, dof = model.idx_vs[index], model.nvs[index], int(theirs.jnt_dofadr[joint])
        T[dof : dof + count, at : at + count] = np.eye(count)
        if count == 6:
            R = pin.Quaternion(q[q_slice(model, index)][3:]).toRotationMatrix()
            T[dof : dof + 3, at : at + 3] = R
            rate[dof : dof + 3, at : at + 3] = R @ pin.skew(v[at + 3 : at + 6])
    data.qvel[:] = T @ v
    return T, rate


def _evaluate(source: Compiled, data: Any) -> FloatArray:
    """Let MuJoCo compute its forces, without contacts, and return its mass matrix."""
    model, mujoco = source.model, source.mujoco
    flags = model.opt.disableflags
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)
    model.opt.disableflags = flags
    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, M)
    return M


def read_mjcf(path: str | PathLike[str], leave_out: Iterable[str] = ()) -> tuple[pin.Model, Closures]:
    """Load a MuJoCo model whose loops are connect and weld equalities, from a file or from the XML itself.

    See :mod:`exo_pin.chain.formats.mjcf.mjcf_reading` for what is read and how it is named. ``description.left_out``
    says what was left out; what changes the motion and cannot be read is refused unless it is named in ``leave_out``.

    Parameters
    ----------
    path : path-like or str
        The XML file, or the XML itself.
    leave_out : iterable of str
        What to leave out of the file though it changes the motion: names of
        :data:`exo_pin.chain.formats.leaving_out.LEAVE_OUT`.

    Returns
    -------
    pinocchio.Model
        The tree. Hinges and slides have MuJoCo's coordinates, ``ref`` included; quaternions are (x, y, z, w), and the
        linear velocity of a free joint is in the body's axes (in MuJoCo: the world's). Its ``damping``, ``armature``
        and ``upperDryFrictionLimit`` are the joints'; ``upperEffortLimit`` and ``lowerEffortLimit`` are infinite where
        the file limits no effort. ``referenceConfigurations`` has "qpos0", where MuJoCo starts, and the keyframes; one
        without a name, or called "qpos0", is "key_0" and so on.
    Closures
        A connect is a spherical closure, a weld a rigid one at its anchor; a weld with ``torquescale="0"`` holds a
        point only and is spherical. A joint equality is a coupling: its first joint is joint b. A tendon equality of
        two sites is a distance. Springs are in ``joints``, tendons that pull in ``cables``. Joints with an actuator are
        actuated. What was left out is in ``left_out``. Of tree and closures
        ``ClosedChain.from_mjcf`` makes the chain.

    Warns
    -----
    RuntimeWarning
        If MuJoCo warns about the file.

    Raises
    ------
    FileFormatError
        If there is no such file, MuJoCo cannot compile it, or it has something that a chain cannot hold.
    MissingExtra
        If MuJoCo is not installed.
    InvalidInput
        If ``path`` is neither a path nor text.

    Examples
    --------
    >>> rod = '<joint name="hinge" axis="0 1 0"/><inertial mass="2" pos="0 0 -0.5" diaginertia="1 1 1"/>'
    >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{rod}</body></worldbody></mujoco>")
    >>> chain.inverse_dynamics([np.pi / 2], actuated=["hinge"]).tau.round(3)  # N m hold it level: 2 kg at 0.5 m
    array([9.81])
    """
    source = compile_mjcf(path)
    left, tendons = LeftOut(leave_out, source.error), cables(source)
    settle(source, left)
    with naming_file(source.path):
        model, closures = _built(source, left, tendons.values())
    source.warn()
    return model, closures


def _built(source: Compiled, left: LeftOut, tendons: Iterable[Cable]) -> tuple[pin.Model, Closures]:
    """The tree and its closures, compared with MuJoCo."""
    tree = build_tree(source)
    actuated = _limit_efforts(source, tree)
    closures = _closures(source, tree, left)
    refuse_disagreement(source, tree)
    root = Root(gravity=tuple(np.asarray(tree.model.gravity.linear).tolist()))
    roles = Roles(tuple(tree.model.names[joint] for joint in actuated))
    shapes = tuple(mjcf_shapes(source, tree.frames, left))
    routed = tuple(
        replace(
            own,
            points=tuple((tree.frames[int(body)], at) for body, at in own.points),
            joint=None if own.joint is None else tree.model.names[tree.joints[int(own.joint)]],
        )
        for own in tendons
    )
    described = Closures(
        tree.model.name, root, closures, roles, tree.properties, left.report, shapes=shapes, cables=routed
    )

    def again(digits: Redrawn) -> tuple[pin.Model, Closures]:
        other = replace(source, model=redrawn(source.model, digits, rounding_of(source.words)))
        tree = build_tree(other)
        return tree.model, replace(described, closures=_closures(other, tree, LeftOut()))

    return tree.model, with_digits(tree.model, described, source.words, again)


def _closures(source: Compiled, tree: MjcfTree, left: LeftOut) -> tuple[Closure, ...]:
    """The active equalities under names of their own."""
    count = source.model.neq
    joints = set(tree.model.names)
    taken = {*joints, *(source.name("EQUALITY", index) for index in range(count))}
    found = list[Closure | None]()
    for index in range(count):
        name = source.name("EQUALITY", index)
        if not name or name in joints:
            name = free_name(f"{name}_closure" if name else f"equality_{index}", taken)
        if source.model.eq_active0[index]:
            read = {"joint": _coupling, "tendon": _distance}.get(
                source.kind("mjtEq", source.model.eq_type[index]), _closure
            )
            closure = read(source, tree, index, name)
            if closure is None:
                left.say("rigid", f"equality {name!r} joins two frames of one rigid body")
            found.append(closure)
    return tuple(closure for closure in found if closure is not None)


def _coupling(source: Compiled, tree: MjcfTree, index: int, name: str) -> Closure:
    """A joint equality: q_1 - q0_1 = a_0 + a_1 (q_2 - q0_2) + ... with q0 of the model's ``qpos0``."""
    theirs = source.model

    def end(joint: int) -> tuple[str, float]:
        if joint < 0:
            return "universe", 0.0
        return tree.model.names[tree.joints[joint]], float(theirs.qpos0[theirs.jnt_qposadr[joint]])

    (joint_a, r_a), (joint_b, r_b) = end(int(theirs.eq_obj2id[index])), end(int(theirs.eq_obj1id[index]))
    powers = tuple(theirs.eq_data[index, : 1 if joint_a == "universe" else COEFFICIENTS].tolist())
    return Closure(name, "coupling", joint_a, joint_b, polynomial=powers, references=(r_a, r_b))


def _distance(source: Compiled, tree: MjcfTree, index: int, name: str) -> Closure:
    """The constant length of a tendon between two sites."""
    found = distance(source, index)
    assert found is not None
    (a, at_a), (b, at_b) = (
        (tree.frames[int(source.model.site_bodyid[site])], Placement(tuple(source.model.site_pos[site].tolist())))
        for site in found[:2]
    )
    return Closure(name, "distance", a, b, at_a, at_b, distance=found[2])


def _closure(source: Compiled, tree: MjcfTree, index: int, name: str) -> Closure | None:
    """One equality as MuJoCo compiled it; None if both ends are on one rigid body.

    ``eq_data`` of a connect is the point in body 1 and in body 2. Of a weld it is the point in body 2, the point in
    body 1, the orientation of body 2 in body 1, and the scale of the rows that hold the orientation.
    """
    theirs = source.model
    data = theirs.eq_data[index]
    is_weld = source.kind("mjtEq", theirs.eq_type[index]) == "weld"
    ids = int(theirs.eq_obj1id[index]), int(theirs.eq_obj2id[index])
    still = np.eye(4)[0]  # the scalar of a quaternion comes first
    if source.kind("mjtObj", theirs.eq_objtype[index]) == "site":
        bodies = [int(theirs.site_bodyid[site]) for site in ids]
        places = [(theirs.site_pos[site], theirs.site_quat[site]) for site in ids]
    else:
        bodies = list(ids)
        places = [(data[3:6], data[6:10]), (data[0:3], still)] if is_weld else [(data[0:3], still), (data[3:6], still)]
    kind = "rigid" if is_weld and data[10] else "spherical"
    if tree.carriers[bodies[0]][0] == tree.carriers[bodies[1]][0]:
        one, other = (tree.carriers[body][1] * pose(*place) for body, place in zip(bodies, places, strict=True))
        apart = one.actInv(other)
        if np.abs(apart.translation).max() > _SAME or (kind == "rigid" and not apart.isIdentity(_SAME)):
            raise source.error(f"equality {name!r} joins two places of one rigid body that are apart: remove it")
        return None
    ends = [placement_of(pose(*place)) for place in places]
    return Closure(name, kind, tree.frames[bodies[0]], tree.frames[bodies[1]], ends[0], ends[1])


def _limit_efforts(source: Compiled, tree: MjcfTree) -> list[int]:
    """Put the limits of efforts into the tree, and return the joints that carry an actuator, by their index."""
    theirs, model = source.model, tree.model
    lower, upper = np.full(model.nv, -np.inf), np.full(model.nv, np.inf)
    efforts: dict[int, FloatArray] = {}
    for index, joint in drives(source).items():
        efforts[joint] = efforts.get(joint, np.zeros(2)) + effort_range(source, index)
    for joint, own in enumerate(tree.joints):
        limits = efforts.get(joint, np.array([-np.inf, np.inf]))
        if theirs.jnt_actfrclimited[joint]:
            limits = np.clip(limits, *theirs.jnt_actfrcrange[joint])
        lower[model.idx_vs[own]], upper[model.idx_vs[own]] = limits
    model.lowerEffortLimit, model.upperEffortLimit = lower, upper
    return [tree.joints[joint] for joint in efforts]
