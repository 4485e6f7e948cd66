"""What the page asks: a person, a device and a pose, with the call in Python that gives the same answer."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ..core.conventions import shoulder_angles
from ..core.errors import MissingExtra
from ..core.optional_packages import require_extra
from ..core.validation import FloatArray
from ..design import DEFAULT_PRESET
from ..exo.loading import load
from ..exo.pose_report import PoseReport, report_on_pose
from ..exo.shoulder_exo import ShoulderExo
from ..load_case import Motion
from ..person import Person
from ..view.scene.panels import ANGLES

_STILL = (0.0, 0.0, 0.0)
#: Fields of an arm at rest.
AT_REST: dict[str, Any] = {"angular_velocity": _STILL, "angular_acceleration": _STILL}


@dataclass(frozen=True)
class Asked:
    """Everything that the page knows of a question.

    Attributes
    ----------
    design : str
        A preset, or the path of a file, as :func:`exo_pin.load` takes it.
    changes : tuple of (str, float)
        Dimensions of the device by name, in the unit that the name ends in.
    side : {"left", "right"}
        Of the body.
    height, mass : float
        Of the person, m and kg.
    sex : {"male", "female"}
        Of the person.
    elbow : float
        Bend of the elbow, degrees.
    payload : float
        In the hand, kg.
    strength : float
        Of the person's muscles, percent.
    girth, clothing : float
        Girth of the upper arm (0 for that of the person's size) and thickness of clothing, mm.
    flexion, abduction, internal_rotation : float
        The pose, degrees.
    angular_velocity, angular_acceleration : tuple of float
        Of the arm, rad/s and rad/s², base frame.
    shown : str
        What the design's file is called where it came from; empty where ``design`` says it.
    """

    design: str = DEFAULT_PRESET
    changes: tuple[tuple[str, float], ...] = ()
    side: str = "left"
    height: float = 1.75
    mass: float = 75.0
    sex: str = "male"
    elbow: float = 0.0
    payload: float = 0.0
    strength: float = 100.0
    girth: float = 0.0
    clothing: float = 0.0
    flexion: float = 0.0
    abduction: float = 0.0
    internal_rotation: float = 0.0
    angular_velocity: tuple[float, ...] = _STILL
    angular_acceleration: tuple[float, ...] = _STILL
    shown: str = ""

    @property
    def name(self) -> str:
        """What the design is called on the page, and whether it was changed."""
        return f"{self.shown or self.design}{', changed' if self.changes else ''}"

    @property
    def angles(self) -> tuple[float, float, float]:
        """Flexion, abduction and internal rotation, degrees."""
        return self.flexion, self.abduction, self.internal_rotation

    @property
    def anywhere(self) -> Asked:
        """The same in the pose at rest: equal for all poses of a device on a person."""
        return replace(self, flexion=0.0, abduction=0.0, internal_rotation=0.0, **AT_REST)

    @property
    def exo(self) -> ShoulderExo:
        """The device on its wearer."""
        return _worn(self.anywhere)

    @property
    def bare(self) -> ShoulderExo:
        """The device as its file has it, with what is changed."""
        return _bare(self.design, self.side, self.changes)

    def changed(self, name: str, value: float) -> Asked:
        """The same with another value of a dimension."""
        return replace(self, changes=tuple(sorted((dict(self.changes) | {name: value}).items())))

    @property
    def person(self) -> Person:
        """Who wears it."""
        return _person(self.anywhere)

    @property
    def pose(self) -> Rotation:
        """The arm's pose, {O_B} to {O_A}."""
        return self.exo.pose(*self.angles)

    @property
    def motion(self) -> Motion | None:
        """How the arm moves; None at rest."""
        given = self.angular_velocity, self.angular_acceleration
        return None if given == (_STILL, _STILL) else Motion(np.array(given[0]), np.array(given[1]))

    @property
    def hand(self) -> FloatArray:
        """The end of the hand in the arm's frame, shape (3,), m."""
        person, bend = self.person, self.person.elbow_flexion
        forearm = person.forearm_length * np.array([np.sin(bend), 0.0, -np.cos(bend)])
        return np.asarray(forearm - [0.0, 0.0, person.upper_arm_length])

    @property
    def joints(self) -> dict[str, FloatArray]:
        """Centres of joints on torso and arm by name, in this pose, shape (3,), m, base frame."""
        places = self.exo.device.places().items()
        found = {name: at for name, at in places if name.startswith("A[")}
        return found | {name: self.pose.apply(at) for name, at in places if name.startswith("B[")}

    def with_joint_at(self, name: str, place: FloatArray) -> Asked:
        """The same with a joint centre elsewhere, shape (3,), m, base frame, as dimensions that the design changes."""
        own = self.pose.inv().apply(place) if name.startswith("B[") else place
        known = replace(self, changes=()).bare.device.dimensions()
        changes = dict[str, float]()
        for key, value in self.bare.device.with_place(name, own).dimensions().items():
            if abs(value - known.get(key, np.inf)) > 1e-9:
                stem, _, unit = key.rpartition("_")
                size, shown = {"m": (1e3, "mm"), "rad": (180.0 / np.pi, "deg")}[unit]
                changes[f"{stem}_{shown}"] = round(size * value, 2)
        return replace(self, changes=tuple(sorted(changes.items())))

    def with_hand_at(self, place: FloatArray) -> dict[str, float]:
        """Angles of the pose that brings the hand towards a place, shape (3,), m, by the shortest turn, in degrees."""
        turn, _ = Rotation.align_vectors(place, self.pose.apply(self.hand))
        angles = shoulder_angles(turn * self.pose, self.side, degrees=True)
        return {
            name: float(np.clip(round(float(angle)), *ends))
            for (name, ends), angle in zip(ANGLES.items(), angles, strict=True)
        }

    def report(self, moving: bool = False) -> PoseReport:
        """The answer; ``moving`` leaves out what can wait while the arm moves: remedy, and tension that is kept."""
        exo, person = self.exo, self.person if has_muscles() else None
        answer = exo.reaction(self.pose, self.motion)
        if not moving:
            return report_on_pose(exo, answer, person, angles=self.angles)
        contact = None
        if person is not None:
            contact = exo.joint_contact(self.pose, person, answer, self.motion, outside="mark")
        return PoseReport(answer, None, contact)

    def python(self) -> str:
        """The same question in Python; what it prints begins with the verdict."""
        lines = ["import exo_pin as ep", "from exo_pin.exo.pose_report import report_on_pose", ""]
        said = "".join(f", {name}={value!r}" for name, value in _options(self).items())
        angles = ", ".join(f"{angle:.9g}" for angle in self.angles)
        lines += [
            f'person = ep.Person({self.height:g}, {self.mass:g}, "{self.sex}"{said})',
            f'exo = ep.load("{self.shown or self.design}", side="{self.side}")',
        ]
        if self.changes:
            changed = ", ".join(f'"{name}": {value:.9g}' for name, value in self.changes)
            lines.append(f"exo = ep.ShoulderExo.from_device(exo.device.with_dimensions(**{{{changed}}}))")
        moves = ""
        if self.motion is not None:
            moves = f", ep.Motion({[*self.angular_velocity]}, {[*self.angular_acceleration]})"
        lines += [
            "exo = exo.worn_by(person)",
            f"answer = exo.reaction(exo.pose({angles}){moves})",
            f"print(report_on_pose(exo, answer, person, angles=({angles})))",
        ]
        return "\n".join(lines)


@lru_cache(maxsize=16)
def _bare(design: str, side: str, changes: tuple[tuple[str, float], ...]) -> ShoulderExo:
    if changes:
        return ShoulderExo.from_device(_bare(design, side, ()).device.with_dimensions(**dict(changes)))
    return load(design, side=side)


@lru_cache(maxsize=16)
def _worn(asked: Asked) -> ShoulderExo:
    return _bare(asked.design, asked.side, asked.changes).worn_by(asked.person)


@lru_cache(maxsize=16)
def _person(asked: Asked) -> Person:
    return Person(asked.height, asked.mass, asked.sex, **_options(asked))


def _options(asked: Asked) -> dict[str, Any]:
    """What is said of a person besides height, mass and sex; what is as by default is left out."""
    girth = asked.girth / 1e3 or None
    said = {
        "elbow_flexion": asked.elbow, "payload": asked.payload, "strength": asked.strength / 100.0,
        "arm_girth": girth, "clothing": asked.clothing / 1e3, "side": asked.side,
    }  # fmt: skip
    usual = {"elbow_flexion": 0.0, "payload": 0.0, "strength": 1.0, "arm_girth": None, "clothing": 0.0, "side": "left"}
    found = {name: value for name, value in said.items() if value != usual[name]}
    return found | ({"degrees": True} if "elbow_flexion" in found else {})


@lru_cache(maxsize=1)
def has_muscles() -> bool:
    """Whether the extra with the wearer's muscles is installed."""
    try:
        require_extra("person")
    except MissingExtra:
        return False
    return True
