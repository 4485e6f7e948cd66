"""Search for designs: ``optimise``."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.progress import track
from ...core.validation import FloatArray, require_method
from ...load_case.pose_stacks import pose_matrices
from ..criteria import Criteria
from .descent import Descent
from .design_variables import DesignVariables
from .merit import OBJECTIVES, Merit, check_objectives
from .optimised import Candidate, Optimised
from .recheck import recheck
from .search_poses import SearchPoses, lifting_poses
from .stored_study import CHECKPOINT, Run, StoredStudy
from .stroke_fitting import fitted_strokes

if TYPE_CHECKING:
    from ...exo.shoulder_exo import ShoulderExo

__all__ = ["optimise"]

#: Designs that one run evaluates: of a search in 24 variables few runs gain more after these.
_RUN = 12_000
#: Beyond the window of the lengths on the grid, an actuator takes this much, m, where its family allows it.
_SPARE = 0.002


def optimise(
    exo: ShoulderExo,
    variables: Mapping[str, Any],
    poses: Rotation | SearchPoses | None = None,
    objectives: str | Iterable[str] = ("index",),
    constraints: Criteria | Iterable[str] | None = None,
    *,
    seed: int = 0,
    budget: int = 60_000,
    storage: str | PathLike[str] | None = None,
    name: str = "study",
    fit_strokes: bool = True,
    refine: bool = False,
    run_length: int = _RUN,
    finer_step: float = 2.0,
    progress: bool = False,
) -> Optimised:
    """Search for the design that meets all criteria over the most poses, with low shoulder force.

    Runs of CMA-ES from starts drawn at random; a run is a row of the stored study. Call it again with the same storage
    and name to go on, from any number of processes at once: they share the budget.

    Parameters
    ----------
    exo : ShoulderExo
        The design to start from: number of limbs, families of actuators and their forces, arm.
    variables : mapping of str to (float, float)
        Bounds by name, m and rad; see :mod:`.design_variables` and :func:`free_joints`.
    poses : Rotation or SearchPoses, optional
        Where designs are judged during the search; :func:`lifting_poses` of the design's side if left out.
    objectives : str or iterable of str
        Of :data:`exo_pin.workspace.optimisation.OBJECTIVES`. With several, the runs weigh them differently, and the
        result has their Pareto front.
    constraints : Criteria or iterable of str, optional
        What a pose must meet; all that the design's data allow if left out.
    seed : int
        Of all random numbers: run k starts from (seed, k), whoever makes it.
    budget : int
        Designs to evaluate in all.
    storage : str or path-like, optional
        A path, for a SQLite file, or the URL of a database. In memory if left out.
    name : str
        Of the study in the storage.
    fit_strokes : bool
        Whether each limb gets the stroke of its family that fits best, in place of the design's own.
    refine : bool
        Whether every run starts from the design itself, with small steps, instead of from a random start.
    run_length : int
        Designs of one run.
    finer_step : float
        Of the second grid of the check, degrees.
    progress : bool
        Whether to show a bar.

    Returns
    -------
    Optimised
        ``best``, ``front``, and the check of each: through Pinocchio, on the full grid and a finer one, with other
        persons and off centre.

    Raises
    ------
    MissingExtra
        If Optuna or cmaes is not installed (``pip install ".[optimise]"``).
    MissingData
        If the design lacks what a criterion needs.
    SolverFailed
        If the check through Pinocchio does not confirm a result.
    """
    require_method("exo", exo, "reaction", "a ShoulderExo")
    wanted = check_objectives(objectives)
    if not wanted:
        raise InvalidInput(f"expected at least one objective of {', '.join(OBJECTIVES)}")
    for label, count in (("budget", budget), ("run_length", run_length)):
        if isinstance(count, bool) or not isinstance(count, int) or count < 1:
            raise InvalidInput(f"expected {label} as a number of designs, got {count!r}")
    criteria = Criteria.of(constraints)
    chosen = lifting_poses(exo.side) if poses is None else SearchPoses.of(poses)
    space = DesignVariables(exo.mechanism, variables)
    merit = Merit(space, chosen, criteria, fit_strokes)
    study = StoredStudy(storage, name, wanted, _description(space, chosen, criteria, seed, run_length, refine))
    start = space.point(space.of_design()) if refine else None
    runs = _search(study, merit, wanted, seed, budget, run_length, start, progress)
    if not runs:
        raise InvalidInput("no design could be evaluated: every one lacks data or cannot be built")
    return _reported(exo, merit, runs, wanted, finer_step)


def _description(
    space: DesignVariables, poses: SearchPoses, criteria: Criteria, seed: int, run_length: int, refine: bool
) -> dict[str, Any]:
    """What a study searches, to tell it from others."""
    return {
        "design": space.mechanism.name,
        "limbs": space.mechanism.limb_count,
        "variables": dict(zip(space.names, space.bounds.tolist(), strict=True)),
        "poses": len(poses.weights),
        "criteria": repr(criteria),
        "seed": seed,
        "run_length": run_length,
        "start": space.of_design() if refine else "random",
    }


def _search(
    study: StoredStudy,
    merit: Merit,
    objectives: tuple[str, ...],
    seed: int,
    budget: int,
    length: int,
    start: FloatArray | None,
    progress: bool,
) -> list[Run]:
    runs = list(study.runs())
    planned = range(max(1, -(-(budget - sum(run.evaluations for run in runs)) // length)))
    if budget <= sum(run.evaluations for run in runs):
        planned = range(0)
    for _ in track(planned, "runs", progress):
        if sum(run.evaluations for run in study.runs()) >= budget:
            break  # other workers have used it up
        trial, state = study.take()
        weights = _weights(objectives, seed, trial.number)
        run = Descent(merit, weights, (seed, trial.number), state or None, start)
        last = time.monotonic()
        study.checkpoint(trial, run.stored())

        def store(run: Descent = run, trial: Any = trial) -> None:
            nonlocal last
            if time.monotonic() - last > CHECKPOINT:
                last = time.monotonic()
                study.checkpoint(trial, run.stored())

        run.run(min(length, budget), store)
        found = merit.evaluate(run.best, weights)
        study.finish(trial, run.best.tolist(), float(found.merit), found.objectives, run.done)
    return list(study.runs())


def _weights(objectives: tuple[str, ...], seed: int, number: int) -> dict[str, float]:
    """Weights of the objectives beside the coverage in the merit of a run.

    With one objective a little weight on the force decides between designs of equal coverage; with several, weights are
    drawn for every run, evenly in their logarithm.
    """
    if objectives == ("index",):
        return {"mean_shoulder_force": 0.05}
    numbers = np.random.default_rng((seed, number, 1))
    return {name: float(10.0 ** numbers.uniform(-2.0, 0.0)) for name in objectives if name != "index"}


def _reported(
    exo: ShoulderExo, merit: Merit, runs: list[Run], objectives: tuple[str, ...], finer_step: float
) -> Optimised:
    """The best run and the Pareto front of all, each with its check."""
    from ...study import non_dominated

    table = {name: np.array([run.objectives[name] for run in runs]) for name in objectives}
    largest = [name for name in objectives if OBJECTIVES[name]]
    smallest = [name for name in objectives if not OBJECTIVES[name]]
    on_front = np.flatnonzero(non_dominated(table, largest, smallest))
    best = int(np.argmin([run.merit for run in runs])) if len(objectives) == 1 else None
    rows = [best] if best is not None else sorted(on_front.tolist(), key=lambda row: -runs[row].objectives["index"])
    return Optimised(
        tuple(_candidate(exo, merit, runs[row], finer_step) for row in rows),
        tuple(runs),
        objectives,
    )


def _candidate(exo: ShoulderExo, merit: Merit, run: Run, finer_step: float) -> Candidate:
    values = merit.variables.values(np.array(run.point))
    mechanism = merit.variables.design(values)
    if merit.fit_strokes:
        mechanism = _with_strokes(mechanism, merit)
    design = type(exo).from_mechanism(mechanism)
    return Candidate(design, run, recheck(mechanism, design.reaction, merit.criteria, finer_step))


def _with_strokes(mechanism: Any, merit: Merit) -> Any:
    """The design with strokes that fit the full grid of daily activities and the poses of the search."""
    from ...study import adl_box

    matrices = np.concatenate(
        [pose_matrices(adl_box(4.0, mechanism.side))[1], pose_matrices(merit.poses.orientations)[1]]
    )
    geometry = mechanism.geometry
    ends = np.einsum("kij,nj->kni", matrices, geometry.platform_points)
    lengths: FloatArray = np.sqrt(((ends - geometry.base_points) ** 2).sum(axis=-1))
    # The grid has many poses and the search few: both count alike.
    search = len(merit.poses.weights)
    grid = len(matrices) - search
    weights = np.concatenate([np.full(grid, 0.5 / grid), 0.5 * merit.poses.weights])
    return fitted_strokes(mechanism, lengths, weights, _SPARE)
