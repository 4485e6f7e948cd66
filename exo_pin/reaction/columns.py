"""Reactions as columns of a table, with units in the names, as plain data, as pictures and as short texts."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..core.conventions import pose_columns
from ..core.errors import InvalidInput
from ..core.errors.checked import checked
from ..core.results import Result, drawn
from ..core.tables import NOTES, effort_column, html_table
from ..core.validation import FloatArray
from ..design.shoulder import PRESSURE_LIMITS
from .holding.verdict import row_verdicts

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from .batch.reaction_maps import ReactionMap
    from .result import Reaction


#: Properties that an answer as plain data has besides its fields.
DERIVED = (
    "magnitude",
    "percent_body_weight",
    "harness_wrench",
    "ratio",
    "can_hold",
    "unknown",
    "reasons",
    "clearance",
    "cuff_pull",
    "cuff_slip",
    "cuff_pressure",
)
_EVIDENCE = ("closest_actuator_forces", "missing_wrench", "blocking", "relief")
_DETERMINED = ("actuator_forces", "constraint_forces", "shoulder_force", "torso_wrench")


@dataclass(frozen=True)
class _SingleAnswer:
    """What an answer as plain data has besides: of a single pose the range of |F_s|, and what equilibrium determines.

    Attributes
    ----------
    criterion : str
        By what the forces were chosen among those that balance the arm.
    cuff_pressure_limits : str
        What skin bears, as sources have it.
    range_least, range_greatest, range_found : ndarray
        |F_s| of the sets of forces that the split allows, N.
    range_unbounded : bool
        Whether nothing bounds |F_s|.
    actuator_forces_determined, constraint_forces_determined : ndarray
        Whether equilibrium alone determines them.
    shoulder_force_determined, torso_wrench_determined : ndarray
        Whether equilibrium alone determines them.
    undetermined : ndarray
        Number of independent reactions that equilibrium does not determine.
    certificate : str
        The same in words.
    """

    criterion: str
    cuff_pressure_limits: str
    range_least: FloatArray
    range_greatest: FloatArray
    range_found: FloatArray
    range_unbounded: bool
    actuator_forces_determined: NDArray[np.bool_]
    constraint_forces_determined: NDArray[np.bool_]
    shoulder_force_determined: NDArray[np.bool_]
    torso_wrench_determined: NDArray[np.bool_]
    undetermined: NDArray[np.int64]
    certificate: str


def vector_columns(label: str, values: FloatArray | None, names: Any) -> dict[str, FloatArray]:
    """Columns of the last axis of an array, none for None; ``label`` has a place for the name."""
    return {} if values is None else {label.format(name): values[..., k] for k, name in enumerate(names)}


def force_columns(answer: Reaction | ReactionMap) -> dict[str, FloatArray]:
    """F_s, |F_s|, f, g and the margin, N and 1, each of the stack's shape; without what a map left out."""
    f, g = answer.actuator_forces, answer.constraint_forces
    columns = vector_columns("F_s_{}_N", answer.shoulder_force, "xyz")
    columns |= {} if answer.magnitude is None else {"F_s_N": answer.magnitude}
    # "f_1_N" of "limb 1".
    drives = [effort_column(name, unit) for name, unit in answer.drive_units]
    columns |= vector_columns("{}", f, drives) | vector_columns("g_{}_N", g, range(1, 1 + len(drives)))
    return columns | ({} if answer.margin is None else {"margin": answer.margin})


def peak_of(magnitude: FloatArray) -> float:
    """Largest of the finite values; NaN if there is none."""
    known = magnitude[np.isfinite(magnitude)]
    return float(known.max()) if known.size else float("nan")


def peak(self: Reaction) -> float:
    """Largest |F_s| of all poses that can be held as far as limits are known, N; NaN if there is none."""
    return peak_of(self.magnitude[self.held])


def drive_units(self: Reaction) -> tuple[tuple[str, str], ...]:
    """Name and unit of each effort: "limb 1" and on of limbs, whose tensions are in N."""
    return self.source.poses.mechanism.drive_units


def clearance(self: Reaction) -> FloatArray:
    """Least gap of the device's parts to the wearer and to one another, shape (...), m; negative in an overlap.

    That of the criterion "clearance" of a workspace. NaN where it is not known who wears the design or how thick
    its parts are (:attr:`cautions` say which), and where the device does not reach the pose. Of limbs that give way
    the undisplaced ones.
    """
    return np.asarray(self.source.poses.gaps.least.min(axis=1).reshape(self.status.shape))


