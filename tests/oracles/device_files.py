"""The devices of the ``urdf`` folder for tests: as files, and the agile eye's configurations in closed form."""

import tomllib

import numpy as np
import pinocchio as pin
from mechanisms import Named
from places import URDF
from scipy.spatial.transform import Rotation

from exo_pin.chain import ClosedChain, read_closures


def loaded(name):
    """The chain of a device's files."""
    return ClosedChain.from_urdf(URDF / f"{name}.urdf")


def named(name):
    """The same as text, for MuJoCo."""
    closures = read_closures(URDF / f"{name}.closures.toml")
    text = (URDF / f"{name}.urdf").read_text()
    return Named(text, closures, ClosedChain.from_urdf(text, closures).neutral())


def device_table(name):
    """The device file."""
    return tomllib.loads((URDF / f"{name}.device.toml").read_text())


def reached(chain, arm, steps=8):
    """A closed configuration with the arm at a rotation, on the way from the arm hanging."""
    q = chain.close(chain.neutral())
    for share in np.arange(1, steps + 1) / steps:
        q[chain.configuration_slice("root_joint")] = Rotation.from_rotvec(share * arm.as_rotvec()).as_quat()
        held = chain.locked(["root_joint"], q)
        joints = [name for name in list(chain.model.names)[1:] if name != "root_joint"]
        start = held.neutral()
        for joint in joints:
            start[held.configuration_slice(joint)] = q[chain.configuration_slice(joint)]
        closed = held.close(start)
        for joint in joints:
            q[chain.configuration_slice(joint)] = closed[held.configuration_slice(joint)]
    return q


class AgileEye:
    """The spherical 3RRR by vectors: u, v, w at rest as its file has them, shape (3, 3), one axis a row."""

    def __init__(self):
        self.chain = chain = loaded("spherical-3rrr")
        axes = {}
        for kind in ("motor", "elbow", "cuff"):
            axes[kind] = np.array([_axis(chain, f"limb_{i}_{kind}") for i in (1, 2, 3)])
        # The motor's coordinate is the outer link's turn seen from the torso.
        self.u, self.w, self.v = -axes["motor"], axes["elbow"], axes["cuff"]

    def middles(self, R, signs=(1, 1, 1)):
        """w_i of a pose, across u_i and v_i, on the side of the rest pose for a sign of 1."""
        w = np.cross(self.u, self.v @ R.T)
        same = np.sign(np.einsum("ij,ij->i", np.cross(self.u, self.v), self.w))
        return (np.array(signs) * same)[:, None] * w / np.linalg.norm(w, axis=1, keepdims=True)

    def configuration(self, R, w):
        """q of a pose with given w_i: angles from rest to there, by limb cuff, elbow, motor."""
        q = self.chain.neutral()
        q[self.chain.configuration_slice("root_joint")] = Rotation.from_matrix(R).as_quat()
        for i in range(3):
            cuff = _turn(self.v[i], self.w[i], R.T @ w[i])
            motor = _turn(self.u[i], self.w[i], w[i])
            inner = Rotation.from_matrix(R) * Rotation.from_rotvec(cuff * self.v[i])
            elbow = (inner.inv() * Rotation.from_rotvec(motor * self.u[i])).as_rotvec() @ self.w[i]
            for kind, angle in (("cuff", cuff), ("elbow", elbow), ("motor", motor)):
                q[self.chain.configuration_slice(f"limb_{i + 1}_{kind}")] = angle
        return q

    def sines(self, R):
        """Sine between u_i and v_i of poses, shape (..., 3)."""
        cosines = np.einsum("ij,...jk,ik->...i", self.u, R, self.v)
        return np.sqrt(np.maximum(1.0 - cosines**2, 0.0))


def _axis(chain, joint):
    data = chain.model.createData()
    pin.computeJointJacobians(chain.model, data, chain.neutral())
    J = pin.getJointJacobian(chain.model, data, chain.model.getJointId(joint), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
    return J[3:, chain.velocity_slice(joint)][:, 0]


def _turn(axis, start, end):
    """Angle about an axis from one direction across it to another."""
    return np.arctan2(axis @ np.cross(start, end), start @ end)
