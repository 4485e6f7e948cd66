"""Lengths and forces that the actuators of a design can take, as arrays over poses.

Assumption: the static law of a muscle is scaled to another nominal length by equal strain
(:func:`exo_pin.muscle.muscle_model`).
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ...core.validation import FloatArray, frozen
from ...design import Actuator, Mechanism, Stroke
from ...muscle import Muscle, muscle_model

#: Share of the largest tension by which a limit may be passed: rounding, and forces that are zero in theory.
_ROUNDING = 1e-9
#: A length, m, or angle, rad, that passes an end of its stroke by less is at the end, which belongs to the stroke.
AT_END = 1e-9
#: Lengths of a stroke at which the limits of a law are looked for.
_LENGTHS = 1025


class DesignLimits(NamedTuple):
    """Force limits of the actuators of a design in N poses; tension is positive.

    Attributes
    ----------
    lower, upper : ndarray
        Least and greatest f_i, shape (N, n), N; NaN where not known.
    ceiling : ndarray
        A force above which f_i is impossible also where ``upper`` is not known, shape (N, n), N; infinite without one.
    """

    lower: FloatArray
    upper: FloatArray
    ceiling: FloatArray


@lru_cache(maxsize=64)
def length_limits(mechanism: Mechanism) -> tuple[FloatArray, FloatArray]:
    """Shortest and longest l_i, shapes (n,), m; NaN where the stroke or the end fitting is not known."""
    low, high = np.array([limb.length_range for limb in mechanism.limbs]).T
    return frozen(low.copy()), frozen(high.copy())


@lru_cache(maxsize=64)
def closed_length_limits(mechanism: Mechanism) -> tuple[FloatArray, FloatArray]:
    """The same as far as a length may be with rounding: both ends belong to the stroke."""
    low, high = length_limits(mechanism)
    return frozen(low - AT_END), frozen(high + AT_END)


@lru_cache(maxsize=64)
def _constant_limits(mechanism: Mechanism) -> tuple[tuple[FloatArray, ...], tuple[tuple[Muscle, list[int]], ...]]:
    """Limits of the forces that hold at any length, shape (n,) each, and the muscles besides, with their limbs."""
    lower, upper = np.array([limb.effort_range for limb in mechanism.limbs]).T.copy()
    ceiling = np.where(np.isnan(upper), np.inf, upper)
    alike: dict[tuple[Actuator, Stroke], list[int]] = {}
    for i, limb in enumerate(mechanism.limbs):
        if limb.actuator is not None and limb.actuator.force_law is not None and limb.stroke is not None:
            alike.setdefault((limb.actuator, limb.stroke), []).append(i)
    muscles = list[tuple[Muscle, list[int]]]()
    for (actuator, stroke), limbs in alike.items():
        model = muscle_model(actuator.force_law, stroke.nominal_length)  # type: ignore[arg-type]
        muscle = Muscle(model=model, end_fitting=stroke.end_fitting, supply_pressure=actuator.supply_pressure)
        muscles.append((muscle, limbs))
        line = float(muscle.model.validity.capability_line(np.array(muscle.supply)))
        ceiling[limbs] = np.minimum(ceiling[limbs], line)
    return (frozen(lower), frozen(upper), frozen(ceiling)), tuple(muscles)


class PullLaws(NamedTuple):
    """Greatest tensions that depend on the length, one entry a limb, for compiled code.

    Attributes
    ----------
    powers : ndarray
        Coefficients of the tension in powers of contraction, from the constant on, shape (n, k), N m^-i.
    uncontracted : ndarray
        Length of the limb without contraction, shape (n,), m.
    least, most : ndarray
        Contractions between which the law was identified, shape (n,), m; none where the limb has no law.
    ceiling : ndarray
        The tension is no larger than this, shape (n,), N.
    """

    powers: FloatArray
    uncontracted: FloatArray
    least: FloatArray
    most: FloatArray
    ceiling: FloatArray


def have_powers(mechanism: Mechanism) -> bool:
    """Whether the laws of all muscles of a design are polynomials in contraction."""
    with suppress(InvalidInput):
        for muscle, _ in _constant_limits(mechanism)[1]:
            muscle.model.contraction_powers(muscle.supply)
        return True
    return False


def pull_laws(mechanism: Mechanism) -> PullLaws:
    """Laws of the muscles of a design, which have powers, what :func:`design_limits` evaluates."""
    (_, _, ceiling), muscles = _constant_limits(mechanism)
    n = mechanism.limb_count
    powers, ends = np.zeros((n, 1)), np.repeat([[0.0], [np.inf], [-np.inf]], n, axis=1)
    for muscle, limbs in muscles:
        if muscle.end_fitting is not None:
            own, size = muscle.model.contraction_powers(muscle.supply), muscle.model.length
            powers = np.pad(powers, ((0, 0), (0, max(0, len(own) - powers.shape[1]))))
            powers[limbs, : len(own)] = own
            strains = muscle.model.validity.strains_at(muscle.supply)
            ends[:, limbs] = np.reshape([size + muscle.end_fitting, *(size * each for each in strains)], (3, 1))
    return PullLaws(powers, ends[0], ends[1], ends[2], np.maximum(ceiling, 0.0))


def depend_on_length(mechanism: Mechanism) -> bool:
    """Whether the force limits of some actuator depend on its length."""
    return bool(_constant_limits(mechanism)[1])


def design_limits(mechanism: Mechanism, lengths: FloatArray) -> DesignLimits:
    """Limits of the forces at limb lengths, shape (N, n), m."""
    constant, muscles = _constant_limits(mechanism)
    lower, upper, ceiling = (part + np.zeros(lengths.shape) for part in constant)
    for muscle, limbs in muscles:
        if muscle.end_fitting is not None:
            # The lower of the two where both are known; a law that was not identified there leaves it open.
            known = np.where(np.isnan(upper[:, limbs]), np.inf, upper[:, limbs])
            upper[:, limbs] = np.minimum(_greatest_pull(muscle, lengths[:, limbs]), known)
    return DesignLimits(lower, upper, ceiling)


def stroke_limits(mechanism: Mechanism) -> tuple[FloatArray, FloatArray]:
    """Least and greatest f_i at any length of the strokes, shape (n,) each, N; infinite where not known."""
    low, high = length_limits(mechanism)
    ended = np.isfinite(low) & np.isfinite(high)
    own = design_limits(mechanism, np.linspace(np.where(ended, low, np.nan), np.where(ended, high, np.nan), _LENGTHS))
    # fmin and fmax leave out NaN, which is where a law was not identified.
    least, greatest = np.fmin.reduce(own.lower, axis=0), np.fmax.reduce(own.upper, axis=0)
    return np.where(np.isnan(least), -np.inf, least), np.where(np.isnan(greatest), own.ceiling[0], greatest)


def limits_motion(mechanism: Mechanism) -> bool:
    """Whether speed or power of some actuator is limited."""
    return any(limb.speed_limit is not None or limb.power_limit is not None for limb in mechanism.limbs)


@dataclass(frozen=True, eq=False)
class LimbLimits:
    """Limits of the lengths and forces of the limbs in the N poses of a query.

    Attributes
    ----------
    lower, upper : ndarray
        Least and greatest f_i, shape (N, n), N; infinite where there is no limit, and where none is known.
    open_below, open_above : ndarray of bool
        Shape (N, n): whether the least, the greatest force is not known.
    length_error : ndarray
        Shape (N, n), m: negative where the limb is shorter than its stroke allows, positive where longer, zero within,
        NaN where the stroke is not known. Infinite where a given actuator cannot take the length.
    asked : bool
        Whether the query asks for limits at all; False for ``limits="none"``.
    excess_speed : ndarray or None
        Shape (N, n), m/s: by how much a limb would have to be faster than its actuator can; None without a motion.
    passive_error : ndarray or None
        Shape (N,), m or rad: by how much joints without drive are beyond their limits; None for wrists.
    """

    lower: FloatArray
    upper: FloatArray
    open_below: NDArray[np.bool_]
    open_above: NDArray[np.bool_]
    length_error: FloatArray
    asked: bool = True
    excess_speed: FloatArray | None = None
    passive_error: FloatArray | None = None

    @cached_property
    def slow_enough(self) -> NDArray[np.bool_]:
        """Whether no limb would have to be faster than it can, as far as that is known, shape (N,)."""
        if self.excess_speed is None:
            return np.ones(len(self.lower), dtype=bool)
        return np.asarray((self.excess_speed == 0.0).all(axis=1))

    @cached_property
    def reachable(self) -> NDArray[np.bool_]:
        """Whether every limb is within its stroke as far as that is known, shape (N,)."""
        # NaN, of a stroke that is not known, is neither.
        inside = ~((self.length_error < 0.0) | (self.length_error > 0.0)).any(axis=1)
        return np.asarray(inside if self.passive_error is None else inside & (self.passive_error == 0.0))

    @cached_property
    def bound_forces(self) -> bool:
        """Whether some force has a limit in some pose."""
        return bool(np.isfinite(self.lower).any() or np.isfinite(self.upper).any())

    @cached_property
    def one_signed(self) -> bool:
        """Whether the limits fix the sign of every f_i, so that |g_i| <= |f_i| is convex."""
        return bool((self.lower >= 0.0).all() or (self.upper <= 0.0).all())

    @classmethod
    def none(cls, shape: tuple[int, ...]) -> LimbLimits:
        """No limits for lengths of shape (N, n)."""
        free, unknown = np.full(shape, np.inf), np.ones(shape, dtype=bool)
        return cls(-free, free, unknown, unknown, np.full(shape, np.nan), asked=False)

    @classmethod
    def of_design(cls, mechanism: Mechanism, lengths: FloatArray) -> LimbLimits:
        """What the design's actuators can do at limb lengths, shape (N, n), m."""
        own = design_limits(mechanism, lengths)
        below, above = np.isnan(own.lower), np.isnan(own.upper)
        low, high = closed_length_limits(mechanism)
        # NaN where an end is not known.
        error = lengths - np.minimum(np.maximum(lengths, low), high)
        # At a length at which it cannot give its least tension an actuator cannot be.
        error[own.lower > own.upper] = np.inf
        lower, upper = np.where(below, -np.inf, own.lower), np.where(above, own.ceiling, own.upper)
        return cls(np.minimum(lower, upper), upper, below, above, error)

    def narrowed(self, lower: FloatArray, upper: FloatArray) -> LimbLimits:
        """The same within further limits of f, N, shape (N, n); where these are finite the limit is known."""
        low, high = np.maximum(self.lower, lower), np.minimum(self.upper, upper)
        # Limits that exclude each other: the actuator cannot be here.
        error = np.where(low > high, np.inf, self.length_error)
        return replace(
            self,
            lower=np.minimum(low, high),
            upper=high,
            length_error=error,
            open_below=self.open_below & ~np.isfinite(lower),
            open_above=self.open_above & ~np.isfinite(upper),
        )

    def allowing(self, which: NDArray[np.bool_], efforts: FloatArray, size: float) -> LimbLimits:
        """The same with the efforts themselves as limits of some entries, where these together are at most ``size``.

        Parameters
        ----------
        which : ndarray of bool
            The entries, shape (n,).
        efforts : ndarray
            Shape (N, n).
        size : float
            Of the vector of these efforts.
        """
        small = (np.linalg.norm(efforts[:, which], axis=1) <= size)[:, None] & which
        lower, upper = (np.where(small, efforts, end) for end in (self.lower, self.upper))
        return replace(self, lower=lower, upper=upper)

    def in_motion(self, mechanism: Mechanism, shortening: FloatArray) -> LimbLimits:
        """The same within the actuators' speed and power.

        Power P of tension times shortening rate bounds the tension of a limb that shortens and the push of one that
        lengthens by P over the rate. A motion that the actuator brakes takes no power.

        Parameters
        ----------
        mechanism : Mechanism
            The design.
        shortening : ndarray
            -dl_i/dt, shape (N, n), m/s; NaN without an answer.
        """
        given = [(limb.speed_limit, limb.power_limit) for limb in mechanism.limbs]
        speed, power = np.array(given, dtype=np.float64).T
        rate = np.nan_to_num(shortening)
        with np.errstate(divide="ignore", invalid="ignore"):
            force = np.nan_to_num(power / np.abs(rate), nan=np.inf)
        limited = self.narrowed(np.where(rate < 0.0, -force, -np.inf), np.where(rate > 0.0, force, np.inf))
        excess = np.maximum(np.abs(rate) - speed, 0.0)
        # A limb within its power is not known to be within its greatest force.
        return replace(
            limited,
            open_below=self.open_below,
            open_above=self.open_above,
            excess_speed=np.where(excess > _ROUNDING * speed, excess, 0.0),
        )

    def rows(self, rows: NDArray[np.intp]) -> LimbLimits:
        """Limits of some poses."""
        forces = (self.lower[rows], self.upper[rows], self.open_below[rows], self.open_above[rows])
        speed = None if self.excess_speed is None else self.excess_speed[rows]
        passive = None if self.passive_error is None else self.passive_error[rows]
        return LimbLimits(*forces, self.length_error[rows], self.asked, speed, passive)

    def force_error(self, tensions: FloatArray) -> FloatArray:
        """How far tensions, shape (N, n), N, are beyond the limits, shape (N, n), N.

        Positive where a tension is above the greatest pull, negative where the limb would have to push harder than it
        can, zero within, NaN where it depends on a limit that is not known.
        """
        slack = _ROUNDING * np.abs(tensions).max(axis=1)[:, None]
        pushed = np.minimum(tensions - self.lower + slack, 0.0)
        pulled = np.maximum(tensions - self.upper - slack, 0.0)
        error = np.where(pushed < 0.0, pushed, pulled)
        unknown = (self.open_below & (tensions < -slack)) | (self.open_above & (tensions > slack))
        return np.where(unknown & (error == 0.0), np.nan, error)

    def met(self, tensions: FloatArray, rows: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Whether tensions, shape (k, n), N, are within the limits of some poses, shape (k,); rounding is allowed."""
        slack = _ROUNDING * np.abs(tensions).max(axis=1)[:, None]
        inside = (tensions >= self.lower[rows] - slack) & (tensions <= self.upper[rows] + slack)
        return np.asarray(inside.all(axis=1))


def _greatest_pull(muscle: Muscle, length: FloatArray) -> FloatArray:
    """Greatest tension at lengths, N; NaN where the law was not identified or the limb is shorter than its fitting."""
    assert muscle.end_fitting is not None
    pull, longer = np.full(length.shape, np.nan), length > muscle.end_fitting
    if longer.any():
        pull[longer] = np.ma.filled(muscle.force_limits(length[longer], outside="mark")[1], np.nan)
    return pull
