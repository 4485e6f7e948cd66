"""Answers of experiments as they are stored: their catalogue, runs with what is found in them, loops, measured runs."""

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
from answers import changes, each_of
from asked_in_turn import in_a_folder, in_digits, in_turn
from asked_plants import POSE, SPIN, TISSUE, device, waves
from places import URDF

import exo_pin as ep
from exo_pin import control
from exo_pin.control import PIGains, experiment
from exo_pin.muscle import ConstantFriction, Valve, ValveUnit, muscle_model

SHORT = control.AnglePath([0.0, 0.25], np.radians([[5, 20, 0], [20, 45, -10]]))


def catalogue():
    """What each experiment of the catalogue is made of."""
    found = {}
    for name in control.experiments():
        one = experiment(name)
        limbs = [(limb.stroke.nominal_length, limb.stroke.end_fitting) for limb in one.mechanism.limbs if limb.stroke]
        state = one.reference([0.0, 0.37 * one.reference.duration, one.reference.duration])
        own = {
            "fields": {
                key: str(getattr(one, key))
                for key in ("title", "controller", "duration", "faults", "rate", "feedback", "source")
            }
        }
        options = {key: value for key, value in vars(one.options).items() if value != getattr(ep.PlantOptions(), key)}
        found[name] = own | {
            "options": str(options), "imu": str(one.imu), "reference": (repr(one.reference),
            state.orientation.as_rotvec(), state.angular_velocity),
            "device": (one.mechanism.name, limbs, one.mechanism.arm.centre_of_mass, one.mechanism.geometry.base_points),
        }  # fmt: skip
    return found


def assumed():
    """What plants of the presets take for known."""
    names = ("prototype", "four-cables", "three-linear-actuators", "four-muscle-cables", "optimised-table-5-3")
    told = {name: lambda name=name: [str(each) for each in ep.Plant(ep.load(name)).assumptions] for name in names}
    rubbing = ep.PlantOptions(muscle_friction=ConstantFriction(), shoulder_coulomb=0.1, second_flange=True)
    flanged = ep.Plant(ep.load("prototype"), rubbing)
    return in_turn(
        **told,
        flange=lambda: [str(each) for each in flanged.assumptions],
        serial=lambda: [str(each) for each in ep.Plant(device("serial-y-x-z")).assumptions],
        options=lambda: control.options_for(ep.load("four-muscle-cables")),
    )


def tracked(one, brief=False):
    found = one.run()
    told = {
        "says": str(found).splitlines(),
        "verdict": found.verdict,
        "known": found.known,
        "summary": found.summary(),
        "foreseen": one.foreseen,
    }
    if brief:
        return told
    angles = [found.angles(wanted, convention) for wanted in (False, True) for convention in ("shoulder", "thesis")]
    return told | {
        "angles": angles,
        "columns": [*found.columns().items()],
        "rms": found.rms_error(found.reachable),
        "parts": [found.error_vector, found.air_energy, found.energy_in, found.main_angle, found.missing_moment],
    }


def tracks():
    """Short runs of muscles and cables along references, with faults, lost sensors, and motors at their limits."""
    still = ep.load("prototype").mechanism
    lost = control.Imu(drift=0.3, lost=((0.1, 0.17),), delay=0.02, noise=0.01, seed=3)
    torn = (ep.Fault("torn", 0, 0.1), ep.Fault("torn", 2, 0.1), ep.Fault("no current", 1, 0.15))
    cables = control.Experiment(
        "cables", "Cables", ep.load("four-cables").mechanism, SHORT, duration=0.3, faults=torn, imu=lost
    )
    every = tuple(ep.Fault("burst", k, 0.05) for k in range(3))
    return {
        "muscles": tracked(replace(experiment("held-abduction"), duration=0.2)),
        "burst": tracked(control.Experiment("burst", "Burst", still, SHORT, faults=every), True),
        "cables": tracked(cables, True),
        "pi": tracked(control.Experiment("pi", "Lengths", ep.load("three-linear-actuators").mechanism, SHORT, "pi"),
        True),
        "function": tracked(control.Experiment("own", "Own", ep.load("four-linear-actuators").mechanism, SHORT,
        waves(4),
        duration=0.1), True),
        "late": tracked(control.Experiment("late", "Late", ep.load("four-cables").mechanism, SHORT, duration=0.2,
        imu=control.Imu(lost=((3.0, 4.0),)), feedback=control.FeedbackGains(stiffness=30.0, damping=2.0)), True),
    }  # fmt: skip


