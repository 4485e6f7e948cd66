"""Plots of the contact force of the wearer's shoulder joint."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_finite
from ...person import JointContact
from ..colours import BLACK, BLUE, ORANGE
from .plot_style import pyplot, tidy

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["contact_over_elevation"]


def contact_over_elevation(elevation: ArrayLike, contact: JointContact, ax: Axes | None = None) -> Axes:
    """Contact force over the elevation of the arm, with and without the device.

    Poses without a result are gaps. Thin lines are the shear, which the rim of the socket has to carry.

    Parameters
    ----------
    elevation : array_like
        Shape (k,), degrees.
    contact : JointContact
        Of shape (k,).
    ax : matplotlib Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    matplotlib.axes.Axes
        Percent of body weight on the left, N on the right.
    """
    degrees = as_finite("elevation", elevation, (None,))
    if contact.status.shape != degrees.shape:
        raise InvalidInput(f"expected contact forces of shape {degrees.shape}, got {contact.status.shape}")
    if ax is None:
        _, ax = pyplot().subplots(figsize=(6.4, 4.8), layout="constrained")
    assert ax is not None
    percent = 100.0 / contact.body_weight
    if contact.without_device is None:
        _curves(ax, degrees, contact, "", BLACK, "-")
    else:
        _curves(ax, degrees, contact.without_device, " without the device", BLACK, "-")
        _curves(ax, degrees, contact, " with the device", BLUE, "--")
    ax.set(xlabel="elevation of the arm, °", ylabel="% of body weight", ylim=(0.0, None))
    right = ax.secondary_yaxis("right", functions=_newtons(percent))
    right.set_ylabel("N")
    tidy(ax)
    ax.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2, frameon=False)
    return ax


def _newtons(percent: float) -> tuple[Any, Any]:
    """From percent of body weight to N, and back."""
    return (lambda value: value / percent), (lambda force: force * percent)


def _curves(ax: Axes, degrees: FloatArray, contact: JointContact, which: str, colour: str, dashes: str) -> None:
    """Size and shear of one result, and crosses where there is none."""
    percent = 100.0 / contact.body_weight
    ax.plot(degrees, percent * contact.magnitude, dashes, color=colour, linewidth=2.2, label=f"contact force{which}")
    ax.plot(degrees, percent * contact.shear, dashes, color=colour, linewidth=1.0, label=f"shear{which}")
    lost = ~contact.has_result
    if lost.any():
        ax.plot(degrees[lost], np.zeros(lost.sum()), "x", color=ORANGE, label=f"no result{which}")
