"""Selection of a force law: candidates fitted to the same measurements and judged by leave-one-out errors.

Candidates are polynomials in contraction and pressure, (3-10) among them. One that would not behave like a muscle
where it was measured (pull more when shorter, or less with more air) is not admitted. Of the admitted ones within one
standard error of the least squared leave-one-out error, the one with the fewest coefficients is taken (the
one-standard-error rule of Breiman and others): smaller differences are chance. Choosing by an error makes that error
optimistic, so the whole choice can also be repeated with each measurement left out in turn (nested cross-validation).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import NotIdentifiable, UnknownName
from ...core.errors.checked import checked
from ...core.validation import FloatArray, as_positive, frozen
from ..laws.static import StaticModel
from .region import Powers, as_measurements
from .static_identification import identify_static

#: Measurements that a coefficient must have at least, so that the choice does not end at an interpolation.
CELLS_PER_COEFFICIENT = 3


@dataclass(frozen=True)
class Score:
    """How one candidate did.

    Attributes
    ----------
    powers : tuple of (int, int)
        Powers of contraction and pressure of its terms.
    model : StaticModel
        Fitted to all measurements.
    leave_one_out_rms : float
        N.
    admitted : bool
        Whether it behaves like a muscle at every measurement.
    standard_error : float
        Of the mean squared leave-one-out error, N².
    """

    powers: Powers
    model: StaticModel
    leave_one_out_rms: float
    admitted: bool
    standard_error: float

    @property
    def name(self) -> str:
        """For example "x3P1 x0P0 x0P2"."""
        return " ".join(f"x{i}P{j}" for i, j in self.powers)


@dataclass(frozen=True)
class Selection:
    """The outcome of a choice.

    Attributes
    ----------
    winner : Score
        The candidate that was chosen.
    scores : tuple of Score
        All candidates, best first.
    nested_errors : ndarray or None
        Shape (n,), N: error at each measurement of the law chosen and fitted without it.

    Examples
    --------
    >>> from exo_pin.muscle import select_model, steady_states
    >>> states = steady_states(valid_only=True)
    >>> choice = select_model(states.contraction, states.pressure, states.force, 0.3)
    >>> rejected = [score for score in choice.scores if not score.admitted]  # a weight would fall, or air would push
    >>> len(rejected), len(choice.scores)
    (7, 86)
    """

    winner: Score
    scores: tuple[Score, ...]
    nested_errors: FloatArray | None

    @property
    def model(self) -> StaticModel:
        """The winner's law."""
        return self.winner.model

    @property
    def nested_rms(self) -> float:
        """Root mean square of the nested errors, N.

        Raises
        ------
        NotIdentifiable
            If the selection was made without nesting.
        """
        if self.nested_errors is None:
            raise NotIdentifiable("expected a selection made with nested=True")
        return float(np.sqrt(np.mean(self.nested_errors**2)))

    def score(self, name: str) -> Score:
        """Score of the candidate with this name.

        Parameters
        ----------
        name : str
            Of a candidate.

        Returns
        -------
        Score

        Raises
        ------
        UnknownName
            If no such candidate was scored.

        Examples
        --------
        >>> from exo_pin.muscle import select_model, steady_states
        >>> states = steady_states(valid_only=True)
        >>> choice = select_model(states.contraction, states.pressure, states.force, 0.3)
        >>> round(choice.score(choice.winner.name).leave_one_out_rms, 2)  # N
        0.41
        """
        for score in self.scores:
            if score.name == name:
                return score
        raise UnknownName("candidate", name, (s.name for s in self.scores))


def candidates(measurements: int) -> list[Powers]:
    """Forms that are tried on so many measurements.

    Polynomials g(x) P + s(x) + q(x) P² with g of degree 0 to 4, s of degree up to 4 or none, q of degree up to 2 or
    none, each with at least ``CELLS_PER_COEFFICIENT`` measurements a coefficient.
    """
    forms = []
    for g, s, q in product(range(5), range(-1, 5), range(-1, 3)):
        powers = [(i, 1) for i in range(g, -1, -1)]
        powers += [(i, 0) for i in range(s, -1, -1)] + [(i, 2) for i in range(q, -1, -1)]
        forms.append(tuple(powers))
    return [form for form in forms if CELLS_PER_COEFFICIENT * len(form) <= measurements]


def _choice(
    forms: Sequence[Powers], x: FloatArray, p: FloatArray, f: FloatArray, length: float
) -> tuple[Score, list[Score]]:
    """The winner, and all scores, best first."""
    scores = []
    for powers in forms:
        try:
            found = identify_static(x, p, f, length, powers)
        except NotIdentifiable:
            continue
        # A grid over the whole rectangle would ask for states that no weight was ever hung at.
        model = found.model
        admitted = bool((model._stiffness(x, p) < 0).all() and (model._pressure_gain(x, p) > 0).all())
        spread = float(np.std(found.leave_one_out**2, ddof=1) / np.sqrt(len(f)))
        scores.append(Score(powers, model, found.leave_one_out_rms, admitted, spread))
    scores.sort(key=lambda score: score.leave_one_out_rms)
    admitted_ones = [score for score in scores if score.admitted]
    if not admitted_ones:
        raise NotIdentifiable(f"none of {len(scores)} force laws that could be fitted behaves like a muscle")
    least = admitted_ones[0]
    limit = least.leave_one_out_rms**2 + least.standard_error
    # Equal counts keep the order of the scores, best first.
    alike = [score for score in admitted_ones if score.leave_one_out_rms**2 <= limit]
    return min(alike, key=lambda score: len(score.powers)), scores


@checked
def select_model(
    contraction: ArrayLike, pressure: ArrayLike, force: ArrayLike, nominal_length: float, nested: bool = False
) -> Selection:
    """Choose a force law by leave-one-out errors.

    Parameters
    ----------
    contraction, pressure, force : array_like
        Shape (n,), m, Pa and N.
    nominal_length : float
        Nominal length of the muscle, m.
    nested : bool
        Whether to repeat the choice without each measurement, for an error that the choice has not flattered.

    Returns
    -------
    Selection

    Raises
    ------
    InvalidInput
        If the measurements are not usable columns.
    NotIdentifiable
        If no candidate can be fitted and behaves like a muscle.

    Examples
    --------
    >>> from exo_pin.muscle import select_model, steady_states
    >>> states = steady_states(valid_only=True)
    >>> choice = select_model(states.contraction, states.pressure, states.force, 0.3)
    >>> len(choice.winner.powers)  # coefficients
    6
    """
    x, p, f = as_measurements(contraction, pressure, force, nominal_length)
    length = as_positive("nominal_length", nominal_length)
    forms = candidates(len(f))
    winner, scores = _choice(forms, x, p, f, length)
    errors = None
    if nested:
        errors = np.empty(len(f))
        for i in range(len(f)):
            rest = np.arange(len(f)) != i
            chosen = _choice(forms, x[rest], p[rest], f[rest], length)[0]
            errors[i] = f[i] - chosen.model.unchecked_force(x[i], p[i])
        errors = frozen(errors)
    return Selection(winner, tuple(scores), errors)
