"""Check of a design that was found: through Pinocchio, on a finer grid, for other persons, off centre.

The search uses closed forms; nothing it finds is reported before the poses of the lifting lines and a sample of the
others have been answered by :meth:`exo_pin.ShoulderExo.reaction`, which takes another way: constraint Jacobians and
inverse dynamics in Pinocchio, and a quadratic program.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput, SolverFailed
from ...core.errors.base import echo
from ...core.errors.checked import checked
from ...core.records import Record
from ...core.validation import FloatArray, as_positive, require_type
from ...design import Mechanism, Wearer
from ...device.protocol import Device
from ...device.wrist_device import as_device
from ...load_case import CentreOffset
from ...reaction.holding.least_held_forces import tension_limits
from ...wrist.clearance.gaps import beyond_elbow
from ..criteria import Criteria
from ..criterion import CRITERIA
from ..query import workspace
from ..result import Workspace
from .search_poses import Centre, centre_text, lifting_lines, shifted

if TYPE_CHECKING:
    from collections.abc import Callable

    from ...reaction import Reaction

#: Persons of the check, by stature and mass alike: ANSUR II, 4,082 men and 1,986 women, public tables.
PERSONS = {
    "woman, 5th percentile": Wearer(1.525, 51.0, "female"),
    "man, 5th percentile": Wearer(1.648, 64.0, "male"),
    "man, 50th percentile": Wearer(1.755, 85.0, "male"),
    "man, 95th percentile": Wearer(1.87, 111.0, "male"),
}
#: By how much the device's centre is off the shoulder's, m, along each axis.
_OFFSET = 0.01
#: Poses that are answered through Pinocchio besides the lifting lines.
_SAMPLE = 40
#: Largest difference of |F_s| between closed form and Pinocchio, relative to the largest tension.
_AGREEMENT = 1e-6


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
    pinocchio_poses : int
        Poses that were answered through Pinocchio as well.
    pinocchio_difference : float
        Largest difference of |F_s|, N.
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
    pinocchio_poses: int
    pinocchio_difference: float
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
        nearest = np.degrees(self.workspace.region_distance)
        region = f"{100 * self.workspace.region.mean():.1f} % of the poses, the nearest {nearest:.0f}° from rest"
        agreement = (
            f"Checked with Pinocchio: {self.pinocchio_poses} poses, |F_s| differs by at most "
            f"{self.pinocchio_difference:.1e} N."
        )
        lines = [
            *([] if self.centre_offset is None else [centre_text(self.centre_offset)]),
            str(self.workspace),
            "",
            f"On the grid of {self.finer_step:g}°: {100 * self.finer_index:.1f} %.",
            *([f"Largest connected region on one side of det X = 0: {region}."] if self.workspace.region.any() else []),
            *(
                f"{name} 0 to 90°: {int(each.inside.sum())} of {each.inside.size} poses inside, shoulder force at most "
                f"{np.nanmax(each.magnitude):.0f} N, least moment margin {np.nanmin(each.margins['forces']):.1f} N m."
                for name, each in (("Flexion", self.flexion), ("Abduction", self.abduction))
                if "forces" in each.margins and np.isfinite(each.magnitude).any()
            ),
            *([agreement] if self.pinocchio_poses else []),
            *(
                f"{name}: {100 * share:.1f} %{f'; {words}' if (words := self.beyond_elbow.get(name)) else ''}"
                for name, share in {**self.persons, **self.offsets}.items()
            ),
        ]
        return "\n".join(lines)


@checked
def recheck(
    mechanism: Device | Mechanism,
    reaction: Callable[..., Reaction],
    criteria: Criteria,
    finer_step: float = 2.0,
    centre_offset: Centre = None,
    step: float = 4.0,
) -> Recheck:
    """Check a design on the full grid, and its forces through Pinocchio.

    Parameters
    ----------
    mechanism : Device or Mechanism
        The design. One that is no wrist is asked through Pinocchio in all of its poses: none are checked besides.
    reaction : callable
        :meth:`exo_pin.ShoulderExo.reaction` of the design.
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

    Raises
    ------
    SolverFailed
        If Pinocchio and the closed form do not agree on which poses are held, or on |F_s|.

    Examples
    --------
    >>> from exo_pin.workspace import recheck
    >>> exo = ep.load("four-linear-actuators-worn")
    >>> found = recheck(exo.mechanism, exo.reaction, ep.Criteria(), finer_step=12.0)
    >>> bool(found.pinocchio_difference < 1e-6)  # N, of |F_s| by Pinocchio and by the closed form
    True
    """
    device: Any = as_device(mechanism)
    # Ahead of the grids, which take seconds.
    require_type("criteria", criteria, Criteria)
    if not callable(reaction):
        raise InvalidInput(f"expected reaction to be a function, got {echo(reaction)}")
    finer_step, step = as_positive("finer_step", finer_step), as_positive("step", step)
    full, wide = workspace(device, step, criteria, centre_offset=centre_offset), max(step, 8.0)
    record = device.accelerate("workspace")
    rows, along = criteria.off_grid(), lifting_lines(device.side)
    lines = [workspace(device, poses, rows, None, centre_offset) for poses in along]
    checked, difference = 0, float("nan")
    if record is not None and "forces" in full.margins:
        # Pinocchio is asked about the design's own arm, whoever wears the design in the check.
        own, answered = (
            criteria.replace(wearers=(), elbow_range=None, obstacles=(), body=criteria.body_of(record)),
            (full, lines),
        )
        if any(arm is not record.arm for arm in criteria.arms(record)):
            rows = own.off_grid()
            answered = (
                workspace(record, wide, own, centre_offset=centre_offset),
                [workspace(record, poses, rows, None, centre_offset) for poses in along],
            )
        checked, difference = _through_pinocchio(record, *answered, reaction, own)
    return Recheck(
        full,
        workspace(device, finer_step, criteria, centre_offset=centre_offset).index,
        finer_step,
        lines[0],
        lines[1],
        checked,
        difference,
        {} if device.arm is None else _persons(device, criteria, centre_offset, wide),
        {} if record is None else _beyond_elbow(record.geometry.platform_points),
        _offsets(device, criteria, centre_offset, wide),
        centre_offset,
    )


def _through_pinocchio(
    mechanism: Mechanism,
    full: Workspace,
    lines: list[Workspace],
    reaction: Callable[..., Reaction],
    criteria: Criteria,
) -> tuple[int, float]:
    """Number of poses and the largest difference of |F_s|, N."""
    held = np.flatnonzero(np.isfinite(full.magnitude).ravel())
    sample = np.random.default_rng(0).permutation(held)[:_SAMPLE]
    count, worst = 0, 0.0
    for part, rows in ((lines[0], None), (lines[1], None), (full, sample)):
        flat, n = part.magnitude.size, mechanism.limb_count
        chosen = np.flatnonzero(np.isfinite(part.magnitude).ravel()) if rows is None else rows
        if chosen.size == 0:
            continue
        lengths = part.lengths.reshape(flat, n)[chosen]
        low, high = tension_limits(mechanism, lengths, criteria.least_tension)
        answer = reaction(
            Rotation.from_quat(part.poses.as_quat().reshape(flat, 4)[chosen]),
            split="minimal",
            limits=(low, high),
            constraint_bounds=(0.0, 0.0),
            centre_offset=_offset_of(part, chosen),
        )
        if not hasattr(answer, "magnitude"):
            raise InvalidInput(f"expected reaction to give reactions, got {echo(answer)}")
        # A length out of its stroke is a criterion of its own here; the query then answers with plain equilibrium.
        gap = np.abs(answer.magnitude - part.magnitude.ravel()[chosen])[answer.status != "out_of_stroke"]
        scale = max(1.0, float(np.nanmax(np.abs(part.tensions.reshape(flat, n)[chosen]))))
        if not np.isfinite(gap).all() or gap.max(initial=0.0) > _AGREEMENT * scale:
            raise SolverFailed("Pinocchio", float(gap.max()), "difference of |F_s| to the closed form, N")
        inside = part.inside.ravel()[chosen]
        if "stroke" in part.margins and not (answer.can_hold | answer.unknown)[inside].all():
            raise SolverFailed("Pinocchio", float("nan"), "a pose inside the workspace cannot be held by its verdict")
        count, worst = count + len(chosen), max(worst, float(gap.max(initial=0.0)))
    return count, worst


def _offset_of(part: Workspace, chosen: np.ndarray) -> CentreOffset | None:
    """Offset in some poses of a workspace, by their index."""
    given, shape = part.centre_offset, (part.magnitude.size, 3)
    return None if given is None else CentreOffset(given.base.reshape(shape)[chosen], given.cuff.reshape(shape)[chosen])


def _beyond_elbow(points: FloatArray) -> dict[str, str]:
    """Joints on the arm, shape (n, 3), m, {O_B}, that lie beyond the elbow of some person, in words by person."""
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
