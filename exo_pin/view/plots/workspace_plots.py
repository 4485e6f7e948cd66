"""Pictures of a workspace: the ball of rotations, slices with the reasons, and shares by criterion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.conventions import shoulder_angles
from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_finite, require_type
from ...workspace import CRITERIA, Workspace
from ..colours import BLUE
from .plot_style import new_figure, pyplot, tidy

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["rotation_ball", "shoulder_force_slices", "workspace_slices"]

#: A largest force that is so many times that of 99 % of the poses is beyond the scale of colours.
_OUTLYING = 1.5


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
    figure = plt.figure(figsize=(11.0, 9.5), layout="constrained")
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
    figure.suptitle(f"{found.name}: {100 * found.index:.1f} % of {inside.size} poses inside (blue)")
    return figure


def workspace_slices(found: Workspace, internal_rotations: Sequence[float] | None = None) -> Figure:
    """Flexion and abduction at several internal rotations: inside, or the first criterion that is not met.

    Parameters
    ----------
    found : Workspace
        On a grid of three angles, such as :func:`exo_pin.adl_box`.
    internal_rotations : sequence of float, optional
        Degrees; the nearest layers of the grid are drawn. Six evenly spread ones if left out.

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
    figure, panels = _panels(found, internal_rotations)
    for ax, x, y, layer in panels:
        _shaded(ax, x, y, first[..., layer], colours, -0.5, len(names) + 0.5)
    handles = [Patch(color=colour, label=label) for code, (label, colour) in enumerate(looks) if (first == code).any()]
    figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 4), frameon=False)
    figure.suptitle(f"{found.name}: {100 * found.index:.1f} % inside; colours name the first criterion that is not met")
    return figure


def shoulder_force_slices(found: Workspace, internal_rotations: Sequence[float] | None = None) -> Figure:
    """|F_s| of the poses inside over flexion and abduction, at several internal rotations.

    Parameters
    ----------
    found, internal_rotations
        As in :func:`workspace_slices`.
    """
    require_type("found", found, Workspace)
    force = np.where(found.inside, found.magnitude, np.nan)
    known = force[np.isfinite(force)]
    usual, most = np.percentile(known, [99.0, 100.0]).tolist() if known.size else (1.0, 1.0)
    # A few poses at the edge of what the device can hold would leave one colour for all others.
    cut = most > _OUTLYING * usual > 0.0
    highest = usual if cut else most
    figure, panels = _panels(found, internal_rotations)
    image: Any = None
    for ax, x, y, layer in panels:
        ax.set_facecolor("0.88")
        image = _shaded(ax, x, y, force[..., layer], "cividis", 0.0, highest)
    label = f"|F_s|, N (grey: outside{f'; up to {most:.0f} N' if cut else ''})"
    figure.colorbar(image, ax=figure.axes, label=label, fraction=0.03, extend="max" if cut else "neither")
    figure.suptitle(f"{found.name}: least shoulder force over tensions within the limits")
    return figure


def _shaded(ax: Any, x: FloatArray, y: FloatArray, values: Any, colours: Any, low: float, high: float) -> Any:
    """Values of shape (x, y) as cells."""
    return ax.pcolormesh(x, y, values.T, cmap=colours, vmin=low, vmax=high, shading="nearest", rasterized=True)


def _panels(
    found: Workspace, chosen: Sequence[float] | None
) -> tuple[Figure, list[tuple[Any, FloatArray, FloatArray, int]]]:
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
    layers = np.linspace(0, len(internal) - 1, 6).round().astype(int)
    if chosen is not None:
        wanted = as_finite("internal_rotations", chosen, (None,))
        if not len(wanted):
            raise InvalidInput("expected at least one internal rotation, got none")
        layers = np.abs(internal - wanted[:, None]).argmin(axis=1)
    layers = np.unique(layers)
    columns = min(3, len(layers))
    lines = -(-len(layers) // columns)
    cells = {"nrows": lines, "ncols": columns, "squeeze": False, "sharex": True, "sharey": True}
    figure, grid = new_figure(4.0 * columns, 3.6 * lines + 0.6, **cells)
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
