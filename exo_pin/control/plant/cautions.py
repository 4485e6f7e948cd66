"""Doubts about the muscles of a run, and about drives whose motion takes long to compute."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.errors.base import ExoPinWarning, warn
from ...muscle.laws.static import BAR
from .drives import MuscleDrive

if TYPE_CHECKING:
    from .plant import Plant
    from .run import Run

#: Share by which pressures may exceed a limit, as of an integration.
_SLACK = 1e-3
#: Damping over critical damping from which a motion takes many steps, or long ones that are implicit.
_STIFF = 10.0


def muscle_cautions(run: Run) -> Iterator[str]:
    """Sentences on the muscles of a run; none for a plant without muscles."""
    muscles = [(i, drive) for i, drive in enumerate(run.plant.drives) if isinstance(drive, MuscleDrive)]
    inside, pulls = run.in_range, run.tensions > 0.0
    pulling = {f"muscle {i + 1}": inside[pulls[:, i], i] for i, _ in muscles if pulls[:, i].any()}
    every = np.concatenate([np.ones(0, dtype=bool), *pulling.values()])
    if not every.all():
        yield (
            f"The force laws of the muscles were identified in {_percent(every)} of the states in which they pull "
            f"({', '.join(f'{name}: {_percent(part)}' for name, part in pulling.items())}), and are extrapolated "
            "elsewhere."
        )
    for i, drive in muscles:
        most = float(run.pressures[:, i].max())
        if most > drive.supply_pressure * (1.0 + _SLACK):
            yield (
                f"Muscle {i + 1} reaches {most / BAR:.3g} bar, above its greatest safe pressure of "
                f"{drive.supply_pressure / BAR:.3g} bar: lower the supply."
            )


def warn_of_stiff_drives(plant: Plant) -> None:
    """Warn of drives that creep behind their limb: their motion decays faster by far than that of the arm."""
    found = {f"{drive.word} {i}": drive.damping_ratio for i, drive in enumerate(plant.drives, 1)}
    stiff = {name: ratio for name, ratio in found.items() if ratio > _STIFF}
    if stiff:
        warn(
            f"The damping of the spring is up to {max(stiff.values()):.3g} times critical in {', '.join(stiff)}: the "
            "run is right, and takes long. A damping_time is given in s, and is about 5e-4",
            ExoPinWarning,
        )


def _percent(met: NDArray[np.bool_]) -> str:
    """A share in percent, never rounded to all or to none."""
    share = 100.0 * float(met.mean())
    return f"{min(max(round(share), int(share > 0.0)), 100 - int(share < 100.0))} %"
