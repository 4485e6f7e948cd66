"""Pressures that hold a pose with least shoulder force, and the stiffness of the arm at these pressures."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput
from ..core.errors.checked import checked
from ..core.results import Result
from ..core.validation import FloatArray, require_method
from ..device.chain_device import ChainDevice
from ..device.wrist_device import as_device
from ..load_case import Case, Load
from ..wrist.forces.rotational_stiffness_matrix import rotational_stiffness
from .assumptions import Assumptions
from .constraints.actuator_limits import muscles_of_design
from .constraints.limb_limits import PressureActuator, each_limb, in_reach
from .result import Reaction
from .solve_case import solve

#: Turns of the arm whose moments give the stiffness of a device, rad.
_TURN = 1e-5


@dataclass(frozen=True, eq=False)
class PressurePlan(Result):
    """Pressures that hold a pose or a stack of poses of shape (...). Rows without an answer are NaN (``has_answer``).

    Attributes
    ----------
    reaction : Reaction
        The forces; its ``status`` and ``infeasibility`` give the reason where a pose cannot be held.
    pressures : ndarray
        Shape (..., n), gauge, Pa.
    axial_stiffness : ndarray
        df_i/dl_i of each limb at constant pressure, shape (..., n), N/m.
    stiffness : ndarray
        Shape (..., 3, 3), N m/rad, base frame: restoring moment on the arm about O per rad, pressures held
        constant (:func:`exo_pin.wrist.rotational_stiffness`).

    Examples
    --------
    >>> from exo_pin.muscle import Muscle, muscle_model
    >>> exo = ep.load("four-cables")
    >>> pose = exo.pose(60)
    >>> lengths = exo.inverse_kinematics(pose).lengths
    >>> law = muscle_model("best").scaled(0.25)
    >>> muscles = [Muscle(model=law, end_fitting=length - 0.22) for length in lengths]
    >>> plan = exo.pressures(pose, muscles)
    >>> plan.pressures_bar.round(2)  # the fourth pulls nothing
    array([3.62, 1.85, 2.99,  nan])
    """

    reaction: Reaction
    pressures: FloatArray
    axial_stiffness: FloatArray
    stiffness: FloatArray

    @property
    def has_answer(self) -> NDArray[np.bool_]:
        """Shape (...): whether the pose is held and the pressure and stiffness of every muscle are known."""
        return np.asarray(self.reaction.held & np.isfinite(self.stiffness).all(axis=(-1, -2)))

    @property
    def cautions(self) -> tuple[str, ...]:
        """Those of the forces, and how many held poses the muscle laws were identified for."""
        held, known = int(self.reaction.held.sum()), int(self.has_answer.sum())
        if held == known:
            return self.reaction.cautions
        return (
            f"{held - known} of {held} held poses need a state in which the law of a muscle was not identified: they "
            "have no pressures.",
            *self.reaction.cautions,
        )

    @property
    def pressures_bar(self) -> FloatArray:
        """Shape (..., n), gauge, bar."""
        return 1e-5 * self.pressures

    @property
    def least_stiffness(self) -> FloatArray:
        """Smallest eigenvalue of the symmetric part of ``stiffness``, shape (...), N m/rad."""
        symmetric = 0.5 * (self.stiffness + np.swapaxes(self.stiffness, -1, -2))
        known = np.asarray(np.isfinite(symmetric).all(axis=(-1, -2)))
        values = np.linalg.eigvalsh(np.where(known[..., None, None], symmetric, 0.0))[..., 0]
        return np.where(known, values, np.nan)

    @property
    def is_stable(self) -> NDArray[np.bool_]:
        """Shape (...): whether the arm returns from every small turn, pressures held constant."""
        return np.asarray(self.least_stiffness > 0.0)


@checked
def plan_pressures(device: Any, case: Case, actuators: Any, assumptions: Assumptions) -> PressurePlan:
    """Pressures of least shoulder force; see :meth:`exo_pin.ShoulderExo.pressures`.

    Parameters
    ----------
    device : ShoulderExo
        The device.
    case : Case
        Poses, motion and load.
    actuators : PressureActuator or sequence of them
        One for all limbs, or one a limb.
    assumptions : Assumptions
        Bounds, cone and weights.

    Returns
    -------
    PressurePlan

    Examples
    --------
    >>> from exo_pin.muscle import Muscle, muscle_model
    >>> exo, law = ep.load("four-cables"), muscle_model("best").scaled(0.25)
    >>> lengths = exo.inverse_kinematics(exo.pose(45)).lengths
    >>> muscles = [Muscle(model=law, end_fitting=length - 0.22) for length in lengths]
    >>> plan = ep.reaction.plan_pressures(exo, ep.Case(exo.pose(45)), muscles, ep.Assumptions())
    >>> pull, pressure = plan.reaction.actuator_forces[0], plan.pressures[0]
    >>> abs(round(float(law.force(0.25 - 0.22, pressure) - pull), 6))  # N, of the law at 30 mm of contraction
    0.0
    """
    if case.centre_offset is not None:
        raise InvalidInput(
            "expected no centre_offset: pressures and their stiffness are those of a device whose centre is the "
            "shoulder's. reaction takes an offset, with the muscles as limits"
        )
    if assumptions.law.moves:
        raise InvalidInput(
            f"pressures and their stiffness are those of a device without displacement, got "
            f"split={assumptions.law.name!r}: ask reaction with the muscles as limits"
        )
    if case.wearer is not None:
        require_method("device", device, "worn_by", "a ShoulderExo, which a wearer can wear")
        device, case = device.worn_by(case.wearer), replace(case, wearer=None)
    own = as_device(device)
    record, n = own.accelerate("pressures"), own.limb_count
    if record is None:
        _require_muscles(own.as_chain())
    muscles = each_limb(
        muscles_of_design(own) if actuators is None else actuators,
        n,
        PressureActuator,
        "force_limits(length), pressure_for(force, length) and stiffness(length, pressure)",
    )
    answer = solve(device, case, replace(assumptions, limits=muscles))
    lengths = answer.source.poses.lengths
    f = answer.actuator_forces.reshape(-1, n)
    held = np.flatnonzero(answer.held)
    pressures, axial = np.full(f.shape, np.nan), np.full(f.shape, np.nan)
    for i, muscle in enumerate(muscles if held.size else []):
        pressures[held, i] = in_reach(muscle.pressure_for, 1, f[held, i], lengths[held, i])[0]
        known = held[np.isfinite(pressures[held, i])]
        if known.size:
            axial[known, i] = in_reach(muscle.stiffness, 1, lengths[known, i], pressures[known, i])[0]
    shape = answer.status.shape
    stacked = (pressures.reshape(*shape, n), axial.reshape(*shape, n))
    if record is None:
        stiffness = _stiffness(own.as_chain(), case, answer, axial)
    else:
        stiffness = rotational_stiffness(record, case.poses, answer.actuator_forces, stacked[1], case.load)
    return PressurePlan(answer, *stacked, stiffness)


def _require_muscles(device: ChainDevice) -> None:
    """Raise unless the device holds the arm by drives that pull."""
    if not device.holds_alone:
        raise InvalidInput("expected drives that hold the arm: the wearer's own muscles have no pressures")
    if device.structure.held:
        raise InvalidInput("expected a device that does not move while the arm rests: its muscles would hold that, too")
    turning = [drive.name for drive in device.efforts if drive.route is None and not drive.pulls]
    if turning:
        raise InvalidInput(
            f"expected muscles along routes or in slides that pull, got {', '.join(turning)}, which work in a joint"
        )


def _stiffness(device: ChainDevice, case: Case, answer: Reaction, axial: FloatArray) -> FloatArray:
    """Restoring moment per rad at rest, shape (..., 3, 3), by small turns of the arm; the wrist's is in closed form."""
    from .device_poses import device_poses  # here: a wrist needs none of it

    poses = Rotation.from_matrix(case.query.matrices, assume_valid=True)
    count, load = len(poses), case.load
    if load is not None:
        shape = (*case.poses.shape, 3)
        force, moment, at = (np.broadcast_to(own, shape).reshape(-1, 3) for own in (load.force, load.moment, load.at))
        load = Load(force, moment, at, load.frame)
    here, f = answer.source.poses.lengths, answer.actuator_forces.reshape(count, -1)
    columns = []
    for axis in np.eye(3):
        ends = []
        for sign in (1.0, -1.0):
            turned = Rotation.from_rotvec(sign * _TURN * axis) * poses
            there, _ = device_poses(device, Case(turned, load=load), Assumptions(limits="none"))
            pulls = f + axial * (there.lengths - here)
            ends.append((there.state.moment_of_f @ pulls[..., None])[..., 0] - there.state.moment)
        columns.append((ends[1] - ends[0]) / (2.0 * _TURN))
    return np.stack(columns, axis=-1).reshape(*case.poses.shape, 3, 3)
