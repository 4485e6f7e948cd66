"""Poses with their equilibrium and their limits: what a split chooses forces from.

How the efforts of a device share what it holds: the wearer least, then the drives, then the brakes.

In each pose equilibrium is A f + w = m, with a row for each motion that drives or brakes hold; w, in the three rows of
the arm's turns, is the wearer's moment where they cannot hold the arm alone. Chosen are, in this order,

1. the least w: no drive is spared at the wearer's expense;
2. efforts f of least sum of squares. Where drives have one unit these are squares of N, or of N m. Where they mix N
   and N m, each effort is divided by the larger magnitude of its limits; where a limit is not known, squares of N and
   N m are added as they are, and the answer says so. A brake's effort is a reaction: before it is squared it counts a
   thousandth of a drive's, so that a drive is spared wherever a brake within its limit can do the work.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ...core.errors import SolverFailed
from ...core.records import reduced_tuple
from ...core.validation import FloatArray
from ...design import Mechanism
from ...wrist.forces.affine_state import LOOSE, AffineState, BalancedTensions
from ...wrist.forces.displaced import PartDisplacements
from ..constraints.actuator_limits import LimbLimits, depend_on_length, stroke_limits
from ..constraints.given_limits import SideForceBounds
from .limb_and_side_forces import PoseProgram, Socket

if TYPE_CHECKING:
    from ...device.equilibrium import DeviceEquilibrium
    from ...device.parts.lacking_data import LackingData
    from ...wrist.clearance.gaps import Gaps
    from ..assumptions import Weights


#: What a unit of a brake's effort counts beside one of a drive.
_OF_BRAKES = 1e-3
#: Share of the greatest limit that counts for a drive that gives nothing.
_NOTHING = 1e-6
#: Moment of the wearer in a pose that still counts as held by the device, over m g |c|, the greatest moment of the
#: arm's weight. A centre of mass that is off by as much of its distance, 0.3 mm, makes it; none is known so well.
UNFELT = 1e-3


class EffortSharing(NamedTuple):
    """By what the efforts of a device are chosen among those in equilibrium.

    Attributes
    ----------
    scales : ndarray or None
        What each effort is divided by, shape (p,), the largest of the drives' 1; None where all count alike.
    unknown : tuple of str
        Drives that have no limit to divide by, although the units mix.
    wearer : ndarray of bool or None
        Components that are the wearer's moment, shape (p,); None where the device holds the arm.
    """

    scales: FloatArray | None
    unknown: tuple[str, ...]
    wearer: NDArray[np.bool_] | None

    @property
    def words(self) -> str:
        """What goes before and after "least sum of squares", in words; empty where nothing does."""
        words = "" if self.scales is None else ", each effort over its greatest limit"
        return words if self.wearer is None else f"{words}, after the wearer's least moment"


@lru_cache(maxsize=256)
def sharing_of(device: Any) -> EffortSharing:
    """Of a device whose efforts are drives, brakes and, at the end, the wearer's moments."""
    p, drives, held = device.limb_count, len(device.drives), len(device.efforts)
    wearer = None if p == held else np.arange(p) >= held
    scales, unknown = np.ones(p), ()
    if len({device.unit_of(drive) for drive in device.drives}) > 1:
        ends = [drive.effort_range for drive in device.drives]
        known = stroke_limits(device) if depend_on_length(device) else np.array(ends).T
        size = np.nan_to_num(np.abs(known), posinf=0.0).max(axis=0)[:drives]
        lacking = (size == 0.0) & ~(np.array(ends) == 0.0).all(axis=1)
        unknown = tuple(drive.name for drive, lacks in zip(device.drives, lacking, strict=True) if lacks)
        if not unknown and size.max() > 0.0:
            scales[:drives] = np.maximum(size / size.max(), _NOTHING)
    scales[drives:held] = 1.0 / _OF_BRAKES
    return EffortSharing(None if (scales == 1.0).all() else scales, unknown, wearer)


#: Room of the wearer's least moment, over the largest load.
_ROUNDING = 1e-9


