"""Options of what a pose of the workspace has to meet."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from ...core.errors import InvalidInput
from ...device.accuracy.pose_accuracy import are_hinges
from ...device.accuracy.twins import TWIN_ANGLE
from ...exo.shoulder_exo import ShoulderExo
from ...workspace import Criteria
from .. import options

#: 1 mm/°, m/rad.
_MM_DEGREE = 0.18 / np.pi


@options.group
@dataclass(frozen=True)
class Judged:
    """What a pose has to meet.

    Attributes
    ----------
    criteria : str, optional
        Names of criteria with commas between them (default: all that the data allow).
    fits : tuple of str
        Another person for whom the criteria must hold, too, in the same posture; may be repeated.
    elbow_range : str, optional
        The criteria hold while the elbow bends over this range, degrees (default: --elbow-flexion alone).
    gap : float
        Distance that limbs keep from body and arm and from one another, mm.
    obstacle : tuple of str
        What else limbs keep clear of: chair, wheelchair, car, bed, door, or wall:MM behind the back, ceiling:MM above
        the head; may be repeated.
    shoulder_force : float, optional
        Largest shoulder force |F_s|, N (default: no limit).
    least_tension : float
        Least tension of limbs that only pull, N.
    least_moment : float
        Additional moment in any direction that the limbs must resist, N m.
    pull_out : float, optional
        Largest component of F_s that pulls the humeral head out of the wearer's socket, N (default: no limit).
    cuff_pull : float, optional
        Largest pull of the cuff along the arm, N (default: no limit).
    cuff_slip : float, optional
        Largest slip of the design's soft cuff on the arm, mm (default: no limit).
    above_elbow : float, optional
        Distance that the cuff keeps from the elbow of --person and of all --fits, mm (default: not checked).
    without_limb : float, optional
        Additional moment that the other limbs must resist when any one limb fails, N m; 0: they must hold the arm
        (default: not checked).
    least_rate : float, optional
        Least rate of the drives about the arm's worst axis, mm of their lengths per degree, of hinges degrees per
        degree (default: not checked).
    no_twins : bool
        No pose 10° away or more may look the same to the drives.
    least_margin : float
        Least margin to a singular pose, 0 to 1.
    stroke_rule : str
        Which limb lengths exclude a pose: any limb beyond its stroke (each), or, as in Appendix C, all limbs too short.
    """

    criteria: Annotated[str | None, options.called("NAMES")] = None
    fits: Annotated[options.Texts, options.called("HEIGHT,MASS,SEX")] = ()
    elbow_range: Annotated[str | None, options.called("LOW,HIGH")] = None
    gap: options.Millimetres = 0.0
    obstacle: Annotated[options.Texts, options.called("NAME")] = ()
    shoulder_force: options.Newtons | None = None
    least_tension: options.Newtons = 0.0
    least_moment: Annotated[float, options.called("NM")] = 0.0
    pull_out: options.Newtons | None = None
    cuff_pull: options.Newtons | None = None
    cuff_slip: options.Millimetres | None = None
    above_elbow: options.Millimetres | None = None
    without_limb: Annotated[float | None, options.called("NM")] = None
    least_rate: Annotated[float | None, options.called("MM")] = None
    no_twins: bool = False
    least_margin: float = 0.05
    stroke_rule: Literal["each", "not all short"] = "each"

    def of(self, exo: ShoulderExo) -> Criteria:
        """The criteria that the options name; they hold for who wears the design, and for all of ``--fits``."""
        own, bend = options.own_wearer(exo), None
        others = [options.wearer_of(text, **(own.posture if own else {})) for text in self.fits]
        if self.elbow_range:
            bend = np.radians(options.numbers(self.elbow_range, "--elbow-range LOW,HIGH in degrees", 2))
        if self.pull_out is not None and own is None:
            raise InvalidInput("--pull-out needs to know whose socket it is: give --person too")
        scale = 1.0 if are_hinges(exo.device).any() else _MM_DEGREE
        return Criteria(
            names=None if self.criteria is None else tuple(name.strip() for name in self.criteria.split(",")),
            least_margin=self.least_margin,
            obstacles=self.obstacle,
            stroke_rule=self.stroke_rule,
            least_tension=self.least_tension,
            least_moment=self.least_moment,
            largest_shoulder_force=self.shoulder_force,
            largest_pull_out=self.pull_out,
            socket=None if self.pull_out is None or own is None else options.with_muscles(own).glenoid_cone(),
            largest_cuff_pull=self.cuff_pull,
            largest_cuff_slip=metres(self.cuff_slip),
            least_above_elbow=metres(self.above_elbow),
            least_moment_without_limb=self.without_limb,
            least_rate=None if self.least_rate is None else self.least_rate * scale,
            least_twin_angle=TWIN_ANGLE if self.no_twins else None,
            least_gap=1e-3 * self.gap,
            wearers=(*([own] if others and own is not None else []), *others),
            elbow_range=None if bend is None else (bend[0], bend[1]),
        )


def metres(millimetres: float | None) -> float | None:
    """Of a length in mm; None of none."""
    return None if millimetres is None else 1e-3 * millimetres
