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
from ...reaction import Reaction
from ...wrist import LimbState, inverse_kinematics
from ..colours import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, RED
from .shapes import Arrow, trimmed
from .stage import Stage

if TYPE_CHECKING:
    from ...exo.shoulder_exo import ShoulderExo

__all__ = ["LONGEST", "ForcePicture", "PoseForces", "nice_step"]

#: Length that the arm's weight is drawn with at most, m.
_WEIGHT_LENGTH = 0.12
#: No arrow is drawn longer, m.
LONGEST = 0.40
#: Radius of arrows' shafts, and distance of tension arrows from their limb, m.
_MAIN, _LIMB, _SIDE, _BESIDE = 0.0075, 0.0055, 0.0035, 0.032


@dataclass(frozen=True, eq=False)
class PoseForces(Record):
    """Forces of one pose, N, base frame; rows of a :class:`Reaction`."""

    shoulder: FloatArray
    tensions: FloatArray
    side_forces: FloatArray
    limb_forces: FloatArray
    determinant: float
    status: str
    percent: float | None
    split: str

    @classmethod
    def of(cls, answer: Reaction, index: tuple[int, ...]) -> PoseForces:
        """Those of a pose of a stack; () for a single pose."""
        percent = answer.percent_body_weight
        return cls(
            answer.shoulder_force[index],
            answer.actuator_forces[index],
            answer.constraint_forces[index],
            answer.limb_wrenches[index][..., :3],
            float(answer.determinant[index]),
            str(answer.status[index]),
            None if percent is None else float(percent[index]),
            answer.split,
        )


def nice_step(value: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above ``value``."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(step * power for step in (1.0, 2.0, 5.0) if step * power <= value * (1 + 1e-9)))


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
        The scale; one that suits the arm's weight if left out.
    """

    def __init__(self, stage: Stage, exo: ShoulderExo, metres_per_newton: float | None = None) -> None:
        self._stage, self._exo = stage, exo
        arm = exo.arm
        self._weight = np.zeros(3) if arm is None else arm.mass * exo.mechanism.gravity
        heavy = float(np.linalg.norm(self._weight)) or 1.0
        self.scale = nice_step(_WEIGHT_LENGTH / heavy) if metres_per_newton is None else metres_per_newton
        stage.viewer["forces"].delete()
        root = "/meshcat/forces"
        self._arrows = {
            "shoulder": Arrow(stage, f"{root}/shoulder", RED, _MAIN, tail=True),
            "weight": Arrow(stage, f"{root}/weight", GREEN, _MAIN),
        }
        for i in range(exo.geometry.limb_count):
            self._arrows[f"pull_{i}"] = Arrow(stage, f"{root}/limb_{i + 1}/pull", BLUE, _LIMB)
            self._arrows[f"push_{i}"] = Arrow(stage, f"{root}/limb_{i + 1}/push", ORANGE, _LIMB, heads=2)
            self._arrows[f"side_{i}"] = Arrow(stage, f"{root}/limb_{i + 1}/side", PURPLE, _SIDE)
        self._labels: list[dict[str, Any]] = []
        self._bar()

    def show(
        self,
        orientation: Rotation,
        forces: PoseForces | None,
        geometry: WristGeometry,
        labels: Sequence[dict[str, Any]] = (),
    ) -> None:
        """Draw the forces of a pose, or none, on the joints of ``geometry``, and further labels."""
        self._labels = [*labels] if self._exo.arm is None else [self._bar_label, *labels]
        shown: set[str] = set()
        if forces is not None and self._exo.arm is not None:
            R = orientation.as_matrix()
            centre = R @ self._exo.arm.centre_of_mass
            size = float(np.linalg.norm(self._weight))
            self._draw(shown, "weight", centre, self._weight, f"weight {size:.0f} N", GREEN)
            size = float(np.linalg.norm(forces.shoulder))
            self._draw(shown, "shoulder", np.zeros(3), forces.shoulder, f"shoulder {size:.0f} N", RED)
            state = inverse_kinematics(geometry, orientation)
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
        """The scale in words, and what each arrow is."""
        newtons = 0.1 / self.scale
        scale = f"Forces on the arm: 10 cm = {newtons:g} N; cut at {LONGEST / self.scale:.0f} N"
        return scale, [
            {"glyph": "tail", "colour": RED, "text": "shoulder reaction F_s"},
            {"glyph": "arrow", "colour": GREEN, "text": "weight of the moving part"},
            {"glyph": "arrow", "colour": BLUE, "text": "limb pulls, f > 0"},
            {"glyph": "double", "colour": ORANGE, "text": "limb pushes, f < 0"},
            {"glyph": "thin", "colour": PURPLE, "text": "side force of a limb, g"},
        ]

    def _limbs(self, shown: set[str], state: LimbState, forces: PoseForces, sides: FloatArray) -> None:
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
        # Shorter than a millimetre is no arrow, and its label would name a zero.
        if float(np.linalg.norm(vector)) < 1e-3:
            return
        self._arrows[name].show(start, vector)
        shown.add(name)
        tip = start if at_start else start + vector
        self._labels.append({"text": f"{text} (cut)" if cut else text, "at": tip.tolist(), "colour": colour})

    def _bar(self) -> None:
        """A grey arrow of 10 cm in the scene itself: the scale in the same perspective."""
        sideways = 1.0 if self._exo.side == "left" else -1.0
        start = np.array([-0.05, 0.22 * sideways, 0.17])
        vector = np.array([0.0, 0.1 * sideways, 0.0])
        self._scale_arrow = Arrow(self._stage, "/meshcat/forces/scale", GREY, _LIMB)
        if self._exo.arm is not None:
            self._scale_arrow.show(start, vector)
        # Labels are to the right of their points; from the front, that is the left of the body.
        beside = start + vector if self._exo.side == "left" else start
        self._bar_label = {"text": f"scale {0.1 / self.scale:g} N", "at": beside.tolist(), "colour": BLACK}
