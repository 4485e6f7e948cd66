"""Orientation of the arm from sensors: joint sensors and their errors, inertial sensors on torso and arm."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.results import Result
from ...core.validation import FloatArray, as_choice, as_rotation
from ...design import WristGeometry
from ...numerics.vectors import FOLDED_SINE, SINGULAR_MARGIN, margin_of_values
from ..kinematics.inverse import QUANTITIES, inverse_kinematics, joint_jacobians
from ..singularities.measures import kind_of


@dataclass(frozen=True, eq=False)
class SensorSensitivity(Result):
    """Errors of the arm's orientation by errors of joint sensors, for a stack of shape (...).

    Attributes
    ----------
    sensitivity : ndarray
        Shape (...), in its own unit: largest turn of the arm per unit of sensor error (root of sum of squares over all
        sensors), rad per rad, or rad per m if lengths alone are measured; inf where they do not determine the pose.
    worst_axis : ndarray
        Shape (..., 3), unit vector, base frame: the axis about which the sensors give least information.
    error_gain : ndarray
        Shape (..., 3, m), in its own unit as ``sensitivity``: rotation vector of the arm per error of each of the m
        sensors, base frame; least squares for more than three. NaN where they do not determine the pose.
    along : ndarray
        b_i·s_i/|b_i|, shape (..., n): a sensor of θ_xA gives no information where its limb's is zero.
    determinant : ndarray
        Of three sensors' rows, shape (...), in its own unit; NaN for more than three. For θ_xA it is
        Π (b_i·s_i)/l_i det X, for θ_yA det[b_i × X_i] / Π q_i, with q_i the distance of B_i from the line O A_i.
    kind : ndarray of str
        Shape (...): "regular", "near" (margin of the rows below 1e-3, as of a pose in :class:`.Singularity`),
        "singular" or "folded" (a limb has no plane, so its angles have no rate).

    Examples
    --------
    >>> exo = ep.load("prototype")
    >>> exo.sensor_sensitivity(exo.pose(abduction=90)).kind.item()  # the plates are parallel
    'singular'
    """

    sensitivity: FloatArray
    worst_axis: FloatArray
    error_gain: FloatArray
    along: FloatArray
    determinant: FloatArray
    kind: NDArray[np.str_]


@checked
def sensor_sensitivity(
    geometry: WristGeometry, poses: Rotation, measured: str | Iterable[str] = "base_theta_x"
) -> SensorSensitivity:
    """Accuracy of the arm's orientation from sensors on the limbs and their joints.

    A sensor's error e turns the computed arm by J⁻¹ e (least squares: the pseudo-inverse), with J the rows of
    :func:`joint_jacobians` for what is measured. θ_xA alone is singular where det X = 0 or some b_i·s_i = 0, where
    two limb lengths fit one angle; θ_yA alone where det[b_i × X_i] = 0; both together in almost no pose.

    In Section 5.1.2 the potentiometers differ by 3° from the inertial sensor. Their gain was known to 1.7 %, which is
    1.4° in a reading of -83.6°, and a sensitivity of 2 makes 3° of it.

    Parameters
    ----------
    geometry : WristGeometry
        Joint centres.
    poses : Rotation
        Pose, single or a stack of shape (...).
    measured : str or iterable of str
        One or more of :data:`QUANTITIES`, for all limbs. Lengths beside angles are weighed with the largest |B_i|.

    Returns
    -------
    SensorSensitivity

    Raises
    ------
    UnknownName
        If a quantity is not one of :data:`QUANTITIES`.
    InvalidInput
        If nothing is measured.

    Examples
    --------
    >>> from exo_pin import wrist
    >>> exo = ep.load("prototype")
    >>> for measured in ("base_theta_x", ("base_theta_x", "base_theta_y")):  # one angle a limb, or both
    ...     found = wrist.sensor_sensitivity(exo.geometry, exo.pose(40), measured)
    ...     print(round(float(found.sensitivity), 2))
    87.53
    1.64
    """
    names = [measured] if isinstance(measured, str) else list(measured)
    if not names:
        raise InvalidInput("expected at least one measured quantity")
    for name in names:
        as_choice("quantity", name, QUANTITIES)
    state, jacobians = inverse_kinematics(geometry, poses), joint_jacobians(geometry, poses)
    radius = np.linalg.norm(geometry.platform_points, axis=-1)
    weigh = len(set(names)) > 1
    parts = [getattr(jacobians, name) / (radius.max() if weigh and name == "lengths" else 1.0) for name in names]
    rows = np.concatenate(parts, axis=-2)
    folded = (state.reach <= FOLDED_SINE * radius).any(axis=-1) & (set(names) != {"lengths"})
    U, values, Vt = np.linalg.svd(np.where(np.isfinite(rows), rows, 0.0), full_matrices=False)
    smallest = values[..., 2]
    margin = margin_of_values(values)
    lost = (margin < SINGULAR_MARGIN) | folded
    inverse = np.divide(1.0, values, out=np.full_like(values, np.nan), where=~lost[..., None])
    gain = np.einsum("...ji,...j,...kj->...ik", Vt, inverse, U)
    sensitivity = np.divide(1.0, smallest, out=np.full(smallest.shape, np.inf), where=~lost)
    three = rows.shape[-2] == 3
    determinant = np.linalg.det(np.where(np.isfinite(rows), rows, 0.0)) if three else np.full(smallest.shape, np.nan)
    along = np.einsum("...ij,...ij->...i", state.platform_points, state.directions) / radius
    return SensorSensitivity(sensitivity, Vt[..., 2, :], gain, along, determinant, kind_of(margin, folded))


@dataclass(frozen=True, eq=False)
class OrientationChain:
    """From inertial sensors to the shoulder: the orientation calibration of Section 5.3, Figure 5-9.

    A sensor on the arm reports R_GS, from its own frame S to the ground G; the torso's orientation is R_GT. S' is the
    arm's frame {O_B}, fixed to the sensor by R_SS'. Then R_TS' = R_GTᵀ R_GS R_SS' takes {O_B} to {O_A}: the torso may
    lean or walk, and the heading of the ground frame cancels.

    Attributes
    ----------
    arm_mount : Rotation
        R_SS', single: takes {O_B} to the axes of the arm's sensor.
    torso_mount : Rotation
        Single: takes {O_A} to the axes of the torso's sensor, so that R_GT is the torso sensor's reading times this.
        The identity where R_GT itself is given.
    spread : float
        Of the calibration, rad: largest angle between a single calibrating reading and their mean.

    Notes
    -----
    Source: thesis Figure 5-9.

    Examples
    --------
    >>> from exo_pin import wrist
    >>> flat = ep.thesis_rotation(0, 0, 0)
    >>> chain = wrist.OrientationChain(arm_mount=flat, torso_mount=flat)
    >>> leaning = ep.thesis_rotation(0, 20, 0, degrees=True)  # of the whole person, who holds still
    >>> float(chain.orientation(leaning, leaning).magnitude().round(9))
    0.0
    """

    arm_mount: Rotation
    torso_mount: Rotation
    spread: float = 0.0

    def __post_init__(self) -> None:
        for name in ("arm_mount", "torso_mount"):
            if as_rotation(name, getattr(self, name)).shape != ():
                raise InvalidInput(f"expected {name} to be a single rotation, got shape {getattr(self, name).shape}")

    @classmethod
    def calibrated(
        cls,
        arm_reading: Rotation,
        torso_reading: Rotation,
        pose: Rotation | None = None,
        torso_mount: Rotation | None = None,
    ) -> OrientationChain:
        """Mounting of the arm's sensor, from readings in a known pose.

        Parameters
        ----------
        arm_reading, torso_reading : Rotation
            R_GS and the torso's reading while the pose is held, single or stacks that broadcast; averaged.
        pose : Rotation, optional
            The pose held, single; hanging arm, all angles zero, if left out.
        torso_mount : Rotation, optional
            As in the class; the torso's reading is R_GT itself if left out.

        Returns
        -------
        OrientationChain

        Raises
        ------
        InvalidInput
            If a reading is not a finite Rotation, or there is none.

        Examples
        --------
        >>> from exo_pin import wrist
        >>> strapped = ep.thesis_rotation(5, -8, 30, degrees=True)  # the sensor on the hanging arm
        >>> chain = wrist.OrientationChain.calibrated(strapped, ep.thesis_rotation(0, 0, 0))
        >>> float((chain.arm_mount * strapped).magnitude().round(9))  # undoes how it is strapped on
        0.0
        """
        mount = Rotation.identity() if torso_mount is None else as_rotation("torso_mount", torso_mount)
        held = Rotation.identity() if pose is None else as_rotation("pose", pose)
        arm, torso = as_rotation("arm_reading", arm_reading), as_rotation("torso_reading", torso_reading)
        found = _product(_product(arm.inv(), torso), _product(mount, held))
        flat = Rotation.from_quat(found.as_quat().reshape(-1, 4))
        if len(flat) == 0:
            raise InvalidInput("expected at least one reading to calibrate with")
        mean = flat.mean()
        return cls(mean, mount, float((mean.inv() * flat).magnitude().max()))

    def orientation(self, arm_reading: Rotation, torso_reading: Rotation) -> Rotation:
        """Orientation of the arm against the torso, R_TS'.

        Parameters
        ----------
        arm_reading, torso_reading : Rotation
            R_GS and the torso's reading, single or stacks that broadcast to (...).

        Returns
        -------
        Rotation
            Shape (...), takes {O_B} to {O_A}.

        Examples
        --------
        >>> from exo_pin import wrist
        >>> torso = ep.thesis_rotation([0, 10], 0, [0, 40], degrees=True)
        >>> strapped = ep.thesis_rotation(0, 0, 25, degrees=True)
        >>> chain = wrist.OrientationChain.calibrated(torso[0] * strapped, torso[0])
        >>> arm = torso[1] * ep.shoulder_rotation(50, 20, 0, degrees=True) * strapped  # the person has turned, too
        >>> ep.shoulder_angles(chain.orientation(arm, torso[1]), degrees=True).round(6) + 0.0
        array([50., 20.,  0.])
        """
        torso = _product(as_rotation("torso_reading", torso_reading), self.torso_mount)
        return _product(_product(torso.inv(), as_rotation("arm_reading", arm_reading)), self.arm_mount)


def _product(left: Rotation, right: Rotation) -> Rotation:
    """Product of stacks that broadcast."""
    try:
        return left * right
    except ValueError:
        raise InvalidInput(
            f"expected as many readings of the torso as of the arm, or one, got {left.shape} and {right.shape}"
        ) from None
