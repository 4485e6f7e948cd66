"""Maps over flexion and abduction: shoulder force, and det X with the singular poses.

Pictures of a workspace: the ball of rotations, and slices with the reasons.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ... import wrist
from ...core.conventions import shoulder_angles, shoulder_rotation
from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.validation import FloatArray, as_positive, as_single_rotation, require_method, require_type
from ...load_case.ranges_of_motion import DAILY_RANGES, RangeOfMotion
from ...reaction.answer import STANDARD_GRAVITY
from ...reaction.holding.verdict import angle_words
from ...workspace import CRITERIA, Workspace
from ...wrist.singularities import measures as loci
from ...wrist.singularities.singular_surface import daily_crossings, side_of_rest
from ..colours import BLACK, BLUE, RED
from .answer_plots import pose_bars
from .plot_style import (
    WIDEST,
    axes_or_new,
    figure_title,
    force_scale,
    legend_below,
    minded,
    new_figure,
    pyplot,
    tidy,
    wrapped,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ...exo.shoulder_exo import ShoulderExo
    from ...reaction import Reaction
    from ...reaction.assumptions import Question
    from ...workspace.optimisation.optimised import Optimised
    from ...workspace.optimisation.stored_study import SearchRun

#: Colour of the hatches over poses that are not held.
_HATCH = "0.35"


@checked
def shoulder_force_map(
    exo: ShoulderExo,
    ax: Axes | None = None,
    internal_rotation: float = 0.0,
    step: float | None = None,
    **query: Unpack[Question],
) -> Axes:
    """Map |F_s| of the arm at rest over flexion and abduction, with the singular curve det X = 0.

    The forces are those of :meth:`exo_pin.ShoulderExo.reaction_map`. Poses that the device cannot hold are hatched and
    pale: their forces are those that would be needed.

    Parameters
    ----------
    exo : ShoulderExo
        With an arm; three limbs without mass.
    ax : matplotlib Axes, optional
        Where to draw; a new figure if left out.
    internal_rotation : float
        Held fixed, degrees.
    step : float, optional
        Of the grid, degrees; 0.5 for three limbs, 1 for more and 10 for a device that is not a wrist if left out.
    **query
        Of :meth:`exo_pin.ShoulderExo.reaction_map`: ``split``, ``limits``, ...

    Returns
    -------
    matplotlib.axes.Axes
    """
    require_method("exo", exo, "reaction", "a ShoulderExo")
    ax = axes_or_new(ax, 6, 5)
    finest = 10.0 if exo.wrist is None else 1.0 if exo.geometry.limb_count > 3 else 0.5
    step = finest if step is None else as_positive("step", step)
    flexion, abduction = np.arange(-20, 110 + step, step), np.arange(-4, 96 + step, step)
    poses = shoulder_rotation(flexion[None, :], abduction[:, None], internal_rotation, side=exo.side, degrees=True)
    arm = exo.device.require_arm("a map of forces")
    answer = exo.reaction_map(poses, keep=("magnitude", "status"), **query)
    split = query.get("split", "spherical")
    how = ", limbs without side force" if split == "spherical" else f", split {split}"
    _coloured(ax, flexion, abduction, np.asarray(answer.magnitude), answer.held, arm.body_mass)
    if exo.wrist is not None and exo.geometry.limb_count == 3:
        determinant = wrist.singularity(exo.geometry, poses).determinant
        ax.contour(flexion, abduction, determinant, levels=[0.0], colors="white", linewidths=3.0)
        ax.contour(flexion, abduction, determinant, levels=[0.0], colors="black", linewidths=1.5)
        ax.plot([], [], color="black", linewidth=1.5, label="singular: det X = 0")
    ax.set(xlabel="flexion, °", ylabel="abduction, °")
    # Adding zero turns -0 into 0. A device that is not a wrist has no limbs with side forces.
    turn = f"{round(internal_rotation, 1) + 0.0:g}"
    words = f"{exo.name}, internal rotation {turn}°:\nforce on the shoulder joint{how if exo.wrist is not None else ''}"
    ax.set_title(words, fontsize=10.5)
    legend_below(ax, 1)
    return ax


def _coloured(
    ax: Axes,
    flexion: FloatArray,
    abduction: FloatArray,
    force: FloatArray,
    held: NDArray[np.bool_],
    body_mass: float | None,
) -> None:
    """Colour the map by |F_s|, shape (abduction, flexion), with a bar; in percent of body weight if that is known.

    Poses that are not held are pale and hatched.
    """
    unit, name = 1.0, "|F_s|, N"
    if body_mass is not None:
        unit, name = 100.0 / (body_mass * STANDARD_GRAVITY), "|F_s|, % of body weight"
    norm, extend = force_scale(force * unit)
    look: dict[str, Any] = {"norm": norm, "cmap": "cividis", "shading": "nearest", "rasterized": True}
    image = ax.pcolormesh(flexion, abduction, np.where(held, force * unit, np.nan), **look)
    if not held.all():
        ax.pcolormesh(flexion, abduction, np.where(held, np.nan, force * unit), alpha=0.55, **look)
        # Hatches reach to the edges of the outer fields.
        x, y = (
            np.concatenate([[at[0] - half], at, [at[-1] + half]])
            for at, half in ((flexion, 0.5 * np.ptp(flexion[:2])), (abduction, 0.5 * np.ptp(abduction[:2])))
        )
        hatched = ax.contourf(x, y, np.pad(~held, 1, mode="edge"), levels=[0.5, 1.5], colors="none", hatches=["//"])
        hatched.set(edgecolor=_HATCH, linewidth=0.0)
        is_needed = bool(np.isfinite(force[~held]).any())
        label = "cannot be held; colour: force that would be needed" if is_needed else "no forces: singular, or no data"
        ax.fill([], [], facecolor="white", edgecolor=_HATCH, hatch="////", label=label)
    if np.isfinite(force).any():
        ax.figure.colorbar(image, ax=ax, extend=extend, label=name, format="{x:g}")


def overview(exo: ShoulderExo, poses: Rotation, answer: Reaction | None = None) -> Figure:
    """The forces in a pose, that pose on the map of shoulder force, and whether it can be held.

    Parameters
    ----------
    exo : ShoulderExo
        With an arm.
    poses : Rotation
        A single pose.
    answer : Reaction, optional
        The forces of this pose, in place of those of :meth:`exo_pin.ShoulderExo.reaction`. The map asks the same
        question; that of a device that gives way is of rigid limbs, because it would take minutes.
    """
    require_method("exo", exo, "reaction", "a ShoulderExo")
    pose = as_single_rotation("poses", poses)
    answer = exo.reaction(pose) if answer is None else answer
    assumed, rigid = answer.assumptions, not answer.source.split.moves
    case, query = answer.case, dict[str, Any](limits=assumed.limits)
    query |= {"centre_offset": case.centre_offset, "load": case.load, "motion": case.motion}
    # A configuration is of its pose alone.
    query |= {"posture": case.posture} if isinstance(case.posture, Mapping) else {}
    if rigid:
        query |= {"split": assumed.split, "constraint_bounds": assumed.constraint_bounds}
    figure = pyplot().figure(figsize=(WIDEST, 6.4), layout="constrained")
    forces, chart = figure.subfigures(1, 2, width_ratios=[1.0, 1.05])
    upper, lower = forces.subplots(2, 1)
    pose_bars(forces, upper, lower, answer)
    forces.suptitle(f"{exo.name}:\n{angle_words(pose, exo.side)}", fontsize=10.5)
    flexion, abduction, internal = shoulder_angles(pose, exo.side, degrees=True)
    right = shoulder_force_map(exo, chart.subplots(), internal, **query)
    mark: dict[str, Any] = {"markersize": 9, "markerfacecolor": RED, "markeredgecolor": "white"}
    right.plot(flexion, abduction, "o", **mark, label="the pose on the left")
    legend_below(right, 1)
    figure_title(figure, answer.verdict, *minded(answer.cautions))
    return figure


#: Line styles and labels of the ranges drawn on a map.
_STYLES = ("-", (0, (5, 2)), (0, (1, 1.2)), (0, (5, 1, 1, 1)))
#: |det X| at which the colours end, at least.
_FULL = 0.3
#: Colour of the hatches over poses across from rest.
_ACROSS = "0.45"


def determinant_map(
    exo: ShoulderExo, ax: Axes | None = None, internal_rotation: float = 0.0, step: float = 0.5
) -> Axes:
    """Map det X over flexion and abduction, with the locus, the rest pose and ranges of daily motion.

    Parameters
    ----------
    exo : ShoulderExo
        Three limbs.
    ax : matplotlib Axes, optional
        Where to draw; a new figure if left out.
    internal_rotation : float
        Held fixed, degrees.
    step : float
        Of the grid, degrees.

    Returns
    -------
    matplotlib.axes.Axes
        The legend has the share of each range on the other side of the locus, over all its rotations.
    """
    require_method("exo", exo, "reaction", "a ShoulderExo")
    ax = axes_or_new(ax, 7.5, 6.0)
    # All daily ranges are inside.
    around = RangeOfMotion("map", (-10.0, 115.0), (-25.0, 100.0), (internal_rotation, internal_rotation))
    flexion, abduction, values, curves = loci.shoulder_slice(exo.geometry, internal_rotation, around, step, exo.side)
    rest = side_of_rest(exo.geometry)
    determinant = values.T
    full = max(_FULL, float(np.nanpercentile(np.abs(determinant), 95.0)))
    scale: dict[str, Any] = {"cmap": "PuOr_r", "vmin": -full, "vmax": full}
    image = ax.pcolormesh(flexion, abduction, determinant, **scale, shading="nearest", rasterized=True)
    ax.figure.colorbar(image, ax=ax, extend="both", label="det X", fraction=0.046, pad=0.03)
    side = np.nan_to_num(determinant) * rest
    if side.min() < 0.0:
        hatched = ax.contourf(flexion, abduction, side, levels=[-np.inf, 0.0], colors="none", hatches=["///"])
        hatched.set(edgecolor=_ACROSS, linewidth=0.0)
    for k, curve in enumerate(curves):
        ax.plot(*curve.T, color="white", linewidth=5.5)
        ax.plot(*curve.T, color=BLACK, linewidth=3.0, label="singular, det X = 0" if k == 0 else None)
    labels = [item.name for item in DAILY_RANGES]
    if rest != 0:
        # If the rest pose itself is singular, there is no other side.
        crossings = daily_crossings(exo.geometry, DAILY_RANGES, side=exo.side)
        labels = [f"{item.range.name}: {100 * item.across:.0f} % beyond" for item in crossings]
    for style, item, label in zip(_STYLES, DAILY_RANGES, labels, strict=False):
        (x0, x1), (y0, y1) = item.flexion_deg, item.abduction_deg
        frame = [x0, x1, x1, x0, x0], [y0, y0, y1, y1, y0]
        ax.plot(*frame, color="white", linewidth=4.2, solid_joinstyle="miter")
        ax.plot(*frame, color=BLACK, linestyle=style, linewidth=1.7, label=label)
    if internal_rotation == 0.0:
        ax.plot(0, 0, marker="o", markersize=10, color="white", markeredgecolor=BLACK, markeredgewidth=2,
                linestyle="none", label=f"rest, det X {'<=>'[rest + 1]} 0")  # fmt: skip
    if rest != 0:
        ax.fill_between([np.nan], [np.nan], facecolor="white", edgecolor=_ACROSS, hatch="///", label="across from rest")
    ax.set(xlabel="flexion, °", ylabel="abduction, °", xlim=flexion[[0, -1]], ylim=abduction[[0, -1]])
    name = wrapped(exo.mechanism.title or exo.name, 5.8, 10.5)
    ax.set_title(f"{name}\nsingular poses, at internal rotation {internal_rotation:g}°", fontsize=10.5)
    legend_below(ax)
    return ax


#: Objectives of a search in words, with their units.
_OBJECTIVE_LABELS = {
    "index": "poses inside, %",
    "mean_shoulder_force": "mean |F_s| inside, N",
    "peak_shoulder_force": "largest |F_s| inside, N",
    "median_moment_margin": "median moment held besides, N m",
    "worst_margin": "worst margin, share of its scale",
    "contact_force": "contact force of the joint, N",
    "device_mass": "estimated mass of frame, cuff and drives, kg",
    "merit": "merit of the search, smaller is better",
}


def front_figure(found: Optimised) -> Figure:
    """The runs of a search by two objectives, or by share and merit where there is one, and the front among them.

    Parameters
    ----------
    found : Optimised
        Result of a search; values on the full grid.

    Returns
    -------
    matplotlib.figure.Figure
        Every run a grey dot, the front joined; a square is the start of a refinement.
    """
    names = (*found.objectives, "merit")[:2]

    def place(run: SearchRun, values: dict[str, float]) -> list[float]:
        known = {"merit": run.merit} | values
        return [(100.0 if name == "index" else 1.0) * known[name] for name in names]

    figure, ax = new_figure(6.4, 4.4)
    runs = [place(*each) for each in zip(found.runs, found.values, strict=True)]
    ax.plot(*np.array(runs).T, "o", color="0.7", label="runs")
    front = sorted(place(candidate.run, candidate.objectives) for candidate in found.front)
    ax.plot(*np.array(front).T, "o-", color=BLUE, label="front" if len(found.objectives) > 1 else "reported")
    if found.start is not None:
        hollow = {"markersize": 10, "markerfacecolor": "none", "markeredgewidth": 1.6}
        ax.plot(*place(found.start.run, found.start.objectives), "s", color=BLACK, label="start", **hollow)
    ax.set(
        xlabel=_OBJECTIVE_LABELS[names[0]],
        ylabel=_OBJECTIVE_LABELS[names[1]],
        title=f"{len(found.runs)} run{'s'[: len(found.runs) > 1]} of a search, {found.evaluations} designs",
    )
    ax.locator_params(axis="x", nbins=4)
    legend_below(ax, 3)
    tidy(ax)
    return figure


def rotation_ball(found: Workspace) -> Figure:
    """The poses inside as points of the ball of radius π: the rotation vector of each, as in Figures C-2 and C-3.

    Parameters
    ----------
    found : Workspace
        Any stack.

    Returns
    -------
    matplotlib.figure.Figure
        In space, and seen from above, from the left and from the front; grey is what is not reached.

    Notes
    -----
    Source: thesis Figure C-2, Figure C-3.
    """
    plt = pyplot()
    figure = plt.figure(figsize=(WIDEST, 7.8), layout="constrained")
    require_type("found", found, Workspace)
    vectors = found.poses.as_rotvec().reshape(-1, 3)
    inside = found.inside.reshape(-1)
    space = figure.add_subplot(2, 2, 1, projection="3d")
    space.scatter(*vectors[~inside].T, s=1.0, color="0.8", alpha=0.15, rasterized=True)
    space.scatter(*vectors[inside].T, s=2.0, color=BLUE, alpha=0.5, rasterized=True)
    ball = (-np.pi, np.pi)
    space.set(xlabel="x", ylabel="y", zlabel="z", xlim=ball, ylim=ball, zlim=ball, box_aspect=(1, 1, 1))
    space.set_title("rotation vector ω, |ω| in rad")
    for place, (first, second, title) in enumerate(
        ((0, 1, "from above"), (0, 2, "from the right"), (1, 2, "from the front")), start=2
    ):
        ax = figure.add_subplot(2, 2, place)
        ax.add_patch(plt.Circle((0.0, 0.0), np.pi, fill=False, color="0.4", linewidth=1.0))
        ax.scatter(vectors[~inside, first], vectors[~inside, second], s=2.0, color="0.85", rasterized=True)
        ax.scatter(vectors[inside, first], vectors[inside, second], s=3.0, color=BLUE, alpha=0.4, rasterized=True)
        names = ("x forward", "y left", "z up")
        ax.set(xlabel=f"ω_{names[first]}, rad", ylabel=f"ω_{names[second]}, rad", title=title, aspect="equal")
        ax.set(xlim=(-3.4, 3.4), ylim=(-3.4, 3.4))
        tidy(ax)
    figure_title(figure, f"{found.name}: {100 * found.index:.1f} % of {inside.size} poses inside (blue; grey: outside)")
    return figure


def workspace_slices(found: Workspace) -> Figure:
    """Flexion and abduction at six internal rotations: inside, or the first criterion that is not met.

    Parameters
    ----------
    found : Workspace
        On a grid of three angles, such as :func:`exo_pin.adl_box`.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InvalidInput
        If the poses are no grid of three dimensions.
    """
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    require_type("found", found, Workspace)
    names = list(found.margins)
    first = np.zeros(found.inside.shape, dtype=int)
    for code, name in reversed(list(enumerate(names, start=1))):
        first[~found.met[name]] = code
    looks = [("inside", BLUE)]
    looks += [(f"not met: {item.words}", item.colour) for item in (CRITERIA[name] for name in names)]
    colours = ListedColormap([colour for _, colour in looks])
    figure, panels = _panels(found)
    for ax, x, y, layer in panels:
        scale = {"cmap": colours, "vmin": -0.5, "vmax": len(names) + 0.5}
        ax.pcolormesh(x, y, first[..., layer].T, **scale, shading="nearest", rasterized=True)
    handles = [Patch(color=colour, label=label) for code, (label, colour) in enumerate(looks) if (first == code).any()]
    figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 3), frameon=False)
    figure_title(
        figure, f"{found.name}: {100 * found.index:.1f} % of the poses inside", "colour: the first criterion not met"
    )
    return figure


def _grid_angles(found: Workspace) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Flexion, abduction and internal rotation along the axes of a grid, degrees."""
    quaternions = found.poses.as_quat()
    # At 90° of abduction two angles turn about one axis; the layer that is farthest from it names the others.
    middle = int(np.abs(found.poses.as_matrix()[0, :, 0, 1, 2]).argmin())
    lines = quaternions[:, middle, 0], quaternions[0, :, 0], quaternions[0, middle]
    of_flexion, layers, of_rotation = (shoulder_angles(Rotation.from_quat(q), found.side, degrees=True) for q in lines)
    flexion, internal = (np.unwrap(own, period=360.0) for own in (of_flexion[:, 0], of_rotation[:, 2]))
    # Beyond 90° of abduction the angles of an orientation fold back, with half a turn of the two others.
    folded = np.cos(np.radians(layers[:, 0] - layers[middle, 0])) < 0.0
    if abs(internal.mean()) > 90.0:
        folded = ~folded
        flexion, internal = (own - np.copysign(180.0, own.mean()) for own in (flexion, internal))
    return flexion, np.where(folded, 180.0 - layers[:, 1], layers[:, 1]), internal


