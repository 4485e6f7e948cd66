"""Does a mechanism do what its description says? Checks for the user's own designs as for the published ones."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from .chain import ClosedChain, mechanism_urdf
from .design import Arm, Mechanism
from .errors import ExoPinError, LoopNotClosed
from .reaction import EquilibriumModel
from .validation import FloatArray
from .wrist import inverse_kinematics, limb_jacobian, singularity

__all__ = ["CHAIN_CHECKS", "CHECKS", "Finding", "Report", "check", "check_chain", "run_check"]

Outcome = Literal["pass", "note", "fail"]

#: Poses checked: the neutral one and this many around it, seeded.
_POSES = 12
#: Their largest angle from the neutral pose, rad.
_SPREAD = 1.0
#: How far around its first closed configuration a robot that is no wrist is checked, rad, characteristic lengths.
_AROUND = 0.3
#: Loop residual, m and rad.
_CLOSED = 1e-12
#: Step of central differences: their truncation and rounding errors are equal there.
_STEP = float(np.finfo(float).eps ** (1 / 3))
#: Largest error of a Jacobian that such a step explains, for second derivatives of the Jacobian up to about 500.
_JACOBIAN = 500 * _STEP**2


@dataclass(frozen=True)
class Finding:
    """Result of one check: its name, whether it passed, and its evidence in a sentence."""

    name: str
    outcome: Outcome
    detail: str


@dataclass(frozen=True)
class Report:
    """All findings about a mechanism; prints as a table."""

    mechanism: str
    findings: tuple[Finding, ...]

    @property
    def passed(self) -> bool:
        """Whether nothing failed."""
        return all(finding.outcome != "fail" for finding in self.findings)

    def __str__(self) -> str:
        width = max(len(finding.name) for finding in self.findings)
        lines = [f"{self.mechanism}: {'consistent' if self.passed else 'NOT CONSISTENT'}"]
        lines += [f"  {item.outcome:4}  {item.name:{width}}  {item.detail}" for item in self.findings]
        return "\n".join(lines)


class _Subject:
    """A mechanism with what the checks share: a chain whose arm may be massless, and poses."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism
        self.geometry = mechanism.geometry
        # Kinematics needs no mass; where the design has none, any will do.
        arm = mechanism.arm if mechanism.arm is not None else Arm(1.0, np.array([0.0, 0.0, -0.2]))
        self.model = EquilibriumModel(mechanism.replace(arm=arm))
        rng = np.random.default_rng(0)
        axes = rng.normal(size=(_POSES, 3))
        axes *= (_SPREAD * rng.random(_POSES) / np.linalg.norm(axes, axis=1))[:, None]
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
    outcome: Outcome = "pass" if worst <= _CLOSED else "fail"
    return Finding("loops", outcome, f"residual at most {worst:.1e} m, rad over {len(subject.poses)} poses")


def _lengths(subject: _Subject) -> Finding:
    """The chain's slides move as far as the closed form says."""
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
            turn = Rotation.from_rotvec(_STEP * np.eye(3)[axis])
            ahead, behind = (inverse_kinematics(subject.geometry, p).lengths for p in (turn * pose, turn.inv() * pose))
            worst = max(worst, float(np.abs(J[:, axis] - (ahead - behind) / (2 * _STEP)).max()))
    return Finding(
        "limb Jacobian", "pass" if worst <= _JACOBIAN else "fail", f"differences deviate by {worst:.1e} m/rad"
    )


def _closure_jacobian(subject: _Subject) -> Finding:
    """The closures' Jacobian against central differences on the chain's manifold."""
    chain = subject.model.chain
    if not chain.closures:
        return Finding("closure Jacobian", "note", "the chain has no loops")
    worst = max(_jacobian_error(chain, q) for _, q in subject.configurations())
    return Finding("closure Jacobian", "pass" if worst <= _JACOBIAN else "fail", f"differences deviate by {worst:.1e}")


def _jacobian_error(chain: ClosedChain, q: FloatArray) -> float:
    """Largest difference between the closures' Jacobian and central differences."""
    J, worst = chain.constraint_jacobian(q), 0.0
    for column in range(chain.model.nv):
        step = np.zeros(chain.model.nv)
        step[column] = _STEP
        ahead, behind = (chain.residual(pin.integrate(chain.model, q, sign * step)) for sign in (1.0, -1.0))
        worst = max(worst, float(np.abs(J[:, column] - (ahead - behind) / (2 * _STEP)).max()))
    return worst


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
        return Finding("inertia", "note", "no arm is given: reaction forces cannot be asked")
    if arm.inertia is None:
        return Finding("inertia", "note", f"{arm.mass:.4g} kg without inertia: no motion can be asked")
    principal = np.linalg.eigvalsh(arm.inertia)
    shown = ", ".join(f"{value:.3g}" for value in principal)
    slack = 1e-9 * principal[2]
    possible = principal[0] >= -slack and principal[2] <= principal[0] + principal[1] + slack
    return Finding("inertia", "pass" if possible else "fail", f"{arm.mass:.4g} kg, principal moments {shown} kg m²")


