"""Side force with play: a guide that rattles by c_i across its line before it carries anything.

Displacements are taken to be small, as in :mod:`exo_pin.reaction.splits.elastic_linear`. With the elongation e_i =
X_i · δ + misfit_i of limb i in the sense of its side wrench,

    g_i = k_i dead(e_i, c_i),    dead(e, c) = e - c for e > c,  e + c for e < -c,  0 between.

A limb is free or touches on one of two sides, so that n guided limbs have 3^n states; in each of them everything is
linear. Without an offset the strain energy is convex and exactly one state fits its own answer. All are tried, which is
a few small systems in one stack, and needs no iteration that could fail.

In a state F_s is affine in the plays of the limbs that touch, and the plays that belong to the state form a polytope.
|F_s| is convex there, so that it is largest at a corner: the worst play is found among the corners of all states, for
certain, and need not be a corner of the box [0, c_max]ⁿ.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput
from ..core.validation import FloatArray, as_finite
from ..design import Mechanism
from ..load_case import CentreOffset, Load, Motion
from ..reaction.splits.elastic_linear import shoulder_stiffness
from ..wrist.forces.displaced import Displaced, as_offset
from ..wrist.limbs import STATUS
from .worst_case import WorstCase, loaded, status_names

__all__ = ["side_forces_with_play", "worst_clearance"]

#: Guided limbs beyond which the states are too many to try.
_MOST_LIMBS = 5
#: Rounding that a state may miss its own conditions by, relative to the largest elongation or play.
_SLACK = 1e-9


def side_forces_with_play(
    state: Displaced, stiffness: FloatArray, play: ArrayLike
) -> tuple[FloatArray, FloatArray, NDArray[np.int64]]:
    """Side forces and displacement of the joint's centre where the guides have play.

    Parameters
    ----------
    state : Displaced
        N poses.
    stiffness : ndarray
        K_s, shape (3, 3), N/m.
    play : array_like
        c_i, m, to either side; broadcasts to (N, n).

    Returns
    -------
    g, delta : ndarray
        Shape (N, n), N, and (N, 3), m; NaN where no state fits: a pose without an answer.
    fitting : ndarray of int
        Shape (N,): how many different answers fit. More than one can come with an offset, where the energy is not
        convex; the one of least |F_s| stands.

    Raises
    ------
    InvalidInput
        If a play is negative, or more than five limbs are guided.
    """
    plays = np.broadcast_to(as_finite("play", play, (), stack=True), state.f0.shape)
    if (plays < 0.0).any():
        raise InvalidInput(f"expected play to be zero or more, got {play!r:.80}")
    g, delta = np.full_like(state.f0, np.nan), np.full_like(state.shoulder, np.nan)
    fitting = np.zeros(len(g), dtype=np.int64)
    for row in np.flatnonzero(state.status < STATUS.index("singular")).tolist():
        one = _Row(state, row, stiffness)
        c = plays[row, one.limbs]
        found: list[tuple[float, FloatArray, FloatArray]] = []
        for sign in one.states:
            solved = one.solve(sign)
            if solved is None:
                continue
            offset, slope = solved
            d = offset + slope @ (sign * c)
            e = one.sides @ d + one.misfit
            slack = _SLACK * max(float(np.abs(e).max(initial=0.0)), float(c.max(initial=0.0)))
            if (np.where(sign == 0.0, c - np.abs(e), sign * e - c) >= -slack).all():
                pull = one.k * (e - sign * c) * (sign != 0.0)
                if not any(np.allclose(d, other, rtol=1e-7, atol=1e-15) for _, other, _ in found):
                    found.append((float(np.linalg.norm(stiffness @ d)), d, pull))
        if found:
            fitting[row] = len(found)
            _, delta[row], pull = min(found, key=lambda item: item[0])
            g[row] = 0.0
            g[row, one.limbs] = pull
    return g, delta, fitting


def worst_clearance(
    mechanism: Mechanism,
    orientation: Rotation,
    largest_play: ArrayLike,
    motion: Motion | None = None,
    load: Load | None = None,
    centre_offset: CentreOffset | ArrayLike = (0.0, 0.0, 0.0),
) -> WorstCase:
    """Largest |F_s| of the elastic split over all plays of the guides.

    Parameters
    ----------
    mechanism : Mechanism
        With massless limbs, guides and a shoulder stiffness.
    orientation : Rotation
        Single or a stack of shape (...).
    largest_play : array_like
        m, of every limb or shape (n,): each c_i may be anything from zero to this, to either side of the limb's line.
    motion, load, centre_offset
        As :meth:`exo_pin.ShoulderExo.reaction`.

    Returns
    -------
    WorstCase
        Exact, by enumeration of the corners. Limbs without stiffness play no part; their play is given as zero.

    Raises
    ------
    MissingData
        If the shoulder's stiffness is not known.
    InvalidInput
        If a play is negative, more than five limbs are guided, or a limb has mass.
    """
    given = loaded(mechanism, orientation, motion, load)
    stiffness, n = shoulder_stiffness(mechanism), mechanism.limb_count
    limit = as_finite("largest_play", largest_play, (), stack=True)
    if limit.shape not in ((), (1,), (n,)) or (limit < 0.0).any() or (limit > 0.1).any():
        raise InvalidInput(f"expected largest_play of 0 to 0.1 m, one number or {n}, got {largest_play!r:.80}")
    limit = np.broadcast_to(limit, (n,))
    base, cuff = as_offset(centre_offset, given.query.shape)
    state = given.displaced(mechanism, base, cuff)
    g, delta, _ = side_forces_with_play(state, stiffness, 0.0)
    count = len(g)
    magnitude, nominal = np.full(count, np.nan), np.linalg.norm(delta @ stiffness, axis=1)
    force, at = np.full((count, 3), np.nan), np.full((count, n), np.nan)
    codes = state.status.copy()
    codes[(codes < STATUS.index("singular")) & np.isnan(nominal)] = STATUS.index("not_solved")
    for row in np.flatnonzero(codes < STATUS.index("singular")).tolist():
        one = _Row(state, row, stiffness)
        best, corner = one.worst_corner(limit[one.limbs])
        force[row], at[row] = -stiffness @ best, 0.0
        at[row, one.limbs] = corner
        magnitude[row] = np.linalg.norm(force[row])
    shape = given.query.shape
    return WorstCase(
        "clearance",
        tuple(limit.tolist()),
        magnitude.reshape(shape),
        force.reshape(*shape, 3),
        at.reshape(*shape, n),
        nominal.reshape(shape),
        status_names(codes, np.zeros(count, dtype=bool), shape),
        True,
    )


class _Row:
    """The states of one pose."""

    def __init__(self, state: Displaced, row: int, stiffness: FloatArray) -> None:
        side = state.side
        self.limbs = np.flatnonzero(side.stiffness[row] > 0.0)
        if self.limbs.size > _MOST_LIMBS:
            raise InvalidInput(f"expected at most {_MOST_LIMBS} guided limbs with play, got {self.limbs.size}")
        self.k, self.misfit = side.stiffness[row, self.limbs], side.misfit[row, self.limbs]
        self.sides, self.shoulder = side.forces[row, self.limbs], state.shoulder[row]
        self.of_g, self.stiffness = state.shoulder_of_g[row][:, self.limbs], stiffness
        self.states = np.array(list(itertools.product((0.0, 1.0, -1.0), repeat=self.limbs.size)))

    def solve(self, sign: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        """δ = offset + slope (sign · c) in a state, shapes (3,) and (3, n); None where a direction stays free."""
        pushed = self.of_g * (self.k * (sign != 0.0))
        whole = self.stiffness + pushed @ self.sides
        if not np.linalg.cond(whole) < 1e12:
            return None
        answer = np.linalg.solve(whole, np.column_stack([-self.shoulder - pushed @ self.misfit, pushed]))
        return answer[:, 0], answer[:, 1:]

    def worst_corner(self, limit: FloatArray) -> tuple[FloatArray, FloatArray]:
        """δ with the largest |K_s δ|, and the plays that it comes with."""
        best, worst, corner = -1.0, np.zeros(3), np.zeros(len(limit))
        for sign in self.states:
            solved = self.solve(sign)
            if solved is None:
                continue
            touching = np.flatnonzero(sign)
            corners = self._corners(sign, touching, solved, limit)
            if not len(corners):
                continue
            d = solved[0] + (corners * sign[touching]) @ solved[1][:, touching].T
            sizes = np.linalg.norm(d @ self.stiffness, axis=1)
            k = int(sizes.argmax())
            if sizes[k] > best:
                best, worst = float(sizes[k]), d[k]
                corner = limit.copy()  # a free limb needs play to be free
                corner[touching] = np.clip(corners[k], 0.0, limit[touching])
        return worst, corner

    def _corners(
        self, sign: FloatArray, touching: NDArray[np.intp], solved: tuple[FloatArray, FloatArray], limit: FloatArray
    ) -> FloatArray:
        """Corners of the plays of the touching limbs that belong to a state, shape (k, m): A c <= b."""
        m = len(touching)
        free = np.flatnonzero(sign == 0.0)
        constant = self.sides @ solved[0] + self.misfit
        slope = self.sides @ solved[1][:, touching] * sign[touching]
        eye = np.eye(m)
        A = np.concatenate([eye, -eye, eye - sign[touching, None] * slope[touching], slope[free], -slope[free]])
        b = np.concatenate(
            [limit[touching], np.zeros(m), sign[touching] * constant[touching],
             limit[free] - constant[free], limit[free] + constant[free]]
        )  # fmt: skip
        slack = _SLACK * max(float(np.abs(b).max(initial=0.0)), float(limit.max(initial=0.0)))
        if m == 0:
            return np.zeros((1 if (b >= -slack).all() else 0, 0))
        chosen = np.array(list(itertools.combinations(range(len(A)), m)))
        systems, sides = A[chosen], b[chosen]
        regular = np.linalg.cond(systems) < 1e10
        corners = np.linalg.solve(systems[regular], sides[regular][..., None])[..., 0]
        return np.asarray(corners[(corners @ A.T <= b + slack).all(axis=1)])
