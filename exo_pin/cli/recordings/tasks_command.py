"""``exo-pin tasks``: the share of daily tasks that a design reaches, and which poses of a recording over its time."""

from __future__ import annotations

from typing import Annotated, Any

from ...core.errors import InvalidInput
from ...core.results import drawn
from ...design import DEFAULT_PRESET
from ...load_case import read_movement
from ...load_case.ranges_of_motion import DAILY_RANGES
from ...workspace import day_reach, task_reach
from ...workspace.query import workspace as workspace_of
from .. import options
from ..command import Files, writes
from ..options.criteria_options import Judged
from ..options.recording_options import ReadAs


@writes(".csv", ".xlsx", ".json", plot="which poses of each recording are inside, over its time, or what a day needs")
def tasks(
    design: options.Design = DEFAULT_PRESET,
    /,
    *,
    side: options.Side = None,
    worn: options.Worn = options.Worn(),
    judged: Judged = Judged(),
    movement: Annotated[options.Texts, options.called("NAME=FILE")] = (),
    read_as: ReadAs = ReadAs(),
    no_ranges: bool = False,
    day: bool = False,
    step: options.Degrees = 8.0,
    files: Files = Files(),
) -> None:
    """Compute the share of daily tasks that a design reaches, from published ranges and from measured movements.

    Parameters
    ----------
    movement : tuple of str
        Recording of a task's movement; may be repeated.
    no_ranges : bool
        Leave the published ranges out.
    day : bool
        Places of the hand in a day instead: mouth, ear, hair, belt, pocket, shelf, in a chair, a car, bed and a door.
    step : float
        Step of the grid over a range, and of the arm's swivel with --day, degrees.

    Examples
    --------
    exo-pin tasks four-cables
    exo-pin tasks --day --plot day.png
    exo-pin tasks four-cables --movement lifting=examples/lift.csv --out tasks.csv --plot status.png
    """
    exo = worn.load(design, side)
    if day:
        options.refuse("--day has tasks of its own", movement=movement, no_ranges=no_ranges)
        found = day_reach(exo, judged.of(exo), step)
        files.deliver(found, found.table, exo=exo, figure=lambda: drawn("record_plots:day_figure", found))
        return
    if not movement:
        options.refuse("--movement was not given", **options.given(read_as))
    movements = {}
    for text in movement:
        name, _, path = text.partition("=")
        if not name or not path:
            raise InvalidInput(f"expected --movement NAME=FILE, got {text!r}")
        movements[name] = read_movement(path, exo.side, reading=read_as.options)
        for caution in movements[name].cautions:
            options.caution(f"{path}: {caution}")
    if files.plot is not None and not movements:
        raise InvalidInput("--plot draws recordings over their time: give --movement NAME=FILE")
    criteria = judged.of(exo)
    table = task_reach(exo.device, movements, () if no_ranges else DAILY_RANGES, criteria, step)

    def status() -> Any:
        within = criteria.off_grid()
        inside = {name: workspace_of(exo.device, each.poses, within).inside for name, each in movements.items()}
        return drawn("record_plots:task_status_figure", inside, {name: each.times for name, each in movements.items()})

    files.deliver(table, table, exo=exo, figure=status)
