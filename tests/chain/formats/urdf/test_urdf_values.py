"""What numbers of a URDF may be: inertias of few digits, limits, axes, origins, versions and depths."""

import itertools

import numpy as np
import pinocchio as pin
import pytest
from said_of_files import SAID
from urdf_knee import BARE, GOOD

from exo_pin import FileFormatError
from exo_pin.chain import ClosedChain, Closure, Closures

INF = np.inf
INERTIA = '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'


@pytest.mark.parametrize(("mass", "moments", "said"), SAID["urdf_inertias"])
def test_inertias_are_those_of_a_body_or_explained_by_their_digits(mass, moments, said):
    values = dict(zip(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), [*moments, "0", "0", "0"], strict=False))
    given = " ".join(f'{key}="{value}"' for key, value in values.items())
    text = GOOD.replace('mass value="2"', f'mass value="{mass}"').replace(INERTIA, f"<inertia {given}/>")
    if said not in (None, "rounding"):
        with pytest.raises(FileFormatError, match=said):
            ClosedChain.from_urdf(text, BARE)
        return
    chain = ClosedChain.from_urdf(text, BARE)
    body = chain.model.inertias[1]
    found = [body.mass, *np.diag(body.inertia), *body.inertia[[0, 0, 1], [1, 2, 2]]]
    expected = [float(word) for word in (mass, *values.values())]
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-15 * np.abs(expected).max())
    assert [text.partition(":")[0] for text in chain.description.left_out] == ([said] if said else [])


def joint(version, kind, inside):
    return (
        f'<robot name="r" version="{version}"><link name="a"/><link name="b"/><joint name="j" type="{kind}">'
        f'<parent link="a"/><child link="b"/>{inside}</joint></robot>'
    )


@pytest.mark.parametrize(("version", "kind", "inside", "said"), SAID["urdf_joints_read"])
def test_elements_of_a_joint_are_read(version, kind, inside, said):
    report = ClosedChain.from_urdf(joint(version, kind, inside), BARE).description.left_out
    assert len(report) == (said is not None)
    assert (said or "") in "".join(report)


@pytest.mark.parametrize(("version", "kind", "inside", "said"), SAID["urdf_joints_refused"])
def test_elements_of_a_joint_are_refused(version, kind, inside, said):
    with pytest.raises(FileFormatError, match=said):
        ClosedChain.from_urdf(joint(version, kind, inside), BARE)


def links(names, joints):
    """A URDF of links and of fixed joints from one to another."""
    text = "".join(f'<link name="{name}"/>' for name in names)
    for parent, child in joints:
        text += f'<joint name="{parent}-{child}" type="fixed"><parent link="{parent}"/><child link="{child}"/></joint>'
    return f'<robot name="r">{text}</robot>'


@pytest.mark.parametrize(("names", "joints", "said"), SAID["urdf_trees"])
def test_links_make_one_tree(names, joints, said):
    if said is None:
        model = ClosedChain.from_urdf(links(names, joints), BARE).model
        assert all(model.existBodyName(name) for name in names)
        return
    with pytest.raises(FileFormatError, match=said):
        ClosedChain.from_urdf(links(names, joints), BARE)


@pytest.mark.parametrize("count", [1000, 1001])
def test_a_thousand_links_are_one_on_the_other_at_most(count):
    names = [str(k) for k in range(count)]
    text = links(names, list(itertools.pairwise(names)))
    if count == 1000:
        assert ClosedChain.from_urdf(text, BARE).model.existBodyName("999")
        return
    with pytest.raises(FileFormatError, match="more than 1000 links"):
        ClosedChain.from_urdf(text, BARE)


@pytest.mark.parametrize(("version", "inside", "said"), SAID["urdf_pictures"])
def test_pictures_are_one_shape_of_their_version(version, inside, said):
    link = f'<link name="a"><visual><geometry>{inside}</geometry></visual></link>'
    found = ClosedChain.from_urdf(f'<robot name="r" version="{version}">{link}</robot>', BARE).description
    assert len(found.shapes) == (said is None)
    assert len(found.left_out) == (said is not None)
    assert (said or "") in "".join(found.left_out)


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
