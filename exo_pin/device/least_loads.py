"""Which of the forces that equilibrium leaves open an answer has: those of least load, in an order of importance."""

from __future__ import annotations

import numpy as np

from ..core.validation import FloatArray

#: Singular value, relative to the largest, below which a motion, a self-stress or an effect is none.
NONE = 1e-9


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
