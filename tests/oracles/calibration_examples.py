"""Examples of the public classes of calibration."""

import numpy as np

import exo_pin as ep
from exo_pin.calibration import pose_information
from exo_pin.calibration.length_model import CalibrationProblem
from exo_pin.control import MeasuredRun


def calibration_examples():
    exo = ep.load("prototype")
    poses = ep.shoulder_rotation(
        np.linspace(0, 100, 12), 45 + 45 * np.sin(np.arange(12)), 40 * np.cos(3 * np.arange(12)), degrees=True
    )
    lengths = exo.inverse_kinematics(poses).lengths + 1e-4 * np.sin(7 * np.arange(36)).reshape(12, 3)
    found = ep.calibrate(poses, lengths, exo, unknowns=("base_points", "base_offset"), length_noise=1e-4)
    lost = found.undetermined
    str(found)
    return [
        found,
        found.devices,
        CalibrationProblem(found.model, poses.as_matrix(), lengths, found.errors, found.information.prior),
        lost,
        found.model.evaluate(found.values, poses.as_matrix()),
        pose_information(poses, exo, length_noise=1e-4),
        MeasuredRun(poses, lengths, np.arange(12.0)),
    ]
