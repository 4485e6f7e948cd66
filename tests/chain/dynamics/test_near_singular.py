"""Next to a singular configuration forces and accelerations are refused, not computed from rounding."""

import numpy as np
import pytest

from exo_pin.chain import ClosedChain
from exo_pin.core.errors import NearSingularConfiguration

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
        lambda: chain.forward_dynamics(q, method="projected"),
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
