"""Limbs with mass in a workspace: by hand, and against Pinocchio."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.cli import main
from exo_pin.workspace import Criteria

FORCES = Criteria(names=("forces",))
UPPER, LOWER = ep.LimbBody.rod(0.3, 0.2, 0.01), ep.LimbBody(0.2, 0.12, 1e-3, 1e-5)


def with_mass(name, kind):
    exo = ep.load(name)
    actuator = ep.Actuator("linear", pull_limit=400.0, push_limit=400.0)
    limbs = [replace(each, kind=kind, base_body=UPPER, platform_body=LOWER, actuator=actuator) for each in exo.limbs]
    return exo.replace(limbs=limbs)


@pytest.mark.parametrize(("name", "kind"), [("four-cables", "SPS"), ("four-cables", "UPU"), ("prototype", "UPU")])
def test_limbs_with_mass_as_through_pinocchio(name, kind):
    exo, poses = with_mass(name, kind), ep.adl_box(30.0)
    found = exo.workspace(poses, FORCES)
    held = np.isfinite(found.magnitude)
    assert held.sum() > 20
    answer = exo.reaction(
        Rotation.from_quat(poses.as_quat()[held]),
        split="minimal",
        limits=(-400.0, 400.0),
        constraint_bounds=(0.0, 0.0),
    )
    # |F_s| is the least, so it agrees to the square of what the choice of the tensions differs by.
    np.testing.assert_allclose(found.magnitude[held], answer.magnitude, rtol=1e-9)
    light = exo.replace(limbs=[replace(each, base_body=None, platform_body=None) for each in exo.limbs])
    assert np.nanmean(found.magnitude) > np.nanmean(light.workspace(poses, FORCES).magnitude)


def test_hanging_limb_by_hand():
    """A level limb of 1 m and 2 kg gives the arm half its weight; its own actuator carries nothing."""
    base = [[0.3, 1.0, -0.2], [0.0, 0.2, 0.2], [0.2, 0.0, 0.2]]
    platform = [[0.3, 0.0, -0.2], [0.1, 0.1, -0.3], [-0.1, 0.1, -0.3]]
    arm = ep.Arm(2.0, [0.0, 0.0, -0.25], np.diag([0.1, 0.1, 0.01]))
    half = ep.LimbBody(1.0, 0.25, 0.01, 1e-4)
    light = ep.Limb("SPS", actuator=ep.Actuator("linear", pull_limit=1e4, push_limit=1e4))
    rest = Rotation.identity()
    exo = ep.ShoulderExo(
        ep.WristGeometry(base, platform),
        arm=arm,
        limbs=[replace(light, base_body=half, platform_body=half), light, light],
    )
    bare = ep.ShoulderExo(ep.WristGeometry(base, platform), arm=arm, limbs=[light] * 3)
    load = ep.Load([0.0, 0.0, -9.81], at=platform[0])
    np.testing.assert_allclose(
        exo.workspace(rest, FORCES).shoulder_force, bare.workspace(rest, FORCES, load).shoulder_force, rtol=1e-12
    )


def light():
    """A design whose drives hold 0.3 kg."""
    exo = ep.load("four-linear-actuators")
    return exo.replace(arm=ep.Arm(0.3, (0.0, 0.0, -0.2)))


@pytest.mark.full
def test_a_design_whose_drives_have_mass_is_heavier_by_their_moment(tmp_path):
    """Balance of the arm by hand: each limb hangs on two joints, and its weight on the cuff is by the lever rule."""
    path = tmp_path / "heavy.toml"
    assert main(["parts", "--step", "40", "--drive-mass", "0.4", "--with-masses", str(path)]) == 0
    light, heavy = ep.load("four-linear-actuators-worn"), ep.load(path)
    pose = heavy.pose(50.0, 20.0)
    answer, R = heavy.reaction(pose, limits="none"), pose.as_matrix()
    A, B = light.geometry.base_points, light.geometry.platform_points @ R.T
    arm, down = light.mechanism.arm, np.array([0.0, 0.0, -9.81])
    moment = np.cross(R @ arm.centre_of_mass, arm.mass * down)
    for a, b, limb in zip(A, B, light.limbs, strict=True):
        stroke, length = limb.stroke, np.linalg.norm(b - a)
        short = stroke.nominal_length * stroke.shortest + stroke.end_fitting
        # The case hangs from the frame, the rod from the cuff; both are as long as the retracted limb.
        share = 0.4 * (0.85 * short / 2.0 + 0.15 * (length - short / 2.0)) / length
        along = (down @ (b - a)) * (b - a) / length**2
        # Along the limb the cuff carries the rod alone, and the drive is between.
        moment = moment + np.cross(b, share * (down - along) + 0.15 * 0.4 * along)
    pull = np.cross(B, (A - B) / np.linalg.norm(A - B, axis=1)[:, None])
    np.testing.assert_allclose(pull.T @ answer.actuator_forces + moment, 0.0, atol=1e-8)
    assert np.abs(pull.T @ light.reaction(pose, limits="none").actuator_forces + moment).max() > 0.1
