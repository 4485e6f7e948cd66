"""Indices, limits and units of coordinates, of trees with joints of one, two, three and six."""

import numpy as np
import pinocchio as pin
import pytest

from exo_pin import InvalidInput
from exo_pin.chain.formats.xml_elements import as_numbers
from exo_pin.chain.structure.motion_axes import (
    Limits,
    carried_joints,
    characteristic_length,
    in_metres,
    joint_names,
    limits_of,
    moving_coordinates,
    q_slice,
    unit_of,
    v_slice,
)

INF = np.inf
KINDS = (
    pin.JointModelFreeFlyer(), pin.JointModelPlanar(), pin.JointModelTranslation(), pin.JointModelRUBX(),
    pin.JointModelSphericalZYX(), pin.JointModelPZ(), pin.JointModelRY(),
)  # fmt: skip
PARENTS = (0, 1, 1, 3, 3, 4, 0)


def tree():
    model = pin.Model()
    for k, (kind, parent) in enumerate(zip(KINDS, PARENTS, strict=True)):
        model.addJoint(parent, kind, pin.SE3(np.eye(3), np.array([0.0, 0.1 * (k + 1), 0.0])), f"j{k}")
    model.lowerPositionLimit = -np.arange(1.0, model.nq + 1.0)
    model.upperPositionLimit = np.arange(1.0, model.nq + 1.0)
    return model


def test_limits_are_of_coordinates_that_are_vectors_in_their_order():
    model = tree()
    found = limits_of(model)
    # Translation (3), ZYX angles (3), slide and hinge: not the flights, and not the endless hinge.
    assert found.joints == ("j2",) * 3 + ("j4",) * 3 + ("j5", "j6")
    q = np.concatenate([np.arange(model.nq)[q_slice(model, joint)] for joint in (3, 5, 6, 7)])
    v = np.concatenate([np.arange(model.nv)[v_slice(model, joint)] for joint in (3, 5, 6, 7)])
    np.testing.assert_array_equal(found.q_index, q)
    np.testing.assert_array_equal(found.v_index, v)
    np.testing.assert_array_equal(found.lower, -1.0 - q)
    np.testing.assert_array_equal(found.upper, 1.0 + q)
    model.lowerPositionLimit = np.full(model.nq, -INF)
    upper = np.full(model.nq, INF)
    upper[q[1]] = 4.0
    model.upperPositionLimit = upper
    one = limits_of(model)
    assert (one.joints, one.q_index.tolist(), one.v_index.tolist()) == (("j2",), [q[1]], [v[1]])
    assert (one.lower[0], one.upper[0]) == (-INF, 4.0)
    model.upperPositionLimit, lower = np.full(model.nq, INF), np.full(model.nq, -INF)
    lower[q[-1]] = 0.0
    model.lowerPositionLimit = lower
    assert limits_of(model).joints == ("j6",)


def test_a_limit_itself_is_within_and_held_coordinates_are_not_moved():
    limits = Limits(("a", "b"), np.array([1, 2]), np.array([0, 1]), np.array([-1.0, 0.5]), np.array([2.0, 0.75]))
    q = np.array([9.0, -1.0, 0.75])
    assert limits.holds(q)
    assert limits.holds(np.array([9.0, 2.0, 0.5]))
    for wrong in ([9.0, -1.01, 0.6], [9.0, 2.01, 0.6], [9.0, 0.0, 0.49], [9.0, 0.0, 0.76]):
        assert not limits.holds(np.array(wrong))
    beyond = np.array([9.0, -3.0, 7.0])
    np.testing.assert_array_equal(limits.clipped(beyond, np.array([1.0, 0.1])), [9.0, -1.0, 0.75])
    np.testing.assert_array_equal(limits.clipped(beyond, np.array([0.0, 0.1])), [9.0, -3.0, 0.75])
    np.testing.assert_array_equal(limits.clipped(beyond, np.array([0.1, 0.0])), [9.0, -1.0, 7.0])
    np.testing.assert_array_equal(beyond, [9.0, -3.0, 7.0])


def test_units_metres_and_what_each_coordinate_moves():
    model = tree()
    units = [unit_of(model, joint) for joint in range(model.njoints)]
    assert units == [None, None, None, "m", "rad", "rad", "m", "rad"]
    expected = [1, 1, 1, 0, 0, 0, 1, 1, 0, 1, 1, 1, 0, 0, 0, 0, 1, 0]
    np.testing.assert_array_equal(in_metres(model), np.array(expected, dtype=bool))
    # By hand along the parents.
    for joint in range(model.njoints):
        chain, at = set(), joint
        while at:
            chain.add(at)
            at = model.parents[at]
        moved = np.zeros(model.nv)
        for own in chain:
            moved[v_slice(model, own)] = 1.0
        np.testing.assert_array_equal(moving_coordinates(model)[joint], moved)
        carriers = np.zeros(model.njoints)
        carriers[[0, *chain]] = 1.0
        np.testing.assert_array_equal(carried_joints(model)[:, joint], carriers)


def test_the_characteristic_length_is_the_root_mean_square_of_distances_on_bodies():
    model = pin.Model()
    model.addJoint(0, pin.JointModelRX(), pin.SE3(np.eye(3), np.array([0.0, 0.0, 3.0])), "a")
    model.addJoint(1, pin.JointModelRX(), pin.SE3(np.eye(3), np.array([0.0, 0.4, 0.0])), "b")
    model.addJoint(2, pin.JointModelRX(), pin.SE3.Identity(), "c")  # at the same point, which is no length
    none, nowhere = np.zeros((0, 2), dtype=np.int64), np.zeros((0, 2, 4, 3))
    assert characteristic_length(model, none, nowhere) == pytest.approx(0.4)
    local = np.zeros((1, 2, 4, 3))
    local[0, 0, 3], local[0, 1, 3] = [0.0, 0.0, 0.3], [0.0, 0.0, 1.0]
    # The closure joins body c (0.3 from its joint) with the world (2 from joint a).
    found = characteristic_length(model, np.array([[3, 0]]), local)
    assert found == pytest.approx(np.sqrt((0.4**2 + 0.3**2 + 2.0**2) / 3))
    # A coupling joins the same joint with itself; a flight is no joint.
    assert characteristic_length(model, np.array([[3, 3]]), local) == pytest.approx(0.4)
    assert characteristic_length(pin.Model(), none, nowhere) == 1.0
    flying = pin.Model()
    flying.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "flight")
    flying.addJoint(1, pin.JointModelRX(), pin.SE3(np.eye(3), np.array([0.0, 0.7, 0.0])), "a")
    flying.addJoint(1, pin.JointModelRX(), pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.7])), "b")
    assert characteristic_length(flying, none, nowhere) == pytest.approx(0.7 * np.sqrt(2.0))


def test_names_of_joints_are_one_or_several():
    assert joint_names("one") == ("one",)
    assert joint_names(["one", "two"]) == ("one", "two")
    with pytest.raises(InvalidInput, match="names of joints"):
        joint_names(3)


def test_numbers_of_a_file_have_no_negative_zero_and_all_their_digits():
    assert as_numbers([-0.0, 0.0, 1.5, -2.0]) == "0.0 0.0 1.5 -2.0"
    values = np.random.default_rng(0).normal(size=5)
    assert [float(text) for text in as_numbers(values).split()] == values.tolist()
