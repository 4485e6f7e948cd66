"""Static equilibria: closed forms, SciPy's least energy, MuJoCo's settled state, idle freedoms, stops."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from moving_chains import WITH_MASS, moving
from posture_programs import least_by_scipy

from exo_pin.chain import ClosedChain, Closures, JointProperties
from exo_pin.chain.postures.equilibrium import _Energy

PENDULUM = """<mujoco model="pendulum">
  <worldbody><body name="rod">
    <joint name="swing" axis="0 1 0" {swing}/><joint name="spin" axis="0 0 1" {spin}/>
    <geom type="capsule" size="0.01" fromto="0 0 0 0 0 -0.4" mass="2"/>
  </body></worldbody>
</mujoco>"""

FOUR_BAR = """<mujoco model="four_bar">
  <option timestep="0.0005"/>
  <default><joint axis="0 1 0" damping="0.1"/><geom type="capsule" size="0.01" mass="0.3"/></default>
  <worldbody>
    <body name="crank">
      <joint name="crank_hinge" stiffness="1.5" springref="40"/><geom fromto="0 0 0 0 0 0.1"/>
      <body name="coupler" pos="0 0 0.1">
        <joint name="coupler_hinge"/><geom fromto="0 0 0 0.3 0 0"/><site name="coupler_end" pos="0.3 0 0"/>
      </body>
    </body>
    <body name="rocker" pos="0.3 0 0">
      <joint name="rocker_hinge" range="-20 {stop}"/>
      <geom fromto="0 0 0 0 0 0.2"/><site name="rocker_end" pos="0 0 0.2"/>
    </body>
  </worldbody>
  <equality><connect name="pin" site1="coupler_end" site2="rocker_end"/></equality>
