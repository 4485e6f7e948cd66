"""Pictures of a workspace: the ball of rotations, and slices with the reasons."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.conventions import shoulder_angles
from ...core.errors import InvalidInput
from ...core.validation import FloatArray, require_type
from ...workspace import CRITERIA, Workspace
from ..colours import BLACK, BLUE
from .plot_style import WIDEST, figure_title, legend_below, new_figure, pyplot, tidy

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ...workspace.optimisation.optimised import Optimised
    from ...workspace.optimisation.stored_study import SearchRun

#: Objectives of a search in words, with their units.
_OBJECTIVE_LABELS = {
    "index": "share of the poses inside",
    "mean_shoulder_force": "mean |F_s| inside, N",
    "peak_shoulder_force": "largest |F_s| inside, N",
    "median_moment_margin": "median moment held besides, N m",
    "worst_margin": "worst margin, share of its scale",
    "contact_force": "contact force of the joint, N",
    "device_mass": "estimated mass of frame, cuff and drives, kg",
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
    names = found.objectives[:2]
    labels = [_OBJECTIVE_LABELS[name] for name in names] + ["merit of the search, smaller is better"][: 2 - len(names)]

    def place(run: SearchRun, values: dict[str, float]) -> tuple[float, float]:
        return values[names[0]], values[names[1]] if len(names) > 1 else run.merit

    figure, ax = new_figure(6.4, 4.4)
    runs = [place(*each) for each in zip(found.runs, found.values, strict=True)]
    ax.plot(*np.array(runs).T, "o", color="0.7", label="runs")
    front = sorted(place(candidate.run, candidate.objectives) for candidate in found.front)
    ax.plot(*np.array(front).T, "o-", color=BLUE, label="front" if len(found.objectives) > 1 else "reported")
    if found.start is not None:
        hollow = {"markersize": 10, "markerfacecolor": "none", "markeredgewidth": 1.6}
        ax.plot(*place(found.start.run, found.start.objectives), "s", color=BLACK, label="start", **hollow)
    ax.set(
        xlabel=labels[0],
        ylabel=labels[1],
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


def _panels(found: Workspace) -> tuple[Figure, list[tuple[Any, FloatArray, FloatArray, int]]]:
    """A figure with one panel a layer: axes, flexion and abduction of the grid, and the layer's index."""
    if found.inside.ndim != 3:
        raise InvalidInput(f"expected poses on a grid of three angles, got a stack of shape {found.inside.shape}")
    # At 90° of abduction two angles turn about one axis; a layer away from it names the grid.
    quaternions = found.poses.as_quat()
    middle = int(np.abs(found.poses.as_matrix()[0, :, 0, 1, 2]).argmin())
    flexion = shoulder_angles(Rotation.from_quat(quaternions[:, middle, 0]), found.side, degrees=True)[:, 0]
    internal = shoulder_angles(Rotation.from_quat(quaternions[0, middle]), found.side, degrees=True)[:, 2]
    # Beyond 90° the angles of an orientation fold back, so abduction is counted in turns from layer to layer.
    line = Rotation.from_quat(quaternions[0, :, 0])
    turns = np.degrees((line[1:] * line[:-1].inv()).magnitude())
    abduction = shoulder_angles(line[0], found.side, degrees=True)[1] + np.concatenate([[0.0], np.cumsum(turns)])
    layers = np.unique(np.linspace(0, len(internal) - 1, 6).round().astype(int))
    columns = min(3, len(layers))
    lines = -(-len(layers) // columns)
    cells = {"nrows": lines, "ncols": columns, "squeeze": False, "sharex": True, "sharey": True}
    figure, grid = new_figure(2.8 * columns + 0.5, 2.7 * lines + 1.0, **cells)
    panels = []
    for ax, layer in zip(grid.ravel(), layers, strict=False):
        ax.set_title(f"internal rotation {internal[layer]:.0f}°", fontsize=10)
        panels.append((ax, flexion, abduction, int(layer)))
    for ax in grid.ravel()[len(layers) :]:
        ax.set_visible(False)
    for ax in grid[:, 0]:
        ax.set_ylabel("abduction, °")
    for ax in grid[-1]:
        ax.set_xlabel("flexion, °")
    return figure, panels
