"""Pictures of tasks: which poses of a recording a design reaches over time, paths of the elbow, and a day's tasks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.validation import as_mapping, as_real, require_type
from ...load_case import Movement
from ...workspace import CRITERIA, Day
from ..colours import BLUE
from .plot_style import WIDEST, figure_title, line, new_figure, pyplot, tidy

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


@checked
def day_figure(day: Day) -> Figure:
    """Draw the tasks of a day over the swivel of the elbow: inside, the first criterion not met, or not taken.

    Parameters
    ----------
    day : Day
        From :func:`exo_pin.workspace.day_reach`.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    MissingExtra
        If matplotlib is not installed.

    Examples
    --------
    >>> from exo_pin.view.plots import day_figure
    >>> day = ep.workspace.day_reach(ep.load("four-linear-actuators-worn"), ["forces"], step=30.0)
    >>> [text.get_text() for text in day_figure(day).axes[0].get_yticklabels()][0]
    'soup, at a table: yes'
    """
    require_type("day", day, Day)
    figure, axis = new_figure(8.4, 1.7 + 0.33 * len(day.tasks))
    first = np.array([[str(text).split(", ")[0] for text in row] for row in day.reasons])
    looks = [("inside", BLUE, day.inside)]
    looks += [(f"not met: {CRITERIA[name].words}", CRITERIA[name].colour, first == name) for name in CRITERIA]
    step = np.degrees(day.swivels[1] - day.swivels[0]) if len(day.swivels) > 1 else 360.0
    rows = np.arange(len(day.tasks))
    axis.barh(rows, 360.0, left=-180.0 - 0.5 * step, height=0.8, color="0.94")
    for label, colour, where in looks:
        task, at = np.nonzero(where)
        if len(task):
            left = np.degrees(day.swivels[at]) - 0.5 * step
            axis.barh(task, step, left=left, height=0.8, color=colour, label=label)
    axis.set_yticks(rows, [f"{name}: {can}" for name, can in zip(day.tasks, day.table["can_do"], strict=True)])
    axis.set(xlabel="swivel of the elbow about the line from shoulder to hand, °", ylim=(len(rows) - 0.5, -0.5))
    axis.set(xlim=(-180.0 - 0.5 * step, 180.0 - 0.5 * step), xticks=np.arange(-150.0, 151.0, 50.0))
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    done = day.summary()
    figure_title(
        figure, f"{day.design}: {done['done']} of {done['tasks']} tasks of a day", "grey: the person does not turn so"
    )
    tidy(axis)
    return figure
