"""``exo-pin record``: what a recording holds, whether an arm can have moved like this, and the same in other files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np

from ...core.conventions import isb_angles, shoulder_angles
from ...core.results import drawn
from ...core.schema import document
from ...core.tables import aligned, filled, under_verdict
from ...core.validation import FloatArray
from ...load_case import Movement, read_movement, write_movement
from ...load_case.recordings.reading import read_poses
from ...load_case.recordings.writing import ANGLES, in_convention
from ..command import Files, writes
from ..options import called
from ..options.recording_options import ReadAs

#: Within this of an angle at which two others have no meaning of their own, degrees.
_LOCKED = 5.0


@dataclass(frozen=True)
class RecordSummary:
    """What a recording of an arm holds.

    Attributes
    ----------
    format, convention, side : str
        Of the file.
    cautions : list of str
        Doubts.
    time_s : list of float
        Of the samples, s.
    noise_rad : float
        Noise of the angles, rad.
    clinical, thesis, isb : ndarray
        Angles in each convention, a row a sample, degrees.
    quaternions : ndarray
        The same, x, y, z, w, dimensionless.
    elbow_flexion_rad : ndarray or None
        Bend of the elbow, rad.
    """

    format: str
    convention: str
    side: str
    cautions: list[str]
    time_s: list[float]
    noise_rad: float
    clinical: FloatArray
    thesis: FloatArray
    isb: FloatArray
    quaternions: FloatArray
    elbow_flexion_rad: FloatArray | None


@writes(".csv", ".mot", ".sto", plot="the path of the elbow in space")
def record(
    recording: Annotated[Path, called("FILE")],
    /,
    *,
    side: Literal["left", "right"] = "left",
    read_as: ReadAs = ReadAs(),
    angles: Literal["clinical", "thesis", "isb", "quaternions"] = "clinical",
    against: Path | None = None,
    files: Files = Files(),
) -> None:
    """Read a recording of an arm in any known format, check it, and convert it.

    Prints the format and convention that were found, the noise, the range of each angle in the thesis's order, in
    clinical angles and in those of the ISB, and every doubt. Samples near the angles at which a convention does not
    separate two of its angles are counted.

    Parameters
    ----------
    recording : Path
        The file.
    side : str
        Which arm.
    angles : str
        Convention of --out FILE.csv.
    against : Path, optional
        With --plot: a second recording, drawn with it, such as the one that a machine should follow.

    Examples
    --------
    exo-pin record examples/lift.csv
    exo-pin record examples/lift.csv --angles isb --out isb.csv --plot path.png
    exo-pin record examples/lift.csv --out lift.mot
    """
    read = read_poses(recording, side, read_as.options)
    movement = read_movement(recording, side, reading=read_as.options)
    paths = {recording.stem: movement}
    if against is not None:
        paths[f"{against.stem} (against)"] = read_movement(against, side, reading=read_as.options)
    files.deliver(
        _report(read.format, read.convention, movement, side),
        data=lambda: _data(read, movement, side),
        save=lambda path: write_movement(path, movement, side, angles),
        figure=lambda: drawn("record_plots:elbow_paths_figure", paths),
    )


def _report(what: str, convention: str, movement: Movement, side: str) -> str:
    count = len(movement.times)
    rate = (count - 1) / movement.duration
    rows = [["angle, degrees", "first", "lowest", "highest"]]
    for name in ("clinical", "thesis", "isb"):
        values = in_convention(movement.poses, side, name)
        for label, own in zip(ANGLES[name], values.T, strict=True):
            rows.append(
                [label.removesuffix("_deg").replace("_", " "), *(f"{x:.1f}" for x in (own[0], own.min(), own.max()))]
            )
    if movement.elbow_flexion is not None:
        own = np.degrees(movement.elbow_flexion)
        rows.append(["elbow flexion", *(f"{x:.1f}" for x in (own[0], own.min(), own.max()))])
    abduction = shoulder_angles(movement.poses, side, degrees=True)[:, 1]
    elevation = isb_angles(movement.poses, side, degrees=True)[:, 1]
    locked = int((np.abs(abduction) > 90.0 - _LOCKED).sum()), int((np.abs(elevation - 90.0) > 90.0 - _LOCKED).sum())
    verdict = f"A {side} arm can have moved like this." if not movement.cautions else "There are doubts:"
    return "\n\n".join(
        [
            under_verdict(verdict, movement.cautions),
            f"{what}: {convention}, {count} samples in {movement.duration:.4g} s ({rate:.4g} Hz); {movement.noise}",
            "\n".join(aligned(rows, words=1)),
            filled(
                f"Within {_LOCKED:g}° of a lock: {locked[0]} samples of the clinical angles (abduction ±90°), and "
                f"{locked[1]} of the ISB's (elevation 0 and 180°). There two of the angles change by much where the "
                "arm turns little. The poses are not affected."
            ),
        ]
    )


def _data(read: Any, movement: Movement, side: str) -> dict[str, Any]:
    named = {name: in_convention(movement.poses, side, name) for name in ANGLES}
    own = {
        "format": read.format, "convention": read.convention, "side": side, "cautions": list(movement.cautions),
        "time_s": movement.times, "noise_rad": movement.noise.found, **named,
        "elbow_flexion_rad": movement.elbow_flexion,
    }  # fmt: skip
    return document(RecordSummary, own)
