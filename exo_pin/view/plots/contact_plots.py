"""Plots of the contact force of the wearer's shoulder joint."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.validation import FloatArray, as_finite
from ...person import JointContact
from ..colours import BLACK, BLUE, ORANGE
from .plot_style import axes_or_new, legend_below, new_figure, pyplot, right_scale, tidy

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ...person.contact.assumption_range import ContactQuestion

#: Elevations of a curve, degrees.
_ELEVATIONS = np.arange(5.0, 121.0, 5.0)


@checked
def contact_over_elevation(
    elevation: ArrayLike, contact: JointContact, ax: Axes | None = None, label: str = "elevation of the arm, °"
) -> Axes:
    """Contact force over the elevation of the arm, or over the time of a movement, with and without the device.

    Poses without a result are gaps. Thin lines are the shear, which the rim of the socket has to carry.

    Parameters
    ----------
    elevation : array_like
        Shape (k,), degrees, or whatever the label says.
    contact : JointContact
        Of shape (k,).
    ax : matplotlib Axes, optional
        Where to draw; a new figure if left out.
    label : str
        Of the horizontal axis.

    Returns
    -------
    matplotlib.axes.Axes
        Percent of body weight on the left, N on the right.
    """
    degrees = as_finite("elevation", elevation, (None,))
    if contact.status.shape != degrees.shape:
        raise InvalidInput(f"expected contact forces of shape {degrees.shape}, got {contact.status.shape}")
    ax = axes_or_new(ax, 6.4, 4.8)
    if contact.without_device is None:
        _curves(ax, degrees, contact, "", BLACK, "-")
    else:
        _curves(ax, degrees, contact.without_device, " without the device", BLACK, "-")
        _curves(ax, degrees, contact, " with the device", BLUE, "--")
    ax.set(xlabel=label, ylabel="force, % of body weight", ylim=(0.0, None))
    right_scale(ax, 100.0 / contact.body_weight, "force, N")
    tidy(ax)
    legend_below(ax)
    return ax


def _curves(ax: Axes, degrees: FloatArray, contact: JointContact, which: str, colour: str, dashes: str) -> None:
    """Size and shear of one result, and crosses where there is none."""
    percent = 100.0 / contact.body_weight
    ax.plot(degrees, percent * contact.magnitude, dashes, color=colour, linewidth=2.2, label=f"contact force{which}")
    ax.plot(degrees, percent * contact.shear, dashes, color=colour, linewidth=1.0, label=f"shear{which}")
    lost = ~contact.has_result
    if lost.any():
        ax.plot(degrees[lost], np.zeros(lost.sum()), "x", color=ORANGE, clip_on=False, label=f"no result{which}")


def elevation_in_plane(
    subject: Any, poses: Rotation, side: str, **query: Unpack[ContactQuestion]
) -> tuple[FloatArray, JointContact, float]:
    """Contact forces over the elevation in the plane of a pose, outwards for a hanging arm.

    Parameters
    ----------
    subject : ShoulderExo or Person
        Whose ``joint_contact`` is asked.
    poses : Rotation
        A single pose.
    side : {"left", "right"}
        Side of the body.
    **query
        Of ``joint_contact``.

    Returns
    -------
    elevation : ndarray
        Shape (k,), degrees.
    contact : JointContact
        Of shape (k,).
    azimuth : float
        Of the plane, degrees from forward.
    """
    # Lifted in a plane, then turned about the arm's own axis: Rz(plane) Ry(-tilt) Rz(-plane) Rz(turn).
    first, tilt, last = poses.as_euler("ZYZ", degrees=True, suppress_warnings=True)
    outward = 1.0 if side == "left" else -1.0
    forward, left, _ = poses.apply([0.0, 0.0, -1.0])
    azimuth = 90.0 if tilt < 1.0 else float(np.degrees(np.arctan2(outward * left, forward)))
    plane, lifted = outward * azimuth, np.ones_like(_ELEVATIONS)
    angles = np.column_stack([plane * lifted, -_ELEVATIONS, (first + last - plane) * lifted])
    poses = Rotation.from_euler("ZYZ", angles, degrees=True)
    return _ELEVATIONS, subject.joint_contact(poses, **query, outside="mark"), azimuth


@checked
def contact_over_box(axes: tuple[FloatArray, FloatArray, FloatArray], contact: JointContact) -> Figure:
    """Contact force over a box of shoulder angles: without the device, with it, and the relief.

    Each cell is the median over the internal rotations; a cell without a result is grey.

    Parameters
    ----------
    axes : tuple of ndarray
        Flexions, abductions and internal rotations of the grid, degrees, shapes (f,), (a,) and (i,).
    contact : JointContact
        Of shape (f, a, i).

    Returns
    -------
    matplotlib.figure.Figure
        One panel for a bare arm, three with a device.
    """
    flexion, abduction, internal = axes
    shape = (len(flexion), len(abduction), len(internal))
    if contact.status.shape != shape:
        raise InvalidInput(
            f"expected contact forces of shape {shape}, one for each pose of the grid, got {contact.status.shape}"
        )
    bare = contact.without_device
    panels = [("contact force", contact.percent_body_weight)]
    if bare is not None:
        panels = [("without the device", bare.percent_body_weight), ("with the device", contact.percent_body_weight)]
    layers = [(title, _median(values)) for title, values in panels]
    known = np.concatenate([layer[np.isfinite(layer)] for _, layer in layers])
    # Without any result all cells are grey, and the scale is one body weight.
    top = float(known.max()) if known.size else 100.0
    relief = None if contact.relief_percent is None else _median(contact.relief_percent)
    count = len(layers) + (relief is not None)
    figure, axs = new_figure(1.5 + 2.5 * count, 3.5, ncols=count, squeeze=False)
    for ax, (title, layer) in zip(axs[0], layers, strict=False):
        shown = _mesh(ax, flexion, abduction, layer, cmap="cividis", vmin=0.0, vmax=top)
        ax.set_title(title, fontsize=10)
    figure.colorbar(shown, ax=list(axs[0, : len(layers)]), label="% of body weight", shrink=0.9)
    if relief is not None:
        layers.append(("relief", relief))
        colours, bar = relief_scale(relief)
        shown = _mesh(axs[0, -1], flexion, abduction, relief, **colours)
        axs[0, -1].set_title("relief", fontsize=10)
        figure.colorbar(shown, ax=axs[0, -1], shrink=0.9, **bar)
    axs[0, 0].set_ylabel("abduction, °")
    if any(np.isnan(layer).any() for _, layer in layers):
        figure.supxlabel("grey: no result", fontsize=9, color="0.3")
    return figure


def _median(values: FloatArray) -> FloatArray:
    """Median over the last axis of what has a value; NaN where nothing has."""
    return np.asarray(np.ma.median(np.ma.masked_invalid(values), axis=-1).filled(np.nan))


def relief_scale(relief: FloatArray) -> tuple[dict[str, Any], dict[str, Any]]:
    """Colours of a relief of shape (f, a), %, and of its bar: over the values, red below 0 where there are such."""
    known = relief[np.isfinite(relief)]
    if not known.size or known.min() >= 0.0:
        low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 100.0)
        return {"cmap": "YlGnBu", "vmin": low, "vmax": high}, {"label": "relief, %", "extend": "neither"}
    end = min(float(np.abs(known).max()), 100.0)
    cut = "min" if known.min() < -end else "neither"
    return {"cmap": "RdBu", "vmin": -end, "vmax": end}, {
        "label": "relief, %; red: the device adds force",
        "extend": cut,
    }


def _mesh(ax: Axes, flexion: FloatArray, abduction: FloatArray, layer: FloatArray, **style: Any) -> Any:
    """A layer of shape (f, a) as cells."""
    shown = ax.pcolormesh(flexion, abduction, layer.T, shading="nearest", **style)
    ax.set(xlabel="flexion, °", facecolor="0.8")
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(pyplot().MultipleLocator(30.0))
    return shown
