"""Maps over flexion and abduction: shoulder force, and det X with the singular poses."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ... import shoulder_angles, shoulder_rotation, wrist
from ...core.errors.checked import checked
from ...core.validation import FloatArray, as_positive, as_single_rotation, require_method
from ...load_case.ranges_of_motion import DAILY_RANGES, RangeOfMotion
from ...reaction.answer import STANDARD_GRAVITY
from ...reaction.holding.verdict import angle_words
from ...wrist.singularities import measures as loci
from ...wrist.singularities.sides_of_the_surface import daily_crossings, side_of_rest
from ..colours import BLACK, RED
from .answer_plots import pose_bars
from .plot_style import WIDEST, axes_or_new, figure_title, force_scale, legend_below, pyplot, wrapped

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ...exo.shoulder_exo import ShoulderExo
    from ...reaction import Reaction
    from ...reaction.assumptions import Question


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
    ax.set(
        xlabel="flexion, °",
        ylabel="abduction, °",
    )
    # Adding zero turns -0 into 0. A device that is not a wrist has no limbs with side forces.
    turn = f"{round(internal_rotation, 1) + 0.0:g}"
    words = f"{exo.name}, internal rotation {turn}°:\nforce on the shoulder joint{how if exo.wrist is not None else ''}"
    ax.set_title(words, fontsize=10.5)
    if ax.get_legend_handles_labels()[1]:
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
        hatched = ax.contourf(flexion, abduction, ~held, levels=[0.5, 1.5], colors="none", hatches=["//"])
        hatched.set(edgecolor=_HATCH, linewidth=0.0)
        ax.fill(
            [],
            [],
            facecolor="white",
            edgecolor=_HATCH,
            hatch="////",
            label="cannot be held; colour: force that would be needed",
        )
    bar = ax.figure.colorbar(image, ax=ax, extend=extend, label=name)
    bar.ax.yaxis.set_major_formatter("{x:g}")


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
    query: dict[str, Any] = {"limits": assumed.limits, "centre_offset": answer.case.centre_offset}
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
    figure_title(figure, answer.verdict)
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
    piece = loci.shoulder_slice(exo.geometry, internal_rotation, around, step, exo.side)
    rest = side_of_rest(exo.geometry)
    determinant = piece.determinant.T
    known = np.abs(determinant[np.isfinite(determinant)])
    full = max(_FULL, float(np.percentile(known, 95.0))) if known.size else _FULL
    scale: dict[str, Any] = {"cmap": "PuOr_r", "vmin": -full, "vmax": full}
    image = ax.pcolormesh(piece.x, piece.y, determinant, **scale, shading="nearest", rasterized=True)
    ax.figure.colorbar(image, ax=ax, extend="both", label="det X", fraction=0.046, pad=0.03)
    side = np.nan_to_num(determinant) * rest
    if side.min() < 0.0:
        hatched = ax.contourf(piece.x, piece.y, side, levels=[-np.inf, 0.0], colors="none", hatches=["///"])
        hatched.set(edgecolor=_ACROSS, linewidth=0.0)
    for k, curve in enumerate(piece.curves):
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
    ax.set(
        xlabel="flexion, °",
        ylabel="abduction, °",
        xlim=(piece.x[0], piece.x[-1]),
        ylim=(piece.y[0], piece.y[-1]),
    )
    name = wrapped(exo.mechanism.title or exo.name, 5.8, 10.5)
    ax.set_title(f"{name}\nsingular poses, at {piece.fixed}", fontsize=10.5)
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=2, fontsize=8.5, frameon=False)
    return ax
