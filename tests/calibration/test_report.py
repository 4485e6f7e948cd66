"""What a calibration says: the table of unknowns, undetermined directions, mix-ups and contradictions, in numbers."""

import re

import numpy as np
import pytest
from measured_devices import random_exo
from scipy.spatial.transform import Rotation

from exo_pin.calibration import pose_information


def test_the_deviation_of_a_direction_is_that_of_the_data_along_it():
    """Poses within two degrees: a direction is as uncertain as its eigenvector of the covariance is long."""
    rng = np.random.default_rng(71)
    exo = random_exo(rng, 3)
    arm = Rotation.from_rotvec(0.02 * rng.normal(size=(30, 3)))
    told = pose_information(arm, exo, unknowns=("base_offset", "length_offsets"), length_noise=1e-3)
    variances, axes = np.linalg.eigh(told.covariance)
    lost = np.flatnonzero(np.sqrt(variances) > 0.1 * told.model.reach)
    assert len(told.undetermined) == len(lost) > 0
    for each in told.undetermined:
        # In the space of the lost ones, along the direction whose largest component is one.
        along = axes[:, lost].T @ each.direction / np.linalg.norm(each.direction)
        size = np.sqrt((along**2 * variances[lost]).sum()) / np.linalg.norm(each.direction)
        assert each.standard_deviation == pytest.approx(size, rel=1e-6)
        assert f"(standard deviation {1e3 * each.standard_deviation:.3g} mm or mrad)" in str(each)
        largest = np.argsort(-np.abs(each.direction))[:4]
        named = [told.names[k] for k in largest if abs(each.direction[k]) > 0.05]
        assert re.findall(r"[+-][\d.e-]+ ([^,(]+?)(?:,|$)", each.description.removesuffix(", ...")) == named
