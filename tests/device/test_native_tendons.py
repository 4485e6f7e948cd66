"""Cables and springs of a device as MuJoCo's own tendons: read as a device's, written, and moved there."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from places import URDF
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.chain import ClosedChain
from exo_pin.device import ConstantForce, LinearSpring, Route, Spring

#: Cables on the upper arm, and two over the elbow, as of an exoskeleton's second stage; a spring and a cord.
ARM = """<mujoco model="carex"><compiler angle="radian"/><worldbody>{anchors}
  <site name="spring_top" pos="0 0.1 0.3"/>
  <body name="arm"><joint name="root_joint" type="ball"/>
    <inertial pos="0 0 -0.15" mass="2" diaginertia="0.02 0.02 0.004"/>{cuff}<site name="spring" pos="0 0.03 -0.2"/>
    <site name="via" pos="0.03 0.02 -0.25"/><site name="back" pos="-0.04 0 -0.2"/>
    <body name="forearm" pos="0 0 -0.3"><joint name="elbow" axis="0 1 0" range="-2.5 0" stiffness="3" springref="-0.4"/>
      <inertial pos="0 0 -0.12" mass="1.2" diaginertia="0.008 0.008 0.001"/>
      <site name="wrist" pos="0.02 0 -0.2"/><site name="wrist_back" pos="-0.02 0 -0.2"/></body></body></worldbody>
  <tendon>{tendons}
    <spatial name="flexor"><site site="anchor_0"/><site site="via"/><site site="wrist"/></spatial>
    <spatial name="extensor"><site site="anchor_3"/><site site="back"/><site site="wrist_back"/></spatial>
    <spatial name="support" stiffness="300" springlength="0.35"><site site="spring_top"/><site site="spring"/></spatial>
    <spatial name="cord" stiffness="150" springlength="0 0.3"><site site="anchor_1"/><site site="wrist"/></spatial>
  </tendon>
  <actuator>{motors}<motor name="f" tendon="flexor" gear="-1" ctrlrange="5 200"/>
    <general name="e" tendon="extensor" gainprm="-50" ctrlrange="0 3"/></actuator></mujoco>"""
BASE = [(0.15, 0.15, 0.2), (-0.15, 0.15, 0.2), (0.15, -0.15, 0.2), (-0.15, -0.15, 0.2)]


def carex(tmp_path):
    anchors = "".join(f'<site name="anchor_{k}" pos="{x} {y} {z}"/>' for k, (x, y, z) in enumerate(BASE))
    cuff = "".join(f'<site name="cuff_{k}" pos="{0.3 * x} {0.3 * y} -0.2"/>' for k, (x, y, _) in enumerate(BASE))
    over = '<spatial name="cable_{0}"><site site="anchor_{0}"/><site site="cuff_{0}"/></spatial>'
    motor = '<motor name="m{0}" tendon="cable_{0}" gear="-1" ctrlrange="0 400"/>'
    path = tmp_path / "carex.xml"
    path.write_text(
        ARM.format(
            anchors=anchors,
            cuff=cuff,
            tendons="".join(map(over.format, range(4))),
            motors="".join(map(motor.format, range(4))),
        )
    )
    return path


def roles(path):
    path.with_suffix(".device.toml").write_text(
        f'schema = 1\nname = "carex"\nrobot = "{path.name}"\n[roles]\narm = "arm"\nshoulder = "root_joint"\n'
    )
    return ep.load(path)


def test_tendons_are_routed_cables_that_pull_and_springs(tmp_path):
    path = carex(tmp_path)
    chain = ClosedChain.from_mjcf(path)
    assert [entry.partition(":")[0] for entry in chain.description.left_out] == ["cables"]
    exo = roles(path)
    found = {drive.name: drive.effort_range for drive in exo.device.drives}
    assert found == {f"cable_{k}": (0.0, 400.0) for k in range(4)} | {"flexor": (5.0, 200.0), "extensor": (0.0, 150.0)}
    laws = {spring.name: spring.law for spring in exo.device.springs}
    assert (laws["support"].stiffness, laws["support"].slack, laws["support"].only_pulls) == (300.0, 0.35, False)
    assert (laws["cord"].stiffness, laws["cord"].slack, laws["cord"].only_pulls) == (150.0, 0.3, True)
    # The same forces on the joints as MuJoCo's, of every tension and spring.
    theirs = mujoco.MjModel.from_xml_path(str(path))
    data, rng = mujoco.MjData(theirs), np.random.default_rng(3)
    tensions = np.array([10.0, 200.0, 30.0, 7.0, 60.0, 90.0])
    turn = Rotation.random(rng=rng).as_quat()
    q = np.array([*turn, -0.9])
    data.qpos[:] = [turn[3], *turn[:3], -0.9]
    data.ctrl[:] = [*tensions[:5], tensions[5] / 50.0]
    mujoco.mj_forward(theirs, data)
    expected = data.qfrc_actuator + data.qfrc_passive
    expected[-1] += 3.0 * (q[-1] + 0.4)  # the elbow's own spring, which is the chain's
    np.testing.assert_allclose(forces(exo, q, tensions), expected, atol=1e-9 * np.abs(expected).max())


def forces(exo, q, tensions):
    """Generalised forces of the device's tensions and springs, by the Jacobians of the points of their routes."""
    model = exo.device.chain.model
    data = model.createData()
    pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)

    def along(route):
        """Length of a route and its gradient."""
        points, rates = [], []
        for link, at in ((model.getFrameId(p.link), np.array(p.point)) for p in route.points):
            J = pin.getFrameJacobian(model, data, link, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
            points.append(data.oMf[link].act(at))
            rates.append(J[:3] - pin.skew(data.oMf[link].rotation @ at) @ J[3:])
        pieces = np.diff(points, axis=0)
        sizes = np.linalg.norm(pieces, axis=1)
        return sizes.sum(), np.einsum("ij,ijk->k", pieces / sizes[:, None], np.diff(rates, axis=0))

    found = np.zeros(model.nv)
    for drive, tension in zip(exo.device.drives, tensions, strict=True):
        found -= tension * along(drive.route)[1]
    for spring in exo.device.springs:
        if spring.joint is not None:
            own = model.getJointId(spring.joint)
            found[model.idx_vs[own]] -= float(spring.law.force(q[model.idx_qs[own]]))
            continue
        length, rate = along(spring.route)
        found -= float(spring.law.force(length)) * rate
    return found


@pytest.mark.full
def test_a_device_with_cables_and_springs_is_written_with_its_own_tendons(tmp_path):
    exo = roles(carex(tmp_path))
    written = exo.export(tmp_path / "out.xml")
    assert written.lost == ()
    assert "cable" not in written.statement
    again = ep.load(written[0])
    poses = exo.pose([40.0, 20.0], [30.0, 60.0], 10.0)
    one, other = exo.reaction(poses), again.reaction(poses)
    np.testing.assert_allclose(other.actuator_forces, one.actuator_forces, atol=1e-6)
    np.testing.assert_allclose(other.shoulder_force, one.shoulder_force, atol=1e-6)
    # Two files of one device in MuJoCo: half a second with tensions, springs and gravity.
    ends = []
    for path in (tmp_path / "carex.xml", written[0]):
        model = mujoco.MjModel.from_xml_path(str(path))
        data = mujoco.MjData(model)
        model.opt.timestep, model.opt.integrator = 5e-4, mujoco.mjtIntegrator.mjINT_RK4
        data.qpos[:] = [np.cos(0.3), 0.0, np.sin(0.3), 0.0, -0.7]
        data.ctrl[:] = [20.0, 15.0, 25.0, 10.0, 12.0, 0.2]
        if path == written[0]:
            data.ctrl[5] *= 50.0
        mujoco.mj_step(model, data, 1000)
        ends.append(data.qpos.copy())
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-9)
    # And the chain's own motion under the tensions and springs of its device.
    tensions, start = [20.0, 15.0, 25.0, 10.0, 12.0, 10.0], np.array([0.0, np.sin(0.3), 0.0, np.cos(0.3), -0.7])
    own = exo.device.chain.simulate(start, np.zeros(4), [0.0, 0.5], lambda t, q, v: forces(exo, q, tensions), rtol=1e-7)
    w, x, y, z, elbow = ends[0]
    np.testing.assert_allclose(own.q[-1], [x, y, z, w, elbow], atol=5e-5)
    assert np.abs(ends[0] - [np.cos(0.3), 0.0, np.sin(0.3), 0.0, -0.7]).max() > 0.1


