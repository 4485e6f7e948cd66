import re

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import four_bar, parallelogram, random_loop
from moving_chains import ALL, WITH_MASS, drivers, moving
from tree_forces import tree_forces

from exo_pin import InvalidInput, MasslessMotion, SingularConfiguration, UnknownName
from exo_pin.chain import ClosedChain, Closure, Closures
from exo_pin.design import Limb, preset
from exo_pin.wrist_chain import mechanism_urdf


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


@pytest.mark.parametrize("name", ALL)
def test_acceleration_and_multipliers_satisfy_newton_and_the_loops(name):
    case, tau, external = pushed(name)
    motion = case.chain.forward_dynamics(case.q, case.v, tau, external=external)
    J = case.chain.constraint_jacobian(case.q)
    size = np.abs(motion.a).max()
    np.testing.assert_allclose(J @ motion.a, -case.chain.constraint_drift(case.q, case.v), atol=1e-11 * (1 + size))
    assert motion.residual <= 1e-11 * (1 + size)
    forces = motion.forces
    # RNEA with the closures' wrenches asks for just the efforts that were given.
    asked = tree_forces(case.chain, case.q, case.v, motion.a, forces.multipliers, external).tau
    np.testing.assert_allclose(asked, tau, atol=1e-10 * (1 + np.abs(forces.multipliers).max()))
    np.testing.assert_allclose(forces.tau, tau, atol=1e-10 * (1 + np.abs(forces.multipliers).max()))


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


def test_a_rigid_closure_in_place_of_any_type_moves_alike():
    # A revolute closure is a hinge of the tree with a rigid closure behind it.
    named = random_loop("revolute")
    chain = named.chain()
    q = chain.close(named.q)
    closure = chain.closures[0]
    extra = named.urdf.replace(
        "</robot>",
        '<link name="pin"/><joint name="pin_hinge" type="revolute"><parent link="left_3"/><child link="pin"/>'
        f'<origin xyz="{" ".join(map(repr, closure.placement_a.translation))}" '
        f'rpy="{" ".join(map(repr, pin.rpy.matrixToRpy(_rotation(closure.placement_a)).tolist()))}"/>'
        f'<axis xyz="{" ".join(map(repr, closure.axis))}"/>'
        '<limit effort="0" velocity="9" lower="-3" upper="3"/></joint></robot>',
    )
    rigid = Closure("loop", "rigid", "pin", "right_2", placement_b=closure.placement_b)
    other = ClosedChain.from_urdf(extra, Closures("other", closures=(rigid,)))
    same = [other.velocity_slice(name).start for name in list(chain.model.names)[1:]]
    start = other.neutral()
    start[same] = q
    there = other.close(start, hold=list(chain.model.names)[1:])
    rng = np.random.default_rng(0)
    v = chain.project_velocity(q, rng.normal(size=chain.model.nv))
    tau = rng.normal(size=chain.model.nv)
    wide, push = np.zeros(other.model.nv), np.zeros(other.model.nv)
    wide[same], push[same] = v, tau
    turning = other.constraint_jacobian(there)[:, other.velocity_slice("pin_hinge")]
    wide[other.velocity_slice("pin_hinge")] = -np.linalg.lstsq(turning, other.constraint_jacobian(there) @ wide)[0]
    # The pin has no mass.
    motion = other.forward_dynamics(there, wide, push)
    np.testing.assert_allclose(motion.a[same], chain.forward_dynamics(q, v, tau).a, rtol=1e-9, atol=1e-9)


def _rotation(placement):
    return pin.Quaternion(np.array(placement.quaternion)).toRotationMatrix()


def test_massless_limbs_are_no_obstacle_as_long_as_every_motion_moves_mass():
    case = moving("prototype")
    motion = case.chain.forward_dynamics(case.q, case.v)
    # The arm on its ball joint, no effort in the limbs: Euler's equation with the weight's moment.
    arm = preset("prototype").arm
    R = case.chain.placement(case.q, "arm").rotation
    omega, turning = case.v[:3], motion.a[:3]
    inertia = arm.inertia + arm.mass * (
        arm.centre_of_mass @ arm.centre_of_mass * np.eye(3) - np.outer(arm.centre_of_mass, arm.centre_of_mass)
    )
    weight = np.cross(arm.centre_of_mass, R.T @ (arm.mass * case.chain.model.gravity.linear))
    np.testing.assert_allclose(inertia @ turning + np.cross(omega, inertia @ omega), weight, atol=1e-10)


def test_a_motion_without_mass_is_refused_with_the_joints_that_move_in_it():
    # Bare SPS limbs may spin about themselves, and their links have no mass.
    mechanism = preset("prototype").replace(limbs=(Limb("SPS"),) * 3)
    urdf, closures = mechanism_urdf(mechanism, part="whole")
    chain = ClosedChain.from_urdf(urdf, closures)
    q = chain.close(chain.neutral())
    named = four_bar()
    light = named.urdf.replace('<mass value="1.0"', '<mass value="0.0"')
    light = re.sub(r'(i[xyz]{2})="[^"]*"', r'\1="0"', light)
    bare = ClosedChain.from_urdf(light, named.closures)
    with pytest.raises(MasslessMotion, match=r"crank_hinge|rocker_hinge|coupler_hinge") as caught:
        bare.forward_dynamics(named.q)
    assert "mass" in str(caught.value)
    assert np.isfinite(chain.forward_dynamics(q).a).all()


