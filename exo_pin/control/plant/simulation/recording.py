"""From the record of a motion to a run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from ....core.validation import FloatArray
from ..equations.observation import observe
from ..run import Run
from ..state import Snapshot, state_values

if TYPE_CHECKING:
    from ..plant import Plant

#: What :func:`observe` reports of limbs and shoulder, in its order.
_OF_LIMBS = ("lengths", "length_rates", "tensions", "bladder_contractions", "motor_forces", "stored_energy")
_OF_SHOULDER = ("angular_acceleration", "friction_moment", "stop_moment")


def recorded(plant: Plant, record: Sequence[tuple[Snapshot, FloatArray, FloatArray]], status: str, steps: int) -> Run:
    """The record of a motion, from a state at each instant, and the commands and flows from then on."""
    snapshots, commands, flows = zip(*record, strict=True)
    count, n = len(record), plant.count
    Q, Y = np.array([each.q for each in snapshots]), np.array([each.y for each in snapshots])
    motion, limbs, energy = np.zeros((count, 9)), np.zeros((count, n, 6)), np.zeros((count, 2))
    observe(Q, Y, np.array(flows)[..., 6:].copy(), plant.tables, motion, limbs, energy)
    values = state_values(Y, plant.motors)
    for name in ("turn", "drive_friction", "shoulder_friction"):
        del values[name]
    values |= {name: values[name][:, 0] for name in ("shoulder_loss", "air_used", "air_vented")}
    values |= zip(_OF_LIMBS, np.moveaxis(limbs, -1, 0), strict=True)
    values |= zip(_OF_SHOULDER, np.split(motion, 3, axis=1), strict=True)
    values |= {"kinetic_energy": energy[:, 0], "potential_energy": energy[:, 1], "commands": np.array(commands)}
    own = {name: np.array(each) for name, each in values.items()}
    times, turns = np.array([each.time for each in snapshots]), Rotation.from_quat(Q)
    return Run(plant=plant, times=times, rotations=turns, status=status, steps=steps, snapshots=snapshots, **own)
