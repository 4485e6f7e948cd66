"""Data whose pages of zeros are given back is Pinocchio's own, bit for bit."""

import ctypes
import sys

import numpy as np
import pinocchio as pin
import pytest

from exo_pin.chain.structure.memory import new_data as memory
from exo_pin.chain.structure.memory.new_data import new_data

LINUX = sys.platform == "linux"


def row_of_hinges(nv):
    model, parent = pin.Model(), 0
    place = pin.SE3(np.eye(3), np.array([0.1, 0.0, 0.3]))
    for k in range(nv):
        parent = model.addJoint(parent, pin.JointModelRY(), place, f"hinge_{k}")
        model.appendBodyToJoint(parent, pin.Inertia(1.0, np.array([0.0, 0.1, 0.2]), np.eye(3)), pin.SE3.Identity())
    return model


def resident():
    """Resident memory of this process, MB."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * memory.mmap.PAGESIZE / 2**20


@pytest.mark.skipif(not LINUX, reason="pages are given back on Linux")
def test_second_derivatives_of_a_large_tree_take_no_memory():
    model = row_of_hinges(150)
    before = resident()
    kept = pin.Data(model)
    whole = resident() - before
    before = resident()
    data = new_data(model)
    assert whole > 0.9 * 32 * 150**3 / 2**20
    assert resident() - before < 0.2 * whole
    assert kept.M.shape == data.M.shape


def test_answers_are_the_same_bit_for_bit():
    """Also what the arrays hold that were given back."""
    model, rng = row_of_hinges(60), np.random.default_rng(0)
    q, v, a = rng.normal(size=(3, 60))
    answers = []
    for data in (new_data(model), pin.Data(model)):
        pin.computeRNEADerivatives(model, data, q, v, a)
        pin.computeJointJacobiansTimeVariation(model, data, q, v)
        pin.crba(model, data, q)
        parts = [data.dtau_dq, data.dtau_dv, data.M, data.J, data.dJ, data.tau]
        parts += [force.vector for force in data.of] + [pose.homogeneous for pose in data.oMi]
        hidden = [
            ctypes.string_at(place, 8 * 60**3) for place in (memory._second_derivatives(data, 60) if LINUX else ())
        ]
        answers.append([*(part.tobytes() for part in parts), *hidden])
    assert answers[0] == answers[1]


@pytest.mark.skipif(not LINUX, reason="pages are given back on Linux")
def test_arrays_that_are_not_found_or_not_zero_stay(monkeypatch):
    model = row_of_hinges(60)
    data = pin.Data(model)
    assert len(memory._second_derivatives(data, 60)) == 4
    assert memory._second_derivatives(data, 59) == []
    monkeypatch.setattr(memory.os, "pread", lambda *_: (_ for _ in ()).throw(OSError))
    assert memory._second_derivatives(data, 60) == []
    numbers = np.zeros(2**17)
    numbers[-1] = 1.0
    memory._give_back(numbers.ctypes.data, numbers.nbytes)
    assert numbers[-1] == 1.0
    numbers[-1] = 0.0
    memory._give_back(numbers.ctypes.data, numbers.nbytes)
    assert not numbers.any()
