"""The largest shoulder force over a ball of centre offsets.

The device's centre is known to a centimetre or two at best. Within that ball the displaced geometry may be singular:
tensions and shoulder force then grow without bound. Samples of the force may miss such a singular surface. Across it
the determinant of the equilibrium equations changes its sign, so that a change of sign is searched first. Only in a
ball without one the largest force is searched.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput
from ..core.validation import as_finite, as_positive
from ..design import Mechanism
from ..load_case import Load, Motion
from ..reaction.splits.split import Split
from ..wrist.limbs import STATUS
from .linear_splits import linear_split
from .offset_search import OffsetSearch
from .worst_case import WorstCase, loaded, status_names

__all__ = ["worst_offset"]

#: An offset beyond this, m, was probably given in millimetres.
_FARTHEST = 0.2


def worst_offset(
    mechanism: Mechanism,
    orientation: Rotation,
    radius: float,
    split: str | Split = "spherical",
    motion: Motion | None = None,
    load: Load | None = None,
    centre: ArrayLike = (0.0, 0.0, 0.0),
) -> WorstCase:
    """Largest |F_s| over all centre offsets within a ball.

    Parameters
    ----------
    mechanism : Mechanism
        With massless limbs.
    orientation : Rotation
        Single or a stack of shape (...).
    radius : float
        Of the ball, m; 0.015 to 0.021 m is what usual estimates of the shoulder's centre err by.
    split : {"spherical", "elastic_linear", "elastic"}
        How the forces that equilibrium does not determine are chosen. The last two are the same here: the elastic
        formula for small displacements; :meth:`exo_pin.ShoulderExo.elastic_difference` gives its difference from the
        displaced geometry.
    motion, load
        As :meth:`exo_pin.ShoulderExo.reaction`.
    centre : array_like
        Centre of the ball, shape (3,), m, where an offset is known.

    Returns
    -------
    WorstCase
        By search: 256 points of a Sobol sequence, then sequential quadratic
        programming from the best. With more than three limbs the determinant has no sign, and a singular configuration
        is found only by chance.

    Raises
    ------
    MissingData
        If ``split`` is "elastic" and the shoulder's stiffness is not known.
    InvalidInput
        If an argument does not fit, or a limb has mass.
    """
    law = linear_split(split)
    size = as_positive("radius", radius)
    middle = as_finite("centre", centre, (3,))
    if size + float(np.linalg.norm(middle)) > _FARTHEST:
        raise InvalidInput(
            f"expected radius and centre in m, together within {_FARTHEST} m, got {size:g} (millimetres?)"
        )
    stiffness = law.shoulder_stiffness(mechanism)
    given = loaded(mechanism, orientation, motion, load)
    count = len(given.force)
    magnitude, nominal = np.full(count, np.nan), np.full(count, np.nan)
    force, at = np.full((count, 3), np.nan), np.full((count, 3), np.nan)
    codes, within = np.full(count, STATUS.index("not_solved"), dtype=np.int8), np.zeros(count, dtype=bool)
    for row in range(count):
        ball = OffsetSearch(mechanism, given, row, middle, size, stiffness)
        codes[row] = ball.code
        if ball.code == STATUS.index("folded"):
            continue
        nominal[row] = ball.nominal
        if np.isnan(ball.nominal) and ball.code < STATUS.index("singular"):
            codes[row] = STATUS.index("not_solved")  # shoulder and limbs together leave a direction free
            continue
        singular = ball.singular()
        if singular is not None:
            magnitude[row], at[row], within[row] = np.inf, middle + size * singular, True
            continue
        x, force[row], code = ball.largest()
        at[row], codes[row] = middle + size * x, code
        magnitude[row] = np.linalg.norm(force[row]) if code != STATUS.index("singular") else np.inf
        within[row] = code == STATUS.index("singular")
    shape = given.query.shape
    return WorstCase(
        "offset",
        (size,),
        magnitude.reshape(shape),
        force.reshape(*shape, 3),
        at.reshape(*shape, 3),
        nominal.reshape(shape),
        status_names(codes, within, shape),
        False,
        law.name,
    )
