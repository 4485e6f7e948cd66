"""Orientation of the arm from inertial sensors on torso and arm."""

from __future__ import annotations

from dataclasses import dataclass

from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.validation import as_rotation


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
