"""An animation of a simulated motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.errors import InvalidInput
from ...core.validation import as_positive
from ...load_case import Load, Motion
from ...reaction.constraints.limb_limits import given_forces
from .recording import SceneRecording

if TYPE_CHECKING:
    from ...control.plant.run import Run
    from .scene_of_exo import Scene

#: Most limbs whose forces a motion determines.
_DETERMINED = 3


def record_run(scene: Scene, run: Run, frames_a_second: float = 25.0) -> SceneRecording:
    """Record a run of the plant, in real time.

    Parameters
    ----------
    scene : Scene
        Of the design that was run.
    run : Run
        From :meth:`exo_pin.control.Plant.simulate`.
    frames_a_second : float
        At most; frames are samples of the run.

    Returns
    -------
    SceneRecording
        Arm, pressures, and the forces that this motion takes: those of the reaction query with the run's own motion
        and moments of friction and stops. Limb forces are the run's tensions, as in
        :meth:`exo_pin.control.plant.run.Run.reaction`. Without pressures if all limbs have motors.

    Raises
    ------
    InvalidInput
        If the run has only one sample.
    """
    if len(run.times) < 2:
        raise InvalidInput("expected a run of two samples or more: this one ended where it began")
    first, last = float(run.times[0]), float(run.times[-1])
    count = max(int((last - first) * as_positive("frames_a_second", frames_a_second)), 1)
    wanted = np.linspace(first, last, count + 1)
    # The samples nearest to these times: between samples tensions and motion would not balance.
    after = np.clip(np.searchsorted(run.times, wanted), 1, len(run.times) - 1)
    nearer = wanted - run.times[after - 1] < run.times[after] - wanted
    rows = np.unique(np.where(nearer, after - 1, after))
    given = run.load()
    query: dict[str, Any] = {
        "motion": Motion(run.angular_velocity[rows], run.angular_acceleration[rows]),
        "load": Load(given.force, np.asarray(given.moment)[rows], given.at),
    }
    if run.plant.count > _DETERMINED:
        query["limits"] = given_forces(run.tensions[rows])
    pressures = None if run.plant.motors.all() else np.maximum(run.pressures[rows], 0.0)
    return scene.record(run.rotations[rows], run.times[rows], pressures, **query)
