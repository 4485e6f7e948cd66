"""The class is a thin face: every method passes its arguments to the function of its name and shows its docstring."""

import copy
import inspect
import pickle

import numpy as np
import pytest
from places import URDF

from exo_pin.chain import ClosedChain, closed_chain

METHODS = [
    name
    for name, method in vars(ClosedChain).items()
    if inspect.isfunction(method) and inspect.isfunction(getattr(closed_chain, name, None))
]


@pytest.fixture(scope="module")
def chain():
    return ClosedChain.from_urdf(URDF / "prototype.urdf")


def test_the_functions_are_found():
    assert {"close", "mobility", "inverse_dynamics", "joint_reaction", "simulate", "to_sdf"} <= set(METHODS)


@pytest.mark.parametrize("name", METHODS)
def test_a_method_passes_every_argument_to_the_function_of_its_name(name, chain, monkeypatch):
    signature = inspect.signature(getattr(closed_chain, name))
    received = {}

    def record(*args, **kwargs):
        received.update(signature.bind(*args, **kwargs).arguments)

    monkeypatch.setattr(closed_chain, name, record)
    state, *names = signature.parameters
    given = {item: object() for item in names if item != "problem"}
    extra = {"metric": object()} if "problem" in names else {}
    getattr(chain, name)(**given, **extra)
    assert received.pop(state) is chain.state
    assert received.pop("problem", {}) == extra
    assert received == given


@pytest.mark.parametrize("name", METHODS)
def test_a_method_has_the_defaults_and_the_docstring_of_its_function(name):
    method, function = getattr(ClosedChain, name), getattr(closed_chain, name)
    own = list(inspect.signature(method).parameters.values())[1:]
    others = list(inspect.signature(function).parameters.values())[1:]
    assert [(item.name, item.default) for item in own] == [(item.name, item.default) for item in others]
    first, _, rest = inspect.getdoc(function).partition("\n")
    assert method.__doc__.startswith(first)
    assert len(method.__doc__) > len(rest) / 2
    assert "ChainState" not in method.__doc__


def test_a_copy_has_a_state_of_its_own(chain):
    q = chain.close(chain.neutral())
    for again in (pickle.loads(pickle.dumps(chain)), copy.deepcopy(chain)):
        assert again.state is not chain.state
        assert again.state.workspace is not chain.state.workspace
        np.testing.assert_array_equal(again.inverse_dynamics(q).tau, chain.inverse_dynamics(q).tau)
