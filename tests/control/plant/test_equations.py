"""Equations of drives and arm at single states, against formulas written anew and against another integration."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.control.plant.equations.drive_kernels import (
    COLUMNS,
)
from exo_pin.control.plant.equations.plant_kernels import (
    advance,
    rates,
    state_parts,
    tolerances,
)
from exo_pin.muscle import ConstantFriction
from exo_pin.muscle.valve.flow import ATMOSPHERE

MUSCLE = {"nominal_length": 0.3, "end_fitting": 0.1, "capability_slope": 15.0, "capability_intercept": 2.0,
          "braid_stiffness": 4e3, "damping_1": -1.0, "damping_2": 0.8, "friction": 0.5, "friction_2": 200.0,
          "friction_1": -80.0, "friction_0": 6.0, "friction_load": 0.1, "ratio": 2.0, "count": 3.0,
          "pulley_friction": 0.02, "thread": 0.33, "turns": 1.5, "dead_volume": 2e-5}  # fmt: skip


def muscle(**changes):
    return np.array([(MUSCLE | changes).get(name, 0.0) for name in COLUMNS])


OPTIONS = {"shoulder_viscous": 0.02, "shoulder_coulomb": 0.1, "muscle_friction": ConstantFriction(1.0)}


@pytest.fixture(scope="module", params=["prototype", "a manifold", "three-linear-actuators"])
def moving(request):
    """A plant with friction, stops and a load, its flows and a lively state."""
    manifold = {"supply": ep.Supply(5e5, ep.Valve(2e-8, 0.3), 1e-3)} if request.param == "a manifold" else {}
    exo = ep.load("prototype" if manifold else request.param)
    load = ep.Load([3.0, -2.0, -9.0], at=[0.0, 0.02, -0.3])
    plant = ep.Plant(exo, ep.PlantOptions(**OPTIONS, **manifold), load=load)
    n, rng = plant.count, np.random.default_rng(11)
    y, q = np.zeros(13 + 7 * n), ep.thesis_rotation(62.0, -20.0, -15.0, degrees=True).as_quat()
    parts = state_parts(y)
    parts["turn"][:], parts["angular_velocity"][:] = [0.02, -0.01, 0.03], [0.8, -1.2, 2.0]
    parts["shoulder_friction"][:], parts["drive_friction"][:] = [0.5, -0.4, 0.55], rng.uniform(-0.9, 0.9, n)
    lengths = plant.contractions.lengths(Rotation.from_rotvec(parts["turn"]) * Rotation.from_quat(q))
    motors = plant.tables.motors[:, 0] > 0.0
    parts["drives"][:] = np.where(motors, lengths - 1e-4, ATMOSPHERE + np.array([1.0e5, 0.7e5, 2.0e5]))
    parts["drive_speeds"][:], parts["manifold"][:] = np.where(motors, 0.01, 0.0), ATMOSPHERE + 4e5
    flows = np.zeros((n, 10))
    flows[:, :6] = np.where(motors[:, None], 0.0, [2e-9, 0.3, 1e-9, 0.25, 5e-10, 0.4])
    flows[:, 6:9] = [1.0, 60.0, 1.0]
    return plant, flows, q, y


def test_an_integration_ends_where_another_one_does(moving):
    plant, flows, q, y = moving
    t, duration = plant.tables, 2e-3

    def slope(_, state):
        out = np.zeros(len(state))
        rates(t, flows, q, state, out)
        return out

    other = solve_ivp(slope, (0.0, duration), y, rtol=1e-9, atol=tolerances(t, 1e-9)).y[:, -1]
    end, turned = y.copy(), q.copy()
    done, steps, ahead, left = advance(t, flows, turned, end, duration, 1e-4, 1e-8, tolerances(t, 1e-8))
    assert (done, left) == (0, 0.0)
    assert steps > 3
    assert ahead > 0.0
    there = Rotation.from_rotvec(other[:3]) * Rotation.from_quat(q)
    assert (Rotation.from_quat(turned) * there.inv()).magnitude() < 1e-8
    assert np.linalg.norm(turned) == pytest.approx(1.0, abs=1e-14)
    assert not end[:3].any()
    np.testing.assert_allclose(end[3:], other[3:], rtol=1e-5, atol=1e-7)
