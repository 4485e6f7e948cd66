"""Answers of plants as they are stored: every drive with its options and faults, wearers, rest, and refusals."""

from dataclasses import replace

import numpy as np
from answers import changes, each_of
from asked_in_turn import in_a_folder, in_turn, of_run
from asked_plants import PATH, POSE, SHOVE, SPASTIC, SPIN, STOPS, TISSUE, device, waves
from scipy.interpolate import PchipInterpolator

import exo_pin as ep
from exo_pin import control
from exo_pin.device import Brake
from exo_pin.muscle import ConstantFriction, Damping, LoadDependentFriction, Supply, Valve, ValveUnit, muscle_model


def moved(plant, start, faults=(), *more, sensor=None):
    """Of closed forms a longer run, exact; of a chain a short one."""
    (duration, rate), rtol = ((0.06, 50.0), 1e-8) if plant.equations is None else ((0.01, 300.0), 1e-4)
    run = plant.simulate(
        waves(plant.count), duration, start, rate, faults, sensor=sensor, sample_rate=rate / 1.5, rtol=rtol
    )
    return of_run(run, *more)


def muscles():
    """In line, with every option: manifold, valves, friction, springs, the ends of the shoulder."""
    path, vent, narrow = Valve(2e-10, 0.4), Valve(3e-10, 0.25), Valve(1e-10, 0.5)
    valves = ValveUnit(path, vent, restrictor=narrow, frequency=17.0)
    options = ep.PlantOptions(
        supply=Supply(3.7e5, Valve(1e-10, 0.3), 5e-5), valves=valves, polytropic_exponent=1.23, dead_volume=3.1e-6,
        braid_stiffness=2500.0, muscle_damping=Damping.from_bar(-1.3, 0.9),
        muscle_friction=LoadDependentFriction.from_bar(0.3, -0.5, 2.0, 0.4),
        presliding=3e-4, shoulder_viscous=0.07, shoulder_coulomb=0.13, shoulder_presliding=0.003, stop_stiffness=80.0,
        stop_damping=0.7, series_spring=9000.0,
    )  # fmt: skip
    plant = ep.Plant(ep.load("prototype"), options, ep.Load([3.0, -2.0, 1.0], at=(0.01, 0.02, -0.2)))
    faults = [
        ep.Fault("leak", 0, 0.011, 0.047, leak=Valve(5e-11)), ep.Fault("stuck valve", 1, 0.02, command=0.6),
        ep.Fault("burst", 2, 0.052), ep.Fault("torn", 0, 0.057),
    ]  # fmt: skip
    start = plant.state(ep.thesis_rotation(25.0, -9.0, -6.0, degrees=True), SPIN, [2.6e5, 3.1e5, 3.4e5])
    beyond = plant.state(ep.shoulder_rotation(120.0, 10.0, 80.0, degrees=True), SPIN, 4e5)
    return moved(plant, start, faults), plant.simulate(lambda t, seen: [1, -1, 0.5], 0.02, beyond, 100.0).cautions


def tackles():
    """Muscles over tackles."""
    options = ep.PlantOptions(
        muscle_friction=ConstantFriction(), pulley_friction=0.07, muscle_damping=None, dead_volume=2e-6
    )
    plant = ep.Plant(ep.load("four-muscle-cables"), options)
    return moved(plant, replace(plant.held(POSE, [20.0, 31.0, 26.0, 45.0]), angular_velocity=SPIN))


def motors(name, options, *faults, sensor=None, **more):
    plant = ep.Plant(ep.load(name), options, **more)
    start = replace(plant.held(POSE, 20.0 + 7.0 * np.arange(plant.count)), angular_velocity=SPIN)
    return moved(plant, start, faults, *["load", "external_load", "question"] * bool(more), sensor=sensor)


