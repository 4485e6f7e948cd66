"""Devices of every kind with every part that a device may have, drawn at random, and all that is asked of them."""

import functools
from dataclasses import replace

import numpy as np
import pinocchio as pin
from arm_alone import arm_alone
from places import URDF

import exo_pin as ep
from exo_pin.device import (
    Brake,
    ChainDevice,
    ConstantForce,
    Drive,
    GasSpring,
    LinearSpring,
    Route,
    SoftLink,
    Spring,
    TableLaw,
)

FORMATS = (".urdf", ".xml", ".sdf")
MAN = ep.Wearer(1.755, 85.0, "male", elbow_flexion=0.6, payload=0.5)
MUSCLE = ep.Actuator("pneumatic muscle", force_law="best", supply_pressure=4e5)
#: An arm on a ball joint of the torso, and links on the torso that end at the arm, as MuJoCo has them: two hinges on
#: one body, a joint that is called as a link, a spring and an armature, and a loop of each kind.
MJCF = """<mujoco model="arm_and_links"><compiler angle="radian"/><option gravity="0 0 -9.81"/><worldbody>
  <body name="upper_arm"><joint name="shoulder" type="ball" damping="0.02"/>
    <inertial pos="0 0.01 -0.15" mass="2.5" diaginertia="0.03 0.03 0.004"/>
    <body name="cuff" pos="0 0 -0.2"><inertial pos="0.02 0 0.01" mass="0.4" diaginertia="1e-3 1e-3 1e-3"/>
      <site name="cuff_middle"/></body></body>
  <body name="column" pos="-0.15 0.1 0"><joint name="column" axis="0 0 1" range="-2 2" armature="0.01" damping="0.1"/>
    <inertial pos="0 0.05 0" mass="0.7" diaginertia="1e-3 1e-3 1e-3"/>
    <body name="lever" pos="0 0.1 0"><joint name="lift" axis="1 0 0"/>
      <joint name="swing" axis="0 1 0" pos="0 0.02 0" stiffness="3" springref="0.1" frictionloss="0.05"/>
      <inertial pos="0.1 0 -0.1" mass="0.3" diaginertia="4e-4 4e-4 1e-4"/>
      {more}
      <body name="tip" pos="0.1 0 -0.15"><joint name="slider" type="slide" axis="0 0 1" range="-0.3 0.3"/>
        <inertial pos="0 0 0" mass="0.1" diaginertia="1e-5 1e-5 1e-5"/></body></body></body>
  </worldbody>
  <actuator><motor joint="lift" ctrllimited="true" ctrlrange="-30 20"/><motor joint="column"/>
  <motor joint="slider" ctrllimited="true" ctrlrange="-80 80"/></actuator></mujoco>"""
BALL = """<body name="spinner" pos="0 0 0.05"><joint name="spin" type="ball"/>
  <inertial pos="0 0 -0.02" mass="0.05" diaginertia="1e-5 1e-5 1e-5"/></body>"""


def mjcf_chain(closure="spherical", ball=False):
    """The arm with links on the torso, whose tip a closure holds to the cuff."""
    chain = ep.ClosedChain.from_mjcf(MJCF.format(more=BALL if ball else ""))
    roles = ep.chain.Roles(chain.roles.actuated, "shoulder", "upper_arm", None, (), "cuff_middle")
    data = chain.model.createData()
    pin.framesForwardKinematics(chain.model, data, chain.neutral())
    at = {name: data.oMf[chain.model.getFrameId(name)] for name in ("tip", "cuff")}
    apart = at["cuff"].actInv(at["tip"]).translation
    more = {"distance": float(np.linalg.norm(apart))} if closure == "distance" else {}
    more |= {"axis": (1.0, 0.0, 0.0)} if closure == "cylindrical" else {}
    there = ep.chain.Placement() if closure == "distance" else ep.chain.Placement(tuple(apart.tolist()))
    loop = ep.chain.Closure("tip_on_cuff", closure, "tip", "cuff", placement_b=there, **more)
    return ep.ClosedChain(chain.model, replace(chain.description, closures=(loop,), roles=roles))


