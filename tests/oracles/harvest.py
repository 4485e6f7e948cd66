"""One example of every public class, caught while questions of every kind are answered."""

import importlib
import importlib.util
import inspect
import pkgutil
import sys
import typing
from collections import Counter

import foreign_records
import numpy as np
from calibration_examples import calibration_examples
from control_examples import control_examples
from examples import error_examples, muscle_examples, muscle_program_examples, rare_examples, report_examples
from guided_limbs import guided
from moving_chains import moving
from places import URDF
from published_problems import windows
from published_urdf import published_urdf
from rubbing_chains import slide
from scipy.interpolate import PchipInterpolator
from scipy.spatial.transform import Rotation
from sdf_robots import random_sdf
from sockets import hanging
from trajectory_examples import trajectory_examples
from workspace_examples import workspace_examples
from wrists import PERSON, heavy_limbs, map_of

import exo_pin as ep
from exo_pin import control, device, wrist
from exo_pin.chain.formats.sdf import sdf_writing
from exo_pin.control.gym_env import ShoulderEnv
from exo_pin.exo.first_answer import answer_in_parts
from exo_pin.exo.pose_report import report_on_pose
from exo_pin.numerics import least_forces
from exo_pin.person.limb.myoarm import glenoid_surface, myoarm
from exo_pin.view import ChainScene, Scene
from exo_pin.wrist_chain import wrist_urdf as urdf

POSE = ep.shoulder_rotation(40, 20, 10, degrees=True)
#: Examples of a class that are enough.
MOST = 8
#: Returns of one function that are looked at: later ones hardly bring another form, and looking takes time.
LOOKS = 30
POSES = ep.shoulder_rotation([30, 40], [20, 20], [0, 10], degrees=True)


def public_classes():
    """Every class that some module of the package lists in ``__all__``, or defines where it lists none."""
    found = set()
    for entry in pkgutil.walk_packages(ep.__path__, "exo_pin."):
        # Options of a command are read by the parser alone.
        if not entry.name.endswith("__main__") and not entry.name.startswith("exo_pin.cli"):
            module = importlib.import_module(entry.name)
            own = [name for name, value in vars(module).items() if getattr(value, "__module__", "") == entry.name]
            for name in getattr(module, "__all__", [name for name in own if not name.startswith("_")]):
                value = getattr(module, name)
                # A TypedDict describes arguments; there are no objects of it.
                kind = inspect.isclass(value) and not typing.is_typeddict(value)
                if kind and value.__module__.startswith("exo_pin"):
                    found.add(value)
    return sorted(found, key=lambda kind: (kind.__module__, kind.__qualname__))


class Catcher:
    """Keeps some objects of each class that functions of the package return or have as locals."""

    def __init__(self):
        self.caught = {}
        self.looks = Counter()

    def __enter__(self):
        sys.setprofile(self._look)
        return self

    def __exit__(self, *_):
        sys.setprofile(None)

    def keep(self, value):
        kind = type(value)
        if kind.__module__.startswith("exo_pin"):
            found = self.caught.setdefault(kind, {})
            if len(found) < MOST:
                found.setdefault(_form(value), value)
        if isinstance(value, tuple | list):
            for item in value[:8]:
                self.keep(item)

    def keep_all(self, value, seen):
        """Keep a value and all that it holds."""
        if id(value) in seen:
            return
        seen.add(id(value))
        self.keep(value)
        inner = list(value) if isinstance(value, tuple | list) else list(getattr(value, "__dict__", {}).values())
        for item in inner:
            if isinstance(item, tuple | list) or type(item).__module__.startswith("exo_pin"):
                self.keep_all(item, seen)

    def _look(self, frame, event, value):
        if event == "return" and self.looks[frame.f_code] < LOOKS and "/exo_pin/" in frame.f_code.co_filename:
            self.looks[frame.f_code] += 1
            self.keep(value)
            for item in tuple(frame.f_locals.values()):
                self.keep(item)
                # Attributes, too: some objects are only ever built within others.
                if type(item).__module__.startswith("exo_pin"):
                    self.keep(tuple(getattr(item, "__dict__", {}).values()))


def _form(value):
    """Types of the attributes: examples of one class that differ in them may be copied in different ways."""
    inner = tuple(getattr(value, "__dict__", {}).values()) or (value if isinstance(value, tuple) else ())
    return tuple((type(item), getattr(getattr(item, "flags", None), "writeable", None)) for item in inner)


