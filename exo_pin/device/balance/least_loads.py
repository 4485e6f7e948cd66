"""Which of the forces that equilibrium leaves open an answer has: those of least load, in an order of importance."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...core.validation import FloatArray
from ...numerics.rank_factors import fill_least_in_order

#: Singular value, relative to the largest, below which a motion, a self-stress or an effect is none.
NONE = 1e-9
#: Moment of the wearer, relative to the load, that is rounding.
_ROUNDING = 1e-12


def least_in_order(effects: list[FloatArray], present: list[FloatArray]) -> FloatArray:
    """Multiples of self-stresses that make each of several quantities least, the first ones first, (N, stresses, k).

    Parameters
    ----------
    effects : list of ndarray
        Of a unit of each self-stress on the quantities, shape (N, rows, stresses).
    present : list of ndarray
        The quantities without, shape (N, rows, k).
    """
    ends = np.cumsum([effect.shape[1] for effect in effects])
    found = np.empty((len(effects[0]), present[0].shape[2], effects[0].shape[2]))
    # Self-stresses are of size one. Where none reaches the arm, as behind a soft cuff, all effects are rounding.
    fill_least_in_order(np.concatenate(effects, axis=1), np.concatenate(present, axis=1), ends, NONE, found)
    return found.mT


def moments_of(rows: FloatArray) -> FloatArray:
    """Moments of efforts that leave the idle motions at rest, shape (N, 3, p), from the rows M_f, shape (N, 3 + d, p).

    The columns are those of a projection: they have the singular values of the moments, and zeros.
    """
    if rows.shape[1] == 3:
        return rows
    _, s, Vt = np.linalg.svd(rows[:, 3:], full_matrices=False)
    V = Vt.mT * (s > NONE * s.max(axis=1, initial=0.0)[:, None])[:, None]
    return np.asarray(rows[:, :3] - rows[:, :3] @ V @ V.mT)


class LeastEfforts(NamedTuple):
    """Efforts in equilibrium, poses along the first axes.

    Attributes
    ----------
    f : ndarray
        Shape (..., p), or (..., p + 3) with the wearer's moment behind the efforts.
    stress : ndarray
        Efforts that balance themselves, of the same length, columns orthonormal once divided by the scales.
    values : ndarray
        Singular values of the rows.
    """

    f: FloatArray
    stress: FloatArray
    values: FloatArray


def least_efforts(
    rows: FloatArray, load: FloatArray, rank: int, wearer: bool, scales: FloatArray | float = 1.0
) -> LeastEfforts:
    """The wearer's least moment w, then the efforts f of least norm with A f + w = m; w is in the first three rows.

    Parameters
    ----------
    rows : ndarray
        A, shape (..., r, p): three moments, then rows of idle motions.
    load : ndarray
        m, shape (..., r).
    rank : int
        Rows that efforts can meet in general; what they leave free has as many columns in every pose.
    wearer : bool
        Whether the wearer makes what they do not meet.
    scales : ndarray or float
        What each effort is divided by in the norm, shape (p,).
    """
    r, p = rows.shape[-2:]
    rank, size = min(rank, r, p), np.ones(p) * scales
    U, values, Vt = np.linalg.svd(rows * size)
    kept = values[..., :rank] > NONE * values[..., :1]
    U, V = U[..., :rank], np.swapaxes(Vt, -1, -2)
    inverse = np.divide(1.0, values[..., :rank], out=np.zeros(kept.shape), where=kept)
    efforts = size[:, None] * (V[..., :rank] * inverse[..., None, :]) @ np.swapaxes(U, -1, -2)
    stress, left = size[:, None] * V[..., rank:], load
    if wearer:
        met = U * kept[..., None, :]
        unmet = np.eye(r) - met @ np.swapaxes(met, -1, -2)
        w = (np.linalg.pinv(unmet[..., :3], rcond=NONE) @ (unmet @ load[..., None]))[..., 0]
        nothing = np.abs(w).max(axis=-1) <= _ROUNDING * np.abs(load).max(axis=-1)
        w = np.where(nothing[..., None], 0.0, w)
        left = load - np.concatenate([w, np.zeros((*w.shape[:-1], r - 3))], axis=-1)
    f = (efforts @ left[..., None])[..., 0]
    # One refinement: near a singular pose efforts are large, and their rounding would be left over as moment.
    f = f + (efforts @ (left - (rows @ f[..., None])[..., 0])[..., None])[..., 0]
    if wearer:
        f = np.concatenate([f, w], axis=-1)
        stress = np.concatenate([stress, np.zeros((*stress.shape[:-2], 3, p - rank))], axis=-2)
    return LeastEfforts(f, stress, values)
