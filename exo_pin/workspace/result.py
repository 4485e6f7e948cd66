"""A workspace: which poses belong to it, by how much, and why the others do not."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..core.conventions import pose_columns
from ..core.errors import InvalidInput
from ..core.errors.checked import checked
from ..core.results import Result
from ..core.tables import effort_column, filled, position_column
from ..core.validation import FloatArray, ReadOnly, as_choice
from ..design import Wearer
from ..load_case import CentreOffset
from ..load_case.ranges_of_motion import Share, grid_axes, share_of_volume
from ..numerics.vectors import SINGULAR_MARGIN
from ..study import StudyTable
from .criteria import Criteria
from .criterion import CRITERIA, NO_LIMIT, NO_SPRINGS, forces
from .kernels import largest_region


@checked
@dataclass(frozen=True, eq=False)
class Workspace(Result, ReadOnly):
    """Poses of a design beside the criteria; a stack of shape (...), n limbs.

    Attributes
    ----------
    name, side : str
        Of the design.
    poses : Rotation
        Shape (...).
    criteria : Criteria
        Limits that were checked.
    margins : mapping of str to ndarray
        By criterion that was checked, shape (...): distance to its limit, zero or more where it is met, in
        the unit of :attr:`units`. NaN where it is not known, or the pose is singular; such a pose
        does not count as inside. "shoulder_force" is NaN where no tensions within the limits hold the arm.
    not_checked : mapping of str to str
        Criteria that were not checked, and why.
    lengths : ndarray
        l_i, or coordinates of the drives, shape (..., n), m or rad.
    margin : ndarray
        Shape (...): to a singular pose, as :attr:`exo_pin.Reaction.margin`. Where drives hold the arm in one way only
        (three, as three limbs), it is negative beyond the singular surface as seen from rest; where a device does not
        follow the arm to a pose, it is the part of the way that is left, below zero.
    tensions : ndarray
        f_i within the limits that make |F_s| least, shape (..., n), N; NaN where there are none or they were not
        computed.
    shoulder_force : ndarray
        F_s that goes with them, the force of the shoulder on the arm in the base frame, shape (..., 3), N.
    gaps : ndarray
        Least distance of the limbs to the arm, to the torso and to one another, shape (..., 3), m.
    centre_offset : CentreOffset or None
        Of the device's centre from the shoulder's, one a pose; None where the two are one.
    wearers : tuple of Wearer
        For all of whom the criteria hold; empty where it is not known who wears the design.
    stroke_unit : str
        Unit of the margin "stroke": "m", or "rad" where hinges are drives. Where slides are, too, their travel counts
        over their mean lever.
    posture : mapping, ndarray or None
        Values of idle joints by name, shape (N,) for all poses, or configurations (N, nq), if they were asked for.
    drive_units : tuple of (str, str)
        Name of each drive and unit of its effort, as :attr:`exo_pin.Reaction.drive_units`.

    Examples
    --------
    >>> exo = ep.load("four-linear-actuators-worn")
    >>> found = exo.workspace(exo.pose([0, 30, 60, 90]))
    >>> found.inside.tolist(), float(found.index)
    ([True, True, True, True], 1.0)
    """

    name: str
    side: str
    poses: Rotation
    criteria: Criteria
    margins: MappingProxyType[str, FloatArray]
    not_checked: MappingProxyType[str, str]
    lengths: FloatArray
    margin: FloatArray
    tensions: FloatArray
    shoulder_force: FloatArray
    gaps: FloatArray
    centre_offset: CentreOffset | None = None
    wearers: tuple[Wearer, ...] = ()
    stroke_unit: str = "m"
    posture: Any = None
    drive_units: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        for values in self.margins.values():
            values.setflags(write=False)
        super().__post_init__()

    @functools.cached_property
    def met(self) -> dict[str, NDArray[np.bool_]]:
        """By criterion, shape (...): whether it is met."""
        return {name: values >= 0.0 for name, values in self.margins.items()}

    @functools.cached_property
    def inside(self) -> NDArray[np.bool_]:
        """Shape (...): whether all criteria that were checked are met."""
        return np.logical_and.reduce([np.ones(self.margin.shape, dtype=bool), *self.met.values()])

    @property
    def index(self) -> float:
        """Φ of (C-1): the share of the poses that are inside, every pose counted once.

        Source: thesis (C-1).
        """
        return float(self.inside.mean())

    @functools.cached_property
    def volume_share(self) -> Share | None:
        """Share of the volume of these poses on the rotation group that is inside, with the estimate of its error.

        :attr:`index` counts poses, and a grid of equal steps has too many near 90° of abduction, where two of the
        angles turn about one axis. None for poses that are no grid of shoulder angles, which have no volume.
        """
        axes = grid_axes(self.poses, self.side)
        return None if axes is None else share_of_volume(self.inside, axes)

    @property
    def fractions(self) -> dict[str, float]:
        """By criterion: share of the poses that meet it."""
        return {name: float(met.mean()) for name, met in self.met.items()}

    @property
    def lost_to(self) -> dict[str, float]:
        """By criterion: share of the poses that would be inside without it."""
        failed = sum((~met).astype(int) for met in self.met.values())
        return {name: float((~met & (failed == 1)).mean()) for name, met in self.met.items()}

    def summary(self) -> dict[str, Any]:
        """Shares, and what each criterion costs, as plain values.

        Returns
        -------
        dict

        Examples
        --------
        >>> found = ep.load("four-linear-actuators-worn").workspace(20.0).summary()
        >>> found["poses"], round(found["index"], 3), round(found["fractions"]["clearance"], 3)  # shares
        (216, 0.87, 0.935)
        """
        share = self.volume_share
        return {
            "design": self.name,
            "poses": self.inside.size,
            "index": self.index,
            "volume_share": None if share is None else float(share),
            "volume_share_error": None if share is None else share.error,
            "fractions": self.fractions,
            "lost_to": self.lost_to,
            "one_by_one": dict(self.one_by_one()),
            "median_margins": self.median_margins,
            "units": self.units,
            "unknown": float(self.unknown.mean()),
            "not_evaluated": float(self.not_evaluated.mean()),
            "force_inside": self.force_inside,
            "largest_offsets": self.largest_offsets,
            "not_checked": dict(self.not_checked),
        }

    @property
    def median_margins(self) -> dict[str, float]:
        """Median margin of each criterion, in its unit; NaN where none is known."""
        return {
            name: float(np.nanmedian(values)) if np.isfinite(values).any() else float("nan")
            for name, values in self.margins.items()
        }

    @property
    def units(self) -> dict[str, str]:
        """Unit of the margin of each criterion."""
        of_drives = {"stroke": self.stroke_unit, "accuracy": f"{self.stroke_unit}/rad"}
        return {name: of_drives.get(name, CRITERIA[name].unit) for name in self.margins}

    @property
    def force_inside(self) -> dict[str, float]:
        """Mean and largest |F_s| over the poses inside, N; empty where it is not known in any."""
        force = self.magnitude[self.inside & np.isfinite(self.magnitude)]
        return {"mean": float(force.mean()), "largest": float(force.max())} if force.size else {}

    @property
    def largest_offsets(self) -> dict[str, float]:
        """How far the device's centre is off the shoulder's at most, m, at base and cuff; empty where it is not off."""
        sides = {} if self.centre_offset is None else vars(self.centre_offset)
        return {name: float(np.linalg.norm(side, axis=-1).max()) for name, side in sides.items()}

    def one_by_one(self, order: Iterable[str] | None = None) -> StudyTable:
        """What each criterion costs when the criteria are added one after the other.

        Parameters
        ----------
        order : iterable of str, optional
            Criteria that were checked, all in the order of :data:`exo_pin.workspace.CRITERIA` if left out.

        Returns
        -------
        StudyTable
            One row a criterion: ``criterion``; ``alone``, the share of the poses that meet it; ``together``, the share
            that meets it and all before it; ``cost``, by how much it lowers that share.

        Examples
        --------
        >>> found = ep.load("four-linear-actuators-worn").workspace(30.0)
        >>> table = found.one_by_one()
        >>> round(float(table["together"][-1] - found.index), 9)  # all criteria together are the index
        0.0
        """
        names = tuple(self.margins) if order is None else tuple(order)
        together, before, rows = np.ones(self.inside.shape, dtype=bool), 1.0, []
        for name in names:
            met = self.met[as_choice("criterion", name, tuple(self.margins))]
            together &= met
            share = float(together.mean())
            rows.append({"criterion": name, "alone": float(met.mean()), "together": share, "cost": before - share})
            before = share
        return StudyTable(rows)

    @property
    def unknown(self) -> NDArray[np.bool_]:
        """Shape (...): poses outside only because a force limit is not known at their lengths."""
        if "forces" not in self.margins:
            return np.zeros(self.inside.shape, dtype=bool)
        unknown = ~self.not_evaluated & np.isnan(self.margins["forces"]) & (np.abs(self.margin) > SINGULAR_MARGIN)
        for name, met in self.met.items():
            if forces not in CRITERIA[name].needs:
                unknown &= met
        return unknown

    @property
    def not_evaluated(self) -> NDArray[np.bool_]:
        """Shape (...): poses that the data of a spring do not cover; none where no spring was checked."""
        return np.asarray(self.margins.get("evaluated", np.zeros(self.inside.shape)) < 0.0)

    @property
    def reasons(self) -> NDArray[np.str_]:
        """Shape (...): the criteria that are not met, such as "stroke, forces"; "" inside."""
        names = list(self.margins)
        code = np.zeros(self.inside.shape, dtype=np.int64)
        for bit, name in enumerate(names):
            code |= (~self.met[name]).astype(np.int64) << bit
        texts = [", ".join(n for b, n in enumerate(names) if k >> b & 1) for k in range(1 << len(names))]
        return np.array(texts)[code]

    @property
    def magnitude(self) -> FloatArray:
        """|F_s|, shape (...), N: the least over tensions within the limits."""
        return np.asarray(np.linalg.norm(self.shoulder_force, axis=-1))

    @functools.cached_property
    def region(self) -> NDArray[np.bool_]:
        """Largest set of neighbouring poses inside on one side of the singular surface, shape (...).

        Raises
        ------
        InvalidInput
            If the poses are no grid of three dimensions.
        """
        if self.margin.ndim != 3:
            raise InvalidInput(
                f"expected poses on a grid of three angles, got a stack of shape {self.margin.shape}; use "
                "exo_pin.adl_box or RangeOfMotion.poses"
            )
        return largest_region(self.inside, self.margin)

    @property
    def region_distance(self) -> float:
        """Angle from rest, the pose of zero angles, to the nearest pose of :attr:`region`, rad; NaN if it is empty."""
        poses = self.poses[self.region]
        return float(poses.magnitude().min()) if self.region.any() else float("nan")

    @property
    def blocks_elbow(self) -> bool:
        """Whether joints lie beyond a wearer's elbow and the criterion "elbow" was not checked."""
        return NO_LIMIT not in self.not_checked.get("elbow", NO_LIMIT) and self.not_checked["elbow"] != "not chosen"

    def columns(self) -> dict[str, Any]:
        """Pose, verdict and reason, margins, drives and forces of every pose, with units in the names.

        Returns
        -------
        dict of str to ndarray
            Each of the stack's shape; the verdict is "inside", "outside" or "not known".

        Examples
        --------
        >>> table = ep.load("four-linear-actuators-worn").workspace(60.0).columns()
        >>> list(table)[:6]
        ['flexion_deg', 'abduction_deg', 'internal_rotation_deg', 'verdict', 'reason', 'margin_stroke_m']
        """
        open_ = self.unknown | self.not_evaluated
        verdict = np.where(self.inside, "inside", np.where(open_, "not known", "outside"))
        found = pose_columns(self.poses, self.side)
        found |= {"verdict": verdict.astype(object), "reason": self.reasons.astype(object)}
        for name, values in self.margins.items():
            # Names that are identifiers, as MATLAB has them.
            unit = self.units[name].replace(" ", "_").replace("/", "_per_")
            found[f"margin_{name}_{unit}".rstrip("_")] = values
        found |= {f"F_s_{axis}_N": self.shoulder_force[..., k] for k, axis in enumerate("xyz")}
        found |= {"F_s_N": self.magnitude, "singularity_margin": self.margin}
        count = self.lengths.shape[-1]
        units = self.drive_units[:count] or tuple((f"limb {k + 1}", "N") for k in range(count))
        found |= {position_column(*each): self.lengths[..., k] for k, each in enumerate(units)}
        return found | {effort_column(*each): self.tensions[..., k] for k, each in enumerate(units)}

    def __str__(self) -> str:
        total, volume_share = self.inside.size, self.volume_share
        volume = "" if volume_share is None else f" ({volume_share.percent} of their volume on the rotation group)"
        vital = [name for name in self.not_checked if CRITERIA[name].is_vital]
        vital += ["elbow"] if self.blocks_elbow else []
        without = f"; not checked: {', '.join(vital)}" if vital else ""
        lines = [f"{self.name}: {100 * self.index:.1f} % of {total} poses are inside{volume}{without}."]
        if self.wearers:
            lines.append(f"Worn by {_persons(self)}.")
        if self.centre_offset is not None:
            furthest = [1e3 * length for length in self.largest_offsets.values()]
            lines.append(
                "The device's centre is off the shoulder's, in these poses by at most "
                f"{furthest[0]:.0f} mm at the base and {furthest[1]:.0f} mm at the cuff."
            )
        if total > 1 and self.fractions.get("singularity", self.fractions.get("connected")) == 0.0:
            lines.append(
                filled(
                    "The device goes to none of these poses. One that turns the arm about fewer than three axes goes "
                    "to none of a grid: give poses that it has."
                )
            )
        if self.unknown.any():
            lines.append(f"{100 * self.unknown.mean():.1f} % more depend on force limits that are not known.")
        if self.not_evaluated.any():
            share = 100.0 * self.not_evaluated.mean()
            lines.append(f"{share:.1f} % are not evaluated: a spring has no data there, so nothing is known of forces.")
        force = self.force_inside
        if force:
            lines.append(
                f"Shoulder force inside: mean {force['mean']:.0f} N, largest {force['largest']:.0f} N "
                "(tensions chosen for the least)."
            )
        width = max([16, *(len(name) + 2 for name in self.margins)])
        if self.margins:
            lines += ["", f"{'criterion':<{width}}{'met':>9}{'only this':>12}{'median margin':>18}"]
        lost, middle = self.lost_to, self.median_margins
        for name, share in self.fractions.items():
            shares = f"{name:<{width}}{100 * share:>7.1f} %{100 * lost[name]:>10.1f} %"
            margin = f"{middle[name]:>12.3g} {self.units[name]}" if np.isfinite(middle[name]) else f"{'-':>12}"
            lines.append(f"{shares}{margin}".rstrip())
        unasked = [f"{name} ({CRITERIA[name].limit})" for name, why in self.not_checked.items() if NO_LIMIT in why]
        shown = {name: why for name, why in self.not_checked.items() if NO_LIMIT not in why and NO_SPRINGS not in why}
        lines += [_left_out(name, why) for name, why in shown.items()]
        lines += [filled(f"Without a limit: {', '.join(unasked)}.")] if unasked else []
        return "\n".join(lines)


def _left_out(name: str, why: str) -> str:
    """A criterion that is not checked, and why."""
    if why.startswith("does not apply"):
        return f"{name}: {why}"
    return f"{name}: not checked, {'because ' if why.startswith('not known') else ''}{why}"


def _persons(found: Workspace) -> str:
    """For whom the criteria hold, in words."""
    persons = [f"a person of {each.height:.2f} m and {each.mass:.0f} kg ({each.sex})" for each in found.wearers]
    if found.criteria.elbow_range is not None:
        low, high = np.degrees(found.criteria.elbow_range)
        elbow = f", while the elbow bends from {low:.0f} to {high:.0f}°"
    else:
        elbow = f", elbow at {' and '.join(sorted({f'{np.degrees(w.elbow_flexion):.0f}°' for w in found.wearers}))}"
    return " and by ".join(persons) + elbow
