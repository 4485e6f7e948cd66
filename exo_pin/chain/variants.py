"""New chains from a chain: one more loop closed, joints locked, a joint of another kind.

The mirror image of a chain in the x-z plane (y -> -y) of its world.

With S = diag(1, -1, 1), a frame at p with the axes R goes to S p with the axes S R S: the mirror images of its axes,
but for y, which is turned round so that they stay right-handed. All frames do so, those of the world, of joints, links
and closures: a vector v in the axes of any of them goes to S v, a moment m, which is a pseudovector, to -S m.

A joint of one coordinate **keeps its coordinate**, its limits, and the sign of its effort. A slide's axis goes to S a;
a hinge turns about -S a, because the mirror image of a turn by θ about a is one by -θ about S a. Other joints stay of
their kind, and some of their numbers change their sign (:class:`MirrorSigns`): a quaternion
(x, y, z, w) goes to (-x, y, -z, w), and an angular velocity ω to -S ω.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ..core.conventions import MIRROR
from ..core.errors import InvalidInput
from ..core.records import keeps_read_only
from ..core.validation import FloatArray
from .formats.bodies import axis_joint, rebuilt
from .kinematics.loops import residual
from .structure.chain_state import CLOSED, ChainState
from .structure.closures import Closure
from .structure.description import Closures, JointProperties, Shape
from .structure.frames import Placement
from .structure.motion_axes import motion_axes, q_slice

_VECTOR, _TURN = (1, -1, 1), (-1, 1, -1)
#: Signs of q and of v of joints of several coordinates.
_SIGNS = {
    "JointModelSpherical": ((*_TURN, 1), _TURN),
    "JointModelTranslation": (_VECTOR, _VECTOR),
    "JointModelFreeFlyer": ((*_VECTOR, *_TURN, 1), (*_VECTOR, *_TURN)),
    # Place, cosine and sine; their rates.
    "JointModelPlanar": ((1, -1, 1, -1), (1, -1, -1)),
}
#: Signs of the rows of closures by their rules, as of a displacement and of a turn in the axes of frame a.
_LINEAR_ROWS = {"x": 1, "y": -1, "z": 1}
_ANGULAR_ROWS = {"": (), "xy": _TURN[:2], "xyz": _TURN, "cross": (-1,), "joints": (1,)}
#: Limits by the coordinates of q, and of v, of which the mirror image of a coordinate that changes its sign exchanges
#: the lower and the upper one.
_LIMITS = (("PositionLimit", True), ("EffortLimit", False), ("VelocityLimit", False), ("DryFrictionLimit", False))
_COPIED = ("damping", "armature", "rotorInertia", "rotorGearRatio")
_ENDLESS_HINGE = """<robot name="hinge"><link name="a"/><link name="b"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="hinge" type="continuous">
<parent link="a"/><child link="b"/><axis xyz="{}"/></joint></robot>"""


def locked(state: ChainState, joints: Iterable[str], q: ArrayLike) -> tuple[pin.Model, Closures]:
    """A tree and its description with some joints locked; see :meth:`exo_pin.ClosedChain.locked`."""
    q = state.configuration(q)
    indices = sorted({state.joint_index(name) for name in ([joints] if isinstance(joints, str) else joints)})
    names = {str(state.model.names[index]) for index in indices}
    if 0 in indices:
        raise InvalidInput("the world is no joint: expected joints that move")
    whole = _with_joint_frames(state.model, indices)
    model = pin.buildReducedModel(whole, indices, q)
    model.gravity = whole.gravity
    description = state.description
    root, roles, gone = description.root, description.roles, names | _bridged(state, indices, q)
    changed = replace(
        roles,
        actuated=tuple(name for name in roles.actuated if name not in names),
        shoulder=None if roles.shoulder in gone else roles.shoulder,
        limbs=tuple(limb for limb in roles.limbs if not {limb.slide, limb.platform_joint, limb.closure} & gone),
    )
    kept = (closure for closure in state.closures if closure.name not in gone)
    closures = (_held(state, closure, names, q) if closure.polynomial else closure for closure in kept)
    return model, replace(
        description,
        root=replace(root, joint="fixed") if root.name in names else root,
        closures=tuple(closure for closure in closures if closure is not None),
        roles=changed,
        joints=tuple(item for item in description.joints if item.joint not in names),
    )


def _with_joint_frames(model: pin.Model, joints: Iterable[int]) -> pin.Model:
    """A copy with a frame of each of these joints before those of bodies: else Pinocchio cannot lock them, or crashes.

    A model that was built in code may lack them.
    """
    whole = model.copy()
    lacking = [k for k in joints if not whole.existFrame(whole.names[k], pin.FrameType.JOINT)]
    for k in lacking:
        whole.addJointFrame(k)
    count = model.nframes
    order = [0, *range(count, whole.nframes), *range(1, count)] if lacking else range(count)
    frames, place = [pin.Frame(whole.frames[old]) for old in order], {old: new for new, old in enumerate(order)}
    for k, frame in enumerate(frames):
        frame.parentFrame = place.get(frame.parentFrame, 0)
        whole.frames[k] = frame
    return whole


def with_joint(
    state: ChainState,
    joint: int,
    kind: pin.JointModel,
    inertia: pin.Inertia | None = None,
    moved: Mapping[int, FloatArray] | None = None,
) -> pin.Model:
    """The tree with one joint of another kind; data of all others, and their frames, stay.

    Parameters
    ----------
    joint : int
        Index of the joint.
    kind : pinocchio.JointModel
        What it becomes.
    inertia : pinocchio.Inertia, optional
        Of the body that it carries; as it is if left out.
    moved : mapping, optional
        Shifts of joints, by index, shape (3,), m, in the axes of the body that carries them.
    """
    at = state.model.jointPlacements
    places = {k: pin.SE3(at[k].rotation, at[k].translation + shift) for k, shift in (moved or {}).items()}
    new = rebuilt(state.model, {joint: {"": kind}}, places)
    if inertia is not None:
        new.inertias[joint] = inertia
    return new


def _bridged(state: ChainState, indices: list[int], q: FloatArray) -> set[str]:
    """Closures between bodies that locked joints make one.

    Raises
    ------
    InvalidInput
        If one of them is open.
    """
    body = list(range(state.model.njoints))
    for index in indices:
        # Parents come first.
        body[index] = body[state.model.parents[index]]
    open_by, found = residual(state, q), set[str]()
    for closure, (a, b) in zip(state.closures, state.topology.joints.tolist(), strict=True):
        if closure.polynomial is None and body[a] == body[b]:
            gap = float(np.abs(open_by[state.rows(closure.name)]).max())
            if gap > state.closed:
                raise InvalidInput(
                    f"closure {closure.name!r} is open by {gap:.3g} (m, rad) where the joints between its links are "
                    "locked: lock them where it is closed, for example at a configuration from close()"
                )
            found.add(closure.name)
    return found


def _held(state: ChainState, closure: Closure, names: set[str], q: FloatArray) -> Closure | None:
    """What is left of a coupling when joints are locked: nothing of one whose joints are, else a joint that is held.

    Raises
    ------
    InvalidInput
        If it cannot hold with the joints where they are locked.
    """
    assert closure.polynomial is not None
    (a, b), (r_a, r_b) = (closure.frame_a, closure.frame_b), closure.references
    if a not in names and b not in names:
        return closure
    x, y = (
        (0.0 if end == "universe" else q[state.configuration_slice(end)][0]) - start
        for end, start in ((a, r_a), (b, r_b))
    )
    asked = np.polynomial.Polynomial(closure.polynomial)
    if b not in names:
        return replace(closure, frame_a="universe", polynomial=(float(asked(x)),), references=(0.0, r_b))
    moves = a not in names and a != "universe"
    places = [root.real for root in (asked - y).roots() if abs(root.imag) < CLOSED] if moves else [x]
    nearest = min(places, key=lambda place: abs(place - x), default=np.nan)
    if not abs(asked(nearest) - y) <= CLOSED:
        raise InvalidInput(
            f"coupling {closure.name!r} cannot hold with {b!r} locked at {y + r_b:.6g}: lock its joints where it does, "
            "for example at a configuration from close()"
        )
    if not moves:
        return None
    return Closure(closure.name, closure.type, "universe", a, polynomial=(float(nearest),), references=(0.0, r_a))


@keeps_read_only
class MirrorSigns(NamedTuple):
    """Signs, 1.0 or -1.0, of a chain's numbers in its mirror image.

    Attributes
    ----------
    configuration : ndarray
        Shape (nq,), of q.
    motion : ndarray
        Shape (nv,), of v and a, and of efforts and generalised forces.
    rows : ndarray
        Shape (rows,), of the residuals of closures and their multipliers.

    Examples
    --------
    >>> exo = ep.load("four-cables")
    >>> signs = exo.chain.mirror_signs()
    >>> signs.configuration[exo.chain.configuration_slice("root_joint")]  # of the arm's quaternion, x, y, z, w
    array([-1.,  1., -1.,  1.])
    """

    configuration: FloatArray
    motion: FloatArray
    rows: FloatArray


def mirror_signs(state: ChainState) -> MirrorSigns:
    """Signs of q, v and the constraint rows in the mirror image of the chain, :meth:`ClosedChain.mirrored`.

    Joints of one coordinate keep it. The signs are those of the way back, too.

    Returns
    -------
    MirrorSigns

    Examples
    --------
    >>> chain = ep.load("six-cables").chain
    >>> signs = chain.mirror_signs()
    >>> q = chain.close(chain.neutral())
    >>> image = chain.mirrored().residual(signs.configuration * q)  # m, closed as well
    >>> bool(np.abs(image).max() < 1e-12)
    True
    """
    found = [_signs_of(joint) for joint in list(state.model.joints)[1:]]
    q, v = (np.array([sign for pair in found for sign in pair[part]], dtype=float) for part in (0, 1))
    rows = [sign for closure in state.closures for sign in _row_signs(closure)]
    return MirrorSigns(q, v, np.array(rows, dtype=float))


def mirrored(state: ChainState) -> tuple[pin.Model, Closures]:
    """The tree and the description of the mirror image; see :meth:`exo_pin.ClosedChain.mirrored`.

    Raises
    ------
    InvalidInput
        If a joint is of a kind whose mirror image is not known.
    """
    old, new, signs = state.model, pin.Model(), mirror_signs(state)
    new.name, new.gravity = old.name, pin.Motion(_vector(old.gravity.linear), np.zeros(3))
    for index in range(1, old.njoints):
        joint = old.joints[index]
        joint = _one_coordinate(joint) if joint.nv == 1 else joint
        added = new.addJoint(old.parents[index], joint, mirrored_pose(old.jointPlacements[index]), old.names[index])
        new.inertias[added] = _inertia(old.inertias[index])
    for frame in list(old.frames)[1:]:
        place, inertia = mirrored_pose(frame.placement), _inertia(frame.inertia)
        new.addFrame(pin.Frame(frame.name, frame.parentJoint, frame.parentFrame, place, frame.type, inertia), False)
    for name, of_q in _LIMITS:
        low, high = np.array(getattr(old, f"lower{name}")), np.array(getattr(old, f"upper{name}"))
        turned = (signs.configuration if of_q else signs.motion) < 0.0
        setattr(new, f"lower{name}", np.where(turned, -high, low) + 0.0)
        setattr(new, f"upper{name}", np.where(turned, -low, high) + 0.0)
    for name in _COPIED:
        setattr(new, name, np.array(getattr(old, name)))
    for item in old.referenceConfigurations:
        new.referenceConfigurations[item.key()] = signs.configuration * np.array(item.data()) + 0.0
    given = state.description
    return new, replace(
        given,
        root=replace(given.root, gravity=_numbers(_vector(given.root.gravity))),
        closures=tuple(_closure(closure) for closure in given.closures),
        joints=tuple(_properties(state, item, signs) for item in given.joints),
        shapes=tuple(_shape(shape) for shape in given.shapes),
        cables=tuple(
            replace(own, points=tuple((frame, (x, 0.0 - y, z)) for frame, (x, y, z) in own.points))
            for own in given.cables
        ),
    )


def mirrored_pose(pose: pin.SE3) -> pin.SE3:
    """The mirror image of a frame's place and axes."""
    return pin.SE3(MIRROR @ pose.rotation @ MIRROR + 0.0, _vector(pose.translation))


