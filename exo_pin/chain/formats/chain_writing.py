"""Writing a closed chain as URDF with a closures file, as MJCF or as SDF: alone, or with what a device file says of it.

What a file of any format says otherwise than the chain is in :mod:`.restated`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput
from ...core.files import as_file_stem, write_files
from ...core.validation import FloatArray
from ..kinematics.closing import close, reference_configuration
from ..kinematics.loops import closed_configuration
from ..structure.chain_state import ChainState
from ..structure.closures import Closure
from ..structure.description import Closures
from .bodies import (
    LEAST_MOMENT,
    TreeBody,
    add_frame,
    free_name,
    joined_bodies,
    link_frames,
    rebuilt,
    tree_bodies,
    welded_to_arm,
    without,
)
from .closures_file import closures_text
from .joint_data import FIELDS, part_of, put_data
from .mjcf.mjcf_writing import FORMS as MJCF_FORMS
from .mjcf.mjcf_writing import mjcf_document, parts_of
from .restated import JointRestated, Restated, motion, renamed, same_frames
from .sdf.sdf_frames import RESERVED
from .sdf.sdf_writing import FORMS as SDF_FORMS
from .sdf.sdf_writing import sdf_text
from .urdf.urdf_values import linear
from .urdf.urdf_writing import urdf_text

#: Of the robot's mass, and of that times the square of its length: what a link without mass gets.
_SHARE = 1e-6
#: Share of the largest moment of inertia by which MuJoCo's rule may be missed.
_THIN = 1e-12
#: What each format has no place for, of joints that are neither hinge nor slide and of these, as in ``JointData``.
_LOST = {
    ".urdf": (("damping", "friction", "effort limits", "velocity limits", "position limits"), ()),
    ".xml": (("effort limits", "velocity limits", "position limits"), ("velocity limits",)),
    ".sdf": (("damping", "friction", "armature", "effort limits", "velocity limits", "position limits"), ("armature",)),
}  # fmt: skip
_KEYS = {
    "damping": ("damping",), "friction": ("friction",), "armature": ("armature",), "velocity limits": ("speed",),
    "effort limits": ("lower_effort", "upper_effort"), "position limits": ("lower_position", "upper_position"),
}  # fmt: skip


def to_urdf(state: ChainState, folder: str | PathLike[str]) -> Path:
    """Write a URDF and the closures file beside it, both named after the chain, and return the URDF's path.

    See :func:`exo_pin.chain.formats.urdf.urdf_writing.urdf_text` for where damping, friction, limits, springs and
    armatures go, and for what is raised.

    Parameters
    ----------
    folder : path-like
        The folder; made if it does not exist.

    Returns
    -------
    Path

    Examples
    --------
    >>> chain = ep.load("four-cables").chain_with_masses()
    >>> ep.ClosedChain.from_urdf(chain.to_urdf("copy")).model.nv == chain.model.nv
    True
    """
    text, closures = urdf_text(state)
    stem = as_file_stem(state.description.name)
    more = ", its springs and armatures" if closures.joints else ""
    note = f"What {stem}.urdf leaves out: its root, its loops, its roles{more}. Written by exo_pin."
    files = {f"{stem}.urdf": text, f"{stem}.closures.toml": closures_text(closures, note)}
    return write_files(folder, files)[0]


def to_mjcf(state: ChainState, folder: str | PathLike[str], q: ArrayLike | None = None) -> Path:
    """Write a MuJoCo model and return its path.

    Parameters
    ----------
    folder : path-like
        The folder; made if it does not exist.
    q : array_like, optional
        Shape (nq,), the configuration of the keyframe "closed"; found from the rest configuration if left out.

    Returns
    -------
    Path

    Raises
    ------
    InvalidInput
        See :func:`exo_pin.chain.formats.mjcf.mjcf_writing.mjcf_document`.
    LoopNotClosed
        If the loops are not closed at q, or q is left out and the loops do not close.

    Examples
    --------
    >>> chain = ep.load("four-linear-actuators").chain_with_masses()
    >>> len(ep.ClosedChain.from_mjcf(chain.to_mjcf("robot")).closures)  # one a limb
    4
    """
    text, _ = mjcf_document(state, _closed_or_found(state, q))
    return write_files(folder, {f"{as_file_stem(state.description.name)}.xml": text})[0]


def to_sdf(state: ChainState, folder: str | PathLike[str], q: ArrayLike | None = None) -> Path:
    """Write an SDF model in the configuration q and return its path.

    Parameters
    ----------
    folder, q
        As for :meth:`ClosedChain.to_mjcf`; the joints of the file are zero at q.

    Returns
    -------
    Path

    Raises
    ------
    InvalidInput
        See :func:`exo_pin.chain.formats.sdf.sdf_writing.sdf_text`.
    LoopNotClosed
        As for :meth:`ClosedChain.to_mjcf`.

    Examples
    --------
    >>> chain = ep.load("four-linear-actuators").chain_with_masses()
    >>> chain.to_sdf("gazebo").read_text().count("<joint name=")  # those of the tree and one a loop
    17
    """
    text = sdf_text(state, _closed_or_found(state, q))
    return write_files(folder, {f"{as_file_stem(state.description.name)}.sdf": text})[0]


def _closed_or_found(state: ChainState, q: ArrayLike | None) -> FloatArray:
    return close(state, reference_configuration(state)) if q is None else closed_configuration(state, q)


@dataclass(frozen=True, eq=False)
class WrittenChain:
    """The files of a chain.

    Attributes
    ----------
    texts : dict of str to str
        By their endings, the robot's first.
    restated : Restated
        What it says otherwise than the chain.
    lost : tuple of str
        What it cannot say, in words.
    """

    texts: dict[str, str]
    restated: Restated
    lost: tuple[str, ...]


def written_chain(
    chain: ChainState, ending: str, q: FloatArray, real: Mapping[str, pin.Inertia] | None = None
) -> WrittenChain:
    """Write a chain in a format.

    Parameters
    ----------
    chain : ChainState
        The chain.
    ending : {".urdf", ".xml", ".sdf"}
        Of the format.
    q : ndarray
        Shape (nq,), closed: the configuration that an MJCF starts from, and in which an SDF draws the links.
    real : mapping, optional
        By joint, mass properties of links for which the chain has assumed ones.

    Raises
    ------
    InvalidInput
        If the format has no joint for one of the tree, or no way to write its numbers.
    """
    lost = list[str]()
    description = chain.description
    if ending == ".urdf":
        model, joint_names, frame_names = chain.model.copy(), dict[str, str](), dict[str, str]()
    else:
        joint_names, frame_names = _names(chain, ending)
        model = rebuilt(chain.model, joint_names=joint_names, frame_names=frame_names)
        description = renamed(description, joint_names, frame_names)
        description = _with_own_closures(chain, description, {*joint_names.values()})
    _add_links(model)
    bodies = tree_bodies(ChainState(model, description))
    restated = {str(name): JointRestated() for name in list(chain.model.names)[1:]}
    for body, name in zip(bodies, restated, strict=True):
        called = joint_names.get(name)
        found = JointRestated(called, None, _mass(body, bodies, chain, ending, model, real or {}))
        found, said = _stripped(found, body, model, ending)
        lost += [f"the {what} of joint {name!r}" for what in said]
        if body.data.stiffness and _loses_spring(body, ending):
            lost.append(f"the spring of joint {name!r}")
            kept = tuple(item for item in description.joints if item.joint != body.joint)
            description = replace(description, joints=kept)
        restated[name] = found
    light = [name for name, item in restated.items() if item.inertia is not None]
    if light:
        more = f" and {len(light) - 1} more" if len(light) > 1 else ""
        lost.append(f"that what {light[0]}{more} carry weighs less, because simulators need masses")
    helpers, closing = tuple[str, ...](), tuple[str, ...]()
    if ending == ".urdf":
        text, closures = urdf_text(ChainState(model, description))
        beside = {".closures.toml": closures_text(closures, "What the URDF leaves out. Written by exo_pin.")}
    elif ending == ".xml":
        (text, helpers), beside = mjcf_document(ChainState(model, description), q), {}
        forms = {own.name: own.form_in(MJCF_FORMS, "MJCF has no equality") for own in description.closures}
        lost += [
            f"the closure {name!r}, for which a part of a body stands" for name, form in forms.items() if form == "body"
        ]
        parts = [int(chain.topology.joints[c, end]) for c, end in parts_of(chain).items()]
        for index, name in enumerate(restated, 1):
            if index in parts and restated[name].inertia is None:
                restated[name] = replace(restated[name], inertia=_numbers(pin.Inertia(model.inertias[index])))
    else:
        for name in restated:
            here = q[chain.configuration_slice(name)]
            if not motion(chain.model, chain.joint_index(name), here).isIdentity(0.0):
                restated[name] = replace(restated[name], zero=tuple(here.tolist()))
        loops = tuple(own for own in description.closures if _is_in_sdf(own, description.closures))
        lost += [f"the {own.type} closure {own.name!r}" for own in description.closures if own not in loops]
        closing = tuple(own.name for own in loops if not own.kind.is_coupling)
        text, beside = sdf_text(ChainState(model, replace(description, closures=loops)), q), {}
    others = {name: item for name, item in restated.items() if item != JointRestated()}
    return WrittenChain({ending: text} | beside, Restated(others, frame_names, helpers, closing), tuple(lost))


def _is_in_sdf(own: Closure, others: tuple[Closure, ...]) -> bool:
    if (own.kind.linear, own.kind.angular) not in SDF_FORMS:
        return False
    if not own.kind.is_coupling:
        return True
    first = next(other for other in others if other.kind.is_coupling and other.frame_b == own.frame_b)
    return first is own and linear(own) is not None and own.frame_a != "universe"


def _names(chain: ChainState, ending: str) -> tuple[dict[str, str], dict[str, str]]:
    """New names of joints and of frames, where a file would have one name twice or does not allow it."""
    taken = {*RESERVED}
    # A free body hangs on a joint that the reader of an SDF calls so.
    free = [i for i, kind in enumerate(chain.model.joints) if kind.shortname() == "JointModelFreeFlyer"]
    if ending == ".sdf" and free:
        raise InvalidInput(f"SDF has no joint for {chain.model.names[free[0]]!r}, which is free: write URDF or MJCF")
    joints = {name: _allowed(str(name), taken) for name in list(chain.model.names)[1:]}
    frames = {name: _allowed(name, taken) for name in same_frames(chain)}
    return {a: b for a, b in joints.items() if a != b}, {a: b for a, b in frames.items() if a != b}


def _allowed(name: str, taken: set[str]) -> str:
    plain = name.replace("::", "_")
    plain = plain.lstrip("_") or "part" if plain.startswith("__") else plain
    return free_name(plain, taken)


def _with_own_closures(chain: ChainState, description: Closures, joints: set[str]) -> Closures:
    """The description with closures under names that no other part has."""
    taken = {*RESERVED, *(str(name) for name in chain.model.names), *joints, *same_frames(chain)}
    names = {own.name: _allowed(own.name, taken) for own in description.closures}
    roles = description.roles
    limbs = tuple(replace(limb, closure=names[limb.closure]) for limb in roles.limbs)
    shoulder = names.get(roles.shoulder or "", roles.shoulder)
    return replace(
        description,
        closures=tuple(replace(own, name=names[own.name]) for own in description.closures),
        roles=replace(roles, limbs=limbs, shoulder=shoulder),
    )


def _add_links(model: pin.Model) -> None:
    """Give every body a link, which a file calls it by."""
    named, taken = link_frames(model), {frame.name for frame in model.frames}
    for index in range(1, model.njoints):
        if index not in named:
            name = free_name(f"{model.names[index]}_link", taken)
            add_frame(model, name, index, pin.SE3.Identity(), pin.FrameType.BODY)


def _mass(
    body: TreeBody,
    bodies: list[TreeBody],
    chain: ChainState,
    ending: str,
    model: pin.Model,
    real: Mapping[str, pin.Inertia],
) -> tuple[float, ...] | None:
    """A link's own mass properties where the file has others, which are put into the model."""
    own, known = pin.Inertia(body.inertia), real.get(str(chain.model.names[body.index]))
    if known is not None:
        return None if known == own else _numbers(known)
    if ending == ".urdf":
        return None
    if own.mass <= 0.0:
        held = set(chain.topology.joints.ravel().tolist())
        if ending == ".xml" and body.index not in {each.body.index for each in joined_bodies(bodies, held)}:
            return None
        model.inertias[body.index] = _small(chain)
        return _numbers(own)
    # MuJoCo's writer mends moments that are none, of the arm without what is welded to it, too.
    is_mended = ending == ".xml" and any(map(_is_thin, (own, without(own, body.index, welded_to_arm(chain)))))
    return _numbers(own) if is_mended else None


