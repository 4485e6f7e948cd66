"""Springs and viscous damping in the joints, against closed forms, MuJoCo, and the balance of energy."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from scipy.linalg import expm

from exo_pin.chain import ClosedChain, Closures, JointProperties

MASS = pin.Inertia(2.0, np.array([0.1, -0.05, 0.2]), np.diag([0.03, 0.04, 0.05]))


def single(kind, joints=(), damping=None):
    model = pin.Model()
    joint = model.addJoint(0, kind, pin.SE3.Identity(), "joint")
    model.appendBodyToJoint(joint, MASS, pin.SE3.Identity())
    model.addFrame(pin.Frame("link", joint, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    if damping is not None:
        model.damping = np.broadcast_to(damping, (model.nv,)).astype(float)
    return ClosedChain(model, Closures("single", joints=tuple(joints)))


def test_slide_with_spring_and_damper_moves_as_the_damped_oscillator():
    stiffness, damping, slack = 30.0, 1.5, 0.2
    chain = single(pin.JointModelPX(), [JointProperties("joint", stiffness, (slack,))], damping)
    times = np.linspace(0.0, 3.0, 16)
    found = chain.simulate([0.5], [-1.0], times)
    # x'' = -(k (x - slack) + d x') / m, gravity across.
    A = np.array([[0.0, 1.0], [-stiffness / MASS.mass, -damping / MASS.mass]])
    expected = np.array([expm(A * t) @ [0.5 - slack, -1.0] for t in times])
    np.testing.assert_allclose(found.q[:, 0] - slack, expected[:, 0], atol=1e-8)
    np.testing.assert_allclose(found.v[:, 0], expected[:, 1], atol=1e-8)
    assert found.energy_drift < 1e-7
    lost = found.energy[0] - found.energy[-1]
    np.testing.assert_allclose(found.dissipated[-1], lost, rtol=1e-7)
    assert lost > 0.8 * (stiffness * 0.3**2 + MASS.mass) / 2
    assert (np.diff(found.dissipated) > 0.0).all()


@pytest.mark.parametrize("kind", ["ball", "free"])
def test_springs_of_turning_joints_are_mujocos(kind):
    rng = np.random.default_rng(5)
    joint = "<freejoint/>" if kind == "free" else '<joint type="ball"/>'
    xml = f"""<mujoco><option gravity="0 0 0"/><worldbody><body>{joint}<inertial pos="0 0 0" mass="1"
    diaginertia="0.1 0.1 0.1"/></body></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    model.jnt_stiffness[0] = 7.0
    own = pin.JointModelFreeFlyer() if kind == "free" else pin.JointModelSpherical()
    for _ in range(20):
        shift, turns = rng.normal(size=(2, 3)), [pin.Quaternion(pin.exp3(rng.normal(size=3))) for _ in range(2)]
        coordinates = [
            np.concatenate([place if kind == "free" else [], turn.coeffs()])
            for place, turn in zip(shift, turns, strict=True)
        ]
        # Scalar first there.
        theirs = [np.concatenate([q[:-4], [q[-1]], q[-4:-1]]) for q in coordinates]
        data.qpos[:], model.qpos_spring[:] = theirs
        mujoco.mj_forward(model, data)
        chain = single(own, [JointProperties("joint", 7.0, tuple(coordinates[1].tolist()))])
        force = chain._state.passive.force(coordinates[0], None)
        if kind == "free":
            force[:3] = turns[0].toRotationMatrix() @ force[:3]
        np.testing.assert_allclose(force, data.qfrc_passive, atol=1e-12)


@pytest.mark.parametrize("kind", [pin.JointModelSpherical(), pin.JointModelFreeFlyer(), pin.JointModelTranslation()])
def test_force_is_the_gradient_of_the_energy_and_its_change_the_difference(kind):
    rng = np.random.default_rng(6)
    model = single(kind).model
    rest = pin.integrate(model, pin.neutral(model), rng.normal(size=model.nv))
    chain = single(kind, [JointProperties("joint", 4.0, tuple(rest.tolist()))], 0.3)
    q, v = pin.integrate(model, rest, rng.normal(size=model.nv)), rng.normal(size=model.nv)
    step = 1e-4
    for unit in np.eye(model.nv):
        ends = [pin.integrate(model, q, s * step * unit) for s in (1.0, -1.0)]
        slope = (chain._state.passive.energy(ends[0]) - chain._state.passive.energy(ends[1])) / (2 * step)
        np.testing.assert_allclose(chain._state.passive.force(q, None) @ unit, -slope, atol=1e-6)
        change = chain._state.passive.change(q, unit[:, None], 2.0 * unit[:, None])[:, 0]
        moved = [
            chain._state.passive.force(end, v + 2.0 * s * step * unit) for end, s in zip(ends, (1, -1), strict=True)
        ]
        np.testing.assert_allclose(change, (moved[0] - moved[1]) / (2 * step), atol=1e-6)
