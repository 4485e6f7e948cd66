"""The checks of a wrist: that its chain in Pinocchio and its closed forms are one mechanism."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from ..chain import ClosedChain
from ..core.errors import ExoPinError
from ..core.validation import FloatArray
from ..design import Arm, Mechanism
from ..wrist import inverse_kinematics, limb_jacobian, singularity
from ..wrist_chain import EquilibriumModel, mechanism_urdf
from .report import CLOSED, JACOBIAN, POSES, STEP, Finding, Outcome, Report, closure_jacobian

__all__ = ["CHECKS", "check", "run_check"]

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

    def configurations(self) -> Iterator[tuple[Rotation, FloatArray]]:
        for pose in self.poses:
            yield pose, self.model.configuration(pose.as_matrix(), pose.as_quat())


def _loops(subject: _Subject) -> Finding:
    """Every pose closes every loop."""
    chain = subject.model.chain
    if not chain.closures:
        return Finding("loops", "note", "the chain has no loops")
    worst = max(float(np.abs(chain.residual(q)).max()) for _, q in subject.configurations())
    outcome: Outcome = "pass" if worst <= CLOSED else "fail"
    return Finding("loops", outcome, f"residual at most {worst:.1e} m, rad over {len(subject.poses)} poses")


def _lengths(subject: _Subject) -> Finding:
    """The chain's slides have the lengths of the closed form."""
    chain, worst = subject.model.chain, 0.0
    neutral = inverse_kinematics(subject.geometry, subject.geometry.neutral).lengths
    slides = [chain.model.joints[chain.model.getJointId(f"limb_{i + 1}_slide")].idx_q for i in range(len(neutral))]
    for pose, q in subject.configurations():
        lengths = inverse_kinematics(subject.geometry, pose).lengths
        worst = max(worst, float(np.abs(q[slides] + neutral - lengths).max()))
    return Finding(
        "limb lengths", "pass" if worst <= 1e-12 else "fail", f"chain and closed form differ by {worst:.1e} m"
    )


def _limb_jacobian(subject: _Subject) -> Finding:
    """d(lengths)/dt = J ω against central differences on the rotation group."""
    worst = 0.0
    for pose in subject.poses:
        J = limb_jacobian(subject.geometry, pose)
        for axis in range(3):
            turn = Rotation.from_rotvec(STEP * np.eye(3)[axis])
            ahead, behind = (inverse_kinematics(subject.geometry, p).lengths for p in (turn * pose, turn.inv() * pose))
            worst = max(worst, float(np.abs(J[:, axis] - (ahead - behind) / (2 * STEP)).max()))
    return Finding(
        "limb Jacobian", "pass" if worst <= JACOBIAN else "fail", f"differences deviate by {worst:.1e} m/rad"
    )


def _closure_jacobian(subject: _Subject) -> Finding:
    return closure_jacobian(subject.model.chain, (q for _, q in subject.configurations()))


def _wrist_conditions(subject: _Subject) -> Finding:
    """Di Gregorio's two conditions: one axis of every universal joint meets O, the others are parallel in a limb."""
    upu = [i for i, limb in enumerate(subject.mechanism.limbs) if limb.kind == "UPU"]
    if not upu:
        return Finding("wrist conditions", "note", "no UPU limbs, so none are needed")
    model, worst = subject.model.chain.model, 0.0
    data = model.createData()
    for _, q in subject.configurations():
        J = pin.computeJointJacobians(model, data, q)

        def axis(name: str, J: FloatArray = J) -> FloatArray:
            return J[:, model.joints[model.getJointId(name)].idx_v]

        for i in upu:
            limb = f"limb_{i + 1}_"
            # The moment of an axis about O is its distance from O; of parallel axes the cross product vanishes.
            through = [np.linalg.norm(axis(limb + name)[:3]) for name in ("platform_y", "base_y")]
            parallel = np.linalg.norm(np.cross(axis(limb + "platform_x")[3:], axis(limb + "base_x")[3:]))
            worst = max(worst, float(max(*through, parallel)))
    return Finding(
        "wrist conditions",
        "pass" if worst <= 1e-12 else "fail",
        f"axes miss O or each other's direction by at most {worst:.1e} m, rad",
    )


