"""Picture of singular poses over flexion and abduction.

Purple and orange are the two sides of the locus, black the locus, and a hatch the side that rest is not on, so that
colour-blind readers and grey prints show the same.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.validation import require_method
from ...load_case.ranges_of_motion import DAILY_RANGES, RangeOfMotion
from ...wrist.singularities import singular_curves as loci
from ...wrist.singularities import singularity_free_region as region
from ...wrist.singularities.singularity_free_region import daily_crossings
from ..colours import BLACK
from .plot_style import axes_or_new, wrapped

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ...exo.shoulder_exo import ShoulderExo

#: Line styles and labels of the ranges drawn on a map.
_STYLES = ("-", (0, (5, 2)), (0, (1, 1.2)), (0, (5, 1, 1, 1)))
#: |det X| at which the colours end, at least.
_FULL = 0.3
_HATCH = "0.45"


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
    rest = region.side_of_rest(exo.geometry)
    determinant = piece.determinant.T
    known = np.abs(determinant[np.isfinite(determinant)])
    full = max(_FULL, float(np.percentile(known, 95.0))) if known.size else _FULL
    scale: dict[str, Any] = {"cmap": "PuOr_r", "vmin": -full, "vmax": full}
    image = ax.pcolormesh(piece.x, piece.y, determinant, **scale, shading="nearest", rasterized=True)
    ax.figure.colorbar(image, ax=ax, extend="both", label="det X", fraction=0.046, pad=0.03)
    side = np.nan_to_num(determinant) * rest
    if side.min() < 0.0:
        hatched = ax.contourf(piece.x, piece.y, side, levels=[-np.inf, 0.0], colors="none", hatches=["///"])
        hatched.set(edgecolor=_HATCH, linewidth=0.0)
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
        ax.fill_between([np.nan], [np.nan], facecolor="white", edgecolor=_HATCH, hatch="///", label="across from rest")
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
