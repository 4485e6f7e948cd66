"""Designs of a table that no other design dominates (Pareto front)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..core.errors import InvalidInput
from ..core.errors.checked import checked


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
    figures = np.stack(columns, axis=-1)
    front = np.isfinite(figures).all(axis=-1)
    rows = np.flatnonzero(front)
    for row in rows:
        others = figures[rows]
        front[row] = not ((others >= figures[row]).all(axis=-1) & (others > figures[row]).any(axis=-1)).any()
    return front