def winches():
    own = control.Winch(
        rotor_inertia=5e-6, no_load_speed=0.2, stall_ratio=2.5, viscous=23.0, coulomb=7.0, load_friction=0.12,
        presliding=3e-4,
        damping_time=6e-4, brake_force=450.0, stop_stiffness=9e4, stop_damping=900.0, least_tension=4.0,
        drum_radius=0.023,
        gear_ratio=21.0, drum_inertia=2e-5, axial_stiffness=5e4, routing_length=0.4,
    )  # fmt: skip
    faults = [
        ep.Fault("jam", 0, 0.011, reported_after=0.02), ep.Fault("encoder loss", 1, 0.02), ep.Fault("torn", 2, 0.04),
        ep.Fault("supply drop", 3, 0.025, 0.043, share=0.3),
    ]  # fmt: skip
    seen = control.Sensors(control.SensorError("lengths", noise=1e-3))
    return motors("four-cables", ep.PlantOptions(winch=own, play=0.0007), *faults, sensor=seen)


def actuators():
    own = control.LinearActuator(coulomb=12.0, viscous=33.0, lead=0.006, screw_inertia=2e-6, stiffness=8e5)
    faults = (
        ep.Fault("no current", 0, 0.011),
        ep.Fault("slipping brake", 1, 0.02, brake_force=33.0),
        ep.Fault("no current", 2, 0.02, 0.03),
    )
    return motors("three-linear-actuators", ep.PlantOptions(linear_actuator=own, shoulder_coulomb=0.2), *faults)


def worn():
    """Winches on a wearer who acts in every way, with payloads, and a torso that moves."""
    wearer = [
        TISSUE, control.Intent(PATH, 2.0, 9.0, 0.7, 0.05), control.Tremor(0.3, 5.0, (1.0, 2.0, -0.5), 0.4), STOPS,
        control.Spasticity(axis=(1.0, 0.5, 0.2), **SPASTIC), control.Push(SHOVE, 0.004, 0.007),
    ]  # fmt: skip
    payloads = [control.Payload(0.5, (0.01, 0.02, -0.5)), control.Payload(0.3, (0.03, 0.0, -0.3), 0.002, 0.006)]
    turn = control.AnglePath([0.0, 0.5], [[0.1, 0.0, 0.0], [0.3, 0.2, -0.1]])
    torso = control.Torso(turn, lambda t: np.array([0.3, -0.2, 1.0 + t]))
    return motors(
        "four-cables",
        None,
        wearer=wearer,
        payloads=payloads,
        torso=torso,
        load=ep.Load([1.0, 2.0, -3.0], at=(0, 0, -0.1)),
    )


def joint_motors(motor, faults=(), **more):
    """A chain of motors in joints."""
    plant = ep.Plant(device("serial-y-x-z"), control.PlantOptions(joint_motor=motor), **more)
    return moved(plant, plant.state(POSE, SPIN), faults, "question"), plant.force_limits([0.1, 0.2, 0.3])


OF_JOINT = control.JointMotor(
    inertia=0.02, viscous=0.3, coulomb=0.4, load_friction=0.1, presliding=3e-3, stall_ratio=3.0, brake_effort=5.0
)


def geared():
    gear = replace(OF_JOINT, stiffness=900.0, damping_time=6e-4, play=0.004, stop_depth=0.02, stop_time=0.02)
    return joint_motors(gear, ep.Fault("jam", 0, 0.004), wearer=TISSUE)


def direct():
    faults = ep.Fault("jam", 0, 0.002), ep.Fault("no current", 1, 0.004), ep.Fault("torn", 2, 0.006)
    return joint_motors(OF_JOINT, faults), joint_motors(control.JointMotor())


def padded():
    """Motors in joints, with cuff and harness on springs."""
    man = ep.Arm.from_anthropometry(1.75, 75, sex="male")
    cuff = ep.Interface.of([3.7e3, 3.15e3, 2.25e3], 12.0, at=(0.01, 0.02, -0.2))
    faces = ep.Interfaces(cuff=cuff, harness=ep.Interface.of(2e4, 300.0, at=(-0.1, 0.0, 0.1)))
    pad = control.Padding(damping_time=0.01, mass=0.2, radius=0.05, source="a test")
    exo = device("serial-y-x-z").replace(arm=man, interfaces=faces)
    plant = ep.Plant(exo, wearer=TISSUE, cuff=pad, harness=replace(pad, damping_time=0.02, mass=0.9, radius=0.1))
    return moved(plant, plant.state(POSE, SPIN), ())


