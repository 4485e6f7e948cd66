"""Plant mistakes in muscle data, and see whether each is refused or named, with the planted cause first.

    python benchmarks/muscle_mistakes.py

25 mistakes, each in data drawn from 15 genuine sets: Tables 3-1 and 3-2 of the thesis, its 25 valid cells, laws of the
package with noise, and cylinders in a braid (Tondu and Lopez's form, with a tube that takes a pressure of its own) of 5
to 40 mm diameter. Each goes through both doors: a CSV file (``read_measurements``) and arrays (``identify_static``).
"""

import argparse
import csv
import re
import tempfile
from math import pi, radians, sin, tan
from pathlib import Path

import numpy as np

from exo_pin import ExoPinError
from exo_pin.muscle import identify_static, muscle_model, read_measurements, steady_states

HEADER = ("contraction_mm", "pressure_bar", "force_N")
#: Cautions that are true of genuine data.
TRUE = ("cannot distinguish", "beyond the capability")


def braid(rng, length, diameter, angle, k, tube, top, count):
    """States of a cylinder in a braid, in mm, bar and N; the tube takes a pressure of its own."""
    a, b = 3.0 / tan(radians(angle)) ** 2, 1.0 / sin(radians(angle)) ** 2
    area, states = pi / 4.0 * diameter**2, []
    while len(states) < count:
        strain, bar = rng.uniform(0.0, 0.22), rng.uniform(0.3 * top, top)
        force = 1e5 * area * ((bar - tube) * (a * (1.0 - k * strain) ** 2 - b) - 0.4 * tube * a * strain)
        if force > 0.02 * 1e5 * area * top * (a - b):
            states.append((1e3 * length * strain, bar, force))
    states = np.array(states)
    states[:, 2] += rng.normal(0.0, 0.006 * states[:, 2].max(), count)
    return np.round(states, (2)), length, diameter


def genuine(rng):
    """Name, states (mm, bar, N), nominal length (m) and diameter (m) of each set."""
    sets = []
    for name, valid in (("Tables 3-1 and 3-2", False), ("25 valid cells", True)):
        s = steady_states(valid_only=valid)
        sets.append((name, np.column_stack([1e3 * s.contraction, 1e-5 * s.pressure, s.force]), 0.3, 0.006))
    for name in ("best", "tang-optimised", "tang-relaxation"):
        law = muscle_model(name)
        x = rng.uniform(*law.validity.strain, 200) * law.length
        p = rng.uniform(*law.validity.pressure, 200)
        f = law.unchecked_force(x, p)
        states = np.column_stack([1e3 * x, 1e-5 * p, f + rng.normal(0.0, 0.3, 200)])[f > 1.0][:40]
        sets.append((f"law {name}", np.round(states, 2), law.length, 0.006))
    for length, diameter, angle, k, tube, top, count in (
        (0.15, 0.006, 24, 1.10, 0.6, 4.0, 20),
        (0.25, 0.010, 26, 1.15, 0.5, 6.0, 30),
        (0.25, 0.010, 23, 1.00, 0.2, 8.0, 60),
        (0.30, 0.020, 25, 1.20, 0.3, 6.0, 40),
        (0.20, 0.020, 28, 1.05, 0.4, 5.0, 25),
        (0.50, 0.020, 22, 1.10, 0.3, 6.0, 50),
        (0.40, 0.040, 24, 1.15, 0.2, 6.0, 40),
        (0.10, 0.005, 25, 1.10, 0.8, 6.0, 30),
        (0.60, 0.010, 24, 1.10, 0.5, 5.0, 40),
        (0.35, 0.015, 30, 1.00, 0.1, 3.0, 18),
    ):
        states, length, diameter = braid(rng, length, diameter, angle, k, tube, top, count)
        sets.append((f"braid {1e3 * diameter:.0f} x {1e3 * length:.0f} mm", states, length, diameter))
    return sets


def unit(column, factor, shift=0.0):
    """Numbers of a column in another unit."""

    def planted(states, length, row):
        out = states.copy()
        out[:, column] = out[:, column] * factor + shift
        return out, length

    return planted


def cell(column, factor):
    """One number with a slip in it."""

    def planted(states, length, row):
        out = states.copy()
        out[row, column] *= factor
        return out, length

    return planted


def columns(*order):
    """Swapped columns under the same header."""
    return lambda states, length, row: (states[:, order], length)


def sorted_alone(states, length, row):
    """A column that was sorted by itself."""
    out = states.copy()
    out[:, 2] = np.sort(out[:, 2])
    return out, length


