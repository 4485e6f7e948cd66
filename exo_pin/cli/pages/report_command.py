"""``exo-pin report``: what a design does for a person, on two pages."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from ...core.optional_packages import require_extra
from ...design import DEFAULT_PRESET
from ...report.pages import ENDINGS
from .. import options
from ..command import Files, writes


@writes(*ENDINGS, ".json")
def report(
    design: options.Design = DEFAULT_PRESET,
    /,
    *,
    side: options.Side = None,
    worn: options.Worn = options.Worn(),
    arm_speed: Annotated[float, options.called("DEG/S")] = 30.0,
    files: Files = Files(),
) -> None:
    """Report on a design and a person: forces on the shoulder, range of motion, drives to buy, fit, and hazards.

    Two A4 pages, with a picture of three postures, what was assumed and what was not checked (needs the extra
    'report').

    Parameters
    ----------
    arm_speed : float
        Speed of the arm for which speed and power of the drives are given, degrees/s.

    Examples
    --------
    exo-pin report --person 1.75,75,male --out report.pdf
    exo-pin report urdf/prototype.urdf --person 1.60,55,female --out prototype.html
    """
    require_extra("report")
    exo, named = worn.load(design, side), Path(design)
    wearer = options.own_wearer(exo)
    found = exo.report(wearer, arm_speed, named if named.is_file() else None)
    files.deliver(found, data=found.document, exo=exo, save=found.save)