def _numbers(own: pin.Inertia) -> tuple[float, ...]:
    if own.mass <= 0.0:
        return (0.0,) * 10
    tensor = np.asarray(own.inertia)
    return (own.mass, *own.lever.tolist(), *tensor[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]].tolist())


def _is_thin(own: pin.Inertia) -> bool:
    moments = np.linalg.eigvalsh(own.inertia)
    return bool(moments[0] < LEAST_MOMENT or moments[2] > moments[:2].sum() * (1.0 + _THIN))


def _small(chain: ChainState) -> pin.Inertia:
    mass = _SHARE * (sum(inertia.mass for inertia in chain.model.inertias) or 1.0)
    return pin.Inertia(mass, np.zeros(3), mass * chain.characteristic_length**2 * np.eye(3))


def _stripped(found: JointRestated, body: TreeBody, model: pin.Model, ending: str) -> tuple[JointRestated, list[str]]:
    """A joint without the data that the format has no place for, and what they are."""
    data, hinged = body.data, body.axis is not None
    lost = {*_LOST[ending][hinged]} & {*data.present}
    if ending in (".urdf", ".sdf") and hinged:
        for what, limits in (("effort limits", data.effort), ("velocity limits", data.velocity)):
            if what in data.present and limits[0, 0] != -limits[0, 1]:
                lost.add(what)
        if model.nqs[body.index] == 2 and "position limits" in data.present:
            lost.add("position limits")
    if ending == ".xml" and not hinged:
        values = {"damping": data.damping, "friction": data.friction, "armature": data.armature}
        differ = {what for what, own in values.items() if len(set(own.tolist())) > 1}
        compound = {"friction", "armature"} if body.kind in ("free", "planar") else set()
        lost |= {*data.present} & (differ | compound)
    if ending == ".xml" and body.is_limb and data.effort[0, 1] < 0.0:
        # A control range has zero in it.
        lost.add("effort limits")
    told = dict(found.data)
    for what in sorted(lost):
        is_kept = (ending, what) == (".xml", "velocity limits") or (body.is_limb and what == "effort limits")
        for key in _KEYS[what]:
            part = part_of(model, body.index, FIELDS[key][0])
            told[key] = tuple(np.asarray(getattr(model, FIELDS[key][0])[part]).tolist())
            if not is_kept:
                none = np.inf if what.endswith("limits") else 0.0
                put_data(model, body.index, {key: -none if key.startswith("lower") else none})
    return replace(found, data=told), sorted(lost - ({"effort limits"} if body.is_limb else set()))


def _loses_spring(body: TreeBody, ending: str) -> bool:
    if body.axis is not None or ending == ".urdf":
        return False
    turned = body.data.reference is not None and body.data.reference[:3].any()
    return ending == ".sdf" or body.kind != "ball" or bool(turned)
