"""Answers on what moves a plant as they are stored: wearers, sensors, references and controllers."""

from dataclasses import replace

import numpy as np
from answers import changes, each_of
from asked_in_turn import in_turn
from asked_plants import ENDS, PATH, POSE, SHOVE, SPASTIC, SPIN, TISSUE, device, waves

import exo_pin as ep
from exo_pin import control


def actions():
    """Moments of what a wearer does, at the times and places where they begin, are cut, and end."""
    arms = [
        control.ArmState(pose.as_matrix(), SPIN * way)
        for pose in (POSE, ep.shoulder_rotation(-60, 30, 40, degrees=True))
        for way in (1, -3)
    ]
    fall = control.Fall(75.0, 0.5, peak=1.2, impact_time=0.1, hand=(0.1, 0.02, -0.6), start=0.2, turn=PATH)
    said = [
        TISSUE, control.Intent(PATH, 2.0, 3.0, 0.7, 0.2), control.Intent(PATH, 90.0, 3.0, 0.7), control.Tremor(0.3,
        5.0, (1.0, 2.0, -0.5), 0.4),
        control.Spasticity(**SPASTIC), control.Spasticity(axis=(1.0, 0.5, 0.2), **SPASTIC),
        control.Spasticity(**SPASTIC | {"gain": 0.1}),
        control.Push(SHOVE, 0.3, 0.5), control.Push(replace(SHOVE, frame="base")), fall,
        *(control.JointStops(ENDS | more, 50.0, 0.5, side, "a test") for side in ("left", "right")
          for more in ({}, {"plane of elevation": (-2.5, 2.1)}, {"plane of elevation": (-0.1, 0.2), "elevation": (0.0,
          2.0)})),
    ]  # fmt: skip
    own = {"source": "a test"}
    return (
        [[one(t, arm) for t, arm in zip((0.1, 0.3, 0.4999, 0.55), arms, strict=True)] for one in said], fall,
        [(fall.torso.acceleration(t), fall.pulse(t)) for t in (0.19, 0.2, 0.51, 0.53, 0.61, 0.63)],
        said[-1].depth(ep.shoulder_rotation([0.1, 2.0, 1.0], 0.4, [0.5, -1.0, 0.0])),
        in_turn(
            source=lambda: control.Passive(1.0, 2.0, source=" "), damping=lambda: control.Passive(1.0, **own),
            negative=lambda: control.Passive(-1.0, 2.0, **own),
            two=lambda: control.Passive([1.0, 2.0], 2.0, **own), reference=lambda: control.Intent(3, 1.0, 1.0, 1.0),
            strength=lambda: control.Intent(PATH, -1.0, 1.0, 1.0),
            axis=lambda: control.Tremor(1.0, 2.0, (0, 0, 0)), limit=lambda: control.Spasticity(1.0, 2.0, **own),
            about=lambda: control.Spasticity(1.0, 2.0, 3.0, (0, 0, 0), **own),
            stack=lambda: control.Push(ep.Load(np.ones((2, 3)))), push=lambda: control.Push(SHOVE, 0.5, 0.5),
            load=lambda: control.Push(3),
            ranges=lambda: control.JointStops({}, 1.0), angle=lambda: control.JointStops({"flexion": (0, 1)}, 1.0, 1.0,
            **own),
            order=lambda: control.JointStops({"elevation": (1.0, 1.0)}, 1.0, 1.0, **own),
            wide=lambda: control.JointStops({"axial rotation": (-4.0, 3.0)}, 1.0, 1.0, **own),
            zero=lambda: control.JointStops({"elevation": (0.1, 1.0)}, 1.0, 1.0, **own),
            payload=lambda: control.Payload(0.0, (0, 0, 0)),
            held=lambda: control.Payload(1.0, (0, 0, 0), 0.5, 0.5), body=lambda: control.Fall(75.0, 0.0, 1.0, 0.1, (0,
            0, 0)), turn=lambda: control.Fall(75.0, 1.0, 1.0, 0.1, (0, 0, 0), turn=3),
            pad=lambda: control.Padding(damping_time=-1.0, source="a test"),
            radius=lambda: control.Padding(damping_time=0.1, mass=-1.0, source="a test"),
            torso=lambda: control.Torso(3), acceleration=lambda: control.Torso(PATH, 3),
            part=lambda: control.Torso(None, lambda t: np.array([0.0, np.nan, 1.0])).at(0.5, np.zeros(3)),
        ),
    )  # fmt: skip


