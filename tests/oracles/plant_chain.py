"""Runs of a wrist's plant as its closed chain, for tests: Pinocchio's tree and loops instead of closed forms."""

from dataclasses import replace

import numpy as np

import exo_pin as ep


def chain_run(plant, controller, duration, start, rtol):
    """:meth:`Plant.simulate` at 100 Hz as the closed chain, and the loops' residual."""
    whole = ep.Plant(plant.mechanism, plant.options, plant.load, wearer=lambda t, arm: np.zeros(3))
    begin = replace(start, chain=whole.state(start.orientation, start.angular_velocity).chain)
    run = whole.simulate(controller, duration, begin, rtol=rtol)
    state = whole.equations.state
    return run, np.array([state.buffers.residual(q) for q in run.configurations])
