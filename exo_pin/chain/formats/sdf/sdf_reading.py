"""Reading SDF, which describes loops: a link may be the child of several joints.

Read are, of versions 1.3 to 1.12: one model, or a world with models; nested models in the same file; links with pose,
mass and inertia; joints revolute, continuous, prismatic, universal, revolute2, ball and fixed, with their axes, limits,
damping, friction, springs and mimics; frames; poses relative to any of them; the world's gravity. Links without an
inertial have the specification's mass of 1 kg and inertia of 1 kg m².

* All joints are zero in the file's configuration, in which the loops are closed.
* Joints count turns: hinges have one number for their position, endless ones too. A universal joint becomes two
  hinges, ``knee_axis`` and ``knee_axis2``.
* Which joints close the loops: :mod:`exo_pin.chain.formats.sdf.sdf_tree`. How: as closures with their names, or, with
  limits or dynamics, as joints of the tree whose massless end is held by a rigid closure ``knee_closure``
  (:mod:`exo_pin.chain.formats.sdf.sdf_tree`).
* A body that no joint joins to the world is free, and so is every tree of a file without a joint to the world.
* Hinges and slides are actuated unless their effort is limited to zero, as in other readers of SDF; there is no
  element for motors.
* A ball joint's damping is that of its <axis>, which simulators read, too.

* A static model is fixed to the world.

Files are read as tolerantly as by SDF's reference parser where the motion is not affected: elements without a value
have the specification's, joints may have axes that their type has not, comments may have ``--`` in them. Pictures,
collision shapes, sensors, plugins, settings of simulators, and elements that the specification does not have are left
out and listed in the closures' ``left_out``; a name that is nearly one of the specification is an error. What changes
the motion and is not read is an error unless it is named in ``leave_out``. The rules are in ``sdf_grammar.toml``.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable
from os import PathLike
from pathlib import Path

import numpy as np
import pinocchio as pin

from ....core.conventions import GRAVITY
from ....core.errors import FileFormatError, InvalidInput, UnknownName
from ....core.errors.base import warn
from ....core.validation import FloatArray
from ...structure.description import ROOT_JOINTS, Closures, Roles, Root
from ..bodies import add_frame, free_name
from ..digits import Redrawn, exact_right_angles, pose_words, refuse_tolerance, with_digits
from ..leaving_out import LeftOut
from ..shapes import sdf_shapes
from ..xml_elements import Element, checked, flag, is_left_out, numbers_of, parse_xml, read_source
from .sdf_frames import Scope
from .sdf_model import fixed_models, read_joint, read_link
from .sdf_tree import SdfTree, build_tree, make_graph

VERSIONS = ("1.3", "1.4", "1.5", "1.6", "1.7", "1.8", "1.9", "1.10", "1.11", "1.12")


#: Values without effect of elements that otherwise are left out by name.
_HARMLESS = {"gravity": "true", "kinematic": "false", "enable_wind": "false", "velocity_decay": "0"}
#: The specification's gravity of a world that states none, m/s².
_WORLD_GRAVITY = (0.0, 0.0, -9.8)


def check_grammar(root: Element, left: LeftOut) -> None:
    """Check every element's attributes and children that matter, and make of old versions what the newest has.

    Parameters
    ----------
    root : Element
        The document, which is changed.
    left : LeftOut
        What is left out is put down there.

    Warns
    -----
    RuntimeWarning
        If elements of other programs are left out.

    Raises
    ------
    FileFormatError
        If an attribute is missing, an element is there twice, a name is nearly one that is known, something that
        changes the motion is not read and not named to be left out, or the version is not one of :data:`VERSIONS`.
    """
    if root.tag != "sdf":
        old = ", of version 1.2 and before: convert the file (gz sdf -p)" if root.tag == "gazebo" else ""
        raise root.error(f"expected the root element <sdf>, got <{root.tag}>{old}")
    version = root.attributes.get("version")
    if version not in VERSIONS:
        raise root.error(f"expected one of {', '.join(VERSIONS)}, got {version!r}: convert the file (gz sdf -p)")
    age, unread = VERSIONS.index(version), Counter[tuple[str, str]]()

    def strange(name: str, where: str) -> None:
        unread[name, where] += 1

    for element, rule in checked(root, "sdf", strange=strange):
        _renew(element, age, version, left)
        for attribute in rule.required:
            if not element.attributes[attribute]:
                raise element.error(f"the attribute {attribute!r} is empty")
        for child in element.children:
            if child.tag in rule.named:
                if child.tag not in _HARMLESS or not _has_no_effect(child, _HARMLESS[child.tag]):
                    shown = f"{child.place} ({child.text})" if child.text else child.place
                    said = "it is not read: "
                    said += "write the file out (gz sdf -p)" if child.tag == "include" else "take it out"
                    left.named(rule.named[child.tag], shown, said, child.at_line)
            elif is_left_out(child, rule) and child.tag != "visual":
                # What is drawn is carried along.
                strange(child.tag, f"<{child.tag}> in <{element.tag}>")
    prefixed = [where for name, where in unread if ":" in name]
    if prefixed:
        warn(f"not read: {', '.join(prefixed)}, of other programs", RuntimeWarning)
    left.unread(unread)


def _renew(element: Element, age: int, version: str, left: LeftOut) -> None:
    """Make of an element what version 1.7 has; what only old versions have is an error in a new file."""
    is_new = age >= VERSIONS.index("1.7")
    if is_new and (element.tag == "use_parent_model_frame" or "frame" in element.attributes):
        raise element.error(f"is of version 1.6 and before; this file says {version}: use expressed_in, relative_to")
    is_of_model = age < VERSIONS.index("1.5") and element.first("use_parent_model_frame") is None
    if element.tag in ("axis", "axis2") and is_of_model:
        element.children.append(Element("use_parent_model_frame", {}, element.line, element.place, text="true"))
    if element.tag == "model" and not is_new:
        # Links and joints had names apart.
        taken = {child.attributes.get("name", "") for child in element.children if child.tag != "joint"}
        for joint in element.all("joint"):
            name = joint.attributes.get("name", "")
            if name in taken:
                joint.attributes["name"] = free_name(f"{name}_joint", taken)
                left.say("renamed", f"joint {name!r} is {joint.attributes['name']!r}")
            taken.add(joint.attributes.get("name", ""))


def _has_no_effect(element: Element, harmless: str) -> bool:
    """Whether an element has the value that has no effect, or none."""
    if harmless in ("true", "false"):
        return not element.text or flag(element) == (harmless == "true")
    return all(part.text.strip("0.+-") == "" for part in (element, *element.children))


def read_sdf(
    path: str | PathLike[str],
    root_joint: str | None = None,
    right_angle_tolerance: float = 0.0,
    leave_out: Iterable[str] = (),
    first_joint: str | None = None,
    closing: Collection[str] = (),
) -> tuple[pin.Model, Closures]:
    """Load an SDF model, from a file or from the XML itself.

    See :mod:`exo_pin.chain.formats.sdf.sdf_reading` for what is read.

    Parameters
    ----------
    path : path-like or str
        The file, or the XML itself.
    root_joint : str, optional
        How bodies that the file does not join to the world hang on it, one of :data:`exo_pin.chain.ROOT_JOINTS`; free
        for None. The joint is called "root_joint", or, if there are several, after the body.
    right_angle_tolerance : float
        Angles of poses this near a multiple of π/2 are read as that multiple, rad: 2e-5 for 1.5708. Not above 0.01.
    leave_out : iterable of str
        As for :meth:`exo_pin.ClosedChain.from_urdf`.
    first_joint : str, optional
        A joint that is part of the tree, whatever the others are, and closes no loop, as the shoulder's of a device.
    closing : collection of str
        Joints that are not read, because the caller knows the closures that they stand for.

    Returns
    -------
    pinocchio.Model
        The tree.
    Closures
        Its loops, roles and springs; of both ``ClosedChain.from_sdf`` makes the chain.

    Raises
    ------
    FileFormatError
        If there is no such file, it is not SDF, has no joint ``first_joint``, or has something that is not read. The
        message names place and line.
    UnknownName
        If the root joint is not known.

    Examples
    --------
    >>> chain = ep.load("three-linear-actuators").chain_with_masses()
    >>> again = ep.ClosedChain.from_sdf(chain.to_sdf("robot"))
    >>> len(again.closures), again.mobility(again.close(again.neutral())).degrees_of_freedom
    (3, 3)
    """
    if root_joint is not None and root_joint not in ROOT_JOINTS:
        raise UnknownName("root joint", root_joint, ROOT_JOINTS)
    refuse_tolerance(right_angle_tolerance)
    content, file = read_source(path)
    try:
        root = parse_xml(content, "an SDF")
        exact_right_angles(root, right_angle_tolerance)
        left, folder = LeftOut(leave_out), None if file is None else file.parent
        check_grammar(root, left)
        model, closures, words = _read(root, root_joint, first_joint, left, folder, closing)

        def again(digits: Redrawn) -> tuple[pin.Model, Closures]:
            return _read(digits.element(root), root_joint, first_joint, LeftOut(leave_out), folder, closing)[:2]

        return model, with_digits(model, closures, words, again)
    except InvalidInput as error:
        raise FileFormatError(str(error), file, getattr(error, "key", None)) from error


def _read(
    root: Element,
    root_joint: str | None,
    first_joint: str | None,
    left: LeftOut,
    folder: Path | None,
    closing: Collection[str],
) -> tuple[pin.Model, Closures, tuple[str, ...]]:
    """Tree, loops and the numbers of the geometry of a checked document."""
    worlds, models = root.all("world"), root.all("model")
    if len(worlds) + len(models) != 1:
        raise root.error(f"expected one <world> or one <model>, got {len(worlds) + len(models)}")
    outermost = (worlds + models)[0]
    scope = Scope(outermost)
    links = [read_link(*item, left) for item in scope.all("link")]
    if not links:
        raise outermost.error("expected at least one link")
    read = (read_joint(*item, left) for item in scope.all("joint"))
    joints = [joint for joint in read if joint is not None and joint.name not in closing]
    joints += fixed_models(scope, links)
    graph = make_graph(links, joints, first_joint, left)
    tree = build_tree(outermost.attributes["name"], links, graph, root_joint)
    _add_frames(scope, tree, {link.name: link.place for link in links})
    gravity = _gravity(outermost, root.attributes["version"]) if worlds else GRAVITY
    tree.model.gravity.linear = np.array(gravity)
    root_data = Root(gravity=tuple(np.asarray(gravity).tolist()))
    roles = Roles(tuple(tree.actuated))
    name = outermost.attributes["name"]
    shapes = tuple(
        shape
        for own, element in scope.all("link")
        for shape in sdf_shapes(element, f"{own.name}{element.attributes['name']}", folder, left)
    )
    closures = Closures(name, root_data, tuple(tree.closures), roles, tuple(tree.springs), left.report, shapes=shapes)
    # The places of links and joints; those of inertias and pictures have no effect on the loops.
    placed = (element for kind in ("link", "joint", "frame") for _, element in scope.all(kind))
    words = tuple(word for element in placed for word in pose_words(element))
    return tree.model, closures, words


def _add_frames(scope: Scope, tree: SdfTree, places: dict[str, pin.SE3]) -> None:
    """The file's frames, on the bodies that they are attached to."""
    model = tree.model
    for own, element in scope.all("frame"):
        name = element.attributes["name"]
        link = own.link_of(name, element)
        place, body = own.pose(name, element), model.frames[model.getFrameId(link)] if link != "world" else None
        carrier = 0 if body is None else body.parentJoint
        local = place if body is None else body.placement * places[link].actInv(place)
        add_frame(model, f"{own.name}{name}", carrier, local, pin.FrameType.OP_FRAME)


def _gravity(world: Element, version: str) -> FloatArray:
    gravity, physics = world.first("gravity"), world.first("physics")
    if physics is not None and version in VERSIONS[: VERSIONS.index("1.6")]:
        gravity = physics.first("gravity") or gravity
    return np.array(_WORLD_GRAVITY if gravity is None or not gravity.text else numbers_of(gravity, gravity.text, 3))
