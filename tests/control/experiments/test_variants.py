"""Designs that the experiments change."""

from dataclasses import replace

import numpy as np
import pytest
from experiment_runs import tracked
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.control import (
    abduction,
    flexion,
    missing_moments,
)


def test_variants_of_the_design():
    exo = ep.load("prototype")
    four = ep.experiment("abduction-four").mechanism
    assert four.limb_count == 4
    np.testing.assert_allclose(np.linalg.norm(four.geometry.base_points, axis=1), np.hypot(0.1363, 0.078), atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(four.geometry.platform_points, axis=1), np.hypot(0.1188, 0.2), atol=1e-6)
    long = ep.experiment("abduction-long").mechanism
    lengths = exo.inverse_kinematics(exo.pose(abduction=[0.0, 45.0, 90.0])).lengths
    for limb, most in zip(long.limbs, lengths.max(axis=0), strict=True):
        assert limb.stroke.nominal_length + limb.stroke.end_fitting >= most - 1e-12


def test_fourth_muscle_is_in_the_hole_that_holds_most():
    times = np.linspace(0.0, 5.0, 26)
    lift = abduction()(times).orientation
    both = Rotation.concatenate([lift, flexion()(times).orientation])
    mechanism = ep.experiment("abduction-four").mechanism
    base, cuff = mechanism.geometry.base_points.copy(), mechanism.geometry.platform_points.copy()
    shares = {}
    for angle in (140.0, 150.0, 160.0, 170.0, -180.0):
        on_circle = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
        base[3, [0, 2]] = np.hypot(*base[0, [0, 2]]) * on_circle
        cuff[3, :2] = np.hypot(*cuff[0, :2]) * on_circle
        geometry = mechanism.geometry.replace(base_points=base, platform_points=cuff)
        exo = ep.ShoulderExo.from_mechanism(mechanism.replace(geometry=geometry))
        longest = exo.inverse_kinematics(both).lengths.max(axis=0)
        strokes = [replace(x.stroke, nominal_length=most - 0.025, end_fitting=0.025)
                   for x, most in zip(exo.limbs, longest, strict=True)]  # fmt: skip
        limbs = [replace(x, stroke=stroke) for x, stroke in zip(exo.limbs, strokes, strict=True)]
        plant = ep.Plant(exo.replace(limbs=limbs))
        shares[angle] = float((missing_moments(plant, lift) <= 0.01).mean())
    assert max(shares, key=shares.get) == 160.0
    assert shares[160.0] == pytest.approx(0.73, abs=0.01)


def test_longer_muscles_reach_further():
    assert tracked("abduction-long").summary()["end_deg"] > tracked("abduction-outward").summary()["end_deg"] + 15.0
