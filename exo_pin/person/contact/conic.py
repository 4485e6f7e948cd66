"""Small convex cone programs, solved by Clarabel and checked here.

    min ½ xᵀP x + qᵀx   subject to   A x + s = b,   s in a product of cones.

Clarabel is an interior-point solver. Whatever it reports, an answer counts by its own residuals: of the constraints, of
stationarity, and the duality gap, which together prove it optimal.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from ...core.errors import MissingExtra
from ...core.records import OneProcess
from ...core.validation import FloatArray

#: Residual and duality gap of an accepted answer, in a program scaled to numbers of order 1.
ACCEPTED = 1e-7
#: What Clarabel aims at, first and second time: residuals, gap and regularisation. Its default regularisation of 1e-8
#: limits the gap to about 1e-7 where the socket's rim is touched.
_AIMS = ((1e-9, 1e-11, 1e-12), (1e-8, 1e-9, 1e-8))


class Block(NamedTuple):
    """Rows A x + s = b with s in one cone.

    Attributes
    ----------
    cone : {"zero", "positive", "second_order", "cube"}
        s = 0; s >= 0; s_0 >= |(s_1, ...)|; or s = (t, 1, a) with a³ <= t, a >= 0, for three rows.
    A, b : ndarray
        Shape (k, n) and (k,).
    """

    cone: str
    A: FloatArray
    b: FloatArray


class ConicAnswer(NamedTuple):
    """Answer of a program.

    Attributes
    ----------
    x : ndarray
        Shape (n,).
    active : list of ndarray of bool
        For each block of rows: whether its constraint holds with equality; one number for a cone of several rows.
    kkt : float
        Largest violation of constraints and stationarity.
    gap : float
        Duality gap.
    is_optimal : bool
        Whether both are small enough.
    is_infeasible : bool
        Whether the solver has found a proof that no x meets the constraints.
    """

    x: FloatArray
    active: list[NDArray[np.bool_]]
    kkt: float
    gap: float
    is_optimal: bool
    is_infeasible: bool


class ConicProgram(OneProcess):
    """A program that is built block by block.

    Parameters
    ----------
    P : ndarray
        Shape (n, n), symmetric positive semi-definite.
    q : ndarray
        Shape (n,).

    Raises
    ------
    MissingExtra
        If Clarabel is not installed.
    """

    def __init__(self, P: FloatArray, q: FloatArray) -> None:
        try:
            import clarabel
        except ImportError as error:
            raise MissingExtra("person", "clarabel") from error
        self._clarabel, self._P, self._q = clarabel, P, q
        self._blocks: list[Block] = []

    def add(self, cone: str, A: FloatArray, b: FloatArray) -> None:
        """Add rows."""
        self._blocks.append(Block(cone, A, b))

    def solve(self) -> ConicAnswer:
        """Solve it. An infeasible program gives an answer whose ``is_optimal`` is False."""
        answer = self._solve(_AIMS[0])
        return answer if answer.is_optimal or answer.is_infeasible else self._solve(_AIMS[1])

    def _solve(self, aim: tuple[float, float, float]) -> ConicAnswer:
        A = np.vstack([block.A for block in self._blocks])
        b = np.concatenate([block.b for block in self._blocks])
        solver = self._clarabel.DefaultSolver(
            scipy.sparse.csc_matrix(np.triu(self._P)),
            self._q,
            scipy.sparse.csc_matrix(A),
            b,
            [self._cone(block) for block in self._blocks],
            _settings(self._clarabel, aim),
        )
        found = solver.solve()
        x, z, s = (np.array(part) for part in (found.x, found.z, found.s))
        # Where the solver has diverged its numbers are as large as they can be, and the answer is not optimal.
        with np.errstate(over="ignore", invalid="ignore"):
            pull = self._P @ x
            gap = abs(float(x @ pull + self._q @ x + b @ z))
            kkt = max(float(np.abs(A @ x + s - b).max()), float(np.abs(pull + self._q + A.T @ z).max()))
            size = max(1.0, abs(float(0.5 * x @ pull + self._q @ x)))
        solved = str(found.status) in ("Solved", "AlmostSolved", "InsufficientProgress")
        finite = bool(np.isfinite(kkt + gap))
        optimal = solved and finite and max(kkt, gap / size) <= ACCEPTED
        return ConicAnswer(x, self._active(s, z), kkt, gap, optimal, str(found.status) == "PrimalInfeasible")

    def _active(self, s: FloatArray, z: FloatArray) -> list[NDArray[np.bool_]]:
        """By strict complementarity: the multiplier is larger than the room."""
        found, start = [], 0
        for block in self._blocks:
            rows = slice(start, start + len(block.b))
            start = rows.stop
            room, push = s[rows], z[rows]
            if block.cone == "second_order":
                room, push = np.array([room[0] - np.linalg.norm(room[1:])]), push[:1]
            found.append(np.asarray(push > room))
        return found

    def _cone(self, block: Block) -> Any:
        clarabel, rows = self._clarabel, len(block.b)
        if block.cone == "cube":
            return clarabel.PowerConeT(1.0 / 3.0)
        kinds = {"zero": "ZeroConeT", "positive": "NonnegativeConeT", "second_order": "SecondOrderConeT"}
        return getattr(clarabel, kinds[block.cone])(rows)


def _settings(clarabel: Any, aim: tuple[float, float, float]) -> Any:
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    settings.tol_feas, settings.tol_gap_abs, settings.static_regularization_constant = aim
    settings.tol_gap_rel = settings.tol_gap_abs
    return settings
