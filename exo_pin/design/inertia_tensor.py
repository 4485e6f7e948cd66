"""Inertia tensors that a body can have."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import InvalidInput
from ..core.validation import FloatArray, as_finite, frozen


def as_inertia(name: str, value: ArrayLike, asymmetry: float = 1e-6) -> FloatArray:
    """Return an inertia tensor that some body can have.

    Parameters
    ----------
    name : str
        Name of the argument, for the message.
    value : array_like
        Shape (3, 3), in kg m², about the centre of mass.
    asymmetry : float
        Largest difference between mirrored entries, relative to the largest entry, that is taken for
        rounding and averaged away. A larger one is an error.

    Returns
    -------
    ndarray
        Shape (3, 3), symmetric, read-only.

    Raises
    ------
    InvalidInput
        If it is not symmetric, has a negative principal moment, or breaks the triangle inequality
        (no principal moment exceeds the sum of the other two).
    """
    tensor = as_finite(name, value, (3, 3))
    scale = float(np.abs(tensor).max())
    if scale == 0.0:
        return tensor
    gap = float(np.abs(tensor - tensor.T).max())
    if gap > asymmetry * scale:
        raise InvalidInput(f"expected {name} to be symmetric, mirrored entries differ by {gap:.3g} kg m²")
    tensor = 0.5 * (tensor + tensor.T)
    principal = np.linalg.eigvalsh(tensor)
    slack = 1e-9 * scale
    if principal[0] < -slack:
        raise InvalidInput(
            f"expected {name} to be an inertia that a body can have: principal moment {principal[0]:.4g} kg m² "
            "is negative (products of inertia printed by CAD programs have the opposite sign)"
        )
    if principal[2] > principal[0] + principal[1] + slack:
        raise InvalidInput(
            f"expected {name} to be an inertia that a body can have: principal moments {principal} kg m² "
            "break the triangle inequality"
        )
    return frozen(tensor)
