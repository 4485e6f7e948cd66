"""Animations of runs."""

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.view import Scene
from exo_pin.view.scene.scene_recording import record_run


def test_an_animation_of_four_muscles_has_the_forces_of_the_run(tmp_path):
    study = ep.experiment("held-abduction-four-long", "model").replace(duration=2.0)
    run = study.run().run
    scene = Scene(ep.ShoulderExo.from_mechanism(study.mechanism), human=False)
    recording = record_run(scene, run, 3.0)
    rows = np.searchsorted(run.times, recording.times)
    np.testing.assert_array_equal(run.times[rows], recording.times)
    assert len(rows) == 7
    np.testing.assert_allclose(recording.reaction.actuator_forces, run.tensions[rows], atol=1e-6)
    np.testing.assert_allclose(recording.reaction.shoulder_force, run.shoulder_force[rows], atol=1e-6)
    recording.save(tmp_path / "run.html")
    assert (tmp_path / "run.html").stat().st_size > 100_000
    with pytest.raises(ep.InvalidInput, match="two samples"):
        record_run(scene, study.replace(duration=1e-10).run().run)
