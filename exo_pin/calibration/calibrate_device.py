"""``calibrate``: from measured poses and limb lengths to the device as built and worn."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput
from ..core.errors.base import echo
from ..core.errors.checked import checked
from ..core.validation import (
    FloatArray,
    as_choice,
    as_count,
    as_mapping,
    as_positive,
    as_single_rotation,
    frozen,
    require_method,
)
from .information import Information
from .length_model import GROUPS, CalibrationProblem, LengthModel, MeasurementErrors, as_unknowns, estimate, whitening
from .plausibility import as_lengths, as_poses, warn_of_mix_ups
from .result import Calibration, FittedDevice
from .search.solutions import solutions
from .search.starts import near_body_axes, with_offsets

if TYPE_CHECKING:
    from ..exo.shoulder_exo import ShoulderExo


#: What is unknown if nothing else is said.
JOINTS = ("base_points", "platform_points")
#: Larger errors are no measurement, m and rad.
_WORST_LENGTH, _WORST_ORIENTATION = 0.1, 1.0


@checked
def calibrate(
    poses: Rotation,
    lengths: ArrayLike,
    nominal: ShoulderExo,
    *,
    unknowns: str | Iterable[str] = JOINTS,
    length_noise: float | None = None,
    orientation_noise: float = 0.0,
    tolerances: Mapping[str, float] | None = None,
    torso_mounting: Rotation | None = None,
    arm_mounting: Rotation | None = None,
) -> Calibration:
    """Find joint centres, length offsets, the device's centre and sensor mountings from measured poses.

    Nonlinear least squares with exact derivatives, from the nominal design and from other starts. Where several devices
    fit equally well (twins: :mod:`exo_pin.calibration.search.starts`), the one nearest to the nominal design is
    returned, and ``devices`` has all. The arm is assumed to turn about one fixed
    point, the shoulder's centre, and limbs to be straight between their joint centres (no slack muscle). Errors are
    independent: of each length with standard deviation ``length_noise``, of each orientation about each axis with
    ``orientation_noise``. An error of an orientation moves all lengths of its pose at once and is weighted so
    (errors in variables, to first order).

    Parameters
    ----------
    poses : Rotation
        Stack of shape (...): the arm in {O_A}; or, with mountings, the arm's sensor seen from the torso's,
        R_GTᵀ R_GS of Figure 5-9.
    lengths : array_like
        Shape (..., n), m: between the joint centres, or with ``length_offsets`` unknown shorter by a constant of each
        limb, such as a muscle's length without its end fittings.
    nominal : ShoulderExo
        The design to start from.
    unknowns : iterable of str
        * ``"base_points"``, ``"platform_points"``: A_i and B_i, all three coordinates of each;
        * ``"length_offsets"``: o_i, so that |A_i B_i| = measured length + o_i;
        * ``"base_offset"``, ``"cuff_offset"``: where the device's centre is, seen from the shoulder's, of the base and
          of the cuff (:class:`exo_pin.CentreOffset`);
        * ``"torso_mounting"``, ``"arm_mounting"``: Q_T from the torso's sensor to {O_A}, and Q_S from {O_B} to the
          arm's sensor (R_SS' of Figure 5-9): R = Q_T R_GTᵀ R_GS Q_S;
        * ``"length_scale"``: s, so that |A_i B_i| = (1 + s) measured length + o_i, the same of all limbs.
    length_noise : float, optional
        m. Estimated from the residuals if left out.
    orientation_noise : float
        rad, about each axis; it needs ``length_noise``.
    tolerances : mapping of str to float, optional
        Standard deviation of each component before any measurement, m or rad (of the scale 1), by name, such as
        ``{"base_points": 0.002, "torso_mounting": 0.03}``. Of an unknown: how well the nominal design is known. Of what
        is not unknown: how well it is known, which counts in all standard deviations. They need ``length_noise``.
    torso_mounting, arm_mounting : Rotation, optional
        Q_T and Q_S, or the values to start from if they are unknown. None is the identity, or any mounting if it is
        unknown.

    Returns
    -------
    Calibration
        With the calibrated design, ``covariance``, ``known`` (what was taken as known, and its effect),
        ``undetermined``, ``devices`` and residuals; it prints.

    Raises
    ------
    InvalidInput
        If shapes do not fit, lengths are in another unit, or there is nothing to estimate the noise from.
    SolverFailed
        If least squares does not converge.

    Warns
    -----
    SuspectMeasurements
        If the data fit far better with the limbs in another order, or other angles.

    Notes
    -----
    Lengths are those between points. They do not change where all joints of the base turn together against the
    torso's sensor, those of the cuff against the arm's, or where all grow by a scale: with joints unknown, mountings
    and scale are only as good as they are known (:attr:`Calibration.known`). Source of the chain of
    sensors: thesis 5.3, Figure 5-9.

    Examples
    --------
    >>> nominal = ep.load("three-linear-actuators")
    >>> poses = nominal.pose(np.linspace(0, 80, 30), np.linspace(60, 0, 30), np.linspace(-10, 50, 30))
    >>> lengths = nominal.inverse_kinematics(poses).lengths + 0.002  # encoders that read 2 mm too much
    >>> found = ep.calibrate(poses, lengths, nominal, unknowns="length_offsets")
    >>> (1e3 * found.length_offsets).round(3)  # mm
    array([-2., -2., -2.])
    """
    require_method("nominal", nominal, "inverse_kinematics", "a ShoulderExo")
    poses = as_poses(poses)
    errors = _errors(length_noise, orientation_noise)
    model = nominal_model(nominal, unknowns, torso_mounting, arm_mounting, tolerances)
    measured = poses.as_matrix()
    start = model.lengths(np.zeros(model.size), measured)
    values = as_lengths(lengths, poses, start, "length_offsets" in model.unknowns)
    prior = prior_of(model, tolerances, errors.length_noise)
    searched = [
        name
        for name, start in (("torso_mounting", torso_mounting), ("arm_mounting", arm_mounting))
        if start is None and name in model.places and name not in model.known
    ]
    model = with_offsets(model, measured, values)
    free = prior.copy()
    for name in searched:
        free[model.places[name]] = np.inf
    problem = CalibrationProblem(model, measured, values, errors, free)
    if not searched:
        warn_of_mix_ups(model, poses, values)
    fits, count = solutions(problem, searched)
    devices = [FittedDevice(nominal, *near_body_axes(model, device, searched)) for device in fits]
    model = devices[0].model
    if searched:
        warn_of_mix_ups(model, poses, values)
    problem = problem._replace(model=model, prior=prior)
    found = estimate(problem, devices[0].values, near=False)
    if not np.isfinite(found.scale):
        raise InvalidInput(
            f"{values.size} lengths leave nothing to estimate their noise from, with {model.size} unknowns: measure "
            "more poses, or give length_noise"
        )
    information = Information(model, found.values, measured, found.jacobian, found.scale**2, prior)
    devices[0] = FittedDevice(nominal, model, frozen(found.values.copy()))
    return Calibration(
        *(nominal, model, devices[0].values, found, information, poses, frozen(values), errors),
        devices=tuple(devices),
        device_count=count,
    )


def nominal_model(
    nominal: ShoulderExo,
    unknowns: str | Iterable[str],
    torso_mounting: Rotation | None = None,
    arm_mounting: Rotation | None = None,
    tolerances: Any = None,
) -> LengthModel:
    """The model of a design's lengths, to start from; what has a tolerance and is not unknown is known to it."""
    torso, arm = (
        Rotation.identity() if mounting is None else as_single_rotation(name, mounting)
        for name, mounting in (("torso_mounting", torso_mounting), ("arm_mounting", arm_mounting))
    )
    geometry, offsets = nominal.geometry, np.zeros(nominal.geometry.limb_count)
    asked, given = as_unknowns(unknowns), as_mapping("tolerances", tolerances, "quantity to standard deviation")
    known = [as_choice("quantity with a tolerance", name, GROUPS) for name in given if name not in asked]
    together = as_unknowns((*asked, *known))
    return LengthModel(geometry.base_points, geometry.platform_points, offsets, torso, arm, together, tuple(known))


