"""How sure a shoulder force is: which uncertain quantity changes it most, and the worst offset of the device.

Every number is an answer of :func:`exo_pin.reaction.solve` to a changed question, at the whole size of the uncertainty
and not by a derivative, so that limits, forces chosen anew and singular poses nearby count. Quantities change one by
one. A ball is tried along and against each axis, and along and against the steepest direction that these show; of
offsets of the device's centre the worst is searched (:mod:`exo_pin.uncertainty.offset_search`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from ..core.errors import ExoPinError, MissingData, SolverFailed
from ..core.records import Record
from ..core.results import Known, Result, drawn, taken_as_known
from ..core.validation import FloatArray, ReadOnly, as_mapping
from ..device.wrist_device import as_device
from ..load_case import Case, CentreOffset
from ..reaction import Assumptions, Reaction, solve
from .offset_search import WorstOffset, worst_offset
from .quantities import OFFSET, quantities

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Effect(Record):
    """What one uncertain quantity does to |F_s|.

    Attributes
    ----------
    name : str
        Of the quantity, with the unit of ``size``.
    size : float
        Its uncertainty, to both sides, in its own unit.
    least, greatest : float
        Least and greatest |F_s| of the changes that were tried, N; infinite where there is no answer within.
    holds : bool
        Whether the device holds the pose, as far as limits are known, with all of them.
    """

    name: str
    size: float
    least: float
    greatest: float
    holds: bool

    def change(self, magnitude: float) -> float:
        """The larger change from the |F_s| of the question, N."""
        return max(self.greatest - magnitude, magnitude - self.least)


@dataclass(frozen=True)
class _UncertaintyDocument:
    """Plain data of :class:`ForceUncertainty`.

    Attributes
    ----------
    magnitude : float
        |F_s| of the question, N.
    at : list of int
        Row of the stack, that of the peak; empty for a single pose.
    verdict : str
        Of the question.
    effects : list of Effect
        One a quantity.
    worst_offset : WorstOffset or None
        The worst offset of the device's centre.
    known : list of Known
        What counts as certain, and what an error of it does.
    cautions : list of str
        What to mind.
    """

    magnitude: float
    at: list[int]
    verdict: str
    effects: list[Effect]
    worst_offset: WorstOffset | None
    known: list[Known]
    cautions: list[str]


#: What an answer about a device with redundant rows leaves out.
_FIT = (
    "Places of joints and loops count as certain: the loops have redundant rows, and links that are not as drawn do "
    "not fit together."
)


@dataclass(frozen=True, eq=False)
class ForceUncertainty(Result, ReadOnly):
    """How sure |F_s| is in a pose, or at the peak of a stack of poses or a movement.

    Attributes
    ----------
    magnitude : float
        |F_s| of the question, N.
    at : tuple of int
        Index of that pose in the stack, the peak of the poses that can be held; () for a single pose.
    effects : tuple of Effect
        One a quantity, largest change first.
    worst_offset : WorstOffset or None
        Of the device's centre; None where it is taken as certain.
    answer : Reaction
        In that pose.
    known : tuple of Known
        What was taken as known, and by how many per cent one unit of an error of it changes |F_s|.
    places_certain : bool
        Whether joints and loops count as placed exactly, as those of a device with redundant rows do.
    """

    magnitude: float
    at: tuple[int, ...]
    effects: tuple[Effect, ...]
    worst_offset: WorstOffset | None
    answer: Reaction
    known: tuple[Known, ...]
    places_certain: bool

    @property
    def provenance(self) -> dict[str, Any]:
        """Version, design with the hash of its file, case and assumptions."""
        return self.answer.provenance | super().provenance

    @property
    def verdict(self) -> str:
        """What was taken as known, then the answer's verdict."""
        return " ".join(part for part in (taken_as_known(self.known), self.answer.verdict) if part)

    @property
    def cautions(self) -> tuple[str, ...]:
        """Quantities with which the device does not hold the pose, what counts as certain, and doubts of the answer."""
        lost = [effect.name for effect in self.effects if not effect.holds]
        own = []
        if lost and self.answer.held:
            own.append(f"The device may not hold the pose within {', '.join(lost)}.")
        if self.places_certain:
            own.append(_FIT)
        return (*own, *self.answer.cautions)

    def columns(self) -> dict[str, Any]:
        """One row a quantity."""
        rows = self.effects
        return {
            "quantity": np.array([effect.name for effect in rows], dtype=object),
            "uncertainty": np.array([effect.size for effect in rows]),
            "least_F_s_N": np.array([effect.least for effect in rows]),
            "greatest_F_s_N": np.array([effect.greatest for effect in rows]),
            "change_F_s_N": np.array([effect.change(self.magnitude) for effect in rows]),
            "holds": np.array([effect.holds for effect in rows]),
        }

    _document = _UncertaintyDocument

    def as_dict(self) -> dict[str, Any]:
        """Numbers of the pose and of every quantity."""
        found = {"magnitude": self.magnitude, "at": list(self.at), "verdict": self.verdict}
        found |= {"effects": [vars(effect) for effect in self.effects]}
        found |= {"worst_offset": None if self.worst_offset is None else vars(self.worst_offset)}
        return found | {"known": [vars(each) for each in self.known], "cautions": list(self.cautions)}

    def plot(self) -> Figure:
        """Draw least and greatest |F_s| of each quantity as bars about that of the question.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        MissingExtra
            If matplotlib is not installed.
        """
        return drawn("answer_plots:uncertainty_figure", self)

    def __str__(self) -> str:
        where = f" at pose {', '.join(map(str, self.at))}" if self.at else ""
        lines = [self.verdict, f"|F_s| {self.magnitude:.1f} N{where}. It becomes"]
        device = as_device(self.answer.source.poses.mechanism)
        rigid = device.accelerate("uncertainty") is None and not self.answer.assumptions.law.moves
        lines += [f"  {_span(effect, rigid)}  with {effect.name} ±{effect.size:g}" for effect in self.effects]
        if self.worst_offset is not None:
            lines += [_offset_words(self.worst_offset, rigid), *_offset_table(self.worst_offset, self.magnitude)]
        return "\n".join([*lines, *(f"Caution: {text}" for text in self.cautions)])


