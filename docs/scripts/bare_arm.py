"""Write exo_pin/person/data/bare_arm.csv: the contact force of a bare arm over the elevation.

    python docs/scripts/bare_arm.py

Needs the extra ``person``.
"""

from pathlib import Path

import numpy as np

import exo_pin as ep
from exo_pin.person.bare_arm import BARE_ARM_PERSON

TABLE = Path(ep.__file__).parent / "person" / "data" / "bare_arm.csv"


def bare_arm_table():
    """Elevation, °, and contact force in percent of body weight in abduction and flexion, shape (k, 3)."""
    elevation = np.arange(0.0, 136.0, 15.0)
    person = ep.Person(*BARE_ARM_PERSON)
    columns = [elevation]
    for plane in ("abduction", "flexion"):
        angles = {"flexion": 0.0, "abduction": 0.0, "internal_rotation": 0.0} | {plane: elevation}
        found = person.joint_contact(ep.shoulder_rotation(**angles, degrees=True), outside="mark")
        columns.append(found.percent_body_weight)
    return np.column_stack(columns)


if __name__ == "__main__":
    np.savetxt(
        TABLE, bare_arm_table(), fmt="%.1f", delimiter=",", header="elevation_deg,abduction,flexion", comments=""
    )
