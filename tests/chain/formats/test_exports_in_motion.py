"""Written files are read by the programs that they are for, and move there as the chain does, for half a second.

MuJoCo moves an MJCF, Pinocchio a URDF with its closures file, Drake an SDF. Drake has no joints that close loops: as
its manual says, such a joint gets half of its child, and a constraint welds the halves. The bound is on the places and
directions of all links, relative to how far the fastest one went.
"""

import copy
import xml.etree.ElementTree as ET
from dataclasses import replace

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from massive_chains import MASSIVE
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import DiscreteContactApproximation, MultibodyPlant
from pydrake.systems.analysis import Simulator

from exo_pin.chain import ClosedChain, Closures, JointProperties, read_closures

TIMES = np.array([0.0, 0.25, 0.5])
#: The wrist without a shoulder stands near a singular pose, where MuJoCo's equalities give way.
SOFT = "wrist-wrist"
LOOPS = [name for name in MASSIVE if name != SOFT]
JOINTS = {
    "hinge": pin.JointModelRevoluteUnaligned(np.array([0.6, 0.0, 0.8])),
    "endless": pin.JointModelRUBY(),
    "slide": pin.JointModelPrismaticUnaligned(np.array([0.6, 0.0, 0.8])),
    "ball": pin.JointModelSpherical(),
    "free": pin.JointModelFreeFlyer(),
    "translation": pin.JointModelTranslation(),
    "planar": pin.JointModelPlanar(),
}


def some(names, *quick):
    """All of them, of which only some are moved at every run."""
    return [name if name in quick else pytest.param(name, marks=pytest.mark.full) for name in names]


def loop(name):
    """A chain that falls askew, without limits of its joints."""
    chain, q = MASSIVE[name]
    model = chain.model.copy()
    model.gravity.linear = np.array([3.0, -5.0, -7.0])
    model.lowerPositionLimit[:], model.upperPositionLimit[:] = -np.inf, np.inf
    return ClosedChain(model, chain.description), q