def findings():
    """What is found in runs that leave their stroke, stand still, end early, or move a chain."""
    muscles, screws = ep.load("prototype").mechanism, ep.load("three-linear-actuators").mechanism
    quick = control.flexion(1.5, 0.5, "minimum_jerk")
    path = Valve(2e-9, 0.3)
    vented = ep.PlantOptions(valves=ValveUnit(path, path, layout="fill and vent"))
    gains = control.FeedbackGains(stiffness=9.0, damping=0.5, air_ahead=True)
    serial = ep.load(URDF / "serial-y-x-z.urdf").device
    jobs = {
        "beyond": {"mechanism": muscles, "reference": quick, "controller": "model", "duration": 0.9,
        "options": vented, "feedback": gains},
        "lengths": {"mechanism": muscles, "reference": quick, "controller": "pi", "duration": 0.9},
        "screws": {"mechanism": screws, "reference": control.flexion(2.6, 0.7), "controller": "pi", "duration": 0.8},
        "ends": {"mechanism": muscles, "reference": SHORT, "controller": lambda t, seen: [0.3 / (t < 0.1)] * 3,
        "duration": 0.2},
        "chain": {"mechanism": serial, "reference": SHORT, "controller": "model", "duration": 0.03},
        "start": {"mechanism": screws, "reference": control.AnglePath([0.0, 1.0], [[3.0, 1.5, 0.0], [0.0, 0.0, 0.0]])},
    }  # fmt: skip
    return in_turn(
        **{
            name: lambda name=name, job=job: tracked(control.Experiment(name, name.title(), **job), True)
            for name, job in jobs.items()
        }
    )


def recorded(tracking, **changes):
    """A tracking of 101 samples, each as the first one of a run, but for what is stated of run and tracking."""
    times, run = np.linspace(0.0, 2.0, 101), tracking.run
    own = {each.name: getattr(run, each.name) for each in fields(run)}
    own = {
        name: np.repeat(value[:1], 101, axis=0)
        for name, value in own.items()
        if isinstance(value, np.ndarray) and len(value) == len(run.times)
    }
    parts = {"rotations": abducted(np.minimum(40.0 * times + 3.0, 50.0)), "times": times} | changes
    of_run = own | {name: value for name, value in parts.items() if name in own or name == "rotations"}
    ratios = np.full((101, run.plant.count), 0.1)
    about = {"wanted": abducted(40.0 * times), "wanted_ratios": ratios, "ratios": ratios} | {
        name: value for name, value in changes.items() if name not in of_run
    }
    return replace(tracking, run=replace(run, **of_run), missing_moment=np.zeros(101), **about)


def abducted(angle):
    return ep.shoulder_rotation(20.0, angle, 0.0, degrees=True)


def columns(usual, *changed):
    """Values (101, n), with those of one limb changed at some samples."""
    values = np.tile(np.asarray(usual, dtype=float), (101, 1))
    for limb, first, end, value in changed:
        values[first:end, limb] = value
    return values


