"""Motion with dry friction, stops and events: closed forms, MuJoCo and Drake with stiff constraints, energy."""

import mujoco
import numpy as np
import pytest
from moving_chains import moving
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import DiscreteContactApproximation, MultibodyPlant
from pydrake.systems.analysis import Simulator
from rubbing_chains import slide, with_friction

from exo_pin.chain import ClosedChain, Closures, JointProperties

DOWN = np.array([0.0, -9.81, 0.0])


def kinds(simulation):
    return [event.kind for event in simulation.events]


def test_a_block_slides_up_an_incline_stops_and_stays_or_slides_back():
    angle, mass, speed = 0.3, 2.0, 1.5
    pull = mass * 9.81 * np.sin(angle)
    up = (1.0 + 1.2) * pull / mass
    stays = slide(angle, 1.2 * pull).simulate([0.0], [speed], [0.0, 1.0, 5.0])
    np.testing.assert_allclose(stays.q[1:, 0], speed**2 / (2 * up), rtol=1e-9)
    np.testing.assert_array_equal(stays.v[1:], 0.0)
    assert kinds(stays) == ["stick"]
    assert stays.events[0].time == pytest.approx(speed / up)
    assert stays.dissipated[-1] == pytest.approx(1.2 * pull * speed**2 / (2 * up))
    up = (1.0 + 0.5) * pull / mass
    back = slide(angle, 0.5 * pull).simulate([0.0], [speed], [0.0, 1.0])
    turn, top = speed / up, speed**2 / (2 * up)
    np.testing.assert_allclose(back.q[-1, 0], top - 0.25 * pull / mass * (1.0 - turn) ** 2, rtol=1e-8)
    assert kinds(back) == ["reversed"]


def test_the_amplitude_of_a_spring_with_dry_friction_falls_linearly():
    stiffness, friction, mass, start = 50.0, 1.0, 2.0, 0.21
    free = slide(0.0, friction, mass)
    chain = ClosedChain(free.model, Closures("slide", joints=(JointProperties("slide", stiffness),)))
    half = np.pi * np.sqrt(mass / stiffness)
    swing = chain.simulate([start], [0.0], half * np.arange(8))
    # Each half swing ends 2 μ / k nearer; it sticks where k |x| < μ: after 0.21, -0.17, 0.13, -0.09, 0.05, -0.01.
    expected = [0.21, -0.17, 0.13, -0.09, 0.05, -0.01, -0.01, -0.01]
    np.testing.assert_allclose(swing.q[:, 0], expected, atol=1e-8)
    assert kinds(swing) == ["reversed"] * 4 + ["stick"]
    assert swing.dissipated[-1] == pytest.approx(friction * (0.38 + 0.3 + 0.22 + 0.14 + 0.06))
    assert np.abs(swing.energy + swing.dissipated - swing.energy[0]).max() <= 1e-8


def test_a_loop_with_redundant_friction_slips_where_no_friction_can_hold_it():
    case = moving("four-bar")
    case.chain.model.gravity.linear = DOWN
    chain = with_friction(case.chain, [0.5, 0.3, 0.8])
    low, high = chain.inverse_dynamics(case.q).effort_interval("crank_hinge")[0]

    def ramp(t, q, v):
        return {"crank_hinge": low + (high - low) * (0.5 + t)}

    moved = chain.simulate(case.q, 0.0 * case.v, [0.0, 0.4, 0.6], ramp)
    assert kinds(moved)[0] == "slip"
    assert moved.events[0].time == pytest.approx(0.5, abs=1e-7)
    assert set(moved.events[0].joints) == {"crank_hinge", "coupler_hinge", "rocker_hinge"}
    np.testing.assert_allclose(moved.q[1], case.q, atol=1e-12)
    assert np.abs(moved.v[2]).max() > 1e-3


