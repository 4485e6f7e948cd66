"""What numbers of a URDF may be: inertias of few digits, limits, axes, origins, versions and depths."""

import itertools

import numpy as np
import pinocchio as pin
import pytest
from urdf_knee import BARE, GOOD

from exo_pin import FileFormatError
from exo_pin.chain import ClosedChain, Closure, Closures

INF = np.inf


def joint(version, kind, inside):
    return (
        f'<robot name="r" version="{version}"><link name="a"/><link name="b"/><joint name="j" type="{kind}">'
        f'<parent link="a"/><child link="b"/>{inside}</joint></robot>'
    )


def links(names, joints):
    """A URDF of links and of fixed joints from one to another."""
    text = "".join(f'<link name="{name}"/>' for name in names)
    for parent, child in joints:
        text += f'<joint name="{parent}-{child}" type="fixed"><parent link="{parent}"/><child link="{child}"/></joint>'
    return f'<robot name="r">{text}</robot>'


@pytest.mark.parametrize("count", [1000, 1001])
def test_a_thousand_links_are_one_on_the_other_at_most(count):
    names = [str(k) for k in range(count)]
    text = links(names, list(itertools.pairwise(names)))
    if count == 1000:
        assert ClosedChain.from_urdf(text, BARE).model.existBodyName("999")
        return
    with pytest.raises(FileFormatError, match="more than 1000 links"):
        ClosedChain.from_urdf(text, BARE)


@pytest.mark.parametrize(
    ("given", "limits"),
    [('upper="0.5"', (0.0, 0.5)), ('lower="-0.5"', (-0.5, 0.0)), ("", (0.0, 0.0)), ('lower="0.5"', None)],
)
def test_a_limit_that_is_left_out_is_zero(given, limits):
    text = GOOD.replace('lower="-1" upper="1"', given)
    if limits is None:
        with pytest.raises(FileFormatError, match=r"lower <= upper, got 0\.5 and 0"):
            ClosedChain.from_urdf(text, BARE)
        return
    model = ClosedChain.from_urdf(text, BARE).model
    assert (model.lowerPositionLimit[0], model.upperPositionLimit[0]) == limits


def test_joints_without_limits_have_none_on_either_side():
    crossed = ClosedChain.from_urdf(GOOD.replace('lower="-1"', 'lower="1.5"'), BARE, leave_out=["empty_limits"]).model
    gear = Closures("r", closures=(Closure("gear", "coupling", "universe", "knee", polynomial=(0.1,)),))
    counting = ClosedChain.from_urdf(GOOD.replace('"revolute"', '"continuous"'), gear).model
    for model in (crossed, counting):
        assert (model.nq, model.lowerPositionLimit[0], model.upperPositionLimit[0]) == (1, -INF, INF)
        assert (model.lowerEffortLimit[0], model.upperEffortLimit[0]) == (-3.0, 3.0)


@pytest.mark.parametrize(
    "axis", ["0 0 1", "0 0 8", "0 0 1e-3", "0 0 1e200", "0 1e-5 0", "-0.6 0 0.8", "3e200 0 -4e200", "1 2 3"]
)
def test_an_axis_of_any_length_is_a_direction(axis):
    chain = ClosedChain.from_urdf(GOOD.replace('xyz="0 0 1"', f'xyz="{axis}"'), BARE)
    direction = np.array(axis.split(), dtype=float)
    direction /= np.abs(direction).max()
    turn = pin.AngleAxis(0.7, direction / np.linalg.norm(direction)).toRotationMatrix()
    there = chain.model.jointPlacements[1].rotation.T @ chain.placement(np.array([0.7]), "b").rotation
    np.testing.assert_allclose(there, turn, atol=1e-15)
    # Nothing is rounded where Pinocchio reads it, too.
    if "e" not in axis:
        plain = pin.buildModelFromXML(GOOD.replace('xyz="0 0 1"', f'xyz="{axis}"'))
        data = plain.createData()
        pin.forwardKinematics(plain, data, np.array([0.7]))
        np.testing.assert_array_equal(chain.placement(np.array([0.7]), "b").homogeneous, data.oMi[1].homogeneous)
