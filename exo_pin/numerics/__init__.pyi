from .active_set import LeastForces as LeastForces
from .active_set import least_forces as least_forces
from .optimality import KKT_TOLERANCE as KKT_TOLERANCE
from .optimality import RANK_TOLERANCE as RANK_TOLERANCE
from .optimality import LeastSquares as LeastSquares
from .optimality import Solution as Solution
from .optimality import judged as judged
from .quadratic import solve as solve
