"""MuJoCo sees the tree and the loops that are written for it, and reads equalities as they are read here."""

from dataclasses import replace

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from closed_chains import CHAINS, off
from exchanged_closures import exchanged
from massive_chains import MASSIVE

from exo_pin import LoopNotClosed
from exo_pin.chain import ClosedChain, Placement

#: Closures that are written with a body of their own.
HELPED = ("cylindrical", "universal", "prismatic")


def grounded(kind, turned):
    """A loop with its end b on the world instead of on a body, or its end a."""
    chain, q = MASSIVE[f"loop-{kind}"]
    (loop,) = chain.closures
    own = pin.XYZQUATToSE3(np.array([*loop.placement_b.translation, *loop.placement_b.quaternion]))
    there = pin.SE3ToXYZQUAT(chain.placement(q, loop.frame_b) * own).tolist()
    loop = replace(loop, frame_b="universe", placement_b=Placement(tuple(there[:3]), tuple(there[3:])))
    loop = exchanged(loop) if turned else loop
    return ClosedChain(chain.model, replace(chain.description, closures=(loop,))), q


CASES = MASSIVE | {
    f"grounded-{kind}-{'ab'[turned]}": grounded(kind, turned) for kind in HELPED for turned in (False, True)
}


@pytest.fixture(params=CASES)
def case(request):
    return CASES[request.param]


class AsMujoco:
    """A written chain in MuJoCo, asked in Pinocchio's coordinates."""

    def __init__(self, chain, path):
        self.chain = chain
        self.model = mujoco.MjModel.from_xml_path(str(path))
        self.data = mujoco.MjData(self.model)

    def velocity_map(self, q):
        """Shape (nv, nv of MuJoCo's own joints): a free body's linear velocity is told in the world there."""
        chain = self.chain
        T = np.zeros((self.model.nv, chain.model.nv))
        for joint in range(1, chain.model.njoints):
            name, part = chain.model.names[joint], chain.velocity_slice(chain.model.names[joint])
            start = int(self.model.joint(name).dofadr[0])
            T[start : start + part.stop - part.start, part] = np.eye(part.stop - part.start)
            if chain.model.joints[joint].shortname() == "JointModelFreeFlyer":
                T[start : start + 3, part.start : part.start + 3] = chain.placement(q, name).rotation
        return T

    def at(self, q, v=None):
        model, chain = self.model, self.chain
        mujoco.mj_resetDataKeyframe(model, self.data, 0)
        for joint in range(1, chain.model.njoints):
            name = chain.model.names[joint]
            own, start = q[chain.configuration_slice(name)], int(model.joint(name).qposadr[0])
            kind = chain.model.joints[joint].shortname()
            if kind == "JointModelFreeFlyer":
                own = own[[0, 1, 2, 6, 3, 4, 5]]
            elif kind == "JointModelSpherical":
                own = own[[3, 0, 1, 2]]
            self.data.qpos[start : start + len(own)] = own
        if v is not None:
            self.data.qvel[:] = self.velocity_map(q) @ v
        mujoco.mj_forward(model, self.data)
        return self.data


def test_mujoco_sees_the_same_tree(case, tmp_path):
    chain, q0 = case
    seen = AsMujoco(chain, chain.to_mjcf(tmp_path, q0))
    rng = np.random.default_rng(6)
    for _ in range(3):
        q = off(chain, q0, rng, 0.3)
        v = 0.5 * rng.normal(size=chain.model.nv)
        data = seen.at(q, v)
        for name, place in chain.placements(q).items():
            if mujoco.mj_name2id(seen.model, mujoco.mjtObj.mjOBJ_BODY, name) > 0:
                np.testing.assert_allclose(data.body(name).xpos, place.translation, atol=1e-12)
                np.testing.assert_allclose(data.body(name).xmat.reshape(3, 3), place.rotation, atol=1e-12)
        if any(closure.type in HELPED for closure in chain.closures):
            continue  # helper bodies add a millionth of the mass
        M = np.zeros((seen.model.nv,) * 2)
        mujoco.mj_fullM(seen.model, data, M)
        T = seen.velocity_map(q)
        ours = chain.model.createData()
        np.testing.assert_allclose(T.T @ M @ T, symmetric(pin.crba(chain.model, ours, q)), atol=1e-12)
        # Gravity and velocity forces; the two tell a free body's acceleration in different axes.
        if not any(joint.shortname() == "JointModelFreeFlyer" for joint in list(chain.model.joints)[1:]):
            bias = pin.nonLinearEffects(chain.model, ours, q, v)
            np.testing.assert_allclose(T.T @ data.qfrc_bias, bias, atol=1e-11)


def symmetric(upper):
    return np.triu(upper) + np.triu(upper, 1).T


def test_mujoco_closes_the_same_loops(case, tmp_path):
    chain, q0 = case
    seen = AsMujoco(chain, chain.to_mjcf(tmp_path, q0))
    rng = np.random.default_rng(7)
    data = mujoco.MjData(seen.model)
    mujoco.mj_resetDataKeyframe(seen.model, data, 0)
    mujoco.mj_forward(seen.model, data)
    assert np.abs(data.efc_pos[data.efc_type == 0]).max(initial=0.0) < 1e-11
    helped = any(closure.type in HELPED for closure in chain.closures)
    q = q0 if helped else chain.close(off(chain, q0, rng, 0.1))
    data = seen.at(q)
    equalities = data.efc_type == 0
    assert np.abs(data.efc_pos[equalities]).max(initial=0.0) < 1e-11
    # The same freedoms: what keeps our loops closed keeps theirs, and they forbid as much.
    J = np.zeros((data.nefc, seen.model.nv))
    if mujoco.mj_isSparse(seen.model):
        mujoco.mju_sparse2dense(J, data.efc_J, data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind)
    else:
        J[:] = data.efc_J[: J.size].reshape(J.shape)
    J = J[equalities]
    extra = seen.model.nv - chain.model.nv
    rank = np.linalg.matrix_rank(J, tol=1e-8)
    assert rank == chain.mobility(q).rank + extra
    if not helped:
        motions = seen.velocity_map(q) @ chain.reduced_jacobian(q)
        np.testing.assert_allclose(J @ motions, 0.0, atol=1e-8 * max(1.0, np.abs(motions).max()))


