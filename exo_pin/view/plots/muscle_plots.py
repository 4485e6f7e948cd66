"""Pictures of muscles: the force map with its validity region, measured against modelled, the step response."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.errors import InvalidInput, MissingExtra
from ...core.validation import as_mapping, require_type
from ...muscle.io.measured import SteadyStates, steady_states
from ...muscle.laws.dynamic import DynamicModel
from ...muscle.laws.static import BAR, StaticModel
from ...muscle.simulation.response import StepResponse
from ..colours import BLUE, GREEN, RED

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["plot_force_map", "plot_measured", "plot_responses"]

_INK, _GREY = "#222222", "#8a8a8a"


def _figure(width: float, height: float, **kwargs: Any) -> tuple[Figure, Any]:
    try:
        # Not pyplot: a library opens no windows and keeps no list of figures.
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        raise MissingExtra("plot", "matplotlib") from None
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(**kwargs)
    for axis in np.ravel(axes):
        axis.spines[["top", "right"]].set_visible(False)
        axis.tick_params(colors=_INK, labelsize=9)
    return figure, axes


def plot_force_map(model: StaticModel, states: SteadyStates | None = None) -> Figure:
    """Draw force over contraction and pressure, with the region where the model holds.

    Parameters
    ----------
    model : StaticModel
        Of any length.
    states : SteadyStates or None
        Measured states to mark, for a model of the length they were measured at; None for none.

    Returns
    -------
    matplotlib.figure.Figure
        Unfilled where the model does not hold; ``.savefig(path)`` writes it.

    Raises
    ------
    MissingExtra
        If matplotlib is not installed.
    """
    require_type("model", model, StaticModel)
    require_type("states", states, SteadyStates | None)
    figure, axis = _figure(7.6, 4.8)
    high = model.validity.strain[1]
    x = np.linspace(0.0, 1.12 * high, 700) * model.length
    p = np.linspace(0.0, 1.1 * model.validity.pressure[1], 600)
    force = model.force(x[np.newaxis], p[:, np.newaxis], outside="mark")
    raw = np.ma.getdata(force)
    top = float(np.ceil(force.max() / 10) * 10)
    levels = np.arange(0.0, top + 1, 10.0)
    filled = axis.contourf(x * 1e3, p / BAR, force, levels=np.arange(0.0, top + 1, 2.5), cmap="viridis", alpha=0.9)
    lines = axis.contour(x * 1e3, p / BAR, raw, levels=levels, colors=_INK, linewidths=0.7, alpha=0.65)
    axis.clabel(lines, fmt="%.0f N", fontsize=8)
    inside = (~np.ma.getmaskarray(force)).astype(float)
    axis.contour(x * 1e3, p / BAR, inside, levels=[0.5], colors=RED, linewidths=2.2)
    handles = [_handle("the model holds inside", color=RED, linewidth=2.2)]
    if states is not None:
        if not np.isclose(model.scale, 1.0):
            raise InvalidInput("expected a model of the length the states were measured at, got a scaled one")
        for valid, face, label in ((True, "white", "measured, called valid"), (False, "none", "measured, beyond")):
            pick = states.called_valid == valid
            edge = _INK if valid else _GREY
            style = {"s": 26, "facecolor": face, "edgecolor": edge, "linewidth": 1.1}
            axis.scatter(states.contraction[pick] * 1e3, states.pressure[pick] / BAR, **style, zorder=4, clip_on=False)
            look = {"linestyle": "", "marker": "o", "markerfacecolor": face, "markeredgecolor": edge}
            handles.append(_handle(label, **look))
    axis.set(xlabel="contraction (mm)", xlim=(0.0, x[-1] * 1e3), ylabel="pressure (bar)", ylim=(0.0, p[-1] / BAR))
    axis.set_title(f"Pull of a {model.length * 1e3:.0f} mm muscle, {model.name}", loc="left", fontsize=11)
    figure.colorbar(filled, ax=axis, label="force (N)", ticks=levels)
    figure.legend(handles=handles, loc="outside lower left", ncols=len(handles), frameon=False, fontsize=9)
    return figure


def _handle(label: str, **look: Any) -> Any:
    """An entry of a legend."""
    from matplotlib.lines import Line2D

    return Line2D([], [], label=label, **look)


def plot_measured(models: Mapping[str, StaticModel], states: SteadyStates | None = None) -> Figure:
    """Draw measured against modelled force: all of it on the left, the errors on the right.

    Parameters
    ----------
    models : mapping
        From the label to the model; one to three.
    states : SteadyStates or None
        Measured states; None for the 25 valid cells of Tables 3-1 and 3-2.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    MissingExtra
        If matplotlib is not installed.
    InvalidInput
        If there are no models or more than three.
    """
    if not 1 <= len(as_mapping("models", models, "label to model")) <= 3:
        raise InvalidInput(f"expected one to three models, got {len(models)}")
    require_type("states", states, SteadyStates | None)
    data = steady_states(valid_only=True) if states is None else states
    figure, (left, right) = _figure(9.6, 4.4, ncols=2)
    most = 1.08 * float(data.force.max())
    left.plot([0, most], [0, most], color=_GREY, linewidth=1, zorder=1)
    # Beside one another on the right only, where the weight is but a label; on the left it is a coordinate.
    spread = np.linspace(-0.9, 0.9, len(models)) if len(models) > 1 else np.zeros(1)
    looks = zip((RED, BLUE, GREEN), "so^", spread, strict=False)
    for (label, model), (color, marker, shift) in zip(models.items(), looks, strict=False):
        force = model.unchecked_force(data.contraction, data.pressure)
        error = force - data.force
        rms = float(np.sqrt(np.mean(error**2)))
        style = {"s": 26, "marker": marker, "facecolor": "none", "edgecolor": color, "linewidth": 1.3}
        left.scatter(data.force, force, label=f"{label}: rms {rms:.2f} N", **style)
        right.scatter(data.force + shift, error, **style)
    left.set(xlabel="hung weight (N)", xlim=(0, most), ylabel="modelled force (N)", ylim=(0, most))
    left.legend(frameon=False, fontsize=9, loc="upper left")
    left.set_title("Modelled against measured", loc="left", fontsize=11)
    right.axhline(0.0, color=_GREY, linewidth=1, zorder=1)
    right.set(xlabel="hung weight (N), models side by side", xlim=(0, most), ylabel="modelled less measured (N)")
    right.set_title(f"Errors over {len(data.force)} steady states", loc="left", fontsize=11)
    return figure


def _facts(response: StepResponse) -> str:
    """What the legend says of a response."""
    try:
        settle = response.settling_time()
    except InvalidInput:
        return "ends where it began"
    settled = f"settles in {settle:.2f} s" if np.isfinite(settle) else "has not settled"
    return f"overshoot {100 * response.overshoot:.0f} %, {settled}"


def plot_responses(
    responses: Mapping[str, StepResponse],
    rest_bands: Mapping[str, tuple[DynamicModel, float]] | None = None,
    measured: float | None = None,
) -> Figure:
    """Draw step responses of one mass beside each other, contraction above and pressure below.

    Parameters
    ----------
    responses : mapping
        From the label to the response; one to three. Samples outside the model's range are dotted.
    rest_bands : mapping or None
        From a label of ``responses`` to the model and the final pressure in Pa, to shade where its friction can
        hold the mass at rest.
    measured : float or None
        Measured steady contraction in m to mark.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    MissingExtra
        If matplotlib is not installed.
    InvalidInput
        If there are no responses or more than three.
    """
    if not 1 <= len(as_mapping("responses", responses, "label to response")) <= 3:
        raise InvalidInput(f"expected one to three responses, got {len(responses)}")
    figure, (top, bottom) = _figure(8.4, 5.4, nrows=2, sharex=True, height_ratios=[3, 1])
    for (label, response), color in zip(responses.items(), (BLUE, RED, GREEN), strict=False):
        x = response.contraction * 1e3
        held = np.where(response.inside, x, np.nan)
        top.plot(response.time, x, color=color, linewidth=1.2, linestyle=":")
        top.plot(response.time, held, color=color, linewidth=1.8, label=f"{label}: {_facts(response)}")
        bottom.plot(response.time, response.pressure / BAR, color=_INK, linewidth=1.4)
        if rest_bands is not None and label in rest_bands:
            model, pressure = rest_bands[label]
            band = model.rest_band(response.mass, pressure)
            where = f"{label}: can rest here"
            top.axhspan(band[0] * 1e3, band[1] * 1e3, color=color, alpha=0.12, linewidth=0, label=where)
    if measured is not None:
        top.axhline(measured * 1e3, color=_INK, linewidth=1, linestyle="--", label="measured steady state")
    top.set(ylabel="contraction (mm)", ylim=(0.0, None))
    top.legend(frameon=False, fontsize=9, loc="lower right")
    mass = next(iter(responses.values())).mass
    top.set_title(f"A hung mass of {mass:.2f} kg; dotted: outside the model's range", loc="left", fontsize=11)
    bottom.set(xlabel="time (s)", ylabel="pressure (bar)", ylim=(0.0, None))
    return figure
