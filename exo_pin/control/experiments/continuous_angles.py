"""Euler angles of a movement without jumps: of the two triples of each sample the one nearer to the sample before.

R = R_1(α) R_2(β) R_3(γ) about three different axes has the triples (α, β, γ) and (α + π, π - β, γ + π), and each angle
may be a turn more or less. Where β = ±90° only a sum or difference of α and γ is determined, and α stays.
"""

from __future__ import annotations

import numpy as np

from ...core.validation import FloatArray

#: |cos β| below which the angles lock.
_LOCKED = 1e-6


def continuous_angles(angles: FloatArray, locked_sum: float) -> FloatArray:
    """Angles of samples of a movement, each near those of the sample before.

    Parameters
    ----------
    angles : ndarray
        Shape (N, 3), rad: α, β, γ of each sample.
    locked_sum : float
        1 if α + γ is what is determined at β = 90° (and α - γ at -90°), -1 if it is α - γ.

    Returns
    -------
    ndarray
        Shape (N, 3), rad; the first sample as it is.
    """
    found = np.array(angles)
    for k in range(1, len(found)):
        before, (first, middle, last) = found[k - 1], found[k]
        if abs(np.cos(middle)) < _LOCKED:
            side = locked_sum * np.sign(np.sin(middle))
            first, last = before[0], last + side * (first - before[0])
        triples = np.array([[first, middle, last], [first + np.pi, np.pi - middle, last + np.pi]])
        triples -= 2.0 * np.pi * np.round((triples - before) / (2.0 * np.pi))
        found[k] = triples[np.abs(triples - before).sum(axis=1).argmin()]
    return found