#: What is planted, how, whether the diameter is given, and what the first suggestion has to say.
MISTAKES = [
    ("pressure in psi", unit(1, 14.503774), False, "pressure looks like psi:"),
    ("pressure in MPa", unit(1, 0.1), False, "pressure looks like MPa:"),
    ("pressure in kPa", unit(1, 100.0), False, "pressure looks like kPa:"),
    ("pressure in Pa", unit(1, 1e5), False, "pressure looks like Pa:"),
    ("pressure in mbar", unit(1, 1e3), False, "pressure looks like mbar:"),
    ("pressure absolute, bar", unit(1, 1.0, 1.01325), False, "pressure looks like bar absolute"),
    ("pressure absolute, kPa", unit(1, 100.0, 101.325), False, "pressure looks like kPa"),
    ("suction positive", unit(1, -1.0), False, "pressure has the other sign"),
    ("contraction in percent", None, False, "contraction looks like percent"),
    ("contraction as strain", None, False, "contraction looks like strain"),
    ("contraction in m", unit(0, 1e-3), False, "contraction looks like m:"),
    ("length for contraction", None, False, "looks like length in mm"),
    ("negative contraction", unit(0, -1.0), False, "contraction has the other sign"),
    ("nominal length in cm", lambda s, length, row: (s, length / 10.0), False, "nominal length looks like"),
    ("force in kgf", unit(2, 1 / 9.80665), False, "force looks like kgf"),
    ("force in kgf, diameter given", unit(2, 1 / 9.80665), True, "force looks like kgf"),
    ("force in grams, diameter given", unit(2, 1000 / 9.80665), True, "force looks like gf"),
    ("pull negative", unit(2, -1.0), False, "force has the other sign"),
    ("pressure and force swapped", columns(0, 2, 1), False, "pressure and force look swapped"),
    ("contraction and pressure swapped", columns(1, 0, 2), False, "contraction and pressure look swapped"),
    ("one force times 10", cell(2, 10.0), False, "row"),
    ("one force halved", cell(2, 0.5), False, "row"),
    ("one pressure times 10", cell(1, 10.0), False, "row"),
    ("one contraction times 1000", cell(0, 1000.0), False, "row"),
    ("one column sorted alone", sorted_alone, False, "row by row"),
]


def plant(place, states, length, row):
    """The states with a mistake, and the nominal length that is given."""
    name, how, *_ = MISTAKES[place]
    if how is not None:
        return how(states, length, row)
    out = states.copy()
    if name.startswith("length"):
        out[:, 0] = 1e3 * length - out[:, 0]
    else:
        out[:, 0] /= 1e3 * length / (100.0 if "percent" in name else 1.0)
    return out, length


def through_file(states, length, diameter, folder):
    """What the file's door says: an error, or the cautions."""
    path = folder / "muscle.csv"
    with path.open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(HEADER)
        writer.writerows([f"{value:.9g}" for value in row] for row in states)
    try:
        data = read_measurements(path, length, diameter)
        fit = identify_static(
            data.contraction,
            data.pressure,
            data.force,
            length,
            select="region",
            diameter=diameter,
            written=data.written,
        )
    except ExoPinError as error:
        return "refused", [str(error)]
    return "cautions", [text for text in fit.cautions if not any(true in text for true in TRUE)]


def through_arrays(states, length, diameter):
    """What the door of arrays says."""
    x, p, f = states.T * [[1e-3], [1e5], [1.0]]
    try:
        fit = identify_static(x, p, f, length, select="region", diameter=diameter)
    except ExoPinError as error:
        return "refused", [str(error)]
    return "cautions", [text for text in fit.cautions if not any(true in text for true in TRUE)]


def first(texts):
    """The first suggestion."""
    text = texts[0] if texts else ""
    return re.split(r"; or ", text)[0]


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=50)
    parser.add_argument("--all", action="store_true", help="each mistake in each genuine set")
    given = parser.parse_args()
    rng = np.random.default_rng(given.seed)
    sets = genuine(rng)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        alarms = []
        for title, states, length, diameter in sets:
            for width in (None, diameter):
                doors = through_file(states, length, width, folder), through_arrays(states, length, width)
                alarms += [(title, width, door) for door in doors if door[1]]
        said, hits, lines = 0, 0, []
        tried = 0
        for place, (mistake, _, with_diameter, cause) in enumerate(MISTAKES):
            chosen = range(len(sets)) if given.all else [int(rng.integers(len(sets)))]
            for which in chosen:
                title, states, length, diameter = sets[which]
                row = int(rng.integers(len(states)))
                wrong, claimed = plant(place, states, length, row)
                width = diameter if with_diameter else None
                doors = through_file(wrong, claimed, width, folder), through_arrays(wrong, claimed, width)
                named = all(door[1] for door in doors)
                expected = rf"easurement {row + 1} " if cause == "row" else re.escape(cause)
                hit = bool(re.search(expected, first(doors[0][1])))
                tried, said, hits = tried + 1, said + named, hits + hit
                lines.append((mistake, title, doors[0][0] if doors[0][1] else "passes", hit, first(doors[0][1])))
    print("| planted | in | what happens | planted cause first |")
    print("| --- | --- | --- | --- |")
    for mistake, title, happens, hit, text in lines:
        print(f"| {mistake} | {title} | {happens} | {'yes' if hit else 'no: ' + text[-90:]} |")
    print(f"\n{said} of {tried} refused or named at both doors; planted cause first in {hits} of {tried}")
    print(f"{len(sets)} genuine sets, with and without diameter, at both doors: {len(alarms)} false alarms")
    for alarm in alarms:
        print(alarm)


if __name__ == "__main__":
    main()