def chains():
    """Short motions of devices with springs, routed cables, friction and brakes, and of motors at their ends."""
    found = {}
    for name, limit in (("spring-support", None), ("six-cables", 90.0), ("nesm", 20.0), ("spherical-3rrr", None)):
        options = control.PlantOptions(joint_motor=replace(OF_JOINT, limit=limit), shoulder_viscous=0.1)
        turn = control.AnglePath([0.0, 0.5], [[0.1, 0.0, 0.0], [0.3, 0.2, -0.1]])
        jolt = PchipInterpolator([0.0, 0.01, 0.03], [[0.0, 0.0, 1.0], [2.0, 0.0, -1.0], [0.0, 3.0, 0.0]])
        torso = control.Torso(turn, jolt)
        found[name] = lambda name=name, options=options, torso=torso: brief(
            ep.Plant(device(name), options, wearer=TISSUE, torso=torso)
        )
    beyond, below = ep.shoulder_rotation([175.0, -47.0], [60.0, -66.0], [85.0, -33.0], degrees=True)
    rubbing = control.PlantOptions(joint_motor=OF_JOINT, shoulder_coulomb=0.2, shoulder_presliding=0.004)
    ends = ep.Plant(device("serial-y-x-z"), rubbing, wearer=[TISSUE, control.Push(SHOVE, 0.001, 0.004)])
    lacking = control.PlantOptions(winch=control.Winch(no_load_speed=0.05))
    return in_turn(
        **found, ends=lambda: brief(ends, beyond), below=lambda: brief(ends, below),
        slow=lambda: brief(ep.Plant(ep.load("four-cables"), lacking, wearer=TISSUE)),
        limit=lambda: ep.Plant(device("six-cables")),
        moment=lambda: brief(ep.Plant(ep.load("four-cables"), wearer=lambda t, arm: np.full(3, np.nan))),
        force=lambda: brief(ep.Plant(ep.load("four-cables"), wearer=lambda t, arm: (np.full(3, np.nan), np.zeros(3)))),
        number=lambda: brief(ep.Plant(ep.load("four-cables"), wearer=lambda t, arm: 2.0)),
        three=lambda: brief(ep.Plant(ep.load("four-cables"), wearer=lambda t, arm: (1.0, 2.0, 3.0)))["tensions"],
    )  # fmt: skip


def brief(plant, pose=POSE):
    """A short run in numbers."""
    is_direct = not plant.count or plant.drives[0].is_direct
    start = plant.state(pose, SPIN) if is_direct else plant.held(pose, [20.0] * plant.count)
    start = replace(start, angular_velocity=SPIN)
    run = plant.simulate(
        lambda t, seen: [0.4, -0.3, 0.2, 0.1, 0.3, 0.2][: plant.count],
        0.006,
        start,
        400.0,
        sample_rate=200.0,
        rtol=1e-4,
    )
    names = (
        "status",
        "angular_acceleration",
        "tensions",
        "drive_speeds",
        "joint_loss",
        "wearer_work",
        "link_force",
        "chain",
        "electric_power",
        "stored_energy",
    )
    return {name: getattr(run, name) for name in names}


#: Pressures, and poses from which the arm swings over before it comes to rest.
FAR = ((0.0, (-44, 68, 85)), ([195e3, 64e3, 375e3], (43, 154, -60)), (0.0, (120, 30, -80)), (1e5, (-30, 140, 60)))


