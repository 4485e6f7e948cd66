"""Pictures of recorded movements: which of their poses a design reaches over time, and paths of the elbow in space."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.validation import as_mapping, as_real
from ...load_case import Movement
from .plot_style import WIDEST, line, new_figure, pyplot, tidy

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Distance of the lines of two tasks.
_APART = 1.6


@checked
def task_status_figure(inside: Mapping[str, ArrayLike], times: Mapping[str, ArrayLike] | None = None) -> Figure:
    """Draw over the time of each task which poses are inside a workspace (1) and which are not (0).

    Parameters
    ----------
    inside : mapping of str to array_like
        By name of the task: shape (N,), whether each sample is inside.
    times : mapping of str to array_like, optional
        By the same names: shape (N,), rising; evenly over the task if left out.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InvalidInput
        If there is no task.
    MissingExtra
        If matplotlib is not installed.

    Notes
    -----
    Source: thesis Figure 5-16.

    Examples
    --------
    >>> from exo_pin.view.plots import task_status_figure
    >>> figure = task_status_figure({"mouth": [1, 1, 1, 0], "hair": [0, 1, 0, 0]})
    >>> len(figure.axes)
    1
    """
    rows = as_mapping("inside", inside, "samples by task")
    if not rows:
        raise InvalidInput("expected at least one task")
    figure, axis = new_figure(7.6, 1.2 + 0.7 * len(rows))
    places = [-_APART * k for k in range(len(rows))]
    for k, (place, (name, values)) in enumerate(zip(places, rows.items(), strict=True)):
        status = as_real("inside", np.asarray(values, dtype=np.float64)).ravel()
        when = np.arange(len(status)) if times is None else as_real("times", times[name])
        percent = 100.0 * (when - when[0]) / (when[-1] - when[0])
        axis.step(percent, place + status, where="mid", linewidth=1.6, **line(k))
    axis.set_yticks(
        [place + level for place in places for level in (0, 1)],
        [f"{name} {level}" for name in rows for level in ("0", "1")],
    )
    axis.set(xlabel="time, % of the task", xlim=(0.0, 100.0), ylim=(places[-1] - 0.15, 1.15))
    axis.set_title("1 inside the workspace, 0 outside")
    tidy(axis)
    return figure


@checked
def elbow_paths_figure(movements: Mapping[str, Movement]) -> Figure:
    """Draw the paths of the elbow in space, seen from the shoulder in lengths of the upper arm.

    Parameters
    ----------
    movements : mapping of str to Movement
        By name.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InvalidInput
        If there is no movement.
    MissingExtra
        If matplotlib is not installed.

    Notes
    -----
    Source: thesis Figure 5-19.

    Examples
    --------
    >>> from exo_pin.view.plots import elbow_paths_figure
    >>> times = np.linspace(0.0, 1.0, 21)
    >>> lift = ep.Movement.from_samples(times, ep.shoulder_rotation(60 * times, 0, 0, degrees=True))
    >>> len(elbow_paths_figure({"lift": lift}).axes)
    1
    """
    named: Any = as_mapping("movements", movements, "movements by name")
    if not named:
        raise InvalidInput("expected at least one movement")
    figure = pyplot().figure(figsize=(0.72 * WIDEST, 0.64 * WIDEST))
    axis: Any = figure.add_subplot(projection="3d")
    for k, (name, movement) in enumerate(named.items()):
        path = movement.poses.apply([0.0, 0.0, -1.0])
        axis.plot(*path.T, label=name, linewidth=1.8, **line(k))
        axis.scatter(*path[0], s=22, color=line(k)["color"])
    axis.scatter(0.0, 0.0, 0.0, s=40, color="0.2")
    axis.text(0.0, 0.0, 0.06, "shoulder", fontsize=9)
    # Numbers at the ends of two axes would lie on each other in the corner.
    ends, ticks = (-1.0, 1.0), (-0.5, 0.0, 0.5)
    axis.set(xlabel="forward", ylabel="left", zlabel="up", xlim=ends, ylim=ends, zlim=ends)
    axis.set(xticks=ticks, yticks=ticks, zticks=ticks, title="Elbow, in lengths of the upper arm; dots: start")
    axis.set_box_aspect((1, 1, 1))
    axis.view_init(22, -60)
    axis.legend(loc="upper left", bbox_to_anchor=(-0.12, 1.0), frameon=False)
    return figure
