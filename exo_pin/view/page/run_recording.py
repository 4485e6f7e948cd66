"""An animation of a simulated motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Slerp

from ...core.validation import FloatArray, as_positive
from ...load_case import Load, Motion
from .recording import Recording

if TYPE_CHECKING:
    from ...control.plant.run import Run
    from ..scene.scene_of_exo import Scene

__all__ = ["record_run"]

#: Most limbs whose forces a motion determines.
DETERMINED = 3


def record_run(scene: Scene, run: Run, frames_a_second: float = 25.0) -> Recording:
    """Record a run of the plant, in real time.

    Parameters
    ----------
    scene : Scene
        Of the design that was run.
    run : Run
        From :meth:`exo_pin.control.Plant.simulate`.
    frames_a_second : float
        Frames lie between samples on the shortest turn; with more than three limbs each is the nearest sample.

    Returns
    -------
    Recording
        Arm, pressures, and the forces that this motion takes: those of the reaction query with the run's own motion
        and moments of friction and stops. Forces of the limbs are the run's tensions: three are determined by the
        motion, more are given to the query.
    """
    last = float(run.times[-1])
    count = max(int(last * as_positive("frames_a_second", frames_a_second)), 1)
    times = np.linspace(0.0, last, count + 1)
    tensions: dict[str, Any] = {}
    if run.plant.count > DETERMINED:
        # Between samples tensions and motion do not balance each other to rounding.
        rows = np.unique(np.abs(run.times[:, None] - times).argmin(axis=0))
        times = run.times[rows]
        tensions["actuator_bounds"] = (run.tensions[rows], run.tensions[rows])

    def between(values: FloatArray) -> FloatArray:
        return np.stack([np.interp(times, run.times, column) for column in values.T], axis=-1)

    given = run.load()
    load = Load(given.force, between(np.asarray(given.moment)), given.at)
    motion = Motion(between(run.angular_velocity), between(run.angular_acceleration))
    pressures = None if run.plant.motors.all() else np.maximum(between(run.pressures), 0.0)
    poses = Slerp(run.times, run.rotations)(times)
    return scene.record(poses, times, pressures, motion=motion, load=load, **tensions)
