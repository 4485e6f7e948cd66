"""Couplings of joints' positions: their arrays, and their rows of residual, Jacobian and its rate, compiled.

A coupling joins hinges or slides a and b by a polynomial, as a gear, a rack or a mimic joint does:

    residual  q_b - r_b - p(q_a - r_a),   p(x) = c_0 + c_1 x + ... + c_4 x⁴

Its rate is q_b' - p'(x) q_a'. A multiplier λ makes the generalised force λ on joint b and -p'(x) λ on joint a, as
motors in the two joints would: between the two bodies of each joint. These are the rows of MuJoCo's joint equality,
whose first joint is b.

The kernels take the couplings as one array of doubles, shape (k, 12), because every further argument costs a call of a
compiled function a fifth of a microsecond. Its columns: the constraint row; joint a's index in q and in v, -1 where
there is no joint a; joint b's; r_a, r_b, c_0 to c_4, m and rad.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ...core.compiled import kernel
from ...core.errors import InvalidInput, UnknownName
from ...core.validation import FloatArray, frozen
from .closures import COEFFICIENTS, Closure

__all__ = ["couple", "couple_rates", "coupling_forces", "make_couplings", "powers", "refuse_coupling"]


#: Columns of the indices and of the polynomial.
_INDICES, _POLYNOMIAL = 5, 7


def make_couplings(model: pin.Model, closures: tuple[Closure, ...], rows: NDArray[np.int64]) -> FloatArray:
    """Find the joints of the couplings among the closures.

    Parameters
    ----------
    model : pinocchio.Model
        The tree.
    closures : tuple of Closure
        All closures.
    rows : ndarray of int
        Shape (m + 1,), first row of each closure.

    Returns
    -------
    ndarray
        Shape (k, 12), see the module.

    Raises
    ------
    UnknownName
        If a joint is not in the model.
    InvalidInput
        If a joint is no hinge or slide with one number for its position.
    """
    coupled = [(c, closure) for c, closure in enumerate(closures) if closure.polynomial is not None]
    found = np.zeros((len(coupled), _INDICES + 2 + COEFFICIENTS))
    for k, (c, closure) in enumerate(coupled):
        a = (-1, -1) if closure.frame_a == "universe" else _position(model, closure, closure.frame_a)
        found[k, :_POLYNOMIAL] = rows[c], *a, *_position(model, closure, closure.frame_b), *closure.references
        given = closure.polynomial or ()
        found[k, _POLYNOMIAL : _POLYNOMIAL + len(given)] = given
    return frozen(found)


def _position(model: pin.Model, closure: Closure, joint: str) -> tuple[int, int]:
    """Indices of a joint's position in q and in v."""
    names = list(model.names)
    if joint not in names[1:]:
        raise UnknownName("joint", joint, names[1:], where=f"closure {closure.name!r}")
    number = names.index(joint, 1)
    if model.nqs[number] != 1:
        endless = "; cosine and sine do not count turns: make it revolute" if model.nvs[number] == 1 else ""
        raise InvalidInput(
            f"closure {closure.name!r} couples joint {joint!r}, which is a {model.joints[number].shortname()}: "
            f"expected a hinge or slide whose position is one number{endless}"
        )
    return model.idx_qs[number], model.idx_vs[number]


def refuse_coupling(closure: Closure) -> None:
    """Raise InvalidInput if a closure is a coupling, where a wrench is needed."""
    if closure.polynomial is not None:
        raise InvalidInput(
            f"closure {closure.name!r} is a coupling, which transmits no wrench but a generalised force in each of its "
            "joints: see ClosedForces.coupling"
        )


def coupling_forces(couplings: FloatArray, q: FloatArray, multipliers: FloatArray, size: int) -> FloatArray:
    """Generalised forces that the couplings make in all joints, shape (nv,) with nv = ``size``, N and N m.

    Parameters
    ----------
    couplings : ndarray
        Shape (k, 12), see the module.
    q : ndarray
        Shape (nq,).
    multipliers : ndarray
        λ, shape (rows,).
    """
    jacobian = np.zeros((len(multipliers), size))
    couple(np.array(q), couplings, np.zeros(len(multipliers)), jacobian)
    return np.asarray(jacobian.T @ multipliers)


@kernel
def powers(coupling: Any, position: float) -> Any:
    """p, p' and p'' of one coupling, shape (12,), at a position of joint a, m or rad."""
    x = position - coupling[5]
    value, first, second = 0.0, 0.0, 0.0
    for k in range(11, 6, -1):
        second = second * x + 2.0 * first
        first = first * x + value
        value = value * x + coupling[k]
    return value, first, second


@kernel
def couple(q: Any, couplings: Any, gap: Any, jacobian: Any) -> None:
    """Fill the couplings' rows of the residual and of the Jacobian.

    Parameters
    ----------
    q : ndarray
        Shape (nq,).
    couplings : ndarray
        Shape (k, 12), see the module.
    gap : ndarray
        Shape (rows,).
    jacobian : ndarray
        Shape (rows, nv), zero in the couplings' rows before; or shape (0, nv), which is not filled.
    """
    for c in range(len(couplings)):
        coupling = couplings[c]
        row, q_a, v_a = int(coupling[0]), int(coupling[1]), int(coupling[2])
        value, first, _ = powers(coupling, q[q_a] if q_a >= 0 else coupling[5])
        gap[row] = q[int(coupling[3])] - coupling[6] - value
        if jacobian.shape[0] > 0:
            jacobian[row, int(coupling[4])] = 1.0
            if q_a >= 0:
                jacobian[row, v_a] = -first


@kernel
def couple_rates(q: Any, v: Any, couplings: Any, rate: Any, drift: Any) -> None:
    """Fill the couplings' rows of the Jacobian's rate, and of its product with v.

    Parameters
    ----------
    q, v : ndarray
        Shapes (nq,) and (nv,).
    couplings : ndarray
        Shape (k, 12), see the module.
    rate : ndarray
        Shape (rows, nv), zero in the couplings' rows before.
    drift : ndarray
        Shape (rows,).
    """
    for c in range(len(couplings)):
        coupling = couplings[c]
        row, q_a, v_a = int(coupling[0]), int(coupling[1]), int(coupling[2])
        if q_a >= 0:
            _, _, second = powers(coupling, q[q_a])
            rate[row, v_a] = -second * v[v_a]
            drift[row] = rate[row, v_a] * v[v_a]