def _mobility(subject: _Subject) -> Finding:
    """Three freedoms, with the ball joint and, where three UPU limbs or more can do it, without."""
    mechanism = subject.mechanism
    upu = int(mechanism.is_upu.sum())
    pose = _most_regular(subject)
    whole = subject.model.chain.mobility(subject.model.configuration(pose.as_matrix(), pose.as_quat()))
    text = f"{whole.degrees_of_freedom} degrees of freedom, closures of rank {whole.rank} of {whole.rows}"
    good = whole.degrees_of_freedom == 3 and whole.rows - whole.rank == upu
    if upu >= 3:
        alone = ClosedChain.from_urdf(*mechanism_urdf(mechanism, part="wrist"))
        freedom = alone.mobility(alone.close(_freed(subject, alone, pose))).degrees_of_freedom
        text += f"; without the ball joint {freedom}"
        good = good and freedom == 3
    return Finding("mobility", "pass" if good else "fail", text)


def _most_regular(subject: _Subject) -> Rotation:
    """The pose farthest from singularity."""
    return subject.poses[int(np.argmax(singularity(subject.geometry, subject.poses).smallest_singular_value))]


def _freed(subject: _Subject, chain: ClosedChain, pose: Rotation) -> FloatArray:
    """The configuration with a free-flying arm whose origin is at O."""
    q = subject.model.configuration(pose.as_matrix(), pose.as_quat())
    return np.concatenate([np.zeros(chain.model.nq - len(q)), q])


def _inertia(subject: _Subject) -> Finding:
    """A mass and an inertia that a body can have."""
    arm = subject.mechanism.arm
    if arm is None:
        return Finding("inertia", "note", "no arm is given: reaction forces need one")
    if arm.inertia is None:
        return Finding("inertia", "note", f"{arm.mass:.4g} kg without inertia: reaction forces in motion need one")
    principal = np.linalg.eigvalsh(arm.inertia)
    shown = ", ".join(f"{value:.3g}" for value in principal)
    slack = 1e-9 * principal[2]
    possible = principal[0] >= -slack and principal[2] <= principal[0] + principal[1] + slack
    return Finding("inertia", "pass" if possible else "fail", f"{arm.mass:.4g} kg, principal moments {shown} kg m²")


def _neutral_pose(subject: _Subject) -> Finding:
    """Limbs of some length, not folded, and the distance of the neutral pose from singularity."""
    state = inverse_kinematics(subject.geometry, subject.geometry.neutral)
    margin = singularity(subject.geometry, subject.geometry.neutral, subject.mechanism.is_upu)
    lengths = ", ".join(f"{length * 1e3:.1f}" for length in state.lengths)
    text = f"limbs {lengths} mm, {margin.kind}, {float(margin.amplification):.3g} N per N m in the worst direction"
    if state.lengths.min() < 1e-6:
        return Finding("neutral pose", "fail", text)
    if margin.kind != "regular":
        return Finding("neutral pose", "note", f"{text}: choose another neutral pose, or another geometry")
    beyond = [
        f"limb {i + 1}"
        for i, limb in enumerate(subject.mechanism.limbs)
        if limb.stroke is not None
        and limb.stroke.end_fitting is not None
        and not limb.stroke.shortest
        <= (state.lengths[i] - limb.stroke.end_fitting) / limb.stroke.nominal_length
        <= limb.stroke.longest
    ]
    if beyond:
        return Finding("neutral pose", "note", f"{text}; outside the stroke of {', '.join(beyond)}")
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
    """
    try:
        subject = _Subject(mechanism)
    except ExoPinError as error:
        return Report(mechanism.name, tuple(Finding(name, "fail", str(error)) for name in CHECKS))
    return Report(mechanism.name, tuple(_run(name, subject) for name in CHECKS))


def run_check(name: str, mechanism: Mechanism) -> Finding:
    """Run one check of :data:`CHECKS`."""
    try:
        subject = _Subject(mechanism)
    except ExoPinError as error:
        return Finding(name, "fail", str(error))
    return _run(name, subject)


def _run(name: str, subject: _Subject) -> Finding:
    try:
        return CHECKS[name](subject)
    except ExoPinError as error:
        return Finding(name, "fail", str(error))
