"""Plots with matplotlib: the mechanism with its forces, and maps over the range of motion.

One style for all: colours of the Okabe-Ito palette (safe for colour-blind readers) with line styles and labels that
distinguish the curves in grey prints as well, and units on every axis.
"""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ... import wrist
from ...core.conventions import shoulder_angles, shoulder_rotation
from ...core.validation import FloatArray, as_positive, as_single_rotation, require_method
from ...reaction.answer import STANDARD_GRAVITY
from ...reaction.holding.verdict import angle_words
from ..colours import BLACK, BLUE, GREEN, ORANGE, RED
from ..stage.shapes import along
from .plot_style import axes_or_new, legend_below, pyplot

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ...exo.shoulder_exo import ShoulderExo
    from ...reaction import Reaction

__all__ = ["draw_mechanism", "overview", "shoulder_force_map", "use_file_backend"]

#: Colour of the hatches over poses that are not held.
_HATCH = "0.35"
#: Length of the longest arrow and of a head, m.
_LONGEST, _HEAD = 0.15, 0.03


def use_file_backend() -> None:
    """Draw to files only, so that no screen is needed."""
    pyplot().switch_backend("agg")


def draw_mechanism(exo: ShoulderExo, poses: Rotation, ax: Any = None, answer: Reaction | None = None) -> Any:
    """Draw base, platform, limbs and arm in a pose, with the forces on the arm.

    Parameters
    ----------
    exo : ShoulderExo
        With an arm.
    poses : Rotation
        A single pose.
    ax : mpl_toolkits.mplot3d.Axes3D, optional
        Where to draw; a new figure if left out.
    answer : Reaction, optional
        The forces of this pose; those of :meth:`exo_pin.ShoulderExo.reaction` if left out.

    Returns
    -------
    Axes3D
    """
    require_method("exo", exo, "reaction", "a ShoulderExo")
    pose = as_single_rotation("poses", poses)
    if ax is None:
        ax = pyplot().figure(figsize=(6, 6)).add_subplot(projection="3d")
    answer = exo.reaction(pose) if answer is None else answer
    arm = exo.mechanism.require_arm("a drawing of forces")
    R = pose.as_matrix()
    a, b = exo.geometry.base_points, exo.inverse_kinematics(pose).platform_points
    hand = R @ np.array([0.0, 0.0, -0.45])
    ax.plot(*np.stack([np.zeros(3), hand], axis=1), color="0.85", linewidth=18, solid_capstyle="round", zorder=0)
    ax.plot(*_ring(a, exo.geometry.base_axis).T, color=BLACK, linewidth=2, label="base ring on the torso")
    axis = exo.geometry.platform_axis
    ax.plot(*_ring(b, None if axis is None else R @ axis).T, color="0.5", linewidth=2, label="platform ring on the arm")
    for i, tension in enumerate(answer.actuator_forces):
        pulls = not tension < 0
        known = f"{'pulls' if pulls else 'pushes'} {abs(tension):.0f} N" if np.isfinite(tension) else "(no force found)"
        colour, dashes = (BLUE, "-") if pulls else (ORANGE, (0, (2, 0.6)))
        look = {"color": colour, "linestyle": dashes, "linewidth": 3.5, "marker": "o", "markersize": 4}
        ax.plot(*np.stack([a[i], b[i]], axis=1), **look, label=f"limb {i + 1} {known}")
        ax.text(*(1.12 * a[i]), str(i + 1), fontsize=9, ha="center", va="center")
    weight, shoulder = arm.mass * exo.mechanism.gravity, np.nan_to_num(answer.shoulder_force)
    scale = _LONGEST / max(float(np.linalg.norm(weight)), float(np.linalg.norm(shoulder)), 1e-9)
    centre = R @ arm.centre_of_mass
    _arrow(ax, centre, scale * weight, GREEN, f"weight {np.linalg.norm(weight):.0f} N")
    if answer.has_answer:
        _arrow(ax, np.zeros(3), scale * shoulder, RED, f"shoulder on the arm {np.linalg.norm(shoulder):.0f} N")
    else:
        ax.plot([], [], " ", label=f"pose is {answer.status}: no forces")
    ax.set(xlabel="x forward, m", ylabel="y left, m", zlabel="z up, m")
    # Numbers of neighbouring axes do not meet where each axis has few.
    ax.locator_params(nbins=4)
    ax.tick_params(labelsize=8, pad=1)
    ax.zaxis.set_rotate_label(False)
    ax.zaxis.label.set_rotation(90)
    tips = np.stack([np.zeros(3), hand, scale * shoulder, centre + scale * weight])
    _equal_axes(ax, np.vstack([a, b, tips]))
    ax.legend(fontsize=8.5, loc="upper center", bbox_to_anchor=(0.5, -0.02), ncols=2, frameon=False)
    return ax


