"""MuJoCo's own matrices, with its equalities solved exactly instead of as soft springs.

M, bias and passive forces are MuJoCo's, and so are the rows J of its equalities. The rows' drift comes from J along the
motion that ``mj_integratePos`` makes of a constant velocity: the derivative of J v at t = 0 by five points,

    (-f(2h) + 8 f(h) - 8 f(-h) + f(-2h)) / 12 h,  error h⁴ f⁽⁵⁾ / 30 + 1.5 ε |f| / h,

which for f of size one that changes in a second is least near h = 1e-3 at 1e-12. It shares no formula with exo_pin.

Coordinates: MuJoCo's free joint has its linear velocity in the world's axes, Pinocchio's in the body's; quaternions are
(w, x, y, z) there. v_mujoco = T v and a_mujoco = T a + T' v.
"""

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

STEP = 1e-3
#: Singular values of J, its rows of length one, beside the largest: below the first they are zero, above the second
#: they are not.
ZERO, CLEAR = 1e-9, 1e-5
#: Scaled velocities no larger are at rest.
REST = 1e-9


class ExactMujoco:
    """A model at one state in the coordinates of a chain, whose joints have the same names.

    ``names`` maps the chain's joints to MuJoCo's numbers where the names are not the same.
    """

    def __init__(self, model, chain, names=None):
        self.model, self.chain = model, chain
        self.data = mujoco.MjData(model)
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_LIMIT)
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_FRICTIONLOSS)
        self.joints = []
        for name in list(chain.model.names)[1:]:
            joint = names[name] if names else model.joint(name).id
            kind = mujoco.mjtJoint(int(model.jnt_type[joint]))
            sizes = {mujoco.mjtJoint.mjJNT_FREE: (7, 6), mujoco.mjtJoint.mjJNT_BALL: (4, 3)}.get(kind, (1, 1))
            start, dof = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
            theirs = slice(start, start + sizes[0]), slice(dof, dof + sizes[1])
            self.joints.append((*theirs, chain.configuration_slice(name), chain.velocity_slice(name)))

    def q_of(self, qpos):
        """The chain's configuration."""
        q = np.zeros(self.chain.model.nq)
        for theirs, _, own, _ in self.joints:
            values = qpos[theirs]
            order = {7: [0, 1, 2, 4, 5, 6, 3], 4: [1, 2, 3, 0], 1: [0]}[len(values)]
            q[own] = values[order]
        return q

    def qpos_of(self, q):
        qpos = np.zeros(self.model.nq)
        for theirs, _, own, _ in self.joints:
            order = {7: [0, 1, 2, 6, 3, 4, 5], 4: [3, 0, 1, 2], 1: [0]}[own.stop - own.start]
            qpos[theirs] = q[own][order]
        return qpos

    def velocity_map(self, qpos, v=None):
        """T, shape (nv, nv), and its rate with the chain's v if that is given."""
        T, rate = np.zeros((2, self.model.nv, self.model.nv))
        for at, theirs, _, own in self.joints:
            T[theirs, own] = np.eye(own.stop - own.start)
            if own.stop - own.start == 6:
                R = Rotation.from_quat(qpos[at][3:], scalar_first=True).as_matrix()
                linear = slice(theirs.start, theirs.start + 3), slice(own.start, own.start + 3)
                T[linear] = R
                if v is not None:
                    x, y, z = v[own][3:]
                    rate[linear] = R @ np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        return T if v is None else (T, rate)

    def at(self, qpos, qvel=None):
        """Let MuJoCo compute everything but accelerations."""
        self.data.qpos[:] = qpos
        self.data.qvel[:] = 0.0 if qvel is None else qvel
        mujoco.mj_fwdPosition(self.model, self.data)
        mujoco.mj_fwdVelocity(self.model, self.data)
        return self.data

    def mass(self):
        M = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, self.data, M)
        return M

    def rows(self):
        """Residual and Jacobian of the equalities, where the data stand."""
        model, data = self.model, self.data
        J = np.zeros((data.nefc, model.nv))
        if data.nefc and mujoco.mj_isSparse(model):
            mujoco.mju_sparse2dense(J, data.efc_J, data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind)
        elif data.nefc:
            J[:] = data.efc_J[: J.size].reshape(J.shape)
        equalities = data.efc_type == int(mujoco.mjtConstraint.mjCNSTR_EQUALITY)
        return data.efc_pos[equalities].copy(), J[equalities]

    def drift(self, qpos, qvel):
        """The rows' acceleration at a constant qvel."""

        def speed(time):
            moved = np.array(qpos)
            mujoco.mj_integratePos(self.model, moved, qvel, time)
            self.at(moved)
            return self.rows()[1] @ qvel

        return (8.0 * (speed(STEP) - speed(-STEP)) - speed(2 * STEP) + speed(-2 * STEP)) / (12.0 * STEP)

    def rank(self):
        """Rank of J where the data stand, or None if some singular value is neither zero nor clear of it."""
        values = self.singular_values()
        if ((values > ZERO) & (values < CLEAR)).any():
            return None
        return int(np.count_nonzero(values > ZERO))

    def singular_values(self):
        """Of J with rows of length one, beside the largest."""
        J = self.rows()[1]
        # Rows of size one: a torquescale weighs some.
        sizes = np.linalg.norm(J, axis=1, keepdims=True)
        values = np.linalg.svd(np.divide(J, sizes, out=np.zeros_like(J), where=sizes > 0.0), compute_uv=False)
        return values / max(values.max(initial=0.0), 1e-12)

    def motions(self):
        """Orthonormal basis of the velocities that keep the equalities."""
        J = self.rows()[1]
        rank = self.rank()
        assert rank is not None
        return np.linalg.svd(J)[2][rank:].T if len(J) else np.eye(self.model.nv)

    def acceleration(self, qpos, qvel, forces):
        """MuJoCo's acceleration with exact equalities, under forces beside the passive ones, shape (nv,)."""
        drift = self.drift(qpos, qvel)
        data = self.at(qpos, qvel)
        M, J, Z = self.mass(), self.rows()[1], self.motions()
        start = np.linalg.lstsq(J, -drift, rcond=1e-7)[0] if len(J) else np.zeros(self.model.nv)
        push = forces + data.qfrc_passive - data.qfrc_bias - M @ start
        return start + Z @ np.linalg.solve(Z.T @ M @ Z, Z.T @ push)