def harvest(folder):
    """Examples by class, one of every form (types of attributes), up to ``MOST``."""
    with Catcher() as catcher:
        for scenario in (*NUMERICAL, *OTHER):
            scenario(folder)
    # Made once in a process: a query of another test may have made them.
    made_once = (glenoid_surface(), myoarm(), *muscle_program_examples()) if has_persons() else ()
    for example in (*(example for make in EXAMPLES for example in make()), *made_once):
        catcher.keep_all(example, set())
    return {kind: list(found.values()) for kind, found in catcher.caught.items()}


def _forces(folder):
    exo = guided(ep.load("prototype").worn_by(PERSON), stiffness=2e4 * np.eye(3))
    exo.reaction(POSES).certificate.__str__()
    exo.reaction(POSES).range()
    exo.reaction(POSES, split="minimal", constraint_bounds=(-5, 5)).optimum.kkt.shape  # noqa: B018 - made on demand
    exo.reaction(POSE, split="minimal", limits=(0, 5), cone=hanging(20), weights=ep.Weights())
    exo.reaction(POSE, split="elastic", centre_offset=ep.CentreOffset([0.001, 0, 0], [0, 0, 0.001]))
    report_on_pose(exo, exo.reaction(POSE)).__str__()
    answer_in_parts(report_on_pose(exo, exo.reaction(POSE)))
    ep.Interface.upper_arm_cuff(0.2)
    exo.reaction(POSE, ep.Motion([1, 0, 0], [0, 1, 0]), ep.Load([0, 0, -5]))
    for split in ("spherical", "minimal"):
        exo.reaction_map(POSES, split=split)
    heavy = heavy_limbs(exo.mechanism, np.random.default_rng(0))
    ep.ShoulderExo.from_mechanism(heavy).reaction(POSE)
    exo.follow(ep.Movement.from_samples(np.linspace(0, 1, 9), _swing(9)))
    least_forces(np.ones((2, 3)), np.ones((2, 3, 2)), -np.ones((2, 2)), np.ones((2, 2)))
    strong = ep.Limb(actuator=ep.Actuator("linear", 20.0, 20.0), stroke=ep.Stroke(0.3, 0.5, 2.0, 0.0))
    ep.load("prototype").replace(limbs=[strong] * 3).remedy(POSE).__str__()
    report_on_pose(exo, exo.reaction(POSE)).cautions  # noqa: B018 - made on demand
    exo.check()
    ep.ShoulderExo.from_chain(exo.chain)
    ep.sweep(exo.replace(limbs=None), {"r_A": [0.1, 0.11]}, POSES)


def _recordings(folder):
    truth = foreign_records.movement(0, "left")
    for writer in (foreign_records.clinical, foreign_records.mvnx):
        ep.read_movement(writer(folder, truth)[0], reading=ep.RecordingOptions(start=(0, 0, 0)))
    path, _ = foreign_records.clinical(folder, truth._replace(angles=np.radians(truth.angles)))
    assert ep.read_movement(path).cautions


def _swing(count):
    return ep.shoulder_rotation(np.linspace(0, 40, count), np.linspace(0, 20, count), np.zeros(count), degrees=True)


def _unknowns(folder):
    exo = guided(ep.load("prototype").worn_by(PERSON), stiffness=2e4 * np.eye(3))
    exo.uncertainty(POSE)
    exo.total_uncertainty(POSE, draws=8)
    ep.workspace.day_reach(ep.load("four-linear-actuators-worn"), ["stroke"], step=60.0)
    exo.reaction(POSE, centre_offset=ep.CentrePath(np.radians([0, 30, 60, 90]), 1e-3 * np.eye(4, 3)))


def _wrists(folder):
    exo = ep.load("prototype")
    geometry = exo.geometry
    state = exo.inverse_kinematics(POSE)
    exo.forward_kinematics(state.lengths)
    exo.singularity(POSE)
    exo.nearest_singularity(POSE)
    exo.accuracy(POSES)
    wrist.joint_jacobians(geometry, POSE)
    map_of(exo.mechanism, POSE)
    wrist.daily_crossings(geometry, step_deg=15.0)
    wrist.OrientationChain(Rotation.identity(), Rotation.identity())


