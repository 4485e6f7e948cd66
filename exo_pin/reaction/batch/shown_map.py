"""Maps as columns of a table, with units in the names, and as pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.errors import InvalidInput
from ...core.results import drawn, frame_of
from ...core.validation import FloatArray
from ..columns import force_columns, peak_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from .reaction_maps import ReactionMap


class ShownMap:
    """Peak, table and picture of a :class:`ReactionMap`."""

    @property
    def peak(self: ReactionMap) -> float:  # type: ignore[misc]
        """Largest |F_s| of all poses that can be held as far as limits are known, N; NaN if there is none.

        Raises
        ------
        InvalidInput
            If the map has no status, or neither |F_s| nor F_s.
        """
        return peak_of(magnitude_of(self)[self.held])

    def to_dataframe(self: ReactionMap) -> Any:  # type: ignore[misc]
        """A pandas DataFrame, one row a pose, of the selected quantities; see :meth:`Reaction.to_dataframe`.

        Returns
        -------
        pandas.DataFrame

        Raises
        ------
        MissingExtra
            If pandas is not installed.

        Examples
        --------
        >>> exo = ep.load("four-cables")
        >>> frame = exo.reaction_map(exo.pose([0, 30]), keep=["magnitude"]).to_dataframe()
        >>> frame.shape[0], [name for name in frame if "F_s" in name]
        (2, ['F_s_N'])
        """
        columns: dict[str, NDArray[Any]] = {**force_columns(self)}
        if self.status_codes is not None:
            columns["status"] = self.status.astype(object)
        return frame_of(columns)

    def plot(  # type: ignore[misc]
        self: ReactionMap,
        along: ArrayLike | tuple[ArrayLike, ArrayLike] | None = None,
        label: str | tuple[str, str] | None = None,
    ) -> Figure:
        """Draw |F_s| of a map of one dimension as a curve, of two dimensions as a picture.

        Poses that cannot be held are left out where the map has a status.

        Parameters
        ----------
        along : array_like, or a pair of them, optional
            Values along the stack: shape (k,), or for two dimensions shapes (k,) and (m,), rising, of the first
            and of the second. Numbers of the poses if left out.
        label : str, or a pair of them, optional
            Names of these values with the unit.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        InvalidInput
            If the map has another number of dimensions or no |F_s|, or shapes do not fit.
        MissingExtra
            If matplotlib is not installed.

        Examples
        --------
        >>> exo, angles = ep.load("four-cables"), np.array([0.0, 30.0, 60.0])
        >>> figure = exo.reaction_map(exo.pose(angles)).plot(along=angles, label="flexion, °")
        >>> figure.axes[0].get_xlabel()
        'flexion, °'
        """
        shown = magnitude_of(self)
        if self.status_codes is not None:
            shown = np.where(self.held, shown, np.nan)
        return drawn("answer_plots:map_figure", shown, along, label)


def magnitude_of(answer: ReactionMap) -> FloatArray:
    """|F_s| of a map, from F_s if need be."""
    if answer.magnitude is not None:
        return answer.magnitude
    if answer.shoulder_force is None:
        raise InvalidInput('the map has neither |F_s| nor F_s: add "magnitude" to keep')
    return np.asarray(np.linalg.norm(answer.shoulder_force, axis=-1))
