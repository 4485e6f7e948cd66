"""What is made of a reaction on demand: which parts equilibrium alone determines, optimality, closest forces."""

from __future__ import annotations

import functools
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.results import Result
from ...core.validation import FloatArray, ReadOnly

if TYPE_CHECKING:
    from .component_assumptions import ComponentSource

#: Effect of a self-stress on a quantity, relative to the largest, below which the quantity does not change with it.
_NO_EFFECT = 1e-9


#: Assumptions behind a component of a result, and their descriptions.
KINDS = {
    "unique": "Unique by equilibrium",
    "stiffness": "Determined by stiffness",
    "optimiser": "Chosen by an optimiser",
    "assumed": "Fixed by the assumption of the split",
    "bounded": "Bounded only, other values do as well",
    "none": "Without an answer",
}


def component_names(limb_count: int) -> list[str]:
    """Names of f, g and F_s by component, 2 n + 3 of them."""
    limbs = range(1, limb_count + 1)
    return [*(f"f_{i}" for i in limbs), *(f"g_{i}" for i in limbs), "F_s x", "F_s y", "F_s z"]


@dataclass(frozen=True, eq=False)
class Components(Result, ReadOnly):
    """Assumptions behind each component of a result, for a pose or a stack of shape (...).

    Attributes
    ----------
    actuator_forces, constraint_forces, shoulder_force : ndarray of str
        Shape (..., n), (..., n) and (..., 3), a key of :data:`KINDS`: "unique" (no self-stress changes it),
        "stiffness", "optimiser" (the only one, or that of least squares, of those that balance), "assumed" (g = 0 or
        F_s = 0), "bounded" (the objective does not depend on it: any value of an interval is as good), or
        "none" for a pose without an answer.
    actuator_intervals, constraint_intervals, shoulder_intervals : ndarray
        Shape (..., n, 2), (..., n, 2) and (..., 3, 2), N: least and largest value that equilibrium and the bounds
        on f and g allow, each component by itself; infinite without bounds, NaN if nothing fits them.
    needed : tuple of str
        What would have to be known to determine the other components.

    Examples
    --------
    >>> exo = ep.load("prototype")
    >>> parts = exo.reaction(exo.pose(30, 30), limits="none").certificate.components
    >>> parts.actuator_forces.tolist()  # of three limbs, by the moments
    ['unique', 'unique', 'unique']
    >>> parts.constraint_forces.tolist()
    ['assumed', 'assumed', 'assumed']
    """

    actuator_forces: NDArray[np.str_]
    constraint_forces: NDArray[np.str_]
    shoulder_force: NDArray[np.str_]
    actuator_intervals: FloatArray
    constraint_intervals: FloatArray
    shoulder_intervals: FloatArray
    needed: tuple[str, ...]

    def __str__(self) -> str:
        parts = [f"{text}: {', '.join(names)}." for kind, text in KINDS.items() if (names := self._named(kind))]
        spans = self._spans()
        if spans:
            parts.append(f"Between bounds: {', '.join(spans)}.")
        if self.needed and self._open():
            parts.append(f"To determine them: {', '.join(self.needed)}.")
        return " ".join(parts)

    def _columns(self) -> list[tuple[str, NDArray[np.str_], FloatArray]]:
        """Name, kinds and intervals of each component, flat over the stack."""
        columns = []
        n = self.actuator_forces.shape[-1]
        every = component_names(n)
        for names, kinds, intervals in (
            (every[:n], self.actuator_forces, self.actuator_intervals),
            (every[n : 2 * n], self.constraint_forces, self.constraint_intervals),
            (every[2 * n :], self.shoulder_force, self.shoulder_intervals),
        ):
            flat, ends = kinds.reshape(-1, len(names)), intervals.reshape(-1, len(names), 2)
            columns += [(name, flat[:, i], ends[:, i]) for i, name in enumerate(names)]
        return columns

    def _named(self, kind: str) -> list[str]:
        names = []
        for name, kinds, _ in self._columns():
            count = int((kinds == kind).sum())
            if count:
                names.append(name if count == kinds.size else f"{name} ({count} of {kinds.size} poses)")
        return names

    def _open(self) -> bool:
        return any((~np.isin(kinds, ("unique", "none"))).any() for _, kinds, _ in self._columns())

    def _spans(self) -> list[str]:
        spans = []
        for name, kinds, ends in self._columns():
            known = ends[~np.isin(kinds, ("unique", "none")) & ~np.isnan(ends).any(axis=1)]
            if known.size and np.isfinite(known).any():
                low, high = (0.0 if abs(v) < 5e-3 else v for v in (known[:, 0].min(), known[:, 1].max()))
                spans.append(f"{name} {low:.2f} to {high:.2f} N")
        return spans


