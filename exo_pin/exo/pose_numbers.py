"""What a report on a pose has as plain data besides its fields."""

from __future__ import annotations

from dataclasses import dataclass

from ..core.validation import FloatArray

__all__: list[str] = []


@dataclass(frozen=True)
class PoseNumbers:
    """What stands beside the forces of a pose, as plain data.

    Attributes
    ----------
    weakest_rate : float
        Least change of the drives' positions over the turn of the arm, in its own unit.
    weakest_rate_unit : str
        That unit.
    twin_degrees : float or None
        Angle to another pose that looks the same to the drives, degrees.
    twin_difference_rss : float or None
        Root of the sum of squares of what the drives' positions differ by in that pose, m or rad.
    bare_arm_share : tuple of float or None
        Least and greatest joint force of a bare arm at this elevation, % of body weight, computed for abduction and
        flexion; None with a load, a motion, a bent elbow or a torso that leans.
    wearer : dict of str to float or None
        Height and mass by name, m and kg.
    percent_of_limits : ndarray
        Effort of each drive, % of its limit.
    force_on_head_in_socket : ndarray or None
        -F_s, N, in the axes of the socket: out of it, up, forward.
    emg_fall_percent : tuple of float
        By how much devices lower the EMG of wearers, as published, %.
    relief_percent : dict of str to float
        Relief of the joint, %, where muscles keep so much of their activation.
    singular_kind : str
        Kind of a singular pose, or "regular".
    singular_margin : float
        Distance from a singular pose, dimensionless.
    singular_distance : float
        The same, degrees.
    limb_lengths, strokes : ndarray
        Lengths of the limbs, and least and greatest ones, m.
    drive_coordinates : ndarray
        Positions of drives that are no limbs, m or rad.
    drive_units : list of list of str
        Name and unit of the effort of each.
    """

    weakest_rate: float
    weakest_rate_unit: str
    twin_degrees: float | None
    twin_difference_rss: float | None
    bare_arm_share: tuple[float, float] | None
    wearer: dict[str, float] | None
    percent_of_limits: FloatArray
    force_on_head_in_socket: FloatArray | None
    emg_fall_percent: tuple[float, float]
    relief_percent: dict[str, float]
    singular_kind: str
    singular_margin: float
    singular_distance: float
    limb_lengths: FloatArray
    strokes: FloatArray
    drive_coordinates: FloatArray
    drive_units: list[list[str]]
