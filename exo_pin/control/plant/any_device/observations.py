"""What a run reports of a device that moves as its closed chain: forces of shoulder and limbs, and energies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ....chain.dynamics.equations.equations_of_motion import moving_loops, open_tree
from ....chain.dynamics.integration import Instant, energies_of
from ....core.validation import FloatArray
from ....numerics.vectors import matrix
from ..drives import MotorDrive
from ..equations.drive_kernels import FLOWS, limb_tension, motor_energy, motor_force
from ..equations.plant_kernels import state_places, stop_moment
from .moving_torso import carried_along

if TYPE_CHECKING:
    from ..state import Snapshot
    from .device_equations import DeviceEquations, Forces

#: Share of the largest singular value that is none.
_RANK = 1e-9
_INTACT, _EFFORT, _POWERED = (FLOWS.index(name) for name in ("intact", "effort", "powered"))


def shoulder_force(of: DeviceEquations, q: FloatArray, v: FloatArray, found: Forces) -> FloatArray:
    """F_s in a motion, shape (3,), N, base frame; NaN where equilibrium of the links does not determine it.

    The same tree with an arm that flies free needs it besides the forces of the loops, which its other rows give.
    """
    model, free, R = of.model, of.model.free, of.rotation(q)
    own, motion = model.free_configuration(q), model.free_motion(np.array([v, found.a]))
    free.buffers.jacobian_rates(own, motion[0])
    moving_loops(free, own, motion[0])
    left = open_tree(free, own, motion[0], motion[1], None)
    J = free.buffers.jacobian * free.topology.row_scale[:, None]
    tau = np.zeros(free.nv)
    tau[model.v_of], tau[model.angular] = found.tau[model.v_from], found.tau[model.arm_v]
    tau[model.linear] = R.T @ (found.route_force + found.wearer_force + of.tables.force)
    if found.torso is not None:
        along = carried_along(free, model.centre, model.carried, model.owners, found.torso)
        tau[model.linear] += along[model.linear]
    left -= tau
    scale = free.topology.column
    U, sizes, Vt = np.linalg.svd((J * scale).T[model.rest])
    rank = int((sizes > _RANK * sizes.max(initial=0.0)).sum())
    # Loops may stress each other as long as the shoulder does not feel it.
    if np.abs(Vt[rank:] @ J[:, model.linear]).max(initial=0.0) > _RANK * np.abs(J).max(initial=0.0):
        return np.full(3, np.nan)
    loops = Vt[:rank].T @ (U[:, :rank].T @ (left * scale)[model.rest] / sizes[:rank])
    return np.asarray(R @ (left - J.T @ loops)[model.linear])


def energies(of: DeviceEquations, q: FloatArray, v: FloatArray, rates: FloatArray) -> tuple[float, float]:
    """Kinetic energy without that of motors, and potential of weight, springs, padding, load and stops, J."""
    whole, kinetic = energies_of(of.state, Instant(q, v, 0.0, 0.0))
    of.state.buffers.linearise(q)
    poses = of.state.buffers.poses
    springs = sum(float(spring.law.energy(of.coordinate(place, q, poses))) for spring, place in of.elastic)
    R, tables, joint = of.rotation(q), of.tables, of.tables.shoulder
    stop = stop_moment(matrix(R), (0.0, 0.0, 0.0), *joint[4:9].tolist())[2] if joint[3] > 0.0 else 0.0
    own = 0.5 * float(of.motors.inertia @ rates[of.direct] ** 2)
    springs += stop + (0.0 if of.pads is None else of.pads.energy(q))
    return kinetic - own, whole - kinetic + springs - float(tables.force @ (R @ tables.point))


def _limb_numbers(of: DeviceEquations, found: Forces, y: FloatArray, flows: FloatArray) -> FloatArray:
    """Length, rate, tension, contraction, force of the motor and energy stored in each drive, shape (n, 6)."""
    out, tables = np.zeros((of.count, 6)), of.tables
    out[:, 0], out[:, 1], out[:, 2], out[:, 4] = found.coordinates, found.rates, found.efforts, found.sources
    places = state_places(of.count)
    for i in of.limbs:
        length, rate = float(out[i, 0]), float(y[places["drive_speeds"]][i])
        out[i, 3] = limb_tension(tables, i, y, float(out[i, 1]), length)[1]
        if isinstance(of.drives[i], MotorDrive):
            row = tables.motors[i]
            out[i, 4] = flows[i, _POWERED] * motor_force(row, flows[i, _EFFORT], of.signs[i] * rate)
            out[i, 5] = motor_energy(row, length, y[places["drives"]][i], rate, flows[i, _INTACT])
    if len(of.direct):
        own = of.direct
        out[own, 5] = of.motors.stops(out[own, 0], out[own, 1])[2] + 0.5 * of.motors.inertia * out[own, 1] ** 2
    return out


def observed(
    of: DeviceEquations,
    snapshots: Sequence[Snapshot],
    flows: FloatArray,
    arrays: tuple[FloatArray, FloatArray, FloatArray],
) -> FloatArray:
    """Fill what :func:`.plant_kernels.observe` fills; force and moment of the wearer, and F_s, shape (N, 9)."""
    (motion, limbs, energy), more = arrays, np.zeros((len(snapshots), 9))
    places: Any = np.cumsum([of.nq, of.nv, len(of.rubbing)])
    for k, now in enumerate(snapshots):
        q, v, bristles, _ = np.split(now.chain, places)
        of.carry(of.held(now.time, before=True))
        found, _, _ = of.rates(now.time, q, v, now.y, bristles, flows[k])
        R = of.rotation(q)
        motion[k] = np.concatenate([R @ found.a[of.model.arm_v], found.friction, found.stops])
        limbs[k] = _limb_numbers(of, found, now.y, flows[k])
        energy[k] = energies(of, q, v, found.rates)
        more[k] = np.concatenate([found.wearer_force, found.wearer_moment, shoulder_force(of, q, v, found)])
    return more