def braked():
    """Drives of a chain that has a brake, and of which two have other limits to one side than to the other."""
    own = device("serial-y-x-z").device
    uneven = (replace(own.drives[0], lower=-30.0, upper=20.0), replace(own.drives[1], lower=4.0, upper=20.0))
    exo = ep.ShoulderExo.from_device(replace(own, drives=uneven, brakes=(Brake("lock", "flexion", 30.0),)))
    plant = ep.Plant(exo)
    efforts = [[drive.demand(share) for share in (-0.5, 0.0, 0.7)] for drive in plant.drives]
    return plant.drives, efforts, plant.force_limits([0.1, 0.2, 0.3])


def at_rest():
    """States of rest, limits and positions of drives, what moments are missing, and drives that creep."""
    muscles, cables = ep.Plant(ep.load("prototype")), ep.Plant(ep.load("four-cables"), ep.PlantOptions(play=0.001))
    lengths = cables.contractions.lengths(POSE)
    drives = cables.drive_states(lengths, [20.0, -7.0, 0.0, 13.0])
    stack = ep.shoulder_rotation([10.0, 50.0, 120.0], [20.0, 60.0, 90.0], 5.0, degrees=True)
    chain = ep.Plant(device("serial-y-x-z"), wearer=TISSUE)
    creeping = ep.Plant(ep.load("four-cables"), ep.PlantOptions(winch=control.Winch(damping_time=0.2)))
    return (
        muscles.rest([1.2e5, 0.7e5, 0.4e5]), cables.rest(near=POSE, drive_positions=drives.positions), drives,
        chain.rest(near=POSE),
        [muscles.rest(given, ep.shoulder_rotation(*turn, degrees=True)).orientation for given, turn in FAR],
        [cables.force_limits(lengths, slack) for slack in (False, True)], muscles.force_limits([0.2, 0.31, 0.37]),
        muscles.drive_states([0.2, 0.31, 0.37], [30.0, 11.0, 900.0]), control.missing_moments(cables, stack),
        control.missing_moments(muscles, stack), creeping.simulate(waves(4), 0.001, creeping.held(POSE,
        [9.0] * 4)).steps > 0,
    )  # fmt: skip


