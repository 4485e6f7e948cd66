"""Which poses to measure: how much a set of them says, and sets that say most."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput
from ..core.errors.base import echo
from ..core.errors.renamed import ask_for_new_words
from ..core.records import reduced_tuple
from ..core.validation import FloatArray, as_count, as_positive, frozen, require_method, require_type
from ..study import adl_box
from ..workspace import Criteria, Workspace, workspace
from ..workspace.criterion import CRITERIA as REACH
from ..workspace.criterion import forces
from .calibrate_device import JOINTS, nominal_model, prior_of
from .information import Information, whitening
from .length_model import LengthModel
from .plausibility import as_poses

if TYPE_CHECKING:
    from ..exo.shoulder_exo import ShoulderExo

#: Candidates by themselves: the grid of daily life, degrees, finer if too few of its poses can be reached.
_GRIDS = (15.0, 7.5, 5.0)
#: Tolerance of the unknowns, m, as long as too few poses are chosen to determine them.
_LOOSE = 0.05
#: A pose is exchanged if the criterion gains this part of itself.
_GAIN = 1e-9
_MOST_PASSES = 20


@ask_for_new_words
class SuggestedPoses(NamedTuple):
    """Poses to measure.

    Attributes
    ----------
    poses : Rotation
        Stack of shape (count,), in the order of the candidates.
    chosen : ndarray
        Shape (count,), indices of the candidates (flattened).
    expected : Information
        What measurements there would determine.
    not_checked : dict of str to str
        Criteria of reach that were not checked, and what lacks for them.
    """

    poses: Rotation
    chosen: NDArray[np.intp]
    expected: Information
    not_checked: dict[str, str]

    def __reduce__(self) -> tuple[Any, ...]:
        return reduced_tuple(self)


@ask_for_new_words
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

    Returns
    -------
    Information
        With singular values, covariance and undetermined directions; it prints.
    """
    require_method("nominal", nominal, "inverse_kinematics", "a ShoulderExo")
    model = nominal_model(nominal, unknowns, torso_mounting, arm_mounting)
    return _Measurements.of(model, poses, length_noise, orientation_noise, tolerances).information()


def suggest_poses(
    nominal: ShoulderExo,
    count: int,
    candidates: Rotation | None = None,
    *,
    unknowns: str | Iterable[str] = JOINTS,
    length_noise: float,
    orientation_noise: float = 0.0,
    tolerances: Mapping[str, float] | None = None,
    reach: Criteria | None = None,
) -> SuggestedPoses:
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
    candidates : Rotation, optional
        Stack of shape (...), poses that can be taken. If left out, those of a grid over the box of daily life
        (Table 2-1) on the design's side that the device can reach: of 15°, or down to 5° if these are too few.
    unknowns, length_noise, orientation_noise, tolerances
        As in :func:`exo_pin.calibrate`.
    reach : Criteria, optional
        What it is to reach a pose, such as the ``body`` to keep clear of. By default all that the design has data for
        of stroke, range of the shoulder and of the limbs' joints, and distance to the singular surface on the side of
        rest, with a way from rest. ``candidates`` are checked only if it is given.

    Returns
    -------
    SuggestedPoses

    Raises
    ------
    InvalidInput
        If there are fewer candidates than poses, or the device can reach fewer.
    """
    require_method("nominal", nominal, "inverse_kinematics", "a ShoulderExo")
    count = as_count("count", count, 1)
    require_type("reach", Criteria() if reach is None else reach, Criteria, "a Criteria")
    poses, places, not_checked = _candidates(nominal, int(count), candidates, reach)
    model = nominal_model(nominal, unknowns)
    possible = _Measurements.of(model, poses, length_noise, orientation_noise, tolerances)
    start = _start(model, possible.prior)
    search = _Search(possible.jacobian * model.scales, start)
    chosen = frozen(np.sort(search.exchanged(search.first(int(count)))))
    return SuggestedPoses(poses[chosen], frozen(places[chosen]), possible.information(chosen), not_checked)


class _Measurements(NamedTuple):
    """Measurements to come: orientations (N, 3, 3), derivatives of the lengths over their errors (N, n, p), prior."""

    model: LengthModel
    measured: FloatArray
    jacobian: FloatArray
    prior: FloatArray

    @classmethod
    def of(
        cls, model: LengthModel, poses: Rotation, length_noise: float, orientation_noise: float, tolerances: Any
    ) -> _Measurements:
        length = as_positive("length_noise", length_noise)
        turn = as_positive("orientation_noise", orientation_noise, zero=True)
        measured = as_poses(poses).as_matrix()
        lengths = model.evaluate(np.zeros(model.size), measured)
        jacobian = whitening(lengths, length, turn) @ lengths.by_unknowns
        return cls(model, measured, jacobian, prior_of(model, tolerances, length))

    def information(self, chosen: Any = slice(None)) -> Information:
        """Of all of them, or of those with some indices."""
        model, jacobian = self.model, self.jacobian[chosen].reshape(-1, self.model.size)
        return Information(model, np.zeros(model.size), self.measured[chosen], jacobian, 1.0, self.prior)


def _candidates(
    nominal: ShoulderExo, count: int, given: Rotation | None, reach: Criteria | None
) -> tuple[Rotation, NDArray[np.intp], dict[str, str]]:
    """Poses to choose from (flat), which ones of all they are, and criteria that were not checked."""
    grids = [given] if given is not None else [adl_box(step, nominal.side) for step in _GRIDS]
    for grid in grids:
        poses = as_poses(grid)
        inside, lost, not_checked = np.ones(len(poses), dtype=bool), "", dict[str, str]()
        if given is None or reach is not None:
            found, not_checked = _reached(nominal, grid, Criteria() if reach is None else reach)
            inside = found.inside.ravel()
            failed = {name: int((~met).sum()) for name, met in found.met.items()}
            lost = ", ".join(f"{name} {fails}" for name, fails in failed.items() if fails)
        if inside.sum() >= count:
            return poses[inside], np.flatnonzero(inside), not_checked
    if given is not None and reach is None:
        raise InvalidInput(f"expected count from 1 to the number of candidates, {len(poses)}, got {echo(count)}")
    reached = f"{int(inside.sum())} of {len(poses)}" if inside.any() else f"none of {len(poses)}"
    what = "candidates" if given is not None else "poses of daily activities"
    raise InvalidInput(
        f"expected {echo(count)} poses, but {nominal.name!r} can reach {reached} {what} (poses that fail: {lost}): "
        "give candidates that it can reach, or measure with the limits removed (actuators taken off)"
    )


def _reached(nominal: ShoulderExo, poses: Rotation, reach: Criteria) -> tuple[Workspace, dict[str, str]]:
    mechanism, names, not_checked = nominal.mechanism, reach.names, dict[str, str]()
    if names is None:
        # A pose is measured where the device gets, whatever its actuators hold there.
        wanted = {name: item for name, item in REACH.items() if forces not in item.needs}
        lacking = {name: item.missing(mechanism, reach, len(poses.shape) == 3) for name, item in wanted.items()}
        not_checked = {name: ", ".join(texts) for name, texts in lacking.items() if texts}
        names = tuple(name for name in wanted if name not in not_checked)
    return workspace(mechanism, poses, replace(reach, names=names)), not_checked


def _start(model: LengthModel, prior: FloatArray) -> FloatArray:
    """Information before any pose, in the scaled unknowns."""
    return np.diag((model.scales / np.minimum(prior, _LOOSE * model.scales)) ** 2)


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
