"""Hinges and slides with massless bodies between them are written as joints of one body of MJCF."""

import mujoco
import numpy as np
import pinocchio as pin

from exo_pin.chain import ClosedChain, Closures

MASS = """<inertial><origin xyz="0.1 -0.2 0.3"/><mass value="1.3"/>
<inertia ixx="0.2" iyy="0.3" izz="0.4" ixy="0.01" ixz="-0.02" iyz="0.03"/></inertial>"""


def urdf(masses=(False, False, True, True)):
    """A hinge, a slide and a hinge with offsets between them, then another hinge."""
    text = "<robot name='joined'><link name='base'/>"
    joints = (("revolute", "1 0 0"), ("prismatic", "0 0.6 0.8"), ("revolute", "0 1 0"), ("revolute", "0 0 1"))
    for k, (kind, axis) in enumerate(joints):
        parent = f"link{k - 1}" if k else "base"
        text += f"<link name='link{k}'>{MASS if masses[k] else ''}</link>"
        text += f"""<joint name='j{k}' type='{kind}'><parent link='{parent}'/><child link='link{k}'/>
        <origin xyz='0.1 {0.2 * k} -0.3' rpy='0.3 -0.5 {0.4 * k}'/><axis xyz='{axis}'/>
        <limit lower='-2' upper='{k + 1}' effort='{10 * (k + 1)}' velocity='9'/><dynamics damping='0.{k}' friction='0'/>
        </joint>"""
    return text + "</robot>"


def test_joints_without_mass_between_them_move_as_in_mujoco(tmp_path):
    chain = ClosedChain.from_urdf(urdf(), Closures("joined"))
    model = mujoco.MjModel.from_xml_path(str(chain.to_mjcf(tmp_path)))
    assert model.nbody == 3
    assert [model.joint(k).name for k in range(4)] == ["j0", "j1", "j2", "j3"]
    np.testing.assert_allclose(model.jnt_range[:, 1], [1, 2, 3, 4])
    np.testing.assert_allclose(model.dof_damping, [0, 0.1, 0.2, 0.3])
    data, rng = mujoco.MjData(model), np.random.default_rng(3)
    for _ in range(4):
        q, v = rng.normal(size=(2, 4))
        data.qpos[:], data.qvel[:] = q, v
        mujoco.mj_forward(model, data)
        for name in ("link2", "link3"):
            place = chain.placement(q, name)
            np.testing.assert_allclose(data.body(name).xpos, place.translation, atol=1e-12)
            np.testing.assert_allclose(data.body(name).xmat.reshape(3, 3), place.rotation, atol=1e-12)
        M = np.zeros((4, 4))
        mujoco.mj_fullM(model, data, M)
        upper = np.triu(pin.crba(chain.model, chain.model.createData(), q))
        np.testing.assert_allclose(M, upper + np.triu(upper, 1).T, atol=1e-12)
        bias = pin.nonLinearEffects(chain.model, chain.model.createData(), q, v)
        np.testing.assert_allclose(data.qfrc_bias, bias, atol=1e-11)
