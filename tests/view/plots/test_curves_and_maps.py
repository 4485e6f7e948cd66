"""Curves along poses and maps over angles: limits, cuts, marks and colours are those of the answers."""

import matplotlib

matplotlib.use("agg")

import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_hex

import exo_pin as ep
from exo_pin.load_case.ranges_of_motion import DAILY_RANGES
from exo_pin.muscle import muscle_model, steady_states
from exo_pin.view import plots
from exo_pin.view.plots.angle_maps import shoulder_force_map
from exo_pin.view.plots.muscle_plots import plot_force_map
from exo_pin.view.plots.plot_style import force_scale
from exo_pin.workspace import CRITERIA
from exo_pin.wrist.singularities.singular_surface import daily_crossings

ANGLES = np.arange(0.0, 91.0, 3.0)


@pytest.fixture(scope="module")
def exo():
    return ep.load("prototype").worn_by(ep.Arm.from_anthropometry(1.75, 75, "male"))


@pytest.fixture(scope="module")
def crossing(exo):
    """A lift across the singular surface."""
    return exo.reaction(exo.pose(ANGLES), limits="none")


def end_of(values, *edges):
    """Where an axis is cut: half as high again as what nine of ten poses stay below, as far as that is too low."""
    known = np.abs(values[np.isfinite(values).all(axis=1)])
    usual = max(np.percentile(known.max(axis=1), 90.0), *edges, 0.0)
    return 1.5 * usual if known.max() > 3.0 * usual else None


def test_axes_are_cut_where_a_few_poses_would_press_all_others_flat(crossing):
    top, bottom = crossing.plot(ANGLES, "flexion, °").axes[:2]
    forces = np.column_stack([crossing.magnitude, crossing.shoulder_force])
    for ax, values, name in ((top, forces, "|F_s|"), (bottom, crossing.actuator_forces, "|f|")):
        end = end_of(values)
        low, high = np.nanmin(values), np.nanmax(values)
        np.testing.assert_allclose(ax.get_ylim(), [max(1.05 * low, -end), min(1.05 * high, end)])
        peak = float(f"{np.nanmax(np.abs(values)):.3g}")
        assert ax.get_title(loc="right") == f"axis cut: {name} up to {peak:.0f} N beside a singular pose"
    # What is drawn as a limit is on the picture.
    high = 0.9 * np.nanmax(np.abs(crossing.actuator_forces))
    bottom = crossing.plot(ANGLES, limits=(0.0, high)).axes[1]
    assert bottom.get_ylim()[1] >= high
    assert not bottom.get_title(loc="right")