def prior_of(model: LengthModel, tolerances: Any, length_noise: float | None) -> FloatArray:
    """Standard deviation of each unknown before any measurement, shape (p,), infinite without a tolerance."""
    given = as_mapping("tolerances", tolerances, "quantity to standard deviation")
    if given and length_noise is None:
        raise InvalidInput(
            "expected length_noise together with tolerances: the fit weights lengths and tolerances by it"
        )
    prior = np.full(model.size, np.inf)
    for name, tolerance in given.items():
        prior[model.places[name]] = as_positive(f"tolerance of {name}", tolerance)
    return frozen(prior)


def _errors(length_noise: float | None, orientation_noise: float) -> MeasurementErrors:
    turn = as_positive("orientation_noise", orientation_noise, zero=True)
    if turn > _WORST_ORIENTATION:
        raise InvalidInput(
            f"expected orientation_noise in rad, at most {_WORST_ORIENTATION:g}, got {turn:g} (degrees?)"
        )
    if length_noise is None:
        if turn > 0.0:
            raise InvalidInput(
                "expected length_noise together with orientation_noise: the fit weights one against the other"
            )
        return MeasurementErrors(None, 0.0)
    length = as_positive("length_noise", length_noise)
    if length > _WORST_LENGTH:
        raise InvalidInput(f"expected length_noise in m, at most {_WORST_LENGTH:g}, got {length:g} (millimetres?)")
    return MeasurementErrors(length, turn)


