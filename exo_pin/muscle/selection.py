"""Which force law to use: candidates fitted to the same measurements and judged by leave-one-out errors.

Candidates are polynomials in contraction and pressure, (3-10) among them, and the laws of the literature. One that
would not behave like a muscle where it was measured (pull more when shorter, or less with more air) is not admitted.
Of the admitted ones within one standard error of the least squared leave-one-out error, the one with the fewest
coefficients is taken (the one-standard-error rule of Breiman and others): smaller differences are chance. Choosing
by an error makes that error optimistic, so the whole choice can also be repeated with each measurement left out in
turn (nested cross-validation).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from math import pi, sqrt

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from ..errors import UnknownName
from ..validation import FloatArray, as_positive, frozen
from .errors import NotIdentifiable
from .identify import identify_static
from .literature import ChouHannaford, Colbrunn, TonduLopez, Wickramatunge
from .region import Powers, as_measurements, hull
from .static import BAR, StaticModel

__all__ = ["Candidate", "Score", "Selection", "candidates", "select_model"]

Columns = tuple[FloatArray, FloatArray, FloatArray]
Fit = Callable[[FloatArray, FloatArray, FloatArray, float], StaticModel]

#: Measurements that a coefficient must have at least, so that the choice does not end at an interpolation.
CELLS_PER_COEFFICIENT = 3


@dataclass(frozen=True)
class Candidate:
    """A form of force law that can be fitted.

    Attributes
    ----------
    name : str
        For example "x3P1 x0P0 x0P2".
    parameters : int
        How many numbers are fitted.
    fit : callable
        From contraction (m), pressure (Pa), force (N) and nominal length (m) to a model.
    powers : tuple or None
        Terms, if the law is a polynomial, which makes leave-one-out errors a closed form.
    """

    name: str
    parameters: int
    fit: Fit
    powers: Powers | None = None

    def leave_one_out(self, x: FloatArray, p: FloatArray, f: FloatArray, length: float) -> FloatArray:
        """Measured force less the force of the fit to all the others, shape (n,), N."""
        if self.powers is not None:
            return identify_static(x, p, f, length, self.powers).leave_one_out
        errors = np.empty(len(f))
        for i in range(len(f)):
            rest = np.arange(len(f)) != i
            model = self.fit(x[rest], p[rest], f[rest], length)
            errors[i] = f[i] - model.unchecked_force(x[i], p[i])
        return errors


def _polynomial(powers: Powers) -> Candidate:
    def fit(x: FloatArray, p: FloatArray, f: FloatArray, length: float) -> StaticModel:
        return identify_static(x, p, f, length, powers).model

    return Candidate(" ".join(f"x{i}P{j}" for i, j in powers), len(powers), fit, powers)


def _fit_chou_hannaford(x: FloatArray, p: FloatArray, f: FloatArray, length: float) -> StaticModel:
    # F = P (A L² - B) with A = 3/(4 pi n²), B = b²/(4 pi n²).
    bar = p / BAR
    matrix = np.column_stack([bar * (length - x) ** 2, -bar])
    a, b = np.linalg.lstsq(matrix, f, rcond=None)[0] / BAR
    if a <= 0 or b <= 0:
        raise NotIdentifiable("these data give a Chou-Hannaford braid that cannot exist", ("braid_length", "turns"))
    return ChouHannaford(
        name="fitted-chou-hannaford",
        reference_length=length,
        validity=hull(x, p, length),
        braid_length=sqrt(3 * b / a),
        turns=sqrt(3 / (4 * pi * a)),
    )


#: Nominal radius of the Φ6 muscles, m; it only scales the constants of the Tondu-Lopez law.
RADIUS = 0.003


def _fit_tondu_lopez(x: FloatArray, p: FloatArray, f: FloatArray, length: float) -> StaticModel:
    base = pi * RADIUS**2 * p
    matrix = np.column_stack([base * (1 - x / length) ** 2, -base])
    a, b = np.linalg.lstsq(matrix, f, rcond=None)[0]
    validity = hull(x, p, length)
    return TonduLopez(
        name="fitted-tondu-lopez", reference_length=length, validity=validity, radius=RADIUS, a=float(a), b=float(b)
    )


def _fit_colbrunn(x: FloatArray, p: FloatArray, f: FloatArray, length: float) -> StaticModel:
    # Eff(P) = 1 + e P, taken as linear; the factor in front is that of Chou and Hannaford, and the limit force, which
    # would pull without air, is left out.
    bar = p / BAR
    square = (length - x) ** 2
    start = np.linalg.lstsq(np.column_stack([bar * square, -bar]), f, rcond=None)[0]

    def residual(c: FloatArray) -> FloatArray:
        return (c[0] * square - c[1]) * bar * (1 + c[2] * bar) - f

    a, b, e = least_squares(residual, [*start, 0.0], x_scale="jac", xtol=1e-13, ftol=1e-13, gtol=1e-13).x
    if a <= 0 or b <= 0:
        raise NotIdentifiable("these data give a Colbrunn braid that cannot exist", ("braid_length", "turns"))
    return Colbrunn(
        name="fitted-colbrunn",
        reference_length=length,
        validity=hull(x, p, length),
        braid_length=sqrt(3 * b / a),
        turns=sqrt(3 * BAR / (4 * pi * a)),
        efficiency=(1.0, float(e) / BAR),
        limit_force=0.0,
        least_length=0.5 * length,
    )


def _fit_wickramatunge(x: FloatArray, p: FloatArray, f: FloatArray, length: float) -> StaticModel:
    bar = p / BAR

    def solve(rest: float) -> tuple[FloatArray, FloatArray]:
        s = length - x - rest
        matrix = np.column_stack([bar**2 * s, bar * s**2, s**3, s])
        a = np.linalg.lstsq(matrix, f, rcond=None)[0]
        return a, matrix @ a - f

    # Linear in a_0..a_3 for a given rest length: only that one is searched for (variable projection).
    best = least_squares(lambda c: solve(c[0])[1], [0.6 * length], bounds=([0.3 * length], [length]), xtol=1e-13)
    a = solve(float(best.x[0]))[0]
    return Wickramatunge(
        name="fitted-wickramatunge",
        reference_length=length,
        validity=hull(x, p, length),
        rest_length=float(best.x[0]),
        a_0=float(a[0]) / BAR**2,
        a_1=float(a[1]) / BAR,
        a_2=float(a[2]),
        a_3=float(a[3]),
    )


_LITERATURE: tuple[tuple[str, int, Fit], ...] = (
    ("chou-hannaford", 2, _fit_chou_hannaford),
    ("tondu-lopez", 2, _fit_tondu_lopez),
    ("colbrunn", 3, _fit_colbrunn),
    ("wickramatunge", 5, _fit_wickramatunge),
)


def candidates(measurements: int) -> list[Candidate]:
    """Forms that are tried on so many measurements.

    Polynomials g(x) P + s(x) + q(x) P² with g of degree 0 to 4, s of degree up to 4 or none, q of degree up to 2 or
    none, and the literature's laws (row 3 of Table 2-4 is among the polynomials), each with at least
    ``CELLS_PER_COEFFICIENT`` measurements a coefficient.
    """
    forms = []
    for g, s, q in product(range(5), range(-1, 5), range(-1, 3)):
        powers = [(i, 1) for i in range(g, -1, -1)]
        powers += [(i, 0) for i in range(s, -1, -1)] + [(i, 2) for i in range(q, -1, -1)]
        forms.append(_polynomial(tuple(powers)))
    forms += [Candidate(name, count, fit) for name, count, fit in _LITERATURE]
    return [form for form in forms if CELLS_PER_COEFFICIENT * form.parameters <= measurements]


@dataclass(frozen=True)
class Score:
    """How one candidate did.

    Attributes
    ----------
    candidate : Candidate
    leave_one_out_rms : float
        N.
    admitted : bool
        Whether it behaves like a muscle at every measurement.
    standard_error : float
        Of the mean squared leave-one-out error, N².
    """

    candidate: Candidate
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


def _rank(forms: Sequence[Candidate], columns: Columns, length: float) -> list[Score]:
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
    columns = as_measurements(contraction, pressure, force)
    length = as_positive("nominal_length", nominal_length)
    n = len(columns[2])
    forms = candidates(n)
    scores = _rank(forms, columns, length)
    winner = _choose(scores)
    errors = None
    if nested:
        polynomials = [form for form in forms if form.powers is not None]
        errors = np.empty(n)
        for i in range(n):
            rest = np.arange(n) != i
            inner = (columns[0][rest], columns[1][rest], columns[2][rest])
            chosen = _choose(_rank(polynomials, inner, length))
            model = chosen.candidate.fit(*inner, length)
            errors[i] = columns[2][i] - model.unchecked_force(columns[0][i], columns[1][i])
        errors = frozen(errors)
    return Selection(winner.candidate.fit(*columns, length), tuple(scores), errors)
