"""Every public class and error survives pickle, copy and deepcopy, or says what to send instead."""

import concurrent.futures
import copy
import inspect
import itertools
import multiprocessing
import pickle
import xml.etree.ElementTree as ET
from collections import deque
from functools import cached_property
from pathlib import PurePath

import numpy as np
import pinocchio as pin
import pytest
from examples import error_examples, raise_example
from harvest import harvest, has_persons, public_classes
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import ExoPinError, ExoPinWarning
from exo_pin.core.records import OneProcess

WAYS = {
    "pickle": lambda value: pickle.loads(pickle.dumps(value)),
    "old-pickle": lambda value: pickle.loads(pickle.dumps(value, protocol=2)),
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
}
#: Without objects of their own, or with those of Numba and Crocoddyl, which a process makes anew.
PROTOCOLS = {"ClosedChainAction", "Controller", "Device", "DeviceKind", "ForceLimited", "Reference", "PartCacheImpl"}
PROTOCOLS |= {"BatchAnswer", "BatchError", "WorkspaceSummary"}


#: Classes of other rooms whose examples need the extra person.
OF_PERSONS = ("PoseContact", "WearerFigure")


# Once a process: a second harvest finds answers kept, and misses what only their making shows.
@pytest.fixture(scope="session")
def examples(tmp_path_factory):
    return harvest(tmp_path_factory.mktemp("harvest"))


def differences(one, other, where="", seen=None):
    """Where two values differ, in content or in whether an array can be written."""
    seen = set() if seen is None else seen
    if one is other or id(one) in seen:
        return []
    seen.add(id(one))
    if type(one) is not type(other):
        return [f"{where}: {type(one)} and {type(other)}"]
    if isinstance(one, np.ndarray):
        return _array_differences(one, other, where)
    if isinstance(one, Rotation):
        return [] if np.array_equal(one.as_quat(), other.as_quat(), equal_nan=True) else [where]
    if isinstance(one, pin.Model | pin.SE3 | PurePath):
        return [] if one == other else [where]
    if isinstance(one, tuple | list | deque):
        pairs = [(str(k), a, b) for k, (a, b) in enumerate(zip(one, other, strict=False))]
        return [f"{where}: length"] * (len(one) != len(other)) + _all_differences(pairs, where, seen)
    if isinstance(one, ET.Element):
        return [] if ET.tostring(one) == ET.tostring(other) else [where]
    if hasattr(one, "keys"):
        keys, others = list(one.keys()), list(other.keys())
        if keys != others:
            return [f"{where}: {keys} and {others}"]
        return _all_differences([(key, one[key], other[key]) for key in keys], where, seen)
    state = _attributes(one)
    if state is not None:
        lost = sorted(set(state) ^ set(_attributes(other)))
        shared = [(name, value, _attributes(other)[name]) for name, value in state.items() if name not in lost]
        return [f"{where}.{name} is lost" for name in lost] + _all_differences(shared, where, seen)
    if callable(one):
        return [] if one is other or one == other else [where]
    return [] if one == other or (one != one and other != other) else [f"{where}: {one!r} and {other!r}"]


def _array_differences(one, other, where):
    if one.dtype != other.dtype or one.shape != other.shape:
        return [f"{where}: {one.dtype}{one.shape} and {other.dtype}{other.shape}"]
    if one.flags.writeable != other.flags.writeable:
        return [f"{where}: writeable {one.flags.writeable} and {other.flags.writeable}"]
    equal = np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
    return [] if equal else [f"{where}: {one} and {other}"]


def _all_differences(triples, where, seen):
    return [found for name, a, b in triples for found in differences(a, b, f"{where}.{name}", seen)]


def _attributes(value):
    """What an object is made of, without what it has computed and keeps, and memory of this thread."""
    if isinstance(value, ExoPinError):
        return {**vars(value), "args": value.args, "str": str(value)}
    slots = [name for kind in type(value).__mro__ for name in getattr(kind, "__slots__", ())]
    if not hasattr(value, "__dict__") and not slots:
        return None
    state = {name: getattr(value, name) for name in slots if hasattr(value, name)} | getattr(value, "__dict__", {})
    kind = type(value)
    computed = {name for name in state if isinstance(getattr(kind, name, None), cached_property)}
    return {name: item for name, item in state.items() if name not in computed | {"_local", "_drives", "kept"}}