def _span(effect: Effect, rigid: bool) -> str:
    lost = "no answer" if rigid else "unbounded"
    most = lost if np.isinf(effect.greatest) else f"{effect.greatest:.1f} N"
    return f"{effect.least:8.1f} to {most:>10}{'' if effect.holds else ', not held throughout'}"


def _offset_words(worst: WorstOffset, rigid: bool) -> str:
    why = ': rigid, it cannot follow (split="elastic" takes the stiffness of cuff and harness)' if rigid else ""
    if np.isnan(worst.magnitudes).all():
        return f"The device has no answer {1e3 * worst.radius:g} mm off in any direction{why}."
    place = f"({', '.join(f'{1e3 * v:.1f}' for v in worst.offset)}) mm"
    if rigid and np.isinf(worst.magnitude):
        return f"The device has no answer at offset {place}{why}."
    if np.isinf(worst.magnitude):
        return f"Within {1e3 * worst.radius:g} mm the force has no bound: there is no equilibrium at offset {place}."
    return f"Worst offset within {1e3 * worst.radius:g} mm: {place}, |F_s| {worst.magnitude:.1f} N."


def _offset_table(worst: WorstOffset, magnitude: float) -> list[str]:
    """|F_s| by the direction in which the device's centre is off; empty where there is an answer in none."""
    if np.isnan(worst.magnitudes).all():
        return []
    around = np.insert(worst.magnitudes, len(worst.magnitudes) // 2, magnitude).reshape(3, 3, 3)
    columns = ("forward", "", "backward")
    lines = [
        f"|F_s| in N with the device's centre {1e3 * worst.radius:g} mm off (in the middle: at the given offset):",
        " " * 14 + "".join(f"{name:>10}" for name in columns),
    ]
    for k, height in enumerate(("up", "", "down")):
        for j, side in enumerate(("left", "", "right")):
            name = " ".join(word for word in (height, side) if word)
            lines.append(f"  {name:<12}" + "".join(f"{_number(around[i, j, k]):>10}" for i in range(3)))
    return lines


def _number(size: float) -> str:
    return "no answer" if np.isnan(size) else f"{size:.1f}"


def force_uncertainty(
    device: Any, case: Case, assumptions: Assumptions, uncertainties: Mapping[str, float] | None = None
) -> ForceUncertainty:
    """How sure a shoulder force is; see :meth:`exo_pin.ShoulderExo.uncertainty`."""
    stated = as_mapping("uncertainties", uncertainties, "names of quantities to their uncertainty")
    whole = solve(device, case, assumptions)
    mechanism, (single, at) = as_device(device), _at_peak(whole)
    answer = solve(mechanism, single, assumptions)
    if not answer.has_answer:
        raise SolverFailed("uncertainty", np.inf, f"the pose has no answer: {answer.verdict}")
    magnitude = float(answer.magnitude)
    effects, known, worst = [], list[Known](), None
    for quantity in quantities(mechanism, single, stated, assumptions.law.determines_sides):
        if quantity.size == 0.0:
            known += _taken_as_known(quantity, magnitude, assumptions)
        elif quantity.name == OFFSET:
            start = single.offset or CentreOffset.together(np.zeros(3))

            def answers(steps: FloatArray, start: CentreOffset = start) -> Reaction:
                moved = CentreOffset(start.base + steps, start.cuff + steps)
                poses = Rotation.concatenate([single.poses] * len(steps))
                return _evaluated(solve(mechanism, replace(single, poses=poses, centre_offset=moved), assumptions))

            worst, least = worst_offset(answers, 1e-3 * quantity.size)
            effects.append(Effect(OFFSET, quantity.size, least, worst.magnitude, worst.holds))
        else:
            effects.append(_tried(quantity, magnitude, assumptions))
    # Those that change nothing by name, whatever the rounding.
    effects.sort(key=lambda effect: (-round(effect.change(magnitude), 9), effect.name))
    routes = all(name.startswith(("spring", "cable")) for name in mechanism.places())
    certain = routes and bool(mechanism.as_chain().structure.self_stresses)
    return ForceUncertainty(magnitude, at, tuple(effects), worst, answer, tuple(known), certain)


def _at_peak(whole: Reaction) -> tuple[Case, tuple[int, ...]]:
    """The case of the pose of a stack with the largest |F_s| that can be held, of all if none can; and its index."""
    case, shape = whole.case, whole.status.shape
    if not shape:
        return case, ()
    rows = whole.held if whole.held.any() else whole.has_answer
    if not rows.any():
        raise SolverFailed("uncertainty", np.inf, "no pose has an answer")
    row = int(np.where(rows, whole.magnitude, -np.inf).argmax())
    return case.row(row), tuple(int(i) for i in np.unravel_index(row, shape))


def _evaluated(answer: Reaction) -> Reaction:
    """An answer whose poses the data of all parts cover.

    Raises
    ------
    MissingData
        If a spring has no data in one: that is no pose without equilibrium.
    """
    lacking = [text for text in answer.reasons.ravel().tolist() if text]
    if lacking:
        raise MissingData([f"data ({lacking[0]})"], "the effect of an uncertainty", answer.source.poses.mechanism.name)
    return answer


def _taken_as_known(quantity: Any, magnitude: float, assumptions: Assumptions) -> Iterator[Known]:
    """The effect of one unit of a quantity that counts as certain, of a ball in the worst direction.

    By central differences, which are the same on either shoulder.

    Nothing where the question cannot be asked.
    """
    name, _, unit = quantity.name.rpartition("_")
    try:
        changed = [quantity.changed(sign * axis) for axis in np.eye(quantity.dimensions) for sign in (1.0, -1.0)]
        answers = [solve(device, case, assumptions) for device, case in changed]
    except ExoPinError:
        return
    there = [float(answer.magnitude) for answer in answers]
    share = 50.0 * float(np.linalg.norm(np.subtract(there[::2], there[1::2]))) / max(magnitude, 1e-300)
    share = share if np.isfinite(share) else np.inf
    yield Known(name.replace("_", " "), 1.0, {"percent": "%"}.get(unit, unit), {"F_s_percent": share}, shows=False)


def _tried(quantity: Any, magnitude: float, assumptions: Assumptions) -> Effect:
    """Least and greatest |F_s| of one quantity."""
    sizes, holds = [magnitude], True

    def size(step: FloatArray) -> float:
        nonlocal holds
        mechanism, case = quantity.changed(step)
        answer = _evaluated(solve(mechanism, case, assumptions))
        holds = holds and bool(answer.held)
        found = float(answer.magnitude) if answer.has_answer else np.inf
        sizes.append(found)
        return found

    axes = quantity.size * np.eye(quantity.dimensions)
    slope = np.array([size(axis) - size(-axis) for axis in axes])
    length = float(np.linalg.norm(slope))
    if quantity.dimensions > 1 and 0.0 < length < np.inf:
        steepest = quantity.size / length * slope
        size(steepest)
        size(-steepest)
    return Effect(quantity.name, quantity.size, min(sizes), max(sizes), holds)