def test_redundant_closures_leave_the_acceleration_as_it_is():
    case = moving("five-bar")
    twice = ClosedChain(
        case.chain.model,
        Closures(
            "twice", closures=(case.chain.closures[0], Closure(**{**vars(case.chain.closures[0]), "name": "again"}))
        ),
    )
    tau = np.random.default_rng(0).normal(size=4)
    one = case.chain.forward_dynamics(case.q, case.v, tau)
    two = twice.forward_dynamics(case.q, case.v, tau)
    np.testing.assert_allclose(two.a, one.a, rtol=1e-9)
    # Half of the force in either: least norm.
    halves = two.forces.multipliers.reshape(2, 3)
    np.testing.assert_allclose(halves[0], halves[1], atol=1e-9)
    # Across the plane they are undetermined, and share with the hinges.
    np.testing.assert_allclose(halves.sum(axis=0)[:2], one.forces.multipliers[:2], atol=1e-9)


def test_efforts_by_joint():
    case = moving("Stewart platform")
    tau = np.zeros(case.chain.model.nv)
    tau[case.chain.velocity_slice("slide_3")] = 4.0
    tau[case.chain.velocity_slice("flight")] = np.arange(6)
    by_name = case.chain.forward_dynamics(case.q, case.v, {"slide_3": 4.0, "flight": np.arange(6)})
    np.testing.assert_array_equal(by_name.a, case.chain.forward_dynamics(case.q, case.v, tau).a)


def test_forces_are_those_of_the_time_of_the_motion():
    case, tau, external = pushed("five-bar")
    chain, q, v = case.chain, case.q.copy(), case.v.copy()
    expected = chain.forward_dynamics(q, v, tau, external=external).forces
    motion = chain.forward_dynamics(q, v, tau, external=external)
    for array in (q, v, tau, *external.values()):
        array[:] = 0.0
    before = chain.model.gravity.linear.copy()
    chain.model.gravity.linear = np.zeros(3)
    forces = motion.forces
    chain.model.gravity.linear = before
    np.testing.assert_array_equal(forces.multipliers, expected.multipliers)
    np.testing.assert_array_equal(forces.tau, expected.tau)
    np.testing.assert_array_equal(forces.wrench_on("universe").wrench, expected.wrench_on("universe").wrench)


def test_a_regular_chain_needs_no_singular_values(monkeypatch):
    # They cost more than all the rest, and LAPACK may start threads for them.
    case, tau, _ = pushed("five-bar")
    expected = case.chain.forward_dynamics(case.q, case.v, tau).a
    for name in ("svd", "eigvalsh", "eigh", "lstsq"):
        monkeypatch.setattr(np.linalg, name, lambda *_, **__: pytest.fail("a decomposition"))
    np.testing.assert_array_equal(case.chain.forward_dynamics(case.q, case.v, tau).a, expected)


def test_bad_input_is_refused():
    case = moving("five-bar")
    chain, q, v = case.chain, case.q, case.v
    for call in (
        lambda: chain.forward_dynamics(q, np.ones(4)),
        lambda: chain.forward_dynamics(q, v, np.ones(3)),
        lambda: chain.forward_dynamics(q, v, np.full(4, np.nan)),
        lambda: chain.forward_dynamics(q, v, {"left_crank_hinge": [1.0, 2.0]}),
        lambda: chain.forward_dynamics(q, v, {"left_crank_hinge": np.inf}),
    ):
        with pytest.raises(InvalidInput):
            call()
    for call in (
        lambda: chain.forward_dynamics(q, v, {"knee": 1.0}),
        lambda: chain.forward_dynamics(q, v, external={"knee": np.zeros(6)}),
    ):
        with pytest.raises(UnknownName):
            call()


def test_a_velocity_without_an_acceleration_is_reported():
    # All cranks along the bar: the bar may rise and tilt to first order, but not both go on.
    named = parallelogram(0.0)
    chain = named.chain()
    ways = np.linalg.svd(chain.constraint_jacobian(named.q))[2][2:]
    assert np.abs(chain.constraint_jacobian(named.q) @ ways.T).max() <= 1e-12
    for v in (ways[0] + ways[1], ways[0] - ways[1]):
        with pytest.raises(SingularConfiguration) as caught:
            chain.forward_dynamics(named.q, v)
        assert caught.value.opening > 1e-3
    assert np.isfinite(chain.forward_dynamics(named.q).a).all()


def test_unknown_names_and_masked_numbers_are_refused():
    case = moving("five-bar")
    with pytest.raises(InvalidInput, match="names of joints"):
        case.chain.inverse_dynamics(case.q, actuated=3)
    with pytest.raises(InvalidInput, match="names of joints"):
        case.chain.inverse_dynamics_derivatives(case.q, independent=3)
    with pytest.raises(InvalidInput):
        case.chain.forward_dynamics(case.q, np.ma.masked_array(case.v, mask=[True, False, False, False]))


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