@pytest.mark.full
@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.9, 1.0])
def test_a_falling_block_bounces_on_its_stop(restitution):
    chain = slide(np.pi / 2, limits=(0.0, np.inf))
    height = 0.4
    first = np.sqrt(2 * height / 9.81)
    hit = 9.81 * first
    # The bounces last e 2 hit / g, e² 2 hit / g, ...
    rest = first + (2 * hit / 9.81 * restitution / (1 - restitution) if restitution < 1.0 else np.inf)
    end = 1.2 * rest if restitution < 1.0 else 3.0
    moved = chain.simulate([height], [0.0], np.linspace(0, end, 31), stops=True, restitution=restitution)
    impacts = [event.time for event in moved.events if event.kind == "impact"]
    assert impacts[0] == pytest.approx(first, abs=1e-8)
    if len(impacts) > 1:
        assert impacts[1] - impacts[0] == pytest.approx(restitution * 2 * hit / 9.81, abs=1e-7)
    assert moved.q.min() >= -1e-8
    if restitution < 1.0:
        assert moved.q[-1, 0] == pytest.approx(0.0, abs=1e-8)
        assert moved.dissipated[-1] == pytest.approx(2.0 * 9.81 * height)
        reached = next(event for event in moved.events if event.kind == "stop reached")
        assert reached.time == pytest.approx(rest, abs=1e-4)
    else:
        assert abs(moved.dissipated[-1]) <= 1e-7
        assert len(impacts) >= 4


@pytest.mark.parametrize("name", ["four-bar", pytest.param("five-bar", marks=pytest.mark.full)])
def test_energy_never_grows_and_all_of_it_is_accounted_for(name):
    case = moving(name)
    nv = case.chain.model.nv
    case.chain.model.gravity.linear = DOWN
    case.chain.model.lowerPositionLimit = case.q - 1.0
    case.chain.model.upperPositionLimit = case.q + 1.0
    chain = with_friction(case.chain, np.linspace(0.05, 0.3, nv))
    for restitution in (0.0, 0.6):
        swing = chain.simulate(case.q, 2 * case.v, np.linspace(0, 3, 61), stops=True, restitution=restitution)
        assert "impact" in kinds(swing)
        assert "stick" in kinds(swing)
        assert np.diff(swing.energy).max() <= 1e-8
        assert np.diff(swing.dissipated).min() >= -1e-9
        assert swing.energy_drift <= 1e-7
        assert swing.opening.max() <= 1e-12
        assert np.abs(swing.q - case.q).max() <= 1.0 + 1e-7
        assert swing.dissipated[-1] > 0.1


@pytest.mark.parametrize("what", ["friction", "stops"])
def test_mujoco_with_stiff_constraints_moves_alike(what, tmp_path):
    """MuJoCo's friction and limits are soft; the difference shrinks as they become stiff and steps short."""
    case = moving("four-bar")
    case.chain.model.gravity.linear = DOWN
    friction = np.array([0.4, 0.1, 0.6]) if what == "friction" else np.zeros(3)
    model = case.chain.model
    if what == "stops":
        model.lowerPositionLimit = case.q - np.array([0.5, 6.0, 6.0])
        model.upperPositionLimit = case.q + np.array([1.0, 6.0, 6.0])
    chain = with_friction(case.chain, friction)
    times = np.linspace(0.0, 0.6, 13)
    own = chain.simulate(case.q, 0.0 * case.v, times, stops=what == "stops")
    assert ("impact" if what == "stops" else "reversed") in kinds(own)
    errors = []
    for step in (1e-4, 2.5e-5):
        theirs = mujoco.MjModel.from_xml_path(str(chain.to_mjcf(tmp_path, case.q)))
        theirs.opt.timestep = step
        theirs.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
        theirs.opt.tolerance, theirs.opt.iterations = 1e-14, 200
        theirs.dof_solref[:], theirs.dof_solimp[:] = (2 * step, 1.0), (0.9999, 0.9999, 1e-3, 0.5, 2)
        # Overdamped: at the critical damping MuJoCo's limits throw the crank back by 6e-3 at any stiffness.
        theirs.jnt_solref[:], theirs.jnt_solimp[:] = (2 * step, 20.0), (0.9999, 0.9999, 1e-3, 0.5, 2)
        theirs.eq_solref[:], theirs.eq_solimp[:] = (2 * step, 1.0), (0.9999, 0.9999, 1e-3, 0.5, 2)
        data = mujoco.MjData(theirs)
        order = [theirs.joint(name).qposadr[0] for name in list(model.names)[1:]]
        data.qpos[order] = case.q
        found = [np.array(data.qpos[order])]
        for _ in times[1:]:
            for _ in range(round(0.05 / step)):
                mujoco.mj_step(theirs, data)
            found.append(np.array(data.qpos[order]))
        errors.append(np.abs(np.array(found) - own.q).max())
    assert errors[1] <= 2e-4
    assert errors[1] <= 0.5 * errors[0], errors


