"""Motions of all joints from those of some, and of a root joint from world axes."""

import numpy as np
import pytest
from closable_chains import CHAINS, open_configurations
from mechanisms import five_bar, parallelogram, sliders

from exo_pin import InvalidInput, LoopNotClosed, UndeterminedMotion
from exo_pin.chain import ClosedChain

# Central differences of step h: h²/6 of a third derivative of order 10 here, plus rounding eps/h times order 10.


@pytest.fixture(params=CHAINS, scope="module")
def chain(request):
    return CHAINS[request.param]


def test_dependent_motion_does_not_open_the_loops(chain):
    rng = np.random.default_rng(13)
    actuated = list(chain.roles.actuated)
    if chain.description.name == "random-7-whole":
        actuated = ["root_joint"]  # five actuators for three freedoms would contradict each other
    count = len(chain.velocity_indices(actuated))
    for q in open_configurations(chain, 14):
        q = chain.close(q)
        velocity, acceleration = rng.normal(size=(2, count))
        v, a = chain.dependent_motion(q, actuated, velocity, acceleration)
        indices = chain.velocity_indices(actuated)
        np.testing.assert_array_equal(v[indices], velocity)
        np.testing.assert_array_equal(a[indices], acceleration)
        J, drift = chain.constraint_jacobian(q), chain.constraint_drift(q, v)
        assert np.abs(J @ v).max() < 1e-10 * (1 + np.abs(v).max())
        assert np.abs(J @ a + drift).max() < 1e-10 * (1 + np.abs(a).max())


def test_dependent_motion_follows_the_closed_path():
    # Second differences of step h along the path of the closed mechanism: h²/12 of a fourth derivative, and the
    # loops' 1e-12 over h².
    chain, h = CHAINS["five_bar"], 1e-3
    rates, growth = np.array([0.7, -0.4]), np.array([0.3, 0.9])
    q = five_bar().q
    v, a = chain.dependent_motion(q, chain.roles.actuated, rates, growth)

    def at(t):
        there = q.copy()
        there[[0, 2]] += rates * t + growth * t**2 / 2
        return chain.close(there, hold=chain.roles.actuated)

    np.testing.assert_allclose((at(h) - at(-h)) / (2 * h), v, atol=1e-5)
    np.testing.assert_allclose((at(h) - 2 * q + at(-h)) / h**2, a, atol=1e-4)


def test_too_few_joints_leave_freedoms_and_too_many_contradict():
    chain, q = CHAINS["five_bar"], five_bar().q
    with pytest.raises(UndeterminedMotion) as caught:
        chain.dependent_motion(q, ["left_crank_hinge"], [1.0])
    assert caught.value.free == 1
    # The left crank is held, and all others move.
    assert caught.value.joints == tuple(name for name in chain.model.names[1:] if name != "left_crank_hinge")
    assert f"{caught.value.joints[0]}, " in str(caught.value)
    with pytest.raises(InvalidInput, match="opens the loops"):
        chain.dependent_motion(q, chain.model.names[1:], [1.0, 0.0, 0.0, 0.0])
    with pytest.raises(InvalidInput, match="twice"):
        chain.dependent_motion(q, ["left_crank_hinge"] * 2, [1.0, 1.0])
    with pytest.raises(LoopNotClosed):
        chain.dependent_motion(q + 0.1, chain.roles.actuated, [1.0, 1.0])


def test_a_rod_that_turns_about_itself_is_named():
    """A crank and a slider joined by a rod with a ball at either end: the crank says all but the rod's turn."""
    link = '<inertial mass="1" pos="0 0 0.1" diaginertia="0.01 0.01 0.01"/>'
    crank = f'<body><joint name="crank" axis="0 1 0"/>{link}<body pos="0 0 0.1"><joint name="rod" type="ball"/>{link}'
    slider = f'<body pos="0.3 0 0"><joint name="slider" type="slide" axis="1 0 0"/>{link}<site name="pin"/></body>'
    loop = '<equality><connect name="end" site1="tip" site2="pin"/></equality>'
    rod = f'{crank}<site name="tip" pos="0.4 0 0"/></body></body>'
    chain = ClosedChain.from_mjcf(f"<mujoco><worldbody>{rod}{slider}</worldbody>{loop}</mujoco>")
    q = chain.close(chain.neutral())
    with pytest.raises(UndeterminedMotion, match="rod can still move") as caught:
        chain.dependent_motion(q, ["crank"], [1.0])
    assert (caught.value.free, caught.value.joints) == (1, ("rod",))
    with pytest.raises(UndeterminedMotion) as caught:
        chain.split(q, ["crank"])
    assert (caught.value.free, caught.value.joints) == (1, ("rod",))


@pytest.mark.parametrize("size", [1e-8, 1.0, 1e4])
def test_a_motion_that_opens_the_loop_is_refused_however_slow(size, plain):
    """A five-bar has two freedoms: a third joint has to move as the other two make it."""
    named = five_bar()
    chain = named.chain()
    q = chain.close(named.q)
    joints = list(chain.model.names)[1:4]
    v, a = chain.dependent_motion(q, joints[:2], size * np.array([1.0, -0.5]))
    own = chain.velocity_indices(joints)
    again, _ = chain.dependent_motion(q, joints, v[own], a[own])
    np.testing.assert_allclose(again, v, rtol=1e-7, atol=1e-7 * size)
    # Nothing is left to follow, and what the joints do to the loops cancels down to rounding.
    np.testing.assert_array_equal(chain.dependent_motion(q, list(chain.model.names)[1:], v, a), (v, a))
    v[own[2]] += 0.1 * size
    with pytest.raises(InvalidInput, match="opens the loops"):
        chain.dependent_motion(q, joints, v[own], a[own])
    # At rest an acceleration alone.
    still = np.zeros(3)
    _, a = chain.dependent_motion(q, joints[:2], still[:2], size * np.array([1.0, -0.5]))
    a[own[2]] += 0.1 * size
    with pytest.raises(InvalidInput, match="opens the loops"):
        chain.dependent_motion(q, joints, still, a[own])


@pytest.mark.parametrize("length", [0.01, 100.0])
def test_slides_that_contradict_each_other_are_refused_at_any_size(length, plain):
    named = sliders(length)
    chain, q = named.chain(), named.q
    joints, together, apart = (
        ["slide_x", "slide_y", "slide_both"],
        np.array([0.6, 0.8, 1.0]),
        np.array([0.0, 1e-3, 0.0]),
    )
    own = chain.velocity_indices(joints)
    v, a = chain.dependent_motion(q, joints, together, 2 * together)
    np.testing.assert_array_equal((v[own], a[own]), (together, 2 * together))
    for v, a in ((together + apart, together), (0.1 * together, together + apart), (np.zeros(3), together + apart)):
        with pytest.raises(InvalidInput, match="opens the loops"):
            chain.dependent_motion(q, joints, v, a)


@pytest.mark.parametrize("angle", [0.3, 1.0, 2.2])
def test_a_bar_on_parallel_cranks_needs_no_acceleration_at_constant_speed(angle, plain):
    """Each crank's tip accelerates towards its pivot, all alike: what joins them cancels down to rounding."""
    named = parallelogram(angle)
    chain = named.chain()
    names = [str(name) for name in chain.model.names[1:]]
    v = 100.0 * np.array([-1.0 if name == "tip_0" else 1.0 for name in names])
    for joints in (names, ["hinge_0"]):
        found, a = chain.dependent_motion(named.q, joints, v[chain.velocity_indices(joints)])
        np.testing.assert_allclose(found, v, rtol=1e-9)
        np.testing.assert_allclose(a, 0.0, atol=1e-8)
