"""The checks of a wrist: that its chain in Pinocchio and its closed forms are one mechanism."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from ..chain import ClosedChain
from ..core.errors import ExoPinError
from ..core.errors.checked import checked
from ..core.validation import FloatArray
from ..design import Arm, Mechanism
from ..reaction.constraints.actuator_limits import closed_length_limits
from ..wrist import inverse_kinematics, limb_jacobian, singularity
from ..wrist_chain import mechanism_urdf
from ..wrist_chain.equilibrium import EquilibriumModel
from .report import CLOSED, JACOBIAN, POSES, STEP, Finding, Report, closure_jacobian

#: Largest angle of the poses from the neutral pose, rad.
_SPREAD = 1.0


class _Subject:
    """A mechanism with what the checks share: a chain whose arm may be massless, and poses."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.geometry = mechanism.geometry
        # Kinematics needs no mass; where the design has none, any will do.
        arm = mechanism.arm if mechanism.arm is not None else Arm(1.0, np.array([0.0, 0.0, -0.2]))
        self.model = EquilibriumModel(mechanism.replace(arm=arm))
        rng = np.random.default_rng(0)
        axes = rng.normal(size=(POSES, 3))
        axes *= (_SPREAD * rng.random(POSES) / np.linalg.norm(axes, axis=1))[:, None]
        around = Rotation.from_rotvec(np.vstack([np.zeros(3), axes]))
        self.poses = self.geometry.neutral * around

    def configuration(self, pose: Rotation) -> FloatArray:
        return self.model.configuration(pose.as_matrix(), pose.as_quat())

    def configurations(self) -> list[FloatArray]:
        return [self.configuration(pose) for pose in self.poses]


def _loops(subject: _Subject) -> Finding:
    """Every pose closes every loop."""
    chain = subject.model.chain
    if not chain.closures:
        return Finding("loops", "note", "the chain has no loops")
    worst = np.max([np.abs(chain.residual(q)).max() for q in subject.configurations()])
    return Finding.of("loops", worst <= CLOSED, f"residual at most {worst:.1e} m, rad over {len(subject.poses)} poses")


def _lengths(subject: _Subject) -> Finding:
    """The chain's slides have the lengths of the closed form."""
    model = subject.model.chain.model
    neutral = inverse_kinematics(subject.geometry, subject.geometry.neutral).lengths
    slides = [model.joints[model.getJointId(f"limb_{i + 1}_slide")].idx_q for i in range(len(neutral))]
    of_chain = np.array(subject.configurations())[:, slides] + neutral
    worst = np.abs(of_chain - inverse_kinematics(subject.geometry, subject.poses).lengths).max()
    return Finding.of("limb lengths", worst <= 1e-12, f"chain and closed form differ by {worst:.1e} m")


def _limb_jacobian(subject: _Subject) -> Finding:
    """d(lengths)/dt = J ω against central differences on the rotation group."""
    geometry, poses, worst = subject.geometry, subject.poses, 0.0
    J = limb_jacobian(geometry, poses)
    for axis in range(3):
        turn = Rotation.from_rotvec(STEP * np.eye(3)[axis])
        ahead, behind = (inverse_kinematics(geometry, moved).lengths for moved in (turn * poses, turn.inv() * poses))
        worst = np.maximum(worst, np.abs(J[..., axis] - (ahead - behind) / (2 * STEP)).max())
    return Finding.of("limb Jacobian", worst <= JACOBIAN, f"differences deviate by {worst:.1e} m/rad")


def _closure_jacobian(subject: _Subject) -> Finding:
    return closure_jacobian(subject.model.chain, subject.configurations())


def _wrist_conditions(subject: _Subject) -> Finding:
    """Di Gregorio's two conditions: one axis of every universal joint meets O, the others are parallel in a limb."""
    upu = [i for i, limb in enumerate(subject.mechanism.limbs) if limb.kind == "UPU"]
    if not upu:
        return Finding("wrist conditions", "note", "no UPU limbs, so none are needed")
    model, worst = subject.model.chain.model, 0.0
    data = model.createData()
    for q in subject.configurations():
        J = pin.computeJointJacobians(model, data, q)

        def axis(name: str, J: FloatArray = J) -> FloatArray:
            return J[:, model.joints[model.getJointId(name)].idx_v]

        for i in upu:
            limb = f"limb_{i + 1}_"
            # The moment of an axis about O is its distance from O; of parallel axes the cross product vanishes.
            through = [np.linalg.norm(axis(limb + name)[:3]) for name in ("platform_y", "base_y")]
            parallel = np.linalg.norm(np.cross(axis(limb + "platform_x")[3:], axis(limb + "base_x")[3:]))
            worst = np.max([worst, *through, parallel])
    text = f"axes miss O or each other's direction by at most {worst:.1e} m, rad"
    return Finding.of("wrist conditions", worst <= 1e-12, text)


