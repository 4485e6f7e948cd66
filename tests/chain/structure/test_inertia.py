"""Where every motion has inertia, known from the bodies alone, against the mass matrix at random configurations."""

import numpy as np
import pinocchio as pin
import pytest
from closed_chains import CHAINS

from exo_pin.chain import ClosedChain, Closures
from exo_pin.chain.structure.inertia import MASSLESS, has_inertia, inertia_matrix


def spread(chain, q):
    """Least and largest inertia of a motion, metres divided by the characteristic length."""
    column = chain._state.topology.column
    sizes = np.linalg.eigvalsh(inertia_matrix(chain._state, q) * column[:, None] * column)
    return sizes[0], sizes[-1]


def slide(mass, inertia=1e-3):
    """A hinge, and on it a slide with a body."""
    model, place = pin.Model(), pin.SE3(np.eye(3), np.array([0.2, 0.0, 0.0]))
    hinge = model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "hinge")
    model.appendBodyToJoint(hinge, pin.Inertia(1.0, np.zeros(3), np.eye(3)), pin.SE3.Identity())
    body = model.addJoint(hinge, pin.JointModelPX(), place, "slide")
    model.appendBodyToJoint(body, pin.Inertia(mass, np.zeros(3), inertia * np.eye(3)), pin.SE3.Identity())
    return ClosedChain(model, Closures("slide"))


@pytest.mark.parametrize("name", CHAINS)
def test_a_bound_of_the_inertia_holds_at_every_configuration(name):
    chain, _ = CHAINS[name]
    bound = chain._state.inertia_bound
    massless = any(inertia.mass == 0.0 for inertia in chain.model.inertias[1:])
    assert not (bound.everywhere and massless)
    rng = np.random.default_rng(2)
    for _ in range(10):
        q = pin.integrate(chain.model, chain.neutral(), rng.uniform(-3.0, 3.0, chain.model.nv))
        least, most = spread(chain, q)
        if bound.everywhere:
            assert least > MASSLESS * most
        assert has_inertia(chain._state, q) == (least > MASSLESS * most)


def test_named_mechanisms_of_rods_have_inertia_everywhere():
    assert all(
        CHAINS[name][0]._state.inertia_bound.everywhere for name in ("four_bar", "five_bar", "delta-rigid", "stewart")
    )


@pytest.mark.parametrize("mass", [1.0, 1e-4, 1e-8, 1e-14])
def test_slides_have_inertia_up_to_their_travel_and_are_computed_beyond(mass):
    chain = slide(mass, 1e-3 * mass)
    bound = chain._state.inertia_bound
    np.testing.assert_array_equal(bound.travelling, [1])
    for reach in (0.0, 0.999 * bound.travel, 1e3 * bound.travel, 1e9):
        least, most = spread(chain, np.array([0.3, reach]))
        assert not (bound.everywhere and reach < bound.travel and least <= MASSLESS * most)
        assert has_inertia(chain._state, np.array([0.3, reach])) == (least > MASSLESS * most)


def test_bodies_without_inertia_have_no_bound():
    assert not slide(0.0, 0.0)._state.inertia_bound.everywhere
    assert not slide(1.0, 0.0)._state.inertia_bound.everywhere
    assert slide(1.0)._state.inertia_bound.everywhere


@pytest.mark.parametrize("along", [1.0, 1e-16])
def test_a_thin_rod_turns_about_itself_without_inertia(along):
    model = pin.Model()
    hinge = model.addJoint(0, pin.JointModelRX(), pin.SE3.Identity(), "hinge")
    model.appendBodyToJoint(hinge, pin.Inertia(1.0, np.zeros(3), np.eye(3)), pin.SE3.Identity())
    spin = model.addJoint(hinge, pin.JointModelRZ(), pin.SE3.Identity(), "spin")
    rod = pin.Inertia(1.0, np.zeros(3), np.diag([1.0, 1.0, along]))
    model.appendBodyToJoint(spin, rod, pin.SE3.Identity())
    chain = ClosedChain(model, Closures("rod"))
    assert chain._state.inertia_bound.everywhere == (along == 1.0)
    assert has_inertia(chain._state, np.array([0.3, 0.2])) == (along == 1.0)
