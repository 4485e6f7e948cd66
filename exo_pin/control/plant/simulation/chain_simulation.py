"""The plant in time as the closed chain, from instant to instant."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ....core.errors import ExoPinError
from ....core.validation import FloatArray
from ..run import Run
from ..state import PlantState
from .chain_motion import ChainMotion
from .drive_schedule import Piece

if TYPE_CHECKING:
    from ..plant import Plant

__all__ = ["ChainSimulation", "completed"]


class ChainSimulation:
    """The motion of a chain, as a simulation moves it."""

    def __init__(self, plant: Plant, start: PlantState, rtol: float) -> None:
        self._moved = ChainMotion(plant, start, rtol)
        # Every piece of time chooses its first step by itself.
        self.step, self.steps = start.step, 0

    @property
    def chain_state(self) -> FloatArray:
        """As :attr:`PlantState.chain`."""
        now = self._moved
        return np.concatenate([now.q, now.v, [now.work, now.dissipated, now.opening]])

    def kinematics(self) -> tuple[FloatArray, FloatArray]:
        """Quaternion and state of the equations, with ξ = 0."""
        return self._moved.kinematics()

    def advance(self, pieces: list[Piece]) -> str:
        """Move on through some pieces of time; return when and why that did not succeed, or nothing."""
        try:
            self._moved.advance(pieces)
        except ExoPinError as error:
            return f"stopped after {pieces[0].start:.6g} s: {error}"
        return ""

    def act(self, flows: FloatArray) -> None:
        """Take over what acts from now on: which limbs are whole."""
        self._moved.intact = flows[:, 6]

    def observed(self) -> FloatArray:
        """Of the chain at this instant: acceleration and friction moment of the arm, energies, work and residual."""
        now = self._moved
        chain, q, v, R = now.chain, now.q, now.v, now.rotation
        efforts, external = now.loads()
        found = chain.forward_dynamics(q, v, efforts, external=external)
        friction = found.friction[:3] - chain.model.damping[:3] * v[:3]
        rest = chain.simulate(q, v, [0.0], efforts)
        stored = now.stored()
        energies = [rest.kinetic_energy[0], rest.energy[0] - rest.kinetic_energy[0] + stored]
        return np.concatenate(
            [R @ found.a[:3], R @ friction, energies, [now.work, now.dissipated, now.opening, stored]]
        )


def completed(run: Run, chain: FloatArray) -> Run:
    """A run with what its chain says in place of the closed forms.

    The energy's balance is the chain's own: gain of energy less the work of tensions, load and stops, and dissipation.
    """
    kinetic, potential, work, dissipated, opening, stored = chain[:, 6:].T
    # What load and stops stored is part of the potential, what stops took part of the loss.
    held = run.tension_work.sum(axis=1) - work + dissipated - stored
    return replace(
        run,
        angular_acceleration=chain[:, :3],
        friction_moment=chain[:, 3:6],
        kinetic_energy=kinetic,
        potential_energy=potential,
        shoulder_loss=held,
        loop_residual=opening,
    )
