"""Wrists of every kind, with poses away from singularity and loads, for tests."""

import numpy as np
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.design import Arm, Limb, Mechanism, WristGeometry
from exo_pin.wrist.limbs import classify

DEGREES = {"degrees": True}
PERSON = ep.Arm.from_anthropometry(1.75, 75, "male")


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
    """Poses drawn uniformly on the rotation group in which 1 N m takes less than 1 / margin N at the largest |B_i|."""
    poses = Rotation.random(40 * count, rng)
    limbs = classify(mechanism, poses.as_matrix())
    levers = limbs.X * limbs.reach[..., None] / mechanism.geometry.platform_radius
    with np.errstate(divide="ignore"):
        far = (np.linalg.svd(levers, compute_uv=False) ** -2.0).sum(axis=1) ** -0.5 > margin
    return poses[np.flatnonzero(far)[:count]]


def exo_of(mechanism):
    return ep.ShoulderExo.from_mechanism(mechanism)


def map_of(mechanism, *arguments, **options):
    """The reaction map of a bare mechanism."""
    return exo_of(mechanism).reaction_map(*arguments, **options)


def random_terms(rng, count):
    velocity, acceleration, force, moment = rng.normal(size=(4, count, 3))
    return ep.Motion(3 * velocity, 3 * acceleration), ep.Load(10 * force, moment)


#: Physics without actuators, so that no limits are known and forces are those of equilibrium.
MECHANISMS = {
    "prototype": lambda: ep.load("prototype").replace(limbs=None).mechanism,
    "prototype-right": lambda: ep.load("prototype", side="right").replace(limbs=None).mechanism,
    "worn": lambda: ep.load("prototype").worn_by(PERSON).replace(limbs=None).mechanism,
    "random-3": lambda: random_mechanism(np.random.default_rng(20), 3),
    "random-3-mixed": lambda: random_mechanism(np.random.default_rng(21), 3, ["SPS", "UPU", "SPS"]),
    "random-5": lambda: random_mechanism(np.random.default_rng(22), 5, ["UPU", "SPS", "UPU", "SPS", "UPU"]),
}


def heavy_limbs(mechanism, rng):
    def half():
        return ep.LimbBody.rod(0.05 + 0.2 * rng.random(), 0.1 + 0.1 * rng.random(), 0.01)

    return mechanism.replace(limbs=tuple(ep.Limb(limb.kind, half(), half()) for limb in mechanism.limbs))