def joint_numbers(model, chain):
    """MuJoCo's numbers of a chain's joints; those without a name are called after their number."""
    found = {}
    for name in list(chain.model.names)[1:]:
        theirs = "universe" if name == "universe_joint" else name
        number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, theirs)
        found[name] = number if number >= 0 else int(name.strip("_").split("_")[-1])
    return found


def assert_same(one, other, relative=1e-9, what="", least=0.0):
    """Equal, relative to the largest entry of the two, or to ``least`` if that is more."""
    one, other = np.asarray(one), np.asarray(other)
    size = max(least, np.abs(one).max(initial=0.0), np.abs(other).max(initial=0.0))
    assert np.abs(one - other).max(initial=0.0) <= relative * size, what


def problem_of(chain, exact, qpos, v, tau):
    """Of an :class:`ExactMujoco`: mass matrix, acceleration without friction at rest and stops, friction that slides,
    and friction at rest.
    """
    model, scale = chain.model, chain._state.topology.column
    low, high = model.lowerDryFrictionLimit, model.upperDryFrictionLimit
    sliding = np.where(v / scale > REST, low, np.where(v / scale < -REST, high, 0.0))
    resting = (np.abs(v / scale) <= REST) & ((low != 0.0) | (high != 0.0))
    T, rate = exact.velocity_map(qpos, v)
    theirs = exact.acceleration(qpos, T @ v, np.linalg.solve(T.T, tau + sliding))
    smooth = np.linalg.solve(T, theirs - rate @ v)
    exact.at(qpos)
    return T.T @ exact.mass() @ T, smooth, sliding, [(i, low[i], high[i]) for i in np.flatnonzero(resting)]
