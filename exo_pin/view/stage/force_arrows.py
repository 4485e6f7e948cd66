"""Forces in the scene: arrows to one scale, with labels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.records import OneProcess, Record
from ...core.validation import FloatArray
from ...design import WristGeometry
from ...design.holding_frame import WALL, sleeve_size
from ...reaction import Reaction, Split
from ...reaction.answer import BEYOND
from ...wrist import LimbState, inverse_kinematics
from ..colours import BLACK, BLUE, GREEN, ORANGE, PURPLE, RED, SKY
from .shapes import Arrow, trimmed
from .stage import Stage

if TYPE_CHECKING:
    from ...exo.shoulder_exo import ShoulderExo
    from ...person import JointContact

#: Length of the largest force at most, where the arrows scale themselves, m; at least two thirds of it.
GOOD_LENGTH = 0.24
#: No arrow is drawn longer, m; shorter ones than the second are not drawn, nor is their label.
LONGEST, _SHORTEST = 0.40, 0.003
#: Share of a motion's poses whose largest force the scale goes by: the others lie near a singular pose and are cut.
_SHARE = 95.0
#: What 10 cm can mean, times a power of ten, N.
_STEPS = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
#: Radius of arrows' shafts, and distances of tension arrows from their limb and of the cuff's arrow from its sleeve, m.
_MAIN, _LIMB, _SIDE, _BESIDE, _FROM_CUFF = 0.0075, 0.0055, 0.0035, 0.032, 0.015
#: Kinds of arrows, as the legend has them.
_LEGEND = (
    ("shoulder", {"glyph": "tail", "colour": RED, "text": "shoulder reaction F_s"}),
    ("contact", {"glyph": "tail", "colour": BLACK, "text": "joint's contact force"}),
    ("weight", {"glyph": "arrow", "colour": GREEN, "text": "weight of arm and device"}),
    ("cuff", {"glyph": "arrow", "colour": SKY, "text": "cuff's pull along the arm, made by the limbs"}),
    ("pull", {"glyph": "arrow", "colour": BLUE, "text": "limb pulls, f > 0"}),
    ("push", {"glyph": "double", "colour": ORANGE, "text": "limb pushes, f < 0"}),
    ("side", {"glyph": "thin", "colour": PURPLE, "text": "side force of a limb, g"}),
)


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
    limb_forces: FloatArray
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
        none, each = np.zeros(3), np.zeros(len(self.tensions))
        limbs, nan = np.zeros((len(each), 3)), float("nan")
        return ShownForces(none, each, each, limbs, nan, "ok", None, None, False, "", self.contact, has_device=False)

    @classmethod
    def of(cls, answer: Reaction, index: tuple[int, ...], contact: JointContact | None = None) -> ShownForces:
        """Those of a pose of a stack; () for a single pose."""
        percent, slip = answer.percent_body_weight, answer.cuff_slip
        return cls(
            answer.shoulder_force[index],
            answer.actuator_forces[index],
            answer.constraint_forces[index],
            answer.limb_wrenches[index][..., :3],
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

    @property
    def largest(self) -> float:
        """Largest of the shoulder's force, the limb forces and the side forces, N; NaN without an answer."""
        parts = [np.linalg.norm(self.shoulder), *np.abs(self.tensions), *np.abs(self.side_forces)]
        if self.contact is not None:
            parts.append(np.nan_to_num(np.linalg.norm(self.contact.force)))
        return float(max(parts)) if np.isfinite(parts).all() else float("nan")


def round_up(value: float) -> float:
    """The least of a few round numbers that is not below ``value``, which is positive."""
    power = 10.0 ** np.floor(np.log10(value))
    # A quotient, so that 0.3 is 0.3 and not 3 times 0.1.
    rounded = [step * power if power >= 1.0 else step / round(1.0 / power) for step in _STEPS]
    return float(min(step for step in rounded if step >= value * (1 - 1e-9)))


