"""What an identification from responses took as known, and what an error of it does to friction and damping.

Least squares moves the coefficients by dc = -J⁺ dr where an error of a known quantity moves the residuals by dr.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.results import Known
from ...core.validation import FloatArray
from ..laws.dynamic import DynamicModel
from ..laws.static import BAR, StaticModel

if TYPE_CHECKING:
    from .dynamic_identification import Recording

#: Share of the stated error by which the derivative is taken, to either side.
_STEP = 0.01
#: Of errors, in SI.
_UNITS = {"%": 0.01, "bar": BAR, "mm": 1e-3}
#: An error shows if it moves the residuals together by this many standard deviations.
_SHOWS = 3.0


@dataclass(frozen=True)
class _Off(StaticModel):
    """A force law with the zeros of gauge (Pa) and ruler (m) off, and its force scaled."""

    law: StaticModel = field(kw_only=True)
    pressure: float = 0.0
    contraction: float = 0.0
    share: float = 1.0

    def _force(self, x: Any, pressure: Any) -> Any:
        return self.share * self.law._force(x - self.contraction, pressure - self.pressure)

    def _stiffness(self, x: Any, pressure: Any) -> Any:
        return self.share * self.law._stiffness(x - self.contraction, pressure - self.pressure)

    def _pressure_gain(self, x: Any, pressure: Any) -> Any:
        return self.share * self.law._pressure_gain(x - self.contraction, pressure - self.pressure)


def known_inputs(
    build: Callable[[FloatArray], DynamicModel],
    values: FloatArray,
    recordings: Sequence[Recording],
    slopes: FloatArray,
    sigma: float,
) -> tuple[Known, ...]:
    """Errors of the force law, the sensors and the weights, and by how many per cent each changes friction and damping.

    Of their root mean squares over the samples.

    Parameters
    ----------
    build : callable
        Makes a model from coefficients.
    values : ndarray
        Shape (5,), the coefficients that were found.
    recordings : sequence of Recording
        The recorded responses.
    slopes : ndarray
        Shape (n, 5): derivatives of all residuals by the coefficients.
    sigma : float
        Standard deviation of one sample, m.
    """
    model = build(values)
    law = model.static
    shared = {each.name: getattr(law, each.name) for each in fields(StaticModel)}

    def residuals(weight: float = 1.0, **off: Any) -> FloatArray:
        moved = replace(model, static=_Off(**shared, law=law, **off))
        return np.concatenate([replace(each, mass=weight * each.mass).residual(moved) for each in recordings])

    def found(key: str, true: float, name: str, size: float, unit: str) -> Known:
        step = _STEP * size * _UNITS[unit]
        moved = (residuals(**{key: true + step}) - residuals(**{key: true - step})) / (2.0 * _STEP)
        change = -np.linalg.lstsq(slopes / norms, moved, rcond=1e-10)[0] / norms
        off = np.linalg.norm(_forces(build(change), recordings), axis=1)
        share = 100.0 * np.divide(off, here, out=np.full(2, np.inf), where=here > 0.0)
        effects = dict(zip(("friction_percent", "damping_percent"), share.tolist(), strict=True))
        return Known(name, size, unit, effects, bool(np.linalg.norm(moved + slopes @ change) > _SHOWS * sigma))

    norms = np.linalg.norm(slopes, axis=0)
    here = np.linalg.norm(_forces(model, recordings), axis=1)
    return (
        found("share", 1.0, "force law", 1.0, "%"),
        found("pressure", 0.0, "gauge's zero", 0.1, "bar"),
        found("contraction", 0.0, "contraction's zero", 1.0, "mm"),
        found("weight", 1.0, "hung weight", 1.0, "%"),
    )


def _forces(model: DynamicModel, recordings: Sequence[Recording]) -> FloatArray:
    """Friction and damping in all samples as the formulas give them, shape (2, n), N."""
    rows = []
    for each in recordings:
        x, p = each.contraction, each.pressure.sample(each.time)
        friction = model.friction.printed(x, p, each.mass)
        rows.append(np.stack([friction, model.damping.printed(np.gradient(x, each.time), p)]))
    return np.concatenate(rows, axis=1)
