"""A device on MyoArm in MuJoCo, beside the plant: how far the arms are apart along a lift by 20° in 1 s.

    python benchmarks/on_person.py

The plant moves MyoArm's own arm, rigid and about a fixed centre, under the model-based controller; MuJoCo gets the
tensions of its drives at every step (of linear actuators where they stand, with spring and damper in series). With
scapula, elbow and wrist locked, and bones alone, both are the same machine; what is given back to the person then shows
what a plant without it leaves out. Numbers stand on docs/tutorials/hand_off.md.
"""

from __future__ import annotations

import sys
import tempfile
import warnings
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "oracles"))

from worn_on_person import Worn, angles_apart, law_of_drives

import exo_pin as ep
from exo_pin.person.on_person import LOCKS

#: Design, side, step in s, and how the person is written.
CASES: tuple[tuple[str, str, float, dict[str, Any]], ...] = (
    ("four-cables-worn", "right", 1e-3, {"locked": LOCKS, "bones_only": True}),
    ("four-cables-worn", "left", 1e-3, {"locked": LOCKS, "bones_only": True}),
    ("four-linear-actuators-worn", "right", 1e-4, {"locked": LOCKS, "bones_only": True}),
    ("four-cables-worn", "right", 1e-3, {"locked": ("elbow", "wrist"), "bones_only": True}),
    ("four-cables-worn", "right", 1e-3, {"locked": ("scapula", "wrist"), "bones_only": True}),
    ("four-cables-worn", "right", 1e-3, {"bones_only": True}),
    ("four-cables-worn", "right", 1e-3, {"locked": LOCKS}),
    ("four-cables-worn", "right", 1e-3, {}),
)


def main() -> None:
    """Print a row for each case."""
    warnings.simplefilter("ignore")
    print("| design, side, step | locked | person | most, after 0.1, 0.5 and 1 s, rad |")
    print("| --- | --- | --- | --- |")
    for name, side, step, person in CASES:
        exo = ep.load(name, side=side)
        with tempfile.TemporaryDirectory() as folder:
            written = exo.export_on_person(Path(folder, "worn.xml"), **person)
            own = exo.replace(**written.worn)
            apart = angles_apart(own, Worn(written[0], side), step, law_of_drives(own) if "linear" in name else None)
        within = [apart[: round(end / step) + 1].max() for end in (0.1, 0.5, 1.0)]
        who = "bones" if person.get("bones_only") else "muscles, damping"
        locked = ", ".join(person.get("locked", ())) or "nothing"
        print(
            f"| {name}, {side}, {1e3 * step:g} ms | {locked} | {who} | {', '.join(f'{x:.1g}' for x in within)} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
