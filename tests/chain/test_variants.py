"""Chains with joints locked, beside the same chains with those joints held by a closure."""

import dataclasses

import numpy as np
import pinocchio as pin
import pytest
from closed_chains import CHAINS

from exo_pin import InvalidInput, UnknownName
from exo_pin.chain import ClosedChain, Closure, Closures, JointProperties, Placement, Roles


def hinges(chain):
    """Joints whose position is one number."""
    return [str(name) for name, nq in zip(chain.model.names, chain.model.nqs, strict=True) if nq == 1]


def movable(chain, q, count):
    """A joint that may be locked without locking the mechanism."""
    for name in hinges(chain)[::-1]:
        held = chain.locked([name], q)
        if held.mobility(reduced(chain, [name], q)).degrees_of_freedom >= count:
            return name
    return None


def reduced(chain, joints, q):
    gone = {index for name in joints for index in range(*chain.configuration_slice(name).indices(chain.model.nq))}
    return np.array([value for index, value in enumerate(q) if index not in gone])


@pytest.mark.parametrize(
    "name", ["five_bar", "delta-rigid", "stewart", "loop-spherical", "loop-coupling", "wrist-floating"]
)
def test_a_locked_joint_moves_as_one_that_a_closure_holds(name):
    chain, q = CHAINS[name]
    joint = movable(chain, q, 1)
    assert joint is not None
    locked = chain.locked([joint], q)
    place = float(q[chain.configuration_slice(joint)][0])
    held = chain.with_closure(Closure("lock", "coupling", "universe", joint, polynomial=(place,)))
    rng, own = np.random.default_rng(3), chain.velocity_slice(joint)
    others = np.setdiff1d(np.arange(chain.model.nv), [own.start])
    v = held.project_velocity(q, rng.normal(size=chain.model.nv))
    tau = rng.normal(size=chain.model.nv)
    expected = held.forward_dynamics(q, v, tau).a
    found = locked.forward_dynamics(reduced(chain, [joint], q), v[others], tau[others]).a
    np.testing.assert_allclose(found, expected[others], atol=1e-8 * np.abs(expected).max())
    assert joint not in list(locked.model.names)
    assert held.closures[-1].name == "lock"
    assert chain.row_count == held.row_count - 1


@pytest.mark.parametrize("frame", ["coupler", "universe"])
def test_frames_stay_where_they_were(frame):
    chain, q = CHAINS["five_bar"]
    joint = hinges(chain)[0]
    locked = chain.locked(joint, q)
    at = locked.placements(reduced(chain, [joint], q))
    for name, pose in chain.placements(q).items():
        np.testing.assert_allclose(at[name].homogeneous, pose.homogeneous, atol=1e-14)


def tree(polynomial):
    """Two hinges one on the other, coupled: joint "b" follows joint "a"."""
    model = pin.Model()
    first = model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "a")
    second = model.addJoint(first, pin.JointModelRX(), pin.SE3(np.eye(3), np.array([0.3, 0.0, 0.0])), "b")
    for joint in (first, second):
        model.appendBodyToJoint(joint, pin.Inertia(1.0, np.full(3, 0.1), np.eye(3)), pin.SE3.Identity())
    gear = Closure("gear", "coupling", "a", "b", polynomial=polynomial, references=(0.1, 0.2))
    springs = (JointProperties("a", stiffness=2.0), JointProperties("b", stiffness=3.0))
    return ClosedChain(model, Closures("gear", closures=(gear,), roles=Roles(actuated=("a", "b")), joints=springs))


