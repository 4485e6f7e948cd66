"""Reactions as short tables."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..core.errors import InvalidInput
from ..core.errors.checked import checked
from ..core.tables import NOTES, html_table
from .columns import peak_of

if TYPE_CHECKING:
    from .result import Reaction

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
    if abs(value) < 0.5 * 10.0**-digits:
        value = 0.0  # no "-0.00"
    return f"{value:.{digits}f}"


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
    limbs = range(mechanism.limb_count)
    efforts = {i: f"limb {i + 1} tension f, N" for i in limbs}
    efforts |= {i: f"{name}, {unit}" for i, (name, unit) in enumerate(mechanism.drive_units)}
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
        ["crossings of det X = 0", *(_crossings(r) for r in reactions)],
    ]


def _crossings(reaction: Reaction) -> str:
    """Number of crossings of the singular surface; a dash where its sides have no sign."""
    return "-" if np.isnan(reaction.determinant).all() else str(len(reaction.crossings()))


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
