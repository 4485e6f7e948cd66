"""The margins of a design to all criteria, over a stack of poses, each with the place of the device's centre.

A_i + base and B_i + cuff are the joints seen from the anatomical centre O, the first in the base frame, the second in
the arm's. All that a workspace checks is computed with these points and with moments about O, so that the moment of f_i
is that of the limb's displaced line: (R (B_i + cuff)) × (-f_i s_i).

The torso goes with the base. What base and cuff differ by is taken for the motion of O against the torso, because the
device fits at rest: the torso is displaced by base - cuff. A device that only sits in another place (base and cuff
alike) leaves the torso where it is.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ..core.conventions import along_arm
from ..core.records import Record
from ..core.validation import FloatArray
from ..design import Arm, Mechanism
from ..device import as_device
from ..device.accuracy.pose_accuracy import limb_readings, tolerances, weakest_rates
from ..device.accuracy.twins import SPACING, find_twins
from ..load_case import CentreOffset, CentrePath, Load
from ..load_case.pose_stacks import arm_loads, as_query
from ..numerics.vectors import SINGULAR_MARGIN
from ..reaction.holding.least_held_forces import least_held_forces
from ..wrist.forces.displaced import as_offset
from .criteria import Criteria
from .criterion import CRITERIA, body, forces, joints
from .kernels import connection_margin, kinematic_stack, nearest_to_rest, shoulder_stack


class PoseOffsets(Record):
    """Offsets of the device's centre from the shoulder's in N poses.

    Parameters
    ----------
    base : ndarray
        Of the centre that base ring and torso hold, shape (N, 3), or (1, 3) for all poses, m, base frame.
    cuff : ndarray
        Of the centre that platform and arm carry, of the same shape, m, arm frame.
    path : CentrePath, optional
        Which they come from, if from one: it gives the offsets of other poses, too.

    Attributes
    ----------
    base, cuff, path
        As given; arrays contiguous and writable, for which the kernels are compiled.
    """

    def __init__(self, base: FloatArray, cuff: FloatArray, path: CentrePath | None = None) -> None:
        self.base, self.cuff = np.array(base, order="C"), np.array(cuff, order="C")
        self.path = path

    @classmethod
    def none(cls) -> PoseOffsets:
        """The two centres are one."""
        return cls(np.zeros((1, 3)), np.zeros((1, 3)))

    @classmethod
    def of(cls, given: CentreOffset | CentrePath | ArrayLike | None, poses: Rotation) -> PoseOffsets:
        """Offsets of a stack of poses, shape (...), in any form that :meth:`exo_pin.ShoulderExo.reaction` takes.

        Raises
        ------
        InvalidInput
            If they are not finite, too large, of a shape that does not fit the poses, or if the path does not reach as
            far as the poses.
        """
        if given is None:
            return cls.none()
        path = given if isinstance(given, CentrePath) else None
        base, cuff = as_offset(given.offset(poses) if isinstance(given, CentrePath) else given, poses.shape)
        is_single = base.strides[0] == 0 and cuff.strides[0] == 0
        return cls(base[:1], cuff[:1]) if is_single else cls(base, cuff, path)

    @classmethod
    def joined(cls, parts: Sequence[PoseOffsets], count: int) -> PoseOffsets:
        """Offsets of several stacks of ``count`` poses each, one after the other; rest gets that of the first."""
        if all(part.is_aligned for part in parts):
            return cls.none()
        base, cuff = (
            np.concatenate([np.broadcast_to(getattr(part, side), (count, 3)) for part in parts])
            for side in ("base", "cuff")
        )
        return cls(base, cuff, parts[0].path)

    @property
    def is_aligned(self) -> bool:
        """Whether there is no offset in any pose."""
        return not (self.base.any() or self.cuff.any())

    def spread(self, count: int) -> tuple[FloatArray, FloatArray]:
        """Base and cuff offsets of N poses, shape (N, 3) each."""
        return np.broadcast_to(self.base, (count, 3)), np.broadcast_to(self.cuff, (count, 3))

    def rows(self, chosen: np.ndarray) -> PoseOffsets:
        """Offsets of some of the poses, given by their indices."""
        return self if len(self.base) == 1 else PoseOffsets(self.base[chosen], self.cuff[chosen], self.path)

    def at(self, matrices: FloatArray, nearest: int) -> PoseOffsets:
        """Offsets of poses that are not in the stack, shape (M, 3, 3).

        Offsets that were given pose by pose say nothing of them; they get those of the pose ``nearest`` of the stack.
        """
        if self.path is not None:
            return PoseOffsets.of(self.path, Rotation.from_matrix(matrices))
        return self.rows(np.array([nearest]))


class PoseValues(Record):
    """What is known of N poses of a design, and their margins to criteria; the first axis of every array is theirs.

    Parameters
    ----------
    mechanism : Mechanism
        The design, with the data that the criteria need.
    matrices : ndarray
        Shape (N, 3, 3), contiguous.
    shape : tuple of int
        Of the stack; of three dimensions for criteria of a grid.
    criteria : Criteria
        Limits.
    names : tuple of str
        Which criteria to check.
    load : Load, optional
        On the arm, besides its weight.
    offsets : PoseOffsets, optional
        Of the device's centre in these poses; none if left out. Rest and the way to it get those of the path they come
        from, else those of the pose nearest to rest.

    Attributes
    ----------
    margins : dict of str to ndarray
        By criterion, shape (N,): zero or more where it is met, NaN where that is not known or has no meaning.
    lengths : ndarray
        l_i, shape (N, n), m.
    bend : ndarray
        Shape (N,), rad: what the universal joints may turn more, the least of them; infinite where no criterion needs
        it.
    margin : ndarray
        Shape (N,): to a singular pose, as :attr:`exo_pin.Reaction.margin`; where as many drives as moments leave no
        other way to hold the arm, negative beyond the singular surface as seen from rest.
    """

    #: Unit of the distance to the ends of strokes.
    stroke_unit = "m"
    #: Values of idle joints by name, a row a pose, or configurations; None where nobody gave any.
    posture: Any = None
    #: Configurations of a device that has others than those of limbs.
    _placed: Any = None
    #: Distance of the nodes of the net in which twins are looked for.
    _net_spacing = SPACING
    criteria: Criteria
    lengths: FloatArray
    bend: FloatArray
    margin: FloatArray

    def __init__(
        self,
        mechanism: Mechanism,
        matrices: FloatArray,
        shape: tuple[int, ...],
        criteria: Criteria,
        names: tuple[str, ...],
        load: Load | None = None,
        offsets: PoseOffsets | None = None,
    ) -> None:
        self.mechanism, self.matrices, self.shape = mechanism, matrices, shape
        self.criteria, self.load = criteria, load
        self.offsets = PoseOffsets.none() if offsets is None else offsets
        self._needs = {need for name in names for need in CRITERIA[name].needs}
        found = _kinematics(mechanism, matrices, self.offsets, joints in self._needs)
        self.lengths, self.bend, signed = found
        self.side = rest_side(float(self._signed_at(np.eye(3)[None])[0]), signed)
        self.margin = self.side * signed
        self.margins = {name: np.asarray(CRITERIA[name].margin(self)) for name in names}

    @property
    def levers(self) -> FloatArray:
        """What travels of each drive count over, shape (n,): 1, or m of slides where other drives are hinges."""
        return np.ones(self.lengths.shape[1])

    @property
    def data_margin(self) -> FloatArray:
        """Distance to the end of what data of springs cover, over their range, shape (N,): infinite without springs."""
        return np.full(len(self.matrices), np.inf)

    @functools.cached_property
    def _nearest(self) -> int:
        return nearest_to_rest(self.matrices)

    def _signed_at(self, way: FloatArray) -> FloatArray:
        """Margins of poses on the way from rest, of opposite signs on either side of the singular surface."""
        return _kinematics(self.mechanism, way, self.offsets.at(way, self._nearest), False)[2]

    def shoulder_range(self) -> FloatArray:
        """Angle to the end of the shoulder's range, shape (N,), rad."""
        shoulder, margin = self.mechanism.shoulder, np.empty(len(self.matrices))
        outward = 1.0 if self.mechanism.side == "left" else -1.0
        shoulder_stack(self.matrices, shoulder.abduction_centre, shoulder.half_diagonal, outward, margin)
        return margin

    @property
    def connection(self) -> FloatArray:
        """Least margin on the best way from rest, shape (N,)."""
        return connection_margin(lambda way: self.side * self._signed_at(way), self.matrices, self.shape, self.margin)

    @functools.cached_property
    def _arms(self) -> tuple[Arm | None, ...]:
        return self.criteria.arms(self.mechanism)

    def held_by_arm(self, lost: int | None = None) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Margin of the moments, tensions and F_s of every arm, shapes (arms, N), (arms, N, n) and (arms, N, 3).

        All limbs are at work but the one of the index ``lost``.
        """
        shifts, least = (self.offsets.base, self.offsets.cuff), self.criteria.least_tension
        designs = [self.mechanism.replace(arm=arm) for arm in self._arms]
        found = [
            least_held_forces(design, self.matrices, shifts, self.lengths, least, self.load, lost) for design in designs
        ]
        margin, tensions, shoulder = (np.stack(each) for each in zip(*found, strict=True))
        return margin, tensions, shoulder

    @functools.cached_property
    def _held_by_all(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        return self.held_by_arm()

    @functools.cached_property
    def _forces(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        if forces not in self._needs:
            count, n = self.lengths.shape
            return np.full(count, np.nan), np.full((count, n), np.nan), np.full((count, 3), np.nan)
        return _worst(*self._held_by_all)

    @property
    def moment(self) -> FloatArray:
        """Disturbing moment that can be held in any direction, shape (N,), N m; NaN where no criterion needs forces."""
        return self._forces[0]

    @property
    def tensions(self) -> FloatArray:
        """f_i, shape (N, n), N: those within the limits that make |F_s| least; NaN where there are none."""
        return self._forces[1]

    @property
    def shoulder(self) -> FloatArray:
        """F_s with these tensions, shape (N, 3), N."""
        return self._forces[2]

    @property
    def shoulder_size(self) -> FloatArray:
        """|F_s|, shape (N,), N."""
        return np.sqrt((self.shoulder**2).sum(axis=1))

    @property
    def pull_out(self) -> FloatArray:
        """How hard F_s draws the head out of its socket, shape (N,), N: the most of all arms, negative into it."""
        assert self.criteria.socket is not None
        axes = self.criteria.socket.axes(self.mechanism.side, Rotation.from_matrix(self.matrices))[..., 0, :]
        return np.asarray(-(self._held_by_all[2] * axes).sum(axis=-1).min(axis=0))

    def weight_moments(self) -> FloatArray:
        """Size of the moment about O of every arm's weight and of the load, shape (arms, N), N m."""
        query = as_query(Rotation.from_matrix(self.matrices), None, self.load)
        moments = [arm_loads(arm, self.mechanism.gravity, query)[1] for arm in self._arms if arm is not None]
        return np.asarray(np.linalg.norm(moments, axis=-1))

    @functools.cached_property
    def _cuff_wrenches(self) -> FloatArray:
        """Of the wearer's arm on the cuff, shape (arms, N, 6): F_s, the arm's own weight and the load, about O.

        Which way it points makes no difference: pull counts either way, and slip by its size.
        """
        query = as_query(Rotation.from_matrix(self.matrices), None, self.load)
        found = []
        for arm, shoulder in zip(self._arms, self._held_by_all[2], strict=True):
            assert arm is not None
            assert arm.person is not None
            force, moment, _ = arm_loads(arm.person, self.mechanism.gravity, query)
            found.append(np.concatenate([force + shoulder, moment], axis=1))
        return np.stack(found)

    @property
    def cuff_pull(self) -> FloatArray:
        """Pull of the cuff along the arm, either way, shape (N,), N: the most of all arms."""
        return np.asarray(np.abs(along_arm(self._cuff_wrenches[..., :3], self.matrices)).max(axis=0))

    @property
    def cuff_slip(self) -> FloatArray:
        """How far a soft cuff slips under the wrench on it, shape (N,), m: the most of all arms."""
        cuff = self.mechanism.interfaces.cuff
        assert cuff is not None
        return np.asarray(np.linalg.norm(cuff.slip(self._cuff_wrenches, self.matrices)[..., :3], axis=-1).max(axis=0))

    @functools.cached_property
    def moment_without_limb(self) -> FloatArray:
        """Disturbing moment of any direction that is held besides while one limb gives no force, shape (N,), N m.

        The least over all limbs and arms; negative where the arm is not held.
        """
        limbs = range(self.mechanism.limb_count)
        return np.asarray(np.min([self.held_by_arm(lost)[0].min(axis=0) for lost in limbs], axis=0))

    def readings(self, matrices: FloatArray, rows: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
        """Positions of the drives (M, n) and their rates (M, n, 3) in other poses, with the rows' offsets."""
        own = self.offsets.rows(rows)
        return limb_readings(self.mechanism.geometry, matrices, own.base, own.cuff)

    @functools.cached_property
    def rates(self) -> FloatArray:
        """Weakest rate of the drives' positions, shape (N,), m/rad, or rad/rad where hinges are drives.

        See :mod:`exo_pin.device.accuracy.pose_accuracy`; the device's centre stays where it is in the pose.
        """
        rates = self.readings(self.matrices, np.arange(len(self.matrices)))[1]
        return weakest_rates(as_device(self.mechanism), rates)[0]

    @functools.cached_property
    def twin_difference(self) -> FloatArray:
        """How far the pose that looks most alike, and is no neighbour, is from being a twin, shape (N,): at 1 it is."""
        least, device = self.criteria.least_twin_angle, as_device(self.mechanism)
        assert least is not None
        found = find_twins(
            self.readings, self.matrices, tolerances(device), device.side, least, self._net_spacing, self._nearest
        )
        return found.difference

    @functools.cached_property
    def gaps(self) -> FloatArray:
        """Of the parts to arm, torso and one another, shape (N, 3), m; NaN where no criterion needs them."""
        if body not in self._needs:
            return np.full((len(self.matrices), 3), np.nan)
        shape, offset = self.criteria.body_of(self.mechanism), (self.offsets.base, self.offsets.cuff)
        radius = self.criteria.limb_radius
        return as_device(self.mechanism).gaps(self.matrices, offset, self._placed, shape, radius).least


def _worst(moment: FloatArray, tensions: FloatArray, shoulder: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Of several arms, shape (arms, N, ...), in each pose: the least moment, and the forces of the largest |F_s|.

    Where one of the arms is not held, its NaN.
    """
    if len(moment) == 1:
        return moment[0], tensions[0], shoulder[0]
    force = np.linalg.norm(shoulder, axis=-1)
    worst = np.argmax(np.where(np.isnan(force), np.inf, force), axis=0)
    row = np.arange(moment.shape[1])
    return moment.min(axis=0), tensions[worst, row], shoulder[worst, row]


def rest_side(rest: float, margins: FloatArray) -> float:
    """Sign of the margin at rest, ±1: the side of the singular surface that can be reached from rest.

    If rest itself is singular, the sign that most of the poses have.
    """
    if abs(rest) > SINGULAR_MARGIN:
        return float(np.sign(rest))
    return 1.0 if (margins > 0.0).sum() >= (margins < 0.0).sum() else -1.0


def _kinematics(
    mechanism: Mechanism, matrices: FloatArray, offsets: PoseOffsets, angles: bool
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Lengths (N, n), margins of the universal joints (N,) and of the moments (N,), with a sign of three limbs."""
    geometry, count, n = mechanism.geometry, len(matrices), mechanism.limb_count
    half, turns = np.full(n, np.inf), np.tile(np.eye(3), (n, 1, 1))
    if angles:
        for i, limb in enumerate(mechanism.limbs):
            if limb.kind == "UPU":
                assert limb.joint_limit is not None
                assert limb.joint_straight is not None
                half[i], turns[i] = limb.joint_limit, _from_z(np.array(limb.joint_straight))
    lengths, bend, margin = np.empty((count, n)), np.empty(count), np.empty(count)
    kinematic_stack(
        matrices, geometry.base_points, geometry.platform_points, offsets.base, offsets.cuff,
        _rows(geometry.base_frames @ turns), _rows(geometry.platform_frames @ turns), half, lengths, bend, margin,
    )  # fmt: skip
    return lengths, bend, margin


def _rows(frames: FloatArray) -> FloatArray:
    """Frames whose axes are columns with their axes as rows."""
    return np.ascontiguousarray(np.swapaxes(frames, 1, 2))


def _from_z(direction: FloatArray) -> FloatArray:
    """The least rotation that takes e_z to a unit vector: from it the angles of a universal joint are counted."""
    axis = np.cross([0.0, 0.0, 1.0], direction)
    sine, cosine = float(np.linalg.norm(axis)), float(direction[2])
    if sine < 1e-12:
        return np.eye(3) if cosine > 0.0 else np.diag([1.0, -1.0, -1.0])
    return np.asarray(Rotation.from_rotvec(axis / sine * np.arctan2(sine, cosine)).as_matrix())
