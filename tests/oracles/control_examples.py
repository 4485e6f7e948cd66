"""Examples of the classes of controllers, sensors and experiments."""

import numpy as np

import exo_pin as ep
from exo_pin import control
from exo_pin.control.controllers.planning import planner_of


def control_examples():
    """One of each, the ones with a memory after a sample or more."""
    exo, reference = ep.load("prototype"), control.flexion()
    plant, imu = ep.Plant(exo), control.Imu(noise=0.01, delay=0.015, lost=((0.02, 0.03),), seed=2)
    pose = reference(1.0).orientation
    exact = control.Measurement(pose, np.zeros(3), np.full(3, 1e5), 4e5, np.ones(3), np.zeros(3))
    sensor = control.ImuSensor(imu, exo.mechanism)
    reading, seen = sensor.read(0.0, pose, np.zeros(3)), sensor(0.0, exact)
    contractions = plant.contractions
    loop = control.muscle_loop(ep.muscle.muscle_model("best", 0.25), 1.3, 0.1, duration=0.1)
    thesis, model = control.ContractionController(exo.mechanism, reference), control.ModelController(plant, reference)
    for controller in (thesis, model):
        controller(0.0, seen)
    tracking = ep.experiment("flexion").replace(duration=0.05, imu=imu).run()
    gains = control.PIGains(0.1, 1.0)
    pi = control.ProportionalIntegral([gains])
    pi.step([1.0], 0.01)
    feedback = control.FeedbackGains()
    return (
        imu, sensor, reading, seen, contractions, thesis, model, model.planned,
        tracking, tracking.experiment, loop, gains, pi, feedback, *_motor_examples(reference),
    )  # fmt: skip


def _motor_examples(reference):
    """Winches, linear actuators, muscles over tackles, and their controllers, after a sample."""
    cables, rods, tackles = (
        ep.Plant(ep.load(name)) for name in ("four-cables", "three-linear-actuators", "four-muscle-cables")
    )
    pose = reference(0.0).orientation
    start = cables.held(pose, np.full(4, 10.0))
    lengths, out = (np.array(cables.held(pose, np.full(4, f)).drive_positions) for f in (0.0, 10.0))
    seen = control.Measurement(pose, np.zeros(3), np.zeros(4), 0.0, lengths, np.zeros(4), out, np.zeros(4))
    length, model = control.LengthController(cables, reference), control.ModelController(cables, reference)
    for controller in (length, model):
        controller(0.0, seen)
    motion = planner_of(cables).motion(reference(0.5))
    states = tackles.drive_states(lengths, np.full(4, 10.0))
    return (
        cables, start, seen, length, model, motion, states, *cables.drives, *cables.units, *rods.drives,
        *tackles.drives, cables.options.winch, cables.options.linear_actuator,
        tackles.mechanism.limbs[0].actuator.tackle,
    )  # fmt: skip