def refused():
    plant, options, motor = ep.Plant(ep.load("prototype")), ep.PlantOptions, control.JointMotor
    cables = ep.Plant(ep.load("four-cables"))
    state, still = plant.state(), waves(3)
    end = {"start": 0.5, "end": 0.5}
    parts = ("supply", "muscle_damping", "winch", "linear_actuator", "joint_motor", "muscle_friction", "valves")
    return in_turn(
        **{f"{name} as 3": lambda name=name: options(**{name: 3}) for name in parts},
        flange=lambda: options(second_flange=1),
        adiabatic=lambda: options(polytropic_exponent=1.41), isothermal=lambda: options(polytropic_exponent=0.99),
        ends=lambda: [ep.Fault("supply drop", 0, command=c, share=s) for c, s in ((-1.0, 0.0), (1.0, 1.0))],
        edges=lambda: [options(polytropic_exponent=kappa).polytropic_exponent for kappa in (1.0, 1.4)],
        dead=lambda: options(dead_volume=0.0), supply=lambda: options(supply=4e5),
        law=lambda: options(muscle_friction=3.0),
        field=lambda: options().replace(valve=1),
        gear=lambda: motor(play=0.1), beyond=lambda: motor(stiffness=9.0), inertia=lambda: motor(inertia=-1.0),
        winch=lambda: control.Winch(gear_ratio=0.0), screw=lambda: control.LinearActuator(lead=-1.0),
        unknown=lambda: ep.Plant(ep.load("nesm")), options=lambda: ep.Plant(ep.load("prototype"), 3),
        couple=lambda: ep.Plant(ep.load("prototype"), load=ep.Load([0, 0, 0], [1.0, 0, 0])),
        frame=lambda: ep.Plant(ep.load("prototype"), load=ep.Load([1.0, 0, 0], frame="arm")),
        wearer=lambda: ep.Plant(ep.load("prototype"), wearer=[3]), payloads=lambda: ep.Plant(ep.load("prototype"),
        payloads=[3]),
        torso=lambda: ep.Plant(ep.load("prototype"), torso=3), cuff=lambda: ep.Plant(ep.load("prototype"), cuff=3),
        soft=lambda: ep.Plant(ep.load("prototype"), cuff=control.Padding(damping_time=0.01, source="a test")),
        pressures=lambda: plant.state(pressures=[1.0, 2.0]), vacuum=lambda: plant.state(pressures=-1.0),
        state=lambda: cables.simulate(waves(4), 0.1, state), controller=lambda: plant.simulate(3, 0.1),
        sensor=lambda: plant.simulate(still, 0.1, sensor=3), duration=lambda: plant.simulate(still, 0.0),
        rates=lambda: plant.simulate(still, 10.0, control_rate=2e6), loose=lambda: plant.simulate(still, 0.1,
        rtol=2e-3),
        late=lambda: plant.simulate(still, 0.1, faults=ep.Fault("torn", 1, 0.1)), step=lambda: plant.step(state,
        [0.0] * 3, 1e-10),
        few=lambda: plant.simulate(lambda t, seen: [0.0], 0.1), many=lambda: plant.simulate(lambda t,
        seen: [np.nan] * 3, 0.1),
        broken=lambda: plant.simulate(lambda t, seen: {}[t], 0.1),
        ended=lambda: plant.simulate(lambda t, seen: [0.0] * (3 if t < 0.02 else 2), 0.05).status,
        broke=lambda: plant.simulate(lambda t, seen: [1.0 / (t < 0.02)] * 3, 0.05).status,
        sensed=lambda: plant.simulate(still, 0.05, sensor=lambda t, seen: seen if t < 0.02 else None).status,
        recorded=lambda: plant.simulate(still, 0.02).state(0.013),
        shape=lambda: replace(state, pressures=np.zeros(2)), turned=lambda: replace(state, quaternion=np.ones(4)),
        low=lambda: replace(state, supply_pressure=-2e5), command=lambda: replace(state, commands=np.full(3, 1.1)),
        stepped=lambda: replace(state, step=0.0), before=lambda: replace(state, time=-1.0),
        kind=lambda: ep.Fault("broken", 0), limb=lambda: ep.Fault("torn", -1), end=lambda: ep.Fault("torn", 0, **end),
        leak=lambda: ep.Fault("leak", 0), hole=lambda: ep.Fault("torn", 0, leak=Valve(1e-9)),
        brake=lambda: ep.Fault("slipping brake", 0),
        held=lambda: ep.Fault("jam", 0, brake_force=3.0), share=lambda: ep.Fault("supply drop", 0, share=1.1),
        stuck=lambda: ep.Fault("stuck valve", 0, command=-1.1), reported=lambda: ep.Fault("jam", 0,
        reported_after=-1.0),
        text=lambda: ep.Fault.from_text("torn,4,1", 3), words=lambda: ep.Fault.from_text("torn,1", 3),
        texts=lambda: [ep.Fault.from_text(f"{word},2,0.5", 3) for word in ("stuck-open", "stuck-shut", "jam",
        "encoder-loss")],
        air=lambda: cables.simulate(waves(4), 0.1, faults=ep.Fault("burst", 0)),
        current=lambda: plant.simulate(still, 0.1, faults=ep.Fault("jam", 0)), third=lambda: plant.simulate(still, 0.1,
        faults=ep.Fault("torn", 3)),
        times=lambda: [(ep.Fault("jam", 1, 1.0, 2.0, reported_after=0.1).acts(t), ep.Fault("jam", 1, 1.0, 2.0,
        reported_after=0.1).is_reported(t))
                       for t in (0.99, 1.0, 1.09, 1.11, 1.99, 2.0)],
    )  # fmt: skip


class Standing:
    """A reference for one time only."""

    duration = 1.0

    def __call__(self, t):
        return control.ReferenceState(ep.shoulder_rotation(0, 0, 0), np.zeros(3), np.zeros(3))


