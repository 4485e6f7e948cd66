"""What becomes of a block at its stops: impacts with and without rebound, rest, and what is told of them."""

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import sliders
from rubbing_chains import slide

from exo_pin import InvalidInput
from exo_pin.chain import ClosedChain, Closures
from exo_pin.chain.dynamics.integration import Instant, Rates
from exo_pin.chain.dynamics.nonsmooth.contact_forces import AT_STOP, contacts_at, stops_at
from exo_pin.chain.dynamics.nonsmooth.joint_friction import REST
from exo_pin.chain.dynamics.nonsmooth.settling import BRIEF, SLOW, Impacts, StopRules, settled
from exo_pin.chain.structure.frames import body_names
from exo_pin.chain.structure.motion_axes import limits_of

pytestmark = pytest.mark.usefixtures("plain")

MASS = 2.0


def settle(v, q=0.0, restitution=0.5, friction=0.0, before=None, impacts=None, time=3.0, effort=0.0):
    """A block that stands on its lower stop at zero, and what is told of it."""
    state = slide(np.pi / 2, friction, limits=(0.0, 1.0))._state
    rates = Rates(state, np.array([effort]), None, base=np.array([q]), mode=before)
    rules = StopRules(limits_of(state.model), restitution)
    known = {} if impacts is None else impacts
    instant, mode, found = settled(rates, time, Instant(np.array([q]), np.array([v]), 7.0, 5.0), rules, known)
    return instant, mode, [(event.kind, event.joints) for event in found], known


@pytest.mark.parametrize(("q", "v"), [(0.0, -3.0), (1.0, 3.0)])
@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_an_impact_turns_the_speed_back_and_loses_the_rest(q, v, restitution):
    instant, mode, found, known = settle(v, q, restitution)
    np.testing.assert_allclose(instant.v, [-restitution * v], atol=1e-12)
    assert instant.work == 7.0
    assert instant.dissipated == pytest.approx(5.0 + 0.5 * MASS * v**2 * (1.0 - restitution**2))
    assert found == [("impact", ("slide",))]
    assert known == {0: Impacts(3.0, 1)}
    # Without a rebound it rests on the floor, and falls from the ceiling.
    assert mode.held.pairs == ({(0, 1)} if restitution == 0.0 and q == 0.0 else set())


@pytest.mark.parametrize(("share", "rebounds"), [(0.99, False), (1.01, True)])
def test_a_slow_impact_has_no_rebound(share, rebounds):
    instant, mode, _, known = settle(-share * SLOW)
    assert (instant.v[0] > 0.0) == rebounds
    assert len(mode.held.place) == (0 if rebounds else 1)
    # Slow ones in a row are counted, others begin anew.
    assert known[0].times == 1
    assert settle(-share * SLOW, impacts={0: Impacts(1.0, 4)})[3][0].times == (1 if rebounds else 5)


@pytest.mark.parametrize(("share", "rebounds"), [(0.99, False), (1.01, True)])
def test_an_impact_soon_after_another_has_no_rebound(share, rebounds):
    instant, _, _, known = settle(-3.0, impacts={0: Impacts(3.0 - share * BRIEF, 1)})
    assert instant.v[0] == pytest.approx(1.5 if rebounds else 0.0, abs=1e-12)
    assert known == {0: Impacts(3.0, 1 if rebounds else 2)}


def test_at_rest_on_the_stop_and_in_the_air():
    instant, mode, found, known = settle(0.0)
    assert (instant.v[0], instant.dissipated, found, known) == (0.0, 5.0, [], {})
    assert mode.held.pairs == {(0, 1)}
    assert mode.sign.tolist() == [0]
    _, lifted, found, _ = settle(0.0, effort=30.0, before=mode)
    assert lifted.held.pairs == set()
    assert found == [("stop left", ("slide",))]
    _, _, found, _ = settle(0.0, before=lifted)
    assert found == [("stop reached", ("slide",))]
    # One that has rested there still does where rounding has lifted it.
    assert settle(0.0, q=1e-6, before=mode)[1].held.pairs == {(0, 1)}
    assert settle(0.0, q=1e-6)[1].held.pairs == set()


