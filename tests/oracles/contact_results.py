"""Contact forces of a joint that are given and not computed."""

import numpy as np

from exo_pin.person import MUSCLES, JointContact


def some_contact(size, *, status=None, **changes):
    """A result in poses in which the scapula pushes with a force of a size, N, along y; NaN has none.

    The socket faces along y; the person weighs 750 N.
    """
    size = np.asarray(size, dtype=float)
    shape, nothing = size.shape, np.isnan(size)
    vector = np.stack([0.0 * size, size, 0.0 * size], axis=-1)
    fields = {
        "force": vector,
        "activations": np.where(nothing[..., None], np.nan, np.full((*shape, len(MUSCLES)), 0.13)),
        "muscle_forces": np.where(nothing[..., None], np.nan, np.full((*shape, len(MUSCLES)), 20.0)),
        "device_forces": np.zeros((*shape, 0)),
        "constraint_forces": np.zeros((*shape, 0)),
        "device_wrench": np.zeros((*shape, 6)),
        "glenoid": np.broadcast_to(np.eye(3)[[1, 2, 0]], (*shape, 3, 3)),
        "centre": np.zeros((*shape, 3)),
        "status": np.where(nothing, "too_weak", "ok") if status is None else np.asarray(status),
        "missing_moment": np.zeros((*shape, 3)),
        "missing_elbow": np.zeros((*shape, 2)),
        "residual": np.zeros(shape),
        "kkt": np.zeros(shape),
        "gap": np.zeros(shape),
        "body_weight": 750.0,
        "side": "left",
        "assumptions": {},
    }
    return JointContact(**(fields | changes))
