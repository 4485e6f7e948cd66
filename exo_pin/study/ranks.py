"""Ranks of designs by the poses that they hold and by their peak force; equals share a rank; and the Pareto front."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..core.errors import InvalidInput
from ..core.errors.checked import checked
from ..core.tables import enumerated, percent
from ..core.validation import FloatArray
from .figure_words import row_words

__all__: list[str] = []


#: What designs are ranked by.
RANKED_BY = ("can_hold", "holdable", "peak_F_s_N")
#: Shares of poses, and peaks relative to each other, that differ by less are equal.
_SAME_SHARE, _SAME_PEAK = 1e-9, 1e-6
_ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth")
#: Most names in a list of equals.
_MOST = 6
#: What is said of a row of a sweep that could not be built.
_NO_DESIGN = "no design"


def places(columns: Mapping[str, NDArray[Any]]) -> tuple[tuple[int, ...], ...]:
    """Rows of each place, the best first; rows that are equal share one, in the order of their names.

    Empty without the columns of :data:`RANKED_BY`. No order of the rows decides, but for rows of one name.
    """
    if not set(RANKED_BY) <= set(columns):
        return ()
    known, far = (np.asarray(columns[name], dtype=float) for name in RANKED_BY[:2])
    groups: list[list[int]] = [list(range(len(known)))] if len(known) else []
    for values, slack in ((-known, _SAME_SHARE), (-far, _SAME_SHARE), (ranked_peak(columns), None)):
        groups = [part for group in groups for part in _parted(group, values, slack)]
    names = columns.get("design", np.arange(len(known)))
    return tuple(tuple(sorted(group, key=lambda row: (names[row], row))) for group in groups)


def ranked_peak(columns: Mapping[str, NDArray[Any]]) -> FloatArray:
    """The peak force that ranks: over the poses that all hold where there is that column, else each design's own."""
    return np.asarray(columns.get("common_peak_F_s_N", columns["peak_F_s_N"]), dtype=float)


def _parted(group: list[int], values: FloatArray, slack: float | None) -> Iterable[list[int]]:
    """A group in parts of equal value, the least first; NaN comes last. Without ``slack`` the peaks' own."""
    own = np.nan_to_num(values, nan=np.inf)
    ordered = sorted(group, key=lambda row: own[row])
    part = ordered[:1]
    for before, row in itertools.pairwise(ordered):
        step = 0.0 if own[row] == own[before] else own[row] - own[before]
        if step > (_SAME_PEAK * abs(own[before]) if slack is None else slack):
            yield part
            part = []
        part.append(row)
    yield part


def rank_numbers(groups: Sequence[Sequence[int]]) -> tuple[int, ...]:
    """Rank of each row from 1: one more than the number of rows that are better."""
    found, better = [0] * sum(map(len, groups)), 0
    for group in groups:
        for row in group:
            found[row] = better + 1
        better += len(group)
    return tuple(found)


def rule_words(common: bool) -> str:
    """The rule of the ranking, in words."""
    poses = "the poses that all hold" if common else "the poses that each holds"
    return (
        "Ranked by the share of poses known to be held, then by the share held as far as limits are known, then by the "
        f"lower peak |F_s| over {poses}. Equal designs share a rank. A passive support holds no pose alone: it stands "
        "behind those that hold one."
    )


def verdict_words(columns: Mapping[str, NDArray[Any]], groups: Sequence[Sequence[int]]) -> str:
    """Who is first and who is next, with what decides."""
    if not columns["holdable"][groups[0][0]] > 0.0:
        names, peak = row_names(columns, groups[0]), ranked_peak(columns)[groups[0][0]]
        if np.isnan(peak):
            return "No design holds any of the poses."
        verb = "have" if len(groups[0]) > 1 else "has"
        least = f"With the moments of the wearer {names} {verb} the lowest peak |F_s|, {peak:.1f} N."
        return f"No design holds any of the poses alone. {least}"
    texts, rank = [], 1
    for group in groups[:2]:
        place = _ORDINALS[rank - 1] if rank <= len(_ORDINALS) else f"number {rank}"
        names, held = row_names(columns, group, len(group) == 1), _held(columns, group[0])
        if len(group) > 1:
            does = "are no designs" if held == _NO_DESIGN else f"hold {held} each"
            texts.append(f"Equal {place}: {names}, which {does}.")
        elif rank == 1:
            texts.append(f"{names} ranks first: it holds {held}.")
        else:
            texts.append(f"{names} is {place}: {held}.")
        rank += len(group)
    return " ".join(texts)


def row_names(columns: Mapping[str, NDArray[Any]], group: Sequence[int], begins: bool = False) -> str:
    """Some rows in words, at most six; whether they begin a sentence."""
    shown = [row_words(columns, row) for row in group]
    if len(shown) > _MOST:
        shown = [*shown[: _MOST - 1], f"{len(shown) - _MOST + 1} others"]
    words = "; ".join(shown) if any(", " in each for each in shown) else enumerated(shown)
    # A symbol such as r_A, and the name of a design, stay as they are.
    plain = "design" not in columns and words.partition(" ")[0].isalpha()
    return words[0].upper() + words[1:] if begins and plain else words


def _held(columns: Mapping[str, NDArray[Any]], row: int) -> str:
    share, far, peak = columns["can_hold"][row], columns["holdable"][row], ranked_peak(columns)[row]
    if np.isnan(far):
        return _NO_DESIGN
    if not far > 0.0:
        return "none of the poses"
    text = f"{percent(share)} of the poses"
    if far > share:
        text += f" ({percent(far)} if its unknown limits allow it)"
    return text if np.isnan(peak) else f"{text}, peak |F_s| {peak:.1f} N"


@checked
def non_dominated(
    table: Mapping[str, ArrayLike], largest: Sequence[str] = (), smallest: Sequence[str] = ()
) -> NDArray[np.bool_]:
    """Rows of a table that no other row betters (Pareto's front).

    A row betters another if it is at least as good in every figure and better in one.

    Parameters
    ----------
    table : StudyTable or mapping of str to array_like
        Columns of shape (k,).
    largest, smallest : sequence of str
        Columns that should be large, and columns that should be small.

    Returns
    -------
    ndarray of bool
        Shape (k,); False for a row with a figure that is NaN.

    Raises
    ------
    UnknownName
        If a :class:`StudyTable` has no such column.
    InvalidInput
        If no column is named.

    Examples
    --------
    >>> table = {"peak_N": [40.0, 50.0, 60.0], "held": [0.7, 0.6, 0.9]}
    >>> ep.study.non_dominated(table, largest=["held"], smallest=["peak_N"])  # the first beats the second
    array([ True, False,  True])
    """
    columns = [np.asarray(table[name], dtype=float) for name in largest]
    columns += [-np.asarray(table[name], dtype=float) for name in smallest]
    if not columns:
        raise InvalidInput("expected at least one column to be large or small")
    figures = np.stack(columns, axis=1)
    front = np.isfinite(figures).all(axis=1)
    rows = np.flatnonzero(front)
    for row in rows:
        others = figures[rows]
        front[row] = not ((others >= figures[row]).all(axis=1) & (others > figures[row]).any(axis=1)).any()
    return front
