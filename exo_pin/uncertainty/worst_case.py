"""The largest shoulder force over uncertain quantities: the record, and the stiffness of the shoulder."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput
from ..core.results import Result
from ..core.validation import FloatArray, as_positive
from ..design import Mechanism
from ..load_case import CentreOffset, Load, Motion
from ..load_case.pose_stacks import Query, arm_loads, as_query, require_massless
from ..wrist.forces.displaced import Displaced, as_offset
from ..wrist.limbs import STATUS
from .linear_splits import LINEAR_NOTE

__all__ = ["Loaded", "WorstCase", "loaded", "status_names", "worst_stiffness"]

#: Status of a pose besides the names of :data:`exo_pin.wrist.limbs.STATUS`.
SINGULAR_WITHIN = "singular_within"
#: Points per decade of stiffness at which the search starts.
_PER_DECADE = 16


@dataclass(frozen=True, eq=False)
class WorstCase(Result):
    """The largest |F_s| over the range of an uncertain quantity, for a pose or a stack of shape (...).

    Attributes
    ----------
    quantity : {"offset", "stiffness"}
        The uncertain quantity.
    limits : tuple of float
        Its range: (radius,) in m, or (least, largest) stiffness in N/m.
    magnitude : ndarray
        Worst |F_s|, shape (...), N: infinite where the range contains a singular configuration, at which the forces
        grow without bound; NaN without an answer.
    shoulder_force : ndarray
        F_s in the worst case, shape (..., 3), N, of the shoulder on the arm, base frame; NaN where infinite.
    at : ndarray
        Place of the worst case: the offset, shape (..., 3), m, or the stiffness, shape (...), N/m.
        Where the magnitude is infinite it is the singular configuration itself; an offset of that kind is the nearest
        to the centre of the ball that was found.
    nominal : ndarray
        |F_s| at the centre of the ball, or at the least stiffness, shape (...), N.
    status : ndarray of str
        Shape (...): as :attr:`Reaction.status`, or "singular_within".
    exact : bool
        Whether the answer is the largest for certain, or the best of a search.
    split : {"spherical", "elastic_linear"}
        Split of F_s; the second is the elastic formula for small displacements.
    """

    quantity: str
    limits: tuple[float, ...]
    magnitude: FloatArray
    shoulder_force: FloatArray
    at: FloatArray
    nominal: FloatArray
    status: NDArray[np.str_]
    exact: bool
    split: str = "elastic_linear"

    def __str__(self) -> str:
        return self._statement() + (f" {LINEAR_NOTE}" if self.split == "elastic_linear" else "")

    def _statement(self) -> str:
        found = "largest" if self.exact else "largest found"
        if self.magnitude.ndim:
            within = int((self.status == SINGULAR_WITHIN).sum())
            finite = self.magnitude[np.isfinite(self.magnitude)]
            peak = f"{finite.max():.2f} N" if finite.size else "none"
            return (
                f"Worst case over {self._set()}: {self.magnitude.size} poses, {found} finite |F_s| {peak}; "
                f"{within} with a singular configuration within, where the forces grow without bound."
            )
        if np.isinf(self.magnitude):
            return (
                f"Over {self._set()} the shoulder force has no bound: a singular configuration lies at "
                f"{self._place()}. "
                + ("There is no nominal force." if np.isnan(self.nominal) else f"Nominal |F_s| {self.nominal:.2f} N.")
            )
        if np.isnan(self.magnitude):
            return f"No worst case over {self._set()}: the pose is {self.status}."
        return (
            f"Over {self._set()} the {found} |F_s| is {float(self.magnitude):.2f} N, at {self._place()}; "
            f"nominal {float(self.nominal):.2f} N."
        )

    def _set(self) -> str:
        if self.quantity == "offset":
            return f"all centre offsets within {1e3 * self.limits[0]:g} mm"
        return f"all shoulder stiffnesses from {self.limits[0]:g} to {self.limits[1]:g} N/m"

    def _place(self) -> str:
        if self.quantity == "stiffness":
            return f"K_s = {float(self.at):.4g} N/m"
        return f"offset ({', '.join(f'{1e3 * v:.2f}' for v in self.at)}) mm"


class Loaded(NamedTuple):
    """A stack of N poses of a mechanism with the load on limbs and shoulder.

    Attributes
    ----------
    query : Query
        The poses.
    force, moment : ndarray
        Shape (N, 3), N and N m about O, base frame.
    """

    query: Query
    force: FloatArray
    moment: FloatArray

    def one(self, row: int, count: int) -> Loaded:
        """The pose of one row, ``count`` times."""

        def repeated(array: FloatArray) -> FloatArray:
            return np.repeat(array[row : row + 1], count, axis=0)

        query = Query((count,), *(repeated(array) for array in self.query[1:]))
        return Loaded(query, repeated(self.force), repeated(self.moment))

    def displaced(self, mechanism: Mechanism, base: FloatArray, cuff: FloatArray) -> Displaced:
        """Equilibrium with the device's centre at the given offsets, shape (N, 3), m."""
        return Displaced(mechanism, self.query, base, cuff, self.force, self.moment)


