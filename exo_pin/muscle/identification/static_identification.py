"""Coefficients of a static force law from measurements, by linear least squares, with confidence intervals.

The law is linear in its coefficients, so fit, covariance and leave-one-out errors are closed forms. The
coefficients of (3-10) are nearly interchangeable on such data (K_2 against S_2, say): refits give other
coefficients and the same forces. So the result names the coefficients that the data cannot distinguish, and gives
the uncertainty of the force.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import compress

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput, NotIdentifiable
from ...core.errors.checked import checked
from ...core.records import Record
from ...core.results import Known
from ...core.validation import FloatArray, as_positive, frozen
from ..laws.force_laws import PolynomialModel
from ..laws.validity import Validity
from .plausibility import AREA_SHARES, as_measurements
from .regimes import OUTLIER_LEVEL, SECOND_ORDER, Powers, design_matrix, leave_one_out_p, rounding_variance
from .region import Region, collinear, confidence_interval, hull, region_of

#: A law that leaves this share of the greatest pull (standard deviation) does not describe the measurements.
_ROW_BY_ROW = 0.08
_NAMES = dict(zip(SECOND_ORDER, ("K_1", "K_2", "C_1", "S_1", "S_2", "S_3"), strict=True))


def coefficient_name(powers: tuple[int, int]) -> str:
    """Symbol of (3-10) for a pair of powers (contraction, pressure), or for example "x3P1"."""
    return _NAMES.get(powers, f"x{powers[0]}P{powers[1]}")


@dataclass(frozen=True)
class StaticIdentification(Record):
    """A fitted force law.

    Attributes
    ----------
    model : PolynomialModel
        The law, with the validity range of its data.
    powers : tuple of (int, int)
        Powers of contraction and pressure of each coefficient.
    names : tuple of str
        Their symbols.
    coefficients : ndarray
        Shape (k,), N m^-i bar^-j.
    covariance : ndarray
        Shape (k, k), in the squares of those units.
    residuals : ndarray
        Shape (n,), measured less fitted force, N.
    leave_one_out : ndarray
        Shape (n,), measured force less the force of the fit to all the others, N.
    sigma : float
        Standard deviation of one measurement about the law, N, from n - k degrees of freedom.
    indistinct : tuple of str
        Coefficients that the data cannot distinguish; compare forces, not these.
    region : Region or None
        How the measurements were chosen, if they were.
    rounding : float
        Standard deviation of a measured force from the digits of the data alone, N. The covariance is of this scatter
        where it is larger than ``sigma``.
    suspects : tuple of int
        Fitted measurements that the others contradict, counted from 0 in the order given.
    doubts : tuple of str
        What a pneumatic muscle is unlikely to do, with the slip in the data that explains it.

    Examples
    --------
    >>> from exo_pin.muscle import identify_static, steady_states
    >>> states = steady_states(valid_only=True)
    >>> fit = identify_static(states.contraction, states.pressure, states.force, 0.3, select="all")
    >>> fit.names, round(float(fit.sigma), 2)  # N
    (('K_1', 'K_2', 'C_1', 'S_1', 'S_2', 'S_3'), 0.49)
    """

    model: PolynomialModel
    powers: Powers
    names: tuple[str, ...]
    coefficients: FloatArray
    covariance: FloatArray
    residuals: FloatArray
    leave_one_out: FloatArray
    sigma: float
    indistinct: tuple[str, ...]
    region: Region | None
    rounding: float
    suspects: tuple[int, ...]
    doubts: tuple[str, ...]

    @property
    def cautions(self) -> tuple[str, ...]:
        """Doubts about the data, outliers, measurements outside the region, coefficients that are not distinct."""
        found = list(self.doubts)
        if self.region is not None:
            total, outliers = len(self.region.selected), self.region.outliers
            beyond = total - int(self.region.selected.sum()) - len(outliers)
            if beyond:
                dropped = np.setdiff1d(np.flatnonzero(~self.region.selected), outliers)
                which = f" ({', '.join(str(index + 1) for index in dropped)})" if beyond <= 5 else ""
                found.append(
                    f"{beyond} of {total} measurements{which} are beyond the capability of the muscle and not fitted: "
                    "it is hardly contracted there and pulls more than the law, for its braid carries a part."
                )
            if len(outliers):
                found.append(
                    f"{_measurements(outliers.tolist())} not fitted: the others contradict it. "
                    "Look for a slip in its row."
                )
            if self.region.misfit is not None:
                found.append(
                    f"One law of this form does not describe the measurements: it leaves {self.region.misfit:.2g} N "
                    "(rms), more than their scatter, and not as a braid would. Try other powers."
                )
        if self.suspects:
            found.append(
                f"{_measurements(self.suspects)} fitted, but the others contradict it: look for a slip in its row."
            )
        if self.indistinct:
            found.append(f"The data cannot distinguish {', '.join(self.indistinct)}: compare forces.")
        return tuple(found)

    @property
    def known(self) -> tuple[Known, ...]:
        """What the fit took as known of the sensors, and how much an error of it changes the law, of the middle force.

        Residuals show none of it: the law of a shifted gauge, ruler or scale has the same form.
        """
        ranges = ((self.model.reference_length, self.model.validity.strain), (1.0, self.model.validity.pressure))
        x, p = np.meshgrid(*(size * np.linspace(*range_, 9) for size, range_ in ranges))

        def force(dx: float = 0.0, dp: float = 0.0) -> FloatArray:
            return np.asarray(np.ma.getdata(self.model.force(x - dx, p - dp, outside="mark")))

        middle = np.median(np.abs(force()))
        return tuple(
            Known(name, size, unit, {"force_percent": float(100.0 * np.median(np.abs(off)) / middle)}, shows=False)
            for name, size, unit, off in (
                ("gauge's zero", 0.1, "bar", force(dp=1e4) - force()),
                ("contraction's zero", 1.0, "mm", force(dx=1e-3) - force()),
                ("force sensor's scale", 1.0, "%", 1e-2 * force()),
            )
        )

    @property
    def diameters(self) -> tuple[float, float]:
        """Least and greatest diameter at rest of a muscle that pulls so, m: what bounds the unit of the force."""
        limits = self.model.validity
        strain = max(0.0, limits.strain[0])
        gain = float(self.model.pressure_gain(strain * self.model.length, limits.pressure[1], "mark").data)
        least, most = (float(np.sqrt(4.0 * max(gain, 0.0) / (np.pi * share))) for share in AREA_SHARES[::-1])
        return least, most

    @property
    def degrees_of_freedom(self) -> int:
        """Measurements less coefficients."""
        return len(self.residuals) - len(self.coefficients)

    @property
    def rms(self) -> float:
        """Root mean square of the residuals, N."""
        return float(np.sqrt(np.mean(self.residuals**2)))

    @property
    def leave_one_out_rms(self) -> float:
        """Root mean square of the leave-one-out errors, N."""
        return float(np.sqrt(np.mean(self.leave_one_out**2)))

    def intervals(self, level: float = 0.95) -> FloatArray:
        """Confidence interval of each coefficient, shape (k, 2), from Student's t and the digits of the data.

        Parameters
        ----------
        level : float
            Probability that an interval covers the coefficient, between 0 and 1.

        Returns
        -------
        numpy.ndarray
            Shape (k, 2), least and greatest of each coefficient, in its own unit.

        Raises
        ------
        InvalidInput
            If ``level`` is not between 0 and 1.

        Examples
        --------
        >>> from exo_pin.muscle import identify_static, steady_states
        >>> states = steady_states(valid_only=True)
        >>> fit = identify_static(states.contraction, states.pressure, states.force, 0.3, select="all")
        >>> low, high = fit.intervals().T
        >>> [name for name, zero in zip(fit.names, (low < 0.0) & (high > 0.0)) if zero]  # zero is as likely
        ['K_1']
        """
        return confidence_interval(self.coefficients, np.diag(self.covariance), level, self.degrees_of_freedom)


def _measurements(indices: Sequence[int]) -> str:
    """Measurements by their number from 1, as a subject."""
    numbers = ", ".join(str(index + 1) for index in indices)
    return f"Measurement{'s' if len(indices) > 1 else ''} {numbers} {'are' if len(indices) > 1 else 'is'}"


@checked
def identify_static(
    contraction: ArrayLike,
    pressure: ArrayLike,
    force: ArrayLike,
    nominal_length: float,
    powers: Powers = SECOND_ORDER,
    select: str = "all",
    name: str = "identified",
    source: str = "",
    validity: Validity | None = None,
    diameter: float | None = None,
    written: tuple[str, str, str] = ("m", "Pa", "N"),
) -> StaticIdentification:
    """Fit a force law that is a polynomial in contraction and pressure.

    Parameters
    ----------
    contraction, pressure, force : array_like
        Shape (n,), m, Pa and N.
    nominal_length : float
        Nominal length of the muscle, m.
    powers : tuple of (int, int)
        Powers of contraction and pressure of the terms; (3-10) by default.
    select : {"all", "region"}
        Fit all measurements, or those of the region that :func:`find_region` finds without its outliers; the
        intervals take that choice as given.
    name, source : str
        Name and source of the parameter set.
    validity : Validity or None
        Validity range of the set; None for that of the data.
    diameter : float or None
        Of the muscle at rest, m, against which the pull is checked; without it only the slenderness is bounded.
    written : tuple of str
        Units in which contraction, pressure and force came, for example ("mm", "psi", "N"): hints about a slip speak of
        these. The arrays are in m, Pa and N all the same.

    Returns
    -------
    StaticIdentification

    Raises
    ------
    InvalidInput
        If the measurements are not usable columns, no muscle can have made them (it names the likely slip), or
        ``select`` is neither "all" nor "region".
    NotIdentifiable
        If there are no more measurements than coefficients, or columns depend on one another exactly; it names the
        coefficients.

    Notes
    -----
    Source: thesis (3-24).

    Examples
    --------
    >>> from exo_pin.muscle import identify_static, steady_states
    >>> states = steady_states(valid_only=True)
    >>> fit = identify_static(states.contraction, states.pressure, states.force, 0.3, select="all")
    >>> round(float(fit.rms), 2), round(float(fit.leave_one_out_rms), 2)  # N
    (0.43, 0.61)
    """
    x, p, f, doubts = as_measurements(contraction, pressure, force, nominal_length, diameter, written)
    length = as_positive("nominal_length", nominal_length)
    if select not in ("all", "region"):
        raise InvalidInput(f"expected select to be 'all' or 'region', got {select!r}")
    names = tuple(coefficient_name(pair) for pair in powers)
    # Fewer measurements than a test of two regimes needs are one regime.
    region = region_of(x, p, f, length, powers) if select == "region" and len(x) > len(powers) + 2 else None
    if region is not None:
        x, p, f = x[region.selected], p[region.selected], f[region.selected]
    n, k = len(f), len(powers)
    if n <= k:
        raise NotIdentifiable(f"expected more than {k} measurements for {k} coefficients, got {n}", names)
    matrix = design_matrix(x, p, powers)
    norms = np.linalg.norm(matrix, axis=0)
    if (norms == 0).any() or np.linalg.matrix_rank(matrix / norms) < k:
        lost = tuple(compress(names, collinear(matrix)))
        raise NotIdentifiable(f"these data cannot determine the coefficients {', '.join(lost)}", lost)
    # Columns of unit length and an orthogonal factor: the normal equations would square the condition number.
    orthogonal, upper = np.linalg.qr(matrix / norms)
    coefficients = np.linalg.solve(upper, orthogonal.T @ f) / norms
    residuals = f - matrix @ coefficients
    sigma = float(np.sqrt(residuals @ residuals / (n - k)))
    rounding = float(np.sqrt(rounding_variance(x, p, f, powers)))
    contradicted = leave_one_out_p(matrix / norms, f, rounding**2) * n < OUTLIER_LEVEL
    if sigma > _ROW_BY_ROW * np.abs(f).max():
        besides = "" if region else "whether some weights are beyond the muscle's capability (select='region'), and "
        doubts += (f"The law leaves {sigma:.2g} N: look {besides}whether the columns belong row by row.",)
    inverse = np.linalg.inv(upper)
    spread = inverse @ inverse.T
    leverage = (orthogonal**2).sum(axis=1)
    basis = f"range of the {n} measurements"
    found = region.validity if region is not None else hull(x, p, length, basis=basis)
    model = PolynomialModel.from_bar(
        dict(zip(powers, coefficients.tolist(), strict=True)),
        name=name,
        reference_length=length,
        validity=validity or found,
        source=source,
    )
    return StaticIdentification(
        model=model,
        powers=tuple(powers),
        names=names,
        coefficients=frozen(coefficients),
        covariance=frozen(max(sigma, rounding) ** 2 * spread / np.outer(norms, norms)),
        residuals=frozen(residuals),
        leave_one_out=frozen(residuals / (1 - leverage)),
        sigma=sigma,
        indistinct=tuple(compress(names, collinear(matrix))),
        region=region,
        rounding=rounding,
        suspects=tuple(np.flatnonzero(contradicted).tolist()) if region is None else (),
        doubts=doubts,
    )
