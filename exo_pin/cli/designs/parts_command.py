"""``exo-pin parts``: drives, frame and cuff of a design, for a workshop."""

from __future__ import annotations

from json import dumps
from pathlib import Path
from typing import Annotated

import numpy as np

from ...core.results import plain
from ...design import DEFAULT_PRESET
from ...workspace.parts import parts_list, parts_sheet
from .. import options
from ..command import deliver, writes
from ..options.criteria_options import Judged


def parts(
    design: options.Design = DEFAULT_PRESET,
    /,
    *,
    side: options.Side = None,
    worn: options.Worn = options.Worn(),
    offset: options.Offset = None,
    moving_centre: options.MovingCentre = False,
    judged: Judged = Judged(),
    step: options.Degrees = 8.0,
    rate: Annotated[float, options.called("DEG/S")] = 30.0,
    json: options.Json = False,
    out: Annotated[Path | None, writes(".csv", ".json", picture=False)] = None,
) -> None:
    """List drives, frame and cuff of a design, with lengths, forces, speeds, power, mass, and products that fit.

    Drives do what the poses inside the workspace ask. Products are chosen by force and travel from a short table.

    Parameters
    ----------
    step : float
        Step of the grid of poses, degrees.
    rate : float
        How fast the arm turns, about any axis, degrees a second.

    Examples
    --------
    exo-pin parts four-linear-actuators-worn --step 20 --out parts.csv
    """
    exo = worn.load(design, side)
    found = exo.workspace(step, judged.of(exo), centre_offset=options.centre_of(offset, moving_centre, exo))
    table = parts_list(exo.device, found, np.radians(rate))
    asked = {"poses_inside": int(found.inside.sum()), "rate_deg_s": rate, "known_mass_kg": np.nansum(table["mass_kg"])}
    text = f"For {asked['poses_inside']} poses inside and an arm that turns with {rate:g}°/s."
    deliver(
        f"{parts_sheet(exo.device, table)}\n{text}",
        as_json=lambda: dumps(plain(asked | {"columns": dict(table)}), indent=2),
        columns=lambda: table,
        json=json,
        out=out,
    )
