"""Which of the forces that equilibrium leaves open an answer has: those of least load, in an order of importance."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...core.validation import FloatArray

#: Singular value, relative to the largest, below which a motion, a self-stress or an effect is none.
NONE = 1e-9
#: Moment of the wearer, relative to the load, that is rounding.
_ROUNDING = 1e-12


def couple_at(wrenches: FloatArray, point: FloatArray) -> FloatArray:
    """Couple of wrenches about O, shape (6, k), at a point; zero along a route."""
    if np.isnan(point[0]):
        return np.zeros((3, wrenches.shape[1]))
    return np.asarray(wrenches[3:] - np.cross(point, wrenches[:3], axisa=0, axisb=0, axisc=0))


def least_in_order(effects: list[FloatArray], present: list[FloatArray]) -> FloatArray:
    """Multiples of self-stresses that make each of several quantities least, the first ones first, (stresses, k).

    Parameters
    ----------
    effects : list of ndarray
        Of a unit of each self-stress on the quantities, shape (rows, stresses).
    present : list of ndarray
        The quantities without, shape (rows, k).
    """
    count, width = effects[0].shape[1], present[0].shape[1]
    found, null = np.zeros((count, width)), np.eye(count)
    # Self-stresses are of size one. Where none reaches the arm, as behind a soft cuff, all effects are rounding.
    scale = max(1.0, *(float(np.abs(effect).max(initial=0.0)) for effect in effects))
    for effect, value in zip(effects, present, strict=True):
        if not null.shape[1]:
            break
        U, s, Vt = np.linalg.svd(effect @ null)
        rank = int((s > NONE * scale).sum())
        found = found - null @ (Vt[:rank].T / s[:rank]) @ (U[:, :rank].T @ (value + effect @ found))
        null = null @ Vt[rank:].T
    return found


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
