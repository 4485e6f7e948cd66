"""Which parameters matter most for a movement."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from ..core.errors import InvalidInput, SolverFailed
from ..core.results import Result
from ..core.validation import FloatArray, as_choice, as_count, as_mapping, as_positive
from .force_sensitivity import Parameter, Sensitivity

__all__ = ["ASSUMED_UNCERTAINTY", "Influence", "Ranking", "rank"]

#: A number in the parameter's unit, or a share of its value such as "5%".
Uncertainty = float | str

#: Assumed uncertainties, to be replaced by what is known of a device and its wearer. The offset is the error of usual
#: estimates of the shoulder's centre; for K_s no published value was found.
ASSUMED_UNCERTAINTY: Mapping[str, Uncertainty] = MappingProxyType(
    {
        "orientation": np.radians(2.0),
        "r_A": 2e-3,
        "r_B": 2e-3,
        "h_A": 2e-3,
        "h_B": 2e-3,
        "alpha_A": np.radians(1.0),
        "alpha_B": np.radians(1.0),
        "base_points": 2e-3,
        "platform_points": 2e-3,
        "mass": "5%",
        "centre_of_mass": 10e-3,
        "inertia": "10%",
        "load_force": "5%",
        "load_moment": "5%",
        "load_point": 10e-3,
        "bending_rigidity": "20%",
        "torsional_rigidity": "20%",
        "joint_stiffness": "50%",
        "joint_twist_stiffness": "50%",
        "shoulder_stiffness": "50%",
        "offset": 15e-3,
    }
)
#: Vectors: their uncertainty is a ball, whose worst direction counts.
_VECTORS = ("orientation", "centre_of_mass", "load_force", "load_moment", "load_point", "offset", "offset_base",
            "offset_cuff")  # fmt: skip
_POINTS = ("base_points", "platform_points")
#: Matrices: their uncertainty is a common factor.
_TENSORS = ("inertia", "shoulder_stiffness")


@dataclass(frozen=True)
class Influence:
    """Effect of one uncertain parameter on the peak.

    Attributes
    ----------
    name, label, unit : str
        Parameter, which of its components ("" for the whole), and unit.
    uncertainty : float or str
        As stated.
    effect : float
        Change of |F_s| at the peak by the uncertainty, N, to first order, worst direction.
    relative : float
        ``effect`` over the peak.
    """

    name: str
    label: str
    unit: str
    uncertainty: Uncertainty
    effect: float
    relative: float


@dataclass(frozen=True, eq=False)
class Ranking(Result):
    """The parameters that matter most for the peak |F_s| of a movement, by first-order effect.

    Attributes
    ----------
    peak : float
        Largest |F_s|, N.
    at : tuple of int
        Index of that pose in the movement.
    influences : tuple of Influence
        Largest effect first.
    """

    peak: float
    at: tuple[int, ...]
    influences: tuple[Influence, ...]

    def __str__(self) -> str:
        where = f" at pose {', '.join(map(str, self.at))}" if self.at else ""
        lines = [f"Peak |F_s| {self.peak:.2f} N{where}; to first order it changes by"]
        for item in self.influences:
            known = (
                f"±{item.uncertainty}" if isinstance(item.uncertainty, str) else f"±{item.uncertainty:.3g} {item.unit}"
            )
            name = f"{item.name} {item.label}".rstrip()
            lines.append(f"  {item.effect:8.2f} N ({100 * item.relative:5.1f} %)  {name}, {known}")
        return "\n".join(lines)


def rank(found: Sensitivity, uncertainties: Mapping[str, Uncertainty] | None = None, top: int = 5) -> Ranking:
    """Order the parameters of a movement by the effect of their uncertainty on its peak shoulder force.

    The derivative of a peak is that at the peak's pose. Numbers of single limbs count separately; a vector is
    uncertain by a ball of that radius; a stiffness matrix or inertia by a common factor, or if a number is given, by
    the same in every principal direction.

    Parameters
    ----------
    found : Sensitivity
        Of the poses of the movement.
    uncertainties : mapping, optional
        By name of the parameter: a number in its unit, or a share of its value such as "5%". They replace those of
        :data:`ASSUMED_UNCERTAINTY`; zero leaves a parameter out.
    top : int
        Number of parameters.

    Returns
    -------
    Ranking

    Raises
    ------
    UnknownName
        If an uncertainty is stated for a name that is no parameter of the query.
    InvalidInput
        If it is neither a number of zero or more nor a percentage, a percentage of the orientation, or ``top`` is
        below 1.
    SolverFailed
        If no pose has an answer with a shoulder force.
    """
    count = as_count("top", top, 1)
    stated = dict(as_mapping("uncertainties", uncertainties, "names of parameters to numbers or percentages"))
    for name in stated:
        as_choice("parameter", name, found.parameters)
    # Points on circles move with their circles' dimensions.
    chosen = {
        name: value
        for name, value in ASSUMED_UNCERTAINTY.items()
        if name in found.parameters and not (name in _POINTS and "r_A" in found.parameters)
    }
    chosen.update(stated)
    size = np.linalg.norm(found.shoulder_force, axis=-1)
    if not (size > 0.0).any():
        raise SolverFailed("ranking", np.inf, "no pose of the movement has an answer with a shoulder force")
    at = tuple(int(i) for i in np.unravel_index(int(np.nanargmax(size)), size.shape))
    peak = float(size[at])
    influences = []
    for name, uncertainty in chosen.items():
        parameter, slope = found.parameters[name], found.magnitude(name)[at]
        for label, effect in _effects(parameter, parameter.value[at], slope, uncertainty):
            influences.append(Influence(name, label, parameter.unit, uncertainty, effect, effect / peak))
    influences = [item for item in influences if item.effect > 0.0]
    influences.sort(key=lambda item: -item.effect)
    return Ranking(peak, at, tuple(influences[:count]))


def _effects(
    parameter: Parameter, value: FloatArray, slope: FloatArray, uncertainty: Uncertainty
) -> list[tuple[str, float]]:
    """Label and effect of each independent part of a parameter."""
    share, size = _parse(parameter.name, uncertainty)
    if share is not None and parameter.name == "orientation":
        raise InvalidInput(
            f"expected uncertainty of orientation in rad, of which there is no share, got {uncertainty!r}"
        )
    if parameter.name in _TENSORS:
        along = value * share if share is not None else size * np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
        return [("", abs(float(slope @ along)))]
    if parameter.name in _VECTORS:
        radius = size if share is None else share * float(np.linalg.norm(value))
        return [("", radius * float(np.linalg.norm(slope)))]
    if parameter.name in _POINTS:
        points, slopes = value.reshape(-1, 3), slope.reshape(-1, 3)
        radii = np.full(len(points), size) if share is None else share * np.linalg.norm(points, axis=1)
        return [(str(i + 1), float(r * np.linalg.norm(d))) for i, (r, d) in enumerate(zip(radii, slopes, strict=True))]
    steps = np.full(len(value), size) if share is None else share * np.abs(value)
    return [(label, abs(float(s * d))) for label, s, d in zip(parameter.labels, steps, slope, strict=True)]


def _parse(name: str, uncertainty: Uncertainty) -> tuple[float | None, float]:
    """A share of the value, or None, and a size in the parameter's unit."""
    if not isinstance(uncertainty, str):
        return None, as_positive(f"uncertainty of {name}", uncertainty, zero=True)
    try:
        number = float(uncertainty.removesuffix("%")) if uncertainty.endswith("%") else -1.0
    except ValueError:
        number = -1.0
    if not 0.0 <= number < np.inf:
        raise InvalidInput(
            f'expected uncertainty of {name} to be a number, or a share such as "5%", got {uncertainty!r}'
        )
    return number / 100.0, 0.0
