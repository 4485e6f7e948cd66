"""Comparison of designs over the same poses: one design, two designs, all combinations of parameters."""

from __future__ import annotations

import itertools
import pickle
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from .. import wrist
from ..core.conventions import as_side, shoulder_rotation
from ..core.errors import ExoPinError, InvalidInput
from ..core.progress import track
from ..core.validation import FloatArray, as_finite, as_positive, as_rotation, require_method
from ..load_case import Load
from ..reaction.constraints.actuator_limits import length_limits
from .design_parameters import changed, labelled, parameter_values
from .study_table import StudyTable

if TYPE_CHECKING:
    from ..exo.shoulder_exo import ShoulderExo

__all__ = ["FIGURES", "adl_box", "compare", "evaluate", "sweep"]

#: Columns of :func:`evaluate`.
FIGURES = ("peak_F_s_N", "p95_F_s_N", "median_F_s_N", "holdable", "pull_only", "least_margin", "one_side", "reach")
#: Splits that a map answers as the query does; None is the default.
_QUICK = (None, "spherical", "minimal", "standalone")
#: Most designs handed to a second process at once.
_CHUNK = 16


def adl_box(step: float = 4.0, side: str = "left") -> Rotation:
    """Poses of the box of daily activities that the thesis's workspace study uses (Appendix C).

    Flexion 0 to 110, abduction -4 to 96, axial rotation θz -85 to 20 degrees (external positive, as printed), in the
    shoulder's intrinsic Y-X-Z angles, on a grid from the lower ends of θy, θx, θz. At 4 degrees these are 28 × 26 × 27
    poses, at 2 degrees 56 × 51 × 53.

    Parameters
    ----------
    step : float
        Degrees.
    side : {"left", "right"}
        Side of the body.

    Returns
    -------
    Rotation
        Stack of shape (flexion, abduction, axial).
    """
    step = as_positive("step", step)
    if step < 0.5:
        raise InvalidInput(f"expected a step of half a degree or more, got {step:g}")
    flexion, abduction, axial = (
        low + step * np.arange(int((high - low) / step + 1e-9) + 1) for low, high in ((-110, 0), (-4, 96), (-85, 20))
    )
    return shoulder_rotation(-flexion[:, None, None], abduction[:, None], -axial, as_side(side), degrees=True)


def evaluate(exo: ShoulderExo, orientations: Rotation, load: Load | None = None, **options: Any) -> dict[str, float]:
    """Figures of one design over poses.

    Parameters
    ----------
    exo : ShoulderExo
        The design, with an arm.
    orientations : Rotation
        Poses, any stack.
    load : Load, optional
        On the arm.
    **options
        Of :meth:`ShoulderExo.reaction` (``split``, ``limits``, ``cone``, ...). Without a cone, weights or an offset,
        and with massless limbs, :meth:`ShoulderExo.reaction_map` gives the same answer about a thousand times faster.

    Returns
    -------
    dict
        ``peak_F_s_N``, ``p95_F_s_N``, ``median_F_s_N`` : |F_s| over the poses that can be held; NaN if none can.
        If a design crosses det X = 0, its peak depends on how near to the crossing a pose of the grid lies.
        ``holdable`` : fraction of poses that are held as far as the limits are known.
        ``pull_only`` : fraction that limbs which only pull can hold, massless limbs; else NaN.
        ``least_margin`` : smallest dimensionless distance from the singular surface.
        ``one_side`` : fraction of poses on the more frequent side of det X = 0; the rest is out of reach of
        them without passing through it. NaN for other than three limbs.
        ``reach`` : fraction of poses in which every limb is within its stroke; NaN if a stroke, or what the end
        fittings add, is not known.
    """
    require_method("exo", exo, "reaction", "a ShoulderExo")
    poses = as_rotation("orientations", orientations)
    if poses.as_quat().size == 0:
        raise InvalidInput("expected at least one pose, got an empty stack")
    massless = exo.mechanism.limbs_are_massless
    quick = massless and set(options) <= {"split", "limits", "constraint_bounds"} and options.get("split") in _QUICK
    answer = (exo.reaction_map if quick else exo.reaction)(poses, load=load, **options)
    force, margin, held = np.asarray(answer.magnitude), np.asarray(answer.margin), answer.held
    pull_only = wrist.holding(exo.mechanism, poses, load=load).holdable.mean() if massless else np.nan
    sides = np.sign(exo.singularity(poses).determinant)
    one_side = max((sides > 0).mean(), (sides < 0).mean()) if exo.geometry.limb_count == 3 else np.nan
    known = force[held] if held.any() else np.array([np.nan])
    return {
        "peak_F_s_N": float(known.max()),
        "p95_F_s_N": float(np.percentile(known, 95.0)),
        "median_F_s_N": float(np.median(known)),
        "holdable": float(held.mean()),
        "pull_only": float(pull_only),
        "least_margin": float(margin.min()),
        "one_side": float(one_side),
        "reach": _reach(exo, poses),
    }


