"""Whether two records hold the same, bit for bit."""

import numpy as np
from scipy.spatial.transform import Rotation

from exo_pin.design import (
    Arm,
)


def same(a, b):
    """Whether two records hold the same values, bit for bit."""
    if isinstance(a, np.ndarray):
        return np.array_equal(a, b)
    if isinstance(a, Rotation):
        return np.array_equal(a.as_quat(), b.as_quat())
    if isinstance(a, tuple):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, Arm) and a.parts == (a,):
        return all(same(getattr(a, n), getattr(b, n)) for n in ("mass", "centre_of_mass", "inertia", "device"))
    if hasattr(a, "__dataclass_fields__"):
        return all(same(getattr(a, name), getattr(b, name)) for name in a.__dataclass_fields__)
    return a == b