class ForcePicture(OneProcess):
    """Arrows for the forces on the arm.

    A limb that pulls has an arrow with one head, dark blue, from its joint on the arm towards the torso; one that
    pushes has two heads, is light orange, and ends at the joint. So they differ in shape, lightness and direction.

    Parameters
    ----------
    stage : Stage
        Where they are drawn.
    exo : ShoulderExo
        Whose forces.
    metres_per_newton : float, optional
        The scale; if left out, one with which the largest force of a pose or a motion has a good length.
    """

    def __init__(self, stage: Stage, exo: ShoulderExo, metres_per_newton: float | None = None) -> None:
        self._stage, self._exo = stage, exo
        arm = exo.arm
        self._weight = np.zeros(3) if arm is None else arm.mass * exo.mechanism.gravity
        self._given = metres_per_newton
        stage.viewer["forces"].delete()
        root = "/meshcat/forces"
        self._arrows = {
            "shoulder": Arrow(stage, f"{root}/shoulder", RED, _MAIN, tail=True),
            "contact": Arrow(stage, f"{root}/contact", BLACK, _LIMB, tail=True),
            "weight": Arrow(stage, f"{root}/weight", GREEN, _MAIN),
            "cuff": Arrow(stage, f"{root}/cuff", SKY, _MAIN),
        }
        for i in range(exo.geometry.limb_count):
            self._arrows[f"pull_{i}"] = Arrow(stage, f"{root}/limb_{i + 1}/pull", BLUE, _LIMB)
            self._arrows[f"push_{i}"] = Arrow(stage, f"{root}/limb_{i + 1}/push", ORANGE, _LIMB, heads=2)
            self._arrows[f"side_{i}"] = Arrow(stage, f"{root}/limb_{i + 1}/side", PURPLE, _SIDE)
        self._labels: list[dict[str, Any]] = []
        self.plan([])

    def plan(self, poses: Sequence[ShownForces]) -> None:
        """Choose the scale and the legend for a pose or for all poses of a motion."""
        largest = np.array([forces.largest for forces in poses])
        firm = np.array([forces.status in ("ok", *BEYOND) for forces in poses], dtype=bool) & np.isfinite(largest)
        known = largest[firm if firm.any() else np.isfinite(largest)]
        weight = float(np.linalg.norm(self._weight))
        top = max(weight, float(np.percentile(known, _SHARE)) if known.size else 0.0) or 1.0
        self.scale = 0.1 / round_up(0.1 * top / GOOD_LENGTH) if self._given is None else self._given
        tensions = np.array([forces.tensions for forces in poses if np.isfinite(forces.tensions).all()])
        #: Top of the scale of the muscles' colours, N.
        self.tension_top = round_up(min(float(tensions.max(initial=0.0)), max(top, weight)) or 1.0)
        visible = {"weight"} if self.scale * weight >= _SHORTEST else set()
        for forces in poses:
            if np.isfinite(forces.largest):
                visible |= self._visible(forces)
        self._legend = [item for name, item in _LEGEND if name in visible]
        longest = max([weight, *largest[np.isfinite(largest)]])
        self._cuts = bool(self.scale * longest > LONGEST * (1 + 1e-9))

    def _visible(self, forces: ShownForces) -> set[str]:
        """Which kinds of arrows a pose has."""
        least = _SHORTEST / self.scale
        contact = 0.0 if forces.contact is None else float(np.nan_to_num(np.linalg.norm(forces.contact.force)))
        sizes = {
            "shoulder": np.linalg.norm(forces.shoulder),
            "contact": contact,
            "pull": forces.tensions.max(),
            "push": -forces.tensions.min(),
            "side": np.abs(forces.side_forces).max(),
            "cuff": abs(forces.cuff_pull) if forces.cuff_text else 0.0,
        }
        return {name for name, size in sizes.items() if size >= least}

    def show(self, poses: Rotation, forces: ShownForces | None, geometry: WristGeometry) -> None:
        """Draw the forces of a pose, or none, on the joints of ``geometry``."""
        self._labels = []
        shown: set[str] = set()
        if forces is not None and self._exo.arm is not None:
            R = poses.as_matrix()
            centre = R @ self._exo.arm.centre_of_mass
            bodily = [("weight", centre, self._weight, GREEN), ("shoulder", np.zeros(3), forces.shoulder, RED)]
            if forces.contact is not None:
                bodily.append(("contact", np.zeros(3), forces.contact.force, BLACK))
            for name, start, force, colour in bodily:
                self._draw(shown, name, start, force, f"{name} {float(np.linalg.norm(force)):.0f} N", colour)
            if forces.cuff_text:
                pull = -forces.cuff_pull * R[:, 2]
                self._draw(shown, "cuff", _beside_cuff(R, geometry), pull, _cuff_label(forces), SKY)
            state = inverse_kinematics(geometry, poses)
            if geometry is self._exo.geometry:
                sides = -forces.side_forces[:, None] * state.normals
            else:
                # Off its centre a limb's side wrench is a screw: its force is what the limb pulls with across its line.
                sides = forces.limb_forces + forces.tensions[:, None] * state.directions
            self._limbs(shown, state, forces, sides)
        for name, arrow in self._arrows.items():
            if name not in shown:
                arrow.hide()
        self._stage.set_panel("labels", self._labels)

    def legend(self) -> tuple[str, list[dict[str, str]]]:
        """The scale in words, and what each arrow is that the planned poses have."""
        scale = f"Forces on the arm: 10 cm = {0.1 / self.scale:g} N"
        return f"{scale}; cut at {LONGEST / self.scale:.4g} N" if self._cuts else scale, self._legend

    def _limbs(self, shown: set[str], state: LimbState, forces: ShownForces, sides: FloatArray) -> None:
        for i, (b, s) in enumerate(zip(state.platform_points, state.directions, strict=True)):
            tension = float(forces.tensions[i])
            outward = b - (b @ s) * s
            beside = b + _BESIDE * outward / max(float(np.linalg.norm(outward)), 1e-9)
            vector = -tension * s
            if tension >= 0:
                self._draw(shown, f"pull_{i}", beside, vector, f"{i + 1} pulls {tension:.0f} N", BLUE)
            else:
                # A push is drawn up to the joint that it presses on.
                start = beside - trimmed(self.scale * vector, LONGEST)[0]
                self._draw(shown, f"push_{i}", start, vector, f"{i + 1} pushes {-tension:.0f} N", ORANGE, at_start=True)
            side = sides[i]
            self._draw(shown, f"side_{i}", b, side, f"{i + 1} side {float(np.linalg.norm(side)):.0f} N", PURPLE)

    def _draw(
        self,
        shown: set[str],
        name: str,
        start: FloatArray,
        force: FloatArray,
        text: str,
        colour: str,
        at_start: bool = False,
    ) -> None:
        if not np.isfinite(force).all():
            return
        vector, cut = trimmed(self.scale * force, LONGEST)
        if float(np.linalg.norm(vector)) < _SHORTEST:
            return
        self._arrows[name].show(start, vector)
        shown.add(name)
        ends = [start.tolist(), (start + vector).tolist()]
        words = f"{text} (cut)" if cut else text
        self._labels.append({"text": words, "at": ends[not at_start], "arrow": ends, "colour": colour})


def _beside_cuff(R: FloatArray, geometry: WristGeometry) -> FloatArray:
    """Middle of the sleeve, beside it, where no joint is near, base frame, shape (3,), m."""
    points = geometry.platform_points
    radius, bottom, top = sleeve_size(points)
    turns = np.radians(np.arange(0.0, 360.0, 10.0))
    around = np.stack([np.cos(turns), np.sin(turns)], axis=1) * (radius + WALL + _FROM_CUFF)
    gaps = np.linalg.norm(around[:, None] - points[None, :, :2], axis=2).min(axis=1)
    return np.asarray(R @ np.array([*around[int(gaps.argmax())], (bottom + top) / 2]))


def _cuff_label(forces: ShownForces) -> str:
    slips = "" if forces.cuff_slip is None else f", slips {1e3 * forces.cuff_slip:.0f} mm"
    return f"cuff {abs(forces.cuff_pull):.0f} N along the arm{slips}"


def _verdict(answer: Reaction, index: tuple[int, ...]) -> str:
    """The verdict on a pose; on one of a stack only that it cannot be held, because it is drawn many times a second."""
    if answer.equilibrium_status.ndim == 0:
        return answer.verdict
    return "The device cannot hold this pose." if answer.limits.violated[index] else ""
