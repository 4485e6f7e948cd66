"""What MuJoCo makes of MJCF that is read here, and of bodies that are joined in it."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from mjcf_arm import arm, read

from exo_pin import FileFormatError
from exo_pin.chain import ClosedChain, Closures
from exo_pin.core import errors


@pytest.mark.parametrize(
    ("ja", "actuators", "limits"),
    [
        ("", "", (-np.inf, np.inf)),
        ('actuatorfrcrange="-3 4"', "", (-3, 4)),
        ("", '<motor joint="ja"/>', (-np.inf, np.inf)),
        ("", '<motor joint="ja" gear="10" ctrlrange="-1 2"/>', (-10, 20)),
        ("", '<motor joint="ja" gear="-10" ctrlrange="-1 2"/>', (-20, 10)),
        ("", '<motor joint="ja" gear="10" ctrlrange="-1 2" forcerange="-0.5 0.3"/>', (-5, 3)),
        ('actuatorfrcrange="-3 4"', '<motor joint="ja" gear="10" ctrlrange="-1 0.1"/>', (-3, 1)),
        ("", '<general joint="ja" gainprm="3" ctrlrange="-1 2"/>', (-3, 6)),
        # The control of an actuator with dynamics does not bound its force.
        ("", '<general joint="ja" dyntype="integrator" ctrlrange="-1 2"/>', (-np.inf, np.inf)),
        ("", '<general joint="ja" dyntype="integrator" ctrlrange="-1 2" forcerange="-7 8"/>', (-7, 8)),
        ("", '<motor joint="ja" ctrlrange="-1 2"/><motor joint="ja" gear="2" forcerange="-1 1"/>', (-3, 4)),
        ("", '<motor joint="ja" ctrlrange="-1 2"/><motor joint="ja"/>', (-np.inf, np.inf)),
    ],
)
def test_efforts_are_limited_as_mujoco_limits_them(ja, actuators, limits):
    text = arm(ja=ja, more=f"<actuator>{actuators}</actuator>")
    chain = ClosedChain.from_mjcf(text)
    assert (chain.model.lowerEffortLimit[0], chain.model.upperEffortLimit[0]) == limits
    np.testing.assert_array_equal(chain.model.upperEffortLimit[1:], np.inf)
    assert chain.roles.actuated == (("ja",) if actuators else ())
    # Whatever the controls, MuJoCo's forces stay within, and they come near to the limits.
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    forces = []
    for control in (-1e6, 0.0, 1e6):
        data.ctrl[:] = control * np.sign(model.actuator_gear[:, 0])
        data.act[:] = control
        mujoco.mj_forward(model, data)
        forces.append(data.qfrc_actuator[0])
    for limit, force in zip(limits, (min(forces), max(forces)), strict=True):
        if actuators:
            assert force == limit if np.isfinite(limit) else abs(force) > 1e5


def test_mujocos_warnings_become_pythons_and_no_log_is_written(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before = mujoco.get_mju_user_warning()
    with pytest.warns(RuntimeWarning, match="NaN"):
        chain = read(ina='<site name="mark" rgba="nan 0 0 1"/>')
    assert np.isfinite(chain.placement(chain.neutral(), "mark").translation).all()
    assert mujoco.get_mju_user_warning() is before
    assert list(tmp_path.iterdir()) == []


def test_physics_that_is_not_known_is_noticed(monkeypatch):
    # As if this package did not know dampers.
    monkeypatch.setattr("exo_pin.chain.structure.passive.PassiveForces.force", lambda *_: np.zeros(5))
    assert read().model.nv == 5
    with pytest.raises(FileFormatError, match="MuJoCo computes other passive forces"):
        read(ja='damping="1"')


def test_a_limit_with_a_margin_is_where_mujoco_holds_the_joint():
    """A pendulum falls against its limit and comes to rest there; MuJoCo's limit gives way by its softness alone."""
    text = """<mujoco><compiler angle="radian"/><option gravity="0 0 -9.81" timestep="0.001"/><worldbody><body>
    <joint name="j" axis="0 1 0" range="0.2 2" margin="0.3" damping="2" limited="true" ref="1"/>
    <geom size="0.05" pos="-0.4 0 0.4"/></body></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(text)
    model.jnt_solimp[0] = [0.999, 0.9999, 0.001, 0.5, 2.0]
    data = mujoco.MjData(model)
    for _ in range(10000):
        mujoco.mj_step(model, data)
    low, high = (
        ClosedChain.from_mjcf(text).model.lowerPositionLimit[0],
        ClosedChain.from_mjcf(text).model.upperPositionLimit[0],
    )
    assert (low, high) == pytest.approx((0.5, 1.7))
    assert data.qpos[0] == pytest.approx(low, abs=2e-3) or data.qpos[0] == pytest.approx(high, abs=2e-3)
    assert abs(data.qvel[0]) < 1e-6


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


@pytest.mark.parametrize(
    ("version", "is_read"),
    [("3.9.9", False), ("3.10.0", True), ("3.17.2", True), ("4.99.0rc1", True), ("5.0.0", False), ("2.30.0", False)],
)
def test_versions_of_mujoco_that_are_read(version, is_read, monkeypatch):
    monkeypatch.setattr(mujoco, "__version__", version)
    if is_read:
        assert ClosedChain.from_mjcf(arm()).model.njoints == 4
        return
    with pytest.raises(errors.MissingExtra, match=f">=3.10,<5 .what is installed has version {version}"):
        ClosedChain.from_mjcf(arm())
