"""The tables of docs/evidence/which_kind.md: every kind of device on one man, as ``exo-pin compare`` says it.

::

    python benchmarks/compare_devices.py              # print the tables; some minutes
    python benchmarks/compare_devices.py --docs docs  # write them into which_kind.md

The numbers are those of ``exo_pin.study.compare(..., detailed=True)``, with the elbow straight and bent; the page has
the commands that print and draw them.
"""

import argparse
import re
import warnings
from pathlib import Path

import numpy as np

import exo_pin as ep

ROOT = Path(__file__).parents[1]
MARKS = ("<!-- from benchmarks/compare_devices.py -->", "<!-- end -->")
MAN = {"height": 1.755, "mass": 85.0, "sex": "male"}
#: Of the grid over the thesis's box, degrees.
STEP = 20.0
#: Bend of the elbow in the second block of columns, degrees, and how their heads begin.
BEND, BENT = 90.0, "90°: "
#: Preset or file in ``urdf/``, and its kind.
DEVICES = {
    "prototype": "3UPU wrist + S, pneumatic muscles",
    "optimised-table-c-2": "3UPU wrist + S, Table C-2",
    "three-linear-actuators": "3SPS + S, found",
    "four-linear-actuators-worn": "4SPS + S, found",
    "four-cables": "four cables + S, found",
    "six-cables": "six cables + S, found",
    "spherical-3rrr": "spherical 3RRR",
    "3rps-passive-ball": "3RPS, sliding ball",
    "serial-y-x-z": "serial, Y-X-Z",
    "nesm": "serial, X-Y-Z",
    "spring-support": "passive spring",
}
#: Heads of the page's tables: the column, its factor and its digits.
HOLDING = {
    "held, %": ("holdable", 100.0, 0),
    "clear, %": ("clear", 100.0, 0),
    "held and clear, %": ("held_and_clear", 100.0, 0),
    "held after a failure, %": ("held_after_failure", 100.0, 0),
}
SHOULDER = {
    "median F_s, N": ("median_F_s_N", 1.0, 0),
    "peak F_s, N": ("peak_F_s_N", 1.0, 0),
    "median contact, N": ("contact_N", 1.0, 0),
    "peak contact, N": ("peak_contact_N", 1.0, 0),
    "relief, %": ("relief", 100.0, 0),
}
EFFORTS = {
    "effort, N": ("effort_N", 1.0, 0),
    "effort, N m": ("effort_Nm", 1.0, 0),
    "of its limit, %": ("effort_share", 100.0, 0),
}
FIT = {
    "reached, %": ("reach", 100.0, 0),
    "singular, %": ("singular", 100.0, 0),
    "median margin": ("median_margin", 1.0, 2),
    "undetermined": ("undetermined", 1.0, 0),
    "follows 10 mm, %": ("follows_10_mm", 100.0, 0),
    "change by 10 mm, N": ("change_by_10_mm_N", 1.0, 0),
    "on a soft cuff, N": ("change_on_cuff_N", 1.0, 0),
    "on the arm, kg": ("mass_on_arm_kg", 1.0, 2),
    "other links, kg": ("mass_of_links_kg", 1.0, 2),
    "stroke, mm": ("stroke_mm", 1.0, 0),
    "stroke, °": ("stroke_deg", 1.0, 0),
}
FIGURES = HOLDING | SHOULDER | EFFORTS | FIT
#: Heads of each table; those of all but the last come again with a bent elbow.
TABLES = (
    *((*heads, *(f"{BENT}{head}" for head in heads)) for heads in (HOLDING, SHOULDER, EFFORTS)),
    tuple(FIT),
)


def device(name):
    """A device on the man's arm, from the presets or from ``urdf/``."""
    source = name if name in ep.presets() else ROOT / "urdf" / f"{name}.urdf"
    return ep.load(source).worn_by(ep.Wearer(**MAN))


def compared(names, bend=0.0, progress=True):
    """The detailed comparison of devices by name, with an elbow bent by some degrees."""
    first, *others = map(device, names)
    man = ep.Wearer(**MAN, elbow_flexion=bend, degrees=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ep.OutsideHumanRange)
        return first.compare(*others, poses=ep.adl_box(STEP), person=man, detailed=True, progress=progress)


def texts(straight, bent):
    """Cells of the page by device and head."""
    found = {}
    for row, name in enumerate(map(str, straight["design"])):
        cells = found[name] = {}
        for table, begin, heads in ((straight, "", FIGURES), (bent, BENT, HOLDING | SHOULDER | EFFORTS)):
            for head, (column, factor, digits) in heads.items():
                value = factor * table[column][row]
                cells[f"{begin}{head}"] = "-" if np.isnan(value) else f"{value:.{digits}f}"
            if table["holdable"][row] > table["can_hold"][row]:
                cells[f"{begin}held, %"] += " at most"
    return found


def markdown(heads, found):
    """A table of the page; the first has the kinds, too."""
    first = heads is TABLES[0]
    titles = ["device", *(["kind"] if first else []), *heads]
    lines = [titles, ["---"] * len(titles)]
    for name, cells in found.items():
        kind = [DEVICES[name]] if first else []
        lines.append([f"`{name}`", *kind, *(cells[head] for head in heads)])
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def read(page):
    """Cells of a page by device and head: what :func:`markdown` wrote."""
    found = {name: {} for name in DEVICES}
    for heads in TABLES:
        _, _, rest = page.partition(f" | {' | '.join(heads)} |\n")
        for line in rest.split("\n\n")[0].splitlines()[1:]:
            name, *cells = re.split(r" \| ", line[2:-2])
            found[name.strip("`")] |= dict(zip(heads, cells[-len(heads) :], strict=True))
    return found


def main():
    """Print the tables, or write them into the page."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--docs", type=Path, help="folder of the documentation")
    options = parser.parse_args()
    found = texts(compared(DEVICES), compared(DEVICES, BEND))
    text = "\n\n".join(markdown(heads, found) for heads in TABLES)
    print(text)
    if options.docs is not None:
        page = options.docs / "evidence" / "which_kind.md"
        before, rest = page.read_text(encoding="utf-8").split(MARKS[0])
        page.write_text(f"{before}{MARKS[0]}\n\n{text}\n\n{MARKS[1]}{rest.split(MARKS[1])[1]}", encoding="utf-8")


if __name__ == "__main__":
    main()
