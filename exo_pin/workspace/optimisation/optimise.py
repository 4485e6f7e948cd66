"""Search for designs: ``optimise``."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput, MissingData
from ...core.errors.checked import checked
from ...core.progress import track
from ...core.validation import FloatArray, as_choice, require_method
from ...design.holding_frame import with_cuff_by_geometry
from ...load_case.pose_stacks import require_massless
from ..criteria import Criteria
from .merit import (
    GENERATION,
    OBJECTIVES,
    WORST,
    Descent,
    Merit,
    require_known,
    study_description,
)
from .optimised import Candidate, Optimised, on_full_grid, reported
from .recheck import recheck
from .search_poses import Centre, ContactObjective, DesignVariables, SearchPoses, as_centres, lifting_poses
from .starting_designs import with_strokes
from .stored_study import SearchRun, StoredStudy

if TYPE_CHECKING:
    from ...exo.shoulder_exo import ShoulderExo
    from ...person import Person

#: Designs that one run evaluates: of a search in 24 variables few runs gain more after these.
_RUN = 12_000
#: Seconds between two looks at the runs of other workers.
_WAIT = 0.5
#: Rate of the drives, m/rad, that the objective "weakest_rate" demands of every pose by itself: none.
_ANY_RATE = 1e-9


@checked
def optimise(
    exo: ShoulderExo,
    variables: Mapping[str, Any],
    poses: Rotation | SearchPoses | None = None,
    objectives: str | Iterable[str] = ("index",),
    constraints: Criteria | Iterable[str] | None = None,
    *,
    person: Person | None = None,
    centre_offset: Centre | ArrayLike | Sequence[Centre] = None,
    seed: int = 0,
    budget: int = 60_000,
    storage: str | PathLike[str] | None = None,
    name: str = "study",
    fit_strokes: bool = True,
    refine: bool = False,
    run_length: int = _RUN,
    cuff_by_geometry: bool = False,
    step: float = 4.0,
    finer_step: float = 2.0,
    progress: bool = False,
) -> Optimised:
    """Search for the design that meets all criteria over the most poses, with low shoulder force.

    Runs of CMA-ES from starts drawn at random; a run is a row of the stored study. Call it again with the same storage
    and name to go on, from any number of processes at once: they share the budget.

    Parameters
    ----------
    exo : ShoulderExo
        The device to start from, of any kind: of a wrist number of limbs, families of actuators and their forces, arm.
    variables : mapping of str to (float, float)
        Bounds by name, as sweeps name parameters; see :class:`.DesignVariables` and, of wrists, :func:`.free_joints`.
    poses : Rotation or SearchPoses, optional
        Where designs are judged during the search; :func:`.lifting_poses` of the design's side if left out.
    objectives : str or iterable of str
        Of :data:`exo_pin.workspace.optimisation.OBJECTIVES`. "weakest_rate" is the rate of the drives that 99 % of the
        poses inside exceed, m/rad or rad/rad (``least_rate`` of the constraints demands one in every pose). With
        several, the runs weigh them differently, and the result has their Pareto front.
    constraints : Criteria or iterable of str, optional
        What a pose must meet; all that the design's data allow if left out.
    person : Person, optional
        Who wears the designs: their arm is held instead of the design's own, and the objective "contact_force" is the
        force in their shoulder (:class:`.search_poses.ContactObjective`; needs the extra ``person``).
    centre_offset : CentreOffset, CentrePath, array_like or sequence of CentreOffset, CentrePath and None, optional
        Where the device's centre lies, seen from the shoulder's, as in :meth:`exo_pin.ShoulderExo.workspace`. Of
        several, such as ``(None, person.centre_path())``, every pose counts once with each.
    seed : int
        Of all random numbers: run k starts from (seed, k), whoever makes it.
    budget : int
        Most designs to evaluate in all, by whole generations of 24; one generation at least.
    storage : str or path-like, optional
        Path of a SQLite file, or URL of a database; in memory if left out. What it holds is data, and checked.
    name : str
        Of the study in the storage.
    fit_strokes : bool
        Whether each limb of a wrist gets the stroke of its family that fits best, in place of the design's own.
    refine : bool
        Whether every run starts from the design itself, within its bounds, with small steps, and not at random.
    run_length : int
        Designs of one run.
    cuff_by_geometry : bool
        Whether every design moves the cuff that its own joints ask for, of bars, sleeve and joints
        (:mod:`exo_pin.design.holding_frame`), in place of what ``exo`` moves besides the arm.
    step, finer_step : float
        Of the full grid and of the second grid of the check, degrees. A pose of a device that is no wrist takes longer:
        choose wider ones.
    progress : bool
        Whether to show a bar.

    Returns
    -------
    Optimised
        ``best``, ``front``, and the check of each: on the full grid and a finer one, with other
        persons and further off centre, with every one of the offsets. A search that is interrupted by hand (Ctrl-C)
        returns what it has found so far, unless not one generation was finished.

    Raises
    ------
    MissingExtra
        If Optuna or cmaes is not installed (``pip install ".[optimise]"``).
    StorageUnusable
        If the storage cannot be opened, read or written, or holds something else than studies of this version.
    MissingData
        If the design lacks what a criterion needs, or "contact_force" has no ``person``.
    InvalidInput
        If an argument does not fit, the named criteria leave an objective unknown, or a limb has mass with the
        objective "contact_force", which is for massless limbs.

    Examples
    --------
    >>> exo = ep.load("four-linear-actuators-worn")
    >>> poses = exo.pose([0, 30, 60, 90])
    >>> found = ep.optimise(exo, {"cuff_height_mm": (150, 250)}, poses, budget=24, finer_step=30.0)
    >>> found.evaluations, found.objectives
    (24, ('index',))
    """
    require_method("exo", exo, "reaction", "a ShoulderExo")
    listed = (objectives,) if isinstance(objectives, str) else tuple(objectives)
    wanted = tuple(as_choice("objective", name, OBJECTIVES) for name in listed)
    if not wanted:
        raise InvalidInput(f"expected at least one objective of {', '.join(OBJECTIVES)}")
    for label, count in (("budget", budget), ("run_length", run_length)):
        if isinstance(count, bool) or not isinstance(count, int) or count < 1:
            raise InvalidInput(f"expected {label} as a number of designs, got {count!r}")
    criteria = Criteria.of(constraints)
    require_known(wanted, criteria)
    if "weakest_rate" in wanted:
        # Only where it is asked is the rate known.
        names = None if criteria.names is None else (*criteria.names, "accuracy")
        criteria = criteria.replace(names=names, least_rate=criteria.least_rate or _ANY_RATE)
    if person is not None:
        require_method("person", person, "joint_contact", "a Person")
        exo, person = exo.worn_by(person), person.on_side(exo.side)
    centres = as_centres(centre_offset)
    chosen = (lifting_poses(exo.side) if poses is None else SearchPoses.of(poses)).at_centres(centres)
    exo = type(exo).from_mechanism(with_cuff_by_geometry(exo.mechanism)) if cuff_by_geometry else exo
    space = DesignVariables(exo.device, variables, cuff_by_geometry)
    start = space.point(space.of_design(must_fit=True)) if refine else None
    contact = _contact(exo, person, chosen, criteria) if "contact_force" in wanted else None
    merit = Merit(space, chosen, criteria, fit_strokes, contact)
    description = study_description(merit, wanted, seed, run_length, refine, centres)
    study = StoredStudy(storage, name, wanted, description, space.count, run_length)
    unfinished: list[SearchRun] = []
    made = _made_runs(study, merit, wanted, seed, budget, run_length, start, unfinished)
    stopped = False
    try:
        left = max(0, budget - sum(run.evaluations for run in study.runs()))
        for _ in track(made, "runs", progress, -(-left // run_length)):
            pass
    except KeyboardInterrupt:
        # The study goes on where it stands if it is asked again.
        stopped = True
    runs = [*study.runs(), *unfinished]
    if stopped and not runs:
        raise KeyboardInterrupt
    # The start is a candidate like all others.
    known = runs if start is None else [_ended(merit, -1, start, {}, 0), *runs]
    # Links that do not fit together make no device; of a search that found no other, its error is the answer.
    known = [run for run in known if run.number < 0 or run.merit < WORST] or known
    designs = [exo.device if run.number < 0 else _designed(merit, run, centres) for run in known]
    weights = _weights(wanted, seed, 0)
    values = [on_full_grid(design, criteria, centres, weights, contact, step) for design in designs]
    rows, candidates = reported(values, wanted, refine), {}
    for row in {*rows, 0} if refine else rows:
        design = type(exo).from_device(designs[row])
        checks = [recheck(designs[row], criteria, finer_step, each, step) for each in centres]
        candidates[row] = Candidate(design, known[row], tuple(checks), values[row].objectives)
    front = tuple(candidates[row] for row in rows)
    on_grid = tuple(each.objectives for run, each in zip(known, values, strict=True) if run.number >= 0)
    runs = [run for run in known if run.number >= 0]
    return Optimised(front, tuple(runs), wanted, on_grid, candidates[0] if refine else None, stopped)


def _ended(merit: Merit, number: int, point: FloatArray, weights: dict[str, float], done: int) -> SearchRun:
    """A point as what a run has found after so many designs."""
    found = merit.evaluate(point, weights)
    return SearchRun(number, point.tolist(), float(found.merit), found.objectives, done)


def _contact(exo: ShoulderExo, person: Person | None, poses: SearchPoses, criteria: Criteria) -> ContactObjective:
    """The wearer's contact force, by the design's own methods."""
    if person is None:
        raise MissingData(["person (who wears the design)"], "the objective 'contact_force'", exo.name)
    record = exo.device.accelerate("workspace")
    if record is not None:
        require_massless(record)
    return ContactObjective(person, poses, type(exo), criteria)


def _made_runs(
    study: StoredStudy,
    merit: Merit,
    objectives: tuple[str, ...],
    seed: int,
    budget: int,
    length: int,
    start: FloatArray | None,
    unfinished: list[SearchRun],
) -> Iterator[int]:
    """Make runs until the budget of all workers is used up; yields their numbers.

    A run that is interrupted by hand is put into ``unfinished`` with its best so far.
    """
    while study.room(budget) > 0:
        taken = study.take(budget)
        if taken is None:
            # What is left is in the hands of other workers: their runs belong to the result, and if one falls silent
            # its run is taken over.
            time.sleep(_WAIT)
            continue
        trial, state = taken
        weights = _weights(objectives, seed, trial.number)
        with study.watched():  # the state may be anything
            run = Descent(merit, weights, (seed, trial.number), state, start)

        def store(run: Descent = run, trial: Any = trial) -> bool:
            return study.checkpoint(trial, run.stored())

        generations = min(length, study.room(budget, trial)) // GENERATION
        try:
            is_done = run.run(max(generations, 1) * GENERATION, store)
        except KeyboardInterrupt:
            if run.done:
                unfinished.append(_ended(merit, trial.number, run.best, weights, run.done))
            raise
        if is_done:
            study.finish(trial, _ended(merit, trial.number, run.best, weights, run.done))
            yield trial.number


def _weights(objectives: tuple[str, ...], seed: int, number: int) -> dict[str, float]:
    """Weights of the objectives beside the coverage in the merit of a run.

    With the index alone a little weight on the force decides between designs of equal coverage. Another objective alone
    has the same weight in all runs, so that their merits can be compared; of several, weights are drawn for every run,
    evenly in their logarithm.
    """
    if objectives == ("index",):
        return {"mean_shoulder_force": 0.05}
    if len(objectives) == 1:
        return {objectives[0]: 1.0}
    numbers = np.random.default_rng((seed, number, 1))
    return {name: float(10.0 ** numbers.uniform(-2.0, 0.0)) for name in objectives if name != "index"}


def _designed(merit: Merit, run: SearchRun, centres: tuple[Centre, ...]) -> Any:
    """The device that a run found."""
    device = merit.variables.design(merit.variables.values(np.array(run.point)))
    if not merit.fit_strokes:
        return device
    return with_strokes(device, merit.poses.weights, merit.lengths(device), centres, merit.variables.sets_stroke)