def crossings(self: Reaction) -> NDArray[np.int64]:
    """Where a path crosses the singular surface.

    Returns
    -------
    ndarray of int
        Shape (k, d) for a stack of d dimensions, the last of which runs along the path: index of the last pose
        before det X takes the other sign. Poses on the surface itself belong to neither side: a path that steps
        onto it and goes on crosses once, one that touches it and turns back does not. Empty for other than three
        limbs, whose surface has no such sign.

    Notes
    -----
    A path to a pose beyond the surface passes a pose in which the limbs cannot hold the arm.

    Examples
    --------
    >>> exo = ep.load("prototype")
    >>> path = exo.pose(abduction=np.arange(0.0, 11.0))  # det X = 0 at 6.21°
    >>> exo.reaction(path, limits="none").crossings().tolist()
    [[6]]
    """
    # Poses that the limbs are too weak for lie on one side of the surface, too.
    side = np.where(self.equilibrium_status == "singular", 0.0, np.sign(np.nan_to_num(self.determinant)))
    if side.ndim == 0:
        return np.empty((0, 0), dtype=np.int64)
    found = []
    for path in np.ndindex(side.shape[:-1]):
        steps = np.flatnonzero(side[path])
        signs = side[path][steps]
        found += [(*path, int(steps[k])) for k in np.flatnonzero(signs[1:] != signs[:-1])]
    return np.array(found, dtype=np.int64).reshape(len(found), side.ndim)


def columns(self: Reaction) -> dict[str, Any]:
    """Pose, verdict with its reason, forces, margin, det X and status of every pose, with units in the names.

    The verdict is "held", "not held" or "not known". Numbers are NaN where there is no answer.

    Returns
    -------
    dict of str to ndarray
        Each of the stack's shape.

    Examples
    --------
    >>> exo = ep.load("four-cables")
    >>> list(exo.reaction(exo.pose([0, 45])).columns())[:6]
    ['flexion_deg', 'abduction_deg', 'internal_rotation_deg', 'verdict', 'reason', 'F_s_x_N']
    """
    words, why = row_verdicts(self)
    return (
        pose_columns(self.case.poses, self.source.poses.mechanism.side, self.status.shape)
        | {"verdict": words, "reason": why}
        | force_columns(self)
        | _cuff_columns(self)
        | {"det_X": self.determinant, "status": self.status.astype(object)}
    )


def _cuff_columns(self: Reaction) -> dict[str, FloatArray]:
    """Pull, slip and mean force over area of the cuff, of the stack's shape; what is not known is left out."""
    columns = {"cuff_pull_N": self.cuff_pull} if self.is_worn else {}
    if (slip := self.cuff_slip) is not None:
        columns["cuff_slip_m"] = np.linalg.norm(slip[..., :3], axis=-1)
    return columns | ({} if self.cuff_pressure is None else {"cuff_pressure_Pa": self.cuff_pressure})


def plot(
    self: Reaction,
    along: ArrayLike | None = None,
    label: str = "pose",
    limits: tuple[ArrayLike, ArrayLike] | None = None,
) -> Figure:
    """Draw a pose as bars, poses along one dimension as curves.

    Parameters
    ----------
    along : array_like, optional
        Shape (k,), of a stack: values of the horizontal axis; the poses' numbers if left out.
    label : str
        Name of these values with the unit, such as "flexion, °".
    limits : (lower, upper), optional
        N, tension positive, each broadcasting to the limb forces: what the actuators can give.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InvalidInput
        If the stack has more than one dimension, or shapes do not fit.
    MissingExtra
        If matplotlib is not installed.

    Examples
    --------
    >>> exo, angles = ep.load("four-linear-actuators"), np.array([0.0, 40.0, 80.0])
    >>> figure = exo.reaction(exo.pose(angles)).plot(along=angles, label="flexion, °")
    >>> len(figure.axes[0].lines) > 0
    True
    """
    return drawn("answer_plots:reaction_figure", self, along, label, limits)


