"""Where the plant comes to rest with constant pressures: the stable equilibrium that a damped motion leads to.

Limbs with mass add the moment of their weight. A half of mass m_k whose centre lies c_k along the limb from its own
joint, the base's (1) or the platform's (2), puts on the arm about O, by virtual power with ds/dt = (ω × b)_⊥ / l,

    M_1 = m_1 (c_1/l) b × g_⊥        M_2 = m_2 b × g - m_2 (c_2/l) b × g_⊥        g_⊥ = g - (g·s) s

The arm then creeps, M = d ω, instead of swinging with damping: at rest the limbs' inertia does not matter.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from ....core.errors import SolverFailed
from ....core.validation import FloatArray
from ....design import Limb
from ..equations.drive_kernels import AIR, FLOWS
from ..equations.integrator import DONE, advance
from ..equations.motor_kernels import MOTOR_COLUMNS
from ..equations.muscle_kernels import COLUMNS
from ..equations.plant_kernels import SHOULDER, Tables, rates

__all__ = ["settled"]

#: Viscous moment over angular velocity while it settles, N m s/rad: an arm of 1 kg then creeps.
_DAMPING = 0.5
#: Time that it gets in all, s, in pieces, and the moment that is left, N m.
_PATIENCE, _PIECE, _LEFT = 120.0, 0.5, 1e-12
#: Rounding of a limb's length, m: stiffness makes a moment of it (levers are shorter than a metre).
_ROUNDING = 2e-16
#: Step of the difference quotients, rad, and moment from which they are used, N m.
_DIFFERENCE, _NEAR = 1e-6, 1e-3


def settled(tables: Tables, start: FloatArray, near: Rotation, limbs: Sequence[Limb] = ()) -> Rotation:
    """Orientation at rest, from ``near``, with pressures and positions of the drives as in the state ``start``.

    The weight of limbs counts. Friction is left out, and motors stand still.

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
    y[3:6] = y[13 + 5 * n : 13 + 6 * n] = 0.0
    at_rest = _AtRest(still, flows, y, _halves(limbs))
    atol, step, time, ended = np.full(len(y), 1e-6), 1e-4, 0.0, DONE
    atol[6 : 6 + n][tables.motors[:, 0] <= 0.0] = 1.0
    while time < _PATIENCE:
        if at_rest.halves is None:
            ended, _, step, _ = advance(still, flows, q, y, _PIECE, step, 1e-6, atol)
        else:
            q = at_rest.crept(q)
        if ended != DONE:
            break
        time += _PIECE
        if np.linalg.norm(at_rest.moment(q)) < _NEAR and np.linalg.norm(y[3:6]) < _NEAR:
            found = _balanced(at_rest, q)
            if found is not None:
                return Rotation.from_quat(found)
    raise SolverFailed("rest of the plant", float(np.linalg.norm(at_rest.moment(q))), "it goes on moving")


def _halves(limbs: Sequence[Limb]) -> FloatArray | None:
    """Mass times the distance of its centre from the own joint, of both halves, and mass of the second, (3, n)."""
    if not any(limb.mass for limb in limbs):
        return None
    rows = [[(0.0, 0.0) if h is None else (h.mass, h.centre) for h in (b.base_body, b.platform_body)] for b in limbs]
    mass, centre = np.moveaxis(np.array(rows), -1, 0)
    return np.array([*(mass * centre).T, mass[:, 1]])


class _AtRest:
    """The plant's arm at rest with constant pressures; ``halves`` as of :func:`_halves`."""

    def __init__(self, tables: Tables, flows: FloatArray, y: FloatArray, halves: FloatArray | None) -> None:
        self.tables, self.flows, self.y, self.halves = tables, flows, y, halves

    def moment(self, q: FloatArray, turn: FloatArray | None = None) -> FloatArray:
        """Moment on the arm, base frame, N m, at an orientation turned by a rotation vector."""
        at, out = self.y.copy(), np.zeros(len(self.y))
        at[:3] = 0.0 if turn is None else turn
        at[3:6] = 0.0
        rates(self.tables, self.flows, q, at, out)
        R = (Rotation.from_rotvec(at[:3]) * Rotation.from_quat(q)).as_matrix()
        return np.asarray(R @ self.tables.inertia @ R.T @ out[3:6]) + self._weight_of_limbs(R)

    def _weight_of_limbs(self, R: FloatArray) -> FloatArray:
        if self.halves is None:
            return np.zeros(3)
        base, platform, mass = self.halves
        b, g = self.tables.platform @ R.T, self.tables.gravity
        span = b - self.tables.base
        length = np.linalg.norm(span, axis=1)
        s = span / length[:, None]
        across = g - (s @ g)[:, None] * s
        force = ((base - platform) / length)[:, None] * across + mass[:, None] * g
        return np.asarray(np.cross(b, force).sum(axis=0))

    def crept(self, q: FloatArray) -> FloatArray:
        """Where the arm creeps to in one piece of time."""

        def rate(_: float, xi: FloatArray) -> FloatArray:
            # exp(ξ + dξ) = exp(J_l dξ) exp(ξ), J_l(ξ) = J_r(ξ)ᵀ.
            return np.asarray(pin.Jlog3(pin.exp3(xi)).T @ self.moment(q, xi) / _DAMPING)

        # Cables and screws are stiff beside the damping.
        found = solve_ivp(rate, (0.0, _PIECE), np.zeros(3), method="Radau", rtol=1e-6, atol=1e-8)
        return np.asarray((Rotation.from_rotvec(found.y[:, -1]) * Rotation.from_quat(q)).as_quat())


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
