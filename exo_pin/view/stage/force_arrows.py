"""Forces in the scene: arrows to one scale, with labels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...core.records import OneProcess, Record
from ...core.validation import FloatArray
from ...reaction import Reaction, Split
from ...reaction.answer import BEYOND
from ..colours import BLACK, BLUE, GREEN, ORANGE, PURPLE, RED, SKY
from .shapes import Arrow, TurningArrow, trimmed
from .stage import Stage

if TYPE_CHECKING:
    from ...person import JointContact

#: Length of the largest force at most, where the arrows scale themselves, m; at least two thirds of it.
GOOD_LENGTH = 0.24
#: No arrow is drawn longer, m; shorter ones than the second are not drawn, nor is their label.
LONGEST, _SHORTEST = 0.40, 0.003
#: Smaller moments are not drawn, N m.
LEAST_MOMENT = 0.01
#: Share of a motion's poses whose largest force the scale goes by: the others lie near a singular pose and are cut.
_SHARE = 95.0
#: What 10 cm can mean, times a power of ten, N.
_STEPS = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
#: Radius of the arrows' shafts, and of the circle of a moment's arrow, m.
_MAIN, _LIMB, _SIDE, _TURN = 0.0075, 0.0055, 0.0035, 0.045


class ArrowKind(NamedTuple):
    """How a kind of force is drawn, and what the legend says of it."""

    colour: str
    glyph: str
    text: str
    radius: float = _LIMB
    heads: int = 1
    tail: bool = False
    #: Whether the scale goes by it.
    counts: bool = True


#: Kinds of arrows, as the legend has them.
KINDS = {
    "shoulder": ArrowKind(RED, "tail", "shoulder reaction F_s", _MAIN, tail=True),
    "contact": ArrowKind(BLACK, "tail", "joint's contact force", tail=True),
    "weight": ArrowKind(GREEN, "arrow", "weight of arm and device", _MAIN),
    "own weight": ArrowKind(GREEN, "arrow", "weight of the wearer's arm", _MAIN),
    "cuff": ArrowKind(SKY, "arrow", "cuff's pull along the arm, made by the limbs", _MAIN, counts=False),
    "device": ArrowKind(SKY, "arrow", "force of the device on the arm, at the cuff", _MAIN),
    "pull": ArrowKind(BLUE, "arrow", "limb pulls, f > 0"),
    "push": ArrowKind(ORANGE, "double", "limb pushes, f < 0", heads=2),
    "part pulls": ArrowKind(BLUE, "arrow", "drive or spring pulls", counts=False),
    "part pushes": ArrowKind(ORANGE, "double", "drive or spring pushes", heads=2, counts=False),
    "side": ArrowKind(PURPLE, "thin", "side force of a limb, g", _SIDE),
    "turn": ArrowKind(BLUE, "turn", "moment of a drive, not to scale", counts=False),
    "spring turns": ArrowKind(ORANGE, "turn", "moment of a spring, not to scale", counts=False),
    "wearer": ArrowKind(BLACK, "turn", "moment that the wearer adds, not to scale", counts=False),
}
_MOMENTS = ("turn", "spring turns", "wearer")


class DrawnForce(NamedTuple):
    """A force or a moment in the scene.

    Attributes
    ----------
    key : str
        Its node, which belongs to one kind.
    kind : str
        Of :data:`KINDS`.
    at : ndarray
        Where it starts, shape (3,), m, base frame; of a moment the middle of its circle.
    vector : ndarray
        Shape (3,), N or N m, base frame; NaN where it is not known.
    name : str
        What its label calls it.
    ends_there : bool
        Whether it ends at ``at`` and does not start there.
    more : str
        What its label says behind its size.
    """

    key: str
    kind: str
    at: FloatArray
    vector: FloatArray
    name: str
    ends_there: bool = False
    more: str = ""

    @property
    def size(self) -> float:
        """N or N m; NaN where it is not known."""
        return float(np.linalg.norm(self.vector))

    @property
    def text(self) -> str:
        """Its label."""
        size = f"{self.size:.1f} N m" if self.kind in _MOMENTS else f"{self.size:.0f} N"
        return f"{self.name} {size}{self.more}"


@dataclass(frozen=True, eq=False)
class PoseContact(Record):
    """Contact force of the shoulder joint in one pose; a row of a :class:`JointContact`.

    ``bare`` is the size of the force without the device, ``most`` the largest activation with it or without. What has
    no value is NaN.
    """

    force: FloatArray
    percent: float
    bare: float
    activations: FloatArray
    most: float
    status: str

    @classmethod
    def of(cls, contact: JointContact, index: tuple[int, ...]) -> PoseContact:
        """That of a pose of a stack; () for a single pose."""
        bare = contact if contact.without_device is None else contact.without_device
        activations = contact.activations[index]
        return cls(
            contact.force[index],
            float(contact.percent_body_weight[index]),
            float(bare.magnitude[index]),
            activations,
            float(np.fmax(activations, bare.activations[index]).max()),
            str(contact.status[index]),
        )


@dataclass(frozen=True, eq=False)
class ShownForces(Record):
    """Forces of one pose, N, base frame; rows of a :class:`Reaction`."""

    shoulder: FloatArray
    tensions: FloatArray
    side_forces: FloatArray
    limb_wrenches: FloatArray
    cuff_wrench: FloatArray
    determinant: float
    status: str
    percent: float | None
    split: Split | None
    is_near_singular: bool
    verdict: str
    contact: PoseContact | None = None
    has_device: bool = True
    cuff_pull: float = 0.0
    cuff_slip: float | None = None
    cuff_text: str = ""

    def without_device(self) -> ShownForces:
        """The contact force alone."""
        none: dict[str, Any] = {
            name: np.zeros_like(value) for name, value in vars(self).items() if isinstance(value, np.ndarray)
        }
        none |= {"determinant": float("nan"), "status": "ok", "percent": None, "split": None, "verdict": ""}
        none |= {"is_near_singular": False, "has_device": False, "cuff_pull": 0.0, "cuff_slip": None, "cuff_text": ""}
        return replace(self, **none)

    @classmethod
    def of(cls, answer: Reaction, index: tuple[int, ...], contact: JointContact | None = None) -> ShownForces:
        """Those of a pose of a stack; () for a single pose."""
        percent, slip = answer.percent_body_weight, answer.cuff_slip
        return cls(
            answer.shoulder_force[index],
            answer.actuator_forces[index],
            answer.constraint_forces[index],
            answer.limb_wrenches[index],
            answer.cuff_wrench[index],
            float(answer.determinant[index]),
            str(answer.status[index]),
            None if percent is None else float(percent[index]),
            answer.source.split,
            str(answer.equilibrium_status[index]) == "near_singular",
            _verdict(answer, index),
            None if contact is None else PoseContact.of(contact, index),
            cuff_pull=float(answer.cuff_pull[index]),
            cuff_slip=None if slip is None else float(np.linalg.norm(slip[index][:3])),
            cuff_text=answer.cuff_text(index),
        )


def round_up(value: float) -> float:
    """The least of a few round numbers that is not below ``value``, which is positive."""
    power = 10.0 ** np.floor(np.log10(value))
    # A quotient, so that 0.3 is 0.3 and not 3 times 0.1.
    rounded = [step * power if power >= 1.0 else step / round(1.0 / power) for step in _STEPS]
    return float(min(step for step in rounded if step >= value * (1 - 1e-9)))


class ForcePicture(OneProcess):
    """Arrows for forces, all to one scale, and circles for moments.

    What pulls has an arrow with one head, dark blue; what pushes has two heads, is light orange, and ends where it
    acts. So they differ in shape, lightness and direction.

    Parameters
    ----------
    stage : Stage
        Where they are drawn.
    metres_per_newton : float, optional
        The scale; if left out, one with which the largest force of a pose or a motion has a good length.
    """

    def __init__(self, stage: Stage, metres_per_newton: float | None = None) -> None:
        self._stage, self._given = stage, metres_per_newton
        stage.viewer["forces"].delete()
        self._arrows: dict[str, Arrow | TurningArrow] = {}
        self._labels: list[dict[str, Any]] = []
        self.plan([], [])

    def plan(self, poses: Sequence[ShownForces], drawn: Sequence[Sequence[DrawnForce]]) -> None:
        """Choose the scale and the legend for a pose or for all poses of a motion, with the forces of each."""
        sizes = [[force.size for force in each if KINDS[force.kind].counts] for each in drawn]
        largest = np.array([max(each, default=0.0) if np.isfinite(each).all() else np.nan for each in sizes])
        firm = np.array([forces.status in ("ok", *BEYOND) for forces in poses], dtype=bool) & np.isfinite(largest)
        known = largest[firm if firm.any() else np.isfinite(largest)]
        weights = [force.size for each in drawn for force in each if force.kind in ("weight", "own weight")]
        weight = max(weights, default=0.0)
        top = max(weight, float(np.percentile(known, _SHARE)) if known.size else 0.0) or 1.0
        self.scale = 0.1 / round_up(0.1 * top / GOOD_LENGTH) if self._given is None else self._given
        tensions = np.array([forces.tensions for forces in poses if np.isfinite(forces.tensions).all()])
        #: Top of the scale of the muscles' colours, N.
        self.tension_top = round_up(min(float(tensions.max(initial=0.0)), max(top, weight)) or 1.0)
        for force in (force for each in drawn for force in each):
            self._arrow(force)
        visible = {force.kind for each in drawn for force in each if self._is_visible(force)}
        self._legend = [
            {"glyph": kind.glyph, "colour": kind.colour, "text": kind.text}
            for name, kind in KINDS.items()
            if name in visible
        ]
        longest = max([weight, *largest[np.isfinite(largest)]])
        self._cuts = bool(self.scale * longest > LONGEST * (1 + 1e-9))

    def show(self, drawn: Sequence[DrawnForce]) -> None:
        """Draw the forces of a pose and nothing else."""
        self._labels = []
        shown = {force.key for force in drawn if self._is_visible(force)}
        for force in drawn:
            if force.key in shown:
                self._draw(force)
        for key, arrow in self._arrows.items():
            if key not in shown:
                arrow.hide()
        self._stage.set_panel("labels", self._labels)

    def legend(self) -> tuple[str, list[dict[str, str]]]:
        """The scale in words, and what each arrow is that the planned poses have."""
        scale = f"Forces on the arm: 10 cm = {0.1 / self.scale:g} N"
        return f"{scale}; cut at {LONGEST / self.scale:.4g} N" if self._cuts else scale, self._legend

    def _is_visible(self, force: DrawnForce) -> bool:
        least = LEAST_MOMENT if force.kind in _MOMENTS else _SHORTEST / self.scale
        return bool(force.size >= least)

    def _draw(self, force: DrawnForce) -> None:
        arrow, label = self._arrow(force), {"text": force.text, "colour": KINDS[force.kind].colour}
        if force.kind in _MOMENTS:
            arrow.show(force.at, force.vector)
            start, end = force.at, force.at + np.array([0.0, 0.0, _TURN])
        else:
            vector, cut = trimmed(self.scale * force.vector, LONGEST)
            start = force.at - vector if force.ends_there else force.at
            end = start + vector
            arrow.show(start, vector)
            label["text"] += " (cut)" if cut else ""
        ends = [start.tolist(), end.tolist()]
        self._labels.append(label | {"at": ends[not force.ends_there], "arrow": ends})

    def _arrow(self, force: DrawnForce) -> Arrow | TurningArrow:
        """The arrow of a force, made when it is first seen: so that those of a motion are there from its start."""
        if force.key not in self._arrows:
            kind, path = KINDS[force.kind], f"/meshcat/forces/{force.key}"
            self._arrows[force.key] = (
                TurningArrow(self._stage, path, kind.colour, _TURN)
                if force.kind in _MOMENTS
                else Arrow(self._stage, path, kind.colour, kind.radius, kind.heads, kind.tail)
            )
        return self._arrows[force.key]


def _verdict(answer: Reaction, index: tuple[int, ...]) -> str:
    """The verdict on a pose; on one of a stack only that it cannot be held, because it is drawn many times a second."""
    if answer.equilibrium_status.ndim == 0:
        return answer.verdict
    return "The device cannot hold this pose." if answer.limits.violated[index] else ""
