import numpy as np
import pinocchio as pin
import pytest
from moving_chains import ALL, WITH_MASS, drivers, moving
from tree_forces import tree_forces

from exo_pin import InvalidInput, MasslessMotion
from exo_pin.chain import ClosedChain, Closures


def pushed(name, seed=5):
    """A chain with random efforts in all joints and a wrench on one body."""
    case = moving(name, seed)
    rng = np.random.default_rng(seed)
    return case, rng.normal(size=case.chain.model.nv), {case.chain.closures[0].frame_a: rng.normal(size=6)}


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("seed", range(3))
def test_inverse_after_forward_dynamics_is_the_identity(name, seed):
    # Efforts in the drivers alone, for what others gave would be no answer of inverse dynamics.
    case, tau, external = pushed(name, seed)
    driven = case.chain.velocity_indices(drivers(case))
    efforts = np.zeros_like(tau)
    efforts[driven] = tau[driven]
    motion = case.chain.forward_dynamics(case.q, case.v, efforts, external=external)
    back = case.chain.inverse_dynamics(case.q, case.v, motion.a, external=external, actuated=drivers(case))
    size = np.abs(back.tau).max() + np.abs(tree_forces(case.chain, case.q, case.v, motion.a).tau).max()
    if back.effort_is_unique.all():
        np.testing.assert_allclose(back.tau, efforts, atol=1e-10 * size)
    # And forward again, which holds for redundant drives too.
    again = case.chain.forward_dynamics(case.q, case.v, back.tau, external=external)
    np.testing.assert_allclose(again.a, motion.a, atol=1e-9 * (1 + np.abs(motion.a).max()))


def test_forces_of_an_acceleration_that_no_caller_could_state():
    model = pin.Model()
    model.addJoint(0, pin.JointModelPX(), pin.SE3.Identity(), "slide")
    model.appendBodyToJoint(1, pin.Inertia(1e-12, np.zeros(3), 1e-14 * np.eye(3)), pin.SE3.Identity())
    motion = ClosedChain(model, Closures("light")).forward_dynamics([0.0], tau={"slide": [10.0]})
    np.testing.assert_allclose([motion.a[0], motion.forces.joint_reaction("slide").force[0]], [1e13, 10.0], rtol=1e-12)
    np.testing.assert_allclose(motion.forces.tau, [10.0])


@pytest.mark.parametrize("name", [name for name, make in WITH_MASS.items() if "wrist" not in name])
def test_own_solution_equals_pinocchios_where_both_apply(name):
    case, tau, external = pushed(name)
    chain = case.chain
    found = chain.forward_dynamics(case.q, case.v, tau, external=external).a
    if not all(closure.type in ("rigid", "spherical") for closure in chain.closures):
        with pytest.raises(InvalidInput, match="Pinocchio has no constraint"):
            _ = chain.constraint_models
        return
    model, data = chain.model, chain.model.createData()
    models, datas = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
    for constraint in chain.constraint_models:
        models.append(constraint)
        datas.append(constraint.createData())
    pin.initConstraintDynamics(model, data, models, datas)
    push = tree_forces(chain, case.q, case.v, found).tau - tree_forces(chain, case.q, case.v, found, None, external).tau
    settings = pin.ProximalSettings(1e-14, 1e-10, 40)
    expected = pin.constraintDynamics(model, data, case.q, case.v, tau + push, models, datas, settings)
    np.testing.assert_allclose(found, expected, atol=1e-9 * (1 + np.abs(found).max()))


def saddle_point(chain, q, v, tau):
    """Acceleration by the equations of motion and of the loops at once, in the least squares."""
    model, J = chain.model, chain.constraint_jacobian(q)
    data = model.createData()
    upper = np.triu(pin.crba(model, data, q))
    M = upper + np.triu(upper, 1).T
    zero = np.zeros((len(J), len(J)))
    right = np.concatenate([tau - pin.rnea(model, data, q, v, np.zeros(model.nv)), -chain.constraint_drift(q, v)])
    return np.linalg.lstsq(np.block([[M, J.T], [J, zero]]), right, rcond=1e-12)[0][: model.nv]


@pytest.mark.parametrize("name", ["four-bar", "five-bar", "3RRR", "delta with rods", "delta with rigid closures"])
def test_a_link_without_mass_is_the_limit_of_light_ones(name):
    case = moving(name)
    tau = np.random.default_rng(4).normal(size=case.chain.model.nv)
    for joint in range(1, case.chain.model.njoints):
        model = case.chain.model.copy()
        own = model.inertias[joint]

        def weighing(share, model=model, joint=joint, own=own):
            model.inertias[joint] = pin.Inertia(share * own.mass, own.lever, share * np.array(own.inertia))
            return ClosedChain(model.copy(), case.chain.description)

        light = weighing(0.0)
        try:
            found = light.forward_dynamics(case.q, case.v, tau)
        except MasslessMotion:
            continue
        size = np.abs(found.a).max()
        np.testing.assert_allclose(found.a, saddle_point(light, case.q, case.v, tau), atol=1e-8 * size)
        # The difference is of first order in the mass.
        errors = [
            np.abs(weighing(share).forward_dynamics(case.q, case.v, tau).a - found.a).max() / size
            for share in (2e-6, 1e-6)
        ]
        assert errors[1] < 1e-3
        assert errors[0] < 1e-9 or abs(errors[0] / errors[1] - 2.0) < 0.05
