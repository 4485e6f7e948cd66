"""Couplings of joints' positions: their arrays, and their rows of residual, Jacobian and its rate, compiled.

A coupling joins hinges or slides a and b by a polynomial, as a gear, a rack or a mimic joint does:

    residual  q_b - r_b - p(q_a - r_a),   p(x) = c_0 + c_1 x + ... + c_4 x⁴

Its rate is q_b' - p'(x) q_a'. A multiplier λ makes the generalised force λ on joint b and -p'(x) λ on joint a, as
motors in the two joints would: between the two bodies of each joint. These are the rows of MuJoCo's joint equality,
whose first joint is b.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ...core.compiled import kernel
from ...core.errors import InvalidInput, UnknownName
from ...core.records import reduced_tuple
from ...core.validation import FloatArray, frozen
from .closures import COEFFICIENTS, Closure

__all__ = ["Couplings", "couple", "couple_rates", "coupling_forces", "make_couplings", "powers", "refuse_coupling"]


class Couplings(NamedTuple):
    """The couplings of a chain as arrays, k of them.

    Attributes
    ----------
    indices : ndarray of int
        Shape (k, 5): the constraint row; joint a's index in q and in v, -1 where there is no joint a; joint b's.
    polynomial : ndarray
        Shape (k, 7): r_a, r_b, c_0 to c_4, m and rad.
    """

    indices: NDArray[np.int64]
    polynomial: FloatArray

    def __reduce__(self) -> tuple[Any, ...]:
        return reduced_tuple(self)


def make_couplings(model: pin.Model, closures: tuple[Closure, ...], rows: NDArray[np.int64]) -> Couplings:
    """Find the joints of the couplings among the closures.

    Parameters
    ----------
    model : pinocchio.Model
        The tree.
    closures : tuple of Closure
        All closures.
    rows : ndarray of int
        Shape (m + 1,), first row of each closure.

    Raises
    ------
    UnknownName
        If a joint is not in the model.
    InvalidInput
        If a joint is no hinge or slide with one number for its position.
    """
    coupled = [(c, closure) for c, closure in enumerate(closures) if closure.polynomial is not None]
    index = np.full((len(coupled), 5), -1, dtype=np.int64)
    polynomial = np.zeros((len(coupled), 2 + COEFFICIENTS))
    for k, (c, closure) in enumerate(coupled):
        index[k, 0] = rows[c]
        if closure.frame_a != "universe":
            index[k, 1:3] = _position(model, closure, closure.frame_a)
        index[k, 3:] = _position(model, closure, closure.frame_b)
        given = closure.polynomial or ()
        polynomial[k, :2], polynomial[k, 2 : 2 + len(given)] = closure.references, given
    return Couplings(frozen(index), frozen(polynomial))


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


def coupling_forces(couplings: Couplings, q: FloatArray, multipliers: FloatArray, size: int) -> FloatArray:
    """Generalised forces that the couplings make in all joints, shape (nv,) with nv = ``size``, N and N m.

    Parameters
    ----------
    couplings : Couplings
        The couplings.
    q : ndarray
        Shape (nq,).
    multipliers : ndarray
        λ, shape (rows,).
    """
    jacobian = np.zeros((len(multipliers), size))
    couple(np.array(q), couplings, np.zeros(len(multipliers)), jacobian)
    return np.asarray(jacobian.T @ multipliers)


@kernel
def powers(polynomial: Any, position: float) -> Any:
    """p, p' and p'' of one coupling at a position of joint a, m or rad; ``polynomial`` is a row of the arrays."""
    x = position - polynomial[0]
    value, first, second = 0.0, 0.0, 0.0
    for k in range(6, 1, -1):
        second = second * x + 2.0 * first
        first = first * x + value
        value = value * x + polynomial[k]
    return value, first, second


@kernel
def couple(q: Any, couplings: Any, gap: Any, jacobian: Any) -> None:
    """Fill the couplings' rows of the residual and of the Jacobian.

    Parameters
    ----------
    q : ndarray
        Shape (nq,).
    couplings : Couplings
        The couplings.
    gap : ndarray
        Shape (rows,).
    jacobian : ndarray
        Shape (rows, nv), zero in the couplings' rows before; or shape (0, nv), which is not filled.
    """
    index, polynomial = couplings.indices, couplings.polynomial
    for c in range(len(index)):
        row, q_a, v_a = index[c, 0], index[c, 1], index[c, 2]
        value, first, _ = powers(polynomial[c], q[q_a] if q_a >= 0 else polynomial[c, 0])
        gap[row] = q[index[c, 3]] - polynomial[c, 1] - value
        if jacobian.shape[0] > 0:
            jacobian[row, index[c, 4]] = 1.0
            if q_a >= 0:
                jacobian[row, v_a] = -first


@kernel
def couple_rates(q: Any, v: Any, couplings: Any, rate: Any, drift: Any) -> None:
    """Fill the couplings' rows of the Jacobian's rate, and of its product with v.

    Parameters
    ----------
    q, v : ndarray
        Shapes (nq,) and (nv,).
    couplings : Couplings
        The couplings.
    rate : ndarray
        Shape (rows, nv), zero in the couplings' rows before.
    drift : ndarray
        Shape (rows,).
    """
    index, polynomial = couplings.indices, couplings.polynomial
    for c in range(len(index)):
        row, q_a, v_a = index[c, 0], index[c, 1], index[c, 2]
        if q_a >= 0:
            _, _, second = powers(polynomial[c], q[q_a])
            rate[row, v_a] = -second * v[v_a]
            drift[row] = rate[row, v_a] * v[v_a]
