"""Examples of the public classes of reference trajectories."""

import numpy as np
from scipy.spatial.transform import Rotation

from exo_pin import control


def trajectory_examples():
    turn = control.Turn(Rotation.identity(), [0.3, -0.2, 0.1], 2.0)
    times = np.linspace(0.0, 2.0, 9)
    return [
        turn,
        turn(0.5),
        control.daily_task("feeding"),
        control.OrientationSpline(times, turn(times).orientation),
    ]
