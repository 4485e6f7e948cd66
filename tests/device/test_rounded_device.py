"""Rows of a rounded robot that agree within its digits hold nothing: they would be levers of the last digit."""

import re
from pathlib import Path

import numpy as np
import pytest

import exo_pin as ep

_URDF = Path(__file__).parents[2] / "urdf"


def _rounded(text, digits):
    def shorter(match):
        return 'xyz="' + " ".join(f"{round(float(part), digits):g}" for part in match[1].split()) + '"'

    return re.sub(r'xyz="([^"]*)"', shorter, text)


def _prototype(folder, digits):
    for name in ("prototype.urdf", "prototype.closures.toml", "prototype.device.toml"):
        text = (_URDF / name).read_text()
        (folder / name).write_text(_rounded(text, digits) if name.endswith("urdf") else text)
    return ep.load(folder / "prototype.urdf")


@pytest.mark.full
@pytest.mark.parametrize("digits", [5, 4])
def test_a_prototype_of_few_digits_answers_as_the_exact_one(tmp_path, digits):
    pose = ep.shoulder_rotation(np.radians(60.0), 0.0, 0.0)
    exact = ep.load(_URDF / "prototype.urdf").reaction(pose)
    found = _prototype(tmp_path, digits).reaction(pose)
    # Limb forces of 67 N on levers of 50 mm, some thousand N per m, beside the change of the pose of the loops.
    np.testing.assert_allclose(found.actuator_forces, exact.actuator_forces, atol=2e4 * 10.0**-digits)
    np.testing.assert_allclose(found.shoulder_force, exact.shoulder_force, atol=2e4 * 10.0**-digits)
    assert found.can_hold == exact.can_hold
    text = next((text for text in found.cautions if text.startswith("Rounded: ")), "")
    if digits == 4:
        # The caution has a number, which the true change stays below, and comes near.
        most = float(re.search(r"up to about ([\d.]+) N", text)[1])
        change = np.linalg.norm(found.shoulder_force - exact.shoulder_force)
        assert change < most < 20.0 * change
        assert "Undetermined: the digits of the robot's file" in str(found.cautions)


@pytest.mark.full
@pytest.mark.parametrize("split", ["elastic", "elastic_locked"])
def test_stiffness_of_a_rounded_prototype_gives_the_forces_of_the_exact_one(tmp_path, split):
    pose = ep.shoulder_rotation(np.radians(40.0), np.radians(80.0), 0.0)
    soft = {"shoulder": ep.Shoulder(stiffness=2e4 * np.eye(3))}
    exact = ep.load(_URDF / "prototype.urdf").replace(**soft).reaction(pose, split=split)
    found = _prototype(tmp_path, 4).replace(**soft).reaction(pose, split=split)
    np.testing.assert_allclose(found.actuator_forces, exact.actuator_forces, atol=0.2)
    np.testing.assert_allclose(found.shoulder_force, exact.shoulder_force, atol=0.2)


def test_a_device_says_where_digits_leave_a_singular_pose_open():
    """As its chain does: a wrist of a file of seven decimals beside a singular pose, and far from one."""
    exact = ep.load(_URDF / "prototype.urdf")
    rounded = ep.ShoulderExo.from_device(exact.device.replace(chain=exact.device.chain.with_tolerance(5e-8)))
    poses = exact.pose(flexion=[35.45, 90.0])
    assert exact.singularity(poses).kind.tolist() == ["near", "regular"]
    assert rounded.singularity(poses).kind.tolist() == ["undetermined", "regular"]
    for pose, verdict in zip(poses, ("singular", "regular"), strict=True):
        assert rounded.chain.mobility(rounded.configurations(pose), part="orientation").verdict == verdict
        said = [text for text in rounded.reaction(pose).cautions if text.startswith("Undetermined")]
        assert bool(said) == (verdict != "regular")
