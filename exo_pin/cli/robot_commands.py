"""``exo-pin mobility`` and ``forces`` of any robot with closed loops: freedoms, and forces in actuators and joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from ..chain import ClosedChain
from ..chain.dynamics.reactions import ClosedForces
from ..chain.dynamics.wrenches import JointReaction, what_is_open
from ..core.errors import InvalidInput
from ..core.schema import OnDesign, joined
from ..core.tables import three_digits
from ..core.validation import FloatArray, as_finite
from ..design import DEFAULT_PRESET
from ..exo.loading import load
from ..exo.shoulder_exo import ShoulderExo
from . import options
from .command import Files, writes
from .reaction_command import reaction

#: Units of a joint's value, longer endings first, in SI.
_UNITS = {"deg": np.pi / 180.0, "rad": 1.0, "mm": 1e-3, "m": 1.0}


def mobility(
    design: options.Design = DEFAULT_PRESET,
    /,
    *,
    side: options.Side = None,
    pose: options.Pose = options.Pose(),
    set: options.Joints = (),
    leave_out: options.LeaveOut = (),
) -> None:
    """Count the degrees of freedom of a design or of any robot with closed loops.

    Names redundant closures, and prints the distance from a singular configuration.

    Examples
    --------
    exo-pin mobility prototype --abduction 90
    exo-pin mobility urdf/dummy-shoulder.urdf --set shoulder_x=20deg
    """
    exo = load(design, side=side, leave_out=leave_out)
    chain, q = exo.chain, configuration(exo, pose, set)
    print(f"{exo.name}\n{chain.mobility(q)}")
    beyond = chain.beyond_limits(q)
    if beyond:
        print(f"beyond their limits  {', '.join(beyond)}")
    for text in chain.description.left_out:
        print(f"left out             {text}")


@dataclass(frozen=True)
class RobotForces(OnDesign):
    """Efforts and joint reactions of a chain at rest.

    Attributes
    ----------
    forces : ClosedForces
        Of all joints, N and N m.
    efforts : dict
        Of the drives by name, value and interval, N or N m.
    reactions : dict of str to JointReaction
        In joints and closures.
    cautions : list of str
        What to mind.
    """

    forces: ClosedForces
    efforts: dict[str, Any]
    reactions: dict[str, JointReaction]
    cautions: list[str]


@writes(".json")
def forces(
    design: options.Design = DEFAULT_PRESET,
    /,
    *,
    side: options.Side = None,
    pose: options.Pose = options.Pose(),
    set: options.Joints = (),
    leave_out: options.LeaveOut = (),
    worn: options.Worn = options.Worn(),
    joint: Annotated[options.Texts, options.called("NAME")] = (),
    actuated: Annotated[str | None, options.called("NAME,...")] = None,
    external: Annotated[options.Texts, options.called("FRAME=FX,FY,FZ[,MX,MY,MZ]")] = (),
    files: Files = Files(),
) -> int:
    """Compute actuator efforts and joint reactions at rest, for a design or for any robot with closed loops.

    Those that equilibrium determines are marked. In a pose of a device whose drives are no limbs it is what exo-pin
    reaction answers, with springs and cables, unless an option asks for something of the chain.

    Parameters
    ----------
    joint : tuple of str
        Joint or closure to report, may be repeated (default: the shoulder, else all closures).
    actuated : str, optional
        Joints with an actuator (default: as in the file).
    external : tuple of str
        Force (N) and moment (N m) on a body about its frame's origin, world axes; may be repeated, and adds up.

    Examples
    --------
    exo-pin forces prototype --flexion 45
    exo-pin forces urdf/prototype.urdf --external arm=0,0,-20 --joint limb_1_base
    """
    exo = worn.load(design, side, leave_out)
    chain = exo.chain
    if not chain.roles.limbs and exo.has_arm:
        if not any((joint, actuated, external, set, leave_out)):
            return reaction(design, side=side, pose=pose, worn=worn, files=files)
        device = exo.chain_device
        parts: list[Any] = [*device.springs, *(drive for drive in device.drives if drive.route is not None)]
        if parts:
            raise InvalidInput(
                f"joints of the chain do not feel {', '.join(part.name for part in parts)}: ask for the forces in the "
                f"pose without options of the chain, or exo-pin reaction {design}"
            )
    driven = chain.roles.actuated if actuated is None else tuple(actuated.split(","))
    found = chain.inverse_dynamics(configuration(exo, pose, set), external=_wrenches(external), actuated=driven)
    names = joint or _default_joints(chain)
    reactions = {name: found.joint_reaction(name) for name in names}
    lines = [exo.name, *(f"Caution: {text}" for text in found.cautions)]
    lines += [f"Left out: {text}" for text in chain.description.left_out]
    lines += [line for name in driven for line in _effort_lines(chain, found, name)]
    if any(chain.metres[chain.velocity_slice(name)].any() for name in driven):
        lines.append("A slide's effort is positive where it pushes: the tension of a limb is its negative.")
    efforts = {name: {"value": found.effort(name), "interval": found.effort_interval(name)} for name in driven}
    files.deliver(
        "\n".join([*lines, *(f"\n{each}" for each in reactions.values())]),
        data=lambda: joined(
            RobotForces,
            exo,
            forces=found,
            efforts=efforts,
            reactions={each.name: each for each in reactions.values()},
            cautions=found.cautions,
        ),
        exo=exo,
    )
    return 0


def _effort_lines(chain: ClosedChain, found: Any, joint: str) -> list[str]:
    """Efforts of a joint, and what equilibrium leaves open of them."""
    own = chain.velocity_slice(joint)
    rows = zip(found.effort(joint), found.effort_is_unique[own], found.effort_interval(joint), strict=True)
    return [
        f"effort of {joint:24} {three_digits(value):>10} {'N' if slide else 'N m':4} {what_is_open(unique, interval)}"
        for (value, unique, interval), slide in zip(rows, chain.metres[own], strict=True)
    ]


def _default_joints(chain: ClosedChain) -> list[str]:
    """The shoulder where there is one, else the closures that transmit a wrench."""
    if chain.roles.shoulder is not None:
        return [chain.roles.shoulder]
    return [closure.name for closure in chain.closures if not closure.kind.is_coupling]


def _wrenches(texts: options.Texts) -> dict[str, np.ndarray]:
    """Wrenches by frame; several on one frame add up."""
    total: dict[str, np.ndarray] = {}
    for text in texts:
        expected = "--external FRAME=FX,FY,FZ or with ,MX,MY,MZ behind"
        frame, values = options.named_numbers(text, expected, 3, 6, finite=True)
        total[frame] = total.get(frame, np.zeros(6)) + np.append(values, np.zeros(6 - len(values)))
    return total


def configuration(exo: ShoulderExo, pose: options.Pose, joints: options.Texts) -> FloatArray:
    """The closed configuration in a pose or with ``--set``, shape (nq,)."""
    chain = exo.chain
    q = chain.reference_configuration()
    held = list[str]()
    if chain.roles.limbs and "root_joint" in chain.model.names:
        # The arm hangs on the root: put it into the pose.
        root = chain.configuration_slice("root_joint")
        q[root.stop - 4 : root.stop] = pose.of(exo).as_quat()
        held.append("root_joint")
    elif any(pose.angles) and exo.has_arm:
        q = exo.configurations(pose.of(exo))
        if not np.isfinite(q).all():
            raise InvalidInput(f"{exo.name!r} does not reach this pose")
        if joints:
            raise InvalidInput("expected either a pose of the arm or --set: the joints of a device follow its arm")
        return q
    elif any(pose.angles):
        raise InvalidInput(f"{exo.name!r} has no arm to put into a pose: --set its joints instead")
    if joints and not held:
        # The joints are set in the drawn configuration, whose branch the answer is on.
        q = chain.close(q)
    held += [_set(chain, q, text) for text in joints]
    return chain.close(q, hold=held)


def joint_value(text: str) -> tuple[str, float, bool]:
    """The joint and the number, rad or m, of JOINT=VALUE, and whether that is a length."""
    joint, _, value = text.partition("=")
    unit = next((unit for unit in _UNITS if value.endswith(unit)), None)
    expected = "--set JOINT=VALUE with a unit, such as hip=23deg or rod=40mm"
    (number,) = options.numbers("" if unit is None else value.removesuffix(unit), expected, 1, shown=text)
    assert unit is not None
    return joint, float(as_finite(f"--set {joint}", number, ())) * _UNITS[unit], unit.endswith("m")


def _set(chain: ClosedChain, q: FloatArray, text: str) -> str:
    """Put JOINT=VALUE into q and return the joint's name."""
    joint, value, is_length = joint_value(text)
    part, moved = chain.configuration_slice(joint), chain.velocity_slice(joint)
    if moved.stop - moved.start != 1:
        raise InvalidInput(f"expected a hinge or a slide, got {joint!r} with {part.stop - part.start} coordinates")
    if bool(chain.metres[moved][0]) != is_length:
        raise InvalidInput(f"expected {joint!r} in {'deg or rad' if is_length else 'mm or m'}, got {text!r}")
    q[part] = value if part.stop - part.start == 1 else (np.cos(value), np.sin(value))
    return joint
