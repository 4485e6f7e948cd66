"""The checks of a device of any kind: of its chain, drives, arm and springs, and those that only a wrist has."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..chain import ClosedChain
from ..core.conventions import shoulder_rotation
from ..core.errors import ExoPinError, LoopNotClosed, MasslessMotion, NearSingularConfiguration, SingularConfiguration
from ..core.errors.checked import checked
from ..core.tables import enumerated
from ..core.validation import FloatArray
from ..design import Arm, Mechanism
from ..device import ChainDevice
from ..device.device_model import device_model
from ..device.parts.laws import covered_force
from ..device.postures import placements, postures
from ..device.protocol import Device
from ..device.wrist_device import as_device
from ..load_case.pose_stacks import pose_matrices
from ..reaction.constraints.actuator_limits import closed_length_limits
from ..wrist import inverse_kinematics, singularity
from ..wrist_chain import mechanism_urdf
from ..wrist_chain.equilibrium import EquilibriumModel
from .report import CLOSED, POSES, Finding, Report, closure_jacobian, opening_of

#: Largest distance of the checked configurations from the first closed one, rad and characteristic lengths.
_AROUND = 0.3


def _chain_loops(chain: ClosedChain) -> tuple[Finding, list[FloatArray]]:
    """The loops close from the rest configuration and from around it; the closed configurations found."""
    if not chain.closures:
        return Finding("loops", "note", "the chain has no loops"), [chain.reference_configuration()]
    try:
        start = chain.close(chain.reference_configuration())
    except LoopNotClosed as error:
        return Finding("loops", "fail", f"from the rest configuration: {error}"), []
    rng = np.random.default_rng(0)
    scale = np.where(chain.metres, chain.characteristic_length, 1.0)
    found, lost = [start], 0
    for _ in range(POSES):
        away = scale * rng.uniform(-_AROUND, _AROUND, chain.model.nv)
        try:
            found.append(chain.close(pin.integrate(chain.model, start, away)))
        except LoopNotClosed:
            lost += 1
    worst = np.max([np.abs(chain.residual(q)).max() for q in found])
    text = f"residual at most {worst:.1e} m, rad over {len(found)} configurations"
    if lost:
        return Finding("loops", "note", f"{text}; {lost} of {POSES} near the first did not close"), found
    return Finding.of("loops", worst <= CLOSED + opening_of(chain), text), found


def mobility(chain: ClosedChain, found: list[FloatArray], held: int | None = None) -> Finding:
    """Freedoms, and how many are left where what drives the robot is locked.

    Parameters
    ----------
    chain : ClosedChain
        The robot.
    found : list of ndarray
        Closed configurations.
    held : int, optional
        Freedoms that drives and brakes of a device hold in general, cables among them; those that the actuated joints
        of the roles hold if left out.
    """
    answers = [chain.mobility(q) for q in found]
    freedoms = [answer.degrees_of_freedom for answer in answers]
    usual = answers[freedoms.index(max(freedoms, key=freedoms.count))]
    text = f"{usual.degrees_of_freedom} degrees of freedom, closures of rank {usual.rank} of {usual.rows}"
    if usual.redundant:
        text += f" (redundant: {', '.join(usual.redundant_closures)})"
    left = None if usual.locked is None else usual.locked.degrees_of_freedom
    if held is not None:
        left = usual.degrees_of_freedom - held
    if left is None:
        text += "; the roles name no actuated joints"
    else:
        text += f"; {left} with the {'actuators' if held is None else 'drives and brakes'} locked"
    first = answers[0]
    if first.verdict != "regular":
        text += f"; the first configuration is {first.verdict}{': ' * bool(first.kinds)}{', '.join(first.kinds)}"
    return Finding("mobility", "pass" if left == 0 and first.verdict == "regular" else "note", text)


def _chain_limits(chain: ClosedChain, found: list[FloatArray]) -> Finding:
    """Joint limits of the first closed configuration."""
    beyond = chain.beyond_limits(found[0])
    if beyond:
        return Finding("joint limits", "note", f"the loops close first with {', '.join(beyond)} beyond their limits")
    return Finding("joint limits", "pass", "the loops close within them")


def _chain_inertia(chain: ClosedChain, found: list[FloatArray]) -> Finding:
    """Masses and inertias that bodies can have, and motions that move none of them."""
    model = chain.model
    light = sum(inertia.mass <= 0.0 for inertia in list(model.inertias)[1:])
    for joint in range(1, model.njoints):
        principal = np.linalg.eigvalsh(model.inertias[joint].inertia)
        slack = 1e-9 * max(float(principal[2]), 0.0)
        if model.inertias[joint].mass < 0.0 or principal[0] < -slack or principal[2] > principal[:2].sum() + slack:
            return Finding("inertia", "fail", f"no body has the mass or inertia of the link after {model.names[joint]}")
    text = f"{sum(item.mass for item in model.inertias):.4g} kg in all"
    if not light:
        return Finding("inertia", "pass", text)
    try:
        chain.without_friction().forward_dynamics(found[0])
    except MasslessMotion as error:
        return Finding("inertia", "note", f"{text}; {error}")
    except (NearSingularConfiguration, SingularConfiguration):
        return Finding("inertia", "note", f"{text}, none in {light} links; the first configuration is singular")
    return Finding("inertia", "pass", f"{text}, none in {light} links; every motion has inertia")


#: The checks of every robot.
CHAIN_CHECKS = ("loops", "closure Jacobian", "mobility", "joint limits", "inertia")


@checked
def check_chain(chain: ClosedChain, held: int | None = None) -> Report:
    """Run the checks of :data:`CHAIN_CHECKS` on any closed chain.

    Parameters
    ----------
    chain : ClosedChain
        The robot.
    held : int, optional
        Freedoms that a device's drives and brakes hold, in the place of the actuated joints of the roles.

    Returns
    -------
    Report
        If the loops do not close, that is its only finding.

    Examples
    --------
    >>> from exo_pin.consistency import check_chain
    >>> report = check_chain(ep.load("four-cables").chain)
    >>> [finding.name for finding in report.findings if finding.outcome == "pass"]
    ['loops', 'closure Jacobian', 'mobility', 'joint limits', 'inertia']
    """
    loops, found = _chain_loops(chain)
    findings = [loops, *(Finding("left out", "note", text) for text in chain.description.left_out)]
    if found:
        findings += [closure_jacobian(chain, found), mobility(chain, found, held)]
        findings += [_chain_limits(chain, found), _chain_inertia(chain, found)]
    return Report(chain.description.name, tuple(findings))


#: Elevations, degrees, and halvings of their step at an end of what is covered: to 0.1°.
_ELEVATIONS, _HALVINGS = np.arange(0.0, 180.1, 3.0), 5
#: Axes and origin of the world, as those of the joints.
_WORLD = np.concatenate([np.eye(3), np.zeros((1, 3))])[None]


def springs(device: ChainDevice) -> Finding:
    """The range of elevation that each law covers."""
    ranged = [i for i, spring in enumerate(device.springs) if np.isfinite(spring.law.range).any()]
    if not ranged:
        return Finding("springs", "pass", "no law has an end")
    try:
        spans = {name: _covered(device, name) for name in ("flexion", "abduction")}
    except LoopNotClosed:
        return Finding("springs", "note", "the loops do not close with the arm hanging")
    texts, whole = [], True
    for i in ranged:
        parts = []
        for name, (words, complete) in spans.items():
            parts.append(f"{words[i]} of {name}")
            whole &= complete[i]
        texts.append(f"spring {device.springs[i].name!r}: law covers {', '.join(parts)}")
    return Finding("springs", "pass" if whole else "note", "; ".join(texts))


def _covered(device: ChainDevice, plane: str) -> tuple[list[str], list[bool]]:
    """For each spring the elevations in a plane that its law covers, in words, and whether that is all reached."""

    def at(angles: FloatArray) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        forward, aside = (angles, 0.0) if plane == "flexion" else (0.0, angles)
        return _springs_covered(device, shoulder_rotation(forward, aside, 0.0, side=device.side, degrees=True))

    covers, reached = at(_ELEVATIONS)
    words, complete = [], []
    for i in range(len(device.springs)):

        def inside(angle: float, i: int = i) -> bool:
            return bool(at(np.array([angle]))[0][0, i])

        words.append(_spans(covers[:, i], inside))
        complete.append(bool(covers[reached, i].all()))
    return words, complete


def _springs_covered(device: ChainDevice, poses: Rotation) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which of N poses the law of each of S springs covers, shape (N, S), and which the device reaches, shape (N,).

    Raises
    ------
    LoopNotClosed
        If the loops do not close with the arm hanging.
    """
    model, (_, matrices) = device_model(device), pose_matrices(poses)
    found = postures(model, matrices)
    covers = np.zeros((len(matrices), len(model.springs)), dtype=bool)
    for k in np.flatnonzero(found.reached):
        places = np.concatenate([_WORLD, placements(model.held, found.q[k])])
        q = model.free_configuration(found.q[k])
        for i, (spring, place) in enumerate(model.springs):
            covers[k, i] = np.isfinite(covered_force(spring.law, model.coordinate(place, q, places)))
    return covers, found.reached


