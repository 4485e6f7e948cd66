"""An animation of a simulated motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Slerp

from ...core.validation import FloatArray, as_positive
from ...load_case import Load, Motion
from .recording import Recording

if TYPE_CHECKING:
    from ...control.plant.run import Run
    from ..scene.scene_of_exo import Scene

__all__ = ["record_run"]


def record_run(scene: Scene, run: Run, frames_a_second: float = 25.0) -> Recording:
    """Record a run of the plant, in real time.

    Parameters
    ----------
    scene : Scene
        Of the design that was run.
    run : Run
        From :meth:`exo_pin.control.Plant.simulate`.
    frames_a_second : float
        Frames lie between samples on the shortest turn.

    Returns
    -------
    Recording
        Arm, pressures, and the forces that this motion takes: those of the reaction query with the run's own motion
        and moments of friction and stops, which for three limbs are the run's tensions.
    """
    last = float(run.times[-1])
    count = max(int(last * as_positive("frames_a_second", frames_a_second)), 1)
    times = np.linspace(0.0, last, count + 1)

    def between(values: FloatArray) -> FloatArray:
        return np.stack([np.interp(times, run.times, column) for column in values.T], axis=-1)

    given = run.load()
    load = Load(given.force, between(np.asarray(given.moment)), given.at)
    motion = Motion(between(run.angular_velocity), between(run.angular_acceleration))
    pressures = np.maximum(between(run.pressures), 0.0)
    return scene.record(Slerp(run.times, run.rotations)(times), times, pressures, motion=motion, load=load)
