"""Which changes with a self-stress are rounding: forces in N, moments over the characteristic length."""

import numpy as np
import pytest
from mechanisms import parallelogram, random_loop

from exo_pin.chain.dynamics.force_distribution import bounds_and_multipliers, objective_of

pytestmark = pytest.mark.usefixtures("plain")

WIDE = (-1e6, 1e6)


@pytest.fixture(params=["hinges", "slide"])
def stressed(request):
    """Forces of a loop whose joints are all actuated: chain, drive, forces."""
    named = parallelogram() if request.param == "hinges" else random_loop("spherical")
    chain = named.chain()
    joints = tuple(str(name) for name in chain.model.names[1:])
    return chain, chain._state.drive(joints), chain.inverse_dynamics(named.q, actuated=joints)


def edges(sizes):
    """Sharpnesses on both sides of each size."""
    return [share * size for size in sizes if size > 1e-6 for share in (0.999, 1.001)]


def bounded(stressed, sharpness, efforts=None, reactions=None):
    """The effect of each bound by its name."""
    _, drive, forces = stressed
    self_stress = forces._start, forces.self_stresses, sharpness
    bounds, _ = bounds_and_multipliers(
        forces._equations, (drive, drive), self_stress, (efforts, reactions), None, "reactions", None
    )
    return {bound.name: bound.effect for bound in bounds}


def test_efforts_change_by_no_less_than_the_sharpness(stressed):
    chain, _, forces = stressed
    joints = [str(name) for name in chain.model.names[1:]]
    change = -chain.constraint_jacobian(forces._equations.q).T @ forces.self_stresses
    unit = np.where(chain._state.topology.metres, 1.0, chain.characteristic_length)
    sizes = np.abs(change).max(axis=1) / unit
    for sharpness in edges(sizes):
        found = bounded(stressed, sharpness, efforts=dict.fromkeys(joints, WIDE))
        for joint in joints:
            (k,) = chain.velocity_indices([joint])
            expected = change[k] if sizes[k] > sharpness else 0.0 * change[k]
            np.testing.assert_allclose(found[f"effort of {joint}"], expected, atol=1e-12)


def test_reactions_change_by_no_less_than_the_sharpness(stressed):
    chain, _, forces = stressed
    part = str(chain.model.names[2])
    # The wrench is linear in the self-stress: half the difference of two multipliers.
    change = np.column_stack([
        0.5 * (wrench_of(forces, part, column) - wrench_of(forces, part, -column)) for column in forces.self_stresses.T
    ])  # fmt: skip
    unit = np.array([1.0] * 3 + [chain.characteristic_length] * 3)
    sizes = np.abs(change).max(axis=1) / unit
    names = [f"{name} of {part}" for name in ("F_x", "F_y", "F_z", "M_x", "M_y", "M_z")]
    for sharpness in edges(sizes):
        found = bounded(stressed, sharpness, reactions={part: WIDE})
        for k, name in enumerate(names):
            np.testing.assert_allclose(found[name], change[k] if sizes[k] > sharpness else 0.0, atol=1e-12)


def wrench_of(forces, part, more):
    """A joint's wrench in its own axes for multipliers that have a self-stress added."""
    wrenches = forces._equations.wrenches((forces.multipliers + more)[:, None])[:, 0]
    index = forces._equations.state.part(part).place
    R = forces._equations.poses[index + 1, :3]
    own = wrenches[6 * index : 6 * index + 6]
    return np.concatenate([R @ own[:3], R @ own[3:]])


def test_objectives_are_in_newton_and_leave_out_what_is_rounding(stressed):
    chain, drive, forces = stressed
    unit = np.where(chain._state.topology.metres, 1.0, 1.0 / chain.characteristic_length)
    effort = forces.tau + chain.constraint_jacobian(forces._equations.q).T @ (forces.multipliers - forces._start)
    slope = -chain.constraint_jacobian(forces._equations.q).T @ forces.self_stresses
    sizes = np.abs(slope * unit[:, None]).max(axis=1)
    self_stress = forces._start, forces.self_stresses
    for sharpness in edges(sizes):
        constant, effect = objective_of(
            forces._equations, drive.driven, (effort, slope), (*self_stress, sharpness), "efforts"
        )
        np.testing.assert_allclose(constant, unit * effort, atol=1e-12)
        np.testing.assert_allclose(effect[sizes <= sharpness], 0.0, atol=1e-12)
    part = str(chain.model.names[2])
    weights = np.array([1.0, 0.0, 2.0, 3.0, 4.0, 0.5])
    constant, effect = objective_of(
        forces._equations, drive.driven, (effort, slope), (*self_stress, 1e-12), {part: weights}
    )
    scale = (weights / np.array([1.0] * 3 + [chain.characteristic_length] * 3))[weights > 0.0]
    at_start = wrench_of(forces, part, forces._start - forces.multipliers)[weights > 0.0]
    np.testing.assert_allclose(constant, scale * at_start, atol=1e-12)
    z = np.arange(1.0, 1.0 + forces.undetermined)
    moved = wrench_of(forces, part, forces._start - forces.multipliers + forces.self_stresses @ z)[weights > 0.0]
    np.testing.assert_allclose(constant + effect @ z, scale * moved, atol=1e-11)


def test_the_metric_of_closures_is_their_forces_and_moments_over_the_characteristic_length():
    named = random_loop("rigid")
    chain = named.chain()
    forces = chain.inverse_dynamics(named.q, actuated=[str(name) for name in chain.model.names[1:]])
    columns = np.column_stack([forces._start, forces.self_stresses])
    found = forces._equations.metric(forces._start, forces.self_stresses, "closures")
    np.testing.assert_allclose(found[:3], columns[:3], rtol=1e-12)
    np.testing.assert_allclose(found[3:] * chain.characteristic_length, columns[3:], rtol=1e-12)
    assert np.abs(columns[3:]).max() > 1e-3
