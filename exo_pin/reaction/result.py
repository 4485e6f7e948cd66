"""The result of a reaction query, with its checks, its texts and its verdict."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from ..core.conventions import along_arm
from ..core.errors import InvalidInput
from ..core.errors.base import echo
from ..core.errors.checked import checked
from ..core.results import Result
from ..core.validation import FloatArray, ReadOnly
from ..device.protocol import Device, described
from ..load_case.case import Case
from . import columns as shown
from .columns import reaction_html, reaction_table
from .evidence import AnswerSource, Certificate, ClosestForces, Infeasibility, Optimum, certificate_of, closest_forces
from .holding.force_range import ForceRange, force_range
from .holding.hold_check import HoldCheck, cautions, criterion, hold_check
from .holding.infeasible_poses import infeasibility
from .holding.verdict import UNSOLVED, verdict_of

if TYPE_CHECKING:
    from .assumptions import Assumptions


@checked
@dataclass(frozen=True, eq=False)
class Reaction(Result, ReadOnly):
    """Forces between arm, limbs, shoulder and torso in a pose or a stack of poses of shape (...).

    Forces are in N, moments in N m about O, both in the base frame. Rows without an answer are NaN, and ``status``
    gives the reason. The arrays are read-only; ``Rotation.apply`` of SciPy takes copies.

    Attributes
    ----------
    shoulder_force : ndarray
        F_s, shape (..., 3), N: the force of the shoulder **on the arm**.
    actuator_forces : ndarray
        f_i, shape (..., n), N, tension positive; N m of a drive that turns.
    constraint_forces : ndarray
        g_i, shape (..., n), N: the couple in the universal joint at B_i is g_i |B_i|, (D-18), and for a massless
        limb the limb pulls the arm with -f_i s_i - g_i X_i. With a centre offset |g_i| is still the whole force across
        the limb, whose direction is perpendicular to s_i and on the side of X_i, and its line misses O. These are
        passive reactions, no actuator sets them. Zero for an SPS limb.
    limb_wrenches : ndarray
        Shape (..., n, 6): force, N, and moment, N m, of each limb on the arm.
    cuff_wrench : ndarray
        Shape (..., 6), N, N m: wrench of the cuff on the person's arm: all limbs together, less the weight and inertia
        of the device's own moving part.
    harness_wrenches : ndarray
        Shape (..., n, 6): force, N, and moment, N m, of each limb on the torso.
    spherical_force : ndarray
        Shape (..., 3), N: F_s with limbs that carry no side force, the F_s0 of (D-34).
    split : str
        How the forces that equilibrium does not determine were chosen.
    case, assumptions : Case, Assumptions
        The question, enough to ask it again: ``exo_pin.solve(device, answer.case, answer.assumptions)``.
    equilibrium_status : ndarray of str
        Shape (...): status of plain equilibrium, whether the actuators can supply it or not: "ok", "near_singular"
        (an answer, with limb forces far above the load), "singular", "folded", "not_solved", "no_equilibrium" (the
        elastic device has none near the pose, see ``load_share``; or a joint of a device moves that nothing holds, see
        ``verdict``), "guide_overloaded" (see ``guide_load``), "out_of_reach" (the loops of the device cannot close on
        the way from rest), "beyond_singular" (on that way its assembly mode ends at a singular configuration) or
        "not_evaluated" (the data of a part, such as the table of a spring, do not cover the pose; see
        :attr:`reasons`); all but the first two have no answer.
    status : ndarray of str
        Shape (...): the same where all known limits of the query are met. Else "out_of_stroke" (a limb is longer or
        shorter than its actuator allows), "beyond_limits" (equilibrium determines the limb forces, and they are beyond
        their limits) or "infeasible" (forces can be chosen, and none within the limits balance the arm). The forces are
        then those of plain equilibrium, which would be needed: of least norm, and with g = 0 unless the split
        determines it.
    margin : ndarray
        Shape (...): dimensionless distance from a singular pose, 0 there to 1 where all moments about O are made with
        the same ease: the root of the harmonic over the arithmetic mean of σ², the squared singular values of the
        moments per unit of effort, where efforts that move the device alone are left out. It is between the least over
        the greatest σ and three times that. Of a device that gives way it is that of its equilibrium.
    determinant : ndarray
        det[X_1 X_2 X_3], shape (...), NaN for other than three limbs. Where its sign changes along a path the
        path crosses the singular surface.
    residual : ndarray
        Shape (...): error of the force and moment balance of the arm, relative to the largest force (moments over
        the largest |B_i|), evaluated from the wrenches above; NaN without an answer.
    source : AnswerSource
        From which :attr:`certificate` is computed on demand.
    body_weight : float or None
        Of the person under standard gravity, N.
    trivial : bool
        Whether the least shoulder force is zero by construction, in every pose that has an answer: side forces and
        tensions without bounds can produce every shoulder force, so that the limbs alone can always carry the arm.
        A least force of zero is then no property of the device.
    centre_displacement : ndarray or None
        δ, shape (..., 3), m: displacement of the shoulder's centre, for split "elastic". Moments about O are then
        about the displaced centre of the arm's joint.
    side_stiffness : ndarray or None
        k_i, shape (..., n), N/m, for split "elastic"; zero for bare muscles and SPS limbs.
    arm_orientation : ndarray or None
        Shape (..., 3, 3), for split "elastic": orientation of the arm. It differs from the pose only with locked
        actuators.
    interface_displacements : ndarray or None
        Shape (..., 2, 6), for split "elastic": displacement and rotation vector of the base ring against the torso
        (base frame) and of the platform against the arm (arm frame {O_B}), m and rad.
    limb_lengths : ndarray or None
        l_i of the displaced device, shape (..., n), m, for split "elastic".
    guide_twist : ndarray or None
        φ_i, shape (..., n), rad, for split "elastic": twist that the universal joints would give a straight guide.
    guide_bending : ndarray or None
        Shape (..., n), for split "elastic": deflection of a guide from the line A_i B_i, over its length.
    guide_load : ndarray or None
        Shape (..., n), for split "elastic": utilisation of the guide, the larger of bending moment and torque, each
        over its limit, as far as the limits are known; NaN where neither is, or where there is no equilibrium.
    load_share : ndarray or None
        Shape (...), for split "elastic": the share of load and centre offset up to which an equilibrium was
        followed from the unloaded, aligned device; 1 for an answer.

    Examples
    --------
    >>> exo = ep.load("four-linear-actuators")
    >>> answer = exo.reaction(exo.pose(60))
    >>> weight = exo.arm.mass * exo.mechanism.gravity
    >>> total = answer.shoulder_force + answer.limb_wrenches[:, :3].sum(axis=0) + weight
    >>> total.round(9) + 0.0  # N; the arm is at rest
    array([0., 0., 0.])
    """

    shoulder_force: FloatArray
    actuator_forces: FloatArray
    constraint_forces: FloatArray
    limb_wrenches: FloatArray
    cuff_wrench: FloatArray
    harness_wrenches: FloatArray
    spherical_force: FloatArray
    split: str
    case: Case
    assumptions: Assumptions
    equilibrium_status: NDArray[np.str_]
    status: NDArray[np.str_]
    margin: FloatArray
    determinant: FloatArray
    residual: FloatArray
    source: AnswerSource
    body_weight: float | None = None
    trivial: bool = False
    centre_displacement: FloatArray | None = None
    side_stiffness: FloatArray | None = None
    arm_orientation: FloatArray | None = None
    interface_displacements: FloatArray | None = None
    limb_lengths: FloatArray | None = None
    guide_twist: FloatArray | None = None
    guide_bending: FloatArray | None = None
    guide_load: FloatArray | None = None
    load_share: FloatArray | None = None

    _hidden = frozenset({"source", "case", "assumptions"})
    _derived = shown.DERIVED
    _described = (Optimum, Infeasibility, shown._SingleAnswer)

    @cached_property
    def optimum(self) -> Optimum:
        """Optimality conditions, duality gap and uniqueness of the chosen forces; computed on demand."""
        source, shape = self.source, self.status.shape
        chosen, n = source.chosen, source.poses.mechanism.limb_count
        kkt, gap, unique = chosen.kkt.copy(), chosen.gap.copy(), chosen.unique.copy()
        for row in np.flatnonzero(chosen.unjudged).tolist():
            f, g = source.values[row, :n], source.values[row, n : 2 * n]
            kkt[row], gap[row], unique[row] = source.split.judged(source.poses, row, f, g)[2:]
        return Optimum(kkt.reshape(shape), gap.reshape(shape), unique.reshape(shape))

    @cached_property
    def certificate(self) -> Certificate:
        """Which of these forces equilibrium determines."""
        return certificate_of(self.source)

    @property
    def ratio(self) -> FloatArray:
        """Γ = |F_s| / |F_s0| of (D-34), shape (...).

        Both vanish together at some poses: the ratio is NaN there, so never average it over a workspace.

        Source: thesis (D-34).
        """
        size, reference = self.magnitude, np.linalg.norm(self.spherical_force, axis=-1)
        nothing = 1e-12 * np.maximum(size, np.abs(self.limb_wrenches[..., :3]).max(axis=(-1, -2)))
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(reference > nothing, size / reference, np.where(size > nothing, np.inf, np.nan))
        return np.asarray(np.where(np.isnan(size), np.nan, ratio))

    @cached_property
    def limits(self) -> HoldCheck:
        """Lengths and tensions compared with the limits of the query."""
        source, answered = self.source, self.has_answer.ravel()
        tensions = source.values[:, : source.poses.mechanism.limb_count]
        unsolved = np.isin(self.equilibrium_status.ravel(), UNSOLVED)
        check = hold_check(source.poses.mechanism, source.poses.limits, tensions, answered, ~source.held, unsolved)
        return check.reshaped(self.has_answer.shape)

    @property
    def reasons(self) -> NDArray[np.str_]:
        """Shape (...): why a pose is not evaluated, with part, value and range; "" elsewhere."""
        texts = ["; ".join(map(str, parts)) for parts in self.source.poses.lacking]
        return np.where(self.status == "not_evaluated", np.array(texts, dtype=np.str_).reshape(self.status.shape), "")

    @cached_property
    def infeasibility(self) -> Infeasibility | None:
        """Evidence for the poses whose limits no forces meet, strokes left out; None if there are none."""
        return infeasibility(self.source)

    @property
    def held(self) -> NDArray[np.bool_]:
        """Shape (...): whether there is an answer, and no limit that is known is broken.

        :attr:`can_hold` asks besides that every limit is known. Peaks, means and rankings are over these poses.
        """
        return self.has_answer & ~self.limits.violated

    @cached_property
    def closest(self) -> ClosestForces:
        """Forces within the limits that come closest to equilibrium: those of the answer where a pose is held.

        NaN where the split leaves nothing to choose and its forces are beyond the limits, as of locked actuators.
        """
        return closest_forces(self)

    @property
    def provenance(self) -> dict[str, Any]:
        """Version, design with the hash of its file, case and assumptions: enough to compute the answer again."""
        design = described(cast(Device, self.source.poses.mechanism))
        return super().provenance | {"design": design, "case": self.case, "assumptions": self.assumptions}

    @property
    def criterion(self) -> str:
        """By what these forces were chosen among those that balance the arm, in words."""
        return criterion(self.source)

    @cached_property
    def cautions(self) -> tuple[str, ...]:
        """Doubts about a measured movement, what was not checked or not used, and what to mind, a sentence each."""
        return (*self.case.cautions, *cautions(self.source, self.limits))

    def range(self) -> ForceRange | None:
        """Least and greatest |F_s| of all sets of forces that the split allows within the limits, pose by pose.

        None for a single pose without any; such rows of a stack are NaN. Computed anew at every call. Exact where
        vertices can be counted (up to eight limbs with side forces fixed), otherwise bounded from both sides.
        "elastic" takes parts where this answer has them (no wrist: to first order), elsewhere that is an estimate.

        Returns
        -------
        ForceRange or None

        Raises
        ------
        SolverFailed
            If a program was not solved to its accuracy.

        Examples
        --------
        >>> exo = ep.load("four-cables")
        >>> answer = exo.reaction(exo.pose([0, 60]))
        >>> found = answer.range()
        >>> chosen = answer.magnitude
        >>> [bool((low <= high + 1e-9).all()) for low, high in ((found.least, chosen), (chosen, found.greatest))]
        [True, True]
        """
        found = force_range(self.source, self.magnitude)
        return None if found.least.ndim == 0 and np.isnan(found.least) else found

    @property
    def can_hold(self) -> NDArray[np.bool_]:
        """Shape (...): true only where every limit is known, none is estimated, and all are met."""
        return self.limits.can_hold

    @property
    def unknown(self) -> NDArray[np.bool_]:
        """Shape (...): whether :attr:`can_hold` depends on a limit that is missing or estimated, or was not found."""
        return self.limits.unknown

    @cached_property
    def verdict(self) -> str:
        """Whether the device can hold the pose, or how many of a stack, and which limbs pass through the wearer."""
        return verdict_of(self)

    @property
    def magnitude(self) -> FloatArray:
        """|F_s|, shape (...), N."""
        return np.asarray(np.linalg.norm(self.shoulder_force, axis=-1))

    @property
    def harness_wrench(self) -> FloatArray:
        """All limbs together on the torso, shape (..., 6): force in N and moment about O in N m, base frame."""
        return np.asarray(self.harness_wrenches.sum(axis=-2))

    @property
    def percent_body_weight(self) -> FloatArray | None:
        """|F_s| in percent of the person's weight, shape (...); None where the weight is not known."""
        return None if self.body_weight is None else 100.0 * self.magnitude / self.body_weight

    @property
    def has_answer(self) -> NDArray[np.bool_]:
        """Shape (...): whether the pose has an answer."""
        return np.isin(self.equilibrium_status, ("ok", "near_singular"))

    peak = property(shown.peak)
    drive_units = property(shown.drive_units)
    clearance = property(shown.clearance)
    crossings = shown.crossings
    columns = shown.columns
    plot = shown.plot
    as_dict = shown.as_dict

    @property
    def is_worn(self) -> bool:
        """Whether the arm is a person's, so that a cuff is on it."""
        arm = self.source.poses.mechanism.arm
        return arm is not None and arm.person is not None

    @property
    def cuff_pull(self) -> FloatArray:
        """Force of the cuff on the arm along the arm, shape (...), N: positive towards the hand."""
        return along_arm(self.cuff_wrench[..., :3], self._matrices)

    @property
    def cuff_slip(self) -> FloatArray | None:
        """Displacement and rotation vector of the cuff against the arm, shape (..., 6), m and rad, arm frame {O_B}.

        Of a split that takes the cuff as rigid, to first order, from the wrench on it. None where the design does not
        say how stiff its cuff is.
        """
        if self.interface_displacements is not None:
            return np.asarray(self.interface_displacements[..., 1, :])
        cuff = self.source.poses.mechanism.interfaces.cuff
        return None if cuff is None else cuff.slip(self.cuff_wrench, self._matrices)

    @property
    def cuff_pressure(self) -> FloatArray | None:
        """Mean force over area of the cuff on the skin, shape (...), Pa; None where the area is not known.

        The force across the arm over :attr:`exo_pin.Interfaces.cuff_area`: a mean, where the pressure under a cuff has
        peaks. What the moment of the cuff adds on its two ends is not in it.
        """
        area = self.source.poses.mechanism.interfaces.cuff_area
        if area is None:
            return None
        force = np.linalg.norm(self.cuff_wrench[..., :3], axis=-1)
        return np.asarray(np.sqrt(np.maximum(force**2 - self.cuff_pull**2, 0.0)) / area)

    def cuff_text(self, index: tuple[int, ...] = ()) -> str:
        """Pull, slip and pressure of the cuff in words: in a pose of the stack, or the most of all held ones.

        Empty where it is not on a person's arm, or no pose has an answer.

        Parameters
        ----------
        index : tuple of int
            Of the pose in the stack; empty for a single pose or for all.

        Returns
        -------
        str

        Examples
        --------
        >>> exo = ep.load("four-cables-worn")
        >>> print(exo.reaction(exo.pose(45)).cuff_text().split(".")[0])
        The cuff pulls along the arm with 57 N, towards the shoulder
        """
        pulls, chosen = self.cuff_pull, np.zeros(self.status.shape, dtype=bool)
        try:
            chosen[index] = True
        except (IndexError, ValueError):
            raise InvalidInput(f"expected index of a pose of shape {chosen.shape}, got {echo(index)}") from None
        chosen &= np.isfinite(pulls) & (self.held | (chosen.sum() == 1))
        if not self.is_worn or not chosen.any():
            return ""
        most = "up to " if chosen.sum() > 1 else ""
        pull = float(max(pulls[chosen], key=abs))
        text = f"The cuff pulls along the arm with {most}{abs(pull):.0f} N"
        text += "" if abs(pull) < 0.5 else f", towards the {'shoulder' if pull < 0.0 else 'hand'}"
        if (slip := self.cuff_slip) is not None:
            moved, turned = (np.linalg.norm(part[chosen], axis=1).max() for part in np.split(slip, 2, axis=-1))
            text += f"; by its stiffness it slips {most}{1e3 * moved:.1f} mm and turns {most}{np.degrees(turned):.1f}°"
        if (pressure := self.cuff_pressure) is not None:
            area = 1e4 * (self.source.poses.mechanism.interfaces.cuff_area or np.nan)
            mean = f"{most}{1e-3 * float(pressure[chosen].max()):.1f} kPa, on {area:.0f} cm²"
            text += f". Across the arm, its mean force over area on the skin is {mean}"
        return f"{text}."

    @property
    def _matrices(self) -> FloatArray:
        """Orientations of the arm, shape (..., 3, 3)."""
        return self.source.poses.matrices.reshape(*self.status.shape, 3, 3)

    def __str__(self) -> str:
        return reaction_table([self])

    def _repr_html_(self) -> str:
        """The table for notebooks."""
        return reaction_html([self])
