"""Measured lengths as a function of the unknowns, with exact derivatives.

A sensor pair measures S = R_GTᵀ R_GS, the arm's sensor seen from the torso's (Figure 5-9). The arm's orientation is
R = Q_T S Q_S, with Q_T from the torso's sensor to {O_A} and Q_S from {O_B} to the arm's sensor. Of limb i

    a_i = A_i + ε_base        b_i = R (B_i + ε_cuff)        measured length = |b_i - a_i| - o_i

with A_i and B_i in the device's own frames, ε the offsets of the device's centre from the shoulder's (base frame and
arm frame) and o_i the length that the sensor leaves out: the end fittings of a muscle, the zero of an encoder.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput
from ..core.errors.base import echo
from ..core.records import Record
from ..core.validation import FloatArray, as_choice, frozen

#: What can be unknown, and what is written before its components. The unit is m, but rad of the mountings.
_SYMBOLS = {
    "base_points": "A",
    "platform_points": "B",
    "length_offsets": "length offset",
    "base_offset": "base offset",
    "cuff_offset": "cuff offset",
    "torso_mounting": "torso mounting",
    "arm_mounting": "arm mounting",
}
GROUPS = tuple(_SYMBOLS)


class Lengths(NamedTuple):
    """Measured lengths that a model predicts in N poses, n limbs, p unknowns, of devices in a stack (...).

    Attributes
    ----------
    values : ndarray
        Shape (..., N, n), m.
    by_unknowns : ndarray
        Shape (..., N, n, p): derivatives by the unknowns.
    by_orientation : ndarray
        Shape (..., N, n, 3), m/rad: derivatives by a turn of the arm about the axes of {O_A}.
    """

    values: FloatArray
    by_unknowns: FloatArray
    by_orientation: FloatArray


def as_unknowns(names: str | Iterable[str]) -> tuple[str, ...]:
    """Groups of unknowns in the order of :data:`GROUPS`.

    Raises
    ------
    InvalidInput
        If there is none, or one is unknown (:class:`exo_pin.UnknownName`).
    """
    try:
        given = (names,) if isinstance(names, str) else tuple(names)
    except TypeError:
        raise InvalidInput(f"expected unknowns as names, got {echo(names)}") from None
    found = {as_choice("quantity to calibrate", name, GROUPS) for name in given}
    if not found:
        raise InvalidInput(f"expected one unknown or more of {', '.join(GROUPS)}, got none")
    return tuple(name for name in GROUPS if name in found)


@dataclass(eq=False, repr=False)
class LengthModel(Record):
    """The equations above for one design; the vector of unknowns holds changes from its values.

    Parameters
    ----------
    base, platform : ndarray
        Shape (n, 3), m: A_i and B_i to start from.
    offsets : ndarray
        Shape (n,), m: o_i to start from.
    torso, arm : Rotation
        Q_T and Q_S to start from.
    unknowns : tuple of str
        Of :data:`GROUPS`, in their order.
    """

    base: FloatArray
    platform: FloatArray
    offsets: FloatArray
    torso: Rotation
    arm: Rotation
    unknowns: tuple[str, ...]

    def __post_init__(self) -> None:
        self.limb_count = len(self.base)
        #: Where each group stands in the vector of unknowns.
        self.places: dict[str, slice] = {}
        names, units = list[str](), list[str]()
        for name in self.unknowns:
            own = _components(name, self.limb_count)
            self.places[name] = slice(len(names), len(names) + len(own))
            names += own
            units += ["rad" if name.endswith("mounting") else "m"] * len(own)
        #: Number of unknowns p.
        self.size = len(names)
        #: Name of each unknown, such as ``"A_2 x"``, and its unit.
        self.names, self.units = tuple(names), tuple(units)
        self._torso, self._arm = self.torso.as_matrix(), self.arm.as_matrix()
        #: Mean distance of the joints from the centre, m: a turn by 1 rad moves them by this much.
        self.reach = float(np.linalg.norm(np.concatenate([self.base, self.platform]), axis=1).mean())
        #: Changes of the unknowns that move joints by about the same length.
        self.scales = frozen(np.array([1.0 / self.reach if unit == "rad" else 1.0 for unit in units]))

    @property
    def unit(self) -> str:
        """Of a thousandth of an unknown, for texts."""
        return "mm or mrad" if "rad" in self.units else "mm"

    def group(self, name: str, values: FloatArray, shape: tuple[int, ...] = (3,)) -> FloatArray:
        """Values of one group in vectors of unknowns (..., p), zero if it is not unknown."""
        stack = values.shape[:-1]
        return (
            values[..., self.places[name]].reshape(*stack, *shape) if name in self.places else np.zeros(stack + shape)
        )

    def joints(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """A_i + ε_base and B_i + ε_cuff, shape (..., n, 3) each: joints seen from the shoulder's centre."""
        shape = self.base.shape
        base, cuff = (self.group(name, values)[..., None, :] for name in ("base_offset", "cuff_offset"))
        a = self.base + self.group("base_points", values, shape) + base
        return a, self.platform + self.group("platform_points", values, shape) + cuff

    def mountings(self, values: FloatArray) -> tuple[Rotation, Rotation]:
        """Q_T and Q_S, shape (...)."""
        # SciPy takes no read-only array.
        torso, arm = (
            Rotation.from_rotvec(np.array(self.group(name, values))) for name in ("torso_mounting", "arm_mounting")
        )
        return torso * self.torso, self.arm * arm

    def length_offsets(self, values: FloatArray) -> FloatArray:
        """o_i, shape (..., n)."""
        return self.offsets + self.group("length_offsets", values, (self.limb_count,))

    def lengths(self, values: FloatArray, measured: FloatArray) -> FloatArray:
        """Lengths alone, shape (..., N, n); arguments of :meth:`evaluate`."""
        return np.asarray(self._lines(values, measured)[3] - self.length_offsets(values)[..., None, :])

    def _lines(self, values: FloatArray, measured: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """R, b_i, b_i - a_i and |b_i - a_i|."""
        a, b = self.joints(values)
        R = measured
        # In sweeps of many devices products of matrices are faster than those of Rotations.
        if "torso_mounting" in self.places:
            R = _turns(self.group("torso_mounting", values)) @ (self._torso @ R)
        else:
            R = self._torso @ R
        R = R @ self._arm
        if "arm_mounting" in self.places:
            R = R @ _turns(self.group("arm_mounting", values))
        ends = b[..., None, :, :] @ np.swapaxes(R, -2, -1)
        lines = ends - a[..., None, :, :]
        return R, ends, lines, np.sqrt((lines**2).sum(axis=-1))

    def evaluate(self, values: FloatArray, measured: FloatArray) -> Lengths:
        """Lengths and their derivatives.

        Parameters
        ----------
        values : ndarray
            Shape (..., p), the unknowns.
        measured : ndarray
            Shape (N, 3, 3), S of each pose.
        """
        R, ends, lines, lengths = self._lines(values, measured)
        b = self.joints(values)[1][..., None, :, :]
        directions = lines / lengths[..., None]
        # Of the platform's joint in {O_B}, and of a turn in {O_A} and {O_B}.
        in_arm = directions @ R
        turned = np.cross(ends, directions)
        out, limbs = np.zeros((*lengths.shape, self.size)), np.arange(self.limb_count)
        for name, place in self.places.items():
            block = out[..., place]
            if name in ("base_points", "platform_points"):
                own = -directions if name == "base_points" else in_arm
                for i in limbs:
                    block[..., i, 3 * i : 3 * i + 3] = own[..., i, :]
            elif name == "length_offsets":
                block[..., limbs, limbs] = -1.0
            elif name == "base_offset":
                block[:] = -directions
            elif name == "cuff_offset":
                block[:] = in_arm
            elif name == "torso_mounting":
                # exp(θ + dθ) = exp(J_l dθ) exp(θ), J_l(θ) = J_r(-θ).
                block[:] = turned @ _right_jacobians(-self.group(name, values))
            else:
                block[:] = np.cross(b, in_arm) @ _right_jacobians(self.group(name, values))
        return Lengths(lengths - self.length_offsets(values)[..., None, :], out, turned)


def _turns(turns: FloatArray) -> FloatArray:
    """Matrices of rotation vectors (..., 3), shape (..., 1, 3, 3)."""
    return Rotation.from_rotvec(np.array(turns)).as_matrix()[..., None, :, :]


def _right_jacobians(turns: FloatArray) -> FloatArray:
    """J_r of rotation vectors (..., 3), shape (..., 1, 3, 3)."""
    return np.array([pin.Jexp3(turn) for turn in turns.reshape(-1, 3)]).reshape(*turns.shape[:-1], 1, 3, 3)


def labels(name: str, count: int) -> list[str]:
    """What a group consists of, for ``count`` limbs: points, numbers, or one vector."""
    symbol = _SYMBOLS[name]
    if name.endswith("points"):
        return [f"{symbol}_{i + 1}" for i in range(count)]
    if name == "length_offsets":
        return [f"{symbol} {i + 1}" for i in range(count)]
    return [symbol]


def _components(name: str, count: int) -> list[str]:
    parts = labels(name, count)
    return parts if name == "length_offsets" else [f"{part} {axis}" for part in parts for axis in "xyz"]