def _panels(found: Workspace) -> tuple[Figure, list[tuple[Any, FloatArray, FloatArray, int]]]:
    """A figure with one panel a layer: axes, flexion and abduction of the grid, and the layer's index."""
    if found.inside.ndim != 3:
        raise InvalidInput(f"expected poses on a grid of three angles, got a stack of shape {found.inside.shape}")
    flexion, abduction, internal = _grid_angles(found)
    layers = np.unique(np.linspace(0, len(internal) - 1, 6).round().astype(int))
    columns = min(3, len(layers))
    lines = -(-len(layers) // columns)
    cells = {"nrows": lines, "ncols": columns, "squeeze": False, "sharex": True, "sharey": True}
    figure, grid = new_figure(2.8 * columns + 0.5, 2.7 * lines + 1.0, **cells)
    panels = []
    for ax, layer in zip(grid.ravel(), layers, strict=False):
        ax.set_title(f"internal rotation {internal[layer]:.0f}°", fontsize=10)
        panels.append((ax, flexion, abduction, int(layer)))
    for ax in grid.flat:
        at = ax.get_subplotspec()
        ax.set_visible(at.num1 < len(layers))
        ax.set(xlabel="flexion, °" if at.is_last_row() else "", ylabel="abduction, °" if at.is_first_col() else "")
    return figure, panels