#: A four-bar whose rocker has stops; Drake reads it as a URDF, with the loop as a ball.
STOPPED = """<mujoco model="four_bar"><compiler angle="radian"/>
  <default><joint axis="0 1 0"/><geom type="capsule" size="0.01" mass="0.2"/></default>
  <worldbody>
    <body name="crank"><joint name="crank"/><geom fromto="0 0 0 0 0 0.1"/>
      <body name="coupler" pos="0 0 0.1"><joint name="coupler"/><geom fromto="0 0 0 0.3 0 0"/>
        <site name="coupler_end" pos="0.3 0 0"/></body></body>
    <body name="rocker" pos="0.3 0 0"><joint name="rocker" range="-0.35 0.55"/><geom fromto="0 0 0 0 0 0.2"/>
      <site name="rocker_end" pos="0 0 0.2"/></body>
  </worldbody><equality><connect name="pin" site1="coupler_end" site2="rocker_end"/></equality></mujoco>"""


@pytest.mark.parametrize(("torque", "hit"), [(0.2, 0.2523), (-0.2, 0.1003)])
def test_drakes_sap_solver_moves_alike_at_a_stop(torque, hit, tmp_path):
    """The rocker hits its stop and stays: Drake's discrete plant, to first order of its step.

    SAP solves the loop and the joint limits as stiff constraints, implicitly, so that its impacts are inelastic and
    their errors vanish with the step. Drake's plants have no dry friction in joints (they do not read it) and no
    restitution at joint limits: those are compared with MuJoCo, with closed forms, and by a complementarity program.
    """
    chain = ClosedChain.from_mjcf(STOPPED)
    q, times = chain.close(chain.neutral()), np.linspace(0.0, 0.4, 21)
    own = chain.simulate(q, np.zeros(3), times, {"crank": torque}, stops=True)
    impact = next(event for event in own.events if event.kind == "impact")
    assert impact.time == pytest.approx(hit, abs=1e-4)
    found, errors = {}, {}
    for step in (1e-3, 5e-4):
        plant = MultibodyPlant(step)
        plant.set_discrete_contact_approximation(DiscreteContactApproximation.kSap)
        Parser(plant).AddModels(str(chain.to_urdf(tmp_path)))
        bodies = [plant.GetBodyByName(name) for name in ("coupler", "rocker")]
        plant.AddBallConstraint(bodies[0], [0.3, 0.0, 0.0], bodies[1], [0.0, 0.0, 0.2])
        plant.AddJointActuator("motor", plant.GetJointByName("crank"))
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("ground"))
        plant.Finalize()
        simulator = Simulator(plant)
        context = simulator.get_mutable_context()
        order = [plant.GetJointByName(name).position_start() for name in ("crank", "coupler", "rocker")]
        start = np.empty(3)
        start[order] = q
        plant.SetPositions(context, start)
        plant.get_actuation_input_port().FixValue(context, [torque])
        states = []
        for time in times:
            simulator.AdvanceTo(time)
            states.append(plant.GetPositions(context)[order])
        found[step], errors[step] = np.array(states), np.abs(np.array(states) - own.q).max()
    assert errors[5e-4] <= 0.6 * errors[1e-3] <= 0.01
    # The error of first order removed; in the steps about the impact it has no single size.
    away = np.abs(times - impact.time) > 0.01
    better = 2.0 * found[5e-4] - found[1e-3]
    np.testing.assert_allclose(better[away], own.q[away], rtol=0, atol=1e-3)
    assert own.q[-1, 2] == pytest.approx(-0.35, abs=1e-9)
    assert found[5e-4][-1, 2] == pytest.approx(-0.35, abs=1e-6)
