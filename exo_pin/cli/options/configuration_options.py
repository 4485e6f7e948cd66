"""Options for the configuration of a chain."""

from __future__ import annotations

import argparse

import numpy as np

from ...chain import ClosedChain
from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_finite
from ...exo.shoulder_exo import ShoulderExo
from .. import add_repeated
from .option_values import named_numbers
from .query_options import add_pose, pose

__all__ = ["add_configuration", "configuration", "joint_value"]


def add_configuration(parser: argparse.ArgumentParser) -> None:
    """Add the pose of an arm, and joints that are set."""
    add_pose(parser)
    add_repeated(
        parser,
        "--set",
        "JOINT=VALUE",
        "of a robot from a file: hold a hinge at an angle, rad, or a slide at a position, m; may be repeated",
    )


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
    elif angles:
        raise InvalidInput(f"{exo.name!r} has no arm to put into a pose: --set its joints instead")
    held += [_set(chain, q, text) for text in options.set]
    return chain.close(q, hold=held)


def joint_value(text: str) -> tuple[str, float]:
    """The joint and the number, rad or m, of JOINT=VALUE."""
    joint, (value,) = named_numbers(text, "--set JOINT=VALUE with a number, rad or m", 1)
    return joint, float(as_finite(f"--set {joint}", value, ()))


def _set(chain: ClosedChain, q: FloatArray, text: str) -> str:
    """Put JOINT=VALUE into q and return the joint's name."""
    joint, value = joint_value(text)
    part = chain.configuration_slice(joint)
    if part.stop - part.start == 1:
        q[part] = value
    elif part.stop - part.start == 2:
        q[part] = np.cos(value), np.sin(value)
    else:
        raise InvalidInput(f"expected a hinge or a slide, got {joint!r} with {part.stop - part.start} coordinates")
    return joint
