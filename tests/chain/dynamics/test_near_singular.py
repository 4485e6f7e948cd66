"""Next to a singular configuration forces and accelerations are refused, not computed from rounding."""

import numpy as np
import pytest
from mechanisms import random_loop

from exo_pin import NearSingularConfiguration
from exo_pin.chain import ClosedChain
from exo_pin.chain.dynamics.equations.equations_of_motion import CERTAIN, refuse_near_singular
from exo_pin.chain.kinematics.rank import RESOLVED

#: A parallelogram of cranks 0.3 m long, folded flat at zero.
FLAT = """<mujoco><worldbody>
<body name="a"><joint name="j" axis="0 1 0"/><geom size=".05" mass="1" pos=".15 0 0"/>
<body name="b" pos=".3 0 0"><joint name="k" axis="0 1 0"/><geom size=".05" mass="1" pos=".5 0 0"/>
<body name="c" pos="1 0 0"><joint name="l" axis="0 1 0"/><geom size=".05" mass="1" pos="-.15 0 0"/>
<site name="s" pos="-.3 0 0"/></body></body></body><site name="w" pos="1 0 0"/></worldbody>
<equality><connect site1="s" site2="w"/></equality></mujoco>"""
#: By virtual work: the coupler sinks with both cranks' ends, their own centres half as much.
HELD = -(0.15 + 0.3 + 0.15) * 9.81


@pytest.mark.parametrize("angle", [1e-9, 1e-8, 1e-7])
def test_what_closing_cannot_tell_from_flat_is_singular_and_has_no_forces(angle):
    chain = ClosedChain.from_mjcf(FLAT)
    q = chain.close(np.array([angle, -0.7 * angle, 0.4 * angle]))
    assert chain.mobility(q).degrees_of_freedom == 2
    for question in (
        lambda: chain.inverse_dynamics(q, actuated=["j"]),
        lambda: chain.forward_dynamics(q),
        lambda: chain.forward_dynamics(q),
    ):
        with pytest.raises(NearSingularConfiguration) as caught:
            question()
        assert caught.value.error > 1e-3 * caught.value.singular_value


@pytest.mark.parametrize("angle", [1e-3, 1e-2, 0.3])
def test_away_from_flat_the_effort_is_the_closed_form(angle):
    chain = ClosedChain.from_mjcf(FLAT)
    q = chain.close(np.array([angle, -angle, angle]))
    forces = chain.inverse_dynamics(q, actuated=["j"])
    np.testing.assert_allclose(forces.effort("j"), HELD * np.cos(q[0]), rtol=1e-4)
    assert chain.mobility(q).degrees_of_freedom == 1


def test_exactly_flat_the_motion_is_that_of_two_freedoms():
    chain = ClosedChain.from_mjcf(FLAT)
    assert chain.mobility(np.zeros(3)).degrees_of_freedom == 2
    a = chain.forward_dynamics(np.zeros(3)).a
    np.testing.assert_allclose(chain.constraint_jacobian(np.zeros(3)) @ a, 0.0, atol=1e-9)


def two_links(size, weight):
    """Two links whose end slides on a rail through the world's point."""
    body = "diaginertia=" + f'"{weight * size**2 / 50} {weight * size**2 / 50} {weight * size**2 / 50}"'
    return ClosedChain.from_mjcf(
        f"""<mujoco><option gravity="0 0 {-9.81 * size}"/><worldbody>
        <body name="a"><joint name="j" axis="0 1 0"/><inertial pos="{0.15 * size} 0 {0.02 * size}" mass="{weight}"
        {body}/><body name="b" pos="{0.3 * size} 0 0"><joint name="k" axis="0 1 0"/>
        <inertial pos="{0.4 * size} 0 0" mass="{weight}" {body}/>
        <body name="c" pos="{0.8 * size} 0 0"><joint name="l" axis="0 1 0"/><inertial pos="{-0.1 * size} 0 0"
        mass="{weight}" {body}/><site name="s" pos="{-0.4 * size} 0 0"/></body></body></body>
        <site name="w" pos="{0.9 * size} 0 0"/></worldbody>
        <equality><connect site1="s" site2="w"/></equality></mujoco>"""
    )


@pytest.mark.full
@pytest.mark.parametrize("length", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("mass", [1e-6, 1.0, 1e9])
def test_similar_robots_move_alike_at_every_scale(length, mass):
    # Pinocchio's proximal iteration has tolerances with units; where it misses, the other method takes over.
    chain, other = two_links(length, mass), two_links(1.0, 1.0)
    q = other.close(np.array([0.9, -1.2, 0.8]))
    v = other.project_velocity(q, np.ones(3))
    expected = other.forward_dynamics(q, v).a
    found = chain.forward_dynamics(chain.close(q), v).a
    np.testing.assert_allclose(found, expected, atol=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize("size", [1e-3, 1.0, 100.0])
@pytest.mark.parametrize(
    ("passive", "least"), [(None, 0.1), ([0, 1, 2, 3], 0.1), ([1, 3], 0.1), ([0, 3], 1.0), ([0, 2], 1.0)]
)
def test_a_value_with_more_than_a_thousandth_of_error_is_refused(size, passive, least):
    """Values s and s/10, scaled: closed to a gap g, the configuration is known to 10 g/s, and each value to 10 g."""
    state = random_loop("spherical").chain()._state
    # The slide and three hinges.
    places, scaled = np.array([2, 0, 1, 3]), np.zeros((3, state.nv))
    scaled[:2, places] = size * np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.1, 1e-16, 0.0]])
    assert state.topology.metres[places].tolist() == [True, False, False, False]
    J = scaled / state.topology.row_scale[:, None] / state.topology.column
    q, passive = np.zeros(state.nq), None if passive is None else places[passive]
    edge = RESOLVED * 0.1 * size * least
    refuse_near_singular(state, q, J, 0.99 * edge, 0.0, passive)
    with pytest.raises(NearSingularConfiguration) as caught:
        refuse_near_singular(state, q, J, 1.01 * edge, 0.0, passive)
    assert caught.value.singular_value == pytest.approx(size * least)
    assert caught.value.error == pytest.approx(1.01 * edge / 0.1)
    # Not asked where a bound of the values is large enough, nor without rows.
    refuse_near_singular(state, q, J, 1.01 * edge, 1.01 * CERTAIN, passive)
    with pytest.raises(NearSingularConfiguration):
        refuse_near_singular(state, q, J, 1.01 * edge, 0.99 * CERTAIN, passive)
    refuse_near_singular(state, q, J[:0], 1.01 * edge, 0.0, passive)
