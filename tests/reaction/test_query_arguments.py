"""Answers cannot be written to, and no bar is shown unless it is asked for."""

import dataclasses
import importlib
import inspect
import pkgutil

import numpy as np
import pytest
from wrists import (
    DEGREES,
    map_of,
)

import exo_pin as ep
from exo_pin import reaction


@pytest.fixture(scope="module")
def prototype():
    return ep.load("prototype")


def arrays_of(record):
    """All arrays of a record and of the records in it, by name."""
    for name, value in vars(record).items():
        if isinstance(value, np.ndarray):
            yield name, value
        elif dataclasses.is_dataclass(value):
            yield from arrays_of(value)


def test_answers_are_read_only(prototype):
    poses = ep.shoulder_rotation([10, 60], 30, 0, **DEGREES)
    pulling = prototype.reaction(poses, limits="pull")
    assert pulling.infeasibility is not None
    by_stiffness = prototype.replace(shoulder=ep.Shoulder(stiffness=2e4)).reaction(poses, split="elastic")
    records = [
        pulling,
        by_stiffness,
        pulling.certificate,
        prototype.reaction_map(poses),
        map_of(prototype.mechanism, poses),
    ]
    for record in records:
        named = list(arrays_of(record))
        assert len(named) >= 5
        assert [name for name, array in named if array.flags.writeable] == []
    with pytest.raises(ValueError, match="read-only"):
        by_stiffness.shoulder_force[0] = 0.0


def functions():
    """Every function and method of the room, with its name."""
    for info in pkgutil.walk_packages(reaction.__path__, "exo_pin.reaction."):
        for owner in vars(importlib.import_module(info.name)).values():
            for function in (owner, *vars(owner).values()) if inspect.isclass(owner) else (owner,):
                if inspect.isfunction(function) and function.__module__.startswith(reaction.__name__):
                    yield function.__qualname__, function


def test_no_bar_is_shown_unless_it_is_asked_for():
    defaults = {
        name: shown.default
        for name, function in functions()
        if (shown := inspect.signature(function).parameters.get("progress")) and shown.default is not shown.empty
    }
    assert {"solve", "reaction_map", "movement_reaction", "remedy", "answer"} <= set(defaults)
    assert set(defaults.values()) == {False}