def _vector(vector: Any) -> FloatArray:
    """The mirror image of a vector, without -0.0."""
    return np.asarray(vector, dtype=float) * _VECTOR + 0.0


def _numbers(array: FloatArray) -> Any:
    return tuple(array.tolist())


def _inertia(inertia: pin.Inertia) -> pin.Inertia:
    tensor = MIRROR @ np.array(inertia.inertia) @ MIRROR + 0.0
    return pin.Inertia(inertia.mass, _vector(inertia.lever), tensor)


def _signs_of(joint: Any) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Signs of the q and the v of a joint."""
    if joint.nv == 1:
        return (1,) * joint.nq, (1,)
    name = joint.shortname()
    if name not in _SIGNS:
        raise InvalidInput(f"expected joints whose mirror image is known, got a {name}: one of {', '.join(_SIGNS)}")
    return _SIGNS[name]


def _one_coordinate(joint: Any) -> Any:
    """A hinge or slide that keeps its coordinate."""
    alone = pin.Model()
    alone.addJoint(0, joint, pin.SE3.Identity(), "joint")
    motion = motion_axes(alone)[1][:, 0]
    along, about = _vector(motion[:3]), -_vector(motion[3:]) + 0.0
    if along.any() and about.any():
        raise InvalidInput(f"expected joints whose mirror image is known, got a {joint.shortname()}")
    if joint.nq == 1:
        return axis_joint(not about.any(), along if along.any() else about)
    # Pinocchio makes hinges that count no turns, about any axis, of a URDF alone.
    return pin.buildModelFromXML(_ENDLESS_HINGE.format(" ".join(map(repr, about.tolist())))).joints[1]


def _row_signs(closure: Closure) -> tuple[int, ...]:
    linear, angular = closure.kind.rules
    own = (1,) if linear == "length" else tuple(_LINEAR_ROWS[axis] for axis in linear)
    return (*own, *_ANGULAR_ROWS[angular])


def _quaternion(quaternion: Any) -> Any:
    return _numbers(np.asarray(quaternion) * (*_TURN, 1) + 0.0)


def _closure(closure: Closure) -> Closure:
    a, b = (
        Placement(_numbers(_vector(place.translation)), _quaternion(place.quaternion))
        for place in (closure.placement_a, closure.placement_b)
    )
    axis = None if closure.axis is None else _numbers(_vector(closure.axis))
    return replace(closure, placement_a=a, placement_b=b, axis=axis)


def _properties(state: ChainState, item: JointProperties, signs: MirrorSigns) -> JointProperties:
    """A spring with its reference in the mirror image; an armature has no direction."""
    if item.spring_reference is None:
        return item
    own = signs.configuration[q_slice(state.model, state.joint_index(item.joint))]
    return replace(item, spring_reference=_numbers(own * np.array(item.spring_reference) + 0.0))


def _shape(shape: Shape) -> Shape:
    """Bodies of revolution and boxes are their own mirror images in their own axes; a mesh is scaled by -1 along y."""
    size = tuple(_vector(shape.size).tolist()) if shape.kind == "mesh" else shape.size
    place = {"translation": _numbers(_vector(shape.translation)), "quaternion": _quaternion(shape.quaternion)}
    return replace(shape, size=size, **place)
