"""Which poses to measure: how much a set of them says, and sets that say most."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput
from ..core.errors.base import echo
from ..core.errors.checked import checked
from ..core.validation import FloatArray, as_count, as_positive, frozen, require_method
from .calibrate_device import JOINTS, nominal_model, prior_of
from .information import Information, whitening
from .length_model import LengthModel
from .plausibility import as_poses

if TYPE_CHECKING:
    from ..exo.shoulder_exo import ShoulderExo

#: Tolerance of the unknowns, m, as long as too few poses are chosen to determine them.
_LOOSE = 0.05
#: A pose is exchanged if the criterion gains this part of itself.
_GAIN = 1e-9
_MOST_PASSES = 20


@checked
def pose_information(
    poses: Rotation,
    nominal: ShoulderExo,
    *,
    unknowns: str | Iterable[str] = JOINTS,
    length_noise: float,
    orientation_noise: float = 0.0,
    tolerances: Mapping[str, float] | None = None,
    torso_mounting: Rotation | None = None,
    arm_mounting: Rotation | None = None,
) -> Information:
    """How much lengths measured in these poses would say about the unknowns.

    Arguments as in :func:`exo_pin.calibrate`; ``poses`` are as the sensors would measure them.

    Parameters
    ----------
    poses : Rotation
        Stack of shape (N,).
    nominal : ShoulderExo
        The design as drawn.
    unknowns, length_noise, orientation_noise, tolerances, torso_mounting, arm_mounting
        As there.

    Returns
    -------
    Information
        With singular values, covariance and undetermined directions; it prints.

    Examples
    --------
    >>> from exo_pin.calibration import pose_information
    >>> exo = ep.load("three-linear-actuators")
    >>> one = pose_information(exo.pose(flexion=[30]), exo, length_noise=1e-3)
    >>> one.rank, len(one.names)  # three lengths cannot determine the places of six joints
    (3, 18)
    """
    require_method("nominal", nominal, "inverse_kinematics", "a ShoulderExo")
    model, measured = nominal_model(nominal, unknowns, torso_mounting, arm_mounting), as_poses(poses).as_matrix()
    jacobian = _whitened(model, measured, length_noise, orientation_noise).reshape(-1, model.size)
    prior = prior_of(model, tolerances, length_noise)
    return Information(model, np.zeros(model.size), measured, jacobian, 1.0, prior)


def suggest_poses(
    nominal: ShoulderExo,
    count: int,
    candidates: Rotation,
    *,
    unknowns: str | Iterable[str] = JOINTS,
    length_noise: float,
    orientation_noise: float = 0.0,
    tolerances: Mapping[str, float] | None = None,
) -> NDArray[np.intp]:
    """Choose the poses whose measurement determines the unknowns best.

    The sum of the variances of all unknowns is made least, a turn counted by how far it moves the joints (A-optimal).
    Poses are added one by one, the best first, and then exchanged for others as long as that helps. No pose is chosen
    twice. Where something cannot be determined in principle, it is left aside.

    Parameters
    ----------
    nominal : ShoulderExo
        The design.
    count : int
        Number of poses.
    candidates : Rotation
        Stack of shape (...), poses that can be taken, such as those of a grid that are ``inside`` a
        :meth:`workspace <exo_pin.ShoulderExo.workspace>`.
    unknowns, length_noise, orientation_noise, tolerances
        As in :func:`exo_pin.calibrate`.

    Returns
    -------
    ndarray
        Shape (count,), rising: indices of the candidates (flattened) to measure. :func:`pose_information` of these says
        what measurements there would determine.

    Raises
    ------
    InvalidInput
        If there are fewer candidates than poses.

    Examples
    --------
    >>> from exo_pin.calibration import suggest_poses
    >>> exo = ep.load("three-linear-actuators")
    >>> grid = exo.pose(flexion=[0, 20, 40, 60, 80], abduction=[40, 30, 20, 10, 0])
    >>> suggest_poses(exo, 2, grid, unknowns="length_offsets", length_noise=1e-3, orientation_noise=0.01)
    array([0, 2])
    """
    require_method("nominal", nominal, "inverse_kinematics", "a ShoulderExo")
    count = as_count("count", count, 1)
    poses = as_poses(candidates)
    if count > len(poses):
        raise InvalidInput(f"expected count from 1 to the number of candidates, {len(poses)}, got {echo(count)}")
    model = nominal_model(nominal, unknowns)
    prior = prior_of(model, tolerances, length_noise)
    rows = _whitened(model, poses.as_matrix(), length_noise, orientation_noise) * model.scales
    # Before any pose the unknowns are known to a loose tolerance.
    start = np.diag((model.scales / np.minimum(prior, _LOOSE * model.scales)) ** 2)
    search = _Search(rows, start)
    return frozen(np.sort(search.exchanged(search.first(count))))


def _whitened(model: LengthModel, measured: FloatArray, length_noise: float, orientation_noise: float) -> FloatArray:
    """Derivatives of the lengths over their errors, shape (N, n, p)."""
    length = as_positive("length_noise", length_noise)
    turn = as_positive("orientation_noise", orientation_noise, zero=True)
    lengths = model.evaluate(np.zeros(model.size), measured)
    return np.asarray(whitening(lengths, length, turn) @ lengths.by_unknowns)


class _Search:
    """Poses by gain, from their rows of the Jacobian, shape (N, n, p), and the information before any."""

    def __init__(self, rows: FloatArray, start: FloatArray) -> None:
        self.rows, self.start = rows, start

    def gains(self, information: FloatArray) -> FloatArray:
        """By how much each pose would lower the sum of the variances, shape (N,)."""
        spread = np.linalg.inv(information)
        half = self.rows @ spread
        grown = np.eye(self.rows.shape[1]) + half @ np.swapaxes(self.rows, 1, 2)
        # (M + FᵀF)⁻¹ = M⁻¹ - M⁻¹ Fᵀ (1 + F M⁻¹ Fᵀ)⁻¹ F M⁻¹.
        return np.asarray(np.trace(np.linalg.solve(grown, half @ np.swapaxes(half, 1, 2)), axis1=1, axis2=2))

    def first(self, count: int) -> list[int]:
        """The best pose, the best one beside it, and so on."""
        information, chosen = self.start, list[int]()
        for _ in range(count):
            gains = self.gains(information)
            gains[chosen] = -np.inf
            chosen.append(int(gains.argmax()))
            information = information + self.rows[chosen[-1]].T @ self.rows[chosen[-1]]
        return chosen

    def exchanged(self, chosen: list[int]) -> list[int]:
        """Exchange each pose for the best in its place, until none is better (Fedorov's algorithm)."""
        for _ in range(_MOST_PASSES):
            improved = False
            for place in range(len(chosen)):
                others = chosen[:place] + chosen[place + 1 :]
                information = self.start + np.einsum("kip,kiq->pq", self.rows[others], self.rows[others])
                gains = self.gains(information)
                now = gains[chosen[place]]
                gains[others] = -np.inf
                best = int(gains.argmax())
                if gains[best] > now * (1.0 + _GAIN):
                    chosen[place], improved = best, True
            if not improved:
                break
        return chosen
