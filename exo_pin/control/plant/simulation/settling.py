"""Where the plant comes to rest with constant pressures: the stable equilibrium that a damped motion leads to."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ....core.errors import SolverFailed
from ....core.validation import FloatArray
from ..equations.drive_kernels import AIR, COLUMNS, FLOWS, MOTOR_COLUMNS
from ..equations.plant_kernels import DONE, SHOULDER, Tables, advance, rates, state_parts

#: Viscous moment over angular velocity while it settles, N m s/rad: an arm of 1 kg then creeps.
_DAMPING = 0.5
#: Time that it gets in all, s, in pieces, and the moment that is left, N m.
_PATIENCE, _PIECE, _LEFT = 120.0, 0.5, 1e-12
#: Rounding of a limb's length, m: stiffness makes a moment of it (levers are shorter than a metre).
_ROUNDING = 2e-16
#: Step of the difference quotients, rad, and moment from which they are used, N m.
_DIFFERENCE, _NEAR = 1e-6, 1e-3


def settled(tables: Tables, start: FloatArray, near: Rotation) -> Rotation:
    """Orientation at rest, from ``near``, with pressures and positions of the drives as in the state ``start``.

    Friction is left out, and motors stand still.

    Raises
    ------
    SolverFailed
        If it does not come to rest.
    """
    n = len(tables.base)
    air, shoulder = tables.air.copy(), tables.shoulder.copy()
    air[AIR.index("exponent")] = 0.0  # the pressures stay
    shoulder[SHOULDER.index("viscous")] = _DAMPING
    shoulder[SHOULDER.index("coulomb")] = 0.0
    muscles = tables.muscles.copy()
    muscles[:, COLUMNS.index("friction") : COLUMNS.index("presliding")] = 0.0
    muscles[:, COLUMNS.index("pulley_friction")] = 0.0
    motors = tables.motors.copy()
    motors[:, MOTOR_COLUMNS.index("inverse_mass")] = 0.0
    still = tables._replace(air=air, shoulder=shoulder, muscles=muscles, motors=motors)
    flows = np.zeros((n, len(FLOWS)))
    flows[:, FLOWS.index("intact")] = 1.0
    q, y = near.as_quat(), start.copy()
    parts = state_parts(y)
    parts["angular_velocity"][:] = parts["drive_speeds"][:] = 0.0
    at_rest = _AtRest(still, flows, y)
    atol, step, time, ended = np.full(len(y), 1e-6), 1e-4, 0.0, DONE
    state_parts(atol)["drives"][tables.motors[:, 0] <= 0.0] = 1.0
    while time < _PATIENCE:
        ended, _, step, _ = advance(still, flows, q, y, _PIECE, step, 1e-6, atol)
        if ended != DONE:
            break
        time += _PIECE
        if np.linalg.norm(at_rest.moment(q)) < _NEAR and np.linalg.norm(y[3:6]) < _NEAR:
            found = _balanced(at_rest, q)
            if found is not None:
                return Rotation.from_quat(found)
    raise SolverFailed("rest of the plant", float(np.linalg.norm(at_rest.moment(q))), "it goes on moving")


class _AtRest:
    """The plant's arm at rest with constant pressures."""

    def __init__(self, tables: Tables, flows: FloatArray, y: FloatArray) -> None:
        self.tables, self.flows, self.y = tables, flows, y

    def moment(self, q: FloatArray, turn: FloatArray | None = None) -> FloatArray:
        """Moment on the arm, base frame, N m, at an orientation turned by a rotation vector."""
        at, out = self.y.copy(), np.zeros(len(self.y))
        at[:3] = 0.0 if turn is None else turn
        at[3:6] = 0.0
        rates(self.tables, self.flows, q, at, out)
        R = (Rotation.from_rotvec(at[:3]) * Rotation.from_quat(q)).as_matrix()
        return np.asarray(R @ self.tables.inertia @ R.T @ out[3:6])


def _balanced(arm: _AtRest, q: FloatArray) -> FloatArray | None:
    """Newton's method to where the moment vanishes; None if it does not, or the equilibrium is not stable."""
    place = q.copy()
    stiffness = arm.tables.motors[:, MOTOR_COLUMNS.index("stiffness")].sum()
    for _ in range(30):
        here = arm.moment(place)
        columns = [arm.moment(place, _DIFFERENCE * axis) - arm.moment(place, -_DIFFERENCE * axis) for axis in np.eye(3)]
        slope = np.array(columns).T / (2.0 * _DIFFERENCE)
        if np.linalg.norm(here) < _LEFT + _ROUNDING * stiffness:
            stable = np.linalg.eigvalsh(0.5 * (slope + slope.T)).max() < 0.0
            return place if stable else None
        shift = np.linalg.lstsq(slope, -here, rcond=1e-12)[0]
        shift *= min(1.0, 0.05 / max(float(np.linalg.norm(shift)), 1e-300))
        place = (Rotation.from_rotvec(shift) * Rotation.from_quat(place)).as_quat()
    return None
