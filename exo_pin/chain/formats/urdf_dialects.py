"""Loops that other programs' elements state in a URDF, as closures.

====================================== ===========================================================================
``<joint>`` in ``<gazebo>``            SDF's joint, zero where the URDF's joints are: the pose is the child's frame's
Gazebo's ``DetachableJoint``           rigid, as the two links stand where the joints are zero
``<drake:ball_constraint>``            spherical, at a point of each body
``closing_X_1`` and ``closing_X_2``    of onshape-to-robot, links or frames: spherical; revolute about z if each has
                                       a ``closing_X_1_z``, ``closing_X_2_z`` beside it
``connect``, ``weld`` of ``<mujoco>``  spherical, rigid; a weld with torquescale 0 is spherical
``joint`` of its ``<equality>``        a coupling of two joints, or of one with the world
``<loop_joint>``                       of Isaac, spherical
====================================== ===========================================================================

A loop that the closures file states, under the same name or between the same two bodies, counts as stated there. What
no closure holds is refused with the text for that file. ``<drake:linear_bushing_rpy>`` is a spring between two frames,
which a chain has not: it is left out by name alone.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import pinocchio as pin

from ...core.errors import FileFormatError, InvalidInput
from ..structure.closures import Closure
from ..structure.description import Closures
from ..structure.frames import FrameTable, Placement, placement_of, se3
from .bodies import free_name
from .closures_file import closures_text
from .leaving_out import LeftOut, name_of_element
from .sdf.sdf_frames import Scope
from .sdf.sdf_model import closure_of, is_closure, read_joint
from .urdf.urdf_values import origin_of
from .xml_elements import NOTHING, Element, as_numbers, checked, numbers, vector

#: Elements of a ``<robot>`` that may state loops.
DIALECTS = ("gazebo", "mujoco", "loop_joint", "drake:ball_constraint", "drake:linear_bushing_rpy")
_DETACHABLE = re.compile(r"DetachableJoint|detachable-joint")
_CLOSING = re.compile(r"closing_(.+)_1")
#: How far from its z axis, as a share of their distance, a frame's second point may be.
_ALONG = 1e-4
#: How far apart, m, two places of one body may be that a loop joins: digits.
_APART = 1e-5


def extensions(root: Element) -> Element:
    """The elements of a URDF that may state loops; Drake's points are called ``xyz``, as other places are."""
    found = [child for child in root.children if child.tag in (*DIALECTS, "frame") or _is_closing(child)]
    for element in found:
        for child in element.children:
            if child.tag.startswith("drake:ball_constraint_p") and "value" in child.attributes:
                child.attributes["xyz"] = child.attributes["value"]
    return replace(root, children=found)


def with_dialects(closures: Closures, root: Element, model: pin.Model, left: LeftOut) -> Closures:
    """Closures with those loops of other programs' elements that they do not state themselves.

    Parameters
    ----------
    closures : Closures
        Those of the closures file, and mimic joints.
    root : Element
        Of :func:`extensions`.
    model : pinocchio.Model
        The tree.
    left : LeftOut
        What is left out, which is put down there.

    Raises
    ------
    FileFormatError
        If a loop is no closure and not left out by name, or two of these dialects state one loop.
    """
    reader = _Reader(root, model, left)
    table, stated = FrameTable(model), dict[frozenset[Any], str]()
    for closure in closures.closures:
        ends = (closure.frame_a, closure.frame_b)
        if closure.kind.is_coupling:
            stated[frozenset(ends)] = closure.name
        elif all(end in table for end in ends):
            stated[frozenset(model.frames[table[end]].parentJoint for end in ends)] = closure.name
    names = {closure.name for closure in closures.closures}
    found: dict[str, _Loop] = {}
    before: dict[frozenset[Any], _Loop] = {}
    for loop in reader.loops():
        own = loop.closure
        bodies = frozenset(end if own.kind.is_coupling else reader.carriers.get(end, -1) for end in loop.ends)
        known = own.name if own.name in names else stated.get(bodies)
        if known is not None:
            left.say("restated", f"{loop.element.place} is closure {known!r}")
            continue
        if loop.problem is not None:
            refuse = partial(FileFormatError, key=loop.problem.key)
            left.named(loop.refused, str(loop.problem), "state it in the closures file", refuse, loop.paste)
        if loop.refused == "loops":
            continue
        twin, other = found.get(own.name), before.setdefault(bodies, loop)
        if twin is not None and twin is not other:
            raise loop.element.error(f"{twin.element.place} on line {twin.element.line} has this name, too")
        if twin is not None or other.element.tag != loop.element.tag:
            raise loop.element.error(
                f"the loop between {' and '.join(map(repr, loop.ends))} is stated on line {other.element.line}, too, "
                f"by {other.element.place}: take one of the two out, or state it in the closures file{loop.paste}"
            )
        if len(bodies) == 1:
            one, two = (
                reader.places[end] * se3(place)
                for end, place in zip(loop.ends, (own.placement_a, own.placement_b), strict=True)
            )
            if np.linalg.norm(one.translation - two.translation) > _APART:
                raise loop.element.error("it joins two places of one rigid body that are apart")
            left.say("rigid", f"{loop.element.place} joins two frames of one rigid body")
            continue
        if loop.note:
            left.say(loop.note, loop.element.place)
        found[own.name] = loop
    taken = names | set(model.names)
    more = [
        loop.closure if name not in taken else replace(loop.closure, name=free_name(f"{name}_closure", taken))
        for name, loop in found.items()
    ]
    return replace(closures, closures=(*closures.closures, *more)) if more else closures