#: Tolerance of the unknowns, m, as long as too few poses are chosen to determine them.
_LOOSE = 0.05
#: A pose is exchanged if the criterion gains this part of itself: rounding, or a mirror image, changes no choice.
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
    model = nominal_model(nominal, unknowns, torso_mounting, arm_mounting, tolerances)
    measured = as_poses(poses).as_matrix()
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
    model = nominal_model(nominal, unknowns, tolerances=tolerances)
    prior = prior_of(model, tolerances, length_noise)
    rows = _whitened(model, poses.as_matrix(), length_noise, orientation_noise) * model.scales
    # Before any pose the unknowns are known to a loose tolerance.
    start = np.diag((model.scales / np.minimum(prior, _LOOSE * model.scales)) ** 2)
    eye, chosen = np.eye(rows.shape[1]), list[int]()

    def gains(others: list[int]) -> FloatArray:
        """By how much each pose would lower the sum of the variances beside others, shape (N,)."""
        information = start + np.einsum("kip,kiq->pq", rows[others], rows[others])
        half = rows @ np.linalg.inv(information)
        grown = eye + half @ np.swapaxes(rows, 1, 2)
        # (M + FᵀF)⁻¹ = M⁻¹ - M⁻¹ Fᵀ (1 + F M⁻¹ Fᵀ)⁻¹ F M⁻¹.
        found = np.trace(np.linalg.solve(grown, half @ np.swapaxes(half, 1, 2)), axis1=1, axis2=2)
        found[others] = -np.inf
        return np.asarray(found)

    # The best pose, the best one beside it, and so on; then each is exchanged for the best in its place, until none is
    # better (Fedorov's algorithm).
    for _ in range(count):
        chosen.append(int(gains(chosen).argmax()))
    for _ in range(_MOST_PASSES):
        before = list(chosen)
        for place, now in enumerate(before):
            found = gains(chosen[:place] + chosen[place + 1 :])
            if found.max() > found[now] * (1.0 + _GAIN):
                chosen[place] = int(found.argmax())
        if chosen == before:
            break
    return frozen(np.sort(chosen))


def _whitened(model: LengthModel, measured: FloatArray, length_noise: float, orientation_noise: float) -> FloatArray:
    """Derivatives of the lengths over their errors, shape (N, n, p)."""
    length = as_positive("length_noise", length_noise)
    turn = as_positive("orientation_noise", orientation_noise, zero=True)
    lengths = model.evaluate(np.zeros(model.size), measured)
    return np.asarray(whitening(lengths, length, turn) @ lengths.by_unknowns)
