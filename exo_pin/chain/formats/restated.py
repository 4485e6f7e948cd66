"""What an MJCF, SDF or URDF of a chain says otherwise than the chain, because its format has no words for it.

A writer gets a chain that its format can hold: parts have names that differ from each other, links that need mass have
some, and joints lack the data that the format has no place for. A closure may become a small body, a joint or nothing.
:class:`Restated` is what has been changed. With it, and with closures and springs as they were, :func:`restored` makes
of the file's chain the one that was written.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pinocchio as pin

from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_choice
from ..structure.chain_state import ChainState
from ..structure.closures import Closure
from ..structure.description import Closures
from ..structure.motion_axes import q_slice
from .bodies import LINKS_AND_SITES, rebuilt
from .joint_data import put_data


@dataclass(frozen=True)
class JointRestated:
    """One joint, and the link that it carries.

    Attributes
    ----------
    called : str or None
        The joint's name in the file, where it is another.
    zero : tuple of float or None
        Shape (nq of the joint,), its coordinates where the file's joint reads zero.
    inertia : tuple of float or None
        Mass, kg, centre of mass, m, and the moments xx, xy, yy, xz, yz, zz about it, kg m², of the link in the joint's
        frame.
    data : mapping of str to tuple of float
        By the names of :data:`.joint_data.FIELDS`, SI units; infinite for no limit.
    """

    called: str | None = None
    zero: tuple[float, ...] | None = None
    inertia: tuple[float, ...] | None = None
    data: Mapping[str, tuple[float, ...]] = field(default_factory=dict)


@dataclass(frozen=True)
class Restated:
    """What a file says otherwise.

    Attributes
    ----------
    joints : mapping of str to JointRestated
        By the joint's own name.
    frames : mapping of str to str
        Names of links and sites in the file, by their own.
    helpers : tuple of str
        Joints of the file whose bodies only stand for closures.
    closing : tuple of str
        Joints of the file that close loops.
    """

    joints: Mapping[str, JointRestated] = field(default_factory=dict)
    frames: Mapping[str, str] = field(default_factory=dict)
    helpers: tuple[str, ...] = ()
    closing: tuple[str, ...] = ()

    @property
    def is_empty(self) -> bool:
        """Whether the file says the same as the chain."""
        return self == Restated()


def restored(model: pin.Model, read: Closures, restated: Restated, own: Closures) -> tuple[pin.Model, Closures]:
    """The tree and the description of the chain that a file was written from.

    Parameters
    ----------
    model : pinocchio.Model
    read : Closures
        As a reader found them in the file.
    restated : Restated
        What the file says otherwise.
    own : Closures
        With closures, joints, roles, tolerance and what was left out, in the chain's own names.

    Raises
    ------
    UnknownName
        If the file lacks a joint or frame that is restated.
    InvalidInput
        If a joint has another number of coordinates.
    """
    helpers = {_index(model, name) for name in restated.helpers}
    there = {item.called: name for name, item in restated.joints.items() if item.called is not None}
    called = {value: name for name, value in restated.frames.items()}
    for name in there:
        _index(model, name)
    for name in called:
        as_choice("frame", name, [frame.name for frame in model.frames])
    places = {}
    for name, item in restated.joints.items():
        if item.zero is not None:
            index = _index(model, item.called or name)
            places[index] = model.jointPlacements[index] * motion(model, index, np.array(item.zero)).inverse()
    model = rebuilt(model, places=places, joint_names=there, frame_names=called, without=helpers)
    for name, item in restated.joints.items():
        index = _index(model, name)
        if item.inertia is not None:
            model.inertias[index] = _body(item.inertia)
        if item.zero is not None and len(item.zero) == model.nqs[index] == 1:
            for limit in (model.lowerPositionLimit, model.upperPositionLimit):
                limit[model.idx_qs[index]] += item.zero[0]
        put_data(model, index, item.data)
    shapes = tuple(replace(shape, frame=called.get(shape.frame, shape.frame)) for shape in read.shapes)
    return model, replace(own, root=read.root, shapes=shapes)


def renamed(description: Closures, joints: Mapping[str, str], frames: Mapping[str, str]) -> Closures:
    """A description with other names of joints and frames; names that are not in the mappings stay."""

    def joint(name: Any) -> Any:
        return joints.get(name, name)

    def frame(name: Any) -> Any:
        return frames.get(name, joints.get(name, name))

    def closure(own: Closure) -> Closure:
        part = joint if own.kind.is_coupling else frame
        return replace(own, frame_a=part(own.frame_a), frame_b=part(own.frame_b))

    roles = description.roles
    limbs = tuple(
        replace(limb, slide=joint(limb.slide), platform_joint=joint(limb.platform_joint)) for limb in roles.limbs
    )
    named = {key: frame(getattr(roles, key)) for key in ("arm", "reference_point", "cuff")}
    own = [closure.name for closure in description.closures]
    shoulder = roles.shoulder if roles.shoulder in own else joint(roles.shoulder)
    return replace(
        description,
        closures=tuple(map(closure, description.closures)),
        roles=replace(roles, actuated=tuple(map(joint, roles.actuated)), limbs=limbs, shoulder=shoulder, **named),
        joints=tuple(replace(item, joint=joint(item.joint)) for item in description.joints),
        shapes=tuple(replace(shape, frame=frame(shape.frame)) for shape in description.shapes),
        cables=tuple(
            replace(own, points=tuple((frame(end), at) for end, at in own.points), joint=joint(own.joint))
            for own in description.cables
        ),
    )


def same_frames(state: ChainState) -> list[str]:
    """Names of links and sites that a file may have, each once."""
    return list(dict.fromkeys(f.name for f in state.model.frames if f.type in LINKS_AND_SITES and f.name != "universe"))


def motion(model: pin.Model, index: int, q: FloatArray) -> pin.SE3:
    """What a joint does at its coordinates, as a placement of its child."""
    whole, data = pin.neutral(model), model.createData()
    own = q_slice(model, index)
    whole[own] = as_read(model, index, q)
    pin.forwardKinematics(model, data, whole)
    return model.jointPlacements[index].inverse() * data.liMi[index]


def as_read(model: pin.Model, index: int, q: FloatArray) -> FloatArray:
    """Coordinates of a joint, which is read as ``index``: an endless hinge with cosine and sine may have one number.

    Raises
    ------
    InvalidInput
        If it has another number of coordinates.
    """
    count = model.nqs[index]
    if len(q) == 2 and count == 1:
        return np.array([np.arctan2(q[1], q[0])])
    if len(q) != count:
        raise InvalidInput(f"expected {count} coordinates of joint {model.names[index]!r}, got {len(q)}")
    return q


def _body(numbers: tuple[float, ...]) -> pin.Inertia:
    mass, x, y, z, xx, xy, yy, xz, yz, zz = numbers
    return pin.Inertia(mass, np.array([x, y, z]), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))


def _index(model: pin.Model, name: str) -> int:
    names = [str(own) for own in model.names]
    as_choice("joint", name, names[1:])
    return names.index(name)