def test_a_coupling_holds_the_joint_that_is_left():
    chain = tree((0.05, 0.5, 0.25))
    q = chain.close([0.4, 0.0], hold=["a"])
    for joint, other in (("a", 1), ("b", 0)):
        left = chain.locked([joint], q)
        np.testing.assert_allclose(left.close([q[other] + 0.3]), [q[other]], atol=1e-12)
        assert left.roles.actuated == (("b", "a")[other == 0],)
        assert [item.joint for item in left.description.joints] == [("b", "a")[other == 0]]
    assert chain.locked(["a", "b"], q).closures == ()
    with pytest.raises(InvalidInput, match="cannot hold"):
        chain.locked(["a", "b"], q + np.array([0.0, 0.1]))
    with pytest.raises(InvalidInput, match="cannot hold"):
        tree((0.0, 0.0, 1.0)).locked(["b"], [0.0, -3.0])


@pytest.mark.parametrize("joint", ["one", "two"])
def test_a_tree_that_was_built_in_code_is_locked(joint):
    model, parent, bodies = pin.Model(), 0, []
    for name, kind in (("one", pin.JointModelRZ()), ("two", pin.JointModelRY()), ("three", pin.JointModelRX())):
        parent = model.addJoint(parent, kind, pin.SE3(np.eye(3), np.array([0.3, 0.0, 0.0])), name)
        model.addFrame(pin.Frame(f"link {name}", parent, 0, pin.SE3.Identity(), pin.FrameType.BODY))
        model.appendBodyToJoint(parent, pin.Inertia(1.0, np.full(3, 0.1), 0.01 * np.eye(3)), pin.SE3.Identity())
        bodies.append(f"link {name}")
    ends = Placement((0.3, 0.0, 0.0)), Placement((0.0, 0.0, 0.0))
    chain = ClosedChain(model, Closures("arm", closures=(Closure("held", "rigid", bodies[0], bodies[1], *ends),)))
    q = np.array([0.3, 0.0, -0.4])
    left = chain.locked([joint], q)
    assert left.model.nv == 2
    assert all(left.model.existFrame(name) for name in bodies)
    # Two hinges and a weld between them, or one hinge that turns with it.
    assert len(left.closures) == (joint == "one")
    at = q[[name != joint for name in ("one", "two", "three")]]
    there, here = left.placements(at), chain.placements(q)
    assert np.allclose(there[bodies[2]].homogeneous, here[bodies[2]].homogeneous, atol=1e-14)


def test_a_locked_root_and_limbs_leave_the_roles():
    chain, q = CHAINS["wrist-whole"]
    limb = chain.roles.limbs[0]
    left = chain.locked([limb.slide], q)
    assert [item.name for item in left.roles.limbs] == [item.name for item in chain.roles.limbs[1:]]
    assert limb.slide not in left.roles.actuated
    fixed = chain.locked(["root_joint"], q)
    assert fixed.description.root.joint == "fixed"
    assert fixed.roles.shoulder is None
    assert fixed.row_count == chain.row_count


def test_locked_joints_take_the_closures_that_they_bridge_with_them():
    chain, q = CHAINS["four_bar"]
    names = list(chain.model.names)[1:]
    fixed = chain.locked(names, q)
    assert fixed.model.nv == 0
    assert fixed.closures == ()
    bridged = Closure("bridge", "rigid", "ground", "crank", *(Placement(),) * 2)
    held = chain.with_closure(dataclasses.replace(bridged, placement_a=_place(chain, q, "crank")))
    left = held.locked(["crank_hinge"], q)
    assert [closure.name for closure in left.closures] == ["tip"]
    with pytest.raises(InvalidInput, match="'bridge' is open by"):
        held.locked(["crank_hinge"], q + 0.1)


def _place(chain, q, name):
    place = chain.placement(q, name)
    return Placement(tuple(place.translation), tuple(pin.Quaternion(place.rotation).coeffs()))


def test_what_cannot_be_locked_or_closed():
    chain, q = CHAINS["five_bar"]
    with pytest.raises(UnknownName):
        chain.locked(["elbow"], q)
    with pytest.raises(InvalidInput, match="world"):
        chain.locked(["universe"], q)
    with pytest.raises(InvalidInput, match="given twice"):
        chain.with_closure(chain.closures[0])
    with pytest.raises(InvalidInput, match="closure"):
        chain.with_closure("lock")