def sensed():
    """Exact measurements through sensors with every error, one after the other."""
    plant = ep.Plant(ep.load("four-cables"))
    errors = [
        control.SensorError("orientation", 0.02, [0.01, 0.0, -0.02], 0.005, 0.011, [(0.02, 0.03)], seed=3),
        control.SensorError("angular_velocity", 0.1, 0.05, delay=0.02, seed=5), control.SensorError("pressures", 3.0,
        resolution=2.0),
        control.SensorError("supply_pressure", 5.0, 2.0), control.SensorError("lengths", 0.001, 0.003, 0.002, limb=2,
        lost=np.array([(0.0, 0.01), (0.03, 0.04)])),
        control.SensorError("contraction_ratios", bias=(0.1, 0.2, 0.3, 0.4)), control.SensorError("drive_positions",
        resolution=0.01, limb=1),
    ]  # fmt: skip
    imu = control.Imu(ep.shoulder_rotation(5, 2, 30, degrees=True), ep.shoulder_rotation(3, -4, 80, degrees=True),
    noise=0.02, velocity_noise=0.05,
                      drift=0.5, drift_axis=(1.0, 2.0, -1.0), delay=0.013, lost=((0.03, 0.04),), seed=4)  # fmt: skip
    chained = replace(
        imu,
        chain=ep.wrist.OrientationChain(
            ep.shoulder_rotation(0, 0, 80, degrees=True), ep.shoulder_rotation(0, 1, 2, degrees=True)
        ),
        drift_axis=None,
    )
    seen, readings = [], {"errors": control.Sensors(errors)}
    readings |= {name: control.ImuSensor(one, plant.mechanism) for name, one in (("imu", imu), ("chained", chained))}

    def watch(t, exact):
        seen.append({name: one(t, exact) for name, one in readings.items()})
        return exact

    plant.simulate(waves(4), 0.07, replace(plant.held(POSE, [20.0] * 4), angular_velocity=SPIN), sensor=watch)
    error = control.SensorError
    return seen[:6], imu.reading(POSE), [imu.is_lost(t) for t in (0.0299, 0.03, 0.04)], in_turn(
        channel=lambda: error("length"), noise=lambda: error("lengths", -1.0), bias=lambda: error("lengths",
        bias=np.ones((2, 2))), limb=lambda: error("lengths", limb=-1),
        lost=lambda: error("lengths", lost=((0.1, 0.1),)), pair=lambda: error("lengths", lost=(0.1, 0.2, 0.3)),
        axis=lambda: control.Imu(drift_axis=(0, 0, 0)),
        imu=lambda: control.Imu(lost=((2.0, 1.0),)), chain=lambda: control.Imu(chain=3),
        errors=lambda: control.Sensors(3), records=lambda: control.Sensors([3]),
        entry=lambda: plant.simulate(waves(4), 0.01, sensor=control.Sensors(error("lengths", limb=4))),
        turned=lambda: plant.simulate(waves(4), 0.01, sensor=control.Sensors(error("orientation", limb=0))),
    )  # fmt: skip


def references():
    """Paths at odd times, before their beginning and beyond their end."""
    times = [-0.1, 0.0, 0.31, 0.7, 1.1, 1.9, 2.3]
    turns = [control.Turn(POSE, [0.3, -0.5, 0.2], 1.9), control.abduction(1.1, 2.0, side="right"),
    control.flexion(-0.7, 1.5, "minimum_jerk"), PATH, replace(PATH, side="right", law="constant_speed"),
             control.daily_task("feeding", 1.7, "right"), control.daily_task("ten-daily-tasks", 2.2)]  # fmt: skip
    stack = ep.shoulder_rotation(
        [0, 20, 50, 40, 30, 20, 25], [10, 30, 20, 50, 60, 30, 0], [0, 5, -10, 20, 0, 10, 5], degrees=True
    )
    splines = [
        control.OrientationSpline(np.array([0.2, 0.5, 1.0, 1.3, 1.7, 2.0, 2.1])[:count], stack[:count], rest, "odd")
        for count, rest in ((7, True), (7, False), (5, False))
    ]
    movement = turns[0].movement(7.0)
    states = [(one, one(times), one.start, one.end) for one in (*turns, *splines)]
    again = control.OrientationSpline.of_movement(turns[3].movement(20.0))
    return states, movement, again, control.DAILY_TASKS, in_turn(
        duration=lambda: control.Turn(POSE, [1.0, 0, 0], 0.0), vector=lambda: control.Turn(POSE, [19.0, 0, 0], 1.0),
        law=lambda: control.abduction(law="slow"), angle=lambda: control.flexion(3.2),
        half=lambda: control.flexion(np.pi), side=lambda: control.flexion(side="up"),
        task=lambda: control.daily_task("sleeping"), times=lambda: control.AnglePath([0.1, 1.0], np.zeros((2, 3))),
        degrees=lambda: control.AnglePath([0.0, 1.0], np.full((2, 3), 6.3)), one=lambda: control.AnglePath([0.0],
        np.zeros((1, 3))), steep=lambda: control.AnglePath([0.0, 1e-6], np.zeros((2, 3))),
        rate=lambda: PATH.movement(6e6), few=lambda: control.OrientationSpline([0, 1, 2], stack[:3], rest=False),
        fall=lambda: control.OrientationSpline([0, 2, 1], stack[:3]),
        far=lambda: control.OrientationSpline([0, 1], ep.shoulder_rotation([0, 121], 0, 0, degrees=True)),
        swings=lambda: control.OrientationSpline([0, 1, 1.01, 3], ep.shoulder_rotation([0, 100, 0, 100], 0, 0,
        degrees=True), rest=False),
    )  # fmt: skip


