"""Print the contact force of a bare arm over the elevation: the table of docs/evidence/wearer_measured.md.

    python docs/scripts/literature_table.py

Columns: elevation, °; contact force and shear in abduction, with 2 kg in the hand; the same in flexion. Needs the extra
``person``.
"""

import sys

import numpy as np

import exo_pin as ep

ELEVATIONS = np.arange(30.0, 121.0, 30.0)


def literature_table(person):
    """Shape (4, 7); NaN where the muscles hold no such load."""
    columns = [ELEVATIONS]
    for plane in ("abduction", "flexion"):
        angles = {"flexion": 0.0, "abduction": 0.0, "internal_rotation": 0.0} | {plane: ELEVATIONS}
        poses = ep.shoulder_rotation(**angles, side=person.side, degrees=True)
        bare, loaded = (
            person.with_changes(payload=payload).joint_contact(poses, outside="mark") for payload in (0.0, 2.0)
        )
        columns += [bare.percent_body_weight, 100.0 * bare.shear / bare.body_weight, loaded.percent_body_weight]
    return np.column_stack(columns)


if __name__ == "__main__":
    rows = literature_table(ep.Person(1.75, 75.0, "male"))
    sys.stdout.writelines(f"| {row[0]:.0f}° | {' | '.join(f'{value:.0f}' for value in row[1:])} |\n" for row in rows)
