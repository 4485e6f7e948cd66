"""The plane in which a picture lifts an arm: that of the pose, in closed form."""

from types import SimpleNamespace

import numpy as np
import pytest

import exo_pin as ep

plots = pytest.importorskip("exo_pin.view.plots.contact_plots", reason="needs the extra plot")
SUBJECT = SimpleNamespace(joint_contact=lambda poses, **query: (poses, query))


@pytest.mark.parametrize("side", ["left", "right"])
def test_the_arm_is_lifted_in_the_plane_of_its_pose(side):
    for plane in (-170.0, -30.0, 0.0, 50.0, 90.0, 130.0):
        pose = ep.isb_rotation(90.0 - plane, 40.0, 25.0, side, degrees=True)
        elevations, (poses, query), azimuth = plots.elevation_in_plane(SUBJECT, pose, side, person=3)
        directions, up = poses.apply([0.0, 0.0, -1.0]), np.radians(elevations)
        sideways = np.sin(up) * np.sin(np.radians(azimuth)) * (1.0 if side == "left" else -1.0)
        expected = np.column_stack([np.sin(up) * np.cos(np.radians(azimuth)), sideways, -np.cos(up)])
        np.testing.assert_allclose(directions, expected, atol=1e-12)
        (same,) = np.flatnonzero(np.isclose(elevations, 40.0))
        assert (poses[same] * pose.inv()).magnitude() < 1e-9
        assert query == {"person": 3, "outside": "mark"}
        assert azimuth == pytest.approx(plane)
    hanging = ep.shoulder_rotation(0.9, 0.0, 30.0, side, degrees=True)
    assert plots.elevation_in_plane(SUBJECT, hanging, side)[2] == 90.0
    assert plots.elevation_in_plane(SUBJECT, ep.shoulder_rotation(1.1, 0, 0, side, degrees=True), side)[
        2
    ] == pytest.approx(0.0)