def controllers():
    """Commands of controllers to what they measure, in turn, with what they remember."""
    gains = control.FeedbackGains(
        stiffness=9.0,
        damping=0.7,
        integral_time=0.3,
        pressure=1.5,
        bandwidth=30.0,
        axial_share=0.4,
        lost_beyond=0.002,
        lower_in=0.5,
        weight_share=0.8,
        dead_zone=0.02,
        forgetting_time=0.7,
    )
    cables, muscles, motors = (
        ep.Plant(ep.load("four-cables")),
        ep.Plant(ep.load("prototype")),
        ep.Plant(device("serial-y-x-z")),
    )
    made = {
        "model": control.ModelController(cables, PATH, gains, 50.0), "aware": control.ModelController(cables, PATH,
        replace(gains, fault_aware=True, lost_beyond=np.inf)),
        "lengths": control.LengthController(cables, PATH, 50.0), "weight": control.gravity_compensation(cables, 0.7),
        "impedance": control.impedance(cables, PATH, 7.0, 0.3),
        "assist": control.assist_as_needed(cables, PATH, 7.0, 0.3), "admittance": control.AdmittanceController(cables,
        PATH, 0.2, 0.5, 3.0, filter_time=0.03),
        "own gains": control.AdmittanceController(cables, PATH, 0.2, 0.5, 3.0, gains),
        "air": control.ModelController(muscles, PATH, replace(gains,
        air_ahead=True)),
        "usual": control.ModelController(muscles, PATH),
        "contraction": control.ContractionController(muscles.mechanism, PATH, [control.PIGains(0.01 * k,
        0.3) for k in (1, 2, 3)], layout="fill and vent"), "printed": control.ContractionController(muscles.mechanism,
        PATH), "joints": control.ModelController(motors, PATH), "joint lengths": control.LengthController(motors, PATH),
    }  # fmt: skip

    def asked(one):
        plant, said = (
            getattr(one, "plant", None)
            or {"admittance": cables, "own gains": cables, "contraction": muscles, "printed": muscles}[
                next(name for name in made if made[name] is one)
            ],
            [],
        )

        def remembered(t, seen):
            seen = seen._replace(lost=0.025 < t < 0.035, faulty=np.arange(plant.count) == (1 if t > 0.035 else -1))
            said.append(np.asarray(one(t, seen)))
            return said[-1]

        start = (
            plant.state(POSE, SPIN, 1.1e5)
            if plant is not cables
            else replace(cables.held(POSE, [20.0, 31.0, 26.0, 45.0]), angular_velocity=SPIN)
        )
        fault = [ep.Fault("encoder loss", 0, 0.02)] if plant is cables else []
        plant.simulate(remembered, 0.06, start, faults=fault)
        return said, getattr(one, "planned", None), getattr(one, "interaction", None)

    return {name: asked(one) for name, one in made.items()}


