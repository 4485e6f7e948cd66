"""Frame and cuff that could hold a design's joints: bows and a sleeve, made of the joint centres alone, and their mass.

They are no part of a design: the viewer draws them, and a search may take the cuff's mass from them where none is
known. Assumed: bars of aluminium tube, 13 mm in diameter with a wall of 1.5 mm, 2,700 kg/m³; a sleeve of plastic with a
wall of 4 mm, 1,200 kg/m³; 50 g for the joint of each limb. Drives are not in it: what they weigh is for the design to
state, as mass of its limbs.
"""

from __future__ import annotations

import numpy as np

from ..core.errors import MissingData
from ..core.validation import FloatArray
from .arm import Arm
from .geometry import WristGeometry
from .mechanism import Mechanism

#: Radius of bars, wall of the sleeve, and wall of bars, m.
BAR, WALL, _TUBE_WALL = 0.0065, 0.004, 0.0015
#: The sleeve: radius about the arm's axis at most, least height, and how near to O its middle comes, m.
_SLEEVE, _SLEEVE_HEIGHT, _SLEEVE_TOP = 0.066, 0.060, -0.075
#: Mass of a bar, kg/m, and of a joint, kg; density of the sleeve, kg/m³.
PER_METRE = 2700.0 * np.pi * (BAR**2 - (BAR - _TUBE_WALL) ** 2)
PER_JOINT, _PLASTIC = 0.05, 1200.0
#: Places of the sleeve that stand for it, around and along.
_AROUND, _ALONG = 24, 5


def holding_bars(geometry: WristGeometry) -> tuple[list[FloatArray], list[FloatArray]]:
    """Middle lines of the bars of the frame, base frame, and of the cuff, arm frame, each of shape (k, 3), m."""
    base, arm = np.asarray(geometry.base_points), np.asarray(geometry.platform_points)
    over = np.array([0.0, 1.0, 0.0] if geometry.base_axis is None else geometry.base_axis)
    about = np.array([0.0, 0.0, 1.0] if geometry.platform_axis is None else geometry.platform_axis)
    return [_bow(base, over)], [_bow(arm, about), *_struts(arm)]


def sleeve_size(points: FloatArray) -> tuple[float, float, float]:
    """Radius about the arm's axis, and the heights of both rims, m: as high as the joints on it, shape (n, 3), m."""
    radius = float(np.clip(np.hypot(points[:, 0], points[:, 1]).min() - BAR, 0.03, _SLEEVE))
    low, high = points[:, 2].min(), points[:, 2].max()
    middle = min((low + high) / 2, _SLEEVE_TOP)
    half = max(_SLEEVE_HEIGHT, high - low + 0.02) / 2
    return radius, middle - half, middle + half


def estimated_frame_mass(geometry: WristGeometry) -> float:
    """Mass of bars and joints of the frame, kg; what holds it on the torso is not in it."""
    length = sum(_lengths(bar).sum() for bar in holding_bars(geometry)[0])
    return float(PER_METRE * length + PER_JOINT * geometry.limb_count)


def device_mass(mechanism: Mechanism) -> float:
    """Mass of frame and cuff by geometry, and of the limbs as far as the design states it, kg."""
    drives = sum(limb.mass for limb in mechanism.limbs)
    return float(estimated_frame_mass(mechanism.geometry) + estimated_cuff(mechanism.geometry).mass + drives)


def mass_text(mechanism: Mechanism) -> str:
    """Masses of frame, cuff and drives, and where they come from, in words."""
    frame, cuff = estimated_frame_mass(mechanism.geometry), estimated_cuff(mechanism.geometry).mass
    drives = sum(limb.mass for limb in mechanism.limbs)
    stated = (
        f"drives {drives:.2f} kg, as the design states"
        if drives
        else "the design does not state the mass of its drives"
    )
    return f"Estimated from the geometry: bars and joints of the frame {frame:.2f} kg, cuff {cuff:.2f} kg; {stated}."


