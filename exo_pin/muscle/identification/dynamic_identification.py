"""Friction and damping coefficients from recorded responses, (3-28), by trust-region least squares."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import compress, count
from time import monotonic
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput, NotIdentifiable, SolverFailed
from ...core.errors.checked import checked
from ...core.progress import track
from ...core.records import Record
from ...core.results import Known
from ...core.validation import FloatArray, as_finite, as_positive, as_rising, frozen, set_fields
from ..laws.dynamic import DynamicModel, G
from ..laws.friction import Damping, LoadDependentFriction
from ..laws.static import BAR, StaticModel
from ..simulation.response import PressureInput, PressureTrace
from ..simulation.step_response import QUICK, simulate
from .known_inputs import known_inputs
from .plausibility import require_possible
from .regimes import resolution_of
from .region import collinear, confidence_interval


@dataclass(frozen=True)
class Recording(Record):
    """One recorded response of a hung mass.

    Parameters
    ----------
    time : array_like
        Shape (n,), s, rising.
    contraction : array_like
        Shape (n,), m.
    pressure : PressureInput or array_like
        Pressure over time, or shape (n,) in Pa.
    mass : float
        kg.
    start : float or None
        Contraction in m at rest before the first sample; None for the first sample, with its noise.

    Examples
    --------
    >>> from exo_pin.muscle import Recording
    >>> recording = Recording([0.0, 0.1, 0.2], [0.03, 0.031, 0.033], [2e5, 2.1e5, 2.2e5], mass=1.5)
    >>> round(1e-5 * float(recording.pressure(0.1)), 9)  # bar: samples become a pressure over time
    2.1
    """

    # What is given may be any array; what is kept is a PressureInput and arrays.
    time: FloatArray
    contraction: FloatArray
    pressure: Any
    mass: float
    start: float | None = None

    def __post_init__(self) -> None:
        t, pressure = as_rising("time", self.time), self.pressure
        set_fields(
            self,
            time=t,
            contraction=as_finite("contraction", self.contraction, (len(t),)),
            pressure=pressure if isinstance(pressure, PressureInput) else PressureTrace(t, pressure),
            mass=as_positive("mass", self.mass),
            start=None if self.start is None else float(as_finite("start", self.start, ())),
        )

    def residual(self, model: DynamicModel) -> FloatArray:
        """Return simulated less recorded contraction, shape (n,), m.

        Parameters
        ----------
        model : DynamicModel
            The law that is simulated.

        Returns
        -------
        numpy.ndarray
            Shape (n,), m; positive where the law contracts more.

        Examples
        --------
        >>> from exo_pin.muscle import PressureStep, Recording, dynamic_model, simulate
        >>> law, step, time = dynamic_model("tang-3-31"), PressureStep(2e5, 3e5, 0.1, 0.3), np.linspace(0.0, 2.0, 51)
        >>> recording = Recording(time, simulate(law, 1.5, step, time, outside="mark").contraction, step, mass=1.5)
        >>> bool(np.abs(recording.residual(law)).max() < 1e-9)  # m, of the law that made the record
        True
        """
        # A small negative first sample is noise about the stop.
        start = max(0.0, float(self.contraction[0])) if self.start is None else self.start
        response = simulate(model, self.mass, self.pressure, self.time, start, **QUICK)
        return np.asarray(response.contraction - self.contraction)


_NAMES = ("N_2", "N_1", "N_0", "D_1", "D_2")
#: Sizes of the coefficients (m, bar), so that the steps of the search are alike.
_SCALE = np.array([200.0, 100.0, 5.0, 1.0, 1.0])
#: Relative step of the finite differences. The simulated contraction is exact to about 1e-9 of its size: a step of
#: 1e-4 leaves five digits of the derivative.
_STEP = 1e-4
#: How many of the first guesses are followed up.
_STARTS = 2


@dataclass(frozen=True)
class DynamicIdentification(Record):
    """Fitted friction and damping.

    Attributes
    ----------
    model : DynamicModel
    names : tuple of str
        N_2, N_1, N_0, D_1, D_2.
    coefficients : ndarray
        Shape (5,), N/(m² bar), N/(m bar), N/bar, N s²/(m² bar), N s/(m bar).
    covariance : ndarray
        Shape (5, 5), linearised at the answer.
    sigma : float
        Standard deviation of one sample about the simulation, m.
    samples : int
    indistinct : tuple of str
        Coefficients that the recordings cannot distinguish.
    inside : float
        Share of the simulated samples that lie in the model's range.
    doubts : tuple of str
        Recordings that contradict the static law, states where the fitted friction or damping would drive, a search
        that the time limit ended.
    known : tuple of Known
        What the fit took as known, and by how many per cent an error of it changes friction and damping.

    Examples
    --------
    >>> from exo_pin.muscle import PressureStep, Recording, dynamic_model, identify_dynamic, simulate
    >>> law, step, time = dynamic_model("tang-3-31"), PressureStep(2e5, 3e5, 0.1, 0.3), np.linspace(0.0, 2.0, 41)
    >>> seen = simulate(law, 1.5, step, time, outside="mark").contraction
    >>> fit = identify_dynamic([Recording(time, seen, step, 1.5)], law.static, start=[230.0, -90.0, 6.9, -1.0, 0.8])
    >>> fit.names, fit.indistinct
    (('N_2', 'N_1', 'N_0', 'D_1', 'D_2'), ('N_2', 'N_1', 'N_0'))
    """

    model: DynamicModel
    names: tuple[str, ...]
    coefficients: FloatArray
    covariance: FloatArray
    sigma: float
    samples: int
    indistinct: tuple[str, ...]
    inside: float
    doubts: tuple[str, ...] = ()
    known: tuple[Known, ...] = ()

    @property
    def cautions(self) -> tuple[str, ...]:
        """Doubts, samples outside the range of the force law, coefficients that the recordings cannot distinguish."""
        found = list(self.doubts)
        if self.inside < 1.0:
            found.append(
                f"{100.0 * self.inside:.0f} % of the samples are inside the range of the force law; elsewhere it is "
                "extrapolated, and friction and damping take up its error."
            )
        if self.indistinct:
            found.append(f"The data cannot distinguish {', '.join(self.indistinct)}: compare responses.")
        return tuple(found)

    def intervals(self, level: float = 0.95) -> FloatArray:
        """Confidence interval of each coefficient, shape (5, 2).

        Parameters
        ----------
        level : float
            Probability that an interval covers the coefficient, between 0 and 1.

        Returns
        -------
        numpy.ndarray
            Shape (5, 2), least and greatest of each coefficient, in its own unit.

        Raises
        ------
        InvalidInput
            If ``level`` is not between 0 and 1.

        Examples
        --------
        >>> from exo_pin.muscle import DynamicIdentification, dynamic_model
        >>> names = ("N_2", "N_1", "N_0", "D_1", "D_2")
        >>> fit = DynamicIdentification(dynamic_model("tang-3-31"), names, np.zeros(5), np.eye(5), 1e-4, 1000, (), 1.0)
        >>> fit.intervals(0.95)[0].round(2)  # of a coefficient with a standard deviation of 1
        array([-1.96,  1.96])
        """
        return confidence_interval(self.coefficients, np.diag(self.covariance), level, self.samples - len(self.names))


#: Frictions of 1 to 10 N/bar, even or falling to zero at 150 mm, with dampings of 0.3 to 3 N s/(m bar).
_FIRST_GUESSES = [
    np.array([0.0, -n / 0.15 if falls else 0.0, n, 0.0, d])
    for n in (1.0, 3.0, 6.0, 10.0)
    for falls in (False, True)
    for d in (0.3, 1.0, 3.0)
]


class _TimeIsUp(Exception):
    """The time limit is reached."""


@dataclass
class _Search:
    """The sum of squares of simulated less recorded contraction over the scaled coefficients, and its best so far."""

    recordings: Sequence[Recording]
    build: Callable[[FloatArray], DynamicModel]
    end: float
    progress: bool
    best: tuple[float, FloatArray, FloatArray, FloatArray] | None = None
    _last: tuple[FloatArray, FloatArray] = field(init=False)

    def __post_init__(self) -> None:
        self._ticks = track(count(), "sets of responses simulated", self.progress)

    def residual(self, scaled: FloatArray) -> FloatArray:
        """Simulated less recorded contraction of all samples, m."""
        if monotonic() > self.end:
            raise _TimeIsUp
        next(self._ticks)
        model = self.build(scaled * _SCALE)
        self._last = scaled.copy(), np.concatenate([recording.residual(model) for recording in self.recordings])
        return self._last[1]

    def jacobian(self, scaled: FloatArray) -> FloatArray:
        """Its derivatives, by central differences: responses bend where a phase of sticking appears or goes."""
        here = self._last[1] if np.array_equal(self._last[0], scaled) else self.residual(scaled)
        steps = np.diag(_STEP * np.maximum(1.0, np.abs(scaled)))
        rises = [(self.residual(scaled + step) - self.residual(scaled - step)) / (2 * step.sum()) for step in steps]
        found = np.column_stack(rises)
        if self.best is None or here @ here < self.best[0]:
            self.best = float(here @ here), scaled.copy(), here, found
        return found

    def run(self, guesses: list[FloatArray]) -> list[str]:
        """Search from the best of the guesses; return why it ended early, none if it converged."""
        try:
            # The sum of squares has several valleys: a friction too large stops the motion early, too small late.
            for guess in sorted(guesses, key=lambda guess: float((self.residual(guess / _SCALE) ** 2).sum()))[:_STARTS]:
                # Its last derivatives are those at its answer.
                answer = scipy.optimize.least_squares(
                    self.residual, guess / _SCALE, jac=self.jacobian, method="trf", xtol=1e-7, ftol=1e-8, gtol=1e-14
                )
                if not answer.success:
                    raise SolverFailed("least_squares", float(answer.optimality), str(answer.message))
        except _TimeIsUp:
            return ["The time limit ended the search before it converged: these are its best coefficients so far."]
        finally:
            self._ticks.close()  # type: ignore[attr-defined]  # the bar of a generator
        return []


@checked
def identify_dynamic(
    recordings: Sequence[Recording],
    static: StaticModel,
    start: ArrayLike | None = None,
    name: str = "identified",
    source: str = "",
    time_limit: float = 300.0,
    progress: bool = False,
) -> DynamicIdentification:
    """Fit N_2, N_1, N_0, D_1, D_2 of (3-22) to recorded responses, all at once.

    The sum of squares of simulated less recorded contraction, (3-28), is minimised by the trust-region reflective
    method (``scipy.optimize.least_squares``, ``method="trf"``), each simulation with located stick-slip events.

    Parameters
    ----------
    recordings : sequence of Recording
        At least one; several loads and pressures determine the coefficients better.
    static : StaticModel
        The static force law, which is not changed.
    start : array_like or None
        Shape (5,), first guess in the units of the answer; None to start from the best few of a set of frictions
        and dampings.
    name, source : str
        Name and source of the parameter set.
    time_limit : float
        When the search ends at the latest, s; the best coefficients so far are the answer then, with a caution.
    progress : bool
        Whether to show a bar, of the sets of responses that were simulated.

    Returns
    -------
    DynamicIdentification

    Raises
    ------
    InvalidInput
        If there is no recording, an argument is not usable, or no muscle can have made a recording.
    NotIdentifiable
        If the responses do not depend on some coefficient, their friction or damping would have the wrong sign, or
        there are too few samples; it names the coefficients.
    SolverFailed
        If the search does not converge, or has no answer when its time is over.

    Notes
    -----
    Source: thesis (3-28).

    Examples
    --------
    >>> from exo_pin.muscle import PressureStep, Recording, dynamic_model, identify_dynamic, simulate
    >>> law, time = dynamic_model("tang-3-31"), np.linspace(0.0, 2.0, 81)
    >>> step = PressureStep(2e5, 3e5, 0.1, 0.2)
    >>> seen = simulate(law, 1.5, step, time, outside="mark").contraction
    >>> fit = identify_dynamic([Recording(time, seen, step, 1.5)], law.static, start=[230.0, -90.0, 6.9, -1.0, 0.8])
    >>> round(1e6 * fit.sigma, 1)  # μm, between the record and the law that was found
    0.0
    """
    if len(recordings) == 0 or not all(isinstance(r, Recording) for r in recordings):
        raise InvalidInput("expected recordings to be at least one Recording")
    samples = sum(len(r.time) for r in recordings)
    if samples <= len(_NAMES):
        raise NotIdentifiable(f"expected more than {len(_NAMES)} samples, got {samples}", _NAMES)

    for recording in recordings:
        require_possible(recording.contraction, recording.pressure.sample(recording.time), static.reference_length)

    def build(values: FloatArray) -> DynamicModel:
        N_2, N_1, N_0, D_1, D_2 = values.tolist()
        friction, damping = LoadDependentFriction.from_bar(N_2, N_1, N_0), Damping.from_bar(D_1, D_2)
        return DynamicModel(name=name, static=static, friction=friction, damping=damping, source=source)

    guesses = _FIRST_GUESSES if start is None else [np.array(as_finite("start", start, (len(_NAMES),)))]
    search = _Search(recordings, build, monotonic() + as_positive("time_limit", time_limit), progress)
    early = search.run(guesses)
    if search.best is None:
        raise SolverFailed("least_squares", np.inf, f"no answer within the time limit of {time_limit:g} s")
    squares, found, _, sensitivity = search.best
    norms = np.linalg.norm(sensitivity, axis=0)
    floor = 1e-9 * norms.max() if norms.max() > 0 else np.inf
    if (norms <= floor).any() or np.linalg.matrix_rank(sensitivity / np.maximum(norms, 1e-300)) < len(_NAMES):
        lost = tuple(compress(_NAMES, (norms <= floor) | collinear(sensitivity)))
        raise NotIdentifiable(f"these responses cannot determine the coefficients {', '.join(lost)}", lost)
    rounding = max(resolution_of(recording.contraction) for recording in recordings) ** 2 / 12.0
    variance = max(squares / (samples - len(_NAMES)), rounding)
    upper = np.linalg.inv(np.linalg.qr(sensitivity / norms, mode="r"))
    spread = (upper @ upper.T) / np.outer(norms, norms) * np.outer(_SCALE, _SCALE)
    values = found * _SCALE
    model = build(values)
    doubts = [*_contradictions(recordings, static), *_drives(model, recordings), *early]
    return DynamicIdentification(
        model=model,
        names=_NAMES,
        coefficients=frozen(values.copy()),
        covariance=frozen(variance * spread),
        sigma=float(np.sqrt(variance)),
        samples=samples,
        indistinct=tuple(compress(_NAMES, collinear(sensitivity))),
        inside=_share_inside(model, recordings),
        doubts=tuple(doubts),
        known=known_inputs(build, values, recordings, sensitivity / _SCALE, float(np.sqrt(variance))),
    )


def _contradictions(recordings: Sequence[Recording], static: StaticModel) -> list[str]:
    """Recordings that begin at rest where the static law pulls a multiple of the hung weight, or a fraction."""
    found = []
    for number, recording in enumerate(recordings, 1):
        t, x = float(recording.time[0]), max(0.0, float(recording.contraction[0]))
        pull, weight = float(static.unchecked_force(x, recording.pressure(t))), recording.mass * G
        if pull > 0.0 and x > 0.0 and not 0.4 < weight / pull < 2.5:
            found.append(
                f"Recording {number} begins at {1e3 * x:.1f} mm, where the force law pulls {pull:.1f} N, with a weight "
                f"of {weight:.1f} N: look at the weight (N, no kg), the pressure and the length of the muscle."
            )
    return found


def _drives(model: DynamicModel, recordings: Sequence[Recording]) -> list[str]:
    """How often the fitted friction or damping would drive; NotIdentifiable where it does so mostly."""
    states = [(r.contraction, np.gradient(r.contraction, r.time)) for r in recordings]
    x, v = (np.concatenate(parts) for parts in zip(*states, strict=True))
    moving = np.abs(v) >= 0.05 * np.abs(v).max()
    friction = float(np.mean(np.asarray(model.friction.factors(x, BAR, 0.0)[1]) < 0.0))
    damping = float(np.mean(model.damping.rate(v[moving]) < 0.0))
    found = []
    for what, share, names in (("friction", friction, _NAMES[:3]), ("damping", damping, _NAMES[3:])):
        if share > 0.5:
            raise NotIdentifiable(
                f"these responses show no {what}: the fitted one would drive the motion in {100 * share:.0f} % of the "
                f"samples, so {', '.join(names)} cannot be determined",
                names,
            )
        if share > 0.0:
            found.append(
                f"The fitted {what} would drive the motion in {100 * share:.0f} % of the samples; it counts as 0."
            )
    return found


def _share_inside(model: DynamicModel, recordings: Sequence[Recording]) -> float:
    inside = []
    for recording in recordings:
        x = recording.contraction
        velocity = np.gradient(x, recording.time)
        inside.append(model.contains(x, velocity, recording.pressure.sample(recording.time), recording.mass))
    return float(np.concatenate(inside).mean())
