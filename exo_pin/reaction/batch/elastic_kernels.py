"""Stiffness of limbs against side forces, and the forces that follow from stiffness, for one pose, compiled.

Centres of device and shoulder coincide here. The side force of a limb is then a pure force along X_i through O. Let
platform and arm be displaced by δ at O: the limb answers with g_i = k_i X_iᵀ δ (it pulls the arm with -g_i X_i), the
ball joint with F_s = -K_s δ. Equilibrium with N, the force at O of load and tensions, gives

    δ = (K_s + K_X)⁻¹ N,    K_X = Σ k_i X_i X_iᵀ,    N = F - Σ f_i s_i.

Of all g and F_s that balance N these have the least strain energy ½ Σ g_i²/k_i + ½ F_sᵀ K_s⁻¹ F_s.

For speed these formulas of aligned centres are written apart from those for any offset, which ``exo.reaction`` uses
(:mod:`exo_pin.wrist.forces.side_forces`, :mod:`exo_pin.wrist.forces.affine_state`): tests/reaction/batch checks one by
the other.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...core.compiled import kernel
from ...core.errors import InvalidInput
from ...core.errors.base import echo
from ...core.validation import FloatArray, as_finite
from ...design import Mechanism
from ...numerics.vectors import dot, vector
from ..splits.elastic_linear import shoulder_stiffness as shoulder_stiffness_of

__all__ = ["Elasticity", "elastic_forces", "side_stiffness"]

#: Pivot, relative to the largest stiffness, below which a direction has no stiffness.
_NO_STIFFNESS = 1e-14


class Elasticity(NamedTuple):
    """Stiffness of guides and shoulder.

    Attributes
    ----------
    guides : ndarray
        Shape (n, 4), a row a limb: bending rigidity EI and torsional rigidity GJ of its guide, N m²; stiffness of each
        of its universal joints against displacement across the limb, N/m, and against the couple across both of its
        axes, N m/rad (both may be infinite). A row of zeros is a bare muscle.
    shoulder : ndarray
        K_s, shape (3, 3), N/m, base frame.
    """

    guides: FloatArray
    shoulder: FloatArray

    @classmethod
    def of_mechanism(cls, mechanism: Mechanism) -> Elasticity:
        """The design's own guides and shoulder.

        Raises
        ------
        MissingData
            If the shoulder's stiffness is not known.
        """
        guides = np.zeros((mechanism.limb_count, 4))
        guides[:, 2:] = np.inf
        for row, limb in zip(guides, mechanism.limbs, strict=True):
            own = limb.guide
            if own is not None:
                row[:] = (own.bending_rigidity, own.torsional_rigidity, own.joint_stiffness, own.joint_twist_stiffness)
        return cls(guides, shoulder_stiffness_of(mechanism))

    @classmethod
    def of(
        cls,
        bending_rigidity: ArrayLike,
        torsional_rigidity: ArrayLike,
        shoulder_stiffness: ArrayLike,
        joint_stiffness: ArrayLike = math.inf,
        joint_twist_stiffness: ArrayLike = math.inf,
        limb_count: int = 3,
    ) -> Elasticity:
        """Check values and repeat those that are the same for all limbs.

        Parameters
        ----------
        bending_rigidity, torsional_rigidity : array_like
            EI and GJ, a number or shape (n,), N m².
        shoulder_stiffness : array_like
            K_s, shape (3, 3), or a number for the same in every direction, N/m.
        joint_stiffness, joint_twist_stiffness : array_like
            Of each universal joint, a number or shape (n,), N/m and N m/rad.
        limb_count : int
            n.

        Raises
        ------
        InvalidInput
            If a stiffness is negative or NaN, a rigidity infinite, or K_s not symmetric and positive semi-definite.
        """
        guides = np.empty((limb_count, 4))
        for column, (name, value) in enumerate(
            {
                "bending_rigidity": bending_rigidity,
                "torsional_rigidity": torsional_rigidity,
                "joint_stiffness": joint_stiffness,
                "joint_twist_stiffness": joint_twist_stiffness,
            }.items()
        ):
            try:
                guides[:, column] = value
            except (TypeError, ValueError):
                raise InvalidInput(f"expected {name} to be a number or of shape ({limb_count},)") from None
            if not (guides[:, column] >= 0.0).all():
                raise InvalidInput(f"expected {name} to be zero or more, got {echo(value)}")
        if np.isinf(guides[:, :2]).any():
            raise InvalidInput("expected finite bending and torsional rigidities")
        if np.ndim(shoulder_stiffness) == 0:
            shoulder_stiffness = float(as_finite("shoulder_stiffness", shoulder_stiffness, ())) * np.eye(3)
        K = as_finite("shoulder_stiffness", shoulder_stiffness, (3, 3))
        size = float(np.abs(K).max())
        if np.abs(K - K.T).max() > 1e-9 * size or np.linalg.eigvalsh(K)[0] < -1e-9 * size:
            raise InvalidInput("expected shoulder_stiffness to be symmetric and positive semi-definite")
        return cls(guides, 0.5 * (K + K.T))


@kernel(inline=True)
def side_stiffness(a: Any, b: Any, s: Any, length: float, reach: float, guide: Any) -> float:
    """k_i, N/m: 1/k = h² l / GJ + [(b·s)³ - (a·s)³] / (3 EI), with the compliance of the universal joints in series.

    The side force g at O makes the couples g |a| and g |b| across the universal joints at A_i and B_i, (D-18): between
    them the limb is twisted by g h and bent by g times the distance from the foot of O's perpendicular. ``a``, ``b``
    and ``s`` are tuples, ``guide`` is a row of :class:`Elasticity`'s ``guides``. Zero without rigidity against
    bending, or against a twist that there is.
    """
    bending, torsion, across, couple = guide[0], guide[1], guide[2], guide[3]
    if bending == 0.0 or across == 0.0 or couple == 0.0 or (torsion == 0.0 and reach > 0.0):
        return 0.0
    compliance = (dot(b, s) ** 3 - dot(a, s) ** 3) / (3.0 * bending)
    if reach > 0.0:
        compliance += reach * reach * length / torsion
    compliance += 2.0 / across + (dot(a, a) + dot(b, b)) / couple
    return 1.0 / compliance


@kernel(inline=True)
def elastic_forces(X: Any, k: Any, shoulder_stiffness: Any, g: Any, shoulder: Any) -> bool:
    """Replace F_s at g = 0, which is -N, by F_s of the elastic equilibrium, and fill g.

    Parameters
    ----------
    X, k : ndarray
        X_i, shape (n, 3), and k_i, shape (n,), N/m, zero for a limb that carries no side force.
    shoulder_stiffness : ndarray
        K_s, shape (3, 3), N/m.
    g, shoulder : ndarray
        Shapes (n,) and (3,), N, written.

    Returns
    -------
    bool
        False if neither shoulder nor limbs are stiff in some direction.
    """
    n = X.shape[0]
    K = shoulder_stiffness
    k00, k01, k02, k11, k12, k22 = K[0, 0], K[0, 1], K[0, 2], K[1, 1], K[1, 2], K[2, 2]
    for i in range(n):
        x, y, z = vector(X, i)
        k00, k01, k02 = k00 + k[i] * x * x, k01 + k[i] * x * y, k02 + k[i] * x * z
        k11, k12, k22 = k11 + k[i] * y * y, k12 + k[i] * y * z, k22 + k[i] * z * z
    least = _NO_STIFFNESS * max(k00, k11, k22)
    # L D Lᵀ of the symmetric sum, with N = -shoulder on the right.
    if not k00 > least:
        return False
    l10, l20 = k01 / k00, k02 / k00
    d1, e12 = k11 - l10 * k01, k12 - l10 * k02
    if not d1 > least:
        return False
    l21 = e12 / d1
    d2 = k22 - l20 * k02 - l21 * e12
    if not d2 > least:
        return False
    y0, y1, y2 = -shoulder[0], -shoulder[1], -shoulder[2]
    y1 -= l10 * y0
    y2 -= l20 * y0 + l21 * y1
    z = y2 / d2
    y = y1 / d1 - l21 * z
    x = y0 / k00 - l10 * y - l20 * z
    for i in range(n):
        g[i] = k[i] * (X[i, 0] * x + X[i, 1] * y + X[i, 2] * z)
    for j in range(3):
        shoulder[j] = -(K[j, 0] * x + K[j, 1] * y + K[j, 2] * z)
    return True