def _neutral_pose(subject: _Subject) -> Finding:
    """Limbs of some length, not folded, and how near the neutral pose is to singular."""
    state = inverse_kinematics(subject.geometry, subject.geometry.neutral)
    margin = singularity(subject.geometry, subject.geometry.neutral)
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


def _chain_loops(chain: ClosedChain) -> tuple[Finding, list[FloatArray]]:
    """The loops close from the rest configuration and from around it; the closed configurations found."""
    if not chain.closures:
        return Finding("loops", "note", "the chain has no loops"), [chain.neutral()]
    try:
        start = chain.close(chain.neutral())
    except LoopNotClosed as error:
        return Finding("loops", "fail", f"from the rest configuration: {error}"), []
    rng = np.random.default_rng(0)
    scale = np.where(chain.metres, chain.characteristic_length, 1.0)
    found, lost = [start], 0
    for _ in range(_POSES):
        away = scale * rng.uniform(-_AROUND, _AROUND, chain.model.nv)
        try:
            found.append(chain.close(pin.integrate(chain.model, start, away)))
        except LoopNotClosed:
            lost += 1
    worst = max(float(np.abs(chain.residual(q)).max()) for q in found)
    text = f"residual at most {worst:.1e} m, rad over {len(found)} configurations"
    if lost:
        return Finding("loops", "note", f"{text}; {lost} of {_POSES} near the first did not close"), found
    return Finding("loops", "pass" if worst <= _CLOSED else "fail", text), found


def _chain_jacobian(chain: ClosedChain, found: list[FloatArray]) -> Finding:
    """The closures' Jacobian against central differences on the chain's manifold."""
    if not chain.closures:
        return Finding("closure Jacobian", "note", "the chain has no loops")
    worst = max(_jacobian_error(chain, q) for q in found)
    return Finding("closure Jacobian", "pass" if worst <= _JACOBIAN else "fail", f"differences deviate by {worst:.1e}")


def _chain_mobility(chain: ClosedChain, found: list[FloatArray]) -> Finding:
    """Freedoms, and whether the actuators rule them."""
    answers = [chain.mobility(q) for q in found]
    freedoms = [answer.degrees_of_freedom for answer in answers]
    usual = answers[freedoms.index(max(freedoms, key=freedoms.count))]
    text = f"{usual.degrees_of_freedom} degrees of freedom, closures of rank {usual.rank} of {usual.rows}"
    if usual.redundant:
        text += f" (redundant: {', '.join(usual.redundant_closures)})"
    if usual.locked is None:
        return Finding("mobility", "note", f"{text}; the roles name no actuated joints")
    text += f"; {usual.locked.degrees_of_freedom} with the actuators locked"
    if answers[0].kinds:
        return Finding(
            "mobility", "note", f"{text}; the first configuration is singular: {', '.join(answers[0].kinds)}"
        )
    return Finding("mobility", "note" if usual.locked.degrees_of_freedom else "pass", text)


def _chain_limits(chain: ClosedChain, found: list[FloatArray]) -> Finding:
    """Joint limits of the first closed configuration."""
    beyond = chain.beyond_limits(found[0])
    if beyond:
        return Finding("joint limits", "note", f"the loops close first with {', '.join(beyond)} beyond their limits")
    return Finding("joint limits", "pass", "the loops close within them")


def _chain_inertia(chain: ClosedChain, _: list[FloatArray]) -> Finding:
    """Masses and inertias that bodies can have."""
    model = chain.model
    light = [model.names[joint] for joint in range(1, model.njoints) if model.inertias[joint].mass <= 0.0]
    for joint in range(1, model.njoints):
        principal = np.linalg.eigvalsh(model.inertias[joint].inertia)
        slack = 1e-9 * max(float(principal[2]), 0.0)
        if model.inertias[joint].mass < 0.0 or principal[0] < -slack or principal[2] > principal[:2].sum() + slack:
            return Finding("inertia", "fail", f"no body has the mass or inertia of the link after {model.names[joint]}")
    if light:
        return Finding("inertia", "note", f"no mass after {', '.join(light)}: motion there is not ruled by forces")
    return Finding("inertia", "pass", f"{sum(item.mass for item in model.inertias):.4g} kg in all")


#: The checks of a robot that is no wrist, after that of its loops.
CHAIN_CHECKS: dict[str, Callable[[ClosedChain, list[FloatArray]], Finding]] = {
    "closure Jacobian": _chain_jacobian,
    "mobility": _chain_mobility,
    "joint limits": _chain_limits,
    "inertia": _chain_inertia,
}


def check_chain(chain: ClosedChain) -> Report:
    """Run the checks of :data:`CHAIN_CHECKS` on any closed chain.

    Parameters
    ----------
    chain : ClosedChain
        The robot.

    Returns
    -------
    Report
        If the loops do not close, that is its only finding.
    """
    loops, found = _chain_loops(chain)
    rest = tuple(run(chain, found) for run in CHAIN_CHECKS.values()) if found else ()
    return Report(chain.description.name, (loops, *rest))


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