def tree(kind, passive=True, root=False):
    """A body on a joint of a kind, with a hinge, a slide and their bodies on it, with springs, damping and friction."""
    model, rng = pin.Model(), np.random.default_rng(7)
    joints = [JOINTS[kind], pin.JointModelRX(), pin.JointModelPY()]
    for joint, made in enumerate(joints):
        place = np.array([0.0, 0.3, 0.1]) * (joint > 0 or not root)
        index = model.addJoint(joint, made, pin.SE3(np.eye(3), place), f"joint_{joint}")
        body = pin.Inertia(1.0, np.array([0.1, 0.2, -0.2]) * rng.normal(), np.diag([0.03, 0.04, 0.05]))
        model.appendBodyToJoint(index, body, pin.SE3.Identity())
        model.addFrame(pin.Frame(f"body_{joint}", index, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    springs = ()
    model.lowerPositionLimit[:], model.upperPositionLimit[:] = -np.inf, np.inf
    if passive:
        model.damping = np.full(model.nv, 0.3)
        springs = (JointProperties("joint_1", 6.0, (0.3,)), JointProperties("joint_2", 80.0, (0.05,)))
        if kind in ("hinge", "slide", "ball", "translation"):
            springs += (JointProperties("joint_0", 5.0, unit="m" if kind in ("slide", "translation") else "rad"),)
    return ClosedChain(model, Closures("tree", joints=springs)), pin.neutral(model)


def places(chain, q):
    found = chain.placements(q)
    return {name: (place.translation, place.rotation) for name, place in found.items() if name != "universe"}


def difference(one, other, length):
    common = one.keys() & other.keys()
    assert common
    return max(
        max(np.abs(one[k][0] - other[k][0]).max(), np.abs(one[k][1] - other[k][1]).max() * length) for k in common
    )


def assert_moves_alike(chain, q, found, bound):
    """``found``: links' places and directions at the times after the first, by the other program."""
    own = chain.simulate(q, np.zeros(chain.model.nv), TIMES)
    length, start = chain.characteristic_length, places(chain, q)
    expected = [places(chain, at) for at in own.q[1:]]
    moved = max(difference(start, at, length) for at in expected)
    assert moved > 0.1 * length
    apart = max(difference(one, other, length) for one, other in zip(expected, found, strict=True))
    assert apart < bound * moved, apart / moved


def mujoco_moves(chain, q, folder, step, softness=1.0):
    model = mujoco.MjModel.from_xml_path(str(chain.to_mjcf(folder, q)))
    model.body_invweight0 *= softness
    model.opt.timestep = step
    data, found = mujoco.MjData(model), []
    mujoco.mj_resetDataKeyframe(model, data, 0)
    for wait in np.diff(TIMES):
        mujoco.mj_step(model, data, round(wait / step))
        # Of the state that was reached, not of the step before.
        mujoco.mj_kinematics(model, data)
        bodies = [data.body(k) for k in range(1, model.nbody)]
        found.append({body.name: (body.xpos.copy(), body.xmat.reshape(3, 3).copy()) for body in bodies})
    return found


@pytest.mark.parametrize("name", some(LOOPS, "loop-universal", "loop-prismatic", "loop-cylindrical"))
def test_mujoco_moves_every_loop(name, tmp_path):
    chain, q = loop(name)
    assert_moves_alike(chain, q, mujoco_moves(chain, q, tmp_path, 2e-4), 5e-3)


@pytest.mark.full
def test_loops_that_mujoco_cannot_hold_are_said_with_what_helps(tmp_path):
    """MuJoCo's compliance, which no attribute of MJCF makes less, is all that moves the file otherwise."""
    chain, q = loop(SOFT)
    with pytest.raises(AssertionError):
        assert_moves_alike(chain, q, mujoco_moves(chain, q, tmp_path, 2e-4), 0.3)
    text = (tmp_path / f"{chain.description.name}.xml").read_text(encoding="utf-8")
    assert "these loops hold a motion by 2e-08 of it" in text
    assert "model.body_invweight0 *= 1e-4" in text
    assert_moves_alike(chain, q, mujoco_moves(chain, q, tmp_path, 2e-4, softness=1e-4), 5e-3)
    other, at = loop("wrist-floating")
    assert "body_invweight0" not in other.to_mjcf(tmp_path, at).read_text(encoding="utf-8")


@pytest.mark.parametrize("kind", some(JOINTS, "ball", "slide"))
def test_mujoco_moves_every_joint_with_springs_and_damping(kind, tmp_path):
    chain, q = tree(kind)
    assert_moves_alike(chain, q, mujoco_moves(chain, q, tmp_path, 2e-4), 1e-3)


def test_mujoco_moves_with_friction_and_stops(tmp_path):
    chain, q = tree("hinge")
    model = chain.model.copy()
    model.upperDryFrictionLimit[:] = [0.4, 0.2, 1.0]
    model.lowerDryFrictionLimit[:] = -model.upperDryFrictionLimit
    chain = ClosedChain(model, chain.description)
    assert_moves_alike(chain, q, mujoco_moves(chain, q, tmp_path, 2e-4), 2e-3)


def pinocchio_moves(chain, q, folder, step=2e-3):
    """By Pinocchio's own constraint dynamics, from the two files; Runge-Kutta steps."""
    path = chain.to_urdf(folder)
    closures = read_closures(path.with_suffix(".closures.toml"))
    roots = {"fixed": None, "spherical": JOINTS["ball"], "free_flyer": JOINTS["free"], "planar": JOINTS["planar"]}
    root = {**roots, "translation": JOINTS["translation"]}[closures.root.joint]
    if root is None:
        model = pin.buildModelFromUrdf(str(path))
    else:
        model = pin.buildModelFromUrdf(str(path), root, closures.root.name)
    model.gravity.linear = np.array(closures.root.gravity)
    data, models, datas = model.createData(), pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
    for own in closures.closures:
        frames = [model.frames[model.getFrameId(name)] for name in (own.frame_a, own.frame_b)]
        ends = [
            frame.placement * pin.XYZQUATToSE3(np.array([*place.translation, *place.quaternion]))
            for frame, place in zip(frames, (own.placement_a, own.placement_b), strict=True)
        ]
        kind = {"rigid": pin.ContactType.CONTACT_6D, "spherical": pin.ContactType.CONTACT_3D}[own.type]
        parents = [frame.parentJoint for frame in frames]
        models.append(pin.RigidConstraintModel(kind, model, parents[0], ends[0], parents[1], ends[1]))
        corrector = models[-1].m_baumgarte_parameters
        corrector.Kp, corrector.Kd = 400.0, 40.0
        datas.append(models[-1].createData())
    pin.initConstraintDynamics(model, data, models, datas)
    springs = {item.joint: item for item in closures.joints}

    def acceleration(q, v):
        tau = -np.asarray(model.damping) * v
        for name, item in springs.items():
            joint = model.getJointId(name)
            rest = (item.spring_reference or (0.0,))[0]
            tau[model.idx_vs[joint]] -= item.stiffness * (q[model.idx_qs[joint]] - rest)
        settings = pin.ProximalSettings(1e-13, 1e-10, 50)
        return np.array(pin.constraintDynamics(model, data, q, v, tau, models, datas, settings))

    here, v, found = pin.neutral(model), np.zeros(model.nv), []
    for name in list(chain.model.names)[1:]:
        joint = model.getJointId(name)
        own = q[chain.configuration_slice(name)]
        if model.nqs[joint] == 2 and len(own) == 1:
            own = np.array([np.cos(own[0]), np.sin(own[0])])
        here[model.idx_qs[joint] : model.idx_qs[joint] + len(own)] = own
    for wait in np.diff(TIMES):
        for _ in range(round(wait / step)):
            rates, slopes = [], []
            for part in (0.0, 0.5, 0.5, 1.0):
                last = (rates[-1], slopes[-1]) if rates else (v, 0.0 * v)
                rates.append(v + part * step * last[1])
                slopes.append(acceleration(pin.integrate(model, here, part * step * last[0]), rates[-1]))
            weights = step * np.array([1, 2, 2, 1]) / 6
            here, v = pin.integrate(model, here, weights @ rates), v + weights @ slopes
        pin.framesForwardKinematics(model, data, here)
        found.append(
            {f.name: (data.oMf[k].translation.copy(), data.oMf[k].rotation.copy()) for k, f in enumerate(model.frames)}
        )
    return [{name: each[name] for name in places(chain, q) if name in each} for each in found]


@pytest.mark.parametrize("name", some(["four_bar_link", "parallelogram", "loop-rigid", "loop-spherical"], "loop-rigid"))
def test_pinocchio_moves_its_loops(name, tmp_path):
    chain, q = loop(name)
    assert_moves_alike(chain, q, pinocchio_moves(chain, q, tmp_path), 2e-3)


@pytest.mark.parametrize("kind", some(JOINTS, "hinge", "free"))
def test_pinocchio_moves_every_joint(kind, tmp_path):
    is_root = kind in ("ball", "free", "translation", "planar")
    chain, q = tree(kind, passive=not is_root, root=is_root)
    assert_moves_alike(chain, q, pinocchio_moves(chain, q, tmp_path), 1e-4)


def drake_moves(chain, q, folder, step):
    root = ET.parse(chain.to_sdf(folder, q)).getroot()
    model = root.find("model")
    links = {link.get("name"): link for link in model.findall("link")}
    closing, welds = {own.name for own in chain.closures}, []
    for joint in [joint for joint in model.findall("joint") if joint.get("name") in closing]:
        child = joint.find("child").text
        for number in links[child].find("inertial").iter():
            if number.tag == "mass" or (number.tag.startswith("i") and len(number.tag) == 3):
                number.text = repr(0.5 * float(number.text))
        part = copy.deepcopy(links[child])
        part.set("name", f"{child}_of_{joint.get('name')}")
        model.append(part)
        joint.find("child").text = part.get("name")
        welds.append((child, part.get("name")))
    plant = MultibodyPlant(step)
    plant.set_discrete_contact_approximation(DiscreteContactApproximation.kSap)
    Parser(plant).AddModelsFromString(ET.tostring(root, encoding="unicode"), "sdf")
    plant.mutable_gravity_field().set_gravity_vector(chain.model.gravity.linear)
    for one, other in welds:
        plant.AddWeldConstraint(
            plant.GetBodyByName(one), RigidTransform(), plant.GetBodyByName(other), RigidTransform()
        )
    plant.Finalize()
    simulator, found = Simulator(plant), []
    for time in TIMES[1:]:
        simulator.AdvanceTo(time)
        context = simulator.get_context()
        poses = {name: plant.EvalBodyPoseInWorld(context, plant.GetBodyByName(name)) for name in links}
        found.append({name: (X.translation(), X.rotation().matrix()) for name, X in poses.items()})
    return found


DRAKE = ["four_bar_link", "loop-rigid", "loop-spherical", "loop-revolute", "loop-universal", "loop-prismatic"]


@pytest.mark.parametrize("name", some(DRAKE, "loop-universal"))
def test_drake_moves_its_loops(name, tmp_path):
    chain, q = loop(name)
    assert_moves_alike(chain, q, drake_moves(chain, q, tmp_path, 2e-4), 5e-3)


@pytest.mark.parametrize("kind", some(["hinge", "slide", "ball"], "slide"))
def test_drake_moves_its_joints(kind, tmp_path):
    chain, q = tree(kind)
    if kind == "ball":
        # SDF has no spring or damping of a ball.
        model = chain.model.copy()
        model.damping[:3] = 0.0
        chain = ClosedChain(model, replace(chain.description, joints=chain.description.joints[:2]))
    assert_moves_alike(chain, q, drake_moves(chain, q, tmp_path, 2e-4), 2e-3)