def frame_parts(geometry: WristGeometry) -> list[tuple[str, int, float, float, str]]:
    """Parts of frame and cuff: name, number, length of tube or sleeve, m, mass of all of them, kg, and what of."""
    points, n = np.asarray(geometry.platform_points), geometry.limb_count
    frame, cuff = (sum(float(_lengths(bar).sum()) for bar in bars) for bars in holding_bars(geometry))
    radius, bottom, top = sleeve_size(points)
    shell = _PLASTIC * 2.0 * np.pi * radius * WALL * (top - bottom)
    plastic = f"plastic, {1e3 * WALL:.0f} mm, inner radius {1e3 * radius:.0f} mm"
    tube = f"aluminium tube {2e3 * BAR:.0f} x {1e3 * _TUBE_WALL:.1f} mm, bent"
    return [
        ("bars of the frame", 1, frame, PER_METRE * frame, tube),
        ("bars of the cuff", 1, cuff, PER_METRE * cuff, tube),
        ("sleeve of the cuff", 1, top - bottom, shell, plastic),
        ("joints", 2 * n, float("nan"), 2 * n * PER_JOINT, "ball joints or forks, 50 g each; see --limb-table"),
    ]


def estimated_cuff(geometry: WristGeometry) -> Arm:
    """The device's moving part: mass, centre and inertia of bars, joints and sleeve on the arm.

    Returns
    -------
    Arm
        With ``device`` set, in the arm frame. See the module's description for what is assumed.
    """
    points = np.asarray(geometry.platform_points)
    radius, bottom, top = sleeve_size(points)
    turns = np.linspace(0.0, 2.0 * np.pi, _AROUND, endpoint=False)
    heights = bottom + (top - bottom) * (np.arange(_ALONG) + 0.5) / _ALONG
    around, along = (grid.ravel() for grid in np.meshgrid(turns, heights))
    places = [np.stack([radius * np.cos(around), radius * np.sin(around), along], axis=1), points]
    shell = _PLASTIC * 2.0 * np.pi * radius * WALL * (top - bottom)
    masses = [np.full(len(around), shell / len(around)), np.full(len(points), PER_JOINT)]
    for bar in holding_bars(geometry)[1]:
        places.append(0.5 * (bar[1:] + bar[:-1]))
        masses.append(PER_METRE * _lengths(bar))
    at, mass = np.concatenate(places), np.concatenate(masses)
    total = float(mass.sum())
    centre = mass @ at / total
    off = at - centre
    inertia = (mass * (off**2).sum(axis=1)).sum() * np.eye(3) - np.einsum("k,ki,kj->ij", mass, off, off)
    return Arm(total, centre, inertia, device=True)


def with_cuff_by_geometry(mechanism: Mechanism) -> Mechanism:
    """The design on its wearer's arm with :func:`estimated_cuff` in place of what it moves besides.

    Raises
    ------
    MissingData
        If the design has no person's arm.
    """
    own = mechanism.require_arm("the cuff by geometry").person
    if own is None:
        raise MissingData(["a person's arm"], "the cuff by geometry", mechanism.name, "worn_by says whose it is")
    return mechanism.replace(arm=own + estimated_cuff(mechanism.geometry))


def _lengths(line: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(np.diff(line, axis=0), axis=1))


def _bow(points: FloatArray, about: FloatArray) -> FloatArray:
    """A line through all points about an axis through O, shape (k, 3), open at the widest gap."""
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(about)))], about)
    x, z = x / np.linalg.norm(x), about
    y = np.cross(z, x)
    angle = np.arctan2(points @ y, points @ x)
    order = np.argsort(angle)
    gaps = np.diff(angle[order], append=angle[order[0]] + 2 * np.pi)
    order = np.roll(order, -(int(np.argmax(gaps)) + 1))
    turns = np.unwrap(angle[order])
    # From end to end alike, so that a mirrored design has the mirrored bow.
    fine = np.union1d(turns, np.linspace(turns[0], turns[-1], 1 + int(np.ceil(np.ptp(turns) / np.radians(5.0)))))
    sizes = np.hypot(points @ x, points @ y)[order], (points @ z)[order]
    radius, height = (np.interp(fine, turns, size) for size in sizes)
    return np.outer(radius * np.cos(fine), x) + np.outer(radius * np.sin(fine), y) + np.outer(height, z)


def _struts(points: FloatArray) -> list[FloatArray]:
    """From the sleeve to the joints that stand off it."""
    radius, bottom, top = sleeve_size(points)
    found = []
    for point, out in zip(points, np.hypot(points[:, 0], points[:, 1]), strict=True):
        if out > radius + WALL + BAR:
            foot = np.array([*(radius * point[:2] / out), np.clip(point[2], bottom + BAR, top - BAR)])
            found.append(np.linspace(foot, point, 3))
    return found
