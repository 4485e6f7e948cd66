"""Where a single limb of a family can be at all: a necessary condition for designs of that family.

In a design that works every limb by itself is within its stroke and clear of arm and torso, over the wanted share of
the box and in all poses of lifting forward and sideways. Limbs at places drawn evenly from the bounds are examined one
by one, each with the stroke that serves it best. Those that pass are then taken **all together**, as if they were not
in one another's way: where these cannot hold the weight of the arm with forces of any size, no choice among them can.

The places are a sample, so what comes out is evidence and no proof.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls
from scipy.stats import qmc

from ..core.conventions import GRAVITY, MIRROR
from ..core.errors import InvalidInput, MissingData
from ..core.errors.base import echo
from ..core.progress import track
from ..core.validation import FloatArray, ReadOnly, as_finite
from ..design import Actuator, Arm
from ..design.actuator_families import family_limits
from ..load_case.pose_stacks import pose_matrices
from ..study import adl_box
from .criteria import LIMB_RADII, Criteria
from .evaluation import clearances
from .optimisation.search_poses import lifting_lines
from .pose_offsets import PoseOffsets

__all__ = ["LimbPlaces", "limb_places"]

#: Relative residual of the moments above which they are not held.
_HELD = 1e-9


@dataclass(frozen=True, eq=False)
class LimbPlaces(ReadOnly):
    """Places of single limbs, of which K pass.

    Attributes
    ----------
    base_points, platform_points : ndarray
        Joints of the limbs that pass, shape (K, 3), m, base and arm frame.
    shares : ndarray
        Share of the box in which each of them is within its stroke and clear, shape (K,).
    examined : int
        Places that were drawn.
    within_stroke : float
        Share of them that pass by their stroke alone.
    best_share : float
        Largest share of the box of any place, whether or not it passes; 0 if none lifts.
    held : float
        Share of the box in which the limbs that pass hold the arm's weight, all of them together and with forces of any
        size that the family can give.
    """

    base_points: FloatArray
    platform_points: FloatArray
    shares: FloatArray
    examined: int
    within_stroke: float
    best_share: float
    held: float

    @property
    def passing(self) -> float:
        """Share of the places that pass."""
        return len(self.shares) / self.examined

    def __str__(self) -> str:
        return (
            f"Of {self.examined} places of a limb {100 * self.within_stroke:.2g} % pass by their stroke and "
            f"{100 * self.passing:.2g} % ({len(self.shares)}) by stroke and clearance; the best has "
            f"{100 * self.best_share:.1f} % of the box.\nAll that pass together hold the arm in "
            f"{100 * self.held:.1f} % of the box."
        )


def limb_places(
    actuator: Actuator,
    arm: Arm,
    criteria: Criteria,
    base_radius: tuple[float, float] = (0.12, 0.50),
    platform_radius: tuple[float, float] = (0.05, 0.14),
    drop: tuple[float, float] = (0.08, 0.28),
    *,
    share: float = 0.8,
    count: int = 16_384,
    step: float = 18.0,
    side: str = "left",
    seed: int = 0,
    progress: bool = False,
) -> LimbPlaces:
    """Draw places of a limb and examine each by itself.

    Parameters
    ----------
    actuator : Actuator
        Its family, and whether it pushes.
    arm : Arm
        What is to be held, on the given side.
    criteria : Criteria
        ``body``, ``least_gap`` and ``limb_radius`` count.
    base_radius, platform_radius, drop : (float, float)
        Bounds of the joints as in :func:`exo_pin.workspace.free_joints`, m.
    share : float
        Of the box in which a limb has to be within its stroke and clear.
    count : int
        Places to draw.
    step : float
        Of the grid of the box, degrees; lifting to 90° has a pose every 10°.
    side : {"left", "right"}
        Side of the body.
    seed : int
        Of the places (a scrambled Sobol sequence).
    progress : bool
        Whether to show a bar.

    Raises
    ------
    MissingData
        If the criteria have no ``body``.
    InvalidInput
        If ``share`` is not in 0 to 1, ``count`` or ``seed`` is no whole number, or bounds do not rise or are not
        positive.
    """
    if criteria.body is None:
        raise MissingData(["body of the wearer (body)"], "places of a limb")
    if not 0.0 < float(as_finite("share", share, ())) <= 1.0:
        raise InvalidInput(f"expected a share of 0 to 1, got {share!r}")
    for label, value, least in (("count", count, 1), ("seed", seed, 0)):
        if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
            raise InvalidInput(f"expected {label} as a whole number of at least {least}, got {echo(value)}")
    grid = pose_matrices(adl_box(step, side))[1]
    lines = [line.as_matrix() for line in lifting_lines(side, step=10.0)]
    matrices = np.ascontiguousarray(np.concatenate([grid, *lines]))
    lifts = np.arange(len(matrices)) >= len(grid)
    base, platform = _places((base_radius, platform_radius, drop), count, side, seed)
    passing, masks, shares, within, best = [], [], [], 0, 0.0
    for k in track(range(count), "places", progress):
        span = matrices @ platform[k] - base[k]
        length = np.sqrt((span**2).sum(axis=1))
        stroke = _best_window(actuator, length, ~lifts, lifts)
        if stroke is None:
            continue
        by_stroke = float(stroke[~lifts].mean())
        within += by_stroke >= share
        # One that cannot pass may still be the best of all.
        if by_stroke < share and by_stroke <= best:
            continue
        clear = _clear(criteria, actuator, matrices, base[k : k + 1], platform[k : k + 1])
        both = _best_window(actuator, length, clear & ~lifts, lifts) if clear[lifts].all() else None
        if both is None:
            continue
        both &= clear
        of_box = float(both[~lifts].mean())
        best = max(best, of_box)
        if of_box >= share:
            passing.append(k)
            masks.append(both[~lifts])
            shares.append(of_box)
    held = _held(actuator, arm, grid, base[passing], platform[passing], np.array(masks, dtype=bool))
    return LimbPlaces(base[passing], platform[passing], np.array(shares), count, within / count, best, held)


def _places(bounds: tuple[tuple[float, float], ...], count: int, side: str, seed: int) -> tuple[FloatArray, FloatArray]:
    """Joints on torso and arm, shape (count, 3), m: directions even on the sphere, the rest even in its bounds."""
    u = qmc.Sobol(6, rng=np.random.default_rng(seed)).random(count)
    (a0, a1), (p0, p1), (d0, d1) = (as_finite("bounds", pair, (2,)).tolist() for pair in bounds)
    for name, low, high in (("base_radius", a0, a1), ("platform_radius", p0, p1), ("drop", d0, d1)):
        if low > high or (low <= 0.0 and name != "drop"):
            raise InvalidInput(f"expected {name} as rising and positive, m, got {low:g} to {high:g}")
    radius, height = a0 + (a1 - a0) * u[:, 0], 2.0 * u[:, 1] - 1.0
    level, around = radius * np.sqrt(1.0 - height**2), 2.0 * np.pi * u[:, 2]
    base = np.stack([level * np.cos(around), level * np.sin(around), radius * height], axis=-1)
    out, about = p0 + (p1 - p0) * u[:, 3], 2.0 * np.pi * u[:, 4]
    platform = np.stack([out * np.cos(about), out * np.sin(about), -(d0 + (d1 - d0) * u[:, 5])], axis=-1)
    outward = np.ones(3) if side == "left" else np.diag(MIRROR)
    return base * outward, platform * outward


def _best_window(
    actuator: Actuator, length: FloatArray, wanted: NDArray[np.bool_], needed: NDArray[np.bool_]
) -> NDArray[np.bool_] | None:
    """Poses within the stroke of the family that takes all needed poses and most of the wanted ones.

    None if no stroke takes all that are needed.
    """
    share, constant = family_limits(actuator.family)
    travel = np.inf if actuator.travel_limit is None else actuator.travel_limit
    ends = np.concatenate([length[wanted | needed], [length[needed].max()]])
    ends = np.unique(ends[ends >= length[needed].max()])
    starts = np.maximum(share * ends + constant, ends - travel)
    fits = starts <= length[needed].min()
    if not fits.any():
        return None
    ordered = np.sort(length[wanted])
    counts = np.searchsorted(ordered, ends, "right") - np.searchsorted(ordered, starts, "left")
    best = int(np.where(fits, counts, -1).argmax())
    return np.asarray((length <= ends[best]) & (length >= starts[best]))


def _clear(
    criteria: Criteria, actuator: Actuator, matrices: FloatArray, base: FloatArray, platform: FloatArray
) -> NDArray[np.bool_]:
    """Poses in which the limb keeps its distance from arm and torso."""
    radius = LIMB_RADII[actuator.family] if criteria.limb_radius is None else criteria.limb_radius
    gaps = clearances(matrices, base, platform, PoseOffsets.none(), np.array([radius]), criteria.body)
    return np.asarray(gaps[:, :2].min(axis=1) >= criteria.least_gap)


def _held(
    actuator: Actuator, arm: Arm, grid: FloatArray, base: FloatArray, platform: FloatArray, masks: NDArray[np.bool_]
) -> float:
    """Share of the poses in which limbs without limits of force hold the arm's weight."""
    held = 0
    for k, R in enumerate(grid):
        chosen = np.flatnonzero(masks[:, k]) if len(masks) else np.zeros(0, dtype=int)
        if not chosen.size:
            continue
        ends = platform[chosen] @ R.T
        # Tension pulls the arm towards the torso.
        arms = np.cross(ends, base[chosen] - ends).T
        needed = np.cross(R @ arm.centre_of_mass, -arm.mass * GRAVITY)
        columns = arms if actuator.pulls_only else np.hstack([arms, -arms])
        residual = nnls(columns / np.linalg.norm(columns, axis=0), needed)[1]
        held += bool(residual <= _HELD * max(1.0, float(np.linalg.norm(needed))))
    return held / len(grid)