class Moved(NamedTuple):
    """What an elastic device did on the way to its equilibrium, in N poses.

    Attributes
    ----------
    parts : PartDisplacements
        Displacements of the parts.
    unmoved : ndarray
        F_s of limbs without side force and of undisplaced parts, shape (N, 3), N.
    load_share : ndarray
        Share of load and offset up to which an equilibrium was followed, shape (N,).
    guide_load : ndarray
        The larger of bending moment and torque of each guide, each over its limit, shape (N, n); NaN where neither is
        known.
    infeasible : ndarray of bool
        Poses in which forces within the limits lead to no equilibrium, shape (N,).
    """

    parts: PartDisplacements
    unmoved: FloatArray
    load_share: FloatArray
    guide_load: FloatArray
    infeasible: NDArray[np.bool_]

    def __reduce__(self) -> tuple[Any, ...]:
        return reduced_tuple(self)


class PoseStack(NamedTuple):
    """N poses with their equilibrium and their limits: the input of a split.

    Attributes
    ----------
    mechanism : Mechanism
        The design.
    matrices : ndarray
        Orientations, shape (N, 3, 3), {O_B} to {O_A}.
    offset : tuple of ndarray or None
        Shifts of the base and of the cuff, shape (N, 3) each, m; None where the device's centre is the shoulder's.
    state : AffineState
        Of the N poses.
    tensions : BalancedTensions
        Tensions that balance the moments.
    stiffness, misfit : ndarray
        Of each limb along its side wrench, shape (N, n), N/m and m.
    status : ndarray of int8
        Shape (N,), index into :data:`exo_pin.reaction.answer.QUERY_STATUS`, changed where equilibrium has none.
    margin, determinant : ndarray
        Shape (N,), as in :class:`exo_pin.Reaction`.
    limits : LimbLimits
        Of lengths and tensions.
    side_bounds : SideForceBounds
        Of g.
    socket : Socket or None
        The glenoid cone in the N poses.
    weights : Weights or None
        Weights of F_s.
    moved : Moved or None
        Of an elastic device.
    placed : DeviceEquilibrium or None
        Of a device that is not a wrist: its configurations, and more.
    sharing : EffortSharing or None
        How efforts of a device are chosen; None of limbs, which all count alike.
    """

    mechanism: Mechanism
    matrices: FloatArray
    offset: tuple[FloatArray, FloatArray] | None
    state: AffineState
    tensions: BalancedTensions
    stiffness: FloatArray
    misfit: FloatArray
    status: NDArray[np.int8]
    margin: FloatArray
    determinant: FloatArray
    limits: LimbLimits
    side_bounds: SideForceBounds
    socket: Socket | None
    weights: Weights | None
    moved: Moved | None = None
    placed: DeviceEquilibrium | None = None
    sharing: EffortSharing | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        return reduced_tuple(self)

    @property
    def lacking(self) -> list[tuple[LackingData, ...]]:
        """Of each pose the parts whose data do not cover it; none of limbs, which have no such data."""
        if self.placed is None:
            return [()] * len(self.matrices)
        return list(self.placed.lacking)

    @property
    def gaps(self) -> Gaps:
        """To the wearer and between parts of the device, where it stands in these poses."""
        found: Gaps = self.mechanism.gaps(self.matrices, self.offset, self.placed)  # type: ignore[attr-defined]
        return found

    @property
    def posture(self) -> str:
        """By what rule joints stand that leave the arm where it is; empty where there are none."""
        if self.placed is None or self.placed.rule:
            return "" if self.placed is None else self.placed.rule
        from ...device.postures import posture_rule  # here: few devices need it

        device: Any = self.mechanism
        return posture_rule(device) if device.structure.idle else ""

    def weak_axis(self, row: int) -> FloatArray:
        """Axis about which the arm is held least, shape (3,), base frame; NaN where loops keep it from turning."""
        if self.placed is not None:
            return np.asarray(self.placed.weak_axis[row])
        from ...wrist.singularities.measures import singularity  # here: few answers need it

        pose = Rotation.from_matrix(self.matrices[row])
        return singularity(self.mechanism.geometry, pose, self.mechanism.is_upu).lost_direction

    @property
    def upu(self) -> NDArray[np.intp]:
        """Indices of the UPU limbs, shape (u,)."""
        return np.flatnonzero(self.mechanism.is_upu)

    @property
    def lengths(self) -> FloatArray:
        """Limb lengths l_i, shape (N, n), m; of an elastic device at its displaced geometry."""
        if self.moved is not None:
            return self.moved.parts.lengths
        if self.placed is not None:
            return self.placed.coordinates
        return limb_lengths(self.mechanism, self.matrices, self.offset)

    @property
    def scales(self) -> FloatArray | None:
        """What each effort is divided by where their squares are added, shape (n,); None where all count alike."""
        return None if self.sharing is None else self.sharing.scales

    @property
    def open_effects(self) -> tuple[FloatArray, FloatArray]:
        """f and F_s per N of tensions that balance themselves and of side forces, shapes (N, n, m) and (N, 3, m)."""
        own, upu = self.tensions, self.upu
        of_f = np.concatenate([own.self_stress, own.f_of_g[:, :, upu]], axis=2)
        return of_f, np.concatenate([own.shoulder_of_stress, own.shoulder_of_g[:, :, upu]], axis=2)

    def effect(self, row: int) -> FloatArray:
        """Shape (3, m + u): F_s per N of tensions that balance themselves, and of side forces."""
        own = self.tensions
        return np.hstack([own.shoulder_of_stress[row], own.shoulder_of_g[row][:, self.upu]])

    def flexibility(self, rows: NDArray[np.intp]) -> FloatArray:
        """Displacement of a wrist's centre per N on it, (K_s + K_X)⁻¹ of some poses, shape (k, 3, 3), m/N.

        Zero with a rigid shoulder.

        Raises
        ------
        SolverFailed
            If shoulder and limbs together leave a direction free.
        """
        stiffness = self.mechanism.shoulder.stiffness
        if stiffness is None:
            return np.zeros((len(rows), 3, 3))
        system, _ = self._elastic_system(rows, stiffness)
        if not (np.linalg.cond(system) < LOOSE).all():
            raise SolverFailed("elastic split", np.inf, "shoulder and limbs together leave a direction free")
        return np.asarray(np.linalg.inv(system))

    def elastic_load(self, rows: NDArray[np.intp]) -> FloatArray:
        """The load N on a wrist's centre in some poses, misfit included, shape (k, 3), N."""
        return self._elastic_system(rows, np.zeros((3, 3)))[1]

    def _elastic_system(self, rows: NDArray[np.intp], stiffness: FloatArray) -> tuple[FloatArray, FloatArray]:
        """K_s + K_X and N; see :meth:`BalancedTensions.elastic_system`."""
        own = BalancedTensions(*(part[rows] for part in self.tensions))
        return own.elastic_system(self.state.shoulder_of_g[rows], stiffness, self.stiffness[rows], self.misfit[rows])

    def forces(self, row: int, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """f and g, shape (n,), for values z of what :meth:`effect` multiplies."""
        own = self.tensions
        stress, g = own.self_stress[row], np.zeros(len(own.f[row]))
        g[self.upu] = z[stress.shape[1] :]
        return own.f[row] + own.f_of_g[row] @ g + stress @ z[: stress.shape[1]], g

    def _least_of_wearer(self, row: int, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Limits in which a wearer's moment without limits is the least one that will do, to rounding."""
        assert self.sharing is not None
        if self.sharing.wearer is None:
            return low, high
        least, room = self.tensions.f[row], _ROUNDING * np.abs(self.state.moment[row]).max()
        open_ = self.sharing.wearer & np.isinf(low) & np.isinf(high)
        return np.where(open_, least - room, low), np.where(open_, least + room, high)

    def program(self, row: int, **choices: Any) -> PoseProgram:
        """The program of one pose within its limits: tensions of least norm, unless ``choices`` change it."""
        state, low, high = self.state.row(row), self.limits.lower[row], self.limits.upper[row]
        socket = None if self.socket is None else self.socket.row(row)
        if self.sharing is not None:
            choices["scales"] = self.sharing.scales
            low, high = self._least_of_wearer(row, low, high)
        return PoseProgram(state, self.mechanism.radius, low, high, socket, **choices)


def limb_lengths(
    mechanism: Mechanism, matrices: FloatArray, offset: tuple[FloatArray, FloatArray] | None
) -> FloatArray:
    """Lengths of the limbs of a device whose base and cuff may be shifted, shape (N, n), m."""
    base, cuff = offset or (np.zeros((len(matrices), 3)),) * 2
    arm = (mechanism.geometry.platform_points + cuff[:, None]) @ np.swapaxes(matrices, 1, 2)
    return np.asarray(np.linalg.norm(arm - mechanism.geometry.base_points - base[:, None], axis=-1))
