"""Runs of the plant as the closed chain, for tests; see :mod:`plant_chain_motion`."""

from dataclasses import replace

import numpy as np
from plant_chain_motion import ChainMotion

from exo_pin import ExoPinError
from exo_pin.control.plant.simulation import Clock, PlantSimulation


class ChainSimulation:
    """The motion of a chain, as a simulation moves it."""

    def __init__(self, plant, start, rtol):
        self._moved = ChainMotion(plant, start, rtol)
        # Every piece of time chooses its first step by itself.
        self.step, self.steps = start.step, 0

    def kinematics(self):
        """Quaternion and state of the equations, with ξ = 0."""
        return self._moved.kinematics()

    def advance(self, pieces):
        """Move on through some pieces of time; return when and why that did not succeed, or nothing."""
        try:
            self._moved.advance(pieces)
        except ExoPinError as error:
            return f"stopped after {pieces[0].start:.6g} s: {error}"
        return ""

    def act(self, flows):
        """Take over what acts from now on: which limbs are whole."""
        self._moved.intact = flows[:, 6]

    def observed(self):
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


def _completed(run, chain):
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
    ), opening


class _OfChain(PlantSimulation):
    """A simulation that moves the closed chain, and observes it where it is recorded."""

    def __init__(self, plant, controller, instants, start, rtol):
        super().__init__(plant, controller, instants, start, (), None, rtol)
        self.motion, self.observed = ChainSimulation(plant, start, rtol), []

    def _at(self, instant):
        wrong = super()._at(instant)
        self.observed.append(self.motion.observed())
        return wrong


def chain_run(plant, controller, duration, start, rtol):
    """:meth:`Plant.simulate` at 100 Hz as the closed chain, and the loops' residual."""
    instants = Clock(duration, 100.0, 100.0, start.time).instants(())
    simulation = _OfChain(plant, controller, instants, start, rtol)
    return _completed(simulation.run(), np.array(simulation.observed))
