"""What is drawn is what was answered: curves, bars, maps and cells; words are in the stored descriptions."""

from types import SimpleNamespace

import numpy as np
import pytest
from drawn_figures import lift, movement, prototype, sprung, weightless, workspace
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_hex
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.muscle import muscle_model, steady_states
from exo_pin.study import compare
from exo_pin.view import plots
from exo_pin.view.plots.contact_plots import elevation_in_plane
from exo_pin.workspace import CRITERIA

ANGLES = np.arange(0.0, 91.0, 3.0)


def lines(ax):
    return {line.get_label(): line.get_xydata() for line in ax.get_lines()}


def meshes(ax):
    return [each for each in ax.collections if isinstance(each, QuadMesh)]


def middles(mesh):
    """Middles of the cells, along both axes."""
    edges = np.asarray(mesh.get_coordinates())
    return 0.5 * (edges[0, 1:, 0] + edges[0, :-1, 0]), 0.5 * (edges[1:, 0, 1] + edges[:-1, 0, 1])


def test_curves_are_the_forces_and_end_where_a_few_poses_would_press_all_others_flat():
    answer = lift()
    top, bottom = answer.plot(ANGLES, "flexion, °", (0.0, 200.0)).axes[:2]
    forces = np.column_stack([answer.magnitude, answer.shoulder_force])
    for name, values in zip(("|F_s|", "F_s x forward", "F_s y left", "F_s z up"), forces.T, strict=True):
        np.testing.assert_array_equal(lines(top)[name], np.column_stack([ANGLES, values]))
    for k, force in enumerate(answer.actuator_forces.T):
        np.testing.assert_array_equal(lines(bottom)[f"limb {k + 1}"][:, 1], force)
        beyond = (force < 0) | (force > 200)
        np.testing.assert_array_equal(lines(bottom)[f"limb {k + 1} beyond limits"][:, 0], ANGLES[beyond])
    crossed = [(ANGLES[k] + ANGLES[k + 1]) / 2 for (k,) in answer.crossings()]
    assert lines(top)["det X = 0 crossed"][0, 0] == crossed[0]
    for ax, values, edge in ((top, forces, 0.0), (bottom, answer.actuator_forces, 200.0)):
        usual = max(np.percentile(np.nanmax(np.abs(values[np.isfinite(values).all(axis=1)]), axis=1), 90.0), edge)
        ends = [max(1.05 * np.nanmin(values), -1.5 * usual), min(1.05 * np.nanmax(values), 1.5 * usual)]
        np.testing.assert_allclose(ax.get_ylim(), ends)
    # An angle may fall, where time may not.
    assert answer.plot(ANGLES[::-1]).axes


@pytest.mark.parametrize(("against", "place"), [("time", 0), ("flexion", 1), ("abduction", 2)])
def test_a_movement_is_drawn_over_time_or_an_angle(against, place):
    t = movement().movement.times
    drawn = lines(movement().plot(against).axes[0])["|F_s|"]
    np.testing.assert_allclose(
        drawn, np.column_stack([(t, 30 + 20 * t, 10 + 10 * t)[place], movement().reaction.magnitude])
    )


def test_bars_are_the_forces_of_a_pose():
    pose = prototype().pose(60, 30)
    answer = prototype().reaction(pose, split="minimal", constraint_bounds=(-80, 80), limits="none")
    limbs, shoulder = answer.plot().axes
    every = [*answer.actuator_forces, *answer.constraint_forces]
    np.testing.assert_allclose([bar.get_height() for bar in limbs.patches], every)
    every = [answer.magnitude, *answer.shoulder_force, answer.cuff_pull]
    np.testing.assert_allclose([bar.get_height() for bar in shoulder.patches], every)


def test_poses_without_data_or_not_held_are_marked():
    answer = sprung().reaction(sprung().pose([0.0, 20.0, 60.0, 90.0]))
    assert answer.status.tolist() == ["not_evaluated", "not_evaluated", "ok", "ok"]
    for ax in answer.plot([0.0, 20.0, 60.0, 90.0]).axes[:2]:
        np.testing.assert_array_equal(lines(ax)["not evaluated: no data of a spring"][:, 0], [0.0, 20.0])
    exo = ep.load("three-linear-actuators")
    answer = exo.reaction(exo.pose(np.linspace(0.0, 120.0, 13), 95.0))
    marks = lines(answer.plot().axes[0])["not held: the force that it would take"][:, 0]
    np.testing.assert_array_equal(marks, np.flatnonzero(~answer.can_hold & answer.has_answer))
    assert 0 < len(marks) < 13


