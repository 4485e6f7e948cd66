"""Forces in a device as affine functions of its drives' efforts f and of what equilibrium does not determine, g.

    M_f f = m                     virtual work of every motion: three that turn the arm, and idle ones that are held
    F_s = s_0 + S_f f + S_g g     force of the shoulder on the arm
    w_c = w_0c + w_fc f + w_gc g  wrench of the device on the arm at each of its attachments

f is in N or N m, as the drives are; g in N: the columns of S_g are unit vectors, so that g_j is a force on the shoulder
that the device's structure can exert without any drive. At g = 0 the device puts no couple on the arm that equilibrium
does not ask for, about the middle of the cuff, as a cuff that is soft against turning does; of several such states it
is the one of least force there. Where the chain does not say where its cuff is, the couples and forces at the single
attachments are made least, which is g = 0 of UPU limbs.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...core.records import reduced_tuple
from ...core.validation import FloatArray

__all__ = []

#: Singular value, relative to the largest, below which a motion, a self-stress or an effect is none.
NONE = 1e-9
#: Moment of the wearer, relative to the load, that is rounding.
_ROUNDING = 1e-12


class DeviceState(NamedTuple):
    """Forces of N poses as affine functions of f, shape (p,), and g, of the same shape; base frame, moments about O.

    Attributes
    ----------
    moment_of_f, moment_of_g : ndarray
        M_f and M_g, shape (N, 3 + d, p). M_g is zero, because what equilibrium does not determine does no work, but off
        the centre of limbs that resist their twist. The first three rows are moments about O, the d others of idle
        motions on which drives or brakes act (scaled, N m a unit of effort).
    moment : ndarray
        m, shape (N, 3 + d), N m.
    forces : ndarray
        In a row, shape (N, 3 + 6 c + 6): s_0, N; w_0 of the c attachments on the arm, force in N and moment in N m; and
        in the same way the wrench of the device on the torso.
    forces_of_f, forces_of_g : ndarray
        Their change per unit of f and g, shape (N, 9 + 6 c, p).
    """

    moment_of_f: FloatArray
    moment_of_g: FloatArray
    moment: FloatArray
    forces: FloatArray
    forces_of_f: FloatArray
    forces_of_g: FloatArray

    def __reduce__(self) -> tuple[Any, ...]:
        return reduced_tuple(self)

    @classmethod
    def zeros(cls, count: int, efforts: int, attachments: int, held: int = 0) -> DeviceState:
        """Of N poses, to be filled, with rows for ``held`` idle motions."""
        rows, size = (count, 3 + held), (count, 9 + 6 * attachments)
        of_f, of_g = np.zeros((*rows, efforts)), np.zeros((*rows, efforts))
        every = np.zeros(size), np.zeros((*size, efforts)), np.zeros((*size, efforts))
        return cls(of_f, of_g, np.zeros(rows), *every)

    @property
    def shoulder(self) -> FloatArray:
        """s_0, shape (N, 3), N."""
        return self.forces[..., :3]

    @property
    def shoulder_of_f(self) -> FloatArray:
        """S_f, shape (N, 3, p)."""
        return self.forces_of_f[..., :3, :]

    @property
    def shoulder_of_g(self) -> FloatArray:
        """S_g, shape (N, 3, p)."""
        return self.forces_of_g[..., :3, :]

    @property
    def attached_of_f(self) -> FloatArray:
        """Change of the wrenches of the attachments on the arm per unit of f, shape (N, c, 6, p)."""
        own = self.forces_of_f[..., 3:-6, :]
        return own.reshape(*own.shape[:-2], own.shape[-2] // 6, 6, own.shape[-1])

    def count_sides_in_newton(self, count: int) -> None:
        """Count the first forces g, which are moments in limbs, by the forces that they put on the shoulder, 1 N."""
        size = np.linalg.norm(self.shoulder_of_g[..., :count], axis=1)[:, None]
        for part in (self.moment_of_g, self.forces_of_g):
            part[..., :count] /= np.where(size > 0.0, size, 1.0)

    def row(self, k: int) -> DeviceState:
        """Pose k of a stack."""
        return DeviceState(*(part[k] for part in self))

    def shoulder_force(self, f: FloatArray, g: FloatArray) -> FloatArray:
        """F_s, shape (N, 3), N."""
        return np.asarray(
            self.shoulder + (self.shoulder_of_f @ f[..., None] + self.shoulder_of_g @ g[..., None])[..., 0]
        )

    def all_forces(self, f: FloatArray, g: FloatArray) -> FloatArray:
        """Those of :attr:`forces` with f and g."""
        return np.asarray(self.forces + (self.forces_of_f @ f[..., None] + self.forces_of_g @ g[..., None])[..., 0])

    def wrenches(self, f: FloatArray, g: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Wrenches of the attachments on the arm, shape (N, c, 6), and of the device on the torso, shape (N, 1, 6)."""
        every = self.all_forces(f, g)[:, 3:].reshape(len(f), self.forces.shape[1] // 6, 6)
        return every[:, :-1], every[:, -1:]

    def on_arm_of(self, f: FloatArray, g: FloatArray) -> FloatArray:
        """Change of those on the arm with f and g."""
        return self._replace(forces=np.zeros_like(self.forces)).wrenches(f, g)[0]


def moments_of(rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Moments of efforts that leave the idle motions at rest, shape (N, 3, p), from the rows M_f, shape (N, 3 + d, p).

    The columns are those of a projection: they have the singular values of the moments, and zeros. The singular values
    of the idle rows are returned as well.
    """
    _, s, Vt = np.linalg.svd(rows[:, 3:], full_matrices=False)
    V = Vt.mT * (s > NONE * s[:, :1])[:, None]
    return rows[:, :3] - rows[:, :3] @ V @ V.mT, s


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