@checked
@dataclass(frozen=True, eq=False)
class Certificate(Result, ReadOnly):
    """Which reactions of an answer equilibrium determines, for a pose or a stack of shape (...).

    A reaction is unique if no self-stress of the mechanism (a set of closure and joint forces that balances
    itself) changes it; J. Wojtyra's criterion, Multibody Syst. Dyn. 14 (2005) 23, evaluated on the closure Jacobian of
    the pose.

    Attributes
    ----------
    undetermined : ndarray of int
        Shape (...): number of independent reactions that equilibrium alone does not determine; -1 without an answer.
    redundant_closures : ndarray of int
        Shape (...): rows of the loop closures that repeat others, so that only the sum of their forces is determined.
    actuator_forces : ndarray of bool
        Shape (..., n): whether f_i is unique.
    constraint_forces : ndarray of bool
        Shape (..., n): whether g_i is unique (always true for an SPS limb, which has none).
    shoulder_force : ndarray of bool
        Shape (..., 3): whether each base-frame component of F_s is unique.
    torso_wrench : ndarray of bool
        Shape (...,): whether the total wrench of limbs and shoulder on the torso is unique.
    chosen_by : str
        Assumption by which the others were chosen.
    source : ComponentSource or None
        Computes :attr:`components` on demand.
    words : tuple of str
        What f and g are.

    Examples
    --------
    >>> exo = ep.load("prototype")
    >>> certificate = exo.reaction(exo.pose(30, 30), limits="none").certificate
    >>> int(certificate.undetermined)  # of nine reactions: three side forces and F_s for three equations
    3
    """

    undetermined: NDArray[np.int64]
    redundant_closures: NDArray[np.int64]
    actuator_forces: NDArray[np.bool_]
    constraint_forces: NDArray[np.bool_]
    shoulder_force: NDArray[np.bool_]
    torso_wrench: NDArray[np.bool_]
    chosen_by: str
    source: ComponentSource | None = field(default=None, repr=False)
    words: tuple[str, str] = ("limb forces f", "side forces g")

    @functools.cached_property
    def components(self) -> Components:
        """Assumptions behind each component of f, g and F_s, and its interval within the limits of the query.

        Raises
        ------
        InvalidInput
            If the certificate does not come from a query.
        """
        if self.source is None:
            raise InvalidInput("expected a certificate that comes with the answer of a query")
        return self.source.components()

    def sentence(self) -> str:
        """Assumptions behind each component, and what would have to be known, in words.

        Returns
        -------
        str

        Examples
        --------
        >>> exo = ep.load("prototype")
        >>> text = exo.reaction(exo.pose(30, 30), split="standalone", limits="none").certificate.sentence()
        >>> print(text.split(". ")[0] + ".")
        Equilibrium alone does not determine 3 of the reactions.
        """
        return f"{self.statement} {self.components}"

    def __str__(self) -> str:
        open_ends = bool((self.undetermined > 0).any())
        return f"{self.statement} Assumed: {self.chosen_by}." if open_ends else self.statement

    @property
    def statement(self) -> str:
        """Which reactions equilibrium alone determines, in words."""
        counts = np.unique(self.undetermined[self.undetermined >= 0])
        if counts.size == 0:
            if self.source is not None and any(self.source.poses.lacking):
                return "Data of the device do not cover these poses: nothing is known of the forces."
            return "The arm cannot be held in this pose." if self.undetermined.ndim == 0 else "No pose has a solution."
        if counts.max() == 0:
            return "Equilibrium determines every reaction."
        span = str(counts[0]) if counts.size == 1 else f"{counts[0]} to {counts[-1]}"
        sure: list[str] = []
        open_: list[str] = []
        for name, flags in (
            (self.words[0], self.actuator_forces),
            (self.words[1], self.constraint_forces),
            ("shoulder force F_s", self.shoulder_force),
            ("total wrench on the torso", self.torso_wrench),
        ):
            (sure if flags[self.undetermined >= 0].all() else open_).append(name)
        return (
            f"Equilibrium alone does not determine {span} of the reactions. Determined: {', '.join(sure) or 'none'}. "
            f"Not determined: {', '.join(open_) or 'none'}."
        )


def certificate_of(source: ComponentSource) -> Certificate:
    """Which reactions of an answer change with a self-stress, Wojtyra's criterion."""
    poses, upu, good = source.poses, source.poses.upu, np.asarray(~np.isnan(source.values).any(axis=1))
    n, stresses = poses.tensions.self_stress.shape[1:]
    of_f, of_shoulder = poses.open_effects
    g_unique = np.ones((len(good), n), dtype=bool)
    g_unique[:, upu] = False

    def stacked(array: np.ndarray) -> np.ndarray:
        return array.reshape((*source.shape, *array.shape[1:]))

    return Certificate(
        stacked(np.where(good, stresses + upu.size, -1)),
        stacked(np.where(good, upu.size, -1)),
        stacked(is_determined(of_f) & good[:, None]),
        stacked(g_unique & good[:, None]),
        stacked(is_determined(of_shoulder) & good[:, None]),
        # Arm and torso are a closed system: what limbs and shoulder together put on the torso is fixed by the arm.
        stacked(good),
        source.split.assumed(poses.mechanism)
        + (", within the limits of the limbs" if poses.limits.bound_forces and source.held.any() else "")
        + ("" if poses.socket is None or not source.held.any() else ", with regard to the socket"),
        source,
        poses.mechanism.force_words,
    )


def is_determined(effect: FloatArray) -> NDArray[np.bool_]:
    """Whether each row of ``effect`` (..., quantities, self-stresses) is zero, to rounding."""
    return np.asarray(np.abs(effect).max(axis=-1, initial=0.0) <= _NO_EFFECT)


@dataclass(frozen=True, eq=False)
class Optimum(Result, ReadOnly):
    """Optimality of the chosen forces, for a pose or a stack of shape (...).

    Attributes
    ----------
    kkt : ndarray
        Shape (...): largest violation of the optimality conditions, relative to the largest force of the problem;
        0 where there was nothing to choose, NaN without an answer.
    gap : ndarray
        Shape (...), N: duality gap, the most by which the minimised quantity (|F_s| for "minimal" without weights) can
        exceed its least value.
    unique : ndarray of bool
        Shape (...): whether f and g are the only optimal ones. F_s always is for "minimal": its cost is strictly
        convex in it. True is sure, False may be cautious where limits coincide.

    Examples
    --------
    >>> exo = ep.load("four-linear-actuators")
    >>> best = exo.reaction(exo.pose(60, 30), split="minimal").optimum
    >>> bool(best.kkt < 1e-8), bool(best.unique)
    (True, True)
    """

    kkt: FloatArray
    gap: FloatArray
    unique: NDArray[np.bool_]