@pytest.mark.full
def test_a_detailed_comparison_reports_poses_without_data_apart():
    """Held and singular shares are without them; what needs no spring is as without one."""
    exo = sprung()
    table = compare(exo, exo.replace(springs=[], name="bare"), poses=exo.pose([20.0, 90.0]), detailed=True)
    assert table["not_evaluated"].tolist() == [0.5, 0.0]
    assert table["holdable"].tolist() == [0.5, 1.0]
    for name in ("singular", "median_margin", "reach", "stroke_deg", "follows_10_mm"):
        np.testing.assert_array_equal(table[name][0], table[name][1], err_msg=name)
    assert any(text.startswith("In row 1 a spring has no data in some of the poses") for text in table.cautions)


def test_a_map_has_the_forces_of_its_poses_and_the_singular_curve():
    exo = ep.load("four-cables")
    ax = plots.shoulder_force_map(exo, internal_rotation=10.0, step=20.0)
    flexion, abduction = middles(meshes(ax)[0])
    answer = exo.reaction(ep.shoulder_rotation(flexion, abduction[:, None], 10.0, degrees=True))
    held, pale = (np.ma.filled(mesh.get_array(), np.nan).reshape(answer.status.shape) for mesh in meshes(ax))
    np.testing.assert_allclose(held, np.where(answer.held, answer.percent_body_weight, np.nan), rtol=1e-6)
    np.testing.assert_allclose(pale, np.where(answer.held, np.nan, answer.percent_body_weight), rtol=1e-6)
    assert not answer.held.all()
    ax = plots.shoulder_force_map(weightless(), step=2.0, limits="none")
    drawn = [
        path.vertices
        for each in ax.collections
        if list(getattr(each, "levels", [])) == [0.0]
        for path in each.get_paths()
    ]
    curve = np.concatenate(drawn)
    found = weightless().singularity(ep.shoulder_rotation(curve[:, 0], curve[:, 1], 0.0, degrees=True)).determinant
    assert np.percentile(np.abs(found), 80.0) < 5e-3


def test_a_map_of_the_determinant_is_that_of_its_poses():
    exo = prototype()
    ax = plots.determinant_map(exo, internal_rotation=20.0, step=5.0)
    (mesh,) = meshes(ax)
    flexion, abduction = middles(mesh)
    values = np.ma.filled(mesh.get_array(), np.nan).reshape(len(abduction), len(flexion))
    poses = ep.shoulder_rotation(flexion, abduction[:, None], 20.0, degrees=True)
    np.testing.assert_allclose(values, exo.singularity(poses).determinant, atol=1e-9)
    curve = np.concatenate([line.get_xydata() for line in ax.get_lines() if line.get_linewidth() == 3.0])
    found = exo.singularity(ep.shoulder_rotation(curve[:, 0], curve[:, 1], 20.0, degrees=True)).determinant
    assert np.abs(found).max() < 0.02