def as_dict(self: Reaction) -> dict[str, Any]:
    """All fields as arrays and plain values, in one flat dict; of a single pose with its range of |F_s|.

    Returns
    -------
    dict
        By name of the field or property.

    Examples
    --------
    >>> exo = ep.load("four-linear-actuators-worn")
    >>> fields = exo.reaction(exo.pose(90)).as_dict()
    >>> round(float(np.linalg.norm(fields["shoulder_force"]) - fields["magnitude"]), 9)
    0.0
    """
    found = Result.as_dict(self) | vars(self.optimum) | {"criterion": self.criterion}
    found |= {} if self.cuff_pressure is None else {"cuff_pressure_limits": PRESSURE_LIMITS}
    if self.status.ndim == 0 and (allowed := self.range()) is not None:
        # JSON has no infinity: unbounded is a word of its own.
        found |= {f"range_{name}": value for name, value in vars(allowed).items()}
        found["range_unbounded"] = bool(np.isinf(allowed.greatest))
    if self.infeasibility is not None:
        found |= {name: getattr(self.infeasibility, name) for name in _EVIDENCE}
    found |= {f"{name}_determined": getattr(self.certificate, name) for name in _DETERMINED}
    return found | {"undetermined": self.certificate.undetermined, "certificate": str(self.certificate)}


#: Columns of a line of text below the table.
_WIDTH = 100


@checked
def reaction_table(reactions: Sequence[Reaction]) -> str:
    """Answers to the same query side by side.

    Parameters
    ----------
    reactions : sequence of Reaction
        One column each, all for the same pose or the same stack of poses.

    Returns
    -------
    str
        For a single pose its forces; for a stack the peaks and how many poses have an answer.

    Examples
    --------
    >>> exo = ep.load("prototype")
    >>> answers = [exo.reaction(exo.pose(30, 30), split=split, limits="none") for split in ("spherical", "minimal")]
    >>> print(ep.reaction_table(answers).splitlines()[2].split())
    ['spherical', 'minimal']
    """
    if not reactions:
        raise InvalidInput("expected at least one reaction, got none")
    header, rows = _cells(reactions)
    width = [max(len(row[column]) for row in [header, *rows]) for column in range(len(header))]
    lines = [
        "  ".join([row[0].ljust(width[0]), *(cell.rjust(size) for cell, size in zip(row[1:], width[1:], strict=True))])
        for row in [header, *rows]
    ]
    lines.insert(1, "  ".join("-" * size for size in width))
    head = [textwrap.fill(text, _WIDTH) for text in [*_verdicts(reactions), *_cautions(reactions)]]
    plain = [textwrap.fill(text, _WIDTH, subsequent_indent=indent) for text, indent in _notes(reactions)]
    return "\n".join([*head, "", *(line.rstrip() for line in lines), "", *plain])


def reaction_html(reactions: Sequence[Reaction]) -> str:
    """The same as HTML, for notebooks."""
    header, rows = _cells(reactions)
    head = [*_verdicts(reactions), *_cautions(reactions)]
    return html_table(header, rows, head, (text for text, _ in _notes(reactions)))


def _cells(reactions: Sequence[Reaction]) -> tuple[list[str], list[list[str]]]:
    """Heads and rows of the table."""
    single = all(reaction.status.ndim == 0 for reaction in reactions)
    rows = _pose_rows(reactions) if single else _stack_rows(reactions)
    return ["", *(reaction.split for reaction in reactions)], rows


def _verdicts(reactions: Sequence[Reaction]) -> list[str]:
    return list(dict.fromkeys(reaction.verdict for reaction in reactions))


def _cautions(reactions: Sequence[Reaction]) -> list[str]:
    """What to mind, below the verdicts; what was not checked or used is among the notes."""
    every = (text for reaction in reactions for text in reaction.cautions)
    return list(dict.fromkeys(f"Caution: {text}" for text in every if not text.startswith(NOTES)))


def _number(value: float, digits: int = 2) -> str:
    if not np.isfinite(value):
        return "-"
    return f"{round(float(value), digits) + 0.0:.{digits}f}"  # no "-0.00"


def _pose_rows(reactions: Sequence[Reaction]) -> list[list[str]]:
    rows = [["shoulder force |F_s|, N", *(_number(float(r.magnitude)) for r in reactions)]]
    rows.append(["  of all forces allowed, N", *(_allowed(r) for r in reactions)])
    if all(r.body_weight is not None for r in reactions):
        rows.append(["  % of body weight", *(_number(float(r.percent_body_weight)) for r in reactions)])  # type: ignore[arg-type]
    for axis, label in enumerate(("forward", "left", "up")):
        rows.append([f"  F_s {'xyz'[axis]} ({label}), N", *(_number(r.shoulder_force[axis]) for r in reactions)])
    for labels, name in zip(_force_labels(reactions[0]), ("actuator_forces", "constraint_forces"), strict=True):
        columns = [getattr(reaction, name) for reaction in reactions]
        rows += [[label, *(_number(column[limb]) for column in columns)] for limb, label in labels.items()]
    for owner, name in (("cuff on the arm", "cuff_wrench"), ("harness on the torso", "harness_wrench")):
        for label, part in (("force, N", slice(0, 3)), ("moment, N m", slice(3, 6))):
            sizes = (_number(float(np.linalg.norm(getattr(r, name)[part]))) for r in reactions)
            rows.append([f"{owner}, {label}", *sizes])
    rows.append(["status", *(str(r.status) for r in reactions)])
    return rows


