"""Wrists without symmetry, and poses away from singularity, for tests."""

import numpy as np
from scipy.spatial.transform import Rotation

from exo_pin.design import Arm, Limb, Mechanism, WristGeometry
from exo_pin.wrist.forces import classify


def random_mechanism(rng, n, kinds=None):
    """A wrist without any symmetry, with an arm of a general inertia."""
    base = rng.normal(size=(n, 3)) * 0.1 + [0, -0.1, 0.05]
    platform = rng.normal(size=(n, 3)) * 0.08 + [0, 0.02, -0.2]
    body = rng.normal(size=(3, 3)) * 0.1
    spread = body @ body.T
    arm = Arm(2.0 + rng.random(), rng.normal(size=3) * 0.1 + [0, 0, -0.2], np.trace(spread) * np.eye(3) - spread)
    limbs = tuple(Limb(kind) for kind in (kinds or ["UPU"] * n))
    return Mechanism(WristGeometry(base, platform), arm=arm, limbs=limbs, name=f"random-{n}")


def regular_poses(mechanism, rng, count, margin=0.02):
    """Poses drawn uniformly on the rotation group, away from singularity."""
    poses = Rotation.random(40 * count, rng)
    far = classify(mechanism, poses.as_matrix())[1] > margin
    return poses[np.flatnonzero(far)[:count]]
