"""A motion that is cut and goes on is the uncut one, bit for bit."""

import pickle

import numpy as np
import pytest
from drive_plants import held

import exo_pin as ep
from exo_pin import control
from exo_pin.muscle import ConstantFriction, Supply, Valve, ValveUnit

PRESETS = ("prototype", "four-cables", "four-linear-actuators", "three-linear-actuators", "four-muscle-cables")
MANIFOLD = Supply(4e5, Valve(1e-10, 0.3), 5e-5)


def waves(seed, count):
    """A controller without memory, with commands that go to and fro."""
    rng = np.random.default_rng(seed)
    mean, size, rate = rng.uniform(-0.4, 0.4, count), rng.uniform(0.0, 0.6, count), rng.uniform(3.0, 40.0, count)
    return lambda t, seen: mean + size * np.sin(rate * t)


def made(name, rng):
    """A plant with random options, and a state to start from."""
    path = Valve(2e-10, 0.4)
    valves = ValveUnit(path, path, layout=str(rng.choice(["3/2", "fill and vent"])), frequency=rng.choice([7.0, 20.0]))
    options = ep.PlantOptions(
        valves=valves,
        supply=MANIFOLD if rng.random() < 0.7 else None,
        muscle_friction=ConstantFriction() if rng.random() < 0.5 else None,
        shoulder_coulomb=float(rng.choice([0.0, 0.2])),
    )
    spin = rng.uniform(-1.0, 1.0, 3)
    if name == "prototype":
        plant = ep.Plant(ep.load(name), options)
        pose = ep.thesis_rotation(60.0, -20.0, -15.0, degrees=True)
        return plant, plant.state(pose, spin, rng.uniform(0.5e5, 3e5, 3))
    return held(name, options, spin=spin)[::2]


def some_fault(plant, rng, duration):
    kinds = ("torn", "no current", "slipping brake") if plant.motors[0] else ("torn", "burst", "stuck valve", "leak")
    kind, (start, end) = str(rng.choice(kinds)), np.sort(rng.uniform(0.0, duration, 2))
    more = {"leak": {"leak": Valve(5e-11)}, "slipping brake": {"brake_force": 20.0}}.get(kind, {})
    return ep.Fault(kind, int(rng.integers(plant.count)), float(start), float(end), **more)


def arrays(record):
    return {name: value for name, value in vars(record).items() if isinstance(value, np.ndarray)}


def assert_same(one, other):
    """Two states, bit for bit."""
    assert {name: value for name, value in vars(one).items() if isinstance(value, float)} == {
        name: value for name, value in vars(other).items() if isinstance(value, float)
    }
    for name, value in arrays(one).items():
        np.testing.assert_array_equal(value, getattr(other, name), err_msg=name)


def assert_goes_on(plant, whole, cuts, simulate):
    """Cut a run at some of its times, pickle each state, and compare all that the parts report with the whole."""
    state, ends = whole.state(whole.times[0]), [*np.sort(cuts), len(whole.times) - 1]
    for begin, end in zip([0, *ends], ends, strict=False):
        duration = whole.times[end] - whole.times[begin]
        part = simulate(duration, pickle.loads(pickle.dumps(state)))
        for name, values in arrays(part).items():
            # At its end a part has not called its controller any more, so what commands decide is not compared there.
            np.testing.assert_array_equal(values[:-1], getattr(whole, name)[begin:end], err_msg=name)
        state = part.state(whole.times[end])
        assert_same(state, whole.state(whole.times[end]))
    np.testing.assert_array_equal(part.rotations.as_quat()[-1], whole.rotations.as_quat()[-1])


def check(name, seed, duration, count):
    rng = np.random.default_rng([seed, PRESETS.index(name)])
    plant, start = made(name, rng)
    faults = some_fault(plant, rng, duration) if rng.random() < 0.6 else ()
    controller = waves(seed, plant.count)

    def simulate(time, state):
        here = () if faults and faults.start >= state.time + time else faults
        return plant.simulate(controller, time, state, 100.0, here, sample_rate=200.0)

    whole = simulate(duration, start)
    assert whole.status == "completed"
    cuts = rng.choice(np.arange(1, len(whole.times) - 1), count, replace=False)
    assert_goes_on(plant, whole, cuts, simulate)


@pytest.mark.parametrize("name", PRESETS)
def test_a_cut_run_is_the_uncut_one_bit_for_bit(name):
    check(name, 1, 0.15, 4)


@pytest.mark.parametrize("name", ["four-cables", "prototype"])
def test_steps_give_the_states_of_a_run(name):
    plant, start = made(name, np.random.default_rng(5))
    controller, fault = waves(5, plant.count), ep.Fault("torn", 1, start=0.033)
    run, state = plant.simulate(controller, 0.1, start, faults=fault), start
    for t in run.times[:-1]:
        state = plant.step(state, controller(t, None), 0.01, fault)
    assert_same(state, run.state(0.1))
    assert not run.tensions[-1, 1]


def test_a_sensor_goes_on_with_its_noise():
    plant, start = made("prototype", np.random.default_rng(6))
    imu = control.Imu(noise=0.02, velocity_noise=0.05, drift=0.01, delay=0.013, lost=((0.04, 0.06),), seed=4)

    def controller(t, seen):
        return 3.0 * seen.contraction_ratios - seen.angular_velocity

    def simulate(duration, state):
        return plant.simulate(controller, duration, state, sensor=control.ImuSensor(imu, plant.mechanism))

    assert_goes_on(plant, simulate(0.1, start), [3, 5, 8], simulate)


@pytest.mark.parametrize(("name", "controller"), [("abduction", "pi"), ("held-abduction", "model")])
def test_a_controller_goes_on_with_its_own_memory(name, controller):
    experiment = ep.experiment(name).replace(controller=controller)
    plant = experiment.plant
    kept = [experiment.made_controller(plant)]

    def simulate(duration, state):
        return plant.simulate(kept[0], duration, state)

    whole = simulate(0.2, experiment.start(plant))
    kept[0] = experiment.made_controller(plant)
    assert_goes_on(plant, whole, [4, 13], simulate)


@pytest.mark.parametrize("rate", [60.0, 97.0, 333.0])
def test_periods_that_are_no_round_numbers(rate):
    plant, start = made("four-linear-actuators", np.random.default_rng(3))
    control_of, duration = waves(4, 4), 20.0 / rate
    whole = plant.simulate(control_of, duration, start, control_rate=rate)
    for row in (1, 7, 12):
        first = plant.simulate(control_of, whole.times[row], start, control_rate=rate)
        rest = plant.simulate(control_of, duration - whole.times[row], first.state(whole.times[row]), control_rate=rate)
        assert_same(rest.state(rest.times[-1]), whole.state(whole.times[-1]))
    state = start
    for k in range(20):
        state = plant.step(state, control_of(k / rate, None), 1.0 / rate)
    assert state.time == whole.times[-1]
    assert_same(state, whole.state(whole.times[-1]))
