"""Stops of joints in loops: impacts against the equations written out, and motions that a stop makes impossible."""

import numpy as np
import pinocchio as pin
import pytest

from exo_pin.chain import ClosedChain

#: A crank of 0.1 m, a rod of 0.3 m and a slider on the crank's line, which is at 0.4 m at the outer dead centre.
CRANK = """<mujoco model="slider_crank"><option gravity="0 0 0"/><compiler angle="radian"/>
  <default><geom type="capsule" size="0.01"/><joint axis="0 1 0"/></default>
  <worldbody>
    <body name="crank"><joint name="crank"/><geom fromto="0 0 0 0.1 0 0" mass="0.5"/>
      <body name="rod" pos="0.1 0 0"><joint name="rod"/><geom fromto="0 0 0 0.3 0 0" mass="0.3"/>
        <site name="rod_end" pos="0.3 0 0"/></body></body>
    <body name="slider" pos="0.4 0 0"><joint name="slider" type="slide" axis="1 0 0" range="{range}"/>
      <geom fromto="-0.02 0 0 0.02 0 0" mass="0.8"/><site name="pin"/></body>
  </worldbody><equality><connect name="loop" site1="rod_end" site2="pin"/></equality></mujoco>"""
#: A five-bar linkage of two freedoms, whose tip joint has a stop.
FIVE_BAR = """<mujoco model="five_bar"><option gravity="0 0 -9.81"/><compiler angle="radian"/>
  <default><geom type="capsule" size="0.01" mass="0.3"/><joint axis="0 1 0"/></default>
  <worldbody>
    <body name="left"><joint name="left"/><geom fromto="0 0 0 0 0 0.2"/>
      <body name="left_rod" pos="0 0 0.2"><joint name="left_rod" range="-3 0.1"/><geom fromto="0 0 0 0.15 0 0.2"/>
        <site name="left_tip" pos="0.15 0 0.2"/></body></body>
    <body name="right" pos="0.3 0 0"><joint name="right"/><geom fromto="0 0 0 0 0 0.2"/>
      <body name="right_rod" pos="0 0 0.2"><joint name="right_rod"/><geom fromto="0 0 0 -0.15 0 0.2"/>
        <site name="right_tip" pos="-0.15 0 0.2"/></body></body>
  </worldbody><equality><connect name="tip" site1="left_tip" site2="right_tip"/></equality></mujoco>"""


def crank_at(chain, angle, speed):
    """A state with the crank at an angle, turning at a speed."""
    start = chain.neutral()
    start[chain.configuration_slice("crank")] = angle
    q = chain.close(start, hold=["crank"])
    others = [name for name in chain.model.names if name == "other"]
    v = chain.dependent_motion(q, ["crank", *others], [speed] + [0.0] * len(others))[0]
    return q, v


def mass_matrix(chain, q):
    upper = np.triu(pin.crba(chain.model, chain.model.createData(), q))
    return upper + np.triu(upper, 1).T


def after_impact(chain, q, v, joint, restitution):
    """Velocity after an impact in one joint: M (v⁺ - v) = Jᵀ λ + e f, J v⁺ = 0, v⁺_joint = -e v_joint."""
    nv, M = chain.model.nv, mass_matrix(chain, q)
    rows = np.vstack([chain.constraint_jacobian(q), np.eye(nv)[chain.velocity_slice(joint)]])
    target = np.zeros(len(rows))
    target[-1] = -restitution * v[chain.velocity_slice(joint)][0]
    KKT = np.block([[M, -rows.T], [rows, np.zeros((len(rows), len(rows)))]])
    # The loop is plane: its row across the plane is redundant.
    return np.linalg.lstsq(KKT, np.concatenate([M @ v, target]), rcond=None)[0][:nv]


@pytest.mark.parametrize("restitution", [0.0, 0.4, 1.0])
def test_an_impact_in_a_loop_of_one_freedom_reverses_all_joints(restitution):
    """The slider hits its stop from inside: v⁺ = -e v of every joint, and (1 - e²) of the kinetic energy is lost."""
    chain = ClosedChain.from_mjcf(CRANK.format(range="-0.05 1"))
    q, v = crank_at(chain, 0.3, 2.0)
    found = chain.simulate(q, v, np.linspace(0.0, 1.0, 11), stops=True, restitution=restitution)
    hit = next(event for event in found.events if event.kind == "impact")
    assert hit.joints == ("slider",)
    around = chain.simulate(q, v, [0.0, hit.time - 1e-7, hit.time + 1e-7], stops=True, restitution=restitution)
    before, after = around.v[1:]
    assert around.q[1, chain.configuration_slice("slider")][0] == pytest.approx(-0.05, abs=1e-6)
    np.testing.assert_allclose(after, -restitution * before, atol=2e-5)
    kinetic = 0.5 * before @ mass_matrix(chain, around.q[1]) @ before
    assert around.dissipated[-1] == pytest.approx((1.0 - restitution**2) * kinetic, rel=1e-5, abs=1e-8)
    assert found.energy_drift <= 1e-7


@pytest.mark.parametrize("restitution", [0.0, 0.6])
def test_an_impact_in_a_loop_of_two_freedoms_is_that_of_the_equations(restitution):
    """The other freedom goes on: the jump of all velocities, with the loop's impulses written out."""
    chain = ClosedChain.from_mjcf(FIVE_BAR)
    q = chain.close(chain.neutral())
    v = chain.project_velocity(q, np.array([1.0, 1.5, -0.5, 0.2]))
    found = chain.simulate(q, v, np.linspace(0.0, 0.5, 6), stops=True, restitution=restitution)
    hit = next(event for event in found.events if event.kind == "impact")
    assert hit.joints == ("left_rod",)
    around = chain.simulate(q, v, [0.0, hit.time - 1e-8, hit.time + 1e-8], stops=True, restitution=restitution)
    expected = after_impact(chain, around.q[1], around.v[1], "left_rod", restitution)
    np.testing.assert_allclose(around.v[2], expected, atol=1e-5)
    assert np.abs(around.v[2]).max() > 0.1
    assert np.abs(chain.constraint_jacobian(around.q[2]) @ around.v[2]).max() <= 1e-9
    lost = [0.5 * u @ mass_matrix(chain, p) @ u for p, u in zip(around.q[1:], around.v[1:], strict=True)]
    assert around.dissipated[-1] == pytest.approx(lost[0] - lost[1], rel=1e-5, abs=1e-7)
    assert found.energy_drift <= 1e-7
