"""Files with the histories of forces along a movement."""

from __future__ import annotations

import io
from os import PathLike, fspath
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.files import is_stream, write_bytes, write_text
from ...core.files.csv_tables import csv_text
from .along import MovementReaction
from .movement_columns import movement_columns


@checked
def write_movement_reaction(
    answer: MovementReaction, path: str | PathLike[str], side: str = "left", name: str = ""
) -> None:
    """Write full histories; the file appears whole or not at all.

    Parameters
    ----------
    answer : MovementReaction
        What to write.
    path : path-like
        ``.csv``: a table with units in its header, one line a sample, empty cells where there is no answer.
        ``.npz``: all arrays of the answer, among them every wrench, for :func:`numpy.load`.
        A pipe or a device gets the table.
    side : {"left", "right"}
        Side of the body that the clinical angles in the CSV are of.
    name : str
        Of the design, for the comment in the first line of the CSV.

    Raises
    ------
    InvalidInput
        If the ending is another.

    Examples
    --------
    >>> from exo_pin.reaction import write_movement_reaction
    >>> exo = ep.load("four-cables")
    >>> lift = ep.Movement.from_samples(np.linspace(0, 1, 6), exo.pose(np.linspace(10, 30, 6)), smoothing=None)
    >>> answer = exo.follow(lift)
    >>> write_movement_reaction(answer, "lift.npz")
    >>> bool((np.load("lift.npz")["shoulder_force"] == answer.reaction.shoulder_force).all())
    True
    """
    ending = Path(fspath(path)).suffix.lower()
    if ending == ".csv" or (ending != ".npz" and is_stream(path)):
        write_text(path, _as_csv(answer, side, name))
    elif ending == ".npz":
        buffer = io.BytesIO()
        np.savez_compressed(buffer, **_as_arrays(answer))
        write_bytes(path, buffer.getvalue())
    else:
        raise InvalidInput(f"expected a file that ends in .csv or .npz, got {fspath(path)!r}")


def _as_arrays(answer: MovementReaction) -> dict[str, Any]:
    fields = {
        key: np.asarray("" if value is None else value)
        for key, value in answer.reaction.as_dict().items()
        if key not in ("body_weight", "percent_body_weight")
    }
    return {
        "times": answer.movement.times,
        "quaternions_xyzw": answer.movement.poses.as_quat(),
        "angular_velocity": answer.movement.motion.angular_velocity,
        "angular_acceleration": answer.movement.motion.angular_acceleration,
        "movement_noise_covariance": answer.movement.noise.covariance,
        "end_effects": answer.movement.noise.end_effects,
        "force_noise": answer.force_noise,
        **fields,
        "cautions": np.array(answer.cautions, dtype=np.str_),
    }


def _as_csv(answer: MovementReaction, side: str, name: str) -> str:
    reaction, movement = answer.reaction, answer.movement
    columns = movement_columns(answer, side)
    columns["F_s_noise_N"] = answer.force_noise
    columns["end_effects"] = movement.noise.end_effects.astype(float)
    table = np.column_stack(list(columns.values()))
    rows = (
        [*("" if np.isnan(cell) else repr(cell) for cell in row.tolist()), str(status)]
        for row, status in zip(table, reaction.status, strict=True)
    )
    comments = [
        f"{name or 'exo_pin'}: {side} shoulder, split {reaction.split}; F_s is the shoulder's force on the arm",
        f"movement {movement.noise}",
        *(f"Caution: {text}" for text in answer.cautions),
    ]
    return csv_text([*columns, "status"], rows, comments)
