"""The document of a workspace: shares and margins, without its poses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..core.schema import document
from .result import Workspace


@dataclass(frozen=True)
class WorkspaceSummary:
    """Which poses of a grid a design reaches, holds and keeps safe.

    Attributes
    ----------
    design : str
        Its name.
    poses : int
        Number of poses, 1.
    index : float
        Share of poses that meet all criteria.
    volume_share, volume_share_error : float or None
        Share of the group of rotations, and its error.
    fractions, lost_to : dict of str to float
        By criterion: share of poses that meet it, and that it alone excludes.
    one_by_one : dict
        What each criterion costs as they are added one by one.
    median_margins : dict of str to float
        By criterion, in the unit that ``units`` names.
    unknown, not_evaluated : float
        Share of poses of which it is not known.
    force_inside : dict of str to float
        |F_s| over the poses inside, N.
    largest_offsets : dict
        Of moving centres, m.
    not_checked : dict of str to str
        Criteria that were not checked, and why.
    centre_offset_mm : list of float
        How far the device's centre is off the shoulder's, mm.
    moving_centre : bool
        Whether the shoulder's centre moves with the arm.
    contact_N, peak_contact_N, contact_without_N : float
        Force in the joint with the wearer's own muscles over poses inside, N: median, largest, and median without the
        device.
    relief : float
        Median share of it that the device takes.
    """

    design: str
    poses: int
    index: float
    volume_share: float | None
    volume_share_error: float | None
    fractions: dict[str, float]
    lost_to: dict[str, float]
    one_by_one: dict[str, list[Any]]
    median_margins: dict[str, float]
    unknown: float
    not_evaluated: float
    force_inside: dict[str, float] | None
    largest_offsets: dict[str, Any]
    not_checked: dict[str, str]
    centre_offset_mm: list[float] | None = None
    moving_centre: bool | None = None
    contact_N: float | None = None
    peak_contact_N: float | None = None
    contact_without_N: float | None = None
    relief: float | None = None


def workspace_document(found: Workspace, asked: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """The document of a workspace, whose margins have the units of their criteria, with what was ``asked``."""
    body = found.summary() | dict(asked or {})
    margins = body.pop("units")
    whole = document(WorkspaceSummary, body)
    return whole | {"units": {**whole["units"], "median_margins": margins}}
