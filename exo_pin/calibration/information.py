"""How much measured lengths say about the unknowns: covariance, singular values, undetermined directions."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
import scipy

from ..core.errors import InvalidInput
from ..core.errors.checked import checked
from ..core.records import Record
from ..core.validation import FloatArray, ReadOnly, as_finite, as_real, frozen
from .length_model import LengthModel

#: Components below this part of the largest are left out of a description.
_SMALL = 0.05


@dataclass(frozen=True, eq=False)
class Undetermined(ReadOnly):
    """One direction in the unknowns that the data do not determine.

    Attributes
    ----------
    description : str
        What moves, in words.
    direction : ndarray
        Shape (p,), changes of the unknowns, largest component 1 (m or rad).
    standard_deviation : float
        Of the data alone along it, m or rad of the largest component; infinite where no length changes at all.

    Examples
    --------
    >>> from exo_pin.calibration import pose_information
    >>> exo = ep.load("three-linear-actuators")
    >>> one = pose_information(exo.pose(flexion=[30]), exo, unknowns="base_points", length_noise=1e-3)
    >>> len(one.undetermined), one.undetermined[0].standard_deviation  # nine coordinates of A_i, three lengths
    (6, inf)
    """

    description: str
    direction: FloatArray
    standard_deviation: float

    @property
    def is_exact(self) -> bool:
        """Whether no length changes along it, to first order; else noise is too large or poses are too alike."""
        return not np.isfinite(self.standard_deviation)

    def __str__(self) -> str:
        if self.is_exact:
            return self.description
        return f"{self.description} (standard deviation {1e3 * self.standard_deviation:.3g} mm or mrad)"


def _directions(model: LengthModel, space: FloatArray, deviations: FloatArray) -> tuple[Undetermined, ...]:
    """Directions that span a space of the scaled unknowns, by their largest components; exact ones first."""
    found = []
    for chosen in (~np.isfinite(deviations), np.isfinite(deviations)):
        whole, own = space[:, chosen], deviations[chosen]
        for scaled in _localised(whole).T:
            direction = scaled * model.scales
            largest = direction[np.abs(direction).argmax()]
            # Along the direction whose largest component is one.
            size = np.linalg.norm(whole.T @ scaled * own) * abs(largest) if np.isfinite(own).all() else np.inf
            found.append(Undetermined(_components_of(model, direction / largest), direction / largest, float(size)))
    return tuple(found)


def _localised(space: FloatArray) -> FloatArray:
    """The same space spanned by directions with as few components as a pivoted elimination finds."""
    if space.shape[1] == 0:
        return space
    _, _, pivots = scipy.linalg.qr(space.T, pivoting=True)
    chosen = pivots[: space.shape[1]]
    directions = space @ np.linalg.inv(space[chosen])
    return directions / np.linalg.norm(directions, axis=0)


def _components_of(model: LengthModel, parts: FloatArray) -> str:
    order = [k for k in np.argsort(-np.abs(parts)) if abs(parts[k]) > _SMALL]
    words = [f"{parts[k]:+.2g} {model.names[k]}" for k in order[:4]]
    return ", ".join(words) + (", ..." if len(order) > 4 else "")


#: Singular values below this part of the largest are zero.
_RANK = 1e-10
#: A quantity with this part of itself, or less, in undetermined directions is determined.
_TOUCHES = 1e-6
#: A direction whose standard deviation is beyond this part of the joints' distance from the centre is not determined.
_TOO_UNCERTAIN = 0.1


@checked
class Information(Record):
    """Of lengths measured in some poses, and of tolerances.

    Parameters
    ----------
    model : LengthModel
        The unknowns.
    values : ndarray
        Shape (p,), where the derivatives are taken.
    measured : ndarray
        Shape (N, 3, 3), orientations as measured.
    jacobian : ndarray
        Shape (N n, p): derivatives of the lengths, errors independent with standard deviation 1.
    variance : float
        Of these errors, if it is not 1.
    prior : ndarray
        Shape (p,): standard deviation of each unknown before any measurement; infinite if there is no tolerance.

    Examples
    --------
    >>> from exo_pin.calibration import pose_information
    >>> exo = ep.load("three-linear-actuators")
    >>> told = pose_information(exo.pose(flexion=[0, 30, 60]), exo, unknowns="length_offsets", length_noise=1e-3)
    >>> told.rank, (1e3 * told.standard_deviations).round(3)  # mm: 1 mm/√3, of three lengths each
    (3, array([0.577, 0.577, 0.577]))
    """

    def __init__(
        self,
        model: LengthModel,
        values: FloatArray,
        measured: FloatArray,
        jacobian: FloatArray,
        variance: float,
        prior: FloatArray,
    ) -> None:
        self.model, self.values, self.measured = model, values, measured
        self.prior = as_real("prior", prior)
        if self.prior.shape != (model.size,):
            raise InvalidInput(f"expected prior of shape ({model.size},), got {self.prior.shape}")
        self.variance = float(variance)
        scaled = _triangle(jacobian * model.scales)
        sizes = np.linalg.svd(scaled, compute_uv=False)
        #: Of the Jacobian, shape (p,), largest first: standard deviations of the lengths per m of a joint.
        self.singular_values = frozen(np.concatenate([sizes, np.zeros(model.size - len(sizes))]))
        self._scaled, self._noise = scaled, np.sqrt(self.variance)

    @property
    def rank(self) -> int:
        """Number of directions that the data determine."""
        return int((self.singular_values > _RANK * self.singular_values[0]).sum())

    @functools.cached_property
    def _spectrum(self) -> tuple[FloatArray, FloatArray]:
        """Standard deviation along each of p orthonormal directions of the scaled unknowns, tolerances included."""
        # Measurements without any error determine exactly what they determine, and tolerances add nothing to them.
        known = np.concatenate([self._scaled, np.diag(self._noise * self.model.scales / self.prior)])
        _, sizes, directions = np.linalg.svd(_triangle(known))
        return self._deviations(sizes), directions.T

    def _deviations(self, sizes: FloatArray) -> FloatArray:
        """Standard deviation along directions of these singular values, infinite where it is zero."""
        deviations, seen = np.full(len(sizes), np.inf), sizes > _RANK * sizes[0]
        deviations[seen] = self._noise / sizes[seen]
        return deviations

    def spread(self, rows: FloatArray) -> FloatArray:
        """Covariance of linear functions of the unknowns.

        Parameters
        ----------
        rows : ndarray
            Shape (k, p).

        Returns
        -------
        ndarray
            Shape (k, k). A function that is not determined has an infinite variance, and NaN with all others.

        Examples
        --------
        >>> from exo_pin.calibration import pose_information
        >>> exo = ep.load("three-linear-actuators")
        >>> poses = exo.pose(flexion=[0, 20, 40, 60])
        >>> told = pose_information(poses, exo, unknowns="length_offsets", length_noise=1e-3)
        >>> mean = np.full((1, 3), 1.0 / 3.0)
        >>> round(1e3 * float(np.sqrt(told.spread(mean)[0, 0])), 4)  # mm: 1 mm/√12, of the mean of the three
        0.2887
        """
        deviations, directions = self._spectrum
        open_ = ~np.isfinite(deviations)
        rows = as_finite("rows", rows, (None, len(self.model.scales)))
        along = (rows * self.model.scales) @ directions
        lost = np.linalg.norm(along[:, open_], axis=1) > _TOUCHES * np.linalg.norm(along, axis=1)
        half = along[:, ~open_] * deviations[~open_]
        covariance = half @ half.T
        covariance[lost, :] = covariance[:, lost] = np.nan
        covariance[lost, lost] = np.inf
        return frozen(covariance)

    @functools.cached_property
    def covariance(self) -> FloatArray:
        """Shape (p, p), m² and rad²; infinite variance and NaN where an unknown is not determined."""
        return self.spread(np.eye(self.model.size))

    @functools.cached_property
    def standard_deviations(self) -> FloatArray:
        """Shape (p,), m and rad; infinite where an unknown is not determined."""
        return frozen(np.sqrt(np.diag(self.covariance)))

    @functools.cached_property
    def undetermined(self) -> tuple[Undetermined, ...]:
        """What the measurements alone do not determine, or not to a tenth of the joints' distance from the centre.

        What is known but for a tolerance is none of it.
        """
        asked = self.model.asked
        _, found, directions = np.linalg.svd(self._scaled[:, asked])
        sizes = np.concatenate([found, np.zeros(len(directions) - len(found))])
        deviations = self._deviations(sizes)
        lost = deviations > _TOO_UNCERTAIN * self.model.reach
        space = np.zeros((self.model.size, int(lost.sum())))
        space[asked] = directions.T[:, lost]
        return _directions(self.model, space, deviations[lost])

    @property
    def names(self) -> tuple[str, ...]:
        """Of the unknowns."""
        return self.model.names

    def __str__(self) -> str:
        lost, poses = self.undetermined, len(self.measured)
        if lost:
            lines = [f"{poses} poses do not determine {len(lost)} of {self.model.size} directions:"]
            return "\n".join(lines + [f"  {direction}" for direction in lost])
        worst = 1e3 * float(self.standard_deviations.max())
        return f"{poses} poses determine all {self.model.size} unknowns, each to {worst:.2g} {self.model.unit}"


def _triangle(matrix: FloatArray) -> FloatArray:
    """Upper triangular matrix with the same singular values and directions of unknowns."""
    return np.asarray(scipy.linalg.qr(matrix, mode="r")[0])[: matrix.shape[1]]
