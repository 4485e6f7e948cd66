"""A second reading of URDF, and the dynamics of what it says: ElementTree and NumPy, no Pinocchio.

A configuration is a dict, joint name to the coordinates that Pinocchio has for the joint's type; a velocity likewise:

========== ======================= ==========================================================
type       q                       v
========== ======================= ==========================================================
revolute   angle                   its rate; continuous: q is cosine, sine
prismatic  slide                   its rate
planar     x, y, cosine, sine      of the child in its own axes: x, y, about z
floating   x, y, z, quaternion     of the child in its own axes: linear, angular
========== ======================= ==========================================================
"""

import xml.etree.ElementTree as ET
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

WIDTH = {"revolute": 1, "continuous": 1, "prismatic": 1, "planar": 3, "floating": 6, "fixed": 0}


@dataclass
class Joint:
    name: str
    kind: str
    parent: str
    child: str
    R: np.ndarray
    p: np.ndarray
    axis: np.ndarray
    limit: dict = field(default_factory=dict)
    dynamics: dict = field(default_factory=dict)


@dataclass
class Link:
    mass: float
    centre: np.ndarray
    inertia: np.ndarray


def three(element, key, default="0 0 0"):
    text = default if element is None else element.get(key, default)
    values = [float(word) for word in text.split()]
    assert len(values) == 3
    return np.array(values)


def pose(element):
    roll, pitch, yaw = three(element, "rpy")
    return Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix(), three(element, "xyz")


class Tree:
    """What a URDF says, read without any checks but that it can be read."""

    def __init__(self, xml):
        root = ET.fromstring(xml)
        self.links, self.joints = {}, {}
        for link in root.findall("link"):
            self.links[link.get("name")] = self._link(link.find("inertial"))
        for joint in root.findall("joint"):
            R, p = pose(joint.find("origin"))
            axis = three(joint.find("axis"), "xyz", "1 0 0")
            ends = [joint.find(tag).get("link") for tag in ("parent", "child")]
            numbers = [
                {} if part is None else {key: float(value) for key, value in part.attrib.items()}
                for part in (joint.find("limit"), joint.find("dynamics"))
            ]
            name, kind = joint.get("name"), joint.get("type")
            self.joints[name] = Joint(name, kind, *ends, R, p, axis / max(np.linalg.norm(axis), 1e-300), *numbers)
        carried = {joint.child for joint in self.joints.values()}
        (self.root,) = [name for name in self.links if name not in carried]
        self.order = self._ordered()
        self.moving = [joint.name for joint in self.order if WIDTH[joint.kind]]
        self.width = sum(WIDTH[self.joints[name].kind] for name in self.moving)

    def _link(self, inertial):
        if inertial is None:
            return Link(0.0, np.zeros(3), np.zeros((3, 3)))
        R, p = pose(inertial.find("origin"))
        xx, xy, xz, yy, yz, zz = (
            float(inertial.find("inertia").get(key)) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
        )
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        return Link(float(inertial.find("mass").get("value")), p, R @ inertia @ R.T)

    def _ordered(self):
        """Joints, parents first."""
        order, reached = [], [self.root]
        for link in reached:
            for joint in self.joints.values():
                if joint.parent == link:
                    order.append(joint)
                    reached.append(joint.child)
        assert len(reached) == len(self.links)
        return order

    def rates(self, values):
        """A vector, in the order of ``moving``, as a dict."""
        found, at = {}, 0
        for name in self.moving:
            count = WIDTH[self.joints[name].kind]
            found[name], at = np.asarray(values[at : at + count]), at + count
        return found

    def motion(self, q, v, a):
        """Of every link: R, p, and the origin's velocity and acceleration, angular velocity and acceleration."""
        zero = np.zeros(3)
        states = {self.root: (np.eye(3), zero, zero, zero, zero, zero)}
        for joint in self.order:
            R_p, p_p, v_p, a_p, w_p, e_p = states[joint.parent]
            turn, shift, u, du, w, dw = relative(joint, *(part.get(joint.name, np.zeros(0)) for part in (q, v, a)))
            R_j = R_p @ joint.R
            u, du, w, dw = R_j @ u, R_j @ du, R_j @ w, R_j @ dw
            r = R_p @ joint.p + R_j @ shift
            states[joint.child] = (
                R_j @ turn,
                p_p + r,
                v_p + np.cross(w_p, r) + u,
                a_p + np.cross(e_p, r) + np.cross(w_p, np.cross(w_p, r)) + 2 * np.cross(w_p, u) + du,
                w_p + w,
                e_p + dw + np.cross(w_p, w),
            )
        return states

    def forces(self, q, v, a, gravity=(0.0, 0.0, -9.81)):
        """Generalised forces that make the motion, by d'Alembert's principle, in the order of ``moving``."""
        states = self.motion(q, self.rates(v), self.rates(a))
        total = np.zeros(self.width)
        for name, (J_linear, J_angular) in self.jacobians(q).items():
            link = self.links[name]
            R, _, _, acceleration, w, e = states[name]
            c, inertia = R @ link.centre, R @ link.inertia @ R.T
            at_centre = acceleration + np.cross(e, c) + np.cross(w, np.cross(w, c)) - np.array(gravity)
            moment = inertia @ e + np.cross(w, inertia @ w)
            total += link.mass * J_linear.T @ at_centre + J_angular.T @ moment
        return total

    def jacobians(self, q):
        """Of every link with mass: of its centre of mass and of its angular velocity, shape (3, width) each."""
        still = self.rates(np.zeros(self.width))
        units = [self.motion(q, self.rates(column), still) for column in np.eye(self.width)]
        found = {}
        for name, link in self.links.items():
            if link.mass > 0.0:
                moves = [(unit[name][0] @ link.centre, unit[name][2], unit[name][4]) for unit in units]
                found[name] = [
                    np.reshape(columns, (self.width, 3)).T
                    for columns in ([v + np.cross(w, c) for c, v, w in moves], [w for _, _, w in moves])
                ]
        return found

    def mass_matrix(self, q):
        total, states = np.zeros((self.width, self.width)), self.motion(q, *[self.rates(np.zeros(self.width))] * 2)
        for name, (J_linear, J_angular) in self.jacobians(q).items():
            R = states[name][0]
            inertia = R @ self.links[name].inertia @ R.T
            total += self.links[name].mass * J_linear.T @ J_linear + J_angular.T @ inertia @ J_angular
        return total


