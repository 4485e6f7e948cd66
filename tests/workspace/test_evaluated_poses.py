"""The workspace where the data of a spring end: such poses are neither held nor lost, neither singular nor regular."""

import numpy as np
import pytest
from places import URDF

import exo_pin as ep
from exo_pin.device import Route, Spring, TableLaw

LOW, HIGH = 0.285, 0.5
WAY = Route.over(("universe", (0.0, 0.0, -0.4)), ("arm", (0.0, 0.0, -0.2)))


@pytest.fixture(scope="module")
def exo():
    serial = ep.load(URDF / "serial-y-x-z.urdf")
    return serial.replace(springs=[Spring("strut", TableLaw((LOW, HIGH), (-30.0, -10.0)), route=WAY)])


def test_the_margin_is_the_distance_to_the_nearer_end(exo):
    """By the distance of the strut's ends in each pose, over the length of the table."""
    rng = np.random.default_rng(3)
    poses = exo.pose(*rng.uniform([0.0, 0.0, -30.0], [150.0, 80.0, 60.0], (40, 3)).T)
    found = exo.workspace(poses, ["evaluated", "singularity", "forces"])
    size = np.linalg.norm(poses.apply([0.0, 0.0, -0.2]) - [0.0, 0.0, -0.4], axis=1)
    expected = np.minimum(size - LOW, HIGH - size) / (HIGH - LOW)
    assert 0.2 < (expected >= 0.0).mean() < 0.9
    np.testing.assert_allclose(found.margins["evaluated"], expected, atol=1e-9)
    assert found.fractions["evaluated"] == (expected >= 0.0).mean()
    np.testing.assert_array_equal(found.not_evaluated, expected < 0.0)
    assert found.summary()["not_evaluated"] == (expected < 0.0).mean()
    # Kinematics are those without the spring; of forces nothing is known.
    bare = exo.replace(springs=[]).workspace(poses, ["singularity", "forces"])
    np.testing.assert_array_equal(found.margins["singularity"], bare.margins["singularity"])
    np.testing.assert_array_equal(np.isnan(found.margins["forces"]), found.not_evaluated)
    assert np.isnan(found.magnitude[found.not_evaluated]).all()
    assert not found.unknown.any()
    assert f"{100.0 * (expected < 0.0).mean():.1f} % are not evaluated: a spring has no data there" in str(found)
