"""Arguments of every kernel, recorded while queries of many kinds are answered uncompiled."""

import importlib
import pkgutil
from dataclasses import replace

import numpy as np
import pinocchio as pin
from harvest import NUMERICAL
from moving_chains import moving
from places import URDF
from scipy.spatial.transform import Rotation
from wrists import random_mechanism, regular_poses

import exo_pin as ep
from exo_pin import control
from exo_pin.chain.kinematics.kernels.tree_kernels import place_tree, step_tree, tree_arrays
from exo_pin.chain.kinematics.rank import least_motion
from exo_pin.core import compiled
from exo_pin.numerics import least_forces

#: Calls recorded of one kernel.
MOST = 2


def all_kernels():
    """Every kernel of the package, by name."""
    for module in pkgutil.walk_packages(ep.__path__, "exo_pin."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    found = [each for each in compiled.kernels() if (each.__module__ or "").startswith("exo_pin.")]
    return {f"{each.__module__.removeprefix('exo_pin.')}.{each.__name__}": each for each in found}


def changed(value, change):
    """Apply ``change`` to copies of all arrays of floats and to all floats, in tuples too; the rest is copied.

    A copy is read-only where the array was and has its order: other types would be compiled anew, and are no types that
    queries have.
    """
    if isinstance(value, np.ndarray):
        copy = value.copy(order="K")
        if value.dtype == np.float64:
            copy = change(copy)
        copy.setflags(write=value.flags.writeable)
        return copy
    if isinstance(value, float):
        return np.float64(change(np.array(value)))
    if isinstance(value, tuple):
        parts = [changed(part, change) for part in value]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    return value


def recorded_calls(folder):
    """Arguments of calls from Python and from other kernels: {kernel: list of tuples}, at most ``MOST`` of each."""
    found, make, before = {}, compiled.Kernel._make_plain, {}

    def recording(each):
        plain = make(each)

        def record(*arguments):
            calls = found.setdefault(each, [])
            if len(calls) < MOST:
                calls.append(changed(arguments, lambda numbers: numbers))
            return plain(*arguments)

        return record

    for each in all_kernels().values():
        before[each], each._plain = each._plain, None
    compiled.Kernel._make_plain = recording
    try:
        with compiled.mode("plain"):
            for scenario in (*NUMERICAL, _more_wrists, _more_chains, _workspaces, _controllers):
                scenario(folder)
    finally:
        compiled.Kernel._make_plain = make
        for each, plain in before.items():
            each._plain = plain
    return found


def _more_wrists(folder):
    rng = np.random.default_rng(5)
    for mechanism in (ep.load("prototype").mechanism, random_mechanism(rng, 5, ["UPU"] * 4 + ["SPS"])):
        exo = ep.ShoulderExo.from_mechanism(mechanism)
        poses = regular_poses(mechanism, rng, 3)
        state = exo.inverse_kinematics(poses)
        exo.forward_kinematics(state.lengths)
        exo.forward_kinematics_from_base_angles(theta_x=state.base_theta_x)
        exo.forward_kinematics_from_base_angles(theta_y=state.base_theta_y)
        exo.forward_kinematics_from_base_angles(theta_x=state.base_theta_x, theta_y=state.base_theta_y)
        motion = ep.Motion(rng.normal(size=3), rng.normal(size=3))
        for split in ("spherical", "standalone"):
            exo.reaction_map(poses, motion=motion, load=ep.Load([0, 1, -5]), split=split)
    c, G = rng.normal(size=(20, 3)), rng.normal(size=(20, 3, 6))
    G[:10, 2] = 0.0
    least_forces(c, G, -0.3 * np.ones((20, 6)), 0.2 * np.ones((20, 6)))
    least_forces(c, 1e3 * G, -0.3 * np.ones((20, 6)), 0.2 * np.ones((20, 6)))


def _more_chains(folder):
    coupled, _, q, v, a = moving("coupling loop")
    coupled.simulate(q, v, [0.0, 0.01])
    coupled.inverse_dynamics(q, v, a, actuated=list(coupled.model.names)[1:])
    chain, _, q, v, a = moving("delta with rods")
    chain.inverse_dynamics_derivatives(q, v, a)
    chain.forward_dynamics_derivatives(q, v)
    stack = chain.inverse_dynamics(np.stack([q, q]), v, a, close=True)
    top = chain._state.topology
    least_motion(chain.constraint_jacobian(q), np.ones(chain.row_count), top.scales, chain.model.njoints, 1e-12, True)
    for closure in chain.closures:
        stack.joint_reaction(closure.name)
    rps = ep.load(URDF / "3rps-passive-ball.urdf")
    rps.configurations(rps.pose([50.0, 52.0], 20.0, 0.0))
    serial = ep.load(URDF / "serial-y-x-z.urdf")
    serial.reaction(serial.pose(50.0, 20.0), limits="none")
    rrr = ep.load(URDF / "spherical-3rrr.urdf").worn_by(ep.Person(1.75, 75, "male"))
    str(rrr.reaction(rrr.pose([48.0, 50.0, 52.0, 54.0], 20.0)).verdict)
    rrr.workspace(rrr.pose([50.0, 52.0], 20.0), ["clearance"])
    chain._state.buffers.linearise(chain.close(chain.neutral()))
    model = pin.Model()
    kinds = pin.JointModelRUBY(), pin.JointModelPlanar(), pin.JointModelFreeFlyer()
    for kind in kinds:
        model.addJoint(model.njoints - 1, kind, pin.SE3.Identity(), kind.shortname())
    tree, q = tree_arrays(model), pin.neutral(model)
    step_tree(tree, np.linspace(0.1, 0.5, model.nv), q)
    poses, J = np.zeros((model.njoints, 4, 3)), np.zeros((model.nv, 6))
    place_tree(tree, q, np.zeros((2, 4, 3)), poses, J)


def _workspaces(folder):
    body = ep.BodyShape.of(ep.Wearer(1.75, 75, "male"))
    cables = ep.load("four-cables")
    cables.workspace(55.0, ep.Criteria(least_tension=5.0, largest_shoulder_force=120.0, body=body, least_gap=0.012))
    own = np.array([0.002, 0.0, 0.0])
    moving = ep.CentreOffset(own - np.array([[0.0, 0.0, 0.01], [-0.02, -0.01, 0.02]]), own)
    poses = cables.pose(abduction=[20.0, 60.0])
    cables.workspace(poses, ep.Criteria(largest_shoulder_force=120.0, body=body), centre_offset=moving)
    points = np.array(cables.geometry.base_points)
    points[1] = points[0]
    joined = cables.replace(geometry=ep.WristGeometry(points, cables.geometry.platform_points))
    joined.workspace(poses, ep.Criteria(("clearance",), body=body))
    cables.reaction(poses).can_hold.all()
    exo = ep.load("prototype")
    limbs = [replace(limb, joint_straight=(0.0, 0.0, 1.0)) for limb in exo.limbs]
    jointed, limits = exo.replace(limbs=limbs), ep.Criteria(largest_shoulder_force=120.0, body=body)
    jointed.workspace(55.0, limits)
    jointed.workspace(jointed.pose(abduction=[20.0, 60.0]), limits, centre_offset=moving)
    spare = random_mechanism(np.random.default_rng(7), 6, ["SPS"] * 6)
    limb = ep.Limb("SPS", actuator=ep.Actuator("cable", pull_limit=400.0))
    exo = ep.ShoulderExo.from_mechanism(spare).replace(limbs=[limb] * 6)
    exo.workspace(55.0, ep.Criteria(largest_shoulder_force=120.0))
    exo.reaction_map(exo.pose([10.0, 60.0, 110.0], [20.0, 50.0, 90.0]))
    many = ep.ShoulderExo.from_mechanism(random_mechanism(np.random.default_rng(64), 8, ["SPS"] * 8))
    many.reaction_map(many.pose([10.0, 60.0, 110.0], [20.0, 50.0, 90.0]), limits="pull")
    three = ep.load("three-linear-actuators")
    three.reaction_map(three.pose([10.0, 60.0, 110.0], [20.0, 50.0, 90.0]))


def _controllers(folder):
    plant, still = ep.Plant(ep.load("prototype")), np.zeros(3)
    pose = ep.shoulder_rotation(5.0, -8.0, 2.0, degrees=True)
    control.missing_moments(plant, Rotation.from_quat(pose.as_quat()[None]))
    controller = control.ModelController(plant, control.abduction())
    controller(0.0, control.Measurement(pose, still, still, 4e5, still, still))
    winches = ep.Plant(ep.load("four-cables"))
    start = winches.held(pose, np.full(4, 10.0))
    winches.simulate(lambda t, measured: np.full(4, 0.02), 0.002, start, faults=ep.Fault("no current", 0), rtol=1e-4)
