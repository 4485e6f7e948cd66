"""Writes the files of this folder anew: `python examples/write_examples.py` in the folder of the sources."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.control import MeasuredRun, write_run
from exo_pin.core.conventions import CLINICAL_ANGLES
from exo_pin.core.files import write_columns
from exo_pin.muscle.io.measured import steady_states

#: Standard deviations of an angle of the movement, degrees, and of a measured length, m.
ANGLE_NOISE, LENGTH_NOISE = 0.1, 3e-4


def write(folder: Path) -> None:
    """All files."""
    rng = np.random.default_rng(1)
    write_columns(folder / "lift.csv", lift(rng))
    run = measured(rng)
    write_run(run, folder / "measured.csv")
    states = steady_states(valid_only=True)
    names = {
        "contraction_mm": 1e3 * states.contraction,
        "pressure_bar": 1e-5 * states.pressure,
        "force_N": states.force,
    }
    write_columns(folder / "muscle.csv", {name: np.round(values, 6) for name, values in names.items()})
    device = ep.load("four-cables")
    device.replace(name="device", title="Four cables, the beginning of one's own design").save(folder / "device.toml")


def lift(rng: np.random.Generator) -> dict[str, np.ndarray]:
    """The arm lifted forward to 80° in 2 s as an optical system would record it, at rest for a second at both ends."""
    times = np.arange(0.0, 4.0 + 1e-9, 0.02)
    share = np.clip((times - 1.0) / 2.0, 0.0, 1.0)
    smooth = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    angles = np.outer(smooth, (80.0, 20.0, 10.0)) + rng.normal(0.0, ANGLE_NOISE, (len(times), 3))
    return {"time_s": np.round(times, 3)} | dict(zip(CLINICAL_ANGLES, np.round(angles.T, 3), strict=True))


def measured(rng: np.random.Generator) -> MeasuredRun:
    """Poses and lengths of three linear actuators whose joints are some millimetres off."""
    nominal = ep.load("three-linear-actuators")
    shift = rng.normal(0.0, 2e-3, (2, 3, 3))
    built = nominal.replace(
        geometry=ep.WristGeometry(nominal.geometry.base_points + shift[0], nominal.geometry.platform_points + shift[1])
    )
    count = 60
    poses = built.pose(rng.uniform(0, 90, count), rng.uniform(0, 70, count), rng.uniform(-10, 60, count))
    lengths = built.inverse_kinematics(poses).lengths + rng.normal(0.0, LENGTH_NOISE, (count, 3))
    return MeasuredRun(Rotation.from_quat(np.round(poses.as_quat(), 6)), np.round(lengths, 6))


if __name__ == "__main__":
    write(Path(__file__).parent)
