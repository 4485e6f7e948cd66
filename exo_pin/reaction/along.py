"""Reactions along movements."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput
from ..core.validation import FloatArray
from ..load_case import Load, Motion
from ..load_case.trajectories import Movement
from ..wrist_chain.equilibrium import EquilibriumModel
from .columns import ShownMovement
from .movement_noise import force_noise, is_stacked, warn_of_noise
from .query import reaction
from .result import Reaction

__all__ = ["MovementReaction", "movement_reaction"]


@dataclass(frozen=True, eq=False)
class MovementReaction(ShownMovement):
    """Reactions along a movement.

    Attributes
    ----------
    movement : Movement
        The movement, N samples.
    reaction : Reaction
        Histories of all forces, stack shape (N,).
    force_noise : ndarray
        Shape (N,), N: standard deviation of F_s (root of the sum over its components) from the noise of the measured
        movement. It is computed at a few samples, evenly spread, and NaN at the others.
    """

    movement: Movement
    reaction: Reaction
    force_noise: FloatArray

    @property
    def typical_force_noise(self) -> float:
        """Median of :attr:`force_noise`, N; NaN if the noise is unknown."""
        known = self.force_noise[np.isfinite(self.force_noise)]
        return float(np.median(known)) if known.size else float("nan")

    @property
    def peak(self) -> float:
        """Largest |F_s| of all samples with an answer, N; NaN if there is none."""
        held = self.reaction.has_answer
        return float(self.reaction.magnitude[held].max()) if held.any() else float("nan")

    @property
    def peak_time(self) -> float:
        """When it occurs, s; NaN if there is none."""
        if not self.reaction.has_answer.any():
            return float("nan")
        return float(self.movement.times[int(np.nanargmax(self.reaction.magnitude))])

    @property
    def rms(self) -> float:
        """Root of the mean square of |F_s| over the time with an answer, N; NaN if there is none."""
        held, square = self._integral(self.reaction.magnitude**2)
        return float(np.sqrt(square / held)) if held > 0.0 else float("nan")

    @property
    def impulse(self) -> float:
        """∫ |F_s| dt over the time with an answer, N s."""
        return self._integral(self.reaction.magnitude)[1]

    @property
    def time_answered(self) -> float:
        """Time between neighbouring samples that both have an answer, s."""
        return self._integral(self.reaction.magnitude)[0]

    @property
    def fraction_not_holdable(self) -> float:
        """Fraction of samples without an answer, or in which a limit of the actuators is not met.

        ``reaction.status`` names the reason. Limits that are not known count as met: see ``reaction.verdict``.
        """
        return float((~self.reaction.has_answer | self.reaction.limits.violated).mean())

    def _integral(self, values: FloatArray) -> tuple[float, float]:
        """Time with an answer, and the integral over it by the trapezium rule."""
        held, dt = self.reaction.has_answer, np.diff(self.movement.times)
        both = held[1:] & held[:-1]
        known = np.where(held, values, 0.0)
        return float(dt[both].sum()), float((0.5 * (known[1:] + known[:-1]) * dt)[both].sum())

    def summary(self) -> dict[str, float]:
        """Peak, rms, impulse and what cannot be held, with units in the keys."""
        return {
            "duration_s": self.movement.duration,
            "peak_N": self.peak,
            "peak_time_s": self.peak_time,
            "rms_N": self.rms,
            "impulse_N_s": self.impulse,
            "time_answered_s": self.time_answered,
            "fraction_not_holdable": self.fraction_not_holdable,
            "singular_crossings": float(len(self.reaction.crossings())),
            "force_noise_N": self.typical_force_noise,
        }

    def _largest(self) -> list[str]:
        """The largest force in a sentence."""
        if not self.reaction.has_answer.any():
            return []
        weight = self.reaction.body_weight
        share = "" if weight is None else f", {100.0 * self.peak / weight:.1f} % of body weight"
        return [f"Largest force of the shoulder on the arm: {self.peak:.1f} N{share}, at {self.peak_time:.3g} s."]

    def __str__(self) -> str:
        lines = [f"{key.replace('_', ' '):24} {value:.4g}" for key, value in self.summary().items()]
        counts = {name: int((self.reaction.status == name).sum()) for name in np.unique(self.reaction.status)}
        lines.append(f"movement: {self.movement.noise}")
        return "\n".join(
            [
                self.reaction.verdict,
                *self._largest(),
                "",
                *lines,
                "status: " + ", ".join(f"{count} {name}" for name, count in counts.items()),
            ]
        )


def movement_reaction(
    model: EquilibriumModel, movement: Movement, load: Load | None = None, static: bool = False, **options: Any
) -> MovementReaction:
    """Reactions along a movement; see :meth:`exo_pin.ShoulderExo.follow`."""
    if not isinstance(movement, Movement):
        raise InvalidInput(f"expected movement to be a Movement, got {type(movement).__name__}")
    motion = None if static else movement.motion
    answer = reaction(model, movement.orientations, motion, load, **options)
    stacked = is_stacked(load, *options.values())
    quiet = {**options, "progress": False}

    def forces_at(orientations: Rotation, motion: Motion | None) -> FloatArray:
        return reaction(model, orientations, motion, load, **quiet).shoulder_force

    noise = force_noise(movement, answer.shoulder_force, forces_at, static, stacked)
    warn_of_noise(movement, answer.shoulder_force, noise)
    return MovementReaction(movement, answer, noise)