def test_limits_are_a_band_or_lines_of_each_limb(crossing):
    falling = ANGLES[::-1]
    bottom = crossing.plot(falling, "flexion, °", limits=(0.0, 200.0)).axes[1]
    (band,) = [each for each in bottom.collections if each.get_label() == "limits of the actuators"]
    corners = band.get_paths()[0].vertices
    assert (corners[:, 0].min(), corners[:, 0].max()) == (0.0, 90.0)
    assert sorted(set(corners[:, 1])) == [0.0, 200.0]
    x, y = corners[:-1].T
    assert abs(x @ np.roll(y, 1) - y @ np.roll(x, 1)) / 2.0 == pytest.approx(90.0 * 200.0)
    for k in range(3):
        force = crossing.actuator_forces[:, k]
        beyond = (force < 0.0) | (force > 200.0)
        (crosses,) = [line for line in bottom.get_lines() if line.get_label() == f"limb {k + 1} beyond limits"]
        np.testing.assert_array_equal(crosses.get_xydata(), np.stack([falling, force], axis=1)[beyond])
        assert crosses.get_markevery() == max(beyond.sum() // 20, 1)
        own = next(line for line in bottom.get_lines() if line.get_label() == f"limb {k + 1}")
        assert to_hex(own.get_color()) == to_hex(crosses.get_color())
    low, high = [-10.0, -20.0, -30.0], [50.0, np.inf, 70.0]
    bottom = crossing.plot(ANGLES, limits=(low, high)).axes[1]
    assert not [each for each in bottom.collections if each.get_label() == "limits of the actuators"]
    thin = [line for line in bottom.get_lines() if line.get_alpha() == 0.7]
    assert [line.get_ydata()[0] for line in thin] == [edge for pair in zip(low, high, strict=True) for edge in pair]


def test_poses_near_a_singular_one_are_grey(crossing, exo):
    near = np.isin(crossing.equilibrium_status, ("near_singular", "singular", "folded"))
    dense = exo.reaction(exo.pose(np.linspace(20.0, 40.0, 21)), limits="none") if not near.any() else crossing
    stamps = ANGLES if dense is crossing else np.linspace(20.0, 40.0, 21)
    near = np.isin(dense.equilibrium_status, ("near_singular", "singular", "folded"))
    top = dense.plot(stamps).axes[0]
    spans = [(patch.get_x(), patch.get_x() + patch.get_width()) for patch in top.patches]
    edges = np.concatenate([stamps[:1], (stamps[1:] + stamps[:-1]) / 2.0, stamps[-1:]])
    np.testing.assert_allclose(spans, [(edges[k], edges[k + 1]) for k in np.flatnonzero(near)] or np.zeros((0,)))
    labels = [text.get_text() for text in top.get_legend().get_texts()]
    assert labels.count("near singular") == near.any()
    assert labels.count("det X = 0 crossed") == bool(len(dense.crossings()))


def test_bars_of_a_pose_have_limits_and_words():
    exo = ep.load("four-linear-actuators-worn").worn_by(ep.Wearer(1.75, 75, "male"))
    answer = exo.reaction(exo.pose(60.0, 20.0))
    figure = answer.plot(limits=(-np.inf, [300.0, np.inf, 200.0, 100.0]))
    limbs, shoulder = figure.axes
    places = [line for each in limbs.collections for line in each.get_segments()]
    np.testing.assert_allclose([line[:, 0] for line in places], [(k - 0.42, k + 0.42) for k in (0, 2, 3)])
    np.testing.assert_allclose([line[0, 1] for line in places], [300.0, 200.0, 100.0])
    assert [text.get_text() for text in limbs.get_legend().get_texts()] == ["limits of the actuator"]
    assert [text.get_text() for text in limbs.texts] == [f"{round(force)}" for force in answer.actuator_forces]
    assert [text.get_text().split("\n")[0] for text in limbs.get_xticklabels()] == [f"limb {k}" for k in range(1, 5)]
    colours = [to_hex(bar.get_facecolor()) for bar in limbs.patches]
    assert len(set(colours)) == 2
    assert len({colour for colour, force in zip(colours, answer.actuator_forces, strict=True) if force > 0}) == 1
    numbers = [float(text.get_text()) for text in shoulder.texts]
    np.testing.assert_allclose(numbers, [answer.magnitude, *answer.shoulder_force, answer.cuff_pull], atol=0.5)
    assert shoulder.get_title() == f"shoulder on the arm: {float(answer.percent_body_weight):.1f} % of body weight"
    assert "split “spherical”; hatched: equilibrium alone does not determine it" in figure.get_supxlabel()
    bare = ep.load("prototype").replace(arm=ep.Arm(3.0, [0.0, 0.0, -0.3]))
    figure = bare.reaction(bare.pose(20.0), limits="none").plot()
    assert figure.axes[1].get_title() == "shoulder on the arm"


def mesh_of(ax):
    return [each for each in ax.collections if isinstance(each, QuadMesh)]


def test_a_map_of_forces_has_those_that_are_held_and_pale_ones_that_are_not():
    exo = ep.load("four-cables")
    ax = shoulder_force_map(exo, internal_rotation=10.0, step=20.0)
    flexion, abduction = np.arange(-20.0, 130.0, 20.0), np.arange(-4.0, 116.0, 20.0)
    poses = ep.shoulder_rotation(flexion[None], abduction[:, None], 10.0, degrees=True)
    answer = exo.reaction(poses)
    held, pale = (np.ma.filled(mesh.get_array(), np.nan).reshape(answer.status.shape) for mesh in mesh_of(ax))
    np.testing.assert_allclose(held, np.where(answer.held, answer.percent_body_weight, np.nan), rtol=1e-6)
    np.testing.assert_allclose(pale, np.where(answer.held, np.nan, answer.percent_body_weight), rtol=1e-6)
    assert [mesh.get_alpha() for mesh in mesh_of(ax)] == [None, 0.55]
    norm, _ = force_scale(np.asarray(answer.percent_body_weight))
    assert mesh_of(ax)[0].norm.boundaries.tolist() == norm.boundaries.tolist()
    assert ax.figure.axes[1].get_ylabel() == "|F_s|, % of body weight"
    assert (
        ax.get_title() == "four-cables, internal rotation 10°:\nforce on the shoulder joint, limbs without side force"
    )
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("flexion, °", "abduction, °")
    edges = mesh_of(ax)[0].get_coordinates()
    np.testing.assert_allclose(0.5 * (edges[0, 1:, 0] + edges[0, :-1, 0]), flexion)
    np.testing.assert_allclose(0.5 * (edges[1:, 0, 1] + edges[:-1, 0, 1]), abduction)
    # Of three limbs the singular curve is drawn, and without a person the unit is newton.
    three = ep.load("prototype").replace(arm=ep.Arm(3.0, [0.0, 0.0, -0.3]))
    ax = shoulder_force_map(three, step=2.0, split="minimal", constraint_bounds=20.0, limits="none")
    assert "split minimal" in ax.get_title()
    assert ax.figure.axes[1].get_ylabel() == "|F_s|, N"
    assert "singular: det X = 0" in [text.get_text() for text in ax.get_legend().get_texts()]
    lines = [each for each in ax.collections if list(getattr(each, "levels", [])) == [0.0]]
    curve = np.concatenate([path.vertices for each in lines for path in each.get_paths()])
    assert (len(lines), len(curve) > 20) == (2, True)
    found = three.singularity(ep.shoulder_rotation(curve[:, 0], curve[:, 1], 0.0, degrees=True)).determinant
    assert np.percentile(np.abs(found), 80.0) < 5e-3


def test_a_map_of_the_determinant_has_daily_ranges_and_the_side_of_rest(exo):
    ax = plots.determinant_map(exo, step=5.0)
    (mesh,) = mesh_of(ax)
    values = np.ma.filled(mesh.get_array(), np.nan)
    full = max(0.3, np.percentile(np.abs(values[np.isfinite(values)]), 95.0))
    np.testing.assert_allclose(mesh.get_clim(), [-full, full])
    labels = {line.get_label(): line for line in ax.get_lines() if not line.get_label().startswith("_")}
    crossings = daily_crossings(exo.geometry, DAILY_RANGES)
    for each in crossings:
        frame = labels[f"{each.range.name}: {100 * each.across:.0f} % beyond"].get_xydata()
        for k, (low, high) in enumerate((each.range.flexion_deg, each.range.abduction_deg)):
            assert (frame[:, k].min(), frame[:, k].max()) == (low, high)
        assert len(frame) == 5
        assert (frame[0] == frame[-1]).all()
    assert len({str(labels[name]._dash_pattern) for name in labels if "beyond" in name}) == len(crossings)
    curve = np.concatenate([line.get_xydata() for line in ax.get_lines() if line.get_linewidth() == 3.0])
    found = exo.singularity(ep.shoulder_rotation(curve[:, 0], curve[:, 1], 0.0, degrees=True)).determinant
    assert np.abs(found).max() < 0.02
    rest = float(exo.singularity(exo.pose()).determinant)
    name = f"rest, det X {'<' if rest < 0 else '>'} 0"
    np.testing.assert_array_equal(labels[name].get_xydata(), [[0.0, 0.0]])
    assert (ax.get_xlim(), ax.get_ylim()) == ((-10.0, 115.0), (-25.0, 100.0))
    assert "singular poses, at internal rotation 0°" in ax.get_title()
    turned = plots.determinant_map(exo, internal_rotation=30.0, step=10.0)
    assert "at internal rotation 30°" in turned.get_title()
    assert not [line for line in turned.get_lines() if line.get_label().startswith("rest")]
    assert "across from rest" in [text.get_text() for text in turned.get_legend().get_texts()]


def test_slices_have_the_colour_of_what_is_not_met():
    found = ep.load("four-cables").workspace(24.0, ["forces", "stroke", "singularity"])
    figure = plots.workspace_slices(found)
    layers = np.unique(np.linspace(0, found.inside.shape[2] - 1, 6).round().astype(int))
    panels = [ax for ax in figure.axes if mesh_of(ax)]
    named = [text.get_text() for text in figure.legends[0].get_texts()]
    handles = {
        text: to_hex(patch.get_facecolor()) for text, patch in zip(named, figure.legends[0].get_patches(), strict=True)
    }
    for ax, layer in zip(panels, layers, strict=True):
        (mesh,) = mesh_of(ax)
        colours = mesh.cmap(mesh.norm(mesh.get_array())).reshape(*found.inside.shape[1::-1], 4)
        first = np.array([[str(text).split(", ")[0] for text in row] for row in found.reasons[..., layer]]).T
        for name in np.unique(first):
            want = handles["inside"] if not name else to_hex(CRITERIA[name].colour)
            assert {to_hex(colour) for colour in colours[first == name]} == {want}
    assert f"{100 * found.index:.1f} % of the poses inside" in " ".join(figure.get_suptitle().split())


def test_a_map_of_a_muscle_has_its_force_and_where_it_holds():
    model, states = muscle_model("best"), steady_states()
    figure = plot_force_map(model, states)
    ax, bar = figure.axes
    high = model.validity.strain[1]
    np.testing.assert_allclose(ax.get_xlim(), [0.0, 1.12e3 * high * model.length])
    np.testing.assert_allclose(ax.get_ylim(), [0.0, 1.1e-5 * model.validity.pressure[1]])
    points = [each for each in ax.collections if type(each).__name__ == "PathCollection"]
    for dots, valid in zip(points, (True, False), strict=True):
        pick = states.called_valid == valid
        want = np.stack([1e3 * states.contraction[pick], 1e-5 * states.pressure[pick]], axis=1)
        np.testing.assert_allclose(dots.get_offsets(), want)
    levels = bar.get_yticks()
    lines = [each for each in ax.collections if hasattr(each, "levels") and not each.filled and len(each.levels) > 1]
    (contours,) = lines
    np.testing.assert_allclose(contours.levels, levels)
    reached = 0
    for level, path in zip(contours.levels, contours.get_paths(), strict=True):
        for x, p in path.vertices[::25]:
            force = float(np.ma.getdata(model.force(1e-3 * x, 1e5 * p, outside="mark")))
            assert force == pytest.approx(level, abs=0.02 * levels[-1])
            reached += not np.isfinite(force) or np.ma.is_masked(model.force(1e-3 * x, 1e5 * p, outside="mark"))
    assert reached  # lines go on beyond the region where the model holds
    for text in contours.labelTexts:
        share = np.array(text.get_position()) / (ax.get_xlim()[1], ax.get_ylim()[1])
        assert (share > 0.05).all()
        assert (share < 0.95).all()
    assert ax.get_title(loc="left") == f"Pull of a {1e3 * model.length:.0f} mm muscle, {model.name}"
    named = [text.get_text() for text in figure.legends[0].get_texts()]
    assert named == ["the model holds inside", "measured, called valid", "measured, beyond"]
