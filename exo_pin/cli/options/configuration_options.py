"""Options for the configuration of a chain."""

from __future__ import annotations

import argparse

import numpy as np

from ...chain import ClosedChain
from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_finite
from ...exo.shoulder_exo import ShoulderExo
from .option_values import numbers
from .query_options import pose

#: Units of a joint's value, longer endings first, in SI.
_UNITS = {"deg": np.pi / 180.0, "rad": 1.0, "mm": 1e-3, "m": 1.0}


def configuration(options: argparse.Namespace, exo: ShoulderExo) -> FloatArray:
    """The closed configuration, shape (nq,)."""
    chain = exo.chain
    angles = any((options.flexion, options.abduction, options.internal_rotation))
    q = chain.reference_configuration()
    held = list[str]()
    if chain.roles.limbs and "root_joint" in chain.model.names:
        # The arm hangs on the root: put it into the pose.
        root = chain.configuration_slice("root_joint")
        q[root.stop - 4 : root.stop] = pose(options, exo).as_quat()
        held.append("root_joint")
    elif angles and exo.has_arm:
        q = exo.configurations(pose(options, exo))
        if not np.isfinite(q).all():
            raise InvalidInput(f"{exo.name!r} does not reach this pose")
        if options.set:
            raise InvalidInput("expected either a pose of the arm or --set: the joints of a device follow its arm")
        return q
    elif angles:
        raise InvalidInput(f"{exo.name!r} has no arm to put into a pose: --set its joints instead")
    held += [_set(chain, q, text) for text in options.set]
    return chain.close(q, hold=held)


def joint_value(text: str) -> tuple[str, float]:
    """The joint and the number, rad or m, of JOINT=VALUE."""
    joint, value, _ = _parsed(text)
    return joint, value


def _parsed(text: str) -> tuple[str, float, bool]:
    """The joint, its value in SI, and whether that is a length."""
    joint, _, value = text.partition("=")
    unit = next((unit for unit in _UNITS if value.endswith(unit)), None)
    expected = "--set JOINT=VALUE with a unit, such as hip=23deg or rod=40mm"
    (number,) = numbers("" if unit is None else value.removesuffix(unit), expected, 1, shown=text)
    assert unit is not None
    return joint, float(as_finite(f"--set {joint}", number, ())) * _UNITS[unit], unit.endswith("m")


def _set(chain: ClosedChain, q: FloatArray, text: str) -> str:
    """Put JOINT=VALUE into q and return the joint's name."""
    joint, value, is_length = _parsed(text)
    part, moved = chain.configuration_slice(joint), chain.velocity_slice(joint)
    if moved.stop - moved.start != 1:
        raise InvalidInput(f"expected a hinge or a slide, got {joint!r} with {part.stop - part.start} coordinates")
    if bool(chain.metres[moved][0]) != is_length:
        raise InvalidInput(f"expected {joint!r} in {'deg or rad' if is_length else 'mm or m'}, got {text!r}")
    q[part] = value if part.stop - part.start == 1 else (np.cos(value), np.sin(value))
    return joint