</mujoco>"""


def test_a_pendulum_hangs_down_and_its_spin_is_idle():
    chain = ClosedChain.from_mjcf(PENDULUM.format(swing="", spin=""))
    # Upright it is balanced, but falls.
    for start in (1.0, -2.0, np.pi):
        answer = chain.equilibrium([start, 0.7])
        assert abs(np.cos(answer.q[0]) - 1.0) <= 1e-12
        assert answer.q[1] == pytest.approx(0.7, abs=1e-6)
        assert answer.idle == ("spin",)
        assert answer.energy == pytest.approx(-2.0 * 9.81 * 0.2)
        assert answer.kkt <= 1e-12
        assert answer.cautions == ()
        assert "idle" in str(answer)
        np.testing.assert_allclose(answer.forces.tau, 0.0)


def test_a_pendulum_rests_on_its_stop_or_in_its_spring():
    stopped = ClosedChain.from_mjcf(PENDULUM.format(swing='range="30 90"', spin='range="-180 180"'))
    answer = stopped.equilibrium([1.0, 0.0])
    assert answer.q[0] == pytest.approx(np.pi / 6, abs=1e-12)
    assert answer.at_limits == ("swing",)
    torque = 2.0 * 9.81 * 0.2 * 0.5
    assert answer.forces.effort("swing")[0] == pytest.approx(torque)
    assert abs(stopped.equilibrium([1.0, 0.0], respect_limits=False).q[0]) <= 1e-12
    held = stopped.equilibrium([1.0, 0.0], hold=["swing"])
    assert held.q[0] == 1.0
    assert held.forces.effort("swing")[0] == pytest.approx(2.0 * 9.81 * 0.2 * np.sin(1.0))
    spring = ClosedChain.from_mjcf(PENDULUM.format(swing='stiffness="3" springref="60"', spin=""))
    angle = spring.equilibrium([0.1, 0.0]).q[0]
    assert 3.0 * (np.pi / 3 - angle) == pytest.approx(2.0 * 9.81 * 0.2 * np.sin(angle))


@pytest.mark.parametrize("stop", [60, 5])
def test_mujoco_settles_in_the_equilibrium(stop):
    text = FOUR_BAR.format(stop=stop)
    chain = ClosedChain.from_mjcf(text)
    q = chain.close(chain.reference_configuration(), respect_limits=True)
    answer = chain.equilibrium(q)
    assert answer.kkt <= 1e-10
    assert answer.at_limits == (("rocker_hinge",) if stop == 5 else ())
    model = mujoco.MjModel.from_xml_string(text)
    model.eq_solimp[:, :2] = 0.9999
    model.jnt_solimp[:, :2] = 0.9999
    state = mujoco.MjData(model)
    state.qpos[:] = q
    mujoco.mj_step(model, state, 15000)
    assert np.abs(state.qvel).max() < 1e-4
    np.testing.assert_allclose(state.qpos, answer.q, atol=2e-4)


def energy(chain, q):
    """Of weight and springs, from the bodies' centres and the joints' springs."""
    model, data = chain.model, chain.model.createData()
    pin.forwardKinematics(model, data, q)
    bodies = zip(list(model.inertias)[1:], list(data.oMi)[1:], strict=True)
    total = -sum(body.mass * model.gravity.linear @ place.act(body.lever) for body, place in bodies)
    for item in chain.description.joints:
        own, v = chain.configuration_slice(item.joint), chain.velocity_slice(item.joint)
        rest = pin.neutral(model)
        rest[own] = rest[own] if item.spring_reference is None else item.spring_reference
        total += 0.5 * item.stiffness * np.sum(pin.difference(model, rest, q)[v] ** 2)
    return float(total)


def least(name, starts):
    """The equilibrium is a minimum: SciPy finds the same energy, and none below it nearby."""
    case = moving(name)
    # Plane mechanisms lie flat: gravity has to pull in their plane, too.
    model = case.chain.model.copy()
    model.gravity.linear[:] = [3.0, 5.0, -8.0]
    chain = ClosedChain(model, case.chain.description)
    answer = chain.equilibrium(case.q)
    assert answer.kkt <= 1e-8
    assert answer.cautions == ()
    assert np.abs(chain.residual(answer.q)).max() <= 1e-12
    assert not chain.beyond_limits(answer.q)
    assert answer.energy == pytest.approx(energy(chain, answer.q), abs=1e-9)
    size = 1.0 + abs(answer.energy)
    found = least_by_scipy(chain, lambda at: energy(chain, at), answer.q, starts, spread=0.02)
    assert found == pytest.approx(answer.energy, abs=1e-7 * size)
    # What holds the joints is nothing but stops.
    forces = answer.forces
    assert set(np.flatnonzero(np.abs(forces.tau) > 1e-7 * size)) <= set(chain.velocity_indices(answer.at_limits))


@pytest.mark.parametrize("name", ["five-bar", "delta with rods", "universal loop", "heavy wrist"])
def test_equilibria_have_the_least_energy(name):
    least(name, 2)


@pytest.mark.full
@pytest.mark.parametrize("name", WITH_MASS)
def test_equilibria_have_the_least_energy_from_many_starts(name):
    least(name, 6)


def test_forces_count_against_the_weight_of_all_links_and_the_largest_spring():
    """A hinge and a slide; what is fixed to the world weighs on no joint."""
    model = pin.Model()
    hinge = model.addJoint(0, pin.JointModelRY(), pin.SE3.Identity(), "hinge")
    slide = model.addJoint(hinge, pin.JointModelPX(), pin.SE3(np.eye(3), np.array([0.25, 0.0, 0.0])), "slide")
    for joint, mass in ((0, 50.0), (hinge, 2.0), (slide, 3.0)):
        model.appendBodyToJoint(joint, pin.Inertia(mass, np.array([0.1, 0.0, 0.0]), np.eye(3)), pin.SE3.Identity())
    springs = (JointProperties("hinge", 1.5), JointProperties("slide", 40.0))
    chain = ClosedChain(model, Closures("two", joints=springs))
    energy, length = _Energy(chain._state), chain.characteristic_length
    assert length == pytest.approx(0.25)
    for q in (np.array([0.2, -0.1]), np.array([2.0, 0.01])):
        pull = max(1.5 * abs(q[0]), 40.0 * abs(q[1]) * length)
        assert energy.scale(q) == pytest.approx(5.0 * 9.81 * length + pull)
        # The gradient is that of the energy.
        steps = [energy.value(q + 1e-5 * unit) - energy.value(q - 1e-5 * unit) for unit in np.eye(2)]
        np.testing.assert_allclose(energy.gradient(q), np.array(steps) / 2e-5, atol=1e-8)