BASES = {
    "arm alone": arm_alone,
    **{
        name: functools.partial(ep.ClosedChain.from_urdf, URDF / f"{name}.urdf")
        for name in ("serial-y-x-z", "nesm", "spherical-3rrr", "3rps-passive-ball", "six-cables", "spring-support")
    },
    **{f"mjcf {kind}": functools.partial(mjcf_chain, kind) for kind in ("spherical", "distance", "cylindrical")},
    "mjcf universal, with a ball": functools.partial(mjcf_chain, "universal", True),
}


def laws(rng, longest, turns):
    """Springs of every law, for coordinates or lengths up to some."""
    at = np.sort(rng.uniform(-longest if turns else 0.0, 1.5 * longest, 4))
    at[0], at[-1] = (-7.0, 7.0) if turns else (0.0, 3.0)
    forces = np.cumsum(rng.uniform(0.0, 4.0, 4))
    found = [
        ConstantForce(float(rng.uniform(0.5, 3.0))),
        LinearSpring(float(rng.uniform(5.0, 60.0)), float(rng.uniform(0.0, 0.2)), only_pulls=bool(rng.integers(2))),
        TableLaw(tuple(at.tolist()), tuple(forces.tolist())),
    ]
    return found if turns else [*found, GasSpring(15.0, 3.0, 8.0, 1.2)]


def ways(rng, chain):
    """Routes from torso to arm, with and without a via point."""
    arm = chain.roles.arm
    ends = rng.uniform(-0.15, 0.15, (3, 3)) + np.array([[-0.1, 0.15, 0.1], [-0.05, 0.1, 0.0], [0.0, 0.05, -0.2]])
    points = [("universe", ends[0]), ("universe", ends[1]), (arm, ends[2])]
    return Route.over(*(points if rng.integers(2) else [points[0], points[2]]))


def single(chain):
    """Hinges and slides, and which of them turn."""
    model = chain.model
    names = [str(model.names[i]) for i in range(1, model.njoints) if model.joints[i].nq == model.joints[i].nv == 1]
    return {name: not chain.metres[chain.velocity_slice(name)][0] for name in names}


