"""What a run says of itself: reasons in words, numbers of its summary, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import InvalidInput, control
from exo_pin.control import Imu
from exo_pin.control.experiments.tracking_report import greatest_ratios

NEARLY_ZERO = ep.shoulder_rotation(-0.2, np.full(6, -0.1), -0.2, degrees=True)


@pytest.mark.full
def test_a_muscle_that_is_wanted_too_short_for_a_while_only():
    tracking = ep.experiment("hand-to-mouth-outward").run()
    beyond = tracking.wanted_ratios[:, 1] > greatest_ratios(tracking)[1]
    assert 0.0 < beyond.mean() < 0.5
    assert not beyond[-1]
    text = next(text for text in tracking.findings if text.startswith("the reference needs muscle 2 to contract"))
    assert f"for {100.0 * beyond.mean():.0f} % of the time, first at {tracking.times[beyond.argmax()]:.2f} s" in text
    assert " s on " not in text


@pytest.mark.full
def test_a_delayed_sensor_lacks_readings_later():
    study = ep.experiment("held-abduction-stuck-valve", "model").replace(duration=4.5)
    tracking = study.replace(imu=Imu(lost=((2.0, 2.5),), delay=2.0)).run()
    # Readings that were due from 4 to 4.5 s: the stuck valve has changed the force since 3 s.
    due = (tracking.times >= 4.0) & (tracking.times < 4.5)
    force = np.linalg.norm(tracking.shoulder_force, axis=1)
    assert round(force[due].max()) != round(force[(tracking.times >= 2.0) & (tracking.times < 2.5)].max())
    assert f"|F_s| reaches {force[due].max():.0f} N" in tracking.findings[-1]


def test_no_minus_before_a_zero():
    reference = control.Turn(ep.shoulder_rotation(0.0, 12.0, 0.0, degrees=True), [0.0, 0.0, 0.0], 0.05)
    tracking = ep.experiment("abduction-long").replace(reference=reference).run()
    found = replace(tracking, wanted=Rotation.identity(6), run=replace(tracking.run, rotations=NEARLY_ZERO))
    assert "ends at 0° of 0°" in found.verdict


def test_furthest_angle_of_a_reference_that_goes_down():
    name, down = "held-abduction", ep.shoulder_rotation(25.0, [55.0, 40.0], 32.0, degrees=True)
    reference = control.Turn(down[0], (down[1] * down[0].inv()).as_rotvec(), 0.3)
    numbers = ep.experiment(name).replace(reference=reference).run().summary()
    assert numbers["furthest_deg"] <= min(numbers["start_deg"], numbers["end_deg"])


def test_a_reference_for_one_time_only_is_refused_before_the_run():
    class Held:
        duration = 1.0

        def __call__(self, t):
            return control.ReferenceState(Rotation.identity(), np.zeros(3), np.zeros(3))

    with pytest.raises(InvalidInput, match="one orientation a time"):
        ep.load("prototype").track(Held())
