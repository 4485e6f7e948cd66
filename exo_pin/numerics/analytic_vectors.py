"""Vectors and rotation vectors by formulas that are analytic, so that complex steps give exact derivatives.

For a rotation vector v of any size, with θ = |v| and [v] the matrix of v × (Chirikjian, Stochastic Models, Information
Theory, and Lie Groups 2, 2012):

    exp [v] = 1 + sin θ/θ [v] + (1 - cos θ)/θ² [v]²      J_l = 1 + (1 - cos θ)/θ² [v] + (θ - sin θ)/θ³ [v]²

J_l times the rate of v is the angular velocity in the fixed axes.
"""

from __future__ import annotations

import math

import numpy as np

from ..core.validation import FloatArray

#: θ² below which the series is used; the first neglected term is below 1e-16 there.
_SMALL = 1e-2
#: Denominators of the series in -θ²: (2k+1)!, (2k+2)! and (2k+3)!.
_SERIES = [[float(math.factorial(2 * k + first)) for k in range(5)] for first in (1, 2, 3)]


def dot(u: FloatArray, v: FloatArray) -> FloatArray:
    """Dot products of vectors of shape (..., 3)."""
    return np.asarray(np.einsum("...i,...i->...", u, v))


def length_of(vectors: FloatArray) -> FloatArray:
    """Lengths, shape (..., 1), by a formula that is analytic, unlike a norm of absolute values."""
    return np.asarray(np.sqrt((vectors * vectors).sum(axis=-1, keepdims=True)))


def unit(vectors: FloatArray) -> FloatArray:
    """Vectors of length 1 along vectors of shape (..., 3); zero where they are zero."""
    length = length_of(vectors)
    return np.asarray(vectors / (length + (length.real == 0.0)))


def angle_about(s: FloatArray, first: FloatArray, second: FloatArray) -> FloatArray:
    """Angle about s between two unit vectors perpendicular to it, within ±π; analytic, unlike arctan2."""
    return np.asarray(2.0 * np.arctan(dot(np.cross(first, second), s) / (1.0 + dot(first, second))))


def solved(matrices: FloatArray, right: FloatArray) -> FloatArray:
    """Solutions, shape (k, m), of k systems of m equations; NaN where a matrix is not finite or singular."""
    one = np.eye(right.shape[1])
    good = np.asarray(np.isfinite(matrices).all(axis=(1, 2)))[:, None, None]
    good = good & (np.linalg.det(np.where(good, matrices, one)) != 0.0)[:, None, None]
    return np.asarray(np.linalg.solve(np.where(good, matrices, np.nan), right[..., None])[..., 0])


def turn_coefficients(square: FloatArray) -> list[FloatArray]:
    """sin θ/θ, (1 - cos θ)/θ² and (θ - sin θ)/θ³ for θ²."""
    near = square.real < _SMALL
    series = [_series(square, row) for row in _SERIES]
    if near.all():
        return series
    safe = np.where(near, 1.0, square)
    angle = np.sqrt(safe)
    closed = [np.sin(angle) / angle, (1.0 - np.cos(angle)) / safe, (angle - np.sin(angle)) / (safe * angle)]
    return [np.where(near, a, b) for a, b in zip(series, closed, strict=True)]


def _series(square: FloatArray, denominators: list[float]) -> FloatArray:
    out = np.full_like(square, 1.0 / denominators[-1])
    for denominator in denominators[-2::-1]:
        out = 1.0 / denominator - square * out
    return out


def cross_matrix(v: FloatArray) -> FloatArray:
    """[v] of v × w = [v] w, shape (..., 3, 3)."""
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def turn_matrix(v: FloatArray) -> FloatArray:
    """exp [v], shape (..., 3, 3), for rotation vectors of shape (..., 3)."""
    first, second, _ = turn_coefficients((v * v).sum(axis=-1)[..., None, None])
    cross = cross_matrix(v)
    return np.asarray(np.eye(3) + first * cross + second * (cross @ cross))


def left_jacobian(v: FloatArray) -> FloatArray:
    """J_l, shape (..., 3, 3), for rotation vectors of shape (..., 3)."""
    _, second, third = turn_coefficients((v * v).sum(axis=-1)[..., None, None])
    cross = cross_matrix(v)
    return np.asarray(np.eye(3) + second * cross + third * (cross @ cross))
