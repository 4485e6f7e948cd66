"""Figures of designs over the same poses, one design or several side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from scipy.spatial.transform import Rotation

from .. import wrist
from ..core.errors import InvalidInput
from ..core.errors.checked import checked
from ..core.validation import FloatArray, as_rotation, require_method
from ..reaction.assumptions import Question
from ..reaction.columns import peak_of
from ..reaction.constraints.actuator_limits import length_limits
from .study_table import StudyTable

if TYPE_CHECKING:
    from ..exo.shoulder_exo import ShoulderExo

#: Columns of :func:`evaluate`.
FIGURES = ("peak_F_s_N", "p95_F_s_N", "median_F_s_N", "can_hold", "holdable", "pull_only", "least_margin", "one_side",
           "reach")  # fmt: skip


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

    Parameters
    ----------
    exo : ShoulderExo
        A design.
    *others : ShoulderExo
        The other designs.
    poses : Rotation
        Any stack; by name or after the designs.
    **question
        Of :meth:`ShoulderExo.reaction`: ``motion``, ``load``, ``split``, ``limits``, ...

    Returns
    -------
    StudyTable
        One row a design: ``design``, the columns of :func:`evaluate` and ``common_peak_F_s_N``.

    Examples
    --------
    >>> cables, motors = ep.load("four-cables"), ep.load("four-linear-actuators")
    >>> table = ep.study.compare(cables, motors, poses=cables.pose([0, 45, 90]))
    >>> table["common_peak_F_s_N"].round(1)  # N, over the poses that both hold
    array([72.5, 50.7])
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