def _ring(points: FloatArray, axis: FloatArray | None) -> FloatArray:
    """The circle about ``axis`` through the points, or the closed polygon of the points where there is no axis."""
    if axis is None:
        return np.vstack([points, points[:1]])
    centre = axis * float(points.mean(axis=0) @ axis)
    first = points[0] - centre
    turns = np.linspace(0.0, 2 * np.pi, 73)[:, None]
    return np.asarray(centre + np.cos(turns) * first + np.sin(turns) * np.cross(axis, first))


def _arrow(ax: Any, start: FloatArray, arrow: FloatArray, color: str, label: str) -> None:
    """A shaft and a head of four barbs, of which some show from every side."""
    tip, length = start + arrow, float(np.linalg.norm(arrow))
    gap = np.full((1, 3), np.nan)
    pieces = [start[None], tip[None]]
    if length > 0.0:
        x, y, z = along(arrow / length).T * min(_HEAD, length)
        pieces += [piece for barb in (x, -x, y, -y) for piece in (gap, np.stack([tip, tip - z + 0.5 * barb]))]
    ax.plot(*np.vstack(pieces).T, color=color, linewidth=3, solid_capstyle="round", label=label)


def _equal_axes(ax: Any, points: FloatArray) -> None:
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = (low + high) / 2, (high - low).max() / 2 * 1.05
    x, y, z = zip(middle - half, middle + half, strict=True)
    ax.set(xlim=x, ylim=y, zlim=z, box_aspect=(1, 1, 1))


