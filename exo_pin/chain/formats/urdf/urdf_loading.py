"""From files to a Pinocchio tree and its closures."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from os import PathLike

import numpy as np
import pinocchio as pin

from ....core.errors import FileFormatError, UnknownName
from ...structure.description import Closures, JointProperties
from ..bodies import rebuilt
from ..closures_file import read_closures
from ..joint_data import apply_joint_properties, repair_limits
from ..leaving_out import LEAVE_OUT, LeftOut
from ..rounding.digits import with_digits
from ..rounding.right_angles import exact_right_angles, refuse_tolerance
from ..rounding.rounded_numbers import Redrawn, closure_words
from ..xml_elements import parse_xml, read_source
from .urdf_checking import checked_urdf
from .urdf_mimic import with_mimics

#: Most degrees of freedom: Pinocchio's Data takes 64 bytes times their cube, 4 GB for these.
_MOST_FREEDOMS = 400

#: Joints of roots by name; "fixed" needs none.
ROOT_MODELS = {
    "spherical": pin.JointModelSpherical,
    "free_flyer": pin.JointModelFreeFlyer,
    "planar": pin.JointModelPlanar,
    "translation": pin.JointModelTranslation,
}


def load_model(
    urdf: str | PathLike[str],
    closures: Closures | str | PathLike[str] | None = None,
    root_joint: str | None = None,
    right_angle_tolerance: float = 0.0,
    leave_out: Iterable[str] = (),
) -> tuple[pin.Model, Closures]:
    """Load a chain.

    Parameters
    ----------
    urdf : path-like or str
        The file, or the XML itself.
    closures : Closures or path-like, optional
        What closes the loops; by default the file beside the URDF, ``robot.closures.toml`` for
        ``robot.urdf``. Where there is none the URDF is read as a tree.
    root_joint : str, optional
        How the root link hangs in the world, one of :data:`exo_pin.chain.ROOT_JOINTS`; by default that of the
        closures.
    right_angle_tolerance : float
        Angles ``rpy`` of the URDF this near a multiple of π/2 are read as that multiple, rad: 2e-5 for 1.5708,
        which tilts the axes of loops that are meant to be plane. Not above 0.01.
    leave_out : iterable of str
        "inertia_rules" reads inertias that no body has; ``description.left_out`` says what was left out.

    Returns
    -------
    pinocchio.Model
        The tree.
    Closures
        Its loops, roles and springs; of both ``ClosedChain.from_urdf`` makes the chain.

    Raises
    ------
    FileFormatError
        If the URDF or the closures file is not valid; the message names the place and line, see
        :mod:`exo_pin.chain.formats.urdf.urdf_checking`. Mimic joints become closures, see
        :mod:`exo_pin.chain.formats.urdf.urdf_mimic`.
    UnknownName
        If a root joint, frame, joint or closure type is not known.
    InvalidInput
        If data of a joint in the closures have another unit or number of components than the joint.

    Examples
    --------
    >>> mass = '<inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    >>> urdf = f'<robot name="satellite"><link name="body">{mass}</link></robot>'
    >>> chain = ep.ClosedChain.from_urdf(urdf, root_joint="free_flyer")
    >>> chain.model.nq, chain.model.nv  # a position and a quaternion; a velocity and an angular velocity
    (7, 6)
    """
    refuse_tolerance(right_angle_tolerance)
    source, path = read_source(urdf)
    left = LeftOut(leave_out)
    if closures is None:
        beside = None if path is None else path.with_suffix(".closures.toml")
        if beside is None or not beside.exists():
            left.say("closures", f"there is no {'closures file' if beside is None else beside.name}: read as a tree")
            closures = Closures("unnamed" if path is None else path.stem)
        else:
            closures = beside
    if not isinstance(closures, Closures):
        closures = read_closures(closures)
    root = closures.root
    hangs = root.joint if root_joint is None else root_joint
    if hangs != "fixed" and hangs not in ROOT_MODELS:
        raise UnknownName("root joint", hangs, ("fixed", *ROOT_MODELS))

    def hanging() -> pin.JointModel | None:
        return None if hangs == "fixed" else ROOT_MODELS[hangs]()

    try:
        folder = None if path is None else path.parent
        document = parse_xml(source)
        exact_right_angles(document, right_angle_tolerance)
        checked = checked_urdf(document, left, closures.closures, folder)
        closures = with_mimics(closures, checked.mimics)
        kinds, closures = _kinds_of_floating(closures)
        model = _built(checked.text, hanging(), root.name, kinds)
    except FileFormatError as error:
        raise FileFormatError(str(error), path, error.key) from error
    model.gravity.linear = np.array(root.gravity)
    apply_joint_properties(model, closures.joints)
    closures = replace(closures, left_out=(*closures.left_out, *left.report), shapes=checked.shapes)

    def again(digits: Redrawn) -> tuple[pin.Model, Closures]:
        document = digits.element(parse_xml(checked.text))
        whole = checked_urdf(document, LeftOut(LEAVE_OUT))
        return _built(whole.text, hanging(), root.name, kinds), digits.closures(closures)

    return model, with_digits(model, closures, (*checked.words, *closure_words(closures)), again)


def _kinds_of_floating(closures: Closures) -> tuple[dict[str, str], Closures]:
    """What the joints are that a URDF calls floating, by name, and the closures without that."""
    kinds = {item.joint: item.type for item in closures.joints if item.type is not None}
    plain = (item if item.type is None else replace(item, type=None) for item in closures.joints)
    return kinds, replace(closures, joints=tuple(item for item in plain if item != JointProperties(item.joint)))


def _built(text: str, hanging: pin.JointModel | None, name: str, kinds: dict[str, str]) -> pin.Model:
    """The model of a checked URDF, hanging on a joint of this name if there is one; floating joints as they really are.

    Raises
    ------
    FileFormatError
        If Pinocchio reads no model of it, or a joint that is to be another one does not float.
    """
    try:
        model = pin.buildModelFromXML(text) if hanging is None else pin.buildModelFromXML(text, hanging, name)
    except (RuntimeError, ValueError, TypeError) as error:
        raise FileFormatError(f"not a URDF that Pinocchio reads: {error}") from error
    if hanging is not None and list(model.names).count(name) > 1:
        raise FileFormatError(
            f"the root joint and a joint of the URDF are both called {name!r}: rename one", None, name
        )
    if model.nv > _MOST_FREEDOMS:
        raise FileFormatError(
            f"{model.nv} degrees of freedom are too many: Pinocchio's memory for a tree grows with their cube, "
            f"and ends at {_MOST_FREEDOMS}"
        )
    repair_limits(model)
    return _as_they_are(model, kinds)


def _as_they_are(model: pin.Model, kinds: dict[str, str]) -> pin.Model:
    """The tree with the joints that a URDF calls floating as what they are."""
    found = {}
    for name, kind in kinds.items():
        index = list(model.names).index(name) if name in model.names else 0
        if not index or model.joints[index].shortname() != "JointModelFreeFlyer":
            raise FileFormatError(f"expected a floating joint {name!r} in the URDF, for a type of {kind!r}", None, name)
        found[index] = ROOT_MODELS[kind]()
    return rebuilt(model, found) if found else model
