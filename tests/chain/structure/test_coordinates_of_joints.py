"""Units of coordinates and what each moves, of trees with joints of one, two, three and six."""

import numpy as np
import pinocchio as pin
import pytest

from exo_pin.chain.formats.xml_elements import as_numbers
from exo_pin.chain.structure.motion_axes import (
    carried_joints,
    characteristic_length,
    in_metres,
    moving_coordinates,
    unit_of,
    v_slice,
)

KINDS = (
    pin.JointModelFreeFlyer(), pin.JointModelPlanar(), pin.JointModelTranslation(), pin.JointModelRUBX(),
    pin.JointModelSphericalZYX(), pin.JointModelPZ(), pin.JointModelRY(),
)  # fmt: skip
PARENTS = (0, 1, 1, 3, 3, 4, 0)


def tree():
    model = pin.Model()
    for k, (kind, parent) in enumerate(zip(KINDS, PARENTS, strict=True)):
        model.addJoint(parent, kind, pin.SE3(np.eye(3), np.array([0.0, 0.1 * (k + 1), 0.0])), f"j{k}")
    return model


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


def test_numbers_of_a_file_have_no_negative_zero_and_all_their_digits():
    assert as_numbers([-0.0, 0.0, 1.5, -2.0]) == "0.0 0.0 1.5 -2.0"
    values = np.random.default_rng(0).normal(size=5)
    assert [float(text) for text in as_numbers(values).split()] == values.tolist()