def shoulder_force_map(
    exo: ShoulderExo,
    ax: Axes | None = None,
    internal_rotation: float = 0.0,
    step: float | None = None,
    **query: Any,
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
        Of the grid, degrees; 0.5 for three limbs and 1 for more if left out.
    **query
        Of :meth:`exo_pin.ShoulderExo.reaction_map`: ``split``, ``limits``, ...

    Returns
    -------
    matplotlib.axes.Axes
    """
    require_method("exo", exo, "reaction", "a ShoulderExo")
    ax = axes_or_new(ax, 6, 5)
    step = (1.0 if exo.geometry.limb_count > 3 else 0.5) if step is None else as_positive("step", step)
    flexion, abduction = np.arange(-20, 110 + step, step), np.arange(-4, 96 + step, step)
    poses = shoulder_rotation(flexion[None, :], abduction[:, None], internal_rotation, side=exo.side, degrees=True)
    arm = exo.mechanism.require_arm("a map of forces")
    answer = exo.reaction_map(poses, keep=("magnitude", "status"), **query)
    split = query.get("split", "spherical")
    how = "limbs without side force" if split == "spherical" else f"split {split}"
    _coloured(ax, flexion, abduction, np.asarray(answer.magnitude), answer.held, arm.body_mass)
    if exo.geometry.limb_count == 3:
        determinant = wrist.singularity(exo.geometry, poses).determinant
        ax.contour(flexion, abduction, determinant, levels=[0.0], colors="white", linewidths=3.0)
        ax.contour(flexion, abduction, determinant, levels=[0.0], colors="black", linewidths=1.5)
        ax.plot([], [], color="black", linewidth=1.5, label="singular: det X = 0")
    ax.set(xlabel="flexion, °", ylabel="abduction, °", title=f"Force on the shoulder joint, {how}")
    if ax.get_legend_handles_labels()[1]:
        legend_below(ax)
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
    from matplotlib.colors import LogNorm, Normalize
    from matplotlib.ticker import LogLocator, NullFormatter

    unit, name = 1.0, "|F_s|, N"
    if body_mass is not None:
        unit, name = 100.0 / (body_mass * STANDARD_GRAVITY), "|F_s|, % of body weight"
    if np.isfinite(force).any():
        low, high = np.nanpercentile(force * unit, [0.5, 98.5])
    else:
        low, high = 0.0, 1.0
    scale = LogNorm(low, high) if 0.0 < low < high else None  # an unloaded arm has no logarithm
    shown = np.clip(force * unit, low, high)
    look: dict[str, Any] = {"norm": scale or Normalize(low, high), "cmap": "cividis", "shading": "nearest"}
    image = ax.pcolormesh(flexion, abduction, np.where(held, shown, np.nan), rasterized=True, **look)
    if not held.all():
        pale = np.where(held, np.nan, shown)
        ax.pcolormesh(flexion, abduction, pale, alpha=0.55, rasterized=True, **look)
        hatched = ax.contourf(flexion, abduction, ~held, levels=[0.5, 1.5], colors="none", hatches=["//"])
        hatched.set(edgecolor=_HATCH, linewidth=0.0)
        ax.fill([], [], facecolor="white", edgecolor=_HATCH, hatch="////", label="cannot be held: what would be needed")
    bar = ax.figure.colorbar(image, ax=ax, extend="both", label=name)
    if scale is not None:
        bar.ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 3.0, 5.0)))
        bar.ax.yaxis.set_minor_formatter(NullFormatter())
    bar.ax.yaxis.set_major_formatter("{x:g}")


def overview(exo: ShoulderExo, poses: Rotation, answer: Reaction | None = None) -> Figure:
    """The mechanism with its forces in a pose, that pose on the map of shoulder force, and whether it can be held.

    Parameters
    ----------
    exo : ShoulderExo
        With an arm; three limbs without mass.
    poses : Rotation
        A single pose.
    answer : Reaction, optional
        The forces of this pose, in place of those of :meth:`exo_pin.ShoulderExo.reaction`. The map asks the same
        question; that of a device that gives way is of rigid limbs, because it would take minutes.
    """
    require_method("exo", exo, "reaction", "a ShoulderExo")
    answer = exo.reaction(poses) if answer is None else answer
    assumed, rigid = answer.assumptions, not answer.source.split.moves
    query: dict[str, Any] = {"limits": assumed.limits, "centre_offset": answer.case.centre_offset}
    if rigid:
        query |= {"split": assumed.split, "constraint_bounds": assumed.constraint_bounds}
    figure = pyplot().figure(figsize=(12, 6.1), layout="constrained")
    left = figure.add_subplot(1, 2, 1, projection="3d")
    left.view_init(elev=14, azim=58)
    draw_mechanism(exo, poses, left, answer)
    flexion, abduction, internal = shoulder_angles(poses, exo.side, degrees=True)
    left.set_title(f"{exo.name}:\n{angle_words(poses, exo.side)}")
    right = shoulder_force_map(exo, figure.add_subplot(1, 2, 2), internal, **query)
    mark: dict[str, Any] = {"markersize": 9, "markerfacecolor": RED, "markeredgecolor": "white"}
    right.plot(flexion, abduction, "o", **mark, label="the pose on the left")
    legend_below(right)
    figure.suptitle(textwrap.fill(answer.verdict, 120), fontsize=12)
    return figure
