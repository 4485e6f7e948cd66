"""``exo-pin batch``: questions in JSON lines, answers in JSON lines."""

from __future__ import annotations

import json
import sys
from contextlib import nullcontext
from pathlib import Path
from typing import Annotated

from ...core.progress import track
from ...exo.questions import answered
from ..options import Progress, called


def batch(
    questions: Annotated[Path | None, called("FILE.jsonl")] = None,
    /,
    *,
    progress: Progress = False,
) -> int:
    """Answer questions in JSON lines, an answer a line; a line that is wrong is an error line, and the rest goes on.

    The exit status is 1 if any line failed.

    Parameters
    ----------
    questions : Path, optional
        A file with a question a line (default: the standard input).

    Examples
    --------
    exo-pin batch examples/questions.jsonl

    Notes
    -----
    members of a line, whose names are those of the Python call exo_pin.load(design, side).QUESTION(poses, ...):
      question       reaction, joint_contact, workspace, uncertainty, remedy, inverse_kinematics, singularity, accuracy,
                     check or report
      design, side   as in exo_pin.load (default: the design of exo-pin reaction); or the texts of its files,
                     {"toml": "..."} or {"urdf": "...", "closures": "...", "device": "..."}
      worn_by        whose arm it is, such as {"height": 1.75, "mass": 75, "sex": "male"}
      id             anything; the answer has it, too
      poses          {"flexion": 60, "abduction": [0, 30]}, degrees, or {"quaternions_xyzw": [0, 0, 0, 1]}; of workspace
                     also a step in degrees
      load, motion, person, criteria, weights, options    objects with the names of exo_pin.Load, Motion, Person,
                     Criteria, Weights, ContactOptions
      and the other arguments of the question, such as split, limits, centre_offset
    such as
      {"question": "reaction", "design": "four-cables", "poses": {"flexion": 60}, "load": {"force": [0, 0, -20]}}
    The answer of a line has its schema: exo-pin schema batch_answer
    """
    failed = False
    with nullcontext(sys.stdin.buffer) if questions is None else questions.open("rb") as lines:
        for number, line in track(enumerate(lines, 1), "batch", progress):
            if line.strip():
                found = answered(line, number)
                failed |= found["error"] is not None
                print(json.dumps(found, ensure_ascii=False, allow_nan=False), flush=True)
    return int(failed)
