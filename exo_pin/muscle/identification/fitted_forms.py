"""Forms of force law that can be fitted: polynomials in contraction and pressure, laws of the literature."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import product
from math import pi, sqrt
from typing import Any

import numpy as np
import scipy

from ...core.errors.muscles import NotIdentifiable
from ...core.validation import FloatArray
from ..laws.literature import ChouHannaford, Colbrunn, TonduLopez, Wickramatunge
from ..laws.static import BAR, StaticModel
from .region import Powers, hull
from .static_identification import identify_static

Fit = Callable[[FloatArray, FloatArray, FloatArray, float], StaticModel]

#: Measurements that a coefficient must have at least, so that the choice does not end at an interpolation.
CELLS_PER_COEFFICIENT = 3


@dataclass(frozen=True)
class FittedForm:
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
        return left_out_errors(self.fit, x, p, f, length)


def left_out_errors(fit: Fit, x: FloatArray, p: FloatArray, f: FloatArray, length: float) -> FloatArray:
    """Measured force less the force of a fit to all the others, shape (n,), N."""
    errors = np.empty(len(f))
    for i in range(len(f)):
        rest = np.arange(len(f)) != i
        errors[i] = f[i] - fit(x[rest], p[rest], f[rest], length).unchecked_force(x[i], p[i])
    return errors


def _polynomial(powers: Powers) -> FittedForm:
    # No function within a function: those cannot be pickled.
    fit = partial(_fit_polynomial, powers)
    return FittedForm(" ".join(f"x{i}P{j}" for i, j in powers), len(powers), fit, powers)


def _fit_polynomial(powers: Powers, x: FloatArray, p: FloatArray, f: FloatArray, length: float) -> StaticModel:
    return identify_static(x, p, f, length, powers).model


def _common(name: str, x: FloatArray, p: FloatArray, length: float) -> dict[str, Any]:
    return {"name": f"fitted-{name}", "reference_length": length, "validity": hull(x, p, length)}


def _fit_chou_hannaford(x: FloatArray, p: FloatArray, f: FloatArray, length: float) -> StaticModel:
    # F = P (A L² - B) with A = 3/(4 pi n²), B = b²/(4 pi n²).
    bar = p / BAR
    matrix = np.column_stack([bar * (length - x) ** 2, -bar])
    a, b = np.linalg.lstsq(matrix, f, rcond=None)[0] / BAR
    if a <= 0 or b <= 0:
        raise NotIdentifiable("these data give a Chou-Hannaford braid that cannot exist", ("braid_length", "turns"))
    return ChouHannaford(
        **_common("chou-hannaford", x, p, length),
        braid_length=sqrt(3 * b / a),
        turns=sqrt(3 / (4 * pi * a)),
    )


#: Nominal radius of the Φ6 muscles, m; it only scales the constants of the Tondu-Lopez law.
RADIUS = 0.003


def _fit_tondu_lopez(x: FloatArray, p: FloatArray, f: FloatArray, length: float) -> StaticModel:
    base = pi * RADIUS**2 * p
    matrix = np.column_stack([base * (1 - x / length) ** 2, -base])
    a, b = np.linalg.lstsq(matrix, f, rcond=None)[0]
    if a <= 0 or b <= 0:
        raise NotIdentifiable("these data give a Tondu-Lopez muscle that cannot exist", ("a", "b"))
    return TonduLopez(**_common("tondu-lopez", x, p, length), radius=RADIUS, a=float(a), b=float(b))


def _fit_colbrunn(x: FloatArray, p: FloatArray, f: FloatArray, length: float) -> StaticModel:
    # Eff(P) = 1 + e P, taken as linear; the factor in front is that of Chou and Hannaford, and the limit force,
    # which would pull without air, is left out.
    bar = p / BAR
    square = (length - x) ** 2
    start = np.linalg.lstsq(np.column_stack([bar * square, -bar]), f, rcond=None)[0]

    def residual(c: FloatArray) -> FloatArray:
        return (c[0] * square - c[1]) * bar * (1 + c[2] * bar) - f

    a, b, e = scipy.optimize.least_squares(residual, [*start, 0.0], x_scale="jac", xtol=1e-13, ftol=1e-13, gtol=1e-13).x
    if a <= 0 or b <= 0:
        raise NotIdentifiable("these data give a Colbrunn braid that cannot exist", ("braid_length", "turns"))
    return Colbrunn(
        **_common("colbrunn", x, p, length),
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
        a = np.asarray(np.linalg.lstsq(matrix, f, rcond=None)[0], dtype=np.float64)
        return a, matrix @ a - f

    # Linear in a_0..a_3 for a given rest length: only that one is searched for (variable projection).
    best = scipy.optimize.least_squares(
        lambda c: solve(c[0])[1], [0.6 * length], bounds=([0.3 * length], [length]), xtol=1e-13
    )
    a = solve(float(best.x[0]))[0]
    return Wickramatunge(
        **_common("wickramatunge", x, p, length),
        rest_length=float(best.x[0]),
        a_0=float(a[0]) / BAR**2,
        a_1=float(a[1]) / BAR,
        a_2=float(a[2]),
        a_3=float(a[3]),
    )


_LITERATURE = (
    FittedForm("chou-hannaford", 2, _fit_chou_hannaford),
    FittedForm("tondu-lopez", 2, _fit_tondu_lopez),
    FittedForm("colbrunn", 3, _fit_colbrunn),
    FittedForm("wickramatunge", 5, _fit_wickramatunge),
)


def candidates(measurements: int) -> list[FittedForm]:
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
    forms += _LITERATURE
    return [form for form in forms if CELLS_PER_COEFFICIENT * form.parameters <= measurements]