def test_a_body_that_is_written_in_parts_is_named_once_where_it_lacks_inertia(tmp_path):
    chain, q = grounded("universal", True)
    model = chain.model.copy()
    model.inertias[model.getJointId("left_3_joint")] = pin.Inertia(1.0, np.zeros(3), np.zeros((3, 3)))
    text = ClosedChain(model, chain.description).to_mjcf(tmp_path, q).read_text(encoding="utf-8")
    assert "<!-- MuJoCo needs inertia everywhere; a millionth was added to left_3. -->" in text


def test_an_open_loop_shows_the_same_gap_in_mujoco(tmp_path):
    for name in ("five_bar", "delta", "delta-rigid", "stewart", "loop-rigid", "loop-spherical", "loop-distance"):
        chain, q0 = CHAINS[name]
        seen = AsMujoco(chain, chain.to_mjcf(tmp_path, q0))
        q = off(chain, q0, np.random.default_rng(8), 0.05)
        data = seen.at(q)
        theirs = data.efc_pos[data.efc_type == 0]
        residual, start = chain.residual(q), 0
        for closure in chain.closures:
            own = residual[chain.rows(closure.name)]
            gap = theirs[start : start + len(own)]
            start += len(own)
            np.testing.assert_allclose(np.linalg.norm(gap[:3]), np.linalg.norm(own[:3]), atol=1e-12)


MJCF = """<mujoco model="two"><worldbody>
  <body name="base" pos="0 0 1"><joint name="lift" type="slide" axis="0 0 1"/>
    <inertial pos="0.1 0 0" mass="1" diaginertia="1 2 2.5"/>
    <body name="b" pos="0.3 0 0" euler="0 30 0"><joint name="jb" axis="0 0.6 0.8" range="-60 90" pos="0.1 0 0"/>
      <inertial pos="0 0 0.1" mass="1" diaginertia="1 1 1"/><site name="sb" pos="0.2 0 0"/></body>
    <body name="c" pos="0 0.4 0"><joint name="jc" type="ball"/>
      <inertial pos="0 0.2 0" mass="2" diaginertia="1 1 1"/><site name="sc" pos="0 0.1 0" euler="10 20 30"/></body>
  </body></worldbody><equality>EQUALITY</equality>MORE</mujoco>"""


def mjcf(tmp_path, equality="", more=""):
    path = tmp_path / "two.xml"
    path.write_text(MJCF.replace("EQUALITY", equality).replace("MORE", more))
    return path


@pytest.mark.parametrize(
    "equality",
    [
        '<connect name="e" body1="b" body2="c" anchor="0.2 0 0.1"/>',
        '<connect name="e" body1="b" anchor="0.2 0 0.1"/>',
        '<connect name="e" site1="sb" site2="sc"/>',
        '<weld name="e" body1="b" body2="c"/>',
        '<weld name="e" body1="b" body2="c" relpose="0.1 0.2 0 0.6 0.8 0 0"/>',
        '<weld name="e" body1="b" body2="c" anchor="0.1 0.3 -0.2"/>',
        '<weld name="e" body1="b" body2="c" anchor="0.1 0.3 -0.2" relpose="0.1 0.2 0 0.6 0.8 0 0"/>',
        '<weld name="e" body1="c"/>',
        '<weld name="e" site1="sb" site2="sc"/>',
    ],
)
def test_mjcf_equalities_are_what_mujoco_makes_of_them(equality, tmp_path):
    path = mjcf(tmp_path, equality, more='<actuator><motor joint="jb"/></actuator>')
    chain = ClosedChain.from_mjcf(path)
    assert [closure.name for closure in chain.closures] == ["e"]
    assert chain.roles.actuated == ("jb",)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    rng = np.random.default_rng(10)
    for _ in range(3):
        q = pin.integrate(chain.model, chain.neutral(), rng.uniform(-0.5, 0.5, chain.model.nv))
        data.qpos[:] = [*q[:2], q[5], *q[2:5]]
        mujoco.mj_forward(model, data)
        gap = data.efc_pos[data.efc_type == 0]
        residual = chain.residual(q)
        assert len(gap) == len(residual)
        assert np.linalg.norm(gap[:3]) == pytest.approx(np.linalg.norm(residual[:3]), abs=1e-10)
        if len(gap) == 6:
            # MuJoCo's turn is the quaternion's vector part.
            turned = np.linalg.norm(residual[3:])
            torque = np.linalg.norm(gap[3:])
            assert (torque > 1e-6) == (turned > 1e-6)
        # Closed for us is closed for MuJoCo.
        try:
            closed = chain.close(q)
        except LoopNotClosed:
            continue  # not every one of these equalities can hold
        data.qpos[:] = [*closed[:2], closed[5], *closed[2:5]]
        mujoco.mj_forward(model, data)
        assert np.abs(data.efc_pos[data.efc_type == 0]).max() < 1e-10
