"""Reading MJCF through Pinocchio, and comparing what it made of the file with what MuJoCo itself reads.

Pinocchio reads one tree and the equalities connect and weld. What else MuJoCo's format can say, it drops without a
word: a second body on the world, couplings of joints, tendons. Here that is an error.
"""

from __future__ import annotations

from os import PathLike, fspath
from typing import Any

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from ..errors import FileFormatError, MissingExtra
from ..validation import FloatArray
from .closures import Closure, Closures, Placement, Roles, Root

__all__ = ["read_mjcf"]

#: Largest difference between the two readings: placements, m and rad; masses, relative.
_SAME = 1e-9


def read_mjcf(path: str | PathLike[str]) -> tuple[pin.Model, Closures]:
    """Read a robot.

    Equalities become closures of their names: connect spherical, weld rigid. Joints with an actuator of their own
    are actuated.

    Parameters
    ----------
    path : path-like
        The XML file.

    Raises
    ------
    FileFormatError
        If either of the two cannot read the file, if it has something that Pinocchio drops, or if they disagree.
    MissingExtra
        If MuJoCo is not installed.
    """
    try:
        import mujoco
    except ImportError as error:
        raise MissingExtra("robots", "mujoco") from error
    file = fspath(path)
    try:
        theirs = mujoco.MjModel.from_xml_path(file)
    except ValueError as error:
        raise FileFormatError(f"MuJoCo cannot read it: {error}", file) from error
    _refuse_dropped(theirs, mujoco, file)
    try:
        model, constraints = pin.buildModelAndLegacyConstraintsFromMJCF(file)
    except (RuntimeError, ValueError) as error:
        raise FileFormatError(f"Pinocchio cannot read it: {error}", file) from error
    _compare_trees(model, theirs, mujoco, file)
    closures = tuple(_closure(theirs, mujoco, index, file) for index in range(theirs.neq))
    _compare_closures(constraints, closures, file)
    root = Root(gravity=tuple(np.asarray(model.gravity.linear).tolist()))
    name = theirs.names[: theirs.names.index(b"\0")].decode() or "unnamed"
    return model, Closures(name, root, closures, Roles(_actuated(model, theirs, mujoco, file)))


def _refuse_dropped(theirs: Any, mujoco: Any, file: str) -> None:
    """What Pinocchio would not say that it cannot read."""
    kinds = mujoco.mjtEq
    known = {int(kinds.mjEQ_CONNECT), int(kinds.mjEQ_WELD)}
    for index in range(theirs.neq):
        name = theirs.equality(index).name or f"number {index}"
        if int(theirs.eq_type[index]) not in known:
            kind = kinds(int(theirs.eq_type[index])).name.removeprefix("mjEQ_").lower()
            raise FileFormatError(f"equality {name} is a {kind} coupling: only connect and weld are read", file)
        if not theirs.eq_active0[index]:
            raise FileFormatError(f"equality {name} is not active: remove it, or make it so", file)
    roots = [theirs.body(index).name for index in range(1, theirs.nbody) if theirs.body_parentid[index] == 0]
    if len(roots) > 1:
        raise FileFormatError(
            f"several bodies stand on the world ({', '.join(roots)}), of which Pinocchio reads one: put them into one "
            "body that stands still",
            file,
        )
    if theirs.ntendon:
        raise FileFormatError(f"it has {theirs.ntendon} tendons, which are not read", file)


def _compare_trees(model: pin.Model, theirs: Any, mujoco: Any, file: str) -> None:
    """Bodies, joints, masses, and where the bodies are at rest and in another configuration."""
    frames = {frame.name: index for index, frame in enumerate(model.frames)}
    names = [theirs.body(index).name for index in range(theirs.nbody)]
    for index in range(1, theirs.nbody):
        if not names[index]:
            raise FileFormatError(f"body number {index} has no name", file)
        if names[index] not in frames:
            raise FileFormatError(f"body {names[index]!r} is not in what Pinocchio reads", file)
    if (model.nq, model.nv) != (theirs.nq, theirs.nv):
        raise FileFormatError(f"Pinocchio reads {model.nv} freedoms, MuJoCo {theirs.nv}", file)
    data, other = model.createData(), mujoco.MjData(theirs)
    rng = np.random.default_rng(0)
    rest = pin.neutral(model)
    for q in (rest, pin.integrate(model, rest, rng.uniform(-0.5, 0.5, model.nv))):
        pin.framesForwardKinematics(model, data, q)
        other.qpos[:] = _their_configuration(model, theirs, mujoco, q, frames, names)
        mujoco.mj_kinematics(theirs, other)
        mujoco.mj_comPos(theirs, other)
        for index in range(1, theirs.nbody):
            place = data.oMf[frames[names[index]]]
            shift = np.abs(place.translation - other.xpos[index]).max()
            turn = np.abs(place.rotation - other.xmat[index].reshape(3, 3)).max()
            if max(shift, turn) > _SAME:
                raise FileFormatError(f"Pinocchio and MuJoCo see body {names[index]!r} in different places", file)
        pin.crba(model, data, q)
        ours = np.diag(data.M)
        full = np.zeros((theirs.nv, theirs.nv))
        mujoco.mj_makeM(theirs, other)
        mujoco.mj_fullM(theirs, other, full)
        moving = np.diag(full) - theirs.dof_armature
        own = ours - np.asarray(model.armature)
        # A free body's linear part is told in other axes by the two, but its mass is the same in all.
        if np.abs(own - moving).max(initial=0.0) > 1e-6 * max(float(np.abs(moving).max(initial=0.0)), 1e-12):
            raise FileFormatError("Pinocchio and MuJoCo read different masses or inertias", file)


