"""Comparison of designs over the same poses: one design, several designs, all combinations of parameters."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from .. import wrist
from ..core.conventions import as_side, shoulder_rotation
from ..core.errors import ExoPinError, InvalidInput
from ..core.errors.base import echo
from ..core.errors.checked import checked
from ..core.errors.renamed import refuse_old_words
from ..core.progress import mapped
from ..core.validation import FloatArray, as_finite, as_positive, as_rotation, require_method
from ..design import Arm
from ..design.parameters.changes import check_parameters, with_values
from ..design.parameters.names import DesignParameter, parameter, values_of
from ..reaction.assumptions import Question
from ..reaction.columns import peak_of
from ..reaction.constraints.actuator_limits import length_limits
from .study_table import StudyTable

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from ..exo.shoulder_exo import ShoulderExo

#: Columns of :func:`evaluate`.
FIGURES = ("peak_F_s_N", "p95_F_s_N", "median_F_s_N", "can_hold", "holdable", "pull_only", "least_margin", "one_side",
           "reach")  # fmt: skip
#: Designs that are sent to a worker at once.
_BLOCK = 4


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

    Examples
    --------
    >>> ep.adl_box(30.0).shape  # flexion, abduction, internal rotation
    (4, 4, 4)
    """
    step = as_positive("step", step)
    if step < 0.5:
        raise InvalidInput(f"expected a step of half a degree or more, got {step:g}")
    flexion, abduction, axial = (
        low + step * np.arange(int((high - low) / step + 1e-9) + 1) for low, high in ((-110, 0), (-4, 96), (-85, 20))
    )
    return shoulder_rotation(-flexion[:, None, None], abduction[:, None], -axial, as_side(side), degrees=True)


@checked
def evaluate(exo: ShoulderExo, poses: Rotation, **question: Unpack[Question]) -> dict[str, float]:
    """Figures of one design over poses.

    Parameters
    ----------
    exo : ShoulderExo
        The design, with an arm.
    poses : Rotation
        Any stack.
    **question
        Of :meth:`ShoulderExo.reaction`: ``motion``, ``load``, ``split``, ``limits``, ``cone``, ...

    Returns
    -------
    dict
        ``peak_F_s_N``, ``p95_F_s_N``, ``median_F_s_N`` : |F_s| over the poses that can be held; NaN if none can.
        If a design crosses det X = 0, its peak depends on how near to the crossing a pose of the grid lies.
        ``can_hold`` : fraction of poses that are known to be held.
        ``holdable`` : fraction of poses that are held as far as the limits are known.
        ``pull_only`` : fraction that limbs which only pull can hold, massless limbs; else NaN.
        ``least_margin`` : smallest dimensionless distance from the singular surface.
        ``one_side`` : fraction of poses on the more frequent side of det X = 0; the rest is out of reach of
        them without passing through it. NaN for other than three limbs.
        ``reach`` : fraction of poses in which every limb is within its stroke; NaN if a stroke, or what the end
        fittings add, is not known.

    Examples
    --------
    >>> from exo_pin.study import evaluate
    >>> exo = ep.load("four-cables")
    >>> round(evaluate(exo, exo.pose([0, 30, 60], 30))["peak_F_s_N"], 1)
    46.5
    """
    return _figures(exo, poses, question)[0]


def _figures(exo: ShoulderExo, poses: Rotation, question: Question) -> tuple[dict[str, float], FloatArray]:
    """The figures of :func:`evaluate`, and |F_s| in every pose, NaN where it is not held."""
    require_method("exo", exo, "reaction", "a ShoulderExo")
    poses = as_rotation("poses", poses)
    if poses.as_quat().size == 0:
        raise InvalidInput("expected at least one pose, got an empty stack")
    answer = exo.reaction_map(poses, **question)
    force, held = np.where(answer.held, np.asarray(answer.magnitude), np.nan), answer.held
    pull_only = one_side = np.nan
    if exo.is_wrist and exo.mechanism.limbs_are_massless:
        pull_only = wrist.holding(exo.mechanism, poses, load=question.get("load")).holdable.mean()
    if exo.is_wrist and exo.geometry.limb_count == 3:
        sides = np.sign(exo.singularity(poses).determinant)
        one_side = max((sides > 0).mean(), (sides < 0).mean())
    known = force[held] if held.any() else np.array([np.nan])
    figures = {
        "peak_F_s_N": float(known.max()),
        "p95_F_s_N": float(np.percentile(known, 95.0)),
        "median_F_s_N": float(np.median(known)),
        "can_hold": float(answer.can_hold.mean()),
        "holdable": float(held.mean()),
        "pull_only": float(pull_only),
        "least_margin": float(np.fmin.reduce(np.asarray(answer.margin).reshape(-1), initial=np.inf)),
        "one_side": float(one_side),
        "reach": _reach(exo, poses) if exo.is_wrist else float(np.mean(answer.status != "out_of_reach")),
    }
    return figures, force


def _reach(exo: ShoulderExo, poses: Rotation) -> float:
    low, high = length_limits(exo.mechanism)
    if np.isnan(low).any():
        return float("nan")
    lengths = exo.inverse_kinematics(poses).lengths
    return float(((low <= lengths) & (lengths <= high)).all(axis=-1).mean())


