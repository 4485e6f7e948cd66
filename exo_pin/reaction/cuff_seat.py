"""How the cuff sits on the arm: its pull along the arm, and how far a soft one slips and turns under its wrench."""

from __future__ import annotations

import numpy as np

from ..core.validation import FloatArray
from ..design.interface import Interface


def cuff_pull(force: FloatArray, matrices: FloatArray) -> FloatArray:
    """Force of the cuff on the arm along the arm, shape (...,), N: positive towards the hand, negative to the shoulder.

    Parameters
    ----------
    force : ndarray
        Of the cuff on the arm, shape (..., 3), N, base frame.
    matrices : ndarray
        Poses, shape (..., 3, 3).
    """
    return np.asarray(-(matrices[..., :, 2] * force).sum(axis=-1))


def cuff_slip(cuff: Interface, wrench: FloatArray, matrices: FloatArray) -> FloatArray:
    """Displacement and rotation vector of a soft cuff against the arm, shape (..., 6), m and rad, arm frame.

    Of first order: stiffness against the wrench of a rigid cuff that stays where it is. Both grow beyond that as the
    cuff moves; the split "elastic" finds the equilibrium of the displaced device.

    Parameters
    ----------
    cuff : Interface
        Its stiffness, at a point of the arm frame.
    wrench : ndarray
        Of the cuff on the arm, shape (..., 6): force, N, and moment about O, N m, base frame.
    matrices : ndarray
        Poses, shape (..., 3, 3).
    """
    force, moment = (np.einsum("...ji,...j->...i", matrices, part) for part in np.split(wrench, 2, axis=-1))
    about = moment - np.cross(np.asarray(cuff.at), force)
    return np.asarray(np.concatenate([force, about], axis=-1) @ cuff.compliance.T)
