"""The plant in time as the closed chain, from instant to instant."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ....core.errors import ExoPinError
from ....core.progress import track
from ....core.validation import FloatArray
from ....numerics.vectors import matrix
from ..equations.stop_kernels import stop_moment
from ..run import Run
from .chain_motion import ChainMotion, Piece
from .drive_schedule import SAME, DriveSchedule
from .scenario import Loop, Scenario, first_state

__all__ = ["simulate_chain"]


def simulate_chain(scenario: Scenario) -> Run:
    """See :meth:`exo_pin.control.plant.plant.Plant.simulate`, method "chain"."""
    plant, start, loop = scenario.plant, scenario.start, Loop(scenario)
    y = first_state(plant, start)
    motion = ChainMotion(plant, start.orientation, start.angular_velocity, y, scenario.rtol)
    chain_rows, status, before = [], "completed", 0.0
    for instant in track(scenario.instants(), "simulating", scenario.progress):
        time = instant.time
        try:
            motion.advance(_pieces(loop.schedule, before, time) if time > 0.0 else [])
        except ExoPinError as error:
            status = f"stopped after {before:.6g} s: {error}"
            break
        before = time
        motion.intact = loop.at(instant, *motion.kinematics())[:, 6]
        if instant.sample:
            chain_rows.append(_chain_row(motion))
    return _completed(loop.run(status, 0), np.array(chain_rows))


def _pieces(schedule: DriveSchedule, start: float, end: float) -> list[Piece]:
    """The time between two instants, cut where valves switch."""
    pieces: list[Piece] = []
    time = start
    while True:
        flows = schedule.flows(time)
        switch = min(schedule.next_switch(time), end)
        if end - switch < SAME:
            return [*pieces, Piece(time, end, flows)]
        pieces.append(Piece(time, switch, flows))
        schedule.start(switch)
        time = switch


def _chain_row(motion: ChainMotion) -> FloatArray:
    """Of the chain at one instant: acceleration and friction moment of the arm, energies, work and residual."""
    chain, q, v, R = motion.chain, motion.q, motion.v, motion.rotation
    efforts, external = motion.loads()
    found = chain.forward_dynamics(q, v, efforts, external=external)
    friction = found.friction[:3] - chain.model.damping[:3] * v[:3]
    rest = chain.simulate(q, v, [0.0], efforts)
    w, joint = tuple(motion.angular_velocity.tolist()), motion.tables.shoulder
    stops = stop_moment(matrix(R), w, *joint[4:9].tolist())[2] if joint[3] > 0.0 else 0.0
    lifted = stops - motion.tables.force @ (R @ motion.tables.point)
    energies = [rest.kinetic_energy[0], rest.energy[0] - rest.kinetic_energy[0] + lifted]
    return np.concatenate(
        [R @ found.a[:3], R @ friction, energies, [motion.work, motion.dissipated, motion.opening, lifted]]
    )


def _completed(run: Run, chain: FloatArray) -> Run:
    """A run with what its chain says in place of the closed forms.

    The energy's balance is the chain's own: gain of energy less the work of tensions, load and stops, and dissipation.
    """
    kinetic, potential, work, dissipated, opening, lifted = chain[:, 6:].T
    # What load and stops stored is part of the potential, what stops took part of the loss.
    held = run.tension_work.sum(axis=1) - work + dissipated - (lifted - lifted[0])
    return replace(
        run,
        angular_acceleration=chain[:, :3],
        friction_moment=chain[:, 3:6],
        kinetic_energy=kinetic,
        potential_energy=potential,
        shoulder_loss=held,
        loop_residual=opening,
    )
