"""What a search makes small, how far poses are from all criteria and what they cost the shoulder; and one run of it.

A share of poses changes in steps and is zero over most of the space of designs, so no search climbs it. The coverage
term is its smooth stand-in: over the poses, the weighted mean of

    Σ_criteria clip((aim - margin)/scale, 0, most) + 0.3 [some criterion is not met]

with aim, scale and most of each :class:`~exo_pin.workspace.criterion.Criterion`.

One run of CMA-ES from a start drawn at random, which can be stopped and taken up again.

CMA-ES (N. Hansen, The CMA Evolution Strategy: a Tutorial, arXiv 1604.00772) is the package ``cmaes``. Its state is a
few arrays of numbers, so a run that is broken off continues where it was stored, with the same numbers to rounding.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import ExoPinError, InvalidInput
from ...core.errors.base import echo
from ...core.files.toml_tables import TomlTable
from ...core.optional_packages import optional
from ...core.records import OneProcess, Record
from ...core.validation import FloatArray
from ...design.io.mechanism_files import mechanism_table
from ...load_case.pose_stacks import pose_matrices
from ...reaction.splits.pose_stack import limb_lengths
from ..criteria import Criteria
from ..criterion import CRITERIA
from ..device_values import mass_of, values_of
from .search_poses import Centre, ContactObjective, DesignVariables, SearchPoses, described
from .starting_designs import fitted_strokes, stroke_windows, window_margin

#: Objectives, and whether the largest value is the best.
OBJECTIVES = {
    "index": True,
    "mean_shoulder_force": False,
    "peak_shoulder_force": False,
    "median_moment_margin": True,
    "worst_margin": True,
    "weakest_rate": True,
    "contact_force": False,
    "device_mass": False,
}
#: Of criteria that are named, one of these makes an objective known.
_KNOWN_BY = {
    "mean_shoulder_force": ("forces", "shoulder_force"),
    "peak_shoulder_force": ("forces", "shoulder_force"),
    "median_moment_margin": ("forces",),
}
#: Merit of a design that cannot be built or evaluated.
WORST = 100.0
#: A force that counts as one in the merit, N, and units of objectives that count as one: N, N m, and m/rad (1 mm/°).
_FORCE = 100.0
_UNITS = dict.fromkeys(("mean_shoulder_force", "peak_shoulder_force", "contact_force"), _FORCE)
_UNITS |= {"median_moment_margin": 10.0, "weakest_rate": 0.18 / np.pi}
#: Share of the poses inside whose rates of the drives may be below the objective.
_WEAKEST = 0.01


class Evaluation(NamedTuple):
    """A design on the poses of a search.

    Attributes
    ----------
    merit : float
        What the search makes small.
    objectives : dict of str to float
        By name; forces in N over the poses inside, NaN if there are none. The worst margin is the least one of any
        criterion in these poses, as a share of what counts as one in the merit. The weakest rate, m/rad or rad/rad, is
        what 99 % of them exceed, where the criterion "accuracy" is asked. The contact force is that of
        :class:`.ContactObjective`, NaN without one; the device's mass, kg, is the estimate of
        :mod:`exo_pin.design.holding_frame`.
    """

    merit: float
    objectives: dict[str, float]


class Merit(Record):
    """Merit of designs.

    Parameters
    ----------
    variables : DesignVariables
        What a point of the unit cube means.
    poses : SearchPoses
        Where it is judged.
    criteria : Criteria
        What it must meet. Criteria of a grid ("connected") are not part of a search, only of the check afterwards.
    fit_strokes : bool
        Whether the actuators get the strokes that fit (:mod:`.starting_designs`).
    contact : ContactObjective, optional
        Needed for the objective "contact_force".
    """

    def __init__(
        self,
        variables: DesignVariables,
        poses: SearchPoses,
        criteria: Criteria,
        fit_strokes: bool = True,
        contact: ContactObjective | None = None,
    ) -> None:
        self.variables, self.poses, self.criteria, self.contact = variables, poses, criteria, contact
        record = variables.device.accelerate("workspace")
        self.fit_strokes = fit_strokes and record is not None
        self._matrices = pose_matrices(poses.poses)[1]
        self._offsets = poses.offsets
        self.names = criteria.off_grid().chosen(self._built(variables.device), False)[0]
        # Where no pull depends on the stroke, and each limb counts, windows do without a record of each design.
        muscles = [limb.actuator.force_law for limb in record.limbs if limb.actuator] if record is not None else []
        self._by_record = any(muscles) or criteria.stroke_rule != "each"

    def _built(self, mechanism: Any, is_given: ArrayLike = False) -> Any:
        """The design with strokes that fit the poses of the search."""
        if not self.fit_strokes:
            return mechanism
        lengths = self.lengths(mechanism)
        return fitted_strokes(mechanism, lengths, self.poses.weights, is_given=is_given)

    def lengths(self, mechanism: Any) -> FloatArray:
        """l_i in the poses of the search, shape (N, n), m."""
        return limb_lengths(mechanism, self._matrices, self._offsets.spread(len(self._matrices)))

    def generation(self, points: list[FloatArray], weights: dict[str, float]) -> list[float]:
        """Merits of several points.

        With the contact force among the objectives all get its surrogate and the best third the exact force; what the
        surrogate misses in these on average is added to the others.
        """
        is_exact = self.contact is None or not weights.get("contact_force")
        values = [self.evaluate(point, weights, is_exact).merit for point in points]
        if is_exact:
            return values
        best = np.argsort(values)[: -(-len(points) // 3)]
        exact = {int(k): self.evaluate(points[k], weights).merit for k in best}
        missed = float(np.mean([exact[k] - values[k] for k in exact]))
        return [exact.get(k, value + missed) for k, value in enumerate(values)]

    def evaluate(self, point: FloatArray, weights: dict[str, float], is_exact: bool = True) -> Evaluation:
        """Merit of a point of the unit cube, shape (k,).

        Parameters
        ----------
        point : ndarray
            Shape (k,).
        weights : dict of str to float
            Of the objectives beside the coverage, in the merit.
        is_exact : bool
            Whether the contact force is computed exactly, and not by its surrogate.
        """
        try:
            mechanism = self.variables.design(self.variables.values(point))
            fit = self.fit_strokes and "stroke" in self.names
            if fit and self._by_record:
                mechanism, fit = self._built(mechanism, self.variables.sets_stroke), False
            names = tuple(name for name in self.names if not (fit and name == "stroke"))
            values = values_of(mechanism, self._matrices, self.criteria, names, offsets=self._offsets)
            contact = np.nan
            if self.contact is not None:
                contact = (self.contact.exact if is_exact else self.contact.surrogate)(mechanism)
        except (ExoPinError, ValueError):
            return Evaluation(WORST, dict.fromkeys(OBJECTIVES, np.nan))
        if fit:
            windows = stroke_windows(mechanism, values.lengths, self.poses.weights, self.variables.sets_stroke)
            values.margins["stroke"] = window_margin(windows, values.lengths)
        others = {"contact_force": contact, "device_mass": mass_of(mechanism)}
        return judged(values.margins, values.shoulder_size, self.poses.weights, self.criteria, others, weights)


def judged(
    margins: Mapping[str, FloatArray],
    force: FloatArray,
    share: FloatArray,
    criteria: Criteria,
    others: dict[str, float],
    weights: dict[str, float],
) -> Evaluation:
    """Merit and objectives of N poses.

    Parameters
    ----------
    margins : mapping of str to ndarray
        By criterion, shape (N,).
    force : ndarray
        |F_s|, shape (N,), N; NaN where it is not known.
    share : ndarray
        Weights of the poses, shape (N,), of sum 1.
    criteria : Criteria
        Whose limits the margins belong to.
    others : dict of str to float
        Objectives that are known.
    weights : dict of str to float
        Of the objectives beside the coverage, in the merit.
    """
    broken, failed, worst = np.zeros(len(share)), np.zeros(len(share), dtype=bool), np.full(len(share), np.inf)
    for name, margin in margins.items():
        item = CRITERIA[name]
        scale = item.scale(criteria) if callable(item.scale) else item.scale
        broken += np.clip(np.nan_to_num((item.aim - margin) / scale, nan=item.most), 0.0, item.most)
        failed |= ~(margin >= 0.0)
        if np.isfinite(scale):
            worst = np.minimum(worst, margin / scale)
    inside = ~failed
    known = inside & np.isfinite(force)
    moment = margins.get("forces", np.full(len(share), np.nan))
    rate = margins.get("accuracy", np.full(len(share), np.nan)) + (criteria.least_rate or 0.0)
    objectives = {
        "index": float(share[inside].sum()),
        "mean_shoulder_force": _mean(force[known], share[known]),
        "peak_shoulder_force": float(force[known].max()) if known.any() else np.nan,
        "median_moment_margin": float(np.median(moment[inside])) if inside.any() else np.nan,
        "worst_margin": float(worst[inside].min()) if inside.any() else np.nan,
        "weakest_rate": float(np.quantile(rate[inside], _WEAKEST)) if inside.any() else np.nan,
        **others,
    }
    carried = float((share * np.minimum(np.nan_to_num(force, nan=_FORCE), _FORCE)).sum())
    merit = float((share * (broken + 0.3 * failed)).sum())
    return Evaluation(merit + _cost(objectives, carried, weights), objectives)


def _cost(objectives: dict[str, float], carried: float, weights: dict[str, float]) -> float:
    """What the objectives add to the merit; ``carried`` is the mean of |F_s| over all poses, N, each at most 100 N."""
    total, known = 0.0, {**objectives, "mean_shoulder_force": carried}
    for name, weight in weights.items():
        # Where it is not known it counts as nothing gained, or as a force that nobody bears.
        value = np.nan_to_num(known[name], nan=0.0 if OBJECTIVES[name] else 20 * _FORCE)
        total += weight * ((-value if OBJECTIVES[name] else value) / _UNITS.get(name, 1.0))
    return float(total)


def _mean(values: FloatArray, weights: FloatArray) -> float:
    return float((values * weights).sum() / weights.sum()) if weights.sum() > 0.0 else float("nan")


def study_description(
    merit: Merit, objectives: tuple[str, ...], seed: int, run_length: int, refine: bool, centres: tuple[Centre, ...]
) -> dict[str, Any]:
    """What a study searches, to tell it from others."""
    space = merit.variables
    # Its title and sources say where numbers are from; the search does not depend on them.
    untold = space.device.replace(title="", sources={})
    record = untold.accelerate("workspace")
    design = untold.hash if record is None else mechanism_table(record)
    text = {
        "objectives": objectives,
        "fit_strokes": merit.fit_strokes,
        "data of the design": _digest(design),
        "data of the poses": _digest([merit.poses.poses.as_matrix().tolist(), merit.poses.weights.tolist()]),
        "design": space.device.name,
        "limbs": space.device.limb_count,
        "variables": dict(zip(space.names, space.bounds.tolist(), strict=True)),
        "poses": len(merit.poses.weights),
        "criteria": repr(merit.criteria),
        "seed": seed,
        "run_length": run_length,
        "start": space.of_design() if refine else "random",
    }
    if space.by_geometry:
        text["cuff"] = "by geometry"
    if centres != (None,):
        text["centre_offset"] = [described(centre) for centre in centres]
    return text if merit.contact is None else {**text, "contact": merit.contact.description()}


def _digest(data: Any) -> str:
    """A short text that other data do not have."""
    return hashlib.sha256(repr(_rounded(data)).encode()).hexdigest()[:12]


def _rounded(data: Any) -> Any:
    """The same to nine decimals, which computers agree on."""
    if isinstance(data, Mapping):
        return {key: _rounded(value) for key, value in data.items()}
    if isinstance(data, list | tuple | np.ndarray):
        return [_rounded(value) for value in data]
    # + 0.0, so that no -0.0 differs from 0.0.
    return round(float(data), 9) + 0.0 if isinstance(data, float) else data


#: First step of a run, as a share of the range of every variable: from a random start, and from a design.
_STEP, _FINE_STEP = 0.3, 0.02
#: Designs of a generation.
GENERATION = 24
#: What changes during a search: name in a stored state, attribute of the package's record of itself, largest size.
#: cmaes itself ends a search whose steps exceed 1e4; paths have lengths about the root of the number of variables.
_STATE = {
    "mean": ("_mean", 1e6),
    "step": ("_sigma", 1e4),
    "covariance": ("_c_1d", 1e12),
    "step_path": ("_p_sigma", 1e3),
    "covariance_path": ("_pc", 1e12),
    "recent_values": ("_funhist_values", 1e12),
}


class Descent(OneProcess):
    """A run of CMA-ES.

    Parameters
    ----------
    merit : Merit
        What is made small.
    weights : dict of str to float
        Of the objectives in the merit.
    seed : sequence of int
        Of the run's random numbers.
    state : dict, optional
        Of a run that was broken off: what :meth:`stored` gave.
    start : ndarray, optional
        Point of the unit cube, shape (k,), where to start; drawn at random if left out.

    Raises
    ------
    MissingExtra
        If cmaes is not installed.
    InvalidInput
        If ``state`` is none of a search in so many variables.
    """

    _instead = "send what stored() gives, and take the run up from there"

    def __init__(
        self,
        merit: Merit,
        weights: dict[str, float],
        seed: tuple[int, ...],
        state: dict[str, Any] | None = None,
        start: FloatArray | None = None,
    ) -> None:
        self._merit, self._weights, self._seed = merit, weights, seed
        cma = optional("optimise", "cmaes")
        count = merit.variables.count
        mean = np.random.default_rng(seed).uniform(0.0, 1.0, count) if start is None else np.array(start)
        step = _STEP if start is None else _FINE_STEP
        # Its random numbers start afresh with every generation.
        self._search = cma.CMA(mean=mean, sigma=step, population_size=GENERATION)
        # cmaes does not fill what it has not reached yet, and does not read it.
        self._search._funhist_values.fill(0.0)
        self.best, self.value, self.done = mean, np.inf, 0
        if state is not None:
            self._take_up(TomlTable(state, None, "state"))

    def run(self, budget: int, go_on: Callable[[], bool] | None = None) -> bool:
        """Search until ``budget`` designs have been evaluated in all, or the search has come to rest.

        ``go_on`` is called after every generation; False from it ends the search and is what this method returns.
        """
        while self.done < budget and not self._search.should_stop():
            # The stored state has no random numbers: they start afresh with every generation, by its number.
            self._search.reseed_rng(int(np.random.default_rng((*self._seed, self.done)).integers(2**31)))
            points = [self._search.ask() for _ in range(self._search.population_size)]
            values = self._merit.generation(points, self._weights)
            self._search.tell(list(zip(points, values, strict=True)))
            self.done += len(points)
            least = int(np.argmin(values))
            if values[least] < self.value:
                # CMA-ES knows no bounds: the point of the unit cube that means the same design.
                space = self._merit.variables
                self.best, self.value = np.clip(space.point(space.values(points[least])), 0.0, 1.0), values[least]
            if go_on is not None and not go_on():
                return False
        return True

    def stored(self) -> dict[str, Any]:
        """The state as numbers and lists of numbers."""
        now = self._search.__getstate__()
        numbers = {name: np.asarray(now[attribute]).tolist() for name, (attribute, _) in _STATE.items()}
        return {**numbers, "best": self.best.tolist(), "value": float(self.value), "evaluations": self.done}

    def _take_up(self, state: TomlTable) -> None:
        """Go on from a stored state."""
        now = self._search.__getstate__()
        for name, (attribute, largest) in _STATE.items():
            now[attribute] = state.quantity("number", name, np.shape(now[attribute]))
            if np.abs(now[attribute]).max() > largest:
                raise state.error(f"expected numbers of at most {largest:g} in size", name)
        self.best, self.value = as_point(state, "best", len(self.best)), state.quantity("number", "value")
        self.done = state.integer("evaluations")
        state.finish()
        if self.done < GENERATION or self.done % GENERATION:
            raise state.error(f"expected a multiple of {GENERATION}, got {echo(self.done)}", "evaluations")
        self._search.__setstate__({**now, "_g": self.done // GENERATION})
        if now["_sigma"] <= 0.0 or np.diag(self._search._C).min() <= 0.0:
            raise InvalidInput("state: expected a step and variances above zero")


def as_point(table: TomlTable, key: str, count: int) -> FloatArray:
    """A point of the unit cube in a stored record, shape (count,)."""
    point: FloatArray = table.quantity("number", key, (count,))
    if point.min() < 0.0 or point.max() > 1.0:
        raise table.error("expected numbers from 0 to 1", key)
    return point


def require_known(wanted: tuple[str, ...], criteria: Criteria) -> None:
    """Refuse objectives that the named criteria leave unknown.

    Raises
    ------
    InvalidInput
        If no criterion is among them that computes the forces of an objective.
    """
    for name in wanted:
        needed = _KNOWN_BY.get(name, ())
        if criteria.names is not None and needed and not set(needed) & set(criteria.names):
            raise InvalidInput(
                f"the objective {name!r} needs {' or '.join(map(repr, needed))} among the criteria, got "
                f"{', '.join(criteria.names) or 'none'}"
            )
