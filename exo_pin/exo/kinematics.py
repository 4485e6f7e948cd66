"""Where the arm and the device are, how near a pose is to losing hold, and which poses can be reached.

The design in motion, under a controller.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from .. import Criteria, Workspace, wrist
from ..core.conventions import shoulder_rotation
from ..core.errors import InvalidInput
from ..core.errors.checked import checked
from ..core.validation import FloatArray
from ..device.accuracy.pose_accuracy import PoseAccuracy, pose_accuracy
from ..device.accuracy.twins import TWIN_ANGLE
from ..device.device_singularity import device_singularity, drive_positions, position_rates, with_doubts
from ..device.postures import assembly_modes as modes_of
from ..device.postures import configurations_of
from ..load_case import CentreOffset, CentrePath, Load, Movement
from ..load_case.case import Posture, warn_outside_human_range, warn_suspicious_angles
from ..workspace.query import workspace as workspace_of

if TYPE_CHECKING:
    from ..control import Fault, FeedbackGains, Imu, Padding, Payload, PlantOptions, Reference, Torso, Tracking
    from ..control.plant.any_device.arm_actions import Wearer
    from .shoulder_exo import ShoulderExo


def pose(
    self: ShoulderExo,
    flexion: ArrayLike = 0.0,
    abduction: ArrayLike = 0.0,
    internal_rotation: ArrayLike = 0.0,
) -> Rotation:
    """Orientation of the arm from clinical angles in degrees, on the design's own side of the body.

    Warns (:class:`exo_pin.OutsideHumanRange`) of a pose that a human shoulder of that side does not reach, and of
    angles that look like radians.

    Parameters
    ----------
    flexion, abduction, internal_rotation : array_like
        Degrees, positive as named: arm forward, away from the body, turned inward. They broadcast to shape (...).

    Returns
    -------
    Rotation
        Takes {O_B} to {O_A}; single, or a stack of shape (...). See :func:`exo_pin.shoulder_rotation`.

    Raises
    ------
    InvalidInput
        If an angle is not finite or the shapes do not broadcast.

    Examples
    --------
    >>> exo = ep.load("four-cables")
    >>> hand = exo.pose(flexion=90).apply([0.0, 0.0, -0.6])  # a hanging hand, raised to the front
    >>> (hand + 0.0).round(3)
    array([ 0.6,  0. , -0. ])
    """
    angles = {"flexion": flexion, "abduction": abduction, "internal_rotation": internal_rotation}
    orientation = shoulder_rotation(**angles, side=self.side, degrees=True)
    warn_suspicious_angles(angles)
    warn_outside_human_range(orientation.as_matrix().reshape(-1, 3, 3), self.side)
    return orientation


def inverse_kinematics(self: ShoulderExo, poses: Rotation) -> Any:
    """Positions of the drives: of a wrist limb lengths, directions and joint angles.

    Parameters
    ----------
    poses : Rotation
        Pose, single or a stack of shape (...).

    Returns
    -------
    LimbState or DrivePositions
        Both have ``positions``, shape (..., n), m or rad. Of a wrist :class:`exo_pin.wrist.LimbState`
        (:func:`exo_pin.wrist.inverse_kinematics`); of any other device the joints of its chain besides.

    Examples
    --------
    >>> exo = ep.load("prototype")
    >>> exo.inverse_kinematics(exo.pose(abduction=[0, 30])).lengths.round(4)  # m
    array([[0.3051, 0.3654, 0.3663],
           [0.315 , 0.3586, 0.3593]])
    """
    own = self.wrist
    return drive_positions(self.chain_device, poses) if own is None else wrist.inverse_kinematics(own.geometry, poses)


def jacobian(self: ShoulderExo, poses: Rotation) -> FloatArray:
    """Rates of the drives' positions for an angular velocity ω of the arm, J ω.

    Parameters
    ----------
    poses : Rotation
        Pose, single or a stack of shape (...).

    Returns
    -------
    ndarray
        Shape (..., n, 3), ω in the base frame: d(positions)/dt of :meth:`inverse_kinematics`, m/rad, or rad/rad in a
        hinge; of limbs and cables that of their lengths (:func:`exo_pin.wrist.limb_jacobian`).

    Examples
    --------
    >>> exo = ep.load("four-cables")
    >>> J = exo.jacobian(exo.pose(60))  # m/rad
    >>> (J @ [0.0, -1.0, 0.0]).round(3)  # lengths while flexion grows by 1 rad/s, m/s
    array([-0.152, -0.015, -0.122,  0.193])
    """
    own = self.wrist
    return position_rates(self.chain_device, poses) if own is None else wrist.limb_jacobian(own.geometry, poses)


def singularity(self: ShoulderExo, poses: Rotation) -> Any:
    """How far poses are from losing control.

    Parameters
    ----------
    poses : Rotation
        Pose, single or a stack of shape (...).

    Returns
    -------
    Singularity or DeviceSingularity
        Of a wrist :mod:`exo_pin.wrist.singularities.measures`, else :class:`.DeviceSingularity`. Of both ``kind`` is
        "undetermined" where the digits of a robot's file may make or hide a singular pose.

    Examples
    --------
    >>> exo = ep.load("prototype")
    >>> exo.singularity(exo.pose(abduction=[0, 20])).determinant.round(4)  # a singular pose lies between
    array([-0.0143,  0.0198])
    """
    own = self.wrist
    if own is None:
        return with_doubts(self.device, poses, device_singularity(self.chain_device, poses))
    return with_doubts(self.device, poses, wrist.singularity(own.geometry, poses, own.is_upu))


def accuracy(
    self: ShoulderExo, poses: Rotation, twins: bool = True, twin_angle: float = float(np.degrees(TWIN_ANGLE))
) -> PoseAccuracy:
    """How well the drives place the arm, and which other pose looks the same to them.

    Parameters
    ----------
    poses : Rotation
        Pose, single or a stack of shape (...).
    twins : bool
        Whether to look for twins.
    twin_angle : float
        Angle from which a pose that looks the same counts as a twin, degrees.

    Returns
    -------
    PoseAccuracy
        ``rate``, ``mm_per_degree``, ``has_twin``, ``twin_angle`` and more (:mod:`exo_pin.device.accuracy`).

    Examples
    --------
    >>> for name in ("four-linear-actuators", "four-linear-actuators-worn"):
    ...     exo = ep.load(name)
    ...     round(float(exo.accuracy(exo.pose(80)).mm_per_degree), 2)
    1.54
    0.25
    """
    return pose_accuracy(self.device, poses, twins, math.radians(twin_angle))


def configurations(self: ShoulderExo, poses: Rotation) -> FloatArray:
    """Joints of the chain in poses of the arm, on the assembly mode that continues from rest.

    Parameters
    ----------
    poses : Rotation
        Pose, single or a stack of shape (...).

    Returns
    -------
    ndarray
        q, shape (..., nq), as Pinocchio orders it; NaN where a pose is out of reach.

    Examples
    --------
    >>> exo = ep.load("prototype")
    >>> q = exo.configurations(exo.pose(30, 20))
    >>> bool(np.abs(exo.chain.close(q) - q).max() < 1e-9)  # its loops are closed
    True
    """
    return configurations_of(self.chain_device, poses)


def assembly_modes(self: ShoulderExo, poses: Rotation, starts: int = 64, seed: int = 0) -> FloatArray:
    """All closed configurations of the chain that were found in one pose of the arm.

    Parameters
    ----------
    poses : Rotation
        Single.
    starts : int
        Random configurations to close from.
    seed : int
        Of the random numbers.

    Returns
    -------
    ndarray
        Shape (k, nq); the first is the one that continues from rest, where it reaches the pose.

    Examples
    --------
    >>> exo = ep.load("prototype")
    >>> modes = exo.assembly_modes(exo.pose(30, 20), starts=4)
    >>> bool((modes[0] == exo.configurations(exo.pose(30, 20))).all())
    True
    """
    return modes_of(self.chain_device, poses, starts, seed)


def workspace(
    self: ShoulderExo,
    poses: Rotation | float | None = None,
    criteria: Criteria | Iterable[str] | None = None,
    load: Load | None = None,
    centre_offset: CentreOffset | CentrePath | ArrayLike | None = None,
    posture: Posture = None,
) -> Workspace:
    """Which poses the device can reach, hold and keep safe, with a margin to every criterion.

    Parameters
    ----------
    poses : Rotation or float, optional
        Stack of shape (...), or the step, degrees, of the grid of daily activities; the grid of 4° with 19,656
        poses of Appendix C if left out.
    criteria : Criteria or iterable of str, optional
        Which of :data:`exo_pin.workspace.CRITERIA`, and their limits; all that the design's data allow if left
        out. The result names those that were not checked.
    load : Load, optional
        On the arm, besides its weight.
    centre_offset : CentreOffset, CentrePath or array_like, optional
        Where the device's centre lies, seen from the anatomical one, as in :meth:`reaction`: one for all poses, or
        one a pose; ``person.centre_path()`` for a frame that the torso holds while the shoulder moves. All criteria
        are checked in the displaced geometry.
    posture : mapping or array_like, optional
        Values of idle joints, as in :meth:`reaction`.

    Returns
    -------
    Workspace
        ``index`` (Φ), ``fractions``, ``inside``, ``reasons`` and more; prints as a table.

    Raises
    ------
    MissingData
        If a criterion that is named needs what the design does not have.

    Examples
    --------
    >>> found = ep.load("four-linear-actuators-worn").workspace(10.0)
    >>> print(f"{found.index:.0%} of {found.inside.size} poses; clearance {found.fractions['clearance']:.0%}")
    90% of 1452 poses; clearance 94%
    """
    return workspace_of(self.device, poses, criteria, load, centre_offset, posture)


@checked
def track(
    self: ShoulderExo,
    reference: Reference | Movement | str | PathLike[str],
    controller: str | Callable[[float, Any], Any] | None = None,
    *,
    options: PlantOptions | None = None,
    duration: float | None = None,
    imu: Imu | None = None,
    faults: Fault | Sequence[Fault] = (),
    feedback: FeedbackGains | None = None,
    rate: float = 100.0,
    wearer: Wearer | Sequence[Wearer] = (),
    payloads: Payload | Sequence[Payload] = (),
    torso: Torso | None = None,
    cuff: Padding | None = None,
    harness: Padding | None = None,
    title: str = "",
    progress: bool = False,
) -> Tracking:
    """Simulate the design while a controller follows a reference.

    Parameters
    ----------
    reference : Reference, Movement, str or path-like
        A trajectory (:mod:`exo_pin.control`) or a movement; "abduction" or "flexion", the tests of Section 5.4.1; or a
        file of orientations, as :func:`exo_pin.read_movement` reads it. A device that turns the arm about fewer than
        three axes follows in the nearest poses that it has.
    controller : {"pi", "model"} or callable, optional
        "model" of a redundant design, unless it states that it measures lengths alone, else "pi", if left out.
        "pi": of muscles the thesis's, contraction ratios with the gains of Table 5-5; of winches and linear
        actuators their lengths. "model": tensions of least shoulder force and their pressures or motor forces,
        with feedback. Or any function ``(t, measurement) -> commands``, see
        :class:`exo_pin.control.Controller`.
    options : PlantOptions, optional
        Air, valves, motors, friction, shoulder unit; estimates if left out.
    duration : float, optional
        s; that of the reference if left out.
    imu : Imu, optional
        The inertial sensor with its errors; exact measurements if left out.
    faults : Fault or sequence of Fault
        Of muscles, valves and motors.
    feedback : FeedbackGains, optional
        Of the controller "model".
    rate : float
        Of the controller, Hz.
    wearer, payloads, torso, cuff, harness : optional
        What the person does, what the arm carries, how the torso moves, and how cuff and harness give way, as for
        :class:`exo_pin.Plant`.
    title : str
        For verdict and plots.
    progress : bool
        Whether to show a bar.

    Returns
    -------
    Tracking
        Angles, lengths, pressures, tensions, shoulder force and energy over time; prints its verdict first.

    Raises
    ------
    MissingData
        If arm, actuators, strokes or end fittings are not known.
    InvalidInput
        If an argument does not fit.

    Examples
    --------
    >>> run = ep.load("four-cables").track("flexion", "model", duration=0.5)
    >>> round(run.summary()["rms_error_deg"], 1)
    0.2
    """
    from ..control import Experiment, Payload, options_for, reference_of  # here, because few queries need them

    wanted = reference_of(reference, self.side)
    name = title or getattr(wanted, "title", "") or "tracking"
    moved = self.moved_record
    chosen = options_for(moved) if options is None else options
    acts = (wearer,) if callable(wearer) else tuple(wearer)
    carried = (payloads,) if isinstance(payloads, Payload) else tuple(payloads)
    experiment = Experiment(
        "track", name, moved, wanted, controller, chosen, duration, imu, faults, rate, feedback, acts, carried, torso,  # type: ignore[arg-type]
        cuff, harness,
    )  # fmt: skip
    # Without a name the controller is that which suits the design.
    if feedback is not None and experiment.controller != "model":
        raise InvalidInput('feedback gains are for the controller "model"')
    return experiment.run(progress)