def loaded(mechanism: Mechanism, orientation: Rotation, motion: Motion | None, load: Load | None) -> Loaded:
    """Check and broadcast a query for the closed forms.

    Raises
    ------
    MissingData
        If there is no arm, or ``motion`` is given and the arm has no inertia.
    InvalidInput
        If a limb has mass, or the stacks do not fit.
    """
    require_massless(mechanism)
    if motion is not None:
        mechanism.require_arm("motion", inertia=True)
    query = as_query(orientation, motion, load)
    force, moment, _ = arm_loads(mechanism.require_arm("weight"), mechanism.gravity, query)
    return Loaded(query, force, moment)


def status_names(codes: NDArray[np.int8], within: NDArray[np.bool_], shape: tuple[int, ...]) -> NDArray[np.str_]:
    """Names of status codes, with "singular_within" where it is so."""
    names = np.array([*STATUS, SINGULAR_WITHIN])
    return names[np.where(within, len(STATUS), codes)].reshape(shape)


def worst_stiffness(
    mechanism: Mechanism,
    orientation: Rotation,
    least: float,
    largest: float,
    motion: Motion | None = None,
    load: Load | None = None,
    centre_offset: CentreOffset | ArrayLike = (0.0, 0.0, 0.0),
) -> WorstCase:
    """Largest |F_s| over all shoulders equally stiff in every direction, by the linear elastic formula.

    Without an offset |F_s| never falls with the stiffness κ: F_s = -κ (κ 1 + K_X)⁻¹ N, and κ / (κ + λ) grows in each
    principal direction of K_X. In the displaced geometry the side forces also load the tensions, their matrix is not
    symmetric, and |F_s| can peak in between, or grow without bound where κ 1 + K_X is singular: those κ are the
    negative eigenvalues of K_X, and are searched among them.

    Parameters
    ----------
    mechanism : Mechanism
        With massless limbs; its own shoulder stiffness does not enter.
    orientation : Rotation
        Single or a stack of shape (...).
    least, largest : float
        N/m, both above zero.
    motion, load, centre_offset
        As :meth:`exo_pin.ShoulderExo.reaction`.

    Returns
    -------
    WorstCase
        ``exact`` without an offset.

    Raises
    ------
    InvalidInput
        If a limit is not positive, ``least`` is above ``largest``, or a limb has mass.
    """
    low, high = as_positive("least", least), as_positive("largest", largest)
    if low > high:
        raise InvalidInput(f"expected least not above largest, got {low:g} and {high:g} N/m")
    given = loaded(mechanism, orientation, motion, load)
    base, cuff = as_offset(centre_offset, given.query.shape)
    state = given.displaced(mechanism, base, cuff)
    centred = not (base.any() or cuff.any())
    whole, target = state.elastic_system(np.zeros((3, 3)))
    count, eye = len(whole), np.eye(3)
    magnitude, at, nominal = np.full(count, np.nan), np.full(count, np.nan), np.full(count, np.nan)
    force = np.full((count, 3), np.nan)
    within = np.zeros(count, dtype=bool)
    points = max(int(_PER_DECADE * np.log10(high / low)) + 2, 2)
    grid = np.array([high]) if centred or low == high else np.geomspace(low, high, points)
    for row in np.flatnonzero(state.status < STATUS.index("singular")).tolist():
        K_X, N = whole[row], target[row]

        def shoulder(kappa: FloatArray, K_X: FloatArray = K_X, N: FloatArray = N) -> FloatArray:
            system = np.asarray(kappa)[..., None, None] * eye + K_X
            return (
                -np.asarray(kappa)[..., None]
                * np.linalg.solve(system, np.broadcast_to(N, (*kappa.shape, 3))[..., None])[..., 0]
            )

        loss = -np.linalg.eigvals(K_X)
        lost = np.sort(
            loss.real[(np.abs(loss.imag) <= 1e-12 * np.abs(loss)) & (low <= loss.real) & (loss.real <= high)]
        )
        if lost.size and N.any():
            magnitude[row], at[row], within[row] = np.inf, lost[0], True
            continue
        sizes = np.linalg.norm(shoulder(grid), axis=-1)
        best = int(sizes.argmax())
        kappa = grid[best]
        if 0 < best < len(grid) - 1:
            around = np.log(grid[[best - 1, best + 1]])
            kappa = np.exp(
                scipy.optimize.minimize_scalar(
                    lambda t: -float(np.linalg.norm(shoulder(np.exp(np.array(t))))), bounds=around, method="bounded"
                ).x
            )
        force[row] = shoulder(np.array(kappa))
        magnitude[row], at[row] = np.linalg.norm(force[row]), kappa
        nominal[row] = np.linalg.norm(shoulder(np.array(low)))
    shape = given.query.shape
    return WorstCase(
        "stiffness",
        (low, high),
        magnitude.reshape(shape),
        force.reshape(*shape, 3),
        at.reshape(shape),
        nominal.reshape(shape),
        status_names(state.status, within, shape),
        centred,
    )
