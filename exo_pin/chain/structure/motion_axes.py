"""Motion subspaces of the joints of a model, units of their coordinates, and what each coordinate moves."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.spatial.distance import pdist

from ...core.validation import FloatArray

__all__ = ["carried_joints", "characteristic_length", "in_metres", "motion_axes", "moving_coordinates"]


def motion_axes(model: pin.Model) -> list[FloatArray]:
    """Motion subspace of every joint at rest, shape (6, nv) each, linear part first, in the joint's frame."""
    rest = pin.neutral(model)
    found = [np.zeros((6, 0))]
    for joint in list(model.joints)[1:]:
        data = joint.createData()
        joint.calc(data, rest)
        found.append(np.array(data.S, dtype=np.float64).reshape(6, -1))
    return found


def in_metres(model: pin.Model) -> NDArray[np.bool_]:
    """Shape (nv,): which coordinates are in metres, the translations: those that turn nothing."""
    return np.asarray(np.linalg.norm(np.hstack(motion_axes(model))[3:], axis=0) < 1e-9)


def moving_coordinates(model: pin.Model) -> FloatArray:
    """Shape (njoints, nv): 1 for coordinates that move the joint's body."""
    moved = np.zeros((model.njoints, model.nv))
    for joint in range(1, model.njoints):
        moved[joint] = moved[model.parents[joint]]
        first = model.idx_vs[joint]
        moved[joint, first : first + model.nvs[joint]] = 1.0
    return moved


def carried_joints(model: pin.Model) -> FloatArray:
    """Shape (njoints, njoints): 1 in row j and column k where joint k hangs on joint j, or is it."""
    outward = np.eye(model.njoints)
    for joint in range(model.njoints - 1, 0, -1):
        outward[model.parents[joint]] += outward[joint]
    return outward


def characteristic_length(model: pin.Model, joints: NDArray[np.int64], local: FloatArray) -> float:
    """Root mean square distance between the joints and closures of each body; a free flight is no joint."""
    points: list[list[FloatArray]] = [[] for _ in range(model.njoints)]
    for joint in range(1, model.njoints):
        if model.nvs[joint] < 6:
            points[joint].append(np.zeros(3))
            points[model.parents[joint]].append(model.jointPlacements[joint].translation)
    joined = joints[:, 0] != joints[:, 1]  # not those of couplings
    for bodies, places in zip(joints[joined], local[joined], strict=True):
        for body, place in zip(bodies, places, strict=True):
            points[body].append(place[3])
    pairs = [pdist(np.array(group)) for group in points if len(group) > 1]
    lengths = np.concatenate([np.zeros(0), *pairs])
    lengths = lengths[lengths > 1e-9]
    return float(np.sqrt(np.mean(lengths**2))) if lengths.size else 1.0
