"""Designs whose limbs have guides and whose shoulder has a stiffness."""

import numpy as np

import exo_pin as ep

GUIDE = ep.LimbGuide(40.0, 30.0)
SOFT_JOINTS = ep.LimbGuide(40.0, 30.0, joint_stiffness=2e5, joint_twist_stiffness=3e3)
RNG = np.random.default_rng(3)
STIFFNESS = (lambda m: m @ m.T)(RNG.normal(size=(3, 3)) * 100) + 1e4 * np.eye(3)


def guided(exo, guide=GUIDE, stiffness=STIFFNESS):
    limbs = tuple(ep.Limb(limb.kind, guide=guide) for limb in exo.limbs)
    return exo.replace(limbs=limbs, shoulder=ep.Shoulder(stiffness=stiffness))
