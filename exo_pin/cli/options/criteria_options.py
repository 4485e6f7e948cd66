"""Options of what a pose of the workspace has to meet."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

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
        Another person for whom the criteria must hold, too; may be repeated.
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
    without_limb : float, optional
        Additional moment that the other limbs must resist when any one limb fails, N m; 0: they must hold the arm
        (default: not checked).
    rate : float, optional
        Least rate of the drives about the arm's worst axis, mm of their lengths per degree, of hinges degrees per
        degree (default: not checked).
    no_twins : bool
        No pose 10° away or more may look the same to the drives.
    """

    criteria: Annotated[str | None, options.called("NAMES")] = None
    fits: Annotated[options.Texts, options.called("HEIGHT,MASS,SEX")] = ()
    elbow_range: Annotated[str | None, options.called("LOW,HIGH")] = None
    gap: options.Millimetres = 0.0
    obstacle: Annotated[options.Texts, options.called("NAME")] = ()
    shoulder_force: options.Newtons | None = None
    least_tension: options.Newtons = 0.0
    without_limb: Annotated[float | None, options.called("NM")] = None
    rate: Annotated[float | None, options.called("MM")] = None
    no_twins: bool = False

    def of(self, exo: ShoulderExo) -> Criteria:
        """The criteria that the options name; they hold for who wears the design, and for all of ``--fits``."""
        own, bend = options.own_wearer(exo), None
        others = [options.wearer_of(text, clothing=own.clothing if own else 0.0) for text in self.fits]
        if self.elbow_range:
            bend = np.radians(options.numbers(self.elbow_range, "--elbow-range LOW,HIGH in degrees", 2))
        return Criteria(
            names=None if self.criteria is None else tuple(name.strip() for name in self.criteria.split(",")),
            obstacles=self.obstacle,
            least_tension=self.least_tension,
            largest_shoulder_force=self.shoulder_force,
            least_moment_without_limb=self.without_limb,
            least_rate=None if self.rate is None else self.rate * (1.0 if are_hinges(exo.device).any() else _MM_DEGREE),
            least_twin_angle=TWIN_ANGLE if self.no_twins else None,
            least_gap=1e-3 * self.gap,
            wearers=(*([own] if others and own is not None else []), *others),
            elbow_range=None if bend is None else (bend[0], bend[1]),
        )