def _chains(folder):
    for name in ("3RRR", "rigid loop"):
        chain, independent, q, v, a = moving(name)
        chain.split(q, independent)
        chain.mirror_signs()
        chain.mobility(q)
        answer = chain.inverse_dynamics(q, v, a)
        answer.joint_reaction(chain.model.names[1])
        chain.close(np.array([q, q]))
        chain.inverse_dynamics(np.array([q, q]), v, a).joint_reaction(chain.model.names[1])
        chain.forward_dynamics(q, v)
        chain.simulate(q, v, times=np.linspace(0, 0.01, 3))
    place = chain.placement(q, chain.closures[0].frame_a)
    chain.inverse_kinematics(chain.closures[0].frame_a, place, q)
    bouncing = slide(np.pi / 2, friction=0.5, limits=(0.0, 1.0))
    bouncing.simulate([0.01], [0.0], [0.0, 0.2], stops=True)
    windows(1).simulate([0.1, -0.1, 0.1], [3.0, -3.0, 3.0], [0.0, 0.6])
    bouncing.forward_dynamics([0.0], stops=True).forces.friction_interval("slide")
    bouncing.inverse_dynamics([0.5], actuated=["slide"])
    chain.inverse_dynamics_derivatives(q, v, a)
    chain.forward_dynamics_derivatives(q, v)
    sdf_writing.sdf_text(chain._state, q)
    ep.ClosedChain.from_sdf(random_sdf(3))
    for made in (chain.to_urdf, chain.to_sdf, chain.to_mjcf):
        path = made(folder)
    ep.ClosedChain.from_mjcf(path)
    ep.ClosedChain.from_sdf(chain.to_sdf(folder))
    urdf.mechanism_urdf(ep.load("prototype").mechanism)
    ep.ClosedChain.from_urdf(*urdf.mechanism_urdf(ep.load("prototype").mechanism))


def _commands(t, measured):
    return [0.5, -1.0, 0.2]


def _plants(folder):
    exo = ep.load("prototype")
    plain, sprung = ep.Plant(exo), ep.Plant(exo, ep.PlantOptions(series_spring=2e3, shoulder_coulomb=0.1))
    fault = ep.Fault("stuck valve", 1, command=0.5)
    for plant, pressures in ((plain, [1e5, 0.0, 3e5]), (sprung, 2e5)):
        start = plant.state(ep.shoulder_rotation(5.0, -8.0, 2.0, degrees=True), pressures=pressures)
        plant.simulate(_commands, 0.004, start, faults=fault, rtol=1e-4)
    plain.assumptions[-1].__str__()


def _moved(folder):
    serial = ep.load(URDF / "serial-y-x-z.urdf").worn_by(ep.Wearer(1.755, 85.0, "male"))
    raised, still = serial.pose(flexion=30), control.flexion()
    wearer = [
        control.Passive(1.0, 1.0, serial.pose(20), source="made up"),
        control.Intent(still, 2.0, 5.0, 0.5, delay=0.02),
        control.Tremor(0.2, 5.0, (1.0, 0.0, 0.0)),
        control.Spasticity(1.0, 0.5, 2.0, (0.0, 1.0, 0.0), source="made up"),
        control.Push(ep.Load([0.0, 0.0, -1.0]), start=0.0, end=0.1),
        control.JointStops({"elevation": (0.0, 0.5)}, 5.0, 0.1, source="made up"),
        control.Fall(75.0, 1e-4, 0.01, 0.1, [0.0, 0.0, -0.5]),
    ]
    cup, torso = (
        control.Payload(1.0, [0.0, 0.0, -0.3], 0.0, 0.02),
        control.Torso(acceleration=PchipInterpolator([0.0, 1.0], np.eye(3)[:2])),
    )
    plant = ep.Plant(serial, wearer=wearer, payloads=[cup], torso=torso)
    wearer[-1].torso.at(0.0, np.zeros(3))
    start = plant.held(raised, serial.reaction(raised).actuator_forces)
    for controller in (control.gravity_compensation(plant), control.AdmittanceController(plant, still, 0.5, 3.0, 5.0)):
        sensors = control.Sensors(
            [control.SensorError("lengths", 1e-4, lost=((0.01, 0.02),)), control.SensorError("orientation")]
        )
        plant.simulate(controller, 0.03, start, sensor=sensors)
    padding = control.Padding(damping_time=0.01, mass=1e-3, radius=0.05, source="made up")
    soft = serial.replace(interfaces=ep.Interfaces(cuff=ep.Interface.upper_arm_cuff(distance=0.2)))
    geared = control.PlantOptions(joint_motor=control.JointMotor(inertia=0.1, stiffness=1e3))
    ep.Plant(soft, geared, cuff=padding).state(raised)
    three = ep.Plant(ep.load("three-linear-actuators"))
    control.gravity_compensation(three)
    with control.ControllerServer(_commands) as server, control.RemoteController(server.address) as remote:
        server.answer(b"no sample")
        remote.reset()
    if importlib.util.find_spec("gymnasium") is not None:
        ShoulderEnv(serial, still)


