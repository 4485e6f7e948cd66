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


@pytest.mark.full
@pytest.mark.parametrize("digits", [5, 4])
def test_a_prototype_of_few_digits_answers_as_the_exact_one(tmp_path, digits):
    pose = ep.shoulder_rotation(np.radians(60.0), 0.0, 0.0)
    exact = ep.load(_URDF / "prototype.urdf").reaction(pose)
    for name in ("prototype.urdf", "prototype.closures.toml", "prototype.device.toml"):
        text = (_URDF / name).read_text()
        (tmp_path / name).write_text(_rounded(text, digits) if name.endswith("urdf") else text)
    found = ep.load(tmp_path / "prototype.urdf").reaction(pose)
    # Limb forces of 67 N on levers of 50 mm, some thousand N per m, beside the change of the pose of the loops.
    np.testing.assert_allclose(found.actuator_forces, exact.actuator_forces, atol=2e4 * 10.0**-digits)
    np.testing.assert_allclose(found.shoulder_force, exact.shoulder_force, atol=2e4 * 10.0**-digits)
    assert "digits of the robot's file" in str(found.cautions)
    assert found.can_hold == exact.can_hold
