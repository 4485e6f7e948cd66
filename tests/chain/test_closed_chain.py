"""The class is a thin face: its methods are the functions of the rooms."""

import copy
import inspect
import pickle

import numpy as np
import pytest
from places import URDF

from exo_pin.chain import ClosedChain

METHODS = {
    name: method
    for name, method in vars(ClosedChain).items()
    # Each shows a function of a room, and its arguments are checked around that.
    if inspect.isfunction(method) and hasattr(getattr(method, "__wrapped__", None), "__wrapped__")
}


@pytest.fixture(scope="module")
def chain():
    return ClosedChain.from_urdf(URDF / "prototype.urdf")


def test_the_functions_are_found():
    assert {"close", "mobility", "inverse_dynamics", "joint_reaction", "simulate", "to_sdf"} <= set(METHODS)


@pytest.mark.parametrize("name", METHODS)
def test_a_method_is_the_function_of_its_name_and_shows_what_the_user_passes(name):
    method, function = METHODS[name], inspect.unwrap(METHODS[name])
    assert method.__name__ == name
    known, shown = list(inspect.signature(function).parameters.values()), inspect.signature(method).parameters
    assert list(shown.values())[1:] == known[1:]
    assert "state" not in shown
    assert method.__doc__ is not None
    assert "ChainState" not in method.__doc__
    if known[1:] and "Parameters\n" in method.__doc__:
        listed = method.__doc__.split("Parameters\n")[1]
        assert all(item.name in listed for item in known[1:])


def test_the_class_shows_what_users_need():
    # Readers of files are one a format.
    shown = [name for name in dir(ClosedChain) if not name.startswith(("_", "from_"))]
    assert len(shown) <= 42
    assert not {"buffers", "state", "sized"} & set(shown)


def test_a_copy_has_a_state_of_its_own(chain):
    q = chain.close(chain.neutral())
    for again in (pickle.loads(pickle.dumps(chain)), copy.deepcopy(chain)):
        assert again._state is not chain._state
        assert again._state.buffers is not chain._state.buffers
        np.testing.assert_array_equal(again.inverse_dynamics(q).tau, chain.inverse_dynamics(q).tau)
