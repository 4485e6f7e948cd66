"""``exo-pin parts``: drives, frame and cuff of a design, for a workshop."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from cyclopts import Parameter

from ...core.errors import InvalidInput
from ...core.schema import document
from ...design import DEFAULT_PRESET
from ...workspace.parts import parts_list, parts_sheet, with_drive_masses
from .. import options
from ..command import Files, check_file, writes
from ..options.criteria_options import Judged

_toml = partial(check_file, "--with-masses", (".toml",), False)


@dataclass(frozen=True)
class Parts:
    """Drives, frame and cuff of a design, a row each.

    Attributes
    ----------
    poses_inside : int
        Poses that the drives are chosen for, dimensionless.
    arm_speed_deg_s : float
        How fast the arm turns, °/s.
    known_mass_kg : float
        Mass of the parts whose mass is known, kg.
    columns : dict of str to list
        By name, which ends in the unit.
    """

    poses_inside: int
    arm_speed_deg_s: float
    known_mass_kg: float
    columns: dict[str, list[Any]]


@writes(".csv", ".xlsx", ".json")
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
    arm_speed: Annotated[float, options.called("DEG/S")] = 30.0,
    drive_mass: options.Kilograms | None = None,
    with_masses: Annotated[Path | None, Parameter(metavar="FILE", validator=_toml)] = None,
    files: Files = Files(),
) -> None:
    """List drives, frame and cuff of a design, with lengths, forces, speeds, power, mass, and products that fit.

    Drives do what the poses inside the workspace ask. Products are chosen by force and travel from a short table.

    Parameters
    ----------
    step : float
        Step of the grid of poses, degrees.
    arm_speed : float
        Speed of the arm, about any axis, for which speed and power of the drives are given, degrees/s.
    drive_mass : float, optional
        Mass of each drive whose mass is not known, kg.
    with_masses : Path, optional
        Write the design with the masses of its drives, for other commands.

    Examples
    --------
    exo-pin parts --drive-mass 0.325 --with-masses heavy.toml
    exo-pin parts four-linear-actuators-worn --step 20 --out parts.csv
    """
    exo = worn.load(design, side)
    found = exo.workspace(step, judged.of(exo), centre_offset=options.centre_of(offset, moving_centre, exo))
    table = parts_list(exo.device, found, np.radians(arm_speed), drive_mass)
    mechanism = exo.device.accelerate("workspace")
    if with_masses is not None:
        if mechanism is None:
            raise InvalidInput(f"--with-masses is for designs of limbs; the file of {exo.name} has masses of its links")
        heavy = with_drive_masses(mechanism, table["mass_kg"][: mechanism.limb_count])
        type(exo).from_mechanism(heavy).save(with_masses)
    asked = {
        "poses_inside": int(found.inside.sum()),
        "arm_speed_deg_s": arm_speed,
        "known_mass_kg": np.nansum(table["mass_kg"]),
    }
    text = f"For {asked['poses_inside']} poses inside and an arm that turns with {arm_speed:g}°/s."
    files.deliver(
        f"{parts_sheet(exo.device, table)}\n{text}",
        data=lambda: document(Parts, asked | {"columns": dict(table)}),
        columns=lambda: table,
        notes=lambda: asked,
        exo=exo,
    )
