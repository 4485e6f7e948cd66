"""What a reader leaves out of a robot's file: what has no effect, and what the caller names.

What a chain cannot hold and changes the mechanism, or has forces that are sure to act, is refused, unless the caller
names it in ``leave_out``. What was left out stands in the ``left_out`` of the closures, one entry for each name, with
its effect (no effect, may change forces, changes the mechanism) and what it means for the answers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType

from ...core.errors import FileFormatError
from ...core.records import OneProcess
from ...core.validation import as_choice, as_texts

#: Effects of what is left out, from none to the largest.
EFFECTS = ("no effect", "may change forces", "changes the mechanism")
_NONE, _FORCES, _MECHANISM = EFFECTS
#: What can be left out by name, and what that is.
LEAVE_OUT = MappingProxyType(
    {
        "actuator_rotors": "rotors and damping of actuators that act on tendons, sites or ball joints",
        "ball_limits": "limits of ball and free joints",
        "bushings": "springs and dampers between two frames",
        "fluid": "forces of air and water",
        "free_joint_rotors": "rotors and dry friction of free joints",
        "gravcomp": "links on which no gravity acts, or less",
        "empty_limits": "limits with the lower one above the upper one: the joint has none",
        "idle_forces": "ranges of force or control without 0, which make an actuator push without control",
        "includes": "parts of the robot in other files, or in the state of a world",
        "inertia_rules": "rules that inertias obey: no moment is negative, or above the sum of the others",
        "joint_types": "joints of types that no chain has",
        "kinematic": "links that are moved from outside",
        "loop_forces": "springs, damping and friction of joints that close loops",
        "loops": "loops and bodies of other programs' elements that no closure holds",
        "nonlinear_springs": "what of springs and dampers is not linear",
        "tendons": "what of tendons is no straight cable that pulls and no linear spring",
    }
)
#: Those of them that change the mechanism: its freedoms, loops or ranges.
_OF_MECHANISM = ("ball_limits", "empty_limits", "includes", "joint_types", "kinematic", "loops", "tendons")
#: What is left out without being named: effect, and what that means.
_NOTED = {
    "axes": (_NONE, "the joint has no such axis, or the specification's, which is z"),
    "actuators": (_FORCES, "they exert nothing here; give their forces as external ones"),
    "cables": (_FORCES, "a device of this robot has them; the chain alone does not feel them"),
    "closures": (_NONE, "a URDF states no loops by itself; a robot that has some needs the file"),
    "closing_frames": (_FORCES, "a ball is the weaker joint; state another type in the closures file"),
    "contact": (_FORCES, "bodies pass through each other"),
    "control_laws": (_FORCES, "efforts are given as forces"),
    "digits": (_NONE, "the geometry is read as known to its digits"),
    "geoms": (_NONE, "shapes that are not drawn"),
    "inactive": (_NONE, "switched off in the file"),
    "limits": (_FORCES, "the joint has no ends"),
    "loop_limits": (_FORCES, "the closure has no ends, and no limit of speed or effort"),
    "mimic": (_NONE, "a fixed joint does not move"),
    "mocap": (_FORCES, "it stands still"),
    "pictures": (_NONE, "shapes that are not drawn"),
    "programs": (_NONE, "for drawing, sensing and control by other programs"),
    "restated": (_NONE, "the closures file states the loop, and counts"),
    "rigid": (_NONE, "one body cannot move against itself"),
    "rounding": (_NONE, "read as written"),
    "renamed": (_NONE, "a link has the name of the joint in the file"),
    "unread": (_FORCES, "of other programs, which may exert forces by it"),
}
#: Elements of other programs by what they are for; others are unread.
_PROGRAMS = frozenset(
    (
        "actor", "allow_auto_disable", "audio", "audio_sink", "audio_source", "battery", "camera", "compiler",
        "disableFixedJointLumping", "frame", "gazebo", "gui", "laserRetro", "light", "magnetic_field", "material",
        "particle_emitter", "preserveFixedJoint", "projector", "provideFeedback", "road", "ros2_control", "scene",
        "self_filter", "sensor", "size", "spherical_coordinates", "statistic", "transmission", "verbose", "visual",
    )
)  # fmt: skip
_CONTACT = frozenset(
    (
        "collision", "collision_checking", "contact", "contact_coefficients", "fdir1", "kd", "kp", "maxContacts",
        "maxVel", "minDepth", "mu1", "mu2", "selfCollide", "self_collide", "surface",
    )
)  # fmt: skip
#: So many things of one name are said one by one.
_SAID = 6


class LeftOut(OneProcess):
    """What one reading leaves out.

    Parameters
    ----------
    leave_out : iterable of str
        Names of :data:`LEAVE_OUT`.
    error : callable
        Makes the error of the file, or of an element, from a message.

    Raises
    ------
    UnknownName
        If there is no such name.
    """

    def __init__(
        self, leave_out: Iterable[str] = (), error: Callable[[str], FileFormatError] = FileFormatError
    ) -> None:
        given = leave_out if isinstance(leave_out, str) else tuple(leave_out)
        self._named = {as_choice("thing to leave out", name, LEAVE_OUT) for name in as_texts("leave_out", given)}
        self._error, self._found = error, dict[str, list[str]]()

    def named(
        self, name: str, what: str, advice: str, error: Callable[[str], FileFormatError] | None = None, more: str = ""
    ) -> None:
        """Leave out what changes the motion.

        Parameters
        ----------
        name : str
            Of :data:`LEAVE_OUT`.
        what, advice : str
            What it is and where, and how to do without it.
        error : callable, optional
            The error of the element.
        more : str
            Lines for the end of the message, such as a text to paste.

        Raises
        ------
        FileFormatError
            If the caller did not name it.
        """
        if name not in self._named:
            effect = f"; it {_MECHANISM}" if name in _OF_MECHANISM else ""
            raise (error or self._error)(
                f'{what}: {advice}, or leave it out with leave_out=["{name}"] (--leave-out {name}){effect}{more}'
            )
        self.say(name, what)

    def say(self, name: str, what: str) -> None:
        """Note what has no effect on the motion, or is no part of a chain."""
        self._found.setdefault(name, []).append(what)

    def unread(self, elements: Mapping[tuple[str, str], int]) -> None:
        """Note elements of other programs: how often each is there, by its tag and where it is."""
        for (tag, where), count in elements.items():
            self.say(name_of_element(tag), where if count == 1 else f"{where}, {count} times")

    def has(self, *names: str) -> bool:
        """Whether something of these names was left out."""
        return not self._found.keys().isdisjoint(names)

    @property
    def report(self) -> tuple[str, ...]:
        """One entry for each name: the name, what was left out, its effect and what that means."""
        found = []
        for name, whats in self._found.items():
            unique = list(dict.fromkeys(whats))
            if len(unique) > _SAID:
                unique[_SAID - 1 :] = [f"and {len(unique) - _SAID + 1} more"]
            found.append(entry(name, "; ".join(unique)))
        return tuple(found)


def entry(name: str, what: str) -> str:
    """One entry of ``left_out``.

    Parameters
    ----------
    name : str
        Of :data:`LEAVE_OUT`, or of what is left out without being named.
    what : str
        What was left out.
    """
    if name in LEAVE_OUT:
        effect, meaning = _MECHANISM if name in _OF_MECHANISM else _FORCES, LEAVE_OUT[name]
    else:
        effect, meaning = _NOTED[name]
    return f"{name}: {what} ({effect}: {meaning})"


def name_of_element(tag: str) -> str:
    """Under which name an element of other programs is left out."""
    return "programs" if tag in _PROGRAMS else "contact" if tag in _CONTACT else "unread"