def _spans(covers: NDArray[np.bool_], inside: Callable[[float], bool]) -> str:
    """Ranges of elevation in words, their ends found by halving the step."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], covers, [False]])))
    spans = []
    for first, beyond in edges.reshape(-1, 2).tolist():
        low = _end(first, first - 1, inside) if first else _ELEVATIONS[0]
        high = _end(beyond - 1, beyond, inside) if beyond < len(_ELEVATIONS) else _ELEVATIONS[-1]
        spans.append(f"{low:.0f}° to {high:.0f}°")
    return enumerated(spans) if spans else "none"


def _end(within: int, without: int, inside: Callable[[float], bool]) -> float:
    """Last elevation covered between one that is and one that is not, degrees."""
    ins, out = float(_ELEVATIONS[within]), float(_ELEVATIONS[without])
    for _ in range(_HALVINGS):
        middle = 0.5 * (ins + out)
        ins, out = (middle, out) if inside(middle) else (ins, middle)
    return ins


def _wrist_conditions(mechanism: Mechanism) -> Finding:
    """Di Gregorio's two conditions: one axis of every universal joint meets O, the others are parallel in a limb.

    Each UPU limb then adds one redundant row beside the ball joint, and three of them hold O without it.
    """
    upu = [i for i, limb in enumerate(mechanism.limbs) if limb.kind == "UPU"]
    if not upu:
        return Finding("wrist conditions", "note", "no UPU limbs, so none are needed")
    # Kinematics needs no mass; where the design has none, any will do.
    arm = mechanism.arm if mechanism.arm is not None else Arm(1.0, np.array([0.0, 0.0, -0.2]))
    wrist = EquilibriumModel(mechanism.replace(arm=arm))
    poses = mechanism.geometry.neutral * Rotation.from_rotvec(np.random.default_rng(0).random((POSES, 3)))
    configurations = [wrist.configuration(pose.as_matrix(), pose.as_quat()) for pose in poses]
    model, worst = wrist.chain.model, 0.0
    data = model.createData()
    for q in configurations:
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
    q = configurations[int(np.argmax(singularity(mechanism.geometry, poses).smallest_singular_value))]
    whole = wrist.chain.mobility(q)
    good = worst <= 1e-12 and whole.degrees_of_freedom == 3 and whole.rows - whole.rank == len(upu)
    if len(upu) >= 3:
        alone = ClosedChain.from_urdf(*mechanism_urdf(mechanism, part="wrist"))
        # The arm flies freely, with its origin at O.
        freed = np.concatenate([np.zeros(alone.model.nq - len(q)), q])
        freedom = alone.mobility(alone.close(freed)).degrees_of_freedom
        text += f"; without the ball joint {freedom} degrees of freedom"
        good = good and freedom == 3
    return Finding.of("wrist conditions", good, text)


def _neutral_pose(mechanism: Mechanism) -> Finding:
    """Limbs of some length, not folded, and the distance of the neutral pose from singularity."""
    geometry = mechanism.geometry
    state = inverse_kinematics(geometry, geometry.neutral)
    margin = singularity(geometry, geometry.neutral, mechanism.is_upu)
    lengths = ", ".join(f"{length * 1e3:.1f}" for length in state.lengths)
    text = f"limbs {lengths} mm, {margin.kind}, limb force up to {float(margin.amplification):.3g} N per N m"
    if state.lengths.min() < 1e-6:
        return Finding("neutral pose", "fail", text)
    if margin.kind != "regular":
        return Finding("neutral pose", "note", f"{text}: choose another neutral pose, or another geometry")
    shortest, longest = closed_length_limits(mechanism)
    beyond = np.flatnonzero((state.lengths < shortest) | (state.lengths > longest)) + 1
    if beyond.size:
        limbs = ", ".join(f"limb {number}" for number in beyond)
        return Finding("neutral pose", "note", f"{text}; outside the stroke of {limbs}")
    return Finding("neutral pose", "pass", text)


#: The checks that a wrist has besides.
WRIST_CHECKS = ("wrist conditions", "neutral pose")


def _check_of_wrist(name: str, mechanism: Mechanism) -> Finding:
    """An error because of the mechanism itself is a failure."""
    try:
        return _wrist_conditions(mechanism) if name == WRIST_CHECKS[0] else _neutral_pose(mechanism)
    except ExoPinError as error:
        return Finding(name, "fail", str(error))


@checked
def check(device: Device | Mechanism, chain: ClosedChain | None = None) -> Report:
    """Run every check on a device: of its chain, its springs, and a wrist's closed forms.

    Parameters
    ----------
    device : Device or Mechanism
        Of any kind, or the record of a wrist; without an arm the kinematic checks still run.
    chain : ClosedChain, optional
        Its chain with the arm of who wears it; as the device has it if left out.

    Returns
    -------
    Report
        A check that cannot run because of the device itself counts as failed, with the error as its evidence.

    Examples
    --------
    >>> from exo_pin.consistency import check
    >>> from exo_pin.device import ChainDevice, Route, Spring, TableLaw
    >>> strut = Route.over(("universe", [0.0, 0.0, -0.4]), ("arm", [0.0, 0.0, -0.2]))
    >>> law = TableLaw((0.3, 0.5), (-40.0, -10.0))  # m, N
    >>> device = ChainDevice.from_chain(ep.load("prototype").chain)
    >>> print(check(device.replace(springs=[Spring("strut", law, route=strut)])).findings[-1].detail)
    spring 'strut': law covers 47° to 108° of flexion, 47° to 108° of abduction
    """
    asked = as_device(device)
    held = None
    try:
        own = asked.as_chain()
        held = own.structure.rank
    except LoopNotClosed:  # as the check of the loops says
        pass
    except ExoPinError as error:
        return Report(asked.name, (Finding("chain", "fail", str(error)),))
    findings = check_chain(own.chain if chain is None else chain, held).findings
    if all(finding.outcome != "fail" for finding in findings):
        lacking = _lacking(asked.arm)
        if lacking:
            findings = (*(each for each in findings if each.name != "inertia"), Finding("inertia", "note", lacking))
        findings += (springs(own),) if own.springs else ()
    record = asked.accelerate("check")
    own_checks = () if record is None else tuple(_check_of_wrist(name, record) for name in WRIST_CHECKS)
    return Report(asked.name, findings + own_checks)


def _lacking(arm: Arm | None) -> str:
    """What forces need of an arm and do not have; empty if nothing."""
    if arm is None:
        return "no arm in the file: forces need one (--person 1.75,75,male)"
    return "" if arm.inertia is not None else f"{arm.mass:.4g} kg without inertia: reaction forces in motion need one"