@pytest.mark.full
def test_springs_of_constant_force_and_in_joints_move_in_mujoco(tmp_path):
    """A spring that rolls up, and a torsion and a constant-torque spring in the elbow, for half a second."""
    exo = roles(carex(tmp_path))
    more = (
        Spring("roll", ConstantForce(8.0), route=Route.over(("universe", [0.3, 0.2, 0.6]), ("arm", [0.03, 0, -0.25]))),
        Spring("torsion", LinearSpring(4.0, -0.3), joint="elbow"),
        Spring("constant", ConstantForce(0.7), joint="elbow"),
    )
    exo = ep.ShoulderExo.from_device(exo.device.replace(springs=(*exo.device.springs, *more)))
    written = exo.export(tmp_path / "out.xml")
    assert written.lost == ()
    assert "spring" not in written.statement
    assert ep.load(written[0]).device.springs == exo.device.springs
    # The robot's file alone has them, too.
    alone = ClosedChain.from_mjcf(written[0])
    assert {own.name: own.constant for own in alone.description.cables if own.constant} == {
        "roll": 8.0,
        "constant": 0.7,
    }
    model = mujoco.MjModel.from_xml_path(str(written[0]))
    data = mujoco.MjData(model)
    model.opt.timestep, model.opt.integrator = 5e-4, mujoco.mjtIntegrator.mjINT_RK4
    model.jnt_limited[:] = 0
    data.qpos[:] = first = [np.cos(0.3), 0.0, np.sin(0.3), 0.0, -0.7]
    tensions = [20.0, 15.0, 25.0, 10.0, 12.0, 10.0]
    data.ctrl[:6] = tensions
    mujoco.mj_step(model, data, 1000)
    start = np.array([0.0, np.sin(0.3), 0.0, np.cos(0.3), -0.7])
    own = exo.device.chain.simulate(start, np.zeros(4), [0.0, 0.5], lambda t, q, v: forces(exo, q, tensions), rtol=1e-7)
    w, x, y, z, elbow = data.qpos
    np.testing.assert_allclose(own.q[-1], [x, y, z, w, elbow], atol=5e-5)
    assert np.abs(data.qpos - first).max() > 0.1


def test_a_published_support_has_its_springs_in_mujoco(tmp_path):
    """The support's routed linear springs are in the MJCF itself; others stay beside it."""
    exo = ep.load(URDF / "spring-support.urdf")
    written = exo.export(tmp_path / "support.xml")
    model = mujoco.MjModel.from_xml_path(str(written[0]))
    native = {mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_TENDON, k) for k in range(model.ntendon)}
    linear = {own.name for own in exo.device.springs if own.route is not None and hasattr(own.law, "stiffness")}
    assert linear <= native
    assert all(name not in written.statement for name in linear)
