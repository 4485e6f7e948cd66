"""The checks that only a wrist has: that its chain in Pinocchio and its closed forms are one mechanism."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from ..chain import ClosedChain
from ..core.errors import ExoPinError
from ..core.validation import FloatArray
from ..design import Arm, Mechanism
from ..reaction.constraints.actuator_limits import closed_length_limits
from ..wrist import inverse_kinematics, limb_jacobian, singularity
from ..wrist_chain import mechanism_urdf
from ..wrist_chain.equilibrium import EquilibriumModel
from .report import JACOBIAN, POSES, STEP, Finding

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


def _wrist_conditions(subject: _Subject) -> Finding:
    """Di Gregorio's two conditions: one axis of every universal joint meets O, the others are parallel in a limb.

    Each UPU limb then adds one redundant row beside the ball joint, and three of them hold O without it.
    """
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
    most_regular = int(np.argmax(singularity(subject.geometry, subject.poses).smallest_singular_value))
    q = subject.configuration(subject.poses[most_regular])
    whole = subject.model.chain.mobility(q)
    good = worst <= 1e-12 and whole.degrees_of_freedom == 3 and whole.rows - whole.rank == len(upu)
    if len(upu) >= 3:
        alone = ClosedChain.from_urdf(*mechanism_urdf(subject.mechanism, part="wrist"))
        # The arm flies freely, with its origin at O.
        freed = np.concatenate([np.zeros(alone.model.nq - len(q)), q])
        freedom = alone.mobility(alone.close(freed)).degrees_of_freedom
        text += f"; without the ball joint {freedom} degrees of freedom"
        good = good and freedom == 3
    return Finding.of("wrist conditions", good, text)


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


#: The checks of closed forms by name, in the order they run.
WRIST_CHECKS: dict[str, Callable[[_Subject], Finding]] = {
    "limb lengths": _lengths,
    "limb Jacobian": _limb_jacobian,
    "wrist conditions": _wrist_conditions,
    "neutral pose": _neutral_pose,
}


def check_wrist(mechanism: Mechanism) -> tuple[Finding, ...]:
    """What only a wrist's closed forms can be asked; an error because of the mechanism itself is a failure."""
    try:
        subject = _Subject(mechanism)
    except ExoPinError as error:
        return tuple(Finding(name, "fail", str(error)) for name in WRIST_CHECKS)
    return tuple(_run(name, subject) for name in WRIST_CHECKS)


def _run(name: str, subject: _Subject) -> Finding:
    try:
        return WRIST_CHECKS[name](subject)
    except ExoPinError as error:
        return Finding(name, "fail", str(error))
