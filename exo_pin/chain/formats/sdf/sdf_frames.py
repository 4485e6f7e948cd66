"""Frames of an SDF: names, poses relative to each other, and the link that each is attached to.

A model has a frame ``__model__``, a world the frame ``world``. Links, joints, frames and nested models of a model are
frames with names of their own; ``inner::arm`` is ``arm`` in the nested model ``inner``. A pose is relative to

* the frame that it names with ``relative_to``, or else
* of a link or a nested model: the frame of the model around it; of a joint: its child; of a frame: the frame that it is
  attached to, which is the model's if none is named.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from ..xml_elements import Element, flag, numbers_of

#: Names that no part of a model may have; nor one with "::" in it, or with two underscores in front.
RESERVED = ("__model__", "__root__", "world", "universe")


class Scope:
    """The frames of a model or a world.

    Parameters
    ----------
    element : Element
        The ``<model>`` or ``<world>``.
    outer : Scope or None
        The model or world around it.

    Attributes
    ----------
    name : str
        Prefix of its names in the chain: empty for the world and the outermost model.
    inner : dict of str to Scope
        Models directly in it.
    parts : dict of str to Element
        Its links, joints and frames.
    """

    def __init__(self, element: Element, outer: Scope | None = None, name: str = "") -> None:
        self.element, self.outer, self.name = element, outer, name
        self.inner: dict[str, Scope] = {}
        self.parts: dict[str, Element] = {}
        self._poses: dict[str, pin.SE3 | None] = {}
        for child in element.children:
            if child.tag not in ("link", "joint", "frame", "model"):
                continue
            own = child.attributes["name"]
            if own in RESERVED or "::" in own or own.startswith("__"):
                raise child.error(f"{own!r} is a reserved name, choose another one", "name")
            before = self.parts.get(own) or (self.inner[own].element if own in self.inner else None)
            if before is not None:
                raise child.error(f"line {before.line} has a {before.tag} of this name, too: names have to differ")
            if child.tag == "model":
                self.inner[own] = Scope(child, self, f"{name}{own}::")
            else:
                self.parts[own] = child

    @property
    def own_frame(self) -> str:
        """Name of its own frame."""
        return "__model__" if self.element.tag == "model" else "world"

    def all(self, tag: str) -> list[tuple[Scope, Element]]:
        """Links, joints or frames of it and of the models in it, in the order of the file."""
        found = []
        for child in self.element.children:
            if child.tag == "model":
                found += self.inner[child.attributes["name"]].all(tag)
            elif child.tag == tag:
                found.append((self, child))
        return found

    def resolved(self, name: str, element: Element) -> tuple[Scope, str]:
        """The scope that has a name, with the part after the last ``::``.

        Raises
        ------
        FileFormatError
            If there is none; ``element`` is named.
        """
        *around, last = name.split("::")
        scope = self
        for piece in around:
            if piece not in scope.inner:
                raise element.error(f"there is no model {piece!r} in {name!r}")
            scope = scope.inner[piece]
        if last in scope.inner:
            return scope.inner[last], "__model__"
        if last == "world" and scope is self:
            outermost = self
            while outermost.outer is not None:
                outermost = outermost.outer
            # Without a <world> the outermost model stands in one.
            return outermost, "world"
        if last not in scope.parts and last != scope.own_frame:
            there = ", ".join((*scope.parts, *scope.inner))
            raise element.error(f"there is no link, joint, frame or model {name!r}; there are: {there}")
        return scope, last

    def pose(self, name: str, element: Element) -> pin.SE3:
        """Pose in the world of a frame that is named in this scope; joints at zero.

        Raises
        ------
        FileFormatError
            If there is no such frame, poses are relative to each other in a circle, or a pose is not valid.
        """
        place = self._once("__model__", self.element) * self._within(name, element)
        return place if self.outer is None else self.outer.pose(self.outer.own_frame, element) * place

    def _within(self, reference: str, element: Element) -> pin.SE3:
        """Pose in its own frame of a frame that is named in this scope."""
        scope, name = self.resolved(reference, element)
        if name == "world" and scope.element.tag != "world":
            raise element.error("poses in a model are relative to its own frames, not to the world")
        place = pin.SE3.Identity() if name == scope.own_frame else scope._once(name, element)
        while scope is not self:
            place = scope._once("__model__", scope.element) * place
            assert scope.outer is not None
            scope = scope.outer
        return place

    def _once(self, name: str, element: Element) -> pin.SE3:
        """Pose of a part in its own frame, or of that, called "__model__", in the frame around it."""
        if name not in self._poses:
            self._poses[name] = None
            self._poses[name] = self._model_pose() if name == "__model__" else self._part_pose(self.parts[name])
        found = self._poses[name]
        if found is None:
            shown = self.element.attributes["name"] if name == "__model__" else name
            raise element.error(f"the pose of {shown!r} is relative to itself, through other frames")
        return found

    def link_of(self, name: str, element: Element, passed: tuple[object, ...] = ()) -> str:
        """The chain's name of the link that a frame named in this scope is attached to, "world" for the world.

        Raises
        ------
        FileFormatError
            If there is no such frame, or frames are attached to each other in a circle.
        """
        scope, own = self.resolved(name, element)
        if own == "world":
            return "world"
        if (scope, own) in passed:
            raise element.error(f"{name!r} is attached to itself, through other frames")
        passed = (*passed, (scope, own))
        if own == "__model__":
            return scope._canonical_link(element, passed)
        part = scope.parts[own]
        if part.tag == "link":
            return f"{scope.name}{own}"
        return scope.link_of(scope._base(part), part, passed)

    def _canonical_link(self, element: Element, passed: tuple[object, ...] = ()) -> str:
        given = self.element.attributes.get("canonical_link")
        if given:
            return self.link_of(given, self.element, passed)
        links = self.element.all("link")
        if links:
            return f"{self.name}{links[0].attributes['name']}"
        for scope in self.inner.values():
            return scope._canonical_link(element, passed)
        raise self.element.error("expected at least one link")

    def _model_pose(self) -> pin.SE3:
        pose, around = self.element.first("pose"), pin.SE3.Identity()
        reference = "" if pose is None else _relative_to(pose)
        if self.outer is not None:
            around = self.outer._within(reference or self.outer.own_frame, pose or self.element)
        elif reference:
            raise self.element.error(f"the outermost model cannot be relative to {reference!r}", "pose")
        given = self.element.attributes.get("placement_frame")
        # The pose may be that of another frame of the model.
        own = self._within(given, self.element) if given else pin.SE3.Identity()
        return around * place_of(pose) * own.inverse()

    def _part_pose(self, part: Element) -> pin.SE3:
        pose = part.first("pose")
        reference = _relative_to(pose) if pose is not None else ""
        return self._within(reference or self._base(part), part) * place_of(pose)

    def _base(self, part: Element) -> str:
        """What a part is attached to, unless its pose says otherwise; a joint to its child."""
        child = part.first("child")
        return part.attributes.get("attached_to") or self.own_frame if child is None else child.text


def _relative_to(pose: Element) -> str:
    if pose.attributes.get("frame"):
        raise pose.error(
            "expected no frame: up to version 1.6 of SDF it has no meaning, use relative_to of 1.7", "frame"
        )
    return pose.attributes.get("relative_to", "")


def place_of(pose: Element | None) -> pin.SE3:
    """The placement that a ``<pose>`` states, whatever it is relative to; the identity without one.

    Raises
    ------
    FileFormatError
        If it is not x, y, z and three angles, or, with ``rotation_format="quat_xyzw"``, a quaternion of length 1.
    """
    if pose is None:
        return pin.SE3.Identity()
    written = pose.attributes.get("rotation_format", "euler_rpy")
    if written not in ("euler_rpy", "quat_xyzw"):
        raise pose.error(f"expected euler_rpy or quat_xyzw, got {written!r}", "rotation_format")
    in_degrees = pose.attributes.get("degrees", "false")
    degrees = flag(Element("degrees", {}, pose.line, pose.place, text=in_degrees))
    is_quaternion = written == "quat_xyzw"
    if degrees and is_quaternion:
        raise pose.error("a quaternion has no degrees", "degrees")
    if not pose.text:
        return pin.SE3.Identity()
    values = np.array(numbers_of(pose, pose.text, 7 if is_quaternion else 6))
    place, turn = values[:3], values[3:]
    if not is_quaternion:
        return pin.SE3(pin.rpy.rpyToMatrix(np.radians(turn) if degrees else turn), place)
    length = float(np.linalg.norm(turn))
    if abs(length - 1.0) > 1e-6:
        raise pose.error(f"expected a quaternion of length 1, got length {length:.9g}")
    return pin.SE3(pin.Quaternion(turn).normalized(), place)
