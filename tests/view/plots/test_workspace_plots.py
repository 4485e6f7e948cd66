import matplotlib

matplotlib.use("Agg")

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import InvalidInput, MissingData
from exo_pin.view.plots import (
    design_drawing,
    rate_slices,
    rotation_ball,
    workspace_slices,
)


@pytest.fixture(scope="module")
def found():
    return ep.load("four-cables").workspace(14.0, ep.Criteria(body=ep.BodyShape.of(ep.Wearer(1.75, 75, "male"))))


def images(figure):
    return [mesh for ax in figure.axes for mesh in ax.collections if mesh.get_array() is not None]


def test_slices_show_what_is_inside(found):
    figure = workspace_slices(found)
    drawn = [mesh.get_array() for mesh in images(figure)]
    assert len(drawn) == 6
    layers = np.linspace(0, found.inside.shape[2] - 1, 6).round().astype(int)
    for values, layer in zip(drawn, layers, strict=True):
        np.testing.assert_array_equal(
            np.asarray(values).reshape(found.inside.shape[1::-1]) == 0, found.inside[..., layer].T
        )
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels[0] == "inside"
    assert "not met: forces of the actuators" in labels


@pytest.mark.parametrize("side", ["left", "right"])
def test_axes_of_the_slices_are_the_grid(side):
    exo = ep.load("four-cables", side=side)
    figure = workspace_slices(exo.workspace(14.0, ["singularity"]))
    ax = figure.axes[0]
    edges = images(figure)[0].get_coordinates()
    centres = 0.5 * (edges[:-1, :-1] + edges[1:, 1:])
    np.testing.assert_allclose(centres[0, :, 0], 110.0 - 14.0 * np.arange(8), atol=1e-6)
    np.testing.assert_allclose(centres[:, 0, 1], -4.0 + 14.0 * np.arange(8), atol=1e-6)
    assert "internal rotation" in ax.get_title()


def test_ball(found):
    figure = rotation_ball(found)
    assert "% of" in figure.get_suptitle()
    # Inside is drawn over what is not, and the three views show the same rotation vectors.
    vectors = found.poses.as_rotvec().reshape(-1, 3)[found.inside.reshape(-1)]
    for ax, axes in zip(figure.axes[1:], ([0, 1], [0, 2], [1, 2]), strict=True):
        np.testing.assert_allclose(ax.collections[1].get_offsets(), vectors[:, axes])


def test_drawing_has_a_row_a_posture_of_the_wearer():
    exo = ep.load("four-cables")
    figure = design_drawing(exo, exo.pose([0, 60, 60], 0), np.radians([0.0, 0.0, 120.0]))
    assert len(figure.axes) == 9
    arms = [{tuple(patch.get_xy().ravel()) for patch in ax.patches} for ax in figure.axes]
    assert arms[3] & arms[6]  # torso and upper arm stay
    assert arms[3] - arms[6]  # the forearm moved
    assert "elbow 120°" in figure.subfigs[2].get_suptitle()
    named = [text.get_text() for text in figure.legends[0].get_texts()]
    limbs, joints = [f"limb {i}" for i in range(1, 5)], ["joint on the torso", "joint on the arm"]
    assert named == [*limbs, *joints, "frame", "cuff", "elbow", "shoulder"]
    # The elbow is where the wearer's is, seen from the left.
    elbow = [drawn.get_xydata()[0] for drawn in figure.axes[4].lines if drawn.get_markerfacecolor() == "white"]
    place = 1e3 * exo.pose(60, 0).apply([0.0, 0.0, -exo.arm.wearer.upper_arm_length])
    np.testing.assert_allclose(elbow, [place[[0, 2]]])
    # All views have one scale, which holds the whole design.
    (low, high), (front, back) = figure.axes[0].get_ylim(), sorted(figure.axes[1].get_xlim())
    joints = 1e3 * exo.geometry.base_points
    assert low < joints[:, 2].min() < joints[:, 2].max() < high
    assert front < joints[:, 0].min() < joints[:, 0].max() < back


def test_drawing_wants_a_wearer():
    exo = ep.load("prototype").replace(arm=None)
    with pytest.raises(MissingData, match="wearer"):
        design_drawing(exo, exo.pose())


def test_slices_need_a_grid():
    found = ep.load("four-cables").workspace(Rotation.identity(3), ["singularity"])
    with pytest.raises(InvalidInput, match="grid"):
        workspace_slices(found)


@pytest.mark.parametrize("draw", [workspace_slices, rotation_ball])
def test_what_is_no_workspace_is_refused(draw):
    with pytest.raises(InvalidInput, match="found to be a Workspace"):
        draw(3)


def test_slices_of_rates_are_those_of_the_poses_and_hatch_what_is_outside():
    exo = ep.load("four-linear-actuators-worn")
    found = exo.workspace(24.0, ["stroke", "forces"])
    figure = rate_slices(exo, found)
    drawn = [mesh for mesh in images(figure) if mesh.get_array().ndim == 2 and mesh.axes.get_title()]
    rates = exo.accuracy(found.poses, twins=False).mm_per_degree
    layers = np.unique(np.linspace(0, found.inside.shape[2] - 1, 6).round().astype(int))
    for mesh, layer in zip(drawn, layers, strict=True):
        np.testing.assert_allclose(mesh.get_array(), rates[..., layer].T)
    hatched = [each for ax in figure.axes for each in ax.collections if getattr(each, "hatches", None)]
    assert bool(hatched) == (not found.inside.all())
    title = figure.get_suptitle()
    assert f"inside at least {rates[found.inside].min():.2g} mm/°" in " ".join(title.split())
    with pytest.raises(InvalidInput, match="grid of three angles"):
        rate_slices(exo, exo.workspace(exo.pose([0.0, 10.0]), ["stroke"]))