def _reach(exo: ShoulderExo, poses: Rotation) -> float:
    low, high = length_limits(exo.mechanism)
    if np.isnan(low).any():
        return float("nan")
    lengths = exo.inverse_kinematics(poses).lengths
    return float(((low <= lengths) & (lengths <= high)).all(axis=-1).mean())


def compare(exo: ShoulderExo, other: ShoulderExo, orientations: Rotation, **options: Any) -> StudyTable:
    """Two designs side by side; see :func:`evaluate` for the columns."""
    for name, design in (("exo", exo), ("other", other)):
        require_method(name, design, "reaction", "a ShoulderExo")
    return StudyTable([{"design": each.name, **evaluate(each, orientations, **options)} for each in (exo, other)])


def sweep(
    exo: ShoulderExo,
    parameters: Mapping[str, ArrayLike | Sequence[Any]],
    orientations: Rotation,
    *,
    jobs: int = 1,
    progress: bool = False,
    payload_at: ArrayLike | None = None,
    **options: Any,
) -> StudyTable:
    """Every combination of parameter values, evaluated over the same poses.

    Parameters
    ----------
    exo : ShoulderExo
        The design to start from.
    parameters : mapping
        Values by name. ``r_A``, ``r_B``, ``h_A``, ``h_B`` (m), ``alpha_A``, ``alpha_B``, or ``alpha`` for both (rad,
        one array of n a value), and ``alpha_A[2]`` and so on for the angle of one limb, counted from 1; ``arm`` and
        ``person`` (:class:`exo_pin.Arm`; the second keeps what the device moves); ``payload`` (kg, a point mass at
        ``payload_at``); ``limbs`` (one sequence of limbs a value) and ``limb_kind``; ``gravity`` (m/s², one vector a
        value), ``lean_forward`` and ``lean_left`` (rad, of the trunk).
    orientations : Rotation
        Poses, any stack.
    jobs : {1, 2}
        Processes. With 2 the calling script has to guard its own start (``if __name__ == "__main__":``), and
        options have to be picklable.
    progress : bool
        Whether to show a progress bar.
    payload_at : array_like, optional
        Shape (3,), m, in the arm frame: where the payload is held.
    **options
        Of :func:`evaluate`: ``load``, and those of :meth:`ShoulderExo.reaction`.

    Returns
    -------
    StudyTable
        A column a parameter (a column a component for arrays), then those of :func:`evaluate`, then ``error``: why a
        design could not be built or evaluated, empty for all others. Such a design has NaN in its figures and
        spoils no other.

    Raises
    ------
    UnknownName
        If a parameter is none of these.
    InvalidInput
        If there are no values, or ``payload_at`` is missing.
    """
    require_method("exo", exo, "reaction", "a ShoulderExo")
    if isinstance(jobs, bool) or jobs not in (1, 2):
        raise InvalidInput(f"expected jobs to be 1 or 2, got {jobs!r}")
    values = parameter_values(parameters)
    hand = None if payload_at is None else as_finite("payload_at", payload_at, (3,))
    if "payload" in values and hand is None:
        raise InvalidInput("a payload needs payload_at, the place in the arm frame where it is held, m")
    poses = as_rotation("orientations", orientations)
    exo = exo.replace()
    if jobs == 2:
        _require_picklable(exo, values, options)
    evaluate(exo, poses, **options)  # arguments that fit no design raise here, and not row by row
    combinations = [dict(zip(values, choice, strict=True)) for choice in itertools.product(*values.values())]
    tasks = [(exo, choice, poses, hand, options) for choice in combinations]
    if jobs == 1:
        rows = [_row(task) for task in track(tasks, "designs", progress)]
    else:
        # Fresh processes: a fork would copy locks that compiled code may hold.
        with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
            results = pool.map(_row, tasks, chunksize=max(1, min(_CHUNK, len(tasks) // (2 * jobs))))
            rows = list(track(results, "designs", progress, total=len(tasks)))
    # A value of the wrong shape has columns of its own: the others are blank there.
    blank: dict[str, Any] = {
        name: "" if any(isinstance(row.get(name), str) for row in rows) else np.nan
        for name in dict.fromkeys(itertools.chain.from_iterable(rows))
        if name not in (*FIGURES, "error")
    }
    return StudyTable([blank | row for row in rows])


def _require_picklable(*things: Any) -> None:
    try:
        pickle.dumps(things)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise InvalidInput(f"expected values and options that a second process can be sent: {error}") from error


def _row(task: tuple[ShoulderExo, dict[str, Any], Rotation, FloatArray | None, dict[str, Any]]) -> dict[str, Any]:
    exo, choice, poses, hand, options = task
    row: dict[str, Any] = {}
    for name, value in choice.items():
        row |= labelled(name, value)
    try:
        design = exo
        for name, value in choice.items():
            design = changed(design, name, value, hand)
        return {**row, **evaluate(design, poses, **options), "error": ""}
    except (ExoPinError, TypeError, ValueError) as error:
        return {**row, **dict.fromkeys(FIGURES, np.nan), "error": " ".join(str(error).split())}
