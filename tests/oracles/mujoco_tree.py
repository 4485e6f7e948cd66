"""A URDF tree as MuJoCo sees it, with forces put on its bodies. It shares no formula with exo_pin or Pinocchio.

The XML is read here anew, so that nothing of what exo_pin reads or writes is taken on trust. MuJoCo's conventions:
quaternions w first; a free joint's velocity is linear in the world and angular in the body (Pinocchio: both in the
body); its acceleration is the derivative of that, so that the linear part has no ω × v; sensors of force and torque
tell what the parent's side puts on the child's side, in the axes of their site (a test holds that against a weight).
"""

import xml.etree.ElementTree as ET

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

JOINTS = {
    "revolute": mujoco.mjtJoint.mjJNT_HINGE,
    "continuous": mujoco.mjtJoint.mjJNT_HINGE,
    "prismatic": mujoco.mjtJoint.mjJNT_SLIDE,
    "spherical": mujoco.mjtJoint.mjJNT_BALL,
    "floating": mujoco.mjtJoint.mjJNT_FREE,
    "free_flyer": mujoco.mjtJoint.mjJNT_FREE,
}
EQUALITIES = {"spherical": mujoco.mjtEq.mjEQ_CONNECT, "rigid": mujoco.mjtEq.mjEQ_WELD}


def numbers(element, key, default):
    return np.array([float(x) for x in (default if element is None else element.get(key, default)).split()])


def placed(origin):
    """Position and rotation of an origin element."""
    return numbers(origin, "xyz", "0 0 0"), Rotation.from_euler("xyz", numbers(origin, "rpy", "0 0 0"))


def spec_of(urdf, root, gravity):
    """The tree as a MuJoCo specification with a site and two sensors at every joint.

    Parameters
    ----------
    urdf : str
        XML.
    root : exo_pin.chain.Root
        How the root link hangs in the world.
    gravity : array_like
        Shape (3,).
    """
    robot = ET.fromstring(urdf)
    links = {link.get("name"): link for link in robot.findall("link")}
    children: dict = {}
    for joint in robot.findall("joint"):
        children.setdefault(joint.find("parent").get("link"), []).append(joint)
    top = (set(links) - {joint.find("child").get("link") for joint in robot.findall("joint")}).pop()
    spec = mujoco.MjSpec()
    spec.compiler.balanceinertia = False
    spec.option.gravity = gravity
    world = spec.worldbody
    if root.joint == "fixed" and links[top].find("inertial") is None:
        place = world
    else:
        place = world.add_body(name=top)
        _fill(spec, place, links[top], None if root.joint == "fixed" else root.joint, root.name, None)
    pending = [(top, place)]
    while pending:
        name, parent = pending.pop()
        for joint in children.get(name, []):
            position, rotation = placed(joint.find("origin"))
            link = joint.find("child").get("link")
            body = parent.add_body(name=link, pos=position, quat=rotation.as_quat(scalar_first=True))
            axis = numbers(joint.find("axis"), "xyz", "1 0 0")
            _fill(spec, body, links[link], joint.get("type"), joint.get("name"), axis)
            pending.append((link, body))
    return spec


