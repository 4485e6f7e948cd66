"""Runs of the named experiments, each made once for all tests of a process."""

import functools

import exo_pin as ep


def tracked(name, controller=None):
    """The run of an experiment, with its own controller if none is named."""
    return _run(name, ep.experiment(name).controller if controller is None else controller)


@functools.cache
def _run(name, controller):
    return ep.experiment(name, controller).run()
