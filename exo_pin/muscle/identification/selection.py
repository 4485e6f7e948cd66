"""Selection of a force law: candidates fitted to the same measurements and judged by leave-one-out errors.

Candidates are polynomials in contraction and pressure, (3-10) among them, and the laws of the literature. One that
would not behave like a muscle where it was measured (pull more when shorter, or less with more air) is not
admitted. Of the admitted ones within one standard error of the least squared leave-one-out error, the one with the
fewest coefficients is taken (the one-standard-error rule of Breiman and others): smaller differences are chance.
Choosing by an error makes that error optimistic, so the whole choice can also be repeated with each measurement
left out in turn (nested cross-validation).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import UnknownName
from ...core.errors.muscles import NotIdentifiable
from ...core.validation import FloatArray, as_positive, frozen
from ..laws.static import StaticModel
from .fitted_forms import FittedForm, candidates, left_out_errors
from .region import as_measurements

Columns = tuple[FloatArray, FloatArray, FloatArray]


@dataclass(frozen=True)
class Score:
    """How one candidate did.

    Attributes
    ----------
    candidate : FittedForm
    leave_one_out_rms : float
        N.
    admitted : bool
        Whether it behaves like a muscle at every measurement.
    standard_error : float
        Of the mean squared leave-one-out error, N².
    """

    candidate: FittedForm
    leave_one_out_rms: float
    admitted: bool
    standard_error: float


def _choose(scores: Sequence[Score]) -> Score:
    admitted = [score for score in scores if score.admitted]
    if not admitted:
        raise NotIdentifiable(f"none of {len(scores)} force laws that could be fitted behaves like a muscle")
    least = admitted[0]
    limit = least.leave_one_out_rms**2 + least.standard_error
    # Equal counts keep the order of the scores, best first.
    alike = [score for score in admitted if score.leave_one_out_rms**2 <= limit]
    return min(alike, key=lambda score: score.candidate.parameters)


@dataclass(frozen=True)
class Selection:
    """The outcome of a choice.

    Attributes
    ----------
    model : StaticModel
        The winner, fitted to all measurements.
    scores : tuple of Score
        All candidates, best first.
    nested_errors : ndarray or None
        Shape (n,), N: error at each measurement of the law chosen and fitted without it.
    """

    model: StaticModel
    scores: tuple[Score, ...]
    nested_errors: FloatArray | None

    @property
    def winner(self) -> Score:
        """The candidate that was chosen."""
        return _choose(self.scores)

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

        Raises
        ------
        UnknownName
            If no such candidate was scored.
        """
        for score in self.scores:
            if score.candidate.name == name:
                return score
        raise UnknownName("candidate", name, (s.candidate.name for s in self.scores))


def _behaves(model: StaticModel, x: FloatArray, p: FloatArray) -> bool:
    # A grid over the whole rectangle would ask for states that no weight was ever hung at.
    return bool((model._stiffness(x, p) < 0).all() and (model._pressure_gain(x, p) > 0).all())


def _rank(forms: Sequence[FittedForm], columns: Columns, length: float) -> list[Score]:
    scores = []
    for form in forms:
        try:
            errors = form.leave_one_out(*columns, length)
            admitted = _behaves(form.fit(*columns, length), columns[0], columns[1])
        except NotIdentifiable:
            continue
        squares = errors**2
        spread = float(np.std(squares, ddof=1) / np.sqrt(len(squares)))
        scores.append(Score(form, float(np.sqrt(squares.mean())), admitted, spread))
    return sorted(scores, key=lambda score: score.leave_one_out_rms)


def select_model(
    contraction: ArrayLike,
    pressure: ArrayLike,
    force: ArrayLike,
    nominal_length: float,
    nested: bool = False,
) -> Selection:
    """Choose a force law by leave-one-out errors.

    Parameters
    ----------
    contraction, pressure, force : array_like
        Shape (n,), m, Pa and N.
    nominal_length : float
        Nominal length of the muscle, m.
    nested : bool
        Whether to repeat the choice without each measurement, for an error that the choice has not flattered. The
        literature's laws, whose leave-one-out errors need refits, take part only in the outer choice.

    Returns
    -------
    Selection

    Raises
    ------
    InvalidInput
        If the measurements are not usable columns.
    NotIdentifiable
        If no candidate can be fitted and behaves like a muscle.
    """
    columns = as_measurements(contraction, pressure, force, nominal_length)
    length = as_positive("nominal_length", nominal_length)
    forms = candidates(len(columns[2]))
    scores = _rank(forms, columns, length)
    winner = _choose(scores)
    errors = None
    if nested:
        polynomials = [form for form in forms if form.powers is not None]

        def fit_of_choice(x: FloatArray, p: FloatArray, f: FloatArray, length: float) -> StaticModel:
            return _choose(_rank(polynomials, (x, p, f), length)).candidate.fit(x, p, f, length)

        errors = frozen(left_out_errors(fit_of_choice, *columns, length))
    return Selection(winner.candidate.fit(*columns, length), tuple(scores), errors)