@in_a_folder
def lacking():
    """What plants, runs and experiments lack, and where they end."""
    prototype, cables, worn = ep.load("prototype"), ep.load("four-cables"), ep.load("four-linear-actuators-worn")
    cuffed = cables.replace(
        arm=ep.Arm.from_anthropometry(1.75, 75, sex="male"),
        interfaces=ep.Interfaces(cuff=ep.Interface.of([3.7e3, 3.15e3, 2.25e3], 12.0, at=(0.0, 0.0, -0.2))),
    )
    guided = [replace(limb, kind="UPU", guide=ep.LimbGuide(65.0, 50.0)) for limb in cuffed.limbs]
    quick = [replace(limb, actuator=replace(limb.actuator, speed_limit=0.8)) for limb in cables.limbs]
    pad = control.Padding(damping_time=0.01, mass=0.0, source="a test")
    far = control.Turn(ep.shoulder_rotation(-60.0, 0.0, 80.0, degrees=True), [0.0, 0.0, 0.1], 1.0)
    abduction, muscles = control.experiment("abduction"), ep.Plant(prototype)
    blind = control.Experiment("lift", "Lift", worn.replace(measures=["lengths"]).mechanism, PATH, "model")
    damped = ep.Plant(cables, ep.PlantOptions(winch=control.Winch(damping_time=0.3)))
    whole = ep.Plant(cables, wearer=lambda t, arm: np.zeros(3))
    return in_turn(
        damping=lambda: control.Padding(source="a test"), source=lambda: control.Padding(damping_time=0.01),
        cuff=lambda: ep.Plant(cables, cuff=pad), body=lambda: ep.Plant(cuffed, cuff=pad),
        guide=lambda: ep.Plant(cuffed.replace(limbs=guided), cuff=replace(pad, mass=0.1, radius=0.1)),
        limits=lambda: ep.Plant(device("nesm")),
        speed=lambda: [(drive.parameters.no_load_speed, drive.damping_ratio) for drive in
                       ep.Plant(cables.replace(limbs=quick)).drives],
        damped=lambda: damped.simulate(waves(4), 0.001, damped.held(POSE, [20.0] * 4)).status,
        other=lambda: whole.simulate(waves(4), 0.1, damped.rest()), wild=lambda: muscles.step(
            replace(muscles.state(), angular_velocity=np.full(3, 1e11)), [0.0] * 3, 0.1),
        weightless=lambda: ep.Plant(prototype.replace(gravity=(0.0, 0.0, 0.0)),
                                    ep.PlantOptions(second_flange=True)).rest(near=POSE),
        once=lambda: prototype.track(Standing()),
        stroke=lambda: ep.load("four-linear-actuators").track(far), blind=lambda: blind.foreseen,
        gains=lambda: prototype.track("flexion", feedback=control.FeedbackGains()),
        limb=lambda: abduction.replace(faults=ep.Fault("burst", 9)),
        kind=lambda: abduction.replace(faults=ep.Fault("no current", 0)),
        after=lambda: abduction.replace(faults=ep.Fault("burst", 0, start=3.0), duration=3.0).run(),
        long=lambda: control.muscle_loop(muscle_model("best", 0.25), 1.3, 0.15, duration=1e9),
        share=lambda: control.muscle_loop(muscle_model("best", 0.25), 1.3, 15.0),
        safe=lambda: control.experiment("held-abduction", lambda t, seen: [1.0, -1.0, 0.5]).replace(
            duration=0.5, supply=Supply(19e5)).run().cautions,
    )  # fmt: skip


ASKED = {
    each.__name__: each
    for each in (
        muscles,
        tackles,
        winches,
        actuators,
        worn,
        geared,
        direct,
        padded,
        braked,
        chains,
        at_rest,
        refused,
        lacking,
    )
}

#: Those that take longer than 0.15 s.
LONGER = {"chains", "lacking", "worn", "geared", "refused"}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
