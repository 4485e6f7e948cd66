"""The class is a thin face: its methods are the functions of the rooms."""

import copy
import inspect
import pickle

import numpy as np
import pytest
from places import URDF

from exo_pin.chain import ChainState, ClosedChain

METHODS = {
    name: method
    for name, method in vars(ClosedChain).items()
    if inspect.isfunction(method) and method.__module__ != ClosedChain.__module__
}


@pytest.fixture(scope="module")
def chain():
    return ClosedChain.from_urdf(URDF / "prototype.urdf")


def test_the_functions_are_found():
    assert {"close", "mobility", "inverse_dynamics", "joint_reaction", "simulate", "to_sdf"} <= set(METHODS)


@pytest.mark.parametrize("name", METHODS)
def test_a_method_is_the_function_of_its_name_and_takes_the_chain_first(name):
    method = METHODS[name]
    assert method.__name__ == name
    first, *others = inspect.signature(method).parameters.values()
    assert first.annotation == ChainState.__name__
    assert method.__doc__ is not None
    assert "ChainState" not in method.__doc__
    if others and "Parameters\n" in method.__doc__:
        listed = method.__doc__.split("Parameters\n")[1]
        assert all(item.name in listed for item in others)


def test_the_chain_is_its_own_state(chain):
    assert chain.state is chain
    assert isinstance(chain, ChainState)


def test_a_copy_has_a_state_of_its_own(chain):
    q = chain.close(chain.neutral())
    for again in (pickle.loads(pickle.dumps(chain)), copy.deepcopy(chain)):
        assert again.state is not chain.state
        assert again.state.buffers is not chain.state.buffers
        np.testing.assert_array_equal(again.inverse_dynamics(q).tau, chain.inverse_dynamics(q).tau)
