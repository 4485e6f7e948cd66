"""Everything that is uncertain at once: |F_s| and the force in the joint, how far they spread, and what dominates.

Quantities and their sizes are those of :mod:`exo_pin.uncertainty.quantities`. Each is drawn anew, evenly over its
ball or interval and independent of the others, and the question is asked again, device, case and all. For a person
one more is drawn, evenly from none to its size: ``tone_percent``, the share of the activations without the device that
the muscles keep, while the device carries the rest.

What a quantity explains is the variance with this one drawn alone, as a share of the variance with all. Shares need not
add up to one: quantities act together.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.errors import InvalidInput, SolverFailed
from ..core.progress import track
from ..core.results import Result, drawn
from ..core.tables import newtons
from ..core.validation import FloatArray, ReadOnly, as_count
from ..device.protocol import Device
from ..device.wrist_device import as_device
from ..load_case import Case
from ..reaction import Reaction, solve
from ..reaction.assumptions import Assumptions
from .quantities import quantities

if TYPE_CHECKING:
    from matplotlib.figure import Figure


#: Tone that is assumed, %: the least share of activations of which the first answer also tells the relief.
TONE, ASSUMED_TONE = "tone_percent", 30.0
#: Force in the joint, N, of a changed device, its answer and a tone, %.
_Joint = Callable[[Device, Reaction, float], float]
#: Draws of one quantity alone, as a share of those of all.
_ALONE = 0.25


class Explained(NamedTuple):
    """How much of a spread one quantity explains.

    Attributes
    ----------
    name : str
        Of the quantity, with its unit.
    size : float
        Its uncertainty, to both sides; of the tone from none.
    of_F_s, of_joint : float
        Variance of |F_s| and of the force in the joint with this one alone, as a share of that with all; NaN where
        there is none.
    """

    name: str
    size: float
    of_F_s: float
    of_joint: float


@dataclass(frozen=True, eq=False)
class TotalUncertainty(Result, ReadOnly):
    """How far |F_s| and the force in the joint spread in a pose with everything uncertain at once.

    Attributes
    ----------
    title : str
        Design and pose.
    magnitude, joint_N : float
        |F_s| and force in the joint as asked, N; NaN of the joint without a person.
    shoulder_forces, joint_forces : ndarray
        Shape (N,), N: of each draw; NaN where a draw has no answer.
    held : ndarray of bool
        Shape (N,): whether the device holds the arm.
    explained : tuple of Explained
        By quantity, what explains most of the joint's spread first, without a person of that of |F_s|.

    Examples
    --------
    >>> exo = ep.load("four-linear-actuators-worn")
    >>> spread = exo.total_uncertainty(exo.pose(60, 30), draws=40)
    >>> spread.explained[0].name
    'offset_mm'
    """

    title: str
    magnitude: float
    joint_N: float
    shoulder_forces: FloatArray
    joint_forces: FloatArray
    held: NDArray[np.bool_]
    explained: tuple[Explained, ...]

    @property
    def quantiles(self) -> dict[str, tuple[float, float, float]]:
        """5 %, median and 95 % by name of the force, N; of the draws that have an answer."""
        named = {"F_s_N": self.shoulder_forces, "joint_N": self.joint_forces}
        known = {name: values[np.isfinite(values)] for name, values in named.items()}
        return {
            name: tuple(float(end) for end in np.percentile(values, (5.0, 50.0, 95.0)))  # type: ignore[misc]
            for name, values in known.items()
            if len(values)
        }

    def columns(self) -> dict[str, Any]:
        """One row a quantity."""
        return {
            "quantity": np.array([each.name for each in self.explained], dtype=object),
            "uncertainty": np.array([each.size for each in self.explained]),
            "explains_F_s_percent": np.array([100.0 * each.of_F_s for each in self.explained]),
            "explains_joint_percent": np.array([100.0 * each.of_joint for each in self.explained]),
        }

    def plot(self) -> Figure:
        """Draw both spreads, and below them what explains them.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        MissingExtra
            If matplotlib is not installed.
        """
        return drawn("answer_plots:total_uncertainty_figure", self)

    def __str__(self) -> str:
        words = {"F_s_N": ("|F_s|", self.magnitude), "joint_N": ("Force in the joint", self.joint_N)}
        count = len(self.held)
        lost = count - int(self.held.sum())
        lines = [f"{count} draws of all that is uncertain; nine of ten lie between"]
        for name, (low, middle, high) in self.quantiles.items():
            title, asked = words[name]
            lines.append(
                f"  {title:<20} {newtons(low):>6} and {newtons(high)} N, median {newtons(middle)}, "
                f"as asked {newtons(asked)} N"
            )
        if lost:
            lines.append(f"The device does not hold the arm in {lost} of {count}.")
        lines += ["", f"{'explains, alone':<28}{'|F_s|, %':>10}{'joint, %':>10}"]
        for each in self.explained:
            cells = (
                f"{100.0 * part:10.0f}" if np.isfinite(part) else f"{'-':>10}" for part in (each.of_F_s, each.of_joint)
            )
            lines.append(
                f"  {each.name} {'0 to ' if each.name == TONE else '±'}{each.size:g}".ljust(28) + "".join(cells)
            )
        return "\n".join([*lines, "What is left to 100 % is of several together."])


def total_uncertainty(
    device: Any,
    case: Case,
    assumptions: Assumptions,
    title: str,
    stated: Mapping[str, float],
    tone: float,
    draws: int,
    seed: int,
    joint: _Joint | None,
    progress: bool,
) -> TotalUncertainty:
    """How far forces spread; see :meth:`exo_pin.ShoulderExo.total_uncertainty`.

    ``joint`` gives the force in the joint of a device, an answer and a tone, %; None without a person.
    """
    count, rng = as_count("draws", draws, least=8), np.random.default_rng(as_count("seed", seed))
    question = _Question(device, case, assumptions, stated, joint)
    asked = question.answer({}, 0.0)
    if not np.isfinite(asked[0]):
        raise SolverFailed("uncertainty", np.inf, "the pose has no answer")
    sizes = {each.name: (each.size, each.dimensions) for each in question.quantities() if each.size > 0.0}
    alone = max(8, round(_ALONE * count))
    right = question.device.side == "right"
    every = [(_steps(sizes, rng, right), tone * rng.uniform()) for _ in range(count)]
    single = {name: [(_steps({name: each}, rng, right), 0.0) for _ in range(alone)] for name, each in sizes.items()}
    if tone > 0.0:
        sizes[TONE] = (tone, 1)
        single[TONE] = [({}, tone * rng.uniform()) for _ in range(alone)]
    whole = [*every, *(draw for group in single.values() for draw in group)]
    found = np.array([question.answer(*draw) for draw in track(whole, "draws", progress)])
    total, parts = found[:count], found[count:].reshape(len(single), alone, 3)
    if not np.isfinite(total[:, 0]).any():
        lost = [name for name, part in zip(single, parts, strict=True) if not np.isfinite(part[:, 0]).any()]
        alike = f", not of {', '.join(lost)} alone either (0 takes that as certain)" if lost else ""
        raise SolverFailed("uncertainty", np.inf, f"no draw has an answer{alike}")
    whole_spread = _variance(total[:, :2])
    whole_spread[whole_spread == 0.0] = np.nan
    shares = np.array([_variance(part[:, :2]) for part in parts]).reshape(-1, 2) / whole_spread
    explained = [Explained(name, sizes[name][0], *map(float, row)) for name, row in zip(single, shares, strict=True)]
    explained.sort(key=lambda each: -np.nan_to_num(each.of_F_s if joint is None else each.of_joint))
    return TotalUncertainty(title, asked[0], asked[1], total[:, 0], total[:, 1], total[:, 2] > 0.0, tuple(explained))


def _steps(sizes: Mapping[str, tuple[float, int]], rng: np.random.Generator, right: bool) -> dict[str, FloatArray]:
    """A change of each quantity, evenly over its interval or ball, in its unit; on a right side the mirror image."""
    found = {}
    for name, (size, dimensions) in sizes.items():
        way = rng.standard_normal(dimensions)
        if right and dimensions == 3:
            # Rotation vectors are pseudovectors.
            way *= (-1.0, 1.0, -1.0) if name.endswith("_deg") else (1.0, -1.0, 1.0)
        found[name] = size * rng.uniform() ** (1.0 / dimensions) * way / np.linalg.norm(way)
    return found


def _variance(values: FloatArray) -> FloatArray:
    """Variance of each column over what is known of it; NaN where there is nothing."""
    return np.asarray(np.ma.masked_invalid(values).var(axis=0).filled(np.nan))


class _Question(NamedTuple):
    """A question whose device and case are changed before it is asked."""

    device: Device
    case: Case
    assumptions: Assumptions
    stated: Mapping[str, float]
    joint: _Joint | None

    def quantities(self, device: Any = None, case: Case | None = None) -> Iterator[Any]:
        """What is uncertain of a device and a case, or of these."""
        device, case = device or self.device, case or self.case
        return quantities(device, case, self.stated, self.assumptions.law.determines_sides)

    def answer(self, steps: Mapping[str, FloatArray], tone: float) -> tuple[float, float, bool]:
        """|F_s|, force in the joint, and whether the device holds the arm, with all changes of a draw."""
        device, case = self.device, self.case
        try:
            for name, step in steps.items():
                # A quantity is of the device that those before it have left.
                changed = next(each.changed for each in self.quantities(device, case) if each.name == name)
                device, case = changed(step)
            found = solve(device, case, self.assumptions)
            if not found.has_answer:
                return np.nan, np.nan, False
            inside = np.nan if self.joint is None else self.joint(as_device(device), found, tone)
            return float(found.magnitude), inside, bool(found.held)
        except (SolverFailed, InvalidInput):
            # A device that does not fit together any more has no forces.
            return np.nan, np.nan, False
