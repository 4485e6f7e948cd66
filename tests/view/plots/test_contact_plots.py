"""Plots of contact forces: what is drawn is what was computed."""

import matplotlib

matplotlib.use("agg")

import matplotlib.pyplot as plt
import numpy as np
import pytest

import exo_pin as ep
from exo_pin.core.errors import InvalidInput

pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")

from exo_pin.view.plots.contact_plots import contact_over_elevation

DEGREES = np.array([30.0, 60.0, 90.0])


@pytest.fixture(autouse=True)
def _close():
    yield
    plt.close("all")


def test_contact_force_is_drawn_in_percent_of_body_weight_with_gaps():
    person = ep.Person(1.75, 75, "male")
    poses = ep.shoulder_rotation(0, DEGREES, 0, degrees=True)
    contact = ep.load("prototype").joint_contact(poses, person)
    axes = contact_over_elevation(DEGREES, contact)
    lines = {line.get_label(): line for line in axes.get_lines()}
    drawn = lines["contact force with the device"].get_ydata()
    assert np.allclose(drawn[:2], contact.percent_body_weight[:2])
    assert np.isnan(drawn[2])
    assert lines["no result with the device"].get_xdata().tolist() == [90.0]
    assert np.allclose(
        lines["contact force without the device"].get_ydata(), contact.without_device.percent_body_weight
    )
    bare = contact_over_elevation(DEGREES, contact.without_device)
    assert [line.get_label() for line in bare.get_lines()] == ["contact force", "shear"]
    with pytest.raises(InvalidInput, match="shape"):
        contact_over_elevation(DEGREES[:2], contact)
