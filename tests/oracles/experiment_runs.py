"""Runs of the named experiments, each made once for all tests of a process."""

import functools
from contextlib import contextmanager
from importlib import import_module

import pytest

import exo_pin as ep


def tracked(name, controller=None):
    """The run of an experiment, with its own controller if none is named."""
    return _run(name, ep.experiment(name).controller if controller is None else controller)


@functools.cache
def _run(name, controller):
    return ep.experiment(name, controller).run()


@contextmanager
def one_estimate():
    """Forces after a fault over the estimates as they are, for tests that are not about their range."""
    module = import_module("exo_pin.control.experiments.sensitivity")
    with pytest.MonkeyPatch.context() as patch:
        for name in ("CHANGES", "MOTOR_CHANGES"):
            patch.setattr(module, name, ())
        yield