def made_records():
    """What is said of records in which what happens and when is known, just below and just above what is worth it."""
    muscles = experiment("abduction-long").replace(duration=0.05).run()
    motors = ep.load("four-linear-actuators-worn").track("flexion", "model", duration=0.02)
    drives = motors.run.plant.drives
    shortest, limits = [each.shortest for each in drives], np.array([each.force_limit for each in drives])
    times, taut = np.linspace(0.0, 2.0, 101), columns([1.0] * 3)
    lengths = muscles.run.plant.contractions.lengths(abducted(80.0))
    wanted = [0.1] * 3
    torn = [
        tuple(ep.Fault("torn", k, start) for k in limbs) for limbs, start in (((0, 2), 1), ((0, 1, 2), 1.5), ((1,), 3))
    ]
    made = {
        "still": recorded(muscles, tensions=taut),
        "long": recorded(muscles, tensions=taut, wanted_ratios=columns(wanted, (0, 0, 1, -0.19)),
                         ratios=columns(wanted, (1, 0, 1, -0.01))),
        **{f"starts {off} off": recorded(muscles, tensions=taut, rotations=abducted(
            40.0 * times + off * (times < 0.05))) for off in (1.9, 2.1)},
        "ends near": recorded(muscles, tensions=taut, rotations=abducted(np.minimum(40.0 * times, 78.1))),
        **{f"creeps by {rate}": recorded(muscles, tensions=taut, rotations=abducted(
            np.minimum(40.0 * times, 50.0 + rate * np.maximum(times - 1.25, 0.0)))) for rate in (1.8, 2.2)},
        "needs": recorded(muscles, tensions=taut, wanted_ratios=columns(
            wanted, (0, 50, 80, -0.2), (1, 75, 101, 0.4), (2, 25, 35, 0.4))),
        "few": recorded(muscles, tensions=taut, wanted_ratios=columns(wanted, (0, 50, 52, -0.2), (1, 50, 53, -0.2))),
        "stroke": recorded(muscles, tensions=columns([1.0] * 3, (0, 0, 51, 0.0), (2, 0, 50, 0.0)),
                           pressures=columns([1e5] * 3, (1, 30, 50, 0.49e5), (1, 50, 101, 0.51e5)),
                           ratios=columns(wanted, (1, 30, 101, 0.4))),
        "ends": recorded(motors, drive_positions=columns(np.add(shortest, 1e-3), (1, 60, 101, shortest[1] - 1e-6)),
                         motor_forces=columns(0.99 * limits, (2, 40, 41, limits[2]), (3, 0, 10, -limits[3]))),
        **{f"{off} mm": recorded(muscles, tensions=taut, lengths=columns(lengths + 1e-3 * np.array([off, -1.0, 0.0])))
           for off in (2.9, 3.1)},
        "safe": recorded(muscles, tensions=columns([0.0] * 3, (0, 0, 50, 1.0)),
                         pressures=columns([1e5] * 3, (1, 40, 41, 4.0036e5), (2, 40, 41, 4.0044e5))),
        "down": recorded(muscles, tensions=taut, wanted=abducted(80.0 - 40.0 * times)),
    }  # fmt: skip
    for k, faults in enumerate(torn):
        study = muscles.experiment.replace(faults=faults, duration=4.0, controller=lambda t, seen: [0.0] * 3)
        made[f"faults {k}"] = replace(made["still"], experiment=study)
    unseen = muscles.experiment.replace(
        imu=control.Imu(lost=((0.51, 0.73),), delay=0.05), controller=lambda t, seen: [0.0] * 3
    )
    made["unseen"] = replace(made["still"], experiment=unseen)
    numbers = recorded(muscles, tensions=np.linspace(10.0, 60.0, 303).reshape(101, 3),
                       tension_work=columns([0.0, 1.0, 2.0]), air_used=np.linspace(0.0, 2e-3, 101))  # fmt: skip
    more = 1.0 + times[:, None]
    # Beyond what a shoulder can do from 1 s on.
    turned = ep.shoulder_rotation(30.0, 10.0, np.where(times < 1.0, 0.0, 170.0), degrees=True)
    borne = recorded(motors, rotations=turned, tensions=more * [10, 20, 30, 40], tension_work=more * [1.0, 2, 3, 4],
                     electric_energy=more**2 * [1.0, 1, 0, 1], angular_velocity=more * [1.0, -2.0, 0.5])  # fmt: skip
    said = {name: (one.findings, one.cautions) for name, one in made.items()}
    verdicts = [made[name].verdict for name in ("still", "ends", "down")]
    table = {name: np.asarray(values)[::25] for name, values in numbers.columns().items()}
    counts = len(table), len(borne.columns())
    return said, verdicts, counts, numbers.summary(), table, borne.run.summary(), made["down"].summary()


def refused_experiments():
    own = lambda **more: lambda: control.Experiment("one", "One", ep.load("four-cables").mechanism, SHORT, **more)  # noqa: E731
    parts = ("mechanism", "reference", "options", "imu", "feedback", "controller", "cuff", "harness", "torso")
    return in_turn(
        **{f"{name} as 3": lambda name=name: experiment("flexion").replace(**{name: 3}) for name in parts},
        name=lambda: experiment("nothing"), rate=own(rate=0.0), duration=own(duration=-1.0),
        controller=own(controller="best"), faults=own(faults=(3,)), imu=own(imu=3), options=own(options=3),
        field=lambda: own()().replace(beauty=1),
        many=lambda: own()().replace(duration=0.1, shoulder_viscous=0.3).options.shoulder_viscous,
        muscles=lambda: control.Experiment("one", "One", ep.load("prototype").mechanism, 3),
        reference=lambda: control.reference_of(3), words=lambda: repr(control.reference_of("flexion", "right")),
        file=lambda: control.reference_of("nothing.csv"),
        movement=lambda: control.reference_of(SHORT.movement(50.0))(0.1).motion,
        unknown=lambda: control.muscle_loop(muscle_model("best"), 1.0, 0.41),
        mass=lambda: control.muscle_loop(muscle_model("best"), 0.0, 0.1),
        short=lambda: control.muscle_loop(muscle_model("best"), 1.0, 0.1, duration=0.0),
    )  # fmt: skip


def loops():
    """Steps of one muscle under its controller, with each kind of valve and friction."""
    path = Valve(3e-10, 0.4)
    options = [
        ep.PlantOptions(valves=ValveUnit(path, path, layout="fill and vent", frequency=13.0),
        muscle_friction=ConstantFriction(), polytropic_exponent=1.3),
        ep.PlantOptions(valves=ValveUnit(path, path), muscle_damping=None, dead_volume=4e-6),
    ]  # fmt: skip
    made = [
        control.muscle_loop(muscle_model("best", 0.25), 1.3, 0.12, gains=PIGains(0.03, 0.6), options=each, duration=0.6)
        for each in options
    ]
    made.append(control.muscle_loop(muscle_model("fitted-second-order", 0.15), 0.7, 0.15, duration=1.0))
    return [(each, each.cautions) for each in made]


