"""Maps as columns of a table, with units in the names."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ...core.results import frame_of
from ...core.validation import FloatArray
from ..columns import force_columns, peak_of

if TYPE_CHECKING:
    from .reaction_maps import ReactionMap


class ShownMap:
    """Peak and table of a :class:`ReactionMap`."""

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


def magnitude_of(answer: ReactionMap) -> FloatArray:
    """|F_s| of a map, from F_s if need be."""
    if answer.magnitude is not None:
        return answer.magnitude
    if answer.shoulder_force is None:
        raise InvalidInput('the map has neither |F_s| nor F_s: add "magnitude" to keep')
    return np.asarray(np.linalg.norm(answer.shoulder_force, axis=-1))