def _files(folder):
    exo = ep.load("prototype")
    exo.save(folder / "exo.toml")
    ep.load(str(folder / "exo.toml"))
    exo.to_urdf(folder)
    published_urdf()
    ep.load(str(folder / "prototype.urdf"))


def has_persons():
    """Whether the extra ``person`` is installed."""
    return all(importlib.util.find_spec(name) is not None for name in ("myo_sim", "clarabel"))


def _devices(folder):
    serial, support = ep.load(URDF / "serial-y-x-z.urdf"), ep.load(URDF / "spring-support.urdf")
    report_on_pose(serial, serial.reaction(POSE)).__str__()
    serial.singularity(POSES)
    serial.inverse_kinematics(POSES)
    serial.worn_by(ep.Wearer(1.755, 85.0, "male")).workspace(POSES)
    support.reaction(POSE)
    serial.chain.to_urdf(folder)
    support.export(folder / "support.xml")
    serial.export(folder / "serial.sdf")
    ep.load(folder / "support.xml").reaction(POSES)
    serial.replace(brakes=[device.Brake("hold", serial.device.drives[0].joint, 20.0)], drives=serial.device.drives[1:])
    support.reaction(support.pose([0, 60, 130]))
    links = [device.SoftLink("link_1", ep.Interface.of(1e5, 1e3))]
    soft = serial.replace(interfaces=ep.Interfaces(cuff=ep.Interface.upper_arm_cuff(distance=0.19)), soft_links=links)
    soft.reaction(POSE, split="elastic")
    wrist = ep.load("prototype")
    limbs = [device.GuidedSlide(f"limb_{i}_slide", ep.LimbGuide(65.0, 50.0)) for i in (1, 2, 3)]
    guided_wrist = device.ChainDevice.from_chain(wrist.chain).replace(guided_slides=limbs)
    for split in ("elastic", "elastic_locked"):
        ep.solve(guided_wrist, ep.Case(wrist.pose(20, 30)), ep.Assumptions(split, "none"))
    wrist.reaction(POSE, posture=wrist.configurations(POSE))
    ep.reaction.posture_range(wrist, ep.Case(POSE))
    route = device.Route.over(("universe", (0.0, 0.2, 0.2)), ("arm", (0.0, 0.05, -0.2)))
    laws = [device.ConstantForce(3.0), device.LinearSpring(10.0), device.GasSpring(50.0, 0.6, 0.5)]
    springs = [device.Spring(f"spring_{k}", law, route=route) for k, law in enumerate(laws)]
    serial.replace(springs=springs, drives=[*serial.device.drives, device.Drive("cable", route=route)]).reaction(POSE)


def _persons(folder):
    if not has_persons():
        return
    # A person and a pose of their own: answers of programs that another test has asked are kept, and nothing is made.
    person, exo = ep.Person(1.7512, 75, "male"), ep.load("prototype")
    pose = ep.shoulder_rotation(37.3, 18.1, 9.7, degrees=True)
    person.joint_contact(pose)
    person.contact_range(pose)
    person.centre_path()
    exo.joint_contact(pose, person, "least_effort", limits="pull")
    person.on_side("right").with_changes(strength=0.1).joint_contact(pose, outside="mark")
    exo.view(person=person).show(POSE)


def _pictures(folder):
    scene = Scene(guided(ep.load("prototype").worn_by(PERSON), stiffness=2e4 * np.eye(3)))
    scene.show(POSE)
    scene.serve(0)
    scene.close()
    scene.record(POSES, [0.0, 1.0])
    ChainScene(moving("3RRR").chain)
    ep.load(URDF / "serial-y-x-z.urdf").view().show(POSE)


#: Queries of every kind, without pictures.
NUMERICAL = (_forces, _unknowns, _wrists, _chains, _plants, _moved, _devices)
#: Queries with files, pictures and persons.
OTHER = (_files, _recordings, _pictures, _persons)
#: What makes the examples that no query makes.
EXAMPLES = (
    muscle_examples,
    rare_examples,
    report_examples,
    error_examples,
    workspace_examples,
    trajectory_examples,
    calibration_examples,
    control_examples,
)
