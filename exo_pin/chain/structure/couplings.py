"""Couplings of joints' positions: their arrays, and their rows of residual, Jacobian and its rate, compiled.

A coupling joins hinges or slides a and b by a polynomial, as a gear, a rack or a mimic joint does:

    residual  q_b - r_b - p(q_a - r_a),   p(x) = c_0 + c_1 x + ... + c_4 x⁴

Its rate is q_b' - p'(x) q_a'. A multiplier λ makes the generalised force λ on joint b and -p'(x) λ on joint a, as
motors in the two joints would: between the two bodies of each joint. These are the rows of MuJoCo's joint equality,
whose first joint is b.

The kernels take k couplings as two arrays. ``coupled``, shape (k, 5): the constraint row; joint a's index in q and in
v, -1 where there is no joint a; joint b's. ``polynomials``, shape (k, 7): r_a, r_b, c_0 to c_4, m and rad.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ...core.compiled import kernel
from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_choice, frozen
from .closures import COEFFICIENTS, Closure


def make_couplings(
    model: pin.Model, closures: tuple[Closure, ...], rows: NDArray[np.int64]
) -> tuple[NDArray[np.int64], FloatArray]:
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
    tuple of ndarray
        Indices, shape (k, 5), and polynomials, shape (k, 7), see the module.

    Raises
    ------
    UnknownName
        If a joint is not in the model.
    InvalidInput
        If a joint is no hinge or slide with one number for its position.
    """
    given = [(c, closure) for c, closure in enumerate(closures) if closure.polynomial is not None]
    coupled, polynomials = np.empty((len(given), 5), dtype=np.int64), np.zeros((len(given), 2 + COEFFICIENTS))
    for k, (c, closure) in enumerate(given):
        a = (-1, -1) if closure.frame_a == "universe" else _position(model, closure, closure.frame_a)
        coupled[k] = rows[c], *a, *_position(model, closure, closure.frame_b)
        numbers = closure.polynomial or ()
        polynomials[k, : 2 + len(numbers)] = *closure.references, *numbers
    return frozen(coupled), frozen(polynomials)


def _position(model: pin.Model, closure: Closure, joint: str) -> tuple[int, int]:
    """Indices of a joint's position in q and in v."""
    names = list(model.names)
    as_choice("joint", joint, names[1:], f"closure {closure.name!r}")
    number = names.index(joint, 1)
    if model.nqs[number] != 1:
        endless = "; cosine and sine do not count turns: make it revolute" if model.nvs[number] == 1 else ""
        raise InvalidInput(
            f"closure {closure.name!r} couples joint {joint!r}, which is a {model.joints[number].shortname()}: "
            f"expected a hinge or slide whose position is one number{endless}"
        )
    return model.idx_qs[number], model.idx_vs[number]


@kernel(fills=True)
def powers(polynomial: Any, position: float) -> Any:
    """p, p' and p'' of one coupling, r_a to c_4, shape (7,), at a position of joint a, m or rad."""
    x = position - polynomial[0]
    value, first, second = 0.0, 0.0, 0.0
    for k in range(6, 1, -1):
        second = second * x + 2.0 * first
        first = first * x + value
        value = value * x + polynomial[k]
    return value, first, second


@kernel(fills=True)
def couple(q: Any, coupled: Any, polynomials: Any, gap: Any, jacobian: Any) -> None:
    """Fill the couplings' rows of the residual and of the Jacobian.

    Parameters
    ----------
    q : ndarray
        Shape (nq,).
    coupled, polynomials : ndarray
        The couplings, see the module.
    gap : ndarray
        Shape (rows,).
    jacobian : ndarray
        Shape (rows, nv), zero in the couplings' rows before; or shape (0, nv), which is not filled.
    """
    for c in range(len(coupled)):
        row, q_a, v_a = coupled[c, 0], coupled[c, 1], coupled[c, 2]
        value, first, _ = powers(polynomials[c], q[q_a] if q_a >= 0 else polynomials[c, 0])
        gap[row] = q[coupled[c, 3]] - polynomials[c, 1] - value
        if jacobian.shape[0] > 0:
            jacobian[row, coupled[c, 4]] = 1.0
            if q_a >= 0:
                jacobian[row, v_a] = -first


@kernel(fills=True)
def couple_rates(q: Any, v: Any, coupled: Any, polynomials: Any, rate: Any, drift: Any) -> None:
    """Fill the couplings' rows of the Jacobian's rate, and of its product with v.

    Parameters
    ----------
    q, v : ndarray
        Shapes (nq,) and (nv,).
    coupled, polynomials : ndarray
        The couplings, see the module.
    rate : ndarray
        Shape (rows, nv), zero in the couplings' rows before.
    drift : ndarray
        Shape (rows,).
    """
    for c in range(len(coupled)):
        row, q_a, v_a = coupled[c, 0], coupled[c, 1], coupled[c, 2]
        if q_a >= 0:
            _, _, second = powers(polynomials[c], q[q_a])
            rate[row, v_a] = -second * v[v_a]
            drift[row] = rate[row, v_a] * v[v_a]


@kernel(fills=True)
def couple_rate_change(q: Any, v: Any, u: Any, w: Any, coupled: Any, polynomials: Any, drift: Any) -> None:
    """Fill the couplings' rows of the change of J̇ v along u while v changes by w; see :func:`couple_rates`."""
    for c in range(len(coupled)):
        row, q_a, v_a = coupled[c, 0], coupled[c, 1], coupled[c, 2]
        drift[row] = 0.0
        if q_a >= 0:
            third = 6.0 * polynomials[c, 5] + 24.0 * polynomials[c, 6] * (q[q_a] - polynomials[c, 0])
            _, _, second = powers(polynomials[c], q[q_a])
            drift[row] = -(third * u[v_a] * v[v_a] + 2.0 * second * w[v_a]) * v[v_a]
