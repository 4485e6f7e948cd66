"""Reactions along movements: histories, peaks and tables, and the noise of the measurement in them.

At each sample the covariance of orientation, ω and η about an axis is split into three independent parts, each of which
moves all three quantities together. The pose is moved by one standard deviation of each part about each axis of the
base frame, and the query is repeated, nine times. The sum of squares of the nine changes of F_s is its variance, exact
where F_s is linear in the change (it is linear in η), for every split and limit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ..core.errors import NoisyMovement
from ..core.errors.base import warn
from ..core.errors.checked import checked
from ..core.results import Result, drawn
from ..core.tables import NOTES, filled
from ..core.validation import FloatArray
from ..load_case import Case, Motion, Movement
from .assumptions import Assumptions
from .columns import vector_columns
from .result import Reaction
from .solve_case import solve

if TYPE_CHECKING:
    from matplotlib.figure import Figure


#: Noise above this share of the shoulder force gives a warning.
NOISY = 0.1
#: Share by which samples that are not trusted may exceed the peak without a caution.
_SAME_PEAK = 0.01
#: Number of samples at which the noise is computed, evenly spread over the movement.
_SAMPLES = 25


def force_noise(
    movement: Movement,
    force: FloatArray,
    forces_at: Callable[[Rotation, Motion | None], FloatArray],
    static: bool,
    stacked: bool,
) -> FloatArray:
    """Standard deviation of F_s from measurement noise, shape (N,), N: root of the sum over its components.

    Parameters
    ----------
    movement : Movement
        With its noise.
    force : ndarray
        F_s along it, shape (N, 3).
    forces_at : callable
        Takes M orientations and their motion, returns F_s, shape (M, 3).
    static : bool
        Whether ``motion`` is left out.
    stacked : bool
        Whether other data of the query have a value for every sample; then all samples are computed.

    Returns
    -------
    ndarray
        NaN where the noise is unknown or was not computed; zero for a movement without noise.
    """
    count = len(movement.times)
    if not movement.noise.is_relevant:
        return np.zeros(count) if np.isfinite(movement.noise.per_axis) else np.full(count, np.nan)
    held = np.flatnonzero(np.isfinite(force).all(axis=1))
    at = held if len(held) <= _SAMPLES else held[np.linspace(0, len(held) - 1, _SAMPLES).round().astype(int)]
    at = np.arange(count) if stacked else at
    out = np.full(count, np.nan)
    if len(at) == 0:
        return out
    values, vectors = np.linalg.eigh(movement.noise.covariance[at])
    parts = vectors * np.sqrt(values.clip(min=0.0))[:, None, :]
    poses, motion = movement.poses[at], movement.motion
    squares = np.zeros(len(at))
    for part in np.moveaxis(parts, -1, 0):
        for axis in np.eye(3):
            turn, omega, eta = (part[:, k, None] * axis for k in range(3))
            moved = Motion(motion.angular_velocity[at] + omega, motion.angular_acceleration[at] + eta)
            change = forces_at(Rotation.from_rotvec(turn) * poses, None if static else moved) - force[at]
            squares += (change**2).sum(axis=1)
    out[at] = np.sqrt(squares)
    return out


def end_effects_caution(
    times: FloatArray, magnitude: FloatArray, held: NDArray[np.bool_], trusted: NDArray[np.bool_]
) -> str:
    """What samples whose motion depends on the ends of the record do to the peak, in a sentence; "" if nothing.

    Parameters
    ----------
    times, magnitude : ndarray
        Shape (N,), s and N.
    held, trusted : ndarray of bool
        Shape (N,): samples that count, and samples whose motion does not depend on the ends.
    """
    doubtful, sure = held & ~trusted, held & trusted
    if not doubtful.any():
        return ""
    advice = "Record a second before and after the movement, or state that the arm rests at both ends (ends)."
    if not sure.any():
        return f"The ends of the record or a gap govern the accelerations of all held samples. {advice}"
    peak, worst = float(magnitude[sure].max()), int(np.where(doubtful, magnitude, -np.inf).argmax())
    if magnitude[worst] <= peak * (1.0 + _SAME_PEAK):
        return ""
    return (
        f"The ends of the record or a gap govern the accelerations of {int(doubtful.sum())} of {len(held)} samples. "
        f"|F_s| reaches {magnitude[worst]:.1f} N there, at {times[worst]:.3g} s, and {peak:.1f} N elsewhere. {advice}"
    )


def noise_caution(movement: Movement, force: FloatArray, noise: FloatArray) -> str:
    """That noise makes up more than :data:`NOISY` of F_s at half of the samples, in a sentence; "" if it does not."""
    known = np.isfinite(noise)
    if not known.any() or not noise[known].any():
        return ""
    size, error = float(np.median(np.linalg.norm(force[known], axis=1))), float(np.median(noise[known]))
    if error <= NOISY * size:
        return ""
    if movement.noise.method == "interpolation":
        advice = 'smooth the movement, Movement.from_samples(..., smoothing="gcv")'
    else:
        advice = "the sensor, its rate or the record do not allow better forces; static=True leaves ω and η out"
    return (
        f"Measurement noise makes up {100 * error / size:.0f} % of the shoulder force ({error:.3g} of {size:.3g} N in "
        f"the median sample): {movement.noise}; {advice}."
    )


def is_stacked(*pairs: Any) -> bool:
    """Whether an end of one of the pairs (lower, upper) has a value for every sample; others than pairs have none."""
    ends = (end for pair in pairs if isinstance(pair, list | tuple | np.ndarray) for end in pair)
    return any(np.ndim(end) >= 2 for end in ends)


@dataclass(frozen=True, eq=False)
class MovementReaction(Result):
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

    Examples
    --------
    >>> exo = ep.load("four-linear-actuators-worn")
    >>> lift = ep.Movement.from_samples(np.linspace(0, 1, 11), exo.pose(np.linspace(0, 40, 11)), smoothing=None)
    >>> answer = exo.follow(lift)
    >>> round(answer.peak / float(answer.reaction.magnitude.max()), 9), round(answer.peak_time, 3)  # s
    (1.0, 0.3)
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
    def cautions(self) -> tuple[str, ...]:
        """Doubts, and what was not checked or used; empty where there is nothing to mind."""
        own = (
            end_effects_caution(self.movement.times, self.reaction.magnitude, self.reaction.held, self.trusted),
            noise_caution(self.movement, self.reaction.shoulder_force, self.force_noise),
        )
        return (*filter(None, own), *self.reaction.cautions)

    @property
    def trusted(self) -> NDArray[np.bool_]:
        """Shape (N,): whether the motion at a sample does not depend on how the record begins and ends."""
        return ~self.movement.noise.end_effects | (self.reaction.case.motion is None)

    @property
    def peak(self) -> float:
        """Largest |F_s| of the trusted samples that can be held, N; of all that can be held if none is trusted.

        NaN if none can be held.
        """
        return float(self._peak()[0])

    @property
    def peak_time(self) -> float:
        """When it occurs, s; NaN if there is none."""
        return float(self._peak()[1])

    @property
    def largest(self) -> float:
        """Largest |F_s| of all samples that can be held, N, trusted or not; NaN if there is none."""
        return self.reaction.peak

    @property
    def counted(self) -> NDArray[np.bool_]:
        """Shape (N,): samples of peak, rms and impulse: held and trusted, or held if none is trusted."""
        held = self.reaction.held
        return held & self.trusted if (held & self.trusted).any() else held

    def _peak(self) -> tuple[float, float]:
        counted = self.counted
        if not counted.any():
            return float("nan"), float("nan")
        row = int(np.where(counted, self.reaction.magnitude, -1.0).argmax())
        return self.reaction.magnitude[row], self.movement.times[row]

    @property
    def rms(self) -> float:
        """Root of the mean square of |F_s| over :attr:`time_counted`, N; NaN if there is none."""
        time, square = self._integral(self.reaction.magnitude**2)
        return float(np.sqrt(square / time)) if time > 0.0 else float("nan")

    @property
    def impulse(self) -> float:
        """∫ |F_s| dt over :attr:`time_counted`, N s."""
        return self._integral(self.reaction.magnitude)[1]

    @property
    def time_counted(self) -> float:
        """Time between neighbouring samples that are both :attr:`counted`, s."""
        return self._integral(self.reaction.magnitude)[0]

    @property
    def fraction_not_holdable(self) -> float:
        """Fraction of samples without an answer, or in which a limit of the actuators is not met.

        ``reaction.status`` names the reason. Limits that are not known count as met: see ``reaction.verdict``. Samples
        that are not evaluated, because a spring has no data there, are not among them.
        """
        return float((~self.reaction.held & (self.reaction.status != "not_evaluated")).mean())

    def _integral(self, values: FloatArray) -> tuple[float, float]:
        """Time that counts, and the integral over it by the trapezium rule."""
        counted, dt = self.counted, np.diff(self.movement.times)
        both = counted[1:] & counted[:-1]
        known = np.where(counted, values, 0.0)
        return float(dt[both].sum()), float((0.5 * (known[1:] + known[:-1]) * dt)[both].sum())

    def summary(self) -> dict[str, float]:
        """Peak, rms, impulse and what cannot be held, with units in the keys.

        Returns
        -------
        dict of str to float

        Examples
        --------
        >>> exo = ep.load("four-cables")
        >>> still = ep.Movement.from_samples(np.linspace(0, 2, 11), exo.pose(np.full(11, 45.0)), smoothing=None)
        >>> found = exo.follow(still).summary()
        >>> round(found["impulse_N_s"] / found["duration_s"], 3), round(found["peak_N"], 3)  # at rest
        (32.438, 32.438)
        """
        return {
            "duration_s": self.movement.duration,
            "peak_N": self.peak,
            "peak_time_s": self.peak_time,
            "largest_with_end_effects_N": self.largest,
            "rms_N": self.rms,
            "impulse_N_s": self.impulse,
            "time_counted_s": self.time_counted,
            "fraction_not_holdable": self.fraction_not_holdable,
            "singular_crossings": float(len(self.reaction.crossings())),
            "force_noise_N": self.typical_force_noise,
        }

    def _largest(self) -> list[str]:
        """The largest force in a sentence."""
        if not self.reaction.held.any():
            return []
        weight = self.reaction.body_weight
        share = "" if weight is None else f", {100.0 * self.peak / weight:.1f} % of body weight"
        return [f"Largest force of the shoulder on the arm: {self.peak:.1f} N{share}, at {self.peak_time:.4g} s."]

    def columns(self) -> dict[str, Any]:
        """Time, motion, and of every sample what :meth:`.Reaction.columns` has, with the noise of the forces.

        Returns
        -------
        dict of str to ndarray
            Shape (N,) each, with units in the names.

        Examples
        --------
        >>> exo = ep.load("four-cables")
        >>> lift = ep.Movement.from_samples(np.linspace(0, 1, 6), exo.pose(np.linspace(0, 50, 6)), smoothing=None)
        >>> exo.follow(lift, static=True).columns()["flexion_deg"].round(6).tolist()
        [0.0, 10.0, 20.0, 30.0, 40.0, 50.0]
        """
        movement, reaction = self.movement, self.reaction
        return (
            {"time_s": movement.times}
            | vector_columns("omega_{}_rad_s", movement.motion.angular_velocity, "xyz")
            | vector_columns("eta_{}_rad_s2", movement.motion.angular_acceleration, "xyz")
            | reaction.columns()
            | {"F_s_noise_N": self.force_noise, "end_effects": movement.noise.end_effects}
        )

    def plot(
        self, against: str = "time", side: str = "left", limits: tuple[ArrayLike, ArrayLike] | None = None
    ) -> Figure:
        """Draw shoulder force and limb forces along the movement.

        Parameters
        ----------
        against : {"time", "flexion", "abduction", "internal_rotation"}
            Quantity of the horizontal axis.
        side : {"left", "right"}
            Side of the body that the angles are of.
        limits : (lower, upper), optional
            N, tension positive, each broadcasting to (N, n): what the actuators can give.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        UnknownName
            If ``against`` is another name.
        MissingExtra
            If matplotlib is not installed.

        Examples
        --------
        >>> exo = ep.load("four-cables")
        >>> lift = ep.Movement.from_samples(np.linspace(0, 1, 11), exo.pose(np.linspace(0, 50, 11)), smoothing=None)
        >>> figure = exo.follow(lift, static=True).plot(against="flexion")
        >>> figure.axes[-1].get_xlabel()
        'flexion, °'
        """
        return drawn("answer_plots:movement_figure", self, against, side, limits)

    def __str__(self) -> str:
        lines = [
            f"{key.replace('_', ' '):26} {'-' if np.isnan(value) else f'{value:.4g}'}"
            for key, value in self.summary().items()
        ]
        counts = {name: int((self.reaction.status == name).sum()) for name in np.unique(self.reaction.status)}
        lines.append(f"movement: {self.movement.noise}")
        return "\n".join(
            [
                self.reaction.verdict,
                *(f"Caution: {text}" for text in self.cautions if not text.startswith(NOTES)),
                *self._largest(),
                *([filled(cuff)] if (cuff := self.reaction.cuff_text()) else []),
                "",
                *lines,
                "status: " + ", ".join(f"{count} {name}" for name, count in counts.items()),
                *(text for text in self.cautions if text.startswith(NOTES)),
            ]
        )


@checked
def movement_reaction(
    device: Any, movement: Movement, case: Case, assumptions: Assumptions, progress: bool = False
) -> MovementReaction:
    """Reactions along a movement, see :meth:`exo_pin.ShoulderExo.follow`; ``case`` is at rest for a slow movement.

    Parameters
    ----------
    device : ShoulderExo
        The device.
    movement : Movement
        N samples.
    case : Case
        Of these samples.
    assumptions : Assumptions
        Split, limits, bounds and cone.
    progress : bool
        Whether to show a progress bar.

    Returns
    -------
    MovementReaction

    Examples
    --------
    >>> exo = ep.load("four-cables")
    >>> lift = ep.Movement.from_samples(np.linspace(0, 1, 6), exo.pose(np.linspace(20, 60, 6)), smoothing=None)
    >>> found = ep.reaction.movement_reaction(exo, lift, ep.Case(lift.poses), ep.Assumptions())
    >>> round(float(found.reaction.magnitude[0] - exo.reaction(exo.pose(20)).magnitude), 9)
    0.0
    """
    answer = solve(device, case, assumptions, progress=progress)

    def forces_at(poses: Rotation, motion: Motion | None) -> FloatArray:
        return solve(device, case.at(poses, motion), assumptions).shoulder_force

    stacked = case.is_stacked or is_stacked(assumptions.limits, assumptions.constraint_bounds)
    noise = force_noise(movement, answer.shoulder_force, forces_at, case.motion is None, stacked)
    if text := noise_caution(movement, answer.shoulder_force, noise):
        warn(text, NoisyMovement)
    return MovementReaction(movement, answer, noise)