def handed(seed):
    """A device: one of the bases with parts of every kind."""
    rng = np.random.default_rng(900 + seed)
    base = list(BASES)[seed % len(BASES)]
    chain = BASES[base]()
    device = ChainDevice.from_chain(chain, ["left", "right"][seed // len(BASES) % 2 if seed else 1])
    joints, springs, drives = single(chain), [], list(device.drives)
    for k in range(rng.integers(1, 4)):
        if joints and rng.integers(2):
            name = str(rng.choice(sorted(joints)))
            place, law = {"joint": name}, laws(rng, 1.0, True)
            law = law if joints[name] else law[:2]
        else:
            place, law = {"route": ways(rng, chain)}, laws(rng, 0.5, False)
        springs.append(Spring(f"spring {k}", law[int(rng.integers(len(law)))], **place))
    for k in range(int(rng.integers(1, 4)) + 3 * (base == "arm alone")):
        way = ways(rng, chain)
        more = [
            {"upper": 300.0}, {"lower": 5.0, "upper": 200.0, "least": 0.05, "greatest": 2.0}, {},
            {"actuator": ep.Actuator("cable", pull_limit=250.0, speed_limit=0.3, power_limit=40.0)},
            {"actuator": MUSCLE, "stroke": ep.Stroke(0.25, 0.7, 1.1, 0.15)},
        ][int(rng.integers(5))]  # fmt: skip
        drives.append(Drive(f"cable {k}", route=way, **more))
    hinges = [drive for drive in device.drives if drive.joint and joints.get(drive.joint) and not drive.pulls]
    if hinges:
        own = hinges[int(rng.integers(len(hinges)))]
        drives[drives.index(own)] = [
            Drive.geared(own.name, own.joint, 0.8, 50.0, 300.0), Drive("motor", own.joint, lower=-3.0, upper=12.0),
            Drive(own.name, own.joint), own,
        ][int(rng.integers(4))]  # fmt: skip
    if rng.integers(2):
        drives = [drives[k] for k in rng.permutation(len(drives))]
    moving = [
        frame.name for frame in chain.model.frames
        if frame.type.name == "BODY" and frame.parentJoint not in (0, chain.model.getJointId(device.arm_joint))
        and chain.model.inertias[frame.parentJoint].mass > 0.0 and frame.placement.isIdentity(1e-12)
    ]  # fmt: skip
    idle = sorted(joints.keys() - {drive.joint for drive in drives})
    brakes = (Brake("brake", idle[0], 250.0),) if idle and rng.integers(2) else ()
    parts = {}
    if rng.integers(2):
        parts["cuff"] = ep.Interface.upper_arm_cuff(0.17, times=2.0)
        parts["cuff_area"] = 0.012
        if rng.integers(2):
            parts["harness"] = ep.Interface.of([8e3, 9e3, 7e3], [300.0, 400.0, 200.0], (0.0, -0.1, 0.05))
    soft = ()
    if moving and rng.integers(2):
        K = np.diag([5e4, 6e4, 7e4, 800.0, 900.0, 700.0])
        K[0, 4] = K[4, 0] = 30.0
        soft = (SoftLink(str(rng.choice(sorted(set(moving)))), ep.Interface(K, (0.0, 0.01, 0.0))),)
    exo = ep.ShoulderExo.from_device(device.replace(
        springs=springs, drives=drives, brakes=brakes,
        interfaces=ep.Interfaces(**parts), soft_links=soft, name=f"device {seed}",
        title=f"Device number {seed}", sources={"drives": "a catalogue", "cuff": "drawn at random"},
        shoulder=ep.Shoulder(stiffness=2e4 * np.eye(3)) if rng.integers(2) else ep.Shoulder(),
    ))  # fmt: skip
    return exo.worn_by(MAN) if rng.integers(2) else exo


def answers(exo, elastic=True):
    """All that a device is asked, by name, as arrays; the name of the error where one is raised."""
    poses = exo.pose([5.0, 25.0, 10.0], [10.0, 15.0, -5.0], [0.0, 5.0, -10.0])
    load = ep.Load((1.0, -2.0, -6.0), at=(0.0, 0.0, -0.3))
    motion = ep.Motion([0.1, 0.2, -0.1], [0.5, -0.3, 0.2])
    found = {}

    def ask(name, question):
        try:
            for key, value in question().items():
                found[f"{name}.{key}"] = np.asarray(value)
        except ep.ExoPinError as error:
            found[f"{name} raises"] = np.asarray(type(error).__name__)

    def forces(**query):
        answer = exo.reaction(poses, load=load, **query)
        own = {key: getattr(answer, key) for key in ("shoulder_force", "actuator_forces", "limb_wrenches", "status",
               "can_hold", "unknown", "cuff_wrench", "harness_wrench")}  # fmt: skip
        own |= dict(zip(("closest_f", "closest_g", "closest_cuff"), answer.closest, strict=True))  # what contact takes
        at = answer.source.poses
        return own | {"lengths": at.lengths, "lower": at.limits.lower, "upper": at.limits.upper}

    ask("design", lambda: forces())
    ask("none", lambda: forces(limits="none"))
    ask("moving", lambda: forces(limits="none", motion=motion))
    if elastic:
        ask("elastic", lambda: forces(split="elastic"))
    ask("jacobian", lambda: {"J": exo.jacobian(poses)})
    ask("singularity", lambda: {
        key: getattr(exo.singularity(poses), key) for key in ("margin", "kind") if hasattr(exo.singularity(poses), key)
    })  # fmt: skip
    return found
