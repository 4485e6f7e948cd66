"""Random poses of muscles that can hold a random load."""

import numpy as np

from exo_pin.person.contact.activation import MusclePose


def some_pose(seed, muscles=12, limbs=0, power=2, rim=True, stopped=False, weights=None):
    """Random muscles that can hold a random load with a force in the socket."""
    rng = np.random.default_rng(seed)
    rows = rng.normal(0.0, 15.0, (5, muscles + limbs))
    pull = rng.normal(0.0, 200.0, (3, muscles + limbs))
    pull[0, :muscles] = 0.5 * np.abs(pull[0, :muscles]) + 40.0
    if limbs:
        rows[:, muscles:], pull[:, muscles:] = rows[:, muscles:] / 100.0, pull[:, muscles:] / 200.0
        rows[3:, muscles:] = 0.0
    inside = np.concatenate([rng.uniform(0.05, 0.6, muscles), rng.uniform(-50.0, 50.0, limbs)])
    rest = np.array([50.0, 0.0, 0.0])
    socket = np.eye(3) / np.array([[1.0], [0.61], [0.34]])
    # Push the load so far into the socket that the condition can be met, and often binds.
    v = socket @ (pull @ inside + rest)
    rest[0] += max(0.0, float(np.hypot(v[1], v[2]) - v[0]))
    return MusclePose(
        rows=rows,
        constant=-rows @ inside,
        pull=pull,
        rest=rest,
        low=np.concatenate([np.zeros(muscles), np.full(limbs, -80.0)]),
        high=np.concatenate([np.ones(muscles), np.full(limbs, 80.0)]),
        weights=np.ones(muscles) if weights is None else weights,
        power=power,
        socket=socket if rim else None,
        stopped=stopped,
    )
