"""Dynamics of chains with couplings against MuJoCo's joint equalities, and energy."""

import numpy as np
import pytest
from geared_arms import arm, geared
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import DiscreteContactApproximation, MultibodyPlant
from pydrake.systems.analysis import Simulator

from exo_pin.chain import ClosedChain, Closures


def moving(seed):
    urdf, closures = geared(seed)
    chain = ClosedChain.from_urdf(urdf, closures)
    rng = np.random.default_rng(seed)
    q = chain.close(rng.uniform(-0.5, 0.5, chain.model.nv))
    return urdf, closures, chain, q, chain.project_velocity(q, rng.normal(size=chain.model.nv)), rng


@pytest.mark.parametrize("seed", range(2))
def test_energy_is_conserved(seed):
    _, _, chain, q, v, _ = moving(seed)
    found = chain.simulate(q, 0.3 * v, np.linspace(0.0, 0.5, 6))
    size = max(1.0, np.abs(found.energy).max(), found.kinetic_energy.max())
    np.testing.assert_allclose(found.energy, found.energy[0], rtol=0, atol=1e-7 * size)
    assert found.opening.max() < 1e-10


def test_a_mimic_joint_of_a_urdf_is_drakes():
    mimic = '<mimic joint="joint_0" multiplier="-1.5" offset="0.2"/></joint>'
    parts = arm(3).split("</joint>")
    urdf = "</joint>".join(parts[:2]) + "</joint>" + parts[2] + mimic + "</joint>".join(parts[3:])
    chain = ClosedChain.from_urdf(urdf, Closures("mimicking"))
    (coupling,) = chain.closures
    assert (coupling.name, coupling.frame_a, coupling.frame_b) == ("joint_2_mimic", "joint_0", "joint_2")
    assert coupling.polynomial == (0.2, -1.5)
    step, end = 1e-4, 0.1
    plant = MultibodyPlant(step)
    plant.set_discrete_contact_approximation(DiscreteContactApproximation.kSap)
    Parser(plant).AddModelsFromString(urdf, "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("ground"))
    plant.Finalize()
    assert plant.num_constraints() == 1
    q = chain.close(chain.neutral(), hold=["joint_0"])
    simulator = Simulator(plant)
    context = simulator.get_mutable_context()
    plant.SetPositions(context, q)
    simulator.AdvanceTo(end)
    # Drake's constraint is a stiff spring and its step of first order: both errors are of the order of the step.
    theirs = plant.GetPositions(context)
    assert np.abs(chain.residual(theirs)).max() < 1e-4
    ours = chain.simulate(q, np.zeros(5), [0.0, end])
    assert np.abs(ours.q[-1] - q).max() > 0.02
    np.testing.assert_allclose(theirs, ours.q[-1], atol=50 * step * np.abs(ours.q[-1] - q).max())