def compare(
    exo: ShoulderExo, *others: ShoulderExo | Rotation, poses: Rotation | None = None, **question: Unpack[Question]
) -> StudyTable:
    """Designs of any kind side by side; see :func:`evaluate` for the columns.

    ``common_peak_F_s_N`` is the largest |F_s| over the poses that all hold, NaN where there is none: the peak over all
    that a design holds counts harder poses of the one that holds more. ``poses`` may also be the last of ``others``.
    """
    designs: list[Any] = [exo, *others]
    stack = as_rotation("poses", designs.pop() if poses is None else poses)
    if len(designs) < 2:
        raise InvalidInput("expected at least one other design to compare with")
    for design in designs:
        require_method("design", design, "reaction", "a ShoulderExo")
    found = [_figures(each, stack, question) for each in designs]
    common = np.all([np.isfinite(force) for _, force in found], axis=0)
    return StudyTable(
        [
            {"design": each.name, "common_peak_F_s_N": peak_of(force[common]), **figures}
            for each, (figures, force) in zip(designs, found, strict=True)
        ]
    )


@checked
@refuse_old_words({"jobs": "executor=, such as a ProcessPoolExecutor"})
def sweep(
    exo: ShoulderExo,
    parameters: Mapping[str, ArrayLike | Sequence[Any]],
    poses: Rotation,
    *,
    executor: Executor | None = None,
    progress: bool = False,
    payload_at: ArrayLike | None = None,
    **question: Unpack[Question],
) -> StudyTable:
    """Every combination of parameter values, evaluated over the same poses.

    Parameters
    ----------
    exo : ShoulderExo
        The design to start from.
    parameters : mapping of str to sequence or str
        Values by name, in the unit that the name ends in (``r_A_mm``), else SI (``r_A``); see
        :mod:`exo_pin.design.parameters.names` for all names. Or as text, ``"100:160:4"`` (low, high, count) or
        ``"50,60,70"``.
    poses : Rotation
        Any stack.
    executor : concurrent.futures.Executor, optional
        Where designs are evaluated, such as a ``ProcessPoolExecutor`` or that of Dask (docs/howto/many_machines.md);
        here if left out. The numbers are the same.
    progress : bool
        Whether to show a progress bar.
    payload_at : array_like, optional
        Shape (3,), m, in the arm frame: where the payload is held.
    **question
        Of :meth:`ShoulderExo.reaction`, as in :func:`evaluate`.

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
        If there are no values, the design has no such parameter, an angle in rad looks like degrees, or ``payload_at``
        is missing.

    Examples
    --------
    >>> exo = ep.load("four-cables")
    >>> table = ep.sweep(exo, {"cuff_height_mm": [180, 220]}, exo.pose([0, 30, 60, 90]))
    >>> print(table.verdict)
    Row 1 ranks first, it holds 100.0% of the poses, peak |F_s| 68.7 N. Row 2 follows: 100.0% of the poses, peak |F_s|
    72.9 N.
    """
    require_method("exo", exo, "reaction", "a ShoulderExo")
    if not isinstance(parameters, Mapping) or not parameters:
        raise InvalidInput("expected parameters to map names to sequences of values")
    named = [parameter(name) for name in parameters]
    check_parameters(exo.mechanism, named)
    values = {each: values_of(each, given) for each, given in zip(named, parameters.values(), strict=True)}
    hand = None if payload_at is None else as_finite("payload_at", payload_at, (3,))
    if hand is None and any(each.key == "payload" for each in named):
        raise InvalidInput("a payload needs payload_at, the place in the arm frame where it is held, m")
    poses = as_rotation("poses", poses)
    exo = exo.replace()
    evaluate(exo, poses, **question)  # arguments that fit no design raise here, and not row by row
    combinations = [dict(zip(values, choice, strict=True)) for choice in itertools.product(*values.values())]
    tasks = [(exo, choice, poses, hand, question) for choice in combinations]
    rows = mapped(_row, tasks, executor, "designs", progress, _BLOCK)
    # A value of the wrong shape has columns of its own: the others are blank there.
    blank: dict[str, Any] = {
        name: "" if any(isinstance(row.get(name), str) for row in rows) else np.nan
        for name in dict.fromkeys(itertools.chain.from_iterable(rows))
        if name not in (*FIGURES, "error")
    }
    return StudyTable([blank | row for row in rows])


def _row(
    task: tuple[ShoulderExo, dict[DesignParameter, Any], Rotation, FloatArray | None, Question],
) -> dict[str, Any]:
    exo, choice, poses, hand, question = task
    row: dict[str, Any] = {}
    for named, value in choice.items():
        row |= _labelled(named.name, value)
    try:
        values = {named: named.in_si(value) for named, value in choice.items()}
        design = type(exo).from_mechanism(with_values(exo.mechanism, values, hand))
        return {**row, **evaluate(design, poses, **question), "error": ""}
    except (ExoPinError, TypeError, ValueError) as error:
        return {**row, **dict.fromkeys(FIGURES, np.nan), "error": " ".join(str(error).split())}


def _labelled(name: str, value: Any) -> dict[str, Any]:
    """Columns that show a value in the table: one for a number or name, one a component for an array."""
    if isinstance(value, Arm):
        return {name: value.mass}
    if isinstance(value, str):
        return {name: value}
    if name == "limbs" and isinstance(value, Sequence):
        return {name: "+".join(str(getattr(limb, "kind", "?")) for limb in value)}
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        return {name: echo(value)}
    if array.ndim == 0:
        return {name: float(array)}
    return {f"{name}_{k + 1}": part for k, part in enumerate(array.ravel().tolist())}
