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
from numpy.typing import NDArray

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
    shoulder : ndarray
        s_0, shape (N, 3), N.
    shoulder_of_f, shoulder_of_g : ndarray
        S_f and S_g, shape (N, 3, p).
    attached : ndarray
        w_0, shape (N, c, 6), N and N m.
    attached_of_f, attached_of_g : ndarray
        Its change per unit of f and g, shape (N, c, 6, p).
    standing, standing_of_f, standing_of_g : ndarray
        Wrench of the device on the torso in the same way, shapes (N, 1, 6) and (N, 1, 6, p).
    """

    moment_of_f: FloatArray
    moment_of_g: FloatArray
    moment: FloatArray
    shoulder: FloatArray
    shoulder_of_f: FloatArray
    shoulder_of_g: FloatArray
    attached: FloatArray
    attached_of_f: FloatArray
    attached_of_g: FloatArray
    standing: FloatArray
    standing_of_f: FloatArray
    standing_of_g: FloatArray

    def __reduce__(self) -> tuple[Any, ...]:
        return reduced_tuple(self)

    @classmethod
    def zeros(cls, count: int, efforts: int, attachments: int, held: int = 0) -> DeviceState:
        """Of N poses, to be filled, with rows for ``held`` idle motions."""
        each = np.zeros((count, 3 + held, efforts)), np.zeros((count, 3 + held, efforts))
        where = [
            np.zeros((count, places, 6, *more)) for places in (attachments, 1) for more in ((), (efforts,), (efforts,))
        ]
        moment, shoulder = np.zeros((count, 3 + held)), np.zeros((count, 3))
        of_f, of_g = np.zeros((count, 3, efforts)), np.zeros((count, 3, efforts))
        return cls(*each, moment, shoulder, of_f, of_g, *where)

    def count_sides_in_newton(self, count: int) -> None:
        """Count the first forces g, which are moments in limbs, by the forces that they put on the shoulder, 1 N."""
        size = np.linalg.norm(self.shoulder_of_g[..., :count], axis=1)
        size = np.where(size > 0.0, size, 1.0)
        for part in (self.moment_of_g, self.shoulder_of_g, self.attached_of_g, self.standing_of_g):
            part[..., :count] /= size.reshape(len(size), *[1] * (part.ndim - 2), count)

    def forget_loads(self, k: NDArray[np.intp]) -> None:
        """Mark what the loads of some poses make as not known; what forces f and g make of it stays."""
        for part in (self.moment, self.shoulder, self.attached, self.standing):
            part[k] = np.nan

    def row(self, k: int) -> DeviceState:
        """Pose k of a stack."""
        return DeviceState(*(part[k] for part in self))

    def shoulder_force(self, f: FloatArray, g: FloatArray) -> FloatArray:
        """F_s, shape (N, 3), N."""
        return np.asarray(
            self.shoulder + (self.shoulder_of_f @ f[..., None] + self.shoulder_of_g @ g[..., None])[..., 0]
        )

    def wrenches(self, f: FloatArray, g: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Wrenches of the attachments on the arm, shape (N, c, 6), and of the device on the torso, shape (N, 1, 6)."""
        of_f, of_g = (
            np.einsum("ncip,np->nci", part, force) for part, force in ((self.standing_of_f, f), (self.standing_of_g, g))
        )
        return self.attached + self.on_arm_of(f, g), self.standing + of_f + of_g

    def on_arm_of(self, f: FloatArray, g: FloatArray) -> FloatArray:
        """Change of those on the arm with f and g."""
        return np.asarray(
            np.einsum("ncip,np->nci", self.attached_of_f, f) + np.einsum("ncip,np->nci", self.attached_of_g, g)
        )


def moments_of(rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Moments of efforts that leave the idle motions at rest, shape (N, 3, p), from the rows M_f, shape (N, 3 + d, p).

    The columns are those of a projection: they have the singular values of the moments, and zeros. The singular values
    of the idle rows are returned as well.
    """
    _, s, Vt = np.linalg.svd(rows[:, 3:], full_matrices=False)
    if not s.size:
        return rows[:, :3], s
    V = Vt.mT * (s > NONE * s.max(axis=1, initial=0.0)[:, None])[:, None]
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