def loops_and_programs():
    """Two PI loops, one program of tensions, and what controllers refuse."""
    cables, muscles = ep.Plant(ep.load("four-cables")), ep.Plant(ep.load("prototype"))
    unseen = control.Measurement(POSE, SPIN, np.zeros(4), 0.0, np.ones(4), np.zeros(4))
    pi = control.ProportionalIntegral([control.PIGains(0.5, 0.7), control.PIGains(2.0, 0.3)], (-0.4, 0.9))
    lone = control.tensions_for_motion(
        cables.mechanism,
        POSE,
        ep.Motion(SPIN, -3.0 * SPIN),
        np.array([20.0, 30.0, 25.0, 60.0]),
        np.array([5.0, 6.0, 0.0, 1.0]),
        SHOVE,
    )
    steps = [pi.step(error, 0.1) for error in ([0.3, 0.1], [-0.9, 0.5], [0.1, -0.4])]
    return steps, pi.integral, lone, control.TABLE_5_5, in_turn(
        gains=lambda: control.FeedbackGains(weight_share=1.1), time=lambda: control.FeedbackGains(integral_time=0.0),
        stiff=lambda: control.FeedbackGains(stiffness=-1.0), pi=lambda: control.PIGains(1.0, 0.0),
        none=lambda: control.ProportionalIntegral([]),
        output=lambda: control.ProportionalIntegral([control.PIGains(1, 1)], (1.0, 1.0)),
        interval=lambda: pi.step([0, 0], 0.0),
        muscles=lambda: control.LengthController(muscles, PATH), plant=lambda: control.ModelController(3, PATH),
        reference=lambda: control.LengthController(cables, 3), inertia=lambda: control.AdmittanceController(cables,
        PATH, 0.0, 1.0, 1.0),
        count=lambda: control.ContractionController(muscles.mechanism, PATH, [control.PIGains(1, 1)]),
        each=lambda: control.ContractionController(muscles.mechanism, PATH, 3),
        layout=lambda: control.ContractionController(muscles.mechanism, PATH, layout="4/2"),
        cables=lambda: control.ContractionController(cables.mechanism, PATH),
        greatest=lambda: control.tensions_for_motion(cables.mechanism, POSE, None, np.ones(3)),
        poses=lambda: control.missing_moments(cables, POSE), share=lambda: control.gravity_compensation(cables, -0.1),
        lacking=lambda: control.LengthController(cables, PATH)(0.0, unseen),
        arm=lambda: control.tensions_for_motion(muscles.mechanism.replace(arm=None), POSE, None, np.ones(3)),
        strokes=lambda: control.ContractionController(ep.load("appendix-d").mechanism, PATH),
        aware=lambda: [
            control.gravity_compensation(cables, 0.4, fault_aware=True).gains,
            control.impedance(cables, PATH, 7.0, 0.3, fault_aware=True).gains,
        ],
        rates=lambda: in_turn(
            weight=lambda: control.gravity_compensation(cables, rate=0.0),
            impedance=lambda: control.impedance(cables, PATH, 7.0, 0.3, 0.0),
            assist=lambda: control.assist_as_needed(cables, PATH, 7.0, 0.3, rate=0.0),
            admittance=lambda: control.AdmittanceController(cables, PATH, 1.0, 1.0, 1.0, rate=0.0),
            contraction=lambda: control.ContractionController(muscles.mechanism, PATH, rate=0.0),
            lengths=lambda: control.LengthController(cables, PATH, 0.0),
        ),
        kinds=lambda: in_turn(
            plant=lambda: control.AdmittanceController(3, PATH, 1.0, 1.0, 1.0),
            virtual=lambda: control.AdmittanceController(cables, 3, 1.0, 1.0, 1.0),
            damping=lambda: control.AdmittanceController(cables, PATH, 1.0, -1.0, 1.0),
            stiffness=lambda: control.AdmittanceController(cables, PATH, 1.0, 0.0, -1.0),
            filter=lambda: control.AdmittanceController(cables, PATH, 1.0, 0.0, 0.0, filter_time=0.0),
            contraction=lambda: control.ContractionController(muscles.mechanism, 3),
            model=lambda: control.ModelController(cables, 3),
            gains=lambda: control.ModelController(cables, None, 3),
            lengths=lambda: control.LengthController(3, PATH),
        ),
        steps=lambda: pi.step([np.nan, 0], 0.1), long=lambda: control.tensions_for_motion(cables.mechanism, POSE,
        None, [np.nan] * 4), stack=lambda: control.tensions_for_motion(cables.mechanism, ep.shoulder_rotation([1, 2], 0,
        0), None, np.ones(4)),
    )  # fmt: skip


ASKED = {each.__name__: each for each in (actions, sensed, references, controllers, loops_and_programs)}

#: Those that take longer than 0.15 s.
LONGER = {"controllers"}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
