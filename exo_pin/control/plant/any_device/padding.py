"""Cuff and harness that give way: springs of six freedoms with dampers between the device and the person.

The displacement d of the device's part against the body under it, and its rotation vector, are those of
:mod:`exo_pin.device.elastic.springs`, and so is the stiffness K. With the damping time τ the wrench on the part is

    -K (d + τ d')
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin

from ....chain.dynamics.nonsmooth.projected_motion import response_at
from ....chain.structure.motion_axes import v_slice
from ....core.errors import MasslessMotion, MissingData
from ....core.errors.checked import checked
from ....core.validation import FloatArray, set_positive
from ....device import ChainDevice
from ....device.device_model import DeviceModel
from ....device.elastic.soft_tree import padded_device
from ....device.elastic.springs import CUFF, HARNESS, PlacedSpring
from ....device.postures import following, postures
from .arm_actions import require_known

if TYPE_CHECKING:
    from ..run import Run

#: Joints of the parts, by the names that a plant gives them.
_JOINTS = {"cuff": CUFF, "harness": HARNESS}
_NONE = np.zeros(3)


@checked
@dataclass(frozen=True, kw_only=True)
class Padding:
    """How a cuff or a harness moves on its spring, whose stiffness is that of the device's interface.

    Parameters
    ----------
    damping_time : float
        Damping over stiffness τ, s.
    mass : float
        Of the part besides the device's own links and its part of the arm (:attr:`exo_pin.Arm.device`), which goes with
        the cuff, kg, at the point of its spring; needed where these have none.
    radius : float
        Of gyration of that mass, m, about every axis.
    source : str
        Where the numbers are from.

    Raises
    ------
    MissingData
        If damping or source is not given: no damping of a cuff on a person is taken for known.

    Examples
    --------
    >>> from exo_pin import control
    >>> exo = ep.load("urdf/serial-y-x-z.urdf")
    >>> exo = exo.replace(interfaces=ep.Interfaces(cuff=ep.Interface.upper_arm_cuff(distance=0.2)))
    >>> pad = control.Padding(damping_time=0.01, source="an assumption for this example")
    >>> plant = ep.Plant(exo, cuff=pad)
    >>> run = plant.simulate(lambda t, seen: [0.0, 0.0, -0.1], 0.05, plant.state(exo.pose(flexion=20)))
    >>> run.cuff_displacement.shape, bool(np.abs(run.energy_residual).max() < 1e-6)  # J
    ((6, 6), True)
    """

    damping_time: float | None = None
    mass: float = 0.0
    radius: float = 0.0
    source: str = ""

    def __post_init__(self) -> None:
        require_known(self.source, {"damping_time": self.damping_time}, "a cuff or harness that gives way")
        set_positive(self, "damping_time", "mass", "radius", zero=True)


class Pads:
    """Cuff and harness of a device that give way, in its trees.

    Parameters
    ----------
    device : ChainDevice
    given : mapping of str to Padding
        "cuff", "harness".

    Raises
    ------
    MissingData
        If the device has no stiffness of one, or its part no mass.
    """

    def __init__(self, device: ChainDevice, given: Mapping[str, Padding]) -> None:
        self._made_of = device, dict(given)
        missing = [f"interfaces.{name}.stiffness" for name in given if getattr(device.interfaces, name) is None]
        if missing:
            raise MissingData(missing, "a plant with padding", device.name)
        worn = device.require_arm("a plant with padding", inertia=True)
        on_cuff = [part for part in worn.parts if part.device and "cuff" in given]
        if on_cuff:
            # What the device has on the arm moves with the cuff.
            if worn.person is None:
                raise MissingData(["arm of a person"], "a cuff that gives way", device.name)
            device = device.replace(arm=worn.person)
        #: The same with rigid parts, in whose configurations no spring is displaced.
        self.rigid = DeviceModel(device)
        self.model, springs = padded_device(device, tuple(_JOINTS[name] for name in given))
        held, by_joint = self.model.held.model, {one.name: one for one in springs if isinstance(one, PlacedSpring)}
        self._springs = {name: by_joint[_JOINTS[name]] for name in given}
        self._places = {name: v_slice(held, held.getJointId(_JOINTS[name])) for name in given}
        self._times = {name: float(pad.damping_time) for name, pad in given.items() if pad.damping_time is not None}
        bodies = [(name, pin.Inertia(pad.mass, self._springs[name].at, pad.mass * pad.radius**2 * np.eye(3)))
                  for name, pad in given.items()]  # fmt: skip
        bodies += [("cuff", pin.Inertia(part.mass, part.centre_of_mass, part.inertia)) for part in on_cuff]
        for name, body in bodies:
            for tree in (held, self.model.free.model):
                tree.inertias[tree.getJointId(_JOINTS[name])] += body
        self._require_mass(device.name, given)

    def __reduce__(self) -> Any:
        # A model that is unpickled is made of its device, and has not the bodies that were added here.
        return Pads, self._made_of

    def _require_mass(self, device: str, given: Mapping[str, Padding]) -> None:
        """Raise where a part moves nothing that has mass."""
        try:
            response_at(self.model.held, self.undisplaced(postures(self.rigid, np.eye(3)[None]).q[0]))
        except MasslessMotion as error:
            names = [f"mass and radius of the {name} (Padding)" for name in given]
            raise MissingData(names, "a plant with padding", device, str(error)) from None

    def undisplaced(self, q: FloatArray) -> FloatArray:
        """The configuration, shape (nq,), of that of the rigid device."""
        state, given, out = self.model.held, self.rigid.held, self.model.held.neutral()
        for name in list(given.model.names)[1:]:
            out[state.configuration_slice(name)] = q[given.configuration_slice(name)]
        return out

    def following(self, q: FloatArray, turning: FloatArray) -> FloatArray:
        """Motion of all joints, shape (nv,), at a configuration of the rigid device, for one of the arm, own axes."""
        state, given, out = self.model.held, self.rigid.held, np.zeros(self.model.held.nv)
        v = following(self.rigid, q, turning)
        for name in list(given.model.names)[1:]:
            out[state.velocity_slice(name)] = v[given.velocity_slice(name)]
        return out

    def forces(self, q: FloatArray, v: FloatArray, tau: FloatArray) -> float:
        """Add the generalised forces to those of the held tree, shape (nv,); return the power that dampers take, W."""
        taken = 0.0
        for name, spring in self._springs.items():
            J, own = spring.jacobian(q, _NONE, _NONE), self._places[name]
            rate = J @ v[own]
            damped = self._times[name] * (spring.stiffness @ rate)
            tau[own] -= J.T @ (spring.stiffness @ spring.displacement(q, _NONE, _NONE) + damped)
            taken += float(rate @ damped)
        return taken

    def energy(self, q: FloatArray) -> float:
        """Of the springs, J."""
        moved = [(spring.displacement(q, _NONE, _NONE), spring.stiffness) for spring in self._springs.values()]
        return sum(0.5 * float(d @ K @ d) for d, K in moved)

    def displacement(self, name: str, q: FloatArray) -> FloatArray:
        """Displacement and rotation vector of a part at its spring's point, shape (6,), m and rad; zero if rigid."""
        spring = self._springs.get(name)
        return np.zeros(6) if spring is None else spring.displacement(q, _NONE, _NONE)


def displacements(run: Run, name: str) -> FloatArray:
    """Those of a part along a run, shape (N, 6), m and rad."""
    pads = None if run.plant.equations is None else run.plant.equations.pads
    moved = [np.zeros(6) if pads is None else pads.displacement(name, q) for q in run.configurations]
    return np.array(moved).reshape(-1, 6)