def has_subclass(kind, examples):
    return any(issubclass(other, kind) and other is not kind for other in examples)


def check_class(kind, examples):
    """Fail if an example of a class is missing or does not survive."""
    if kind not in examples:
        base = inspect.isabstract(kind) or "__init__" not in vars(kind)
        assert kind.__name__ in PROTOCOLS or (base and has_subclass(kind, examples)), (
            f"no example of {kind.__name__}: make one in tests/harvest.py or tests/examples.py"
        )
        return
    for value, (name, way) in itertools.product(examples[kind], WAYS.items()):
        if isinstance(value, OneProcess):
            with pytest.raises(TypeError, match=r"cannot be pickled or copied: .{10}"):
                way(value)
            continue
        assert differences(value, way(value), name) == []


@pytest.mark.full
def test_every_public_class(examples):
    """In one test, so that one process alone makes the examples, which takes seconds."""
    failed, persons = [], has_persons()
    for kind in public_classes():
        # A server and its page live in a process of their own.
        if kind.__module__.startswith(("exo_pin.service", "exo_pin.app")):
            continue
        if not persons and (kind.__module__.startswith("exo_pin.person.") or kind.__name__ in OF_PERSONS):
            continue
        try:
            check_class(kind, examples)
        except (AssertionError, pytest.fail.Exception) as error:
            failed.append(f"{kind.__module__}.{kind.__qualname__}: {error}")
    assert not failed, "\n".join(failed)
    if not persons:
        pytest.skip("needs the extra person: pip install '.[person]'")


@pytest.mark.parametrize("error", error_examples(), ids=lambda error: type(error).__name__)
@pytest.mark.parametrize("way", WAYS)
def test_errors_keep_message_attributes_and_notes(way, error):
    again = WAYS[way](error)
    assert type(again) is type(error)
    assert str(again) == str(error)
    assert again.args == error.args
    assert differences(vars(error), vars(again)) == []


def test_there_is_an_example_of_every_error():
    errors = {kind for kind in public_classes() if issubclass(kind, ExoPinError | ExoPinWarning)}
    assert {type(error) for error in error_examples()} == errors


@pytest.mark.full
def test_process_pool_hands_over_every_error():
    context = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(1, mp_context=context) as pool:
        jobs = [pool.submit(raise_example, index) for index in range(len(error_examples()))]
        for job, error in zip(jobs, error_examples(), strict=True):
            came = job.exception()
            assert type(came) is type(error)
            assert str(came) == str(error)


def test_loaded_robots_keep_their_chain_and_answers(tmp_path):
    pose = ep.shoulder_rotation(40, 20, 10, degrees=True)
    made = ep.load("prototype").worn_by(ep.Arm.from_anthropometry(1.75, 75, "male"))
    made.reaction(pose)
    read = ep.load(str(made.to_urdf(tmp_path)))
    for exo in (made, read):
        for way in WAYS.values():
            again = way(exo)
            assert repr(again) == repr(exo)
            assert again.urdf == exo.urdf
            assert differences(exo.chain, again.chain) == []
    again = pickle.loads(pickle.dumps(made))
    np.testing.assert_array_equal(again.reaction(pose).shoulder_force, made.reaction(pose).shoulder_force)


def test_unpickled_answers_cannot_be_written():
    answer = pickle.loads(pickle.dumps(ep.load("prototype").reaction(Rotation.identity())))
    with pytest.raises(ValueError, match="read-only"):
        answer.shoulder_force[0] = 1.0


def test_parts_that_refer_to_each_other_still_do():
    arm = ep.load("prototype").arm
    again = pickle.loads(pickle.dumps(arm))
    assert again.parts[0] is again


def test_example_of_a_new_class_is_missed():
    with pytest.raises(AssertionError, match="no example of InvalidInput"):
        check_class(ep.InvalidInput, {})
