"""Margins and limits at their edges, the sign at rest, and what a check of a design says, of numbers that are given."""

from types import SimpleNamespace

import numpy as np
import pytest

from exo_pin.workspace import CRITERIA, Criteria

NAN = np.nan
LIMITS = Criteria(
    least_margin=0.1, least_moment=2.0, largest_shoulder_force=50.0, largest_pull_out=30.0, largest_cuff_pull=20.0,
    largest_cuff_slip=0.01, least_moment_without_limb=1.5, least_gap=0.004,
)  # fmt: skip


@pytest.mark.parametrize(
    ("name", "values", "expected"),
    [
        ("joint_angles", {"bend": [0.2, -0.1]}, [0.2, -0.1]),
        ("singularity", {"margin": [0.5, -0.05]}, [0.4, -0.15]),
        ("connected", {"connection": lambda: np.array([0.3, -np.inf])}, [0.2, -np.inf]),
        ("forces", {"moment": [5.0, 1.0, NAN]}, [3.0, -1.0, NAN]),
        ("shoulder_force", {"shoulder": [[30.0, 0.0, 40.0], [0.0, 60.0, 0.0], [NAN] * 3]}, [0.0, -10.0, NAN]),
        ("socket", {"pull_out": [-100.0, 40.0]}, [130.0, -10.0]),
        ("cuff_pull", {"cuff_pull": [5.0, 25.0]}, [15.0, -5.0]),
        ("cuff_slip", {"cuff_slip": [0.002, 0.02]}, [0.008, -0.01]),
        ("limb_loss", {"moment_without_limb": [4.0, 1.0]}, [2.5, -0.5]),
        ("clearance", {"gaps": [[0.01, 0.02, 0.03], [0.5, 0.001, 0.2], [0.5, 0.4, 0.0]]}, [0.006, -0.003, -0.004]),
        ("shoulder_range", {"shoulder_range": lambda: np.array([0.3])}, [0.3]),
    ],
)
def test_margins_by_hand(name, values, expected):
    at = {key: np.array(value) if isinstance(value, list) else value for key, value in values.items()}
    found = CRITERIA[name].margin(SimpleNamespace(criteria=LIMITS, **at))
    np.testing.assert_allclose(found, expected, atol=1e-15)
