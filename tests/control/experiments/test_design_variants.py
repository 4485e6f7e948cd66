"""What a plant can hold with a load, against bounded least squares."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import lsq_linear

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.control import missing_moments
from exo_pin.load_case import Load
from exo_pin.muscle import muscle_model


def test_a_load_counts_for_what_can_be_held():
    study = ep.experiment("held-abduction")
    mechanism, poses = study.mechanism, study.reference(np.arange(7.0)).orientation
    load, exo = Load([2.0, -1.0, -6.0], at=[0.0, 0.02, -0.25]), ep.ShoulderExo.from_mechanism(mechanism)
    plant = ep.Plant(mechanism, load=load)
    missing = missing_moments(plant, poses)
    laws = [muscle_model("tang-optimised", nominal) for nominal in (0.15, 0.25, 0.25)]
    lines = [law.validity.capability_line(np.array(4e5)) for law in laws]
    for pose, found in zip(poses, missing, strict=True):
        arms, answer = exo.jacobian(pose).T, exo.reaction(pose, load=load)
        x = np.array([0.276, 0.404, 0.404]) - exo.inverse_kinematics(pose).lengths
        braid = np.array([0.3 * 2960.0 / law.length for law in laws]) * np.maximum(-x, 0.0)
        pulls = [
            float(np.clip(law.unchecked_force(max(c, 0.0), 4e5), 1e-12, line))
            for law, c, line in zip(laws, x, lines, strict=True)
        ]
        best = lsq_linear(arms, arms @ answer.actuator_forces, (braid, braid + pulls), method="bvls", tol=1e-14)
        assert found == pytest.approx(np.sqrt(2.0 * best.cost), abs=1e-6)
    assert (missing > 0.1).any()
    halves = {"platform_body": ep.LimbBody.rod(0.2, 0.1, 0.01)}
    heavy = mechanism.replace(limbs=[replace(limb, **halves) for limb in mechanism.limbs])
    with pytest.raises(InvalidInput, match="mass"):
        missing_moments(ep.Plant(heavy), poses)
    with pytest.raises(InvalidInput, match="stack"):
        missing_moments(plant, poses[0])
    with pytest.raises(InvalidInput, match="Plant"):
        missing_moments(exo, poses)
