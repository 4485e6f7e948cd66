"""The verdict of an answer: limits, clashes with the wearer, and the way of a device to the pose."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.validation import FloatArray
from ...wrist.clearance.clearance import clash
from ...wrist.singularities.measures import singularity
from .verdict import angle_words, verdict

if TYPE_CHECKING:
    from ..result import Reaction


def verdict_of(answer: Reaction) -> str:
    """See :attr:`exo_pin.Reaction.verdict`."""
    axis = None
    if answer.equilibrium_status.ndim == 0 and answer.equilibrium_status == "singular":
        axis = _weak_axis(answer)
    poses = answer.source.poses
    touching = None if poses.placed is not None else clash(poses.mechanism, poses.matrices, poses.offset)
    texts = (verdict(answer.limits, answer.status, axis), touching, _end_of_way(answer))
    return " ".join(text for text in texts if text)


def _end_of_way(answer: Reaction) -> str:
    """Where the way of a device from rest to a single pose ends that it does not reach; else empty."""
    poses = answer.source.poses
    if answer.status.ndim or answer.status != "out_of_reach" or poses.placed is None:
        return ""
    if poses.placed.share[0] == 0.0:
        return "Its loops do not close even at rest: off its centre a rigid device needs a cuff that gives way."
    turn = Rotation.from_matrix(poses.matrices[0]).as_rotvec()
    last = Rotation.from_rotvec(poses.placed.share[0] * turn)
    return f"On the way from rest it gets as far as {angle_words(last, poses.mechanism.side)}."


def _weak_axis(answer: Reaction) -> FloatArray:
    """Axis about which the arm is held least in a single pose, shape (3,), base frame."""
    poses = answer.source.poses
    if poses.placed is not None:
        return np.asarray(poses.placed.weak_axis[0])
    orientation = Rotation.from_matrix(poses.matrices[0])
    return singularity(poses.mechanism.geometry, orientation, poses.mechanism.is_upu).lost_direction