def _mobility(subject: _Subject) -> Finding:
    """Three freedoms, with the ball joint and, where three UPU limbs or more can do it, without."""
    mechanism = subject.mechanism
    upu = int(mechanism.is_upu.sum())
    most_regular = int(np.argmax(singularity(subject.geometry, subject.poses).smallest_singular_value))
    q = subject.configuration(subject.poses[most_regular])
    whole = subject.model.chain.mobility(q)
    text = f"{whole.degrees_of_freedom} degrees of freedom, closures of rank {whole.rank} of {whole.rows}"
    good = whole.degrees_of_freedom == 3 and whole.rows - whole.rank == upu
    if upu >= 3:
        alone = ClosedChain.from_urdf(*mechanism_urdf(mechanism, part="wrist"))
        # The arm flies freely, with its origin at O.
        freed = np.concatenate([np.zeros(alone.model.nq - len(q)), q])
        freedom = alone.mobility(alone.close(freed)).degrees_of_freedom
        text += f"; without the ball joint {freedom}"
        good = good and freedom == 3
    return Finding.of("mobility", good, text)


def _inertia(subject: _Subject) -> Finding:
    """A mass and an inertia that a body can have."""
    arm = subject.mechanism.arm
    if arm is None:
        return Finding("inertia", "note", "no arm in the file: forces need one (--person 1.75,75,male)")
    if arm.inertia is None:
        return Finding("inertia", "note", f"{arm.mass:.4g} kg without inertia: reaction forces in motion need one")
    principal = np.linalg.eigvalsh(arm.inertia)
    shown = ", ".join(f"{value:.3g}" for value in principal)
    slack = 1e-9 * principal[2]
    possible = principal[0] >= -slack and principal[2] <= principal[0] + principal[1] + slack
    return Finding.of("inertia", possible, f"{arm.mass:.4g} kg, principal moments {shown} kg m²")


def _neutral_pose(subject: _Subject) -> Finding:
    """Limbs of some length, not folded, and the distance of the neutral pose from singularity."""
    state = inverse_kinematics(subject.geometry, subject.geometry.neutral)
    margin = singularity(subject.geometry, subject.geometry.neutral, subject.mechanism.is_upu)
    lengths = ", ".join(f"{length * 1e3:.1f}" for length in state.lengths)
    text = f"limbs {lengths} mm, {margin.kind}, limb force up to {float(margin.amplification):.3g} N per N m"
    if state.lengths.min() < 1e-6:
        return Finding("neutral pose", "fail", text)
    if margin.kind != "regular":
        return Finding("neutral pose", "note", f"{text}: choose another neutral pose, or another geometry")
    shortest, longest = closed_length_limits(subject.mechanism)
    beyond = np.flatnonzero((state.lengths < shortest) | (state.lengths > longest)) + 1
    if beyond.size:
        limbs = ", ".join(f"limb {number}" for number in beyond)
        return Finding("neutral pose", "note", f"{text}; outside the stroke of {limbs}")
    return Finding("neutral pose", "pass", text)


#: The checks by name, in the order they run.
CHECKS: dict[str, Callable[[_Subject], Finding]] = {
    "loops": _loops,
    "limb lengths": _lengths,
    "limb Jacobian": _limb_jacobian,
    "closure Jacobian": _closure_jacobian,
    "wrist conditions": _wrist_conditions,
    "mobility": _mobility,
    "inertia": _inertia,
    "neutral pose": _neutral_pose,
}


@checked
def check(mechanism: Mechanism) -> Report:
    """Run every check on a mechanism.

    Parameters
    ----------
    mechanism : Mechanism
        Any; without an arm the kinematic checks still run.

    Returns
    -------
    Report
        A check that cannot run because of the mechanism itself counts as failed, with the error as its evidence.

    Examples
    --------
    >>> from exo_pin.consistency import check
    >>> check(ep.load("scenario-one").mechanism).passed
    True
    """
    return Report(mechanism.name, _findings(mechanism, CHECKS))


@checked
def run_check(name: str, mechanism: Mechanism) -> Finding:
    """Run one check of :data:`CHECKS`.

    Parameters
    ----------
    name : str
        One of :data:`CHECKS`.
    mechanism : Mechanism
        The design.

    Returns
    -------
    Finding

    Examples
    --------
    >>> from exo_pin.consistency import run_check
    >>> run_check("mobility", ep.load("appendix-d").mechanism).detail.split(",")[0]
    '3 degrees of freedom'
    """
    return _findings(mechanism, [name])[0]


def _findings(mechanism: Mechanism, names: Iterable[str]) -> tuple[Finding, ...]:
    try:
        subject = _Subject(mechanism)
    except ExoPinError as error:
        return tuple(Finding(name, "fail", str(error)) for name in names)
    return tuple(_run(name, subject) for name in names)


def _run(name: str, subject: _Subject) -> Finding:
    try:
        return CHECKS[name](subject)
    except ExoPinError as error:
        return Finding(name, "fail", str(error))