@pytest.mark.parametrize(("effort", "kind", "sign"), [(MASS * 9.81, "stick", 0), (40.0, None, 1), (0.0, None, -1)])
def test_friction_at_rest_holds_or_slips_the_way_it_is_pushed(effort, kind, sign):
    _, mode, _, _ = settle(0.0, q=0.5, friction=4.0, effort=effort)
    assert mode.sign.tolist() == [sign]
    np.testing.assert_allclose(mode.sliding, [-4.0 * sign])
    assert mode.held.pairs == ({(0, 0)} if kind else set())
    _, moving, _, _ = settle(1.0, q=0.5, friction=4.0)
    assert (moving.sign.tolist(), moving.sliding.tolist()) == ([1], [-4.0])
    _, back, found, _ = settle(-1.0, q=0.5, friction=4.0, before=moving)
    assert found == [("reversed", ("slide",))]
    _, _, found, _ = settle(0.0, q=0.5, friction=4.0, before=back, effort=MASS * 9.81)
    assert found == [("stick", ("slide",))]
    _, _, found, _ = settle(1.0, q=0.5, friction=4.0, before=settle(0.0, 0.5, friction=4.0, effort=MASS * 9.81)[1])
    assert found == [("slip", ("slide",))]


def test_room_to_stops_is_in_characteristic_lengths():
    model = pin.Model()
    model.addJoint(0, pin.JointModelRY(), pin.SE3.Identity(), "hinge")
    model.addJoint(1, pin.JointModelPX(), pin.SE3(np.eye(3), np.array([0.25, 0.0, 0.0])), "slide")
    for joint in (1, 2):
        model.appendBodyToJoint(joint, pin.Inertia(1.0, np.zeros(3), np.eye(3)), pin.SE3.Identity())
    model.lowerPositionLimit, model.upperPositionLimit = np.array([-1.0, -0.5]), np.array([2.0, 0.5])
    model.addFrame(pin.Frame("ground", 0, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    model.addFrame(pin.Frame("site", 1, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    model.addFrame(pin.Frame("arm", 1, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    model.addFrame(pin.Frame("more", 1, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    chain = ClosedChain(model, Closures("two"))
    gaps, index, side = StopRules(limits_of(model), 0.0).gaps(chain._state, np.array([0.5, 0.1]))
    assert chain.characteristic_length == 0.25
    np.testing.assert_allclose(gaps, [1.5, 2.4, 1.5, 1.6])
    assert (index.tolist(), side.tolist()) == ([0, 1, 0, 1], [1, 1, -1, -1])
    assert [len(part) for part in StopRules(None, 0.0).gaps(chain._state, np.zeros(2))] == [0, 0, 0]
    # Names of bodies: the first link's, else the joint's.
    assert body_names(model) == ("universe", "arm", "slide")


@pytest.mark.parametrize("axis", range(3))
def test_forces_of_a_motion_are_under_the_gravity_that_it_had(axis):
    chain = slide(0.0)
    motion = chain.forward_dynamics(np.zeros(1), tau=np.array([3.0]))
    chain.model.gravity.linear = chain.model.gravity.linear + 5.0 * np.eye(3)[axis]
    wrench = motion.forces.joint_reaction("slide").wrench
    np.testing.assert_allclose(wrench[:3], [3.0, 0.0, MASS * 9.81], atol=1e-9)


def pair():
    """Two links on hinges, the first on its lower stop, the second on its upper one."""
    model = pin.Model()
    for k in range(2):
        place = pin.SE3(np.eye(3), np.array([0.0, 0.0, -0.4 * k]))
        model.addJoint(k, pin.JointModelRY(), place, f"hinge_{k}")
        inertia = pin.Inertia(1.0, np.array([0.0, 0.0, -0.2]), 0.02 * np.eye(3))
        model.appendBodyToJoint(k + 1, inertia, pin.SE3.Identity())
    model.gravity.linear = np.zeros(3)
    model.lowerPositionLimit, model.upperPositionLimit = np.array([0.0, -2.0]), np.array([2.0, 0.0])
    return ClosedChain(model, Closures("pair"))._state


@pytest.mark.parametrize(
    ("speed", "times", "thrown"), [(0.5, 2, True), (0.5, 3, False), (0.5, 4, False), (2.0, 3, True)]
)
def test_a_joint_that_rocks_slowly_comes_to_rest_at_its_third_time(speed, times, thrown):
    """The first joint's slow impact throws the second off its stop, unless that has been thrown off often enough."""
    state = pair()
    rates = Rates(state, None, None, base=np.zeros(2))
    impacts, v = {1: Impacts(1.0, times)}, np.array([-speed * SLOW, 0.0])
    instant, _, found = settled(
        rates, 2.0, Instant(np.zeros(2), v, 0.0, 0.0), StopRules(limits_of(state.model), 0.0), impacts
    )
    assert [(event.kind, event.joints) for event in found] == [("impact", ("hinge_0",))]
    assert instant.v[0] == pytest.approx(0.0, abs=1e-15)
    # By the momentum of the second about its hinge: the impulse on the first leaves M v there.
    M = pin.crba(state.model, state.model.createData(), np.zeros(2))
    M = np.triu(M) + np.triu(M, 1).T
    free = v[1] - M[1, 0] / M[1, 1] * (0.0 - v[0])
    assert free < 0.0
    assert instant.v[1] == pytest.approx(free if thrown else 0.0, rel=1e-9, abs=1e-18)
    after = 0.5 * (v @ M @ v - instant.v @ M @ instant.v)
    assert instant.dissipated == pytest.approx(after, rel=1e-9)
    assert impacts[0] == Impacts(2.0, 1)
    assert impacts[1] == Impacts(1.0, times)


def stopped_sliders(length, place):
    """Three slides of one freedom, of which one has stops: its state, limits and configuration at a place."""
    chain = sliders(length).chain()
    model = chain.model.copy()
    (index,) = chain.velocity_indices(["slide_both"])
    for name, side in (("lowerPositionLimit", -np.inf), ("upperPositionLimit", np.inf)):
        limits = np.full(3, side)
        limits[index] = np.sign(side) * length
        setattr(model, name, limits)
    q = chain.dependent_motion(np.zeros(3), ["slide_both"], [place])[0]
    return ClosedChain(model, chain.description), q


@pytest.mark.parametrize("length", [0.01, 100.0])
@pytest.mark.parametrize(("share", "active"), [(-1.1, 0), (-0.9, 1), (0.9, 1), (1.1, None)])
def test_stops_are_active_within_a_share_of_any_characteristic_length(length, share, active):
    unit = sliders(length).chain().characteristic_length
    chain, q = stopped_sliders(length, length + share * AT_STOP * unit)
    limits = limits_of(chain.model)
    if active is None:
        with pytest.raises(InvalidInput, match="beyond its limits"):
            stops_at(chain._state, limits, q)
    else:
        assert len(stops_at(chain._state, limits, q)[0]) == active


@pytest.mark.parametrize("length", [0.01, 100.0])
@pytest.mark.parametrize(("share", "hits"), [(-1.1, False), (0.9, False), (1.1, True)])
def test_an_impact_has_a_speed_in_characteristic_lengths(length, share, hits):
    chain, q = stopped_sliders(length, length)
    state = chain._state
    v, _ = chain.dependent_motion(q, ["slide_both"], [share * REST * chain.characteristic_length])
    rates = Rates(state, np.zeros(3), None, base=q)
    _, _, found = settled(rates, 0.0, Instant(q, v, 0.0, 0.0), StopRules(limits_of(chain.model), 0.5), {})
    assert [event.joints for event in found if event.kind == "impact"] == [("slide_both",)] * hits


@pytest.mark.parametrize("length", [0.01, 100.0])
@pytest.mark.parametrize(("share", "active"), [(-1.1, 0), (-0.9, 1), (0.9, 1), (1.1, None)])
def test_leaving_a_stop_and_moving_into_it_are_speeds_in_characteristic_lengths(length, share, active):
    chain, q = stopped_sliders(length, length)
    v, _ = chain.dependent_motion(q, ["slide_both"], [share * REST * chain.characteristic_length])
    if active is None:
        with pytest.raises(InvalidInput, match="moves into its stop"):
            contacts_at(chain._state, q, v, True)
    else:
        assert contacts_at(chain._state, q, v, True)[1].side.tolist() == [-1] * active