def relative(joint, q, v, a):
    """Of the child in the joint's frame: R, p, velocity and its rate, angular velocity and its rate."""
    zero, eye, s = np.zeros(3), np.eye(3), joint.axis
    if joint.kind == "fixed":
        return eye, zero, zero, zero, zero, zero
    if joint.kind == "prismatic":
        return eye, s * q[0], s * v[0], s * a[0], zero, zero
    if joint.kind in ("revolute", "continuous"):
        angle = q[0] if joint.kind == "revolute" else np.arctan2(q[1], q[0])
        return Rotation.from_rotvec(angle * s).as_matrix(), zero, zero, zero, s * v[0], s * a[0]
    if joint.kind == "planar":
        R, p = np.array([[q[2], -q[3], 0.0], [q[3], q[2], 0.0], [0.0, 0.0, 1.0]]), np.array([q[0], q[1], 0.0])
        u, du = np.array([v[0], v[1], 0.0]), np.array([a[0], a[1], 0.0])
        w, dw = np.array([0.0, 0.0, v[2]]), np.array([0.0, 0.0, a[2]])
    else:
        R, p = Rotation.from_quat(q[3:]).as_matrix(), q[:3]
        u, w, du, dw = v[:3], v[3:], a[:3], a[3:]
    return R, p, R @ u, R @ (du + np.cross(w, u)), R @ w, R @ dw


def coordinates(model, q):
    """Pinocchio's q as a dict."""
    return {
        model.names[joint]: q[model.idx_qs[joint] : model.idx_qs[joint] + model.nqs[joint]]
        for joint in range(1, model.njoints)
    }


def reordering(model, tree):
    """Index array: a vector in the order of the tree's ``moving``, from one in Pinocchio's order."""
    ids = [model.getJointId(name) for name in tree.moving]
    parts = [np.arange(model.idx_vs[joint], model.idx_vs[joint] + model.nvs[joint]) for joint in ids]
    return np.concatenate([np.zeros(0, dtype=int), *parts])