def _fill(spec, body, link, kind, joint, axis):
    inertial = link.find("inertial")
    if inertial is not None:
        position, rotation = placed(inertial.find("origin"))
        tensor = inertial.find("inertia")
        entry = {key: float(tensor.get(key)) for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")}
        full = np.array(
            [
                [entry["ixx"], entry["ixy"], entry["ixz"]],
                [entry["ixy"], entry["iyy"], entry["iyz"]],
                [entry["ixz"], entry["iyz"], entry["izz"]],
            ]
        )
        full = rotation.as_matrix() @ full @ rotation.as_matrix().T
        body.mass, body.ipos, body.explicitinertial = float(inertial.find("mass").get("value")), position, True
        body.fullinertia = [full[0, 0], full[1, 1], full[2, 2], full[0, 1], full[0, 2], full[1, 2]]
    if kind in JOINTS:
        given = {} if axis is None or kind in ("spherical", "floating", "free_flyer") else {"axis": axis}
        body.add_joint(name=joint, type=JOINTS[kind], **given)
        body.add_site(name=joint)
        for what, sensor in (("force", mujoco.mjtSensor.mjSENS_FORCE), ("torque", mujoco.mjtSensor.mjSENS_TORQUE)):
            spec.add_sensor(name=f"{what} {joint}", type=sensor, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=joint)


class MujocoTree:
    """The open tree: state from Pinocchio's coordinates, wrenches on bodies, generalised and joint forces."""

    def __init__(self, named, gravity=None):
        closures = named.closures
        self.spec = spec_of(named.urdf, closures.root, closures.root.gravity if gravity is None else gravity)
        self.model = self.spec.compile()
        self.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
        self.data = mujoco.MjData(self.model)

    def body(self, frame):
        """Of a link or a joint."""
        if frame == "universe" or frame not in [self.model.body(i).name for i in range(self.model.nbody)]:
            found = [i for i in range(self.model.njnt) if self.model.joint(i).name == frame]
            return self.model.jnt_bodyid[found[0]] if found else 0
        return self.model.body(frame).id

    def put(self, chain, q, v, a):
        """Take a state in Pinocchio's coordinates; forces are cleared."""
        data = self.data
        data.xfrc_applied[:], data.qfrc_applied[:] = 0.0, 0.0
        for name in list(chain.model.names)[1:]:
            joint = self.model.joint(name)
            at, dof = int(joint.qposadr[0]), int(joint.dofadr[0])
            own = q[chain.configuration_slice(name)]
            speed, rate = v[chain.velocity_slice(name)], a[chain.velocity_slice(name)]
            if joint.type[0] == mujoco.mjtJoint.mjJNT_FREE:
                R = Rotation.from_quat(own[3:]).as_matrix()
                own = [*own[:3], own[6], *own[3:6]]
                rate = [*(R @ (rate[:3] + np.cross(speed[3:], speed[:3]))), *rate[3:]]
                speed = [*(R @ speed[:3]), *speed[3:]]
            elif joint.type[0] == mujoco.mjtJoint.mjJNT_BALL:
                own = [own[3], *own[:3]]
            data.qpos[at : at + len(own)] = own
            data.qvel[dof : dof + len(speed)], data.qacc[dof : dof + len(rate)] = speed, rate
        acceleration = data.qacc.copy()
        mujoco.mj_fwdPosition(self.model, data)
        data.qacc[:] = acceleration

    def push(self, frame, wrench, point):
        """Add a wrench, world axes, moment about a point, to a body; on the world it does nothing."""
        body = self.body(frame)
        force, moment = np.asarray(wrench[:3]), np.asarray(wrench[3:])
        if body:
            self.data.xfrc_applied[body, :3] += force
            self.data.xfrc_applied[body, 3:] += moment + np.cross(point - self.data.xipos[body], force)

    def inverse(self, chain):
        """What the joints' actuators give beside the wrenches that were put on, in Pinocchio's coordinates."""
        model, data = self.model, self.data
        mujoco.mj_inverse(model, data)
        outside = np.zeros(model.nv)
        for body in range(1, model.nbody):
            force, moment = data.xfrc_applied[body, :3].copy(), data.xfrc_applied[body, 3:].copy()
            mujoco.mj_applyFT(model, data, force, moment, data.xipos[body].copy(), body, outside)
        return self.generalised(chain, data.qfrc_inverse - outside)

    def generalised(self, chain, forces):
        """A generalised force (or acceleration of hinges, slides and balls) in Pinocchio's order and axes."""
        out = np.zeros(chain.model.nv)
        for name in list(chain.model.names)[1:]:
            joint = self.model.joint(name)
            dof, own = int(joint.dofadr[0]), chain.velocity_slice(name)
            out[own] = forces[dof : dof + own.stop - own.start]
            if joint.type[0] == mujoco.mjtJoint.mjJNT_FREE:
                R = self.data.body(self.model.jnt_bodyid[joint.id]).xmat.reshape(3, 3)
                out[own][:3] = R.T @ out[own][:3]
        return out

    def transmitted(self, joint):
        """What a joint's parent side puts on its child side, about the joint, in the child's axes, shape (6,)."""
        return np.concatenate([self.data.sensor(f"{what} {joint}").data for what in ("force", "torque")])


class MujocoLoops(MujocoTree):
    """The tree with its spherical and rigid closures as MuJoCo's own connects and welds, of impedance d.

    MuJoCo's equalities are springs: to the constraint's inertia A a compliance R = A (1 - d)/d is added, so that
    every acceleration and force is a smooth function of 1 - d, and right at 1 - d = 0.
    """

    def __init__(self, named, gravity, d):
        closures = named.closures
        spec = spec_of(named.urdf, closures.root, gravity)
        for closure in closures.closures:
            ends = ((closure.frame_a, closure.placement_a), (closure.frame_b, closure.placement_b))
            sites = []
            for letter, (frame, place) in zip("ab", ends, strict=True):
                body = spec.worldbody if frame == "universe" else spec.body(frame) or spec.worldbody
                x, y, z, w = place.quaternion
                sites.append(f"{closure.name} {letter}")
                body.add_site(name=sites[-1], pos=place.translation, quat=[w, x, y, z])
            equality = spec.add_equality(
                name=closure.name, type=EQUALITIES[closure.type], name1=sites[0], name2=sites[1]
            )
            equality.objtype = mujoco.mjtObj.mjOBJ_SITE
            equality.solimp, equality.solref = [d, d, 1.0, 0.5, 1.0], [0.1, 1.0]
        spec.option.solver, spec.option.iterations, spec.option.tolerance = mujoco.mjtSolver.mjSOL_NEWTON, 50, 0.0
        spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)

    def forward(self, chain, tau):
        """Acceleration that efforts make, in MuJoCo's order; sensors are up to date."""
        data = self.data
        for name in list(chain.model.names)[1:]:
            joint, own = self.model.joint(name), chain.velocity_slice(name)
            if joint.type[0] != mujoco.mjtJoint.mjJNT_FREE:
                dof = int(joint.dofadr[0])
                data.qfrc_applied[dof : dof + own.stop - own.start] = tau[own]
        mujoco.mj_forward(self.model, data)
        return data.qacc.copy()
