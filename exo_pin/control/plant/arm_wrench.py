"""What reaches the person's arm along a run: from the device, from outside, and what it needs of both."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.validation import FloatArray
from ...load_case import Load
from .any_device.arm_actions import ArmBody, ArmState, arm_loads

if TYPE_CHECKING:
    from .plant import Plant
    from .run import Run


def carried(run: Run, body: ArmBody) -> tuple[FloatArray, FloatArray]:
    """Force and moment about O of the given force, payloads with inertia, and the torso, shape (N, 3) each."""
    motion = run.rotations.as_matrix(), run.angular_velocity, run.angular_acceleration
    return arm_loads(run.plant, body, run.times, *motion)


def acceleration(run: Run, point: FloatArray) -> FloatArray:
    """Of a point of the arm, shape (N, 3), m/s², base frame."""
    at, w = run.rotations.as_matrix() @ point, run.angular_velocity
    return np.cross(run.angular_acceleration, at) + np.cross(w, np.cross(w, at))


def posture_of(run: Run, rows: Any) -> FloatArray | None:
    """Configurations of a device whose joints move without a drive, (k, nq): where the run has them, and not at rest.

    None of other devices.
    """
    is_chain = run.plant.contractions is run.plant.equations
    return run.configurations[rows] if is_chain and run.plant.mechanism.structure.idle else None


def person_arm(plant: Plant) -> ArmBody:
    """The person's arm; of a dummy without one, all that moves."""
    arm = plant.mechanism.arm
    own = arm.person or arm
    return ArmBody(own.mass, own.centre_of_mass, own.inertia_about_origin)


def needed_moment(self: Run) -> FloatArray:
    """What device and wearer together put on the person's arm about O, shape (N, 3), N m, base frame.

    It moves the arm, with the torso, and bears its weight, payloads, the given force, and friction and stops. Parts
    of the device that turn with the arm are the device's; a dummy without a person's arm is taken whole.
    """
    arm, R = person_arm(self.plant), self.rotations.as_matrix()
    own, along = (np.einsum("kji,kj->ki", R, part) for part in (self.angular_velocity, self.angular_acceleration))
    rate = along @ arm.inertia.T + np.cross(own, own @ arm.inertia.T)
    inertial = np.einsum("kij,kj->ki", R, rate)
    weight = np.cross(R @ arm.centre, arm.mass * self.plant.tables.gravity)
    return np.asarray(inertial - weight - carried(self, arm)[1] - self.friction_moment - self.stop_moment)


def cuff_wrench(self: Run) -> FloatArray:
    """Force of the device on the person's arm, N, and its moment about O, N m, shape (N, 6), base frame.

    As in a reaction, less the weight and inertia of the device's own parts that turn with the arm; a dummy without
    a person's arm is taken whole. The moment is what the arm needs less what the wearer makes; it depends on no
    split. The force is that of :attr:`shoulder_force`.
    """
    arm = person_arm(self.plant)
    others = carried(self, arm)[0] + self.wearer_force + self.shoulder_force
    force = arm.mass * (acceleration(self, arm.centre) - self.plant.tables.gravity) - others
    return np.concatenate([force, self.needed_moment - self.wearer_moment], axis=1)


def external_load(self: Run, rows: Any = slice(None)) -> Load:
    """What acts on the person's arm beside weight, device and wearer: given force, payloads, torso, pushes.

    Parameters
    ----------
    rows : index
        Which samples.

    Returns
    -------
    Load
        Of shape (k,), base frame; forces are moved to O.

    Examples
    --------
    >>> from exo_pin import control
    >>> exo, shove = ep.load("four-cables"), control.Push(ep.Load([20.0, 0.0, 0.0], at=(0.0, 0.0, -0.3)))
    >>> plant = ep.Plant(exo, wearer=shove)
    >>> run = plant.simulate(lambda t, seen: np.full(4, 0.1), 0.02, plant.held(exo.pose(), np.full(4, 40.0)))
    >>> run.external_load().force[0]  # N
    array([20.,  0.,  0.])
    """
    force, moment = (part[rows].copy() for part in carried(self, person_arm(self.plant)))
    pushes = [action for action in self.plant.wearer if getattr(action, "external", False)]
    states = zip(self.times[rows], self.rotations[rows].as_matrix(), self.angular_velocity[rows], strict=True)
    for k, (t, R, w) in enumerate(states):
        for push in pushes:
            found = push(float(t), ArmState(R, w))
            force[k], moment[k] = force[k] + found[0], moment[k] + found[1]
    return Load(force, moment)
