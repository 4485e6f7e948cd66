"""The tests of the prototype in Section 5.4: lengths of its muscles, their strokes, and the four daily tasks.

What the end fittings of the muscles add to their length is not printed. Differences of two lengths of one muscle do not
depend on it, and these are compared with (4-1). Lengths that are printed as "around" so much count as rounded to 10 mm.
"""

from __future__ import annotations

import numpy as np

from ...core.conventions import shoulder_rotation
from ...core.validation import FloatArray
from ...design import preset
from ...load_case.ranges_of_motion import ADL_BOX
from ...wrist import inverse_kinematics
from ..rows import Row, row

#: Both tests turn the arm by 90° in 5 s, at constant speed.
_SPEED = 90.0 / 5.0
#: A length printed as "around" a multiple of 10 mm, and the difference of two.
_AROUND, _TWO_AROUND = 5.0, 10.0


def _lengths(theta_x: float, theta_y: float, theta_z: float) -> FloatArray:
    """l_i of (4-1), mm, at the angles of Section 5.4, Y-X-Z in degrees."""
    pose = shoulder_rotation(-theta_y, theta_x, -theta_z, degrees=True)
    return np.asarray(1e3 * inverse_kinematics(preset("prototype").geometry, pose).lengths)


def rows() -> list[Row]:
    """Rows of the ledger.

    Source: thesis Table 5-6, Table 5-7.
    """
    return [*_abduction(), *_flexion(), *_strokes(), _daily_tasks()]


def _abduction() -> list[Row]:
    rest, start, end = _lengths(0, 0, 0), _lengths(8.8, -13.4, -8.8), _lengths(90, 0, 0)
    late, later = _lengths(3.5 * _SPEED, 0, 0), _lengths(4 * _SPEED, 0, 0)
    equal = "the fittings of muscles 2 and 3 are alike"
    return [
        row("motion_tests.abduction_at_3_5", 3.5 * _SPEED),
        row("motion_tests.muscle_1_from_200", rest[0] - start[0]),
        row("motion_tests.muscle_1_from_200_mm", rest[0] - later[0], values=(rest[0] - 200, later[0] - 150)),
        row("motion_tests.muscle_2_from_around", late[1] - end[1]),
        row("motion_tests.lengths_of_muscles", end[1] - end[2], values=(end[1], equal)),
    ]  # fmt: skip


def _flexion() -> list[Row]:
    rest, stalled, end = _lengths(0, 0, 0), _lengths(0, -70, 0), _lengths(0, -90, 0)
    return [
        row("motion_tests.muscle_1_from_200_to", rest[0] - end[0]),
        row("motion_tests.muscle_1_from_200_mm_at", rest[0] - stalled[0]),
        row("motion_tests.contraction_of_muscle", 100 * (250.0 - 110.0) / 250.0,
            reading=("of the 6-150 that muscle 1 is", 100 * (150.0 - 110.0) / 150.0)),
    ]  # fmt: skip


def _strokes() -> list[Row]:
    limbs = preset("prototype").limbs
    assert limbs is not None
    long = limbs[1].stroke
    assert long is not None
    return [
        row("motion_tests.least_length_of", 1e3 * long.nominal_length * long.shortest,
            reading=("70 % as in Section 5.4.3", 0.70 * 1e3 * long.nominal_length)),
        row("motion_tests.stroke_shortest", [100 * long.shortest, 100 * long.longest]),
        row("motion_tests.stroke_shortest_and", [100 * long.shortest, 100 * long.longest]),
    ]  # fmt: skip


def _daily_tasks() -> Row:
    """Shares of Table 5-7, and what the stroke alone would leave if l_i were the muscle's own length."""
    low = np.array([0.75 * 150.0, 0.75 * 250.0, 0.75 * 250.0])
    high = np.array([150.0, 250.0, 250.0])
    lengths = 1e3 * inverse_kinematics(preset("prototype").geometry, ADL_BOX.poses(4.0)).lengths
    share = 100.0 * float(((lengths > low) & (lengths < high)).all(axis=-1).mean())
    return row("motion_tests.share_of_four_tasks", [np.nan] * 4, values=(share,))
