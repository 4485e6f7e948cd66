"""The bound of the inertia on trees of one and two joints, whose numbers are known by hand, and lawful moments."""

import numpy as np
import pinocchio as pin
import pytest

from exo_pin import MasslessMotion
from exo_pin.chain import ClosedChain, Closures
from exo_pin.chain.structure.inertia import (
    MASSLESS,
    has_inertia,
    heaviest,
    inertia_bound,
    inertia_matrix,
    lawful_moments,
    massless_joints,
)

pytestmark = pytest.mark.usefixtures("plain")

#: Of two joints, which makes it the characteristic length; a body of 4 kg then has one unit of mass.
APART, MASS = 0.5, 4.0


def tree(*joints, armature=0.0):
    """Joints one on the other, (kind, least moment), each with a body about its own origin."""
    model = pin.Model()
    for k, (kind, least) in enumerate(joints):
        model.addJoint(k, kind, pin.SE3(np.eye(3), np.array([0.0, APART if k else 3.0, 0.0])), f"j{k}")
        mass = MASS if len(joints) > 1 else 1.0
        model.appendBodyToJoint(k + 1, pin.Inertia(mass, np.zeros(3), np.diag([1.0, 1.0, least])), pin.SE3.Identity())
    model.armature = np.full(model.nv, armature)
    return model


def bound(model):
    return inertia_bound(model, ClosedChain(model, Closures("tree"))._state.topology)


@pytest.mark.parametrize("armature", [0.0, 4.0])
@pytest.mark.parametrize("kind", [pin.JointModelRX(), pin.JointModelRZ(), pin.JointModelPY()])
def test_one_joint_has_half_its_least_moment(kind, armature):
    # The trace: one coordinate times the largest moment, and the rotor.
    edge = 2.0 * MASSLESS * (1.0 + armature)
    for share, everywhere in ((0.99, False), (1.01, True)):
        found = bound(tree((kind, share * edge), armature=armature))
        assert found.everywhere == everywhere
        assert found.travelling.tolist() == []  # a slide on the world moves no other
    assert bound(tree((kind, 1.0))).travel == 10.0


def test_a_ball_has_the_trace_of_three_coordinates():
    edge = 2.0 * MASSLESS * 3.0
    for share, everywhere in ((0.99, False), (1.01, True)):
        assert bound(tree((pin.JointModelSpherical(), share * edge))).everywhere == everywhere


@pytest.mark.parametrize(("kind", "travel"), [(pin.JointModelRX(), 0.0), (pin.JointModelPY(), 10.0)])
@pytest.mark.parametrize("light", [0, 1])
def test_two_joints_count_the_way_between_them(kind, travel, light):
    """Of the first body 1 + x² with x = 1 + |p| counts; |p| is one length, and what a slide may travel in any axes."""
    way = 1.0 + np.sqrt(3.0) * travel
    most = 1.0 + (1.0 + way) ** 2 * 2.0
    needed = (1.0 + (1.0 + way) ** 2, 1.0)[light]
    edge = 2.0 * needed * MASSLESS * most
    for share, everywhere in ((0.99, False), (1.01, True)):
        moments = [1.0, 1.0]
        moments[light] = share * edge
        found = bound(tree((pin.JointModelRX(), moments[0]), (kind, moments[1])))
        assert found.everywhere == everywhere
        if everywhere:
            assert found.travelling.tolist() == ([1] if travel else [])
            assert found.travel == 10.0 * APART


def test_a_screw_travels_by_its_pitch():
    """A hinge carries a screw of two lengths a radian: its column is √5 long."""
    shift = 1.0 + np.sqrt(3.0) * 10.0 * 2.0
    most, needed = 2.0 * (1.0 + shift) ** 2 + 5.0, 1.0 + (1.0 + shift) ** 2 / 5.0
    edge = 2.0 * needed * MASSLESS * most
    for share, everywhere in ((0.99, False), (1.01, True)):
        found = bound(tree((pin.JointModelRX(), share * edge), (pin.JointModelHX(2.0 * APART), 1.0)))
        assert found.everywhere == everywhere


def test_any_slide_beyond_its_travel_is_asked_at_its_place():
    model = tree((pin.JointModelRX(), 1.0), (pin.JointModelPY(), 1.0), (pin.JointModelPZ(), 1.0))
    state = ClosedChain(model, Closures("tree"))._state
    travel = state.inertia_bound.travel
    assert state.inertia_bound.everywhere
    far = 10.0 * travel / np.sqrt(MASSLESS)
    for q in ([0.0, 0.0, 0.0], [0.0, travel, travel]):
        assert has_inertia(state, np.array(q))
    for q in ([0.0, far, 0.0], [0.0, 0.0, far]):
        assert not has_inertia(state, np.array(q))


def test_no_bound_without_bodies_with_negative_rotors_or_axes_that_change():
    good = tree((pin.JointModelRX(), 1.0), (pin.JointModelRX(), 1.0))
    assert bound(good).everywhere
    assert not bound(tree((pin.JointModelRX(), 1.0), armature=-1e-9)).everywhere
    empty = bound(pin.Model())
    assert (empty.everywhere, empty.travelling.tolist(), empty.travel) == (False, [], 0.0)


def test_motions_without_inertia_are_named_the_most_moved_first():
    """A rod on two hinges in its line: they may turn against each other, and nothing moves."""
    model = pin.Model()
    for k, ratio in enumerate((1.0, 1.0)):
        model.addJoint(k, pin.JointModelRZ(), pin.SE3.Identity(), f"spin_{k}")
        inertia = np.diag([1.0, 1.0, ratio if k else 0.0])
        model.appendBodyToJoint(k + 1, pin.Inertia(1.0, np.zeros(3), inertia), pin.SE3.Identity())
    model.addJoint(2, pin.JointModelRX(), pin.SE3.Identity(), "swing")
    model.appendBodyToJoint(3, pin.Inertia(1.0, np.array([0.0, 0.0, -1.0]), np.eye(3)), pin.SE3.Identity())
    state = ClosedChain(model, Closures("rod"))._state
    q = np.array([0.3, 0.2, 0.1])
    assert not has_inertia(state, q)
    assert sorted(massless_joints(state, q, np.eye(3))) == ["spin_0", "spin_1"]
    with pytest.raises(MasslessMotion, match="spin"):
        ClosedChain(model, Closures("rod")).forward_dynamics(q)
    M = inertia_matrix(state, q)
    np.testing.assert_array_equal(M, M.T)
    assert heaviest(M) == np.diag(M).max()
    assert heaviest(-M) == np.diag(M).max()
    assert heaviest(np.zeros((0, 0))) == 0.0


@pytest.mark.parametrize(
    ("moments", "expected"),
    [
        ([1.0, 2.0, 3.0], [1.0, 2.0, 3.0]),
        ([1.0, 2.0, 2.5], [1.0, 2.0, 2.5]),
        ([1.0, 2.0, 3.3], [1.1, 2.1, 3.2]),
        ([-1.0, 2.0, 3.5], [0.5, 2.5, 3.0]),
        ([-1.0, 2.0, 2.0], [0.0, 2.0, 2.0]),
        ([0.0, 0.0, 3.0], [1.0, 1.0, 2.0]),
    ],
)
def test_lawful_moments_are_the_nearest(moments, expected):
    np.testing.assert_allclose(lawful_moments(np.array(moments)), expected, atol=1e-15)