@dataclass(frozen=True)
class _Loop:
    """A loop as an element states it; the problem of what no closure holds, and its name in ``leave_out``.

    A loop that no closure holds has one of its name between its ends.
    """

    element: Element
    closure: Closure
    problem: FileFormatError | None = None
    refused: str = ""
    note: str = ""

    @property
    def ends(self) -> tuple[str, str]:
        return self.closure.frame_a, self.closure.frame_b

    @property
    def paste(self) -> str:
        """The text for the closures file, whose type is to be chosen where there is no closure."""
        text = closures_text(Closures("robot", closures=(self.closure,)))
        choose = "\n# choose the type, and add where it is: translation_a_m, translation_b_m, axis"
        told = choose if self.refused == "loops" else ""
        return f"\n\n{text[text.index('[[closures]]') :].rstrip()}{told}"


class _Reader:
    """Reads the loops of a document on a tree whose joints are at zero."""

    def __init__(self, root: Element, model: pin.Model, left: LeftOut) -> None:
        self._root, self._left, self._model = root, left, model
        data = model.createData()
        pin.framesForwardKinematics(model, data, pin.neutral(model))
        links = [k for k, frame in enumerate(model.frames) if frame.type == pin.FrameType.BODY]
        self.places = {"universe": pin.SE3.Identity()} | {model.frames[k].name: data.oMf[k] for k in links}
        self.carriers = {"universe": 0} | {model.frames[k].name: model.frames[k].parentJoint for k in links}

    def loops(self) -> Iterator[_Loop]:
        """All of them."""
        for element in self._root.children:
            if element.tag == "drake:linear_bushing_rpy":
                what = f"{element.place} is a spring between two frames"
                self._left.named("bushings", what, "a chain has springs in joints alone", element.error)
            for part, read in self._parts(element):
                try:
                    yield read(part)
                except InvalidInput as error:
                    problem = error if isinstance(error, FileFormatError) else part.error(str(error))
                    yield _without(self._name(part), part, ("?", "?"), problem)
        yield from self._closing_frames()

    def _parts(self, element: Element) -> Iterator[tuple[Element, Callable[[Element], _Loop]]]:
        """The elements in one of a robot's that state a loop each; others are put down."""
        own = {"drake:ball_constraint": self._drake, "loop_joint": self._isaac}
        if element.tag in own:
            yield element, own[element.tag]
        elif element.tag == "mujoco":
            for child in element.children:
                if child.tag == "equality":
                    yield from ((part, self._equality) for part in child.children if self._is_active(part))
                else:
                    self._say(child, "mujoco")
        elif element.tag == "gazebo":
            for child in element.children:
                if child.tag == "joint":
                    yield child, self._sdf
                elif child.tag == "plugin" and _DETACHABLE.search(" ".join(child.attributes.values())):
                    yield child, self._detachable
                elif child.tag in ("link", "model", "include") and "reference" not in element.attributes:
                    what = f"{child.place}: a body that Gazebo adds"
                    self._left.named("loops", what, "make it a link of the URDF", child.error)
                else:
                    self._say(child, "gazebo")

    def _say(self, element: Element, around: str) -> None:
        self._left.say(name_of_element(element.tag), f"<{element.tag}> in <{around}>")

    def _is_active(self, element: Element) -> bool:
        if element.attributes.get("active", "true") == "true":
            return True
        self._left.say("inactive", f"equality {self._name(element)!r}, which is not active")
        return False

    def _name(self, element: Element) -> str:
        return element.attributes.get("name") or f"{element.tag.replace(':', '_')}_{element.line}"

    def _end(self, element: Element, name: str | None) -> str:
        """A link of the URDF, or the world."""
        if name == "world" and name not in self.places:
            return "universe"
        if not name:
            raise element.error("a link is missing")
        if name not in self.places:
            raise element.error(f"there is no link {name!r}")
        return name

    def _at(
        self, element: Element, kind: str, ends: tuple[str, str], at_a: pin.SE3, at_b: pin.SE3 | None = None
    ) -> _Loop:
        """A loop at a frame of its first end, and of its second one where the joints are zero unless it is given."""
        here = self.places[ends[1]].actInv(self.places[ends[0]] * at_a) if at_b is None else at_b
        closure = Closure(self._name(element), kind, *ends, placement_of(at_a), placement_of(here))
        return _Loop(element, closure)

    def _sdf(self, element: Element) -> _Loop:
        for _ in checked(element, "sdf", strange=lambda name, where: self._left.say(name_of_element(name), where)):
            pass
        links = [
            Element("link", {"name": name}, element.line, name, [_pose(place, element)])
            for name, place in self.places.items()
            if name not in ("universe", "world") and "::" not in name
        ]
        model = Element("model", {"name": "robot"}, element.line, element.place, [*links, element])
        joint = read_joint(Scope(model), element)
        assert joint is not None
        ends = (self._end(element, joint.child), self._end(element, joint.parent))
        if not is_closure(joint):
            return _without(self._name(element), element, ends, "no closure has two axes that are not at right angles")
        closure = replace(closure_of(joint, self.places | {"world": self.places[ends[1]]}), frame_b=ends[1])
        found = _Loop(element, closure, note="" if joint.is_bare else "loop_limits")
        if joint.damping or any(axis.damping or axis.friction or axis.stiffness or axis.mimic for axis in joint.axes):
            problem = element.error(
                "no closure has springs, damping, friction or a mimic; cut the loop at another joint"
            )
            return replace(found, problem=problem, refused="loop_forces")
        return found

    def _detachable(self, element: Element) -> _Loop:
        texts = {child.tag: child.text for child in element.children}
        ends = (self._end(element, texts.get("parent_link")), self._end(element, texts.get("child_link")))
        if texts.get("child_model") not in (self._root.attributes["name"], "__model__"):
            return _without(self._name(element), element, ends, f"it holds model {texts.get('child_model')!r}")
        # The name of a plugin is that of its kind.
        named = replace(element, attributes={"name": "_".join(ends)})
        return self._at(named, "rigid", ends, pin.SE3.Identity())

    def _drake(self, element: Element) -> _Loop:
        ends, points = [], []
        for body, point in (("body_A", "p_AP"), ("body_B", "p_BQ")):
            one = element.first(f"drake:ball_constraint_{body}")
            if one is None:
                raise element.error(f"<drake:ball_constraint_{body}> is missing")
            ends.append(self._end(one, one.attributes.get("name")))
            at = element.first(f"drake:ball_constraint_{point}")
            points.append(pin.SE3(np.eye(3), vector(at, "xyz", NOTHING)))
        return self._at(element, "spherical", (ends[0], ends[1]), *points)

    def _isaac(self, element: Element) -> _Loop:
        links = [element.first(tag) for tag in ("link1", "link2")]
        if None in links:
            raise element.error("expected <link1> and <link2>")
        one, two = (self._end(element, link.attributes.get("link")) for link in links if link is not None)
        kind = element.attributes.get("type")
        if kind != "spherical":
            return _without(self._name(element), element, (one, two), f"Isaac closes loops by balls alone, not {kind}")
        return self._at(element, "spherical", (one, two), *map(origin_of, links))

    def _equality(self, element: Element) -> _Loop:
        given = element.attributes
        if element.tag == "joint":
            return self._coupling(element)
        if element.tag not in ("connect", "weld") or "body1" not in given:
            raise element.error("connect and weld of bodies, and joint, are read")
        ends = (self._end(element, given["body1"]), self._end(element, given.get("body2", "world")))
        anchor = pin.SE3(np.eye(3), vector(element, "anchor", NOTHING))
        if element.tag == "connect":
            return self._at(element, "spherical", ends, anchor)
        pose = numbers(element, "relpose", 7) if "relpose" in given else [0.0] * 7
        between = self.places[ends[0]].actInv(self.places[ends[1]])
        if any(pose[3:]):
            w, x, y, z = pose[3:]
            between = pin.SE3(pin.Quaternion(w, x, y, z).normalized(), np.array(pose[:3]))
        if float(vector(element, "torquescale", (1.0,))[0]) == 0.0:
            return self._at(element, "spherical", ends, between * anchor, anchor)
        return self._at(element, "rigid", ends, between, pin.SE3.Identity())

    def _coupling(self, element: Element) -> _Loop:
        """q_1 = Σ c_k q_2^k, of joints that count from zero."""
        joints = [element.attributes.get(key, "universe") for key in ("joint2", "joint1")]
        for name in joints:
            index = self._model.getJointId(name) if self._model.existJointName(name) else 0
            if name != "universe" and self._model.nqs[index] != 1:
                raise element.error(f"there is no hinge or slide {name!r} that counts its turns: couple it by <mimic>")
        powers = numbers(element, "polycoef", 5) if "polycoef" in element.attributes else [0.0, 1.0]
        powers = powers[:1] if joints[0] == "universe" else powers
        return _Loop(element, Closure(self._name(element), "coupling", joints[0], joints[1], polynomial=tuple(powers)))

    def _closing_frames(self) -> Iterator[_Loop]:
        """Pairs of frames of onshape-to-robot."""
        links = {element.attributes["name"]: element for element in self._root.all("link")}
        frames = {name: (name, pin.SE3.Identity(), links.get(name, self._root)) for name in self.places}
        for element in self._root.all("frame"):
            if element.attributes.get("link") in self.places and "name" in element.attributes:
                frames[element.attributes["name"]] = (element.attributes["link"], origin_of(element), element)
        for name in frames:
            match = _CLOSING.fullmatch(name)
            if match is None:
                continue
            pair = (name, f"{name[:-1]}2")
            called, where = f"closing_{match[1]}", frames[name][2]
            element = Element("closing_frames", {"name": called}, where.line, f"frame {name!r}")
            if pair[1] not in frames:
                yield _without(called, element, (frames[name][0], "?"), f"there is no frame {pair[1]!r} for it")
                continue
            (one, at_one, _), (two, at_two, _) = (frames[each] for each in pair)
            found = self._at(element, "spherical", (one, two), at_one, at_two)
            second = [frames.get(f"{each}_z") for each in pair]
            along = [
                (self.places[own] * at).actInv(self.places[end[0]] * end[1]).translation
                for (own, at), end in zip(((one, at_one), (two, at_two)), second, strict=True)
                if end is not None
            ]
            if not along:
                # Those of a fastened joint look the same.
                found = replace(found, note="closing_frames")
            elif len(along) == 2 and all(np.hypot(*each[:2]) < _ALONG * each[2] for each in along):
                found = replace(found, closure=replace(found.closure, type="revolute"))
            else:
                found = _without(called, element, (one, two), "its frames _z do not both stand on the z axes")
            yield found


def _is_closing(element: Element) -> bool:
    return element.tag == "link" and element.attributes.get("name", "").startswith("closing_")


def _without(name: str, element: Element, ends: tuple[str, str], why: str | FileFormatError) -> _Loop:
    problem = element.error(why) if isinstance(why, str) else why
    return _Loop(element, Closure(name, "spherical", *ends), problem, "loops")


def _pose(place: pin.SE3, element: Element) -> Element:
    at: Placement = placement_of(place)
    form = {"rotation_format": "quat_xyzw"}
    return Element("pose", form, element.line, element.place, text=as_numbers([*at.translation, *at.quaternion]))
