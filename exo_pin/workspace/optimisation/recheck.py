"""Check of a design that was found: on a finer grid, for other persons, off centre."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...core.errors.checked import checked
from ...core.records import Record
from ...core.validation import FloatArray, as_positive, require_type
from ...design import Mechanism, Wearer
from ...device.protocol import Device
from ...device.wrist_device import as_device
from ...wrist.clearance.gaps import beyond_elbow
from ..criteria import Criteria
from ..criterion import CRITERIA
from ..query import workspace
from ..result import Workspace
from .search_poses import Centre, centre_text, lifting_lines, shifted

#: Persons of the check, by stature and mass alike: ANSUR II, 4,082 men and 1,986 women, public tables.
PERSONS = {
    "woman, 5th percentile": Wearer(1.525, 51.0, "female"),
    "man, 5th percentile": Wearer(1.648, 64.0, "male"),
    "man, 50th percentile": Wearer(1.755, 85.0, "male"),
    "man, 95th percentile": Wearer(1.87, 111.0, "male"),
}
#: By how much the device's centre is off the shoulder's, m, along each axis.
_OFFSET = 0.01


@dataclass(frozen=True, eq=False)
class Recheck(Record):
    """What a design does on the full grid.

    Attributes
    ----------
    workspace : Workspace
        On the full grid; that of 4° has 19,656 poses.
    finer_index : float
        Φ on the grid of ``finer_step`` degrees.
    finer_step : float
        Degrees.
    flexion, abduction : Workspace
        Lifting forward and sideways from 0 to 90° in steps of 5°.
    persons : dict of str to float
        Φ by person: with their arm and body.
    beyond_elbow : dict of str to str
        Of persons beyond whose elbow joints lie: which joints.
    offsets : dict of str to float
        Φ with the device's centre 10 mm further off the shoulder's, by direction: base and cuff both.
    centre_offset : CentreOffset, CentrePath or None
        Where the device's centre lies in all of this, seen from the shoulder's; of other persons, too.
    """

    workspace: Workspace
    finer_index: float
    finer_step: float
    flexion: Workspace
    abduction: Workspace
    persons: dict[str, float]
    beyond_elbow: dict[str, str]
    offsets: dict[str, float]
    centre_offset: Centre = None

    @property
    def works(self) -> bool:
        """Whether lifting to 90° is inside in both directions, and at least 80 % of the grid, by all of the criteria.

        False where a criterion that is vital (:class:`~exo_pin.workspace.criterion.Criterion`) was not checked, or
        joints lie beyond the wearer's elbow.
        """
        complete = all(name in self.workspace.margins for name, each in CRITERIA.items() if each.is_vital)
        complete &= not self.workspace.blocks_elbow
        lifts = self.flexion.inside.all() and self.abduction.inside.all()
        return bool(complete and lifts and self.workspace.index >= 0.8)

    def __str__(self) -> str:
        lines = [
            *([] if self.centre_offset is None else [centre_text(self.centre_offset)]),
            str(self.workspace),
            "",
            f"On the grid of {self.finer_step:g}°: {100 * self.finer_index:.1f} %.",
            *(
                f"{name} 0 to 90°: {int(each.inside.sum())} of {each.inside.size} poses inside, shoulder force at most "
                f"{np.nanmax(each.magnitude):.0f} N, least moment margin {np.nanmin(each.margins['forces']):.1f} N m."
                for name, each in (("Flexion", self.flexion), ("Abduction", self.abduction))
                if "forces" in each.margins and np.isfinite(each.magnitude).any()
            ),
            *(
                f"{name}: {100 * share:.1f} %{f'; {words}' if (words := self.beyond_elbow.get(name)) else ''}"
                for name, share in {**self.persons, **self.offsets}.items()
            ),
        ]
        return "\n".join(lines)


@checked
def recheck(
    mechanism: Device | Mechanism,
    criteria: Criteria,
    finer_step: float = 2.0,
    centre_offset: Centre = None,
    step: float = 4.0,
) -> Recheck:
    """Check a design on the full grid and on a finer one, for other persons, and off centre.

    Parameters
    ----------
    mechanism : Device or Mechanism
        The design.
    criteria : Criteria
        Limits; "connected" is checked too where they name no criteria.
    finer_step : float
        Of the second grid, degrees.
    centre_offset : CentreOffset or CentrePath, optional
        Where the device's centre lies, seen from the shoulder's: the same for all poses, or a path.
    step : float
        Of the full grid, degrees; those of other persons and further offsets are of 8°, or of this one if it is wider.

    Returns
    -------
    Recheck

    Examples
    --------
    >>> from exo_pin.workspace import recheck
    >>> exo = ep.load("four-linear-actuators-worn")
    >>> found = recheck(exo.mechanism, ep.Criteria(), finer_step=12.0)
    >>> found.works  # lifts to 90° both ways, and holds 80 % of the poses
    True
    """
    device: Any = as_device(mechanism)
    # Ahead of the grids, which take seconds.
    require_type("criteria", criteria, Criteria)
    finer_step, step = as_positive("finer_step", finer_step), as_positive("step", step)
    full, wide = workspace(device, step, criteria, centre_offset=centre_offset), max(step, 8.0)
    record = device.accelerate("workspace")
    rows, along = criteria.off_grid(), lifting_lines(device.side)
    lines = [workspace(device, poses, rows, None, centre_offset) for poses in along]
    return Recheck(
        full,
        workspace(device, finer_step, criteria, centre_offset=centre_offset).index,
        finer_step,
        lines[0],
        lines[1],
        {} if device.arm is None else _persons(device, criteria, centre_offset, wide),
        {} if record is None else _beyond_elbow(record.geometry.platform_points),
        _offsets(device, criteria, centre_offset, wide),
        centre_offset,
    )


def _beyond_elbow(points: FloatArray) -> dict[str, str]:
    found = {name: beyond_elbow(points, (each,)) for name, each in PERSONS.items()}
    return {name: words for name, words in found.items() if words}


def _persons(design: Any, criteria: Criteria, centre_offset: Centre, step: float) -> dict[str, float]:
    """Φ by person, on a wide grid; the gap is there for such differences, so no gap is demanded besides.

    The elbow bends as that of the wearers of the check.
    """
    bend = max((each.elbow_flexion for each in criteria.wearers_of(design)), default=0.0)
    gap, shares = min(criteria.least_gap, 0.0), {}
    for name, person in PERSONS.items():
        # Another person has another body.
        limits = criteria.replace(wearers=(replace(person, elbow_flexion=bend),), least_gap=gap, body=None)
        shares[name] = workspace(design, step, limits, None, centre_offset).index
    return shares


def _offsets(design: Any, criteria: Criteria, centre_offset: Centre, step: float) -> dict[str, float]:
    """Φ with the device's centre further off the shoulder's, on a wide grid: joints on torso and arm moved alike.

    As for other persons, no gap is demanded besides.
    """
    shares, limits = {}, criteria.replace(least_gap=min(criteria.least_gap, 0.0))
    for axis, name in enumerate(("forward", "to the left", "up")):
        for sign in (1.0, -1.0):
            shift = np.zeros(3)
            shift[axis] = sign * _OFFSET
            label = f"centre {1e3 * sign * _OFFSET:+.0f} mm {name}"
            shares[label] = workspace(design, step, limits, None, shifted(centre_offset, shift)).index
    return shares
