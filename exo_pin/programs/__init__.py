"""Small convex quadratic programs with ProxSuite, answered to rounding and with what makes the answer optimal."""

from .optimality import KKT_TOLERANCE, RANK_TOLERANCE, LeastSquares, Solution, judged
from .quadratic import solve

__all__ = ["KKT_TOLERANCE", "RANK_TOLERANCE", "LeastSquares", "Solution", "judged", "solve"]
