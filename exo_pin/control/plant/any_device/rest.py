"""Where a plant comes to rest, with pressures and positions of drives that stay, and without friction.

A wrist's arm is integrated (:func:`~exo_pin.control.plant.state.settled`). Of another device, in coordinates z of the
motions, g(z) is the generalised force and S its slope. A damped motion follows g to where it vanishes and S is
negative; so does, in steps that are short turns,

    dz = (μ - S)⁻¹ g

with μ above every eigenvalue of S and as large as the length of a step needs: Newton's method near the end.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from ....chain.dynamics.nonsmooth.projected_motion import response_at
from ....chain.kinematics.closing import close
from ....chain.kinematics.loops import refined
from ....core.errors import SolverFailed
from ....core.validation import FloatArray
from ..state import equations_state, first_chain, settled, still_flows
from .device_equations import DeviceEquations

if TYPE_CHECKING:
    from ..plant import Plant
    from ..state import PlantState

#: Longest step of a coordinate, rad and m; most steps; step of differences; length of a last step.
_LONGEST, _STEPS, _DIFFERENCE, _LAST = 0.05, 500, 1e-6, 1e-9
#: By how much μ is above the eigenvalues of S, over the largest of them; an eigenvalue over the largest that is none.
_ABOVE, _NOTHING = 0.5, 1e-12


def rest_of(plant: Plant, start: PlantState) -> PlantState:
    """The state of rest that short steps from another lead to, without friction and with drives that stand still.

    Raises
    ------
    SolverFailed
        If it does not come to rest.
    """
    if plant.equations is None:
        pose, chain = settled(plant.tables, equations_state(start, plant.motors), start.orientation), start.chain
    else:
        q, chain = _device_rest(plant.equations, plant, start)
        pose = Rotation.from_quat(q)
    here = plant.state(pose, pressures=start.pressures, drive_positions=start.drive_positions)
    # Where cuff, harness and joints that no drive moves have come to, too.
    return replace(here, chain=chain)


def _device_rest(given: DeviceEquations, plant: Plant, start: PlantState) -> tuple[FloatArray, FloatArray]:
    """Quaternion of the arm, and the chain's part of the state."""
    own, y, flows = given.still(), equations_state(start, plant.motors), still_flows(plant.count)
    own.carry(own.held(start.time, before=True))
    none, still = np.zeros(own.nv), np.zeros(len(own.rubbing))

    def pushed(q: FloatArray) -> tuple[FloatArray, FloatArray]:
        a, motion = own.rates(start.time, q, none, y, still, flows)[0].a, response_at(own.state, q)
        mass = (motion.ways * motion.sizes) @ motion.ways.T
        return motion.basis, mass @ (motion.basis.T @ (a / motion.column))

    def moved(q: FloatArray, step: FloatArray) -> FloatArray:
        found = own.moved(q, step)
        return refined(own.state, close(own.state, found, restarts=0)) if own.state.row_count else found

    q = _settled(start.chain[: own.nq].copy(), pushed, moved, own.state.topology.column)
    return q[own.model.arm_q], first_chain(q, none, len(own.rubbing))


def _settled(
    q: FloatArray,
    pushed: Callable[[FloatArray], tuple[FloatArray, FloatArray]],
    moved: Callable[[FloatArray, FloatArray], FloatArray],
    lengths: FloatArray,
) -> FloatArray:
    """The configuration at rest that steps from another lead to.

    Parameters
    ----------
    q : ndarray
        Where they begin.
    pushed : callable
        From a configuration to its motions, in lengths of one, shape (nv, k), and the generalised forces on them.
    moved : callable
        From a configuration and a step, shape (nv,), to the configuration after it.
    lengths : ndarray
        Shape (nv,), which take those lengths to metres.
    """
    column = lengths[:, None]
    longest, step = _LONGEST, np.inf
    basis, g = pushed(q)
    for _ in range(_STEPS):
        slope = np.zeros((len(g), len(g)))
        for k, way in enumerate((column * basis).T):
            motions, force = pushed(moved(q, _DIFFERENCE * way))
            slope[:, k] = (basis.T @ motions @ force - g) / _DIFFERENCE
        values, ways = np.linalg.eigh(0.5 * (slope + slope.T))
        above = (1.0 + _ABOVE) * max(0.0, float(values.max(initial=0.0)))
        ways = basis @ ways
        along = ways.T @ basis @ g
        dz = _shortened(values, along, above, longest, column * ways)
        change = lengths * (ways @ dz)
        step, there = float(np.abs(change).max(initial=0.0)), moved(q, change)
        motions, force = pushed(there)
        if (ways.T @ motions @ force) @ dz < -abs(along @ dz) and step > _LAST:
            # Beyond the place where the force along the step vanishes, and farther from it.
            longest = 0.5 * min(longest, step)
            continue
        q, basis, g, longest = there, motions, force, min(_LONGEST, 2.0 * longest)
        if step < _LAST:
            return q
    raise SolverFailed("rest of the plant", step, "it goes on moving")


def _shortened(values: FloatArray, along: FloatArray, least: float, longest: float, ways: FloatArray) -> FloatArray:
    """(μ - S)⁻¹ g, in eigenvectors of S, with μ from ``least`` on so large that no coordinate moves farther."""
    scale = max(float(np.abs(values).max(initial=0.0)), 1e-12)
    while True:
        divisor = least - values
        dz = np.divide(along, divisor, out=np.zeros(len(along)), where=np.abs(divisor) > _NOTHING * scale)
        if float(np.abs(ways @ dz).max(initial=0.0)) <= longest:
            return dz
        least = max(2.0 * least, 1e-9 * scale)