def _force_labels(reaction: Reaction) -> tuple[dict[int, str], dict[int, str]]:
    """Labels of f and of g by their index; of a device that is not a wrist only of those g that are open."""
    mechanism = reaction.source.poses.mechanism
    limbs, f = range(mechanism.limb_count), " tension f" if mechanism.has_limbs else ""
    efforts = {i: f"{name}{f}, {unit}" for i, (name, unit) in enumerate(mechanism.drive_units)}
    if mechanism.force_words[1] == "side forces g":
        return efforts, {i: f"limb {i + 1} side force g, N" for i in limbs}
    return efforts, {i: f"structure g_{i + 1}, N" for i in np.flatnonzero(mechanism.is_upu).tolist()}


def _allowed(reaction: Reaction) -> str:
    """Range of |F_s| of a single pose in a few characters."""
    found = reaction.range()
    if found is None:
        return "none"
    if found.is_single:
        return "no other"
    least, greatest = float(found.least), float(found.greatest)
    return f"{_number(least, 1)} to " + ("unbounded" if np.isinf(greatest) else _number(greatest, 1))


def _stack_rows(reactions: Sequence[Reaction]) -> list[list[str]]:
    def counted(status: str) -> list[str]:
        return [str(int((reaction.equilibrium_status == status).sum())) for reaction in reactions]

    def crossings(reaction: Reaction) -> str:
        # A dash where the sides of the singular surface have no sign.
        return "-" if np.isnan(reaction.determinant).all() else str(len(reaction.crossings()))

    def median(values: np.ndarray) -> str:
        return _number(float(np.median(values))) if values.size else "-"

    return [
        ["poses", *(str(r.status.size) for r in reactions)],
        ["  in equilibrium", *(str(int(r.has_answer.sum())) for r in reactions)],
        ["  within all known limits", *(str(int(r.held.sum())) for r in reactions)],
        ["  marked near_singular", *counted("near_singular")],
        *([["  not evaluated", *counted("not_evaluated")]] if any(r.reasons.any() for r in reactions) else []),
        ["held: peak |F_s|, N", *(_number(r.peak) for r in reactions)],
        ["held: median |F_s|, N", *(median(r.magnitude[r.held]) for r in reactions)],
        ["held: peak |f_i|, N", *(_number(peak_of(np.abs(r.actuator_forces[r.held]))) for r in reactions)],
        ["held: peak |g_i|, N", *(_number(peak_of(np.abs(r.constraint_forces[r.held]))) for r in reactions)],
        ["crossings of det X = 0", *map(crossings, reactions)],
    ]


def _notes(reactions: Sequence[Reaction]) -> list[tuple[str, str]]:
    """Paragraphs below the table, each with the indent of its further lines."""
    statements = dict.fromkeys(reaction.certificate.statement for reaction in reactions)
    notes = [(statement, "") for statement in statements]
    for reaction in reactions:
        if reaction.status.ndim == 0 and reaction.infeasibility is not None:
            notes.append((f"{reaction.split}: {reaction.infeasibility.explain()}", "  "))
        if not (reaction.certificate.undetermined > 0).any():
            continue
        line = f"{reaction.split} assumes {reaction.certificate.chosen_by}. Criterion: {reaction.criterion}."
        if reaction.trivial:
            line += (
                " Its zero is trivial: side forces are passive reactions of the structure, and without a bound on "
                "them the limbs alone can carry the arm."
            )
        notes.append((line, "  "))
    cuffs = {reaction.split: reaction.cuff_text() for reaction in reactions}
    name = "{}: ".format if len(cuffs) > 1 else lambda split: ""
    notes += [(f"{name(split)}{text}", "  ") for split, text in cuffs.items() if text]
    every = (text for reaction in reactions for text in reaction.cautions)
    return [*notes, *dict.fromkeys((text, "  ") for text in every if text.startswith(NOTES))]