def test_slices_have_the_colour_of_what_is_not_met_and_the_rates_of_their_poses():
    found, exo = workspace(24.0), ep.load("four-cables")
    layers = np.unique(np.linspace(0, found.inside.shape[2] - 1, 6).round().astype(int))
    drawn = [mesh for ax in plots.workspace_slices(found).axes for mesh in meshes(ax)]
    rates = [mesh for ax in plots.rate_slices(exo, found).axes if ax.get_title() for mesh in meshes(ax)]
    for mesh, rate, layer in zip(drawn, rates, layers, strict=True):
        colours = mesh.cmap(mesh.norm(mesh.get_array())).reshape(*found.inside.shape[1::-1], 4)
        first = np.array([[str(text).split(", ")[0] for text in row] for row in found.reasons[..., layer]]).T
        for name in np.unique(first):
            shown = {to_hex(colour) for colour in colours[first == name]}
            assert len(shown) == 1
            assert not name or shown == {to_hex(CRITERIA[name].colour)}
        known = exo.accuracy(Rotation.from_quat(found.poses.as_quat()[:, :, layer]), twins=False).mm_per_degree
        np.testing.assert_allclose(rate.get_array().reshape(known.T.shape), known.T)
    # On the grid, also beyond 90° where angles fold back.
    flexion, abduction = middles(drawn[0])
    np.testing.assert_allclose(np.diff(flexion), flexion[1] - flexion[0])
    np.testing.assert_allclose(np.diff(abduction), 24.0)


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("abduction", [(0.0, 150.0), (80.0, 100.0), (100.0, 150.0)])
def test_slices_stand_over_the_angles_of_their_grid(side, abduction):
    exo = ep.load("four-cables", side=side)
    angles = np.arange(-30.0, 91.0, 30.0), np.linspace(*abduction, 3), np.array([60.0, 10.0, -40.0])
    figure = plots.workspace_slices(exo.workspace(exo.pose(*np.meshgrid(*angles, indexing="ij"))))
    for ax, internal in zip(figure.axes, angles[2], strict=True):
        assert ax.get_title() == f"internal rotation {internal:.0f}°"
        np.testing.assert_allclose(middles(meshes(ax)[0])[0], angles[0], atol=1e-9)
        np.testing.assert_allclose(middles(meshes(ax)[0])[1], angles[1], atol=1e-9)


def test_a_muscles_map_has_its_force_on_every_line():
    model = muscle_model("best")
    (contours,) = (
        each
        for each in plots.plot_force_map(model, steady_states()).axes[0].collections
        if hasattr(each, "levels") and not each.filled and len(each.levels) > 1
    )
    for level, path in zip(contours.levels, contours.get_paths(), strict=True):
        for x, p in path.vertices[::25]:
            force = float(np.ma.getdata(model.force(1e-3 * x, 1e5 * p, outside="mark")))
            assert force == pytest.approx(level, abs=0.02 * contours.levels[-1])


def test_planes_of_elevation():
    """A pose is on its own curve: lifted in its plane and turned about the arm as it is."""
    asked = {}
    subject = SimpleNamespace(joint_contact=lambda poses, **query: asked.update(poses=poses, query=query))
    for side, outward in (("left", 1.0), ("right", -1.0)):
        pose = ep.shoulder_rotation(40.0, 50.0, 15.0, side=side, degrees=True)
        elevation, _, azimuth = elevation_in_plane(subject, pose, side, limits="none")
        assert asked["query"] == {"limits": "none", "outside": "mark"}
        down = asked["poses"].apply([0.0, 0.0, -1.0])
        np.testing.assert_allclose(np.degrees(np.arccos(-down[:, 2])), elevation)
        lifted = pose.apply([0.0, 0.0, -1.0])
        flat = lifted[:2] / np.linalg.norm(lifted[:2])
        np.testing.assert_allclose(down[:, :2], np.sin(np.radians(elevation))[:, None] * flat, atol=1e-12)
        assert azimuth == pytest.approx(np.degrees(np.arctan2(outward * flat[1], flat[0])))
        own = np.degrees(np.arccos(-lifted[2]))
        below, above = (asked["poses"][k] for k in (int(own // 5) - 1, int(own // 5)))
        assert np.degrees((below.inv() * pose).magnitude()) == pytest.approx(own % 5.0, abs=1e-6)
        assert np.degrees((above.inv() * pose).magnitude()) == pytest.approx(5.0 - own % 5.0, abs=1e-6)
        assert elevation_in_plane(subject, ep.shoulder_rotation(0, 0, 0), side)[2] == 90.0


def test_a_cell_of_a_box_is_the_median_over_the_internal_rotations():
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    box = (np.array([0.0, 40.0, 80.0]), np.array([0.0, 50.0]), np.array([-10.0, 10.0, 150.0]))
    person, poses = ep.Person(1.75, 75, "male"), ep.shoulder_rotation(*np.meshgrid(*box, indexing="ij"), degrees=True)
    contact = ep.load("four-cables").joint_contact(poses, person, outside="mark")
    values = (contact.without_device.percent_body_weight, contact.percent_body_weight, contact.relief_percent)
    for ax, each in zip(plots.contact_over_box(box, contact).axes, values, strict=False):
        drawn = np.ma.filled(ax.collections[0].get_array(), np.nan).ravel()
        np.testing.assert_allclose(drawn, np.nanmedian(each, axis=-1).T.ravel(), rtol=1e-12)
