"""Readings of the example of Scenario One, Section 4.2.2: the way from six angles back to the orientation."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import product

import numpy as np

from ..core.validation import FloatArray
from .scenario_one import PRINTED_MATRICES

__all__ = ["scenario_one_readings"]

#: mm, as printed.
_A_1, _A_3 = (0.0, -29.825, 51.658), (44.7371, -29.825, -25.83)
_A_2 = [(-44.7371, y, z) for y in (-29.825, -25.829) for z in (-25.83, 86.43, -86.43, 51.658)]
_B_1 = [(0.0, y, -86.43) for y in (94.9, 51.658)]
_B_2 = [(x, -25.829, -86.43) for x in (-44.7371, 44.7371)]
_B_3 = (44.7371, -25.829, -86.43)
#: Entries of the third matrix that lost their signs, in both states.
_SIGNS = tuple(product((1.0, -1.0), repeat=2))
_LENGTHS = [(159.5270, 41.6830, 108.7461), (159.5270, 41.6830, 108.741)]


def _arctan(R: FloatArray) -> list[float]:
    """(4-22) as printed."""
    return [np.arctan(-R[1, 2] / R[2, 2]), np.arcsin(np.clip(R[0, 2], -1, 1)), np.arctan(-R[0, 1] / R[0, 0])]


def _arctan2(R: FloatArray, cosine: float) -> list[float]:
    """In the right quadrants, with cos θy."""
    return [np.arctan2(-R[1, 2], R[2, 2]), np.arctan2(R[0, 2], cosine), np.arctan2(-R[0, 1], R[0, 0])]


def _by_row(R: FloatArray) -> list[float]:
    return _arctan2(R, np.hypot(R[0, 0], R[0, 1]))


def _by_column(R: FloatArray) -> list[float]:
    return _arctan2(R, np.hypot(R[1, 2], R[2, 2]))


def _nearest(R: FloatArray) -> list[float]:
    """Of the nearest rotation."""
    U, _, V = np.linalg.svd(R)
    return _arctan(U @ np.diag([1.0, 1.0, np.linalg.det(U @ V)]) @ V)


_EXTRACTIONS: dict[str, Callable[[FloatArray], list[float]]] = {
    "(4-22)": _arctan, "by the first row": _by_row, "by the last column": _by_column, "nearest rotation": _nearest,
}  # fmt: skip


def scenario_one_readings() -> Iterator[tuple[str, FloatArray]]:
    """Name and (θx, θy, θz), degrees, of each reading."""
    points = product(_A_2, _B_1, _B_2, _LENGTHS, _SIGNS, (2, 1, 0), (None, 2), (1.0, -1.0))
    for A_2, B_1, B_2, lengths, signs, column, decimals, sign in points:
        A, B = np.array([_A_1, A_2, _A_3]), np.array([B_1, B_2, _B_3])
        if abs(np.linalg.det(B)) < 1e-6:
            continue
        matrices = PRINTED_MATRICES.copy()
        matrices[2, 0, 1] *= signs[0]
        matrices[2, 2, 2] *= signs[1]
        directions = matrices[:, :, column] if decimals is None else matrices[:, :, column].round(decimals)
        R = np.linalg.solve(B, A + sign * np.array(lengths)[:, None] * directions).T
        name = (
            f"A_2 {A_2}, B_1 {B_1}, B_2 {B_2}, l_3 {lengths[2]}, signs {signs}, column {column + 1}, "
            f"{'all' if decimals is None else decimals} decimals, sign {sign:+.0f}"
        )
        for turned, matrix in (("R", R), ("R transposed", R.T)):
            for how, angles in _EXTRACTIONS.items():
                yield f"{name}, {turned}, {how}", np.degrees(angles(matrix))
