"""All combinations of parameters of a design, over the same poses."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..core.conventions import as_side, shoulder_rotation
from ..core.errors import ExoPinError, InvalidInput
from ..core.errors.base import echo
from ..core.errors.checked import checked
from ..core.progress import mapped
from ..core.validation import FloatArray, as_finite, as_positive, as_rotation, require_method
from ..design import Arm
from ..design.parameters.names import DesignParameter, values_of
from ..reaction.assumptions import Question
from .detailed_figures import joint_figures, joint_words, require_rest
from .evaluation import evaluate
from .figure_words import FIGURES, JOINT_FIGURES
from .study_table import StudyTable

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from ..exo.shoulder_exo import ShoulderExo

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
def sweep(
    exo: ShoulderExo,
    parameters: Mapping[str, ArrayLike | Sequence[Any]],
    poses: Rotation,
    *,
    executor: Executor | None = None,
    progress: bool = False,
    payload_at: ArrayLike | None = None,
    joint: bool = False,
    **question: Unpack[Question],
) -> StudyTable:
    """Every combination of parameter values, evaluated over the same poses.

    Parameters
    ----------
    exo : ShoulderExo
        The design to start from.
    parameters : mapping of str to sequence or str
        Values by name, in the unit that the name ends in (``r_A_mm``), else SI (``r_A``); see
        :mod:`exo_pin.design.parameters.names` for all names, and for those of devices that are no wrists
        :mod:`exo_pin.device.dimensions` (``"spring[strut,1].z_mm"``). Or as text, ``"100:160:4"`` (low, high, count) or
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
    joint : bool
        Whether the force in the joint with the wearer's own muscles leads: the columns ``contact_N``,
        ``peak_contact_N``, ``contact_without_N`` and ``relief`` of :func:`exo_pin.study.compare`, over the held of at
        most 100 poses, at rest. Needs the extra ``person`` and a design that has a wearer.
    **question
        Of :meth:`ShoulderExo.reaction`, as in ``evaluate``.

    Returns
    -------
    StudyTable
        A column a parameter (a column a component for arrays), then those of ``evaluate``, then ``error``: why a
        design could not be built or evaluated, empty for all others. Such a design has NaN in its figures and
        spoils no other.

    Raises
    ------
    UnknownName
        If a parameter is none of these.
    InvalidInput
        If there are no values, the design has no such parameter, an angle in rad looks like degrees, or ``payload_at``
        is missing; or ``joint`` comes with a motion, a load, or a payload, which the wearer has to carry
        (:class:`exo_pin.Wearer`).

    Examples
    --------
    >>> exo = ep.load("four-cables")
    >>> table = ep.sweep(exo, {"cuff_height_mm": [180, 220]}, exo.pose([0, 30, 60, 90]))
    >>> print(table.verdict)
    Cuff height 180 mm ranks first: it holds 100 % of the poses, peak |F_s| 68.7 N. Cuff height 220 mm is second: 100 %
    of the poses, peak |F_s| 72.9 N.
    """
    require_method("exo", exo, "reaction", "a ShoulderExo")
    if not isinstance(parameters, Mapping) or not parameters:
        raise InvalidInput("expected parameters to map names to sequences of values")
    named = exo.device.parameters(parameters)
    values = {each: values_of(each, given) for each, given in zip(named, parameters.values(), strict=True)}
    hand = None if payload_at is None else as_finite("payload_at", payload_at, (3,))
    if hand is None and any(each.key == "payload" for each in named):
        raise InvalidInput("a payload needs payload_at, the place in the arm frame where it is held, m")
    poses = as_rotation("poses", poses)
    if joint:
        require_rest(question)
        if any(each.key == "payload" for each in named):
            raise InvalidInput("expected no payload among the parameters: the wearer carries it (payload of joint)")
    exo = exo.replace()
    evaluate(exo, poses, **question)  # arguments that fit no design raise here, and not row by row
    combinations = [dict(zip(values, choice, strict=True)) for choice in itertools.product(*values.values())]
    tasks = [(exo, choice, poses, hand, question, joint) for choice in combinations]
    rows = mapped(_row, tasks, executor, "designs", progress, _BLOCK)
    # A value of the wrong shape has columns of its own: the others are blank there.
    blank: dict[str, Any] = {
        name: "" if any(isinstance(row.get(name), str) for row in rows) else np.nan
        for name in dict.fromkeys(itertools.chain.from_iterable(rows))
        if name not in (*JOINT_FIGURES, *FIGURES, "error")
    }
    return StudyTable([blank | row for row in rows], (joint_words(poses),) if joint else ())


def _row(
    task: tuple[ShoulderExo, dict[DesignParameter, Any], Rotation, FloatArray | None, Question, bool],
) -> dict[str, Any]:
    exo, choice, poses, hand, question, joint = task
    row: dict[str, Any] = {}
    for named, value in choice.items():
        row |= _labelled(named.name, value)
    try:
        values = {named: named.in_si(value) for named, value in choice.items()}
        design = type(exo).from_device(exo.device.with_values(values, hand))
        leading = joint_figures(design, poses, question) if joint else {}
        return {**row, **leading, **evaluate(design, poses, **question), "error": ""}
    except (ExoPinError, TypeError, ValueError) as error:
        lost = dict.fromkeys((*(JOINT_FIGURES if joint else ()), *FIGURES), np.nan)
        return {**row, **lost, "error": " ".join(str(error).split())}


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