def measurements():
    """What sensors report under faults, and the motion of an arm at the ends of its shoulder, of chains."""
    seen, cables = [], ep.Plant(ep.load("four-cables"))
    faults = [
        ep.Fault("encoder loss", 0, 0.01, reported_after=0.01),
        ep.Fault("jam", 0, 0.0, 0.03, reported_after=0.0),
        ep.Fault("torn", 2, 0.02, reported_after=0.0),
    ]
    run = cables.simulate(
        lambda t, now: seen.append(now) or [0.1] * 4,
        0.05,
        replace(cables.held(POSE, [20.0] * 4), angular_velocity=SPIN),
        faults=faults,
    )
    options = ep.PlantOptions(shoulder_viscous=0.2, shoulder_coulomb=0.3, stop_stiffness=70.0, stop_damping=0.6)
    stopped = ep.Plant(ep.load("prototype"), options, wearer=TISSUE, payloads=control.Payload(0.4, (0.0, 0.03, -0.3)))
    beyond = stopped.state(ep.shoulder_rotation(110.0, 20.0, 60.0, degrees=True), SPIN, 1e5)
    ends = stopped.simulate(lambda t, now: [0.3, -0.2, 0.5], 0.006, beyond, 500.0, sample_rate=300.0, rtol=1e-4)
    rest = stopped.rest([1e5, 0.5e5, 0.0], near=POSE)
    later = [ep.Fault("torn", 3, 0.026), ep.Fault("jam", 1, 0.022, 0.025)]
    stepped = cables.step(run.state(0.02), [0.3, -0.2, 0.5, 0.1], 0.0073, later)
    return (
        seen,
        stepped,
        run.commands,
        {
            name: getattr(ends, name)
            for name in (
                "stop_moment",
                "friction_moment",
                "angular_acceleration",
                "shoulder_loss",
                "tensions",
                "energy_residual",
            )
        },
        rest.quaternion,
    )


@in_a_folder
def measured():
    """Files of measured runs, written and read back, with columns in any order and unit, and those that are refused."""
    poses = ep.shoulder_rotation([10.0, 20.0, 35.0], [30.0, 40.0, 45.0], [5.0, 0.0, -5.0], degrees=True)
    whole = control.MeasuredRun(
        poses, np.arange(9.0).reshape(3, 3) / 30.0 + 0.2, [0.0, 0.1, 0.3], 1e5 * np.arange(9.0).reshape(3, 3)
    )
    control.write_run(whole, "whole.csv", ["made by a test"])
    control.write_run(replace(whole, times=None, pressures=None), "plain.csv")
    angles = "flexion_deg,abduction_deg,internal_rotation_deg"
    files = {
        "order": f"length_2_m,{angles},length_1_m,pressure_1_Pa,force_1_N\n"
        "0.2,30,40,10,0.1,200000,\n0.25,31,41,11,0.15,210000,a note\n",
        "gap": f"{angles},length_1_mm,length_3_mm\n1,2,3,4,5\n",
        "units": f"{angles},length_1_mm,length_2_m\n1,2,3,4,5\n",
        "unit": f"{angles},length_1_cm\n1,2,3,4\n", "twice": f"{angles},length_1_mm,length_1_m\n1,2,3,4,5\n",
        "none": f"{angles},time_s\n1,2,3,0\n", "lost": f"{angles},length_1_mm\n1,2,3,4\n,2,3,4\n",
        "times": f"time_s,{angles},length_1_mm\n0.1,2,3,4,200\n0.1,2,3,4,200\n",
    }  # fmt: skip
    for name, text in files.items():
        Path(f"{name}.csv").write_text(text)
    read = {name: lambda name=name: control.read_run(f"{name}.csv", "right") for name in ("whole", "plain", *files)}
    run = control.MeasuredRun
    return [in_digits(Path(f"{name}.csv").read_text()).splitlines() for name in ("whole", "plain")], in_turn(
        **read, missing=lambda: control.read_run("nothing.csv"), side=lambda: control.read_run("whole.csv", "up"),
        single=lambda: run(poses[0], np.ones((1, 3))), rows=lambda: run(poses, np.ones((2, 3))),
        still=lambda: run(poses, np.ones((3, 3)), [0.0, 0.1, 0.1]), kind=lambda: control.write_run(3, "x.csv"),
    )  # fmt: skip


ASKED = {
    each.__name__: each
    for each in (catalogue, assumed, tracks, findings, made_records, refused_experiments, loops, measurements, measured)
}

#: Those that take longer than 0.15 s.
LONGER = {"findings", "made_records", "tracks", "catalogue", "measurements"}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