def _their_configuration(
    model: pin.Model, theirs: Any, mujoco: Any, q: FloatArray, frames: dict[str, int], names: list[str]
) -> FloatArray:
    """q in MuJoCo's order; quaternions have their scalar first there."""
    kinds = mujoco.mjtJoint
    found = np.zeros(theirs.nq)
    used: dict[int, int] = {}
    for index in range(theirs.njnt):
        joint = model.frames[frames[names[theirs.jnt_bodyid[index]]]].parentJoint
        # Several joints of one body are one composite joint of Pinocchio's, in the same order.
        start = model.idx_qs[joint] + used.get(joint, 0)
        there, kind = int(theirs.jnt_qposadr[index]), int(theirs.jnt_type[index])
        if kind == kinds.mjJNT_FREE:
            found[there : there + 7] = q[start : start + 7][[0, 1, 2, 6, 3, 4, 5]]
            used[joint] = used.get(joint, 0) + 7
        elif kind == kinds.mjJNT_BALL:
            found[there : there + 4] = q[start : start + 4][[3, 0, 1, 2]]
            used[joint] = used.get(joint, 0) + 4
        else:
            found[there] = q[start]
            used[joint] = used.get(joint, 0) + 1
    return found


def _closure(theirs: Any, mujoco: Any, index: int, file: str) -> Closure:
    """One equality as MuJoCo compiled it."""
    is_weld = int(theirs.eq_type[index]) == int(mujoco.mjtEq.mjEQ_WELD)
    name = theirs.equality(index).name or f"equality_{index}"
    ids = int(theirs.eq_obj1id[index]), int(theirs.eq_obj2id[index])
    data = theirs.eq_data[index]
    if int(theirs.eq_objtype[index]) == int(mujoco.mjtObj.mjOBJ_SITE):
        bodies = [int(theirs.site_bodyid[site]) for site in ids]
        places = [_placement(theirs.site_pos[site], theirs.site_quat[site]) for site in ids]
    elif is_weld:
        # relpose stands after the anchor: where body 2 is in body 1.
        bodies, places = list(ids), [_placement(data[3:6], data[6:10]), Placement()]
    else:
        bodies, places = list(ids), [_placement(data[0:3]), _placement(data[3:6])]
    frames = ["universe" if body == 0 else theirs.body(body).name for body in bodies]
    kind = "rigid" if is_weld else "spherical"
    return Closure(name, kind, frames[0], frames[1], placement_a=places[0], placement_b=places[1])


def _placement(position: FloatArray, quaternion: FloatArray | None = None) -> Placement:
    turn = (0.0, 0.0, 0.0, 1.0)
    if quaternion is not None:
        turn = tuple(Rotation.from_quat(quaternion, scalar_first=True).as_quat().tolist())
    return Placement(tuple(np.asarray(position).tolist()), turn)


def _compare_closures(constraints: Any, closures: tuple[Closure, ...], file: str) -> None:
    """Pinocchio has as many connects and as many welds.

    Where they hold is taken from MuJoCo, whose format it is: Pinocchio forgets the ``pos`` of a joint in the anchor of
    a connect between bodies.
    """
    welds = [item.type == pin.ContactType.CONTACT_6D for item in constraints]
    if sorted(welds) != sorted(closure.type == "rigid" for closure in closures):
        raise FileFormatError(f"Pinocchio reads {len(welds)} equalities, MuJoCo {len(closures)}, or other ones", file)


def _actuated(model: pin.Model, theirs: Any, mujoco: Any, file: str) -> tuple[str, ...]:
    """Joints that an actuator acts on."""
    kinds = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
    found = []
    for index in range(theirs.nu):
        if int(theirs.actuator_trntype[index]) not in kinds:
            raise FileFormatError(f"actuator number {index} does not act on a joint", file)
        name = theirs.joint(int(theirs.actuator_trnid[index, 0])).name
        if name not in model.names:
            raise FileFormatError(
                f"joint {name!r} shares its body with others, of which Pinocchio makes one joint: give it its own body",
                file,
            )
        if name not in found:
            found.append(name)
    return tuple(found)
