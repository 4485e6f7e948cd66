"""Make the table of :mod:`exo_pin.design.body_dimensions` from the public tables of ANSUR II.

    python benchmarks/anthropometry.py ANSUR_II_MALE_Public.csv ANSUR_II_FEMALE_Public.csv

The two files are published by the Open Design Lab of Penn State and others; they are not part of this package.
"""

import csv
import sys

import numpy as np

#: Our name of a dimension and the column of the tables, mm.
DIMENSIONS = {
    "upper arm girth": "bicepscircumferenceflexed",
    "forearm girth": "forearmcircumferenceflexed",
    "neck girth": "neckcircumference",
    "head girth": "headcircumference",
    "chest breadth": "chestbreadth",
    "chest depth": "chestdepth",
    "waist breadth": "waistbreadth",
    "waist depth": "waistdepth",
    "sitting height": "sittingheight",
}


def columns(path):
    """Values by name of a column, in small letters."""
    with open(path, encoding="latin-1", newline="") as file:
        rows = list(csv.DictReader(file))
    return {name.lower(): [row[name] for row in rows] for name in rows[0]}


def main(paths):
    """Print the table of both sexes."""
    for sex, path in zip(("male", "female"), paths, strict=True):
        table = columns(path)
        stature, mass = 1e-3 * np.array(table["stature"], float), 0.1 * np.array(table["weightkg"], float)
        known = np.stack([np.ones(len(mass)), np.log(stature), np.log(mass)], axis=1)
        print(f'"{sex}": {{  # {len(mass)} persons')
        for name, column in DIMENSIONS.items():
            size = np.log(1e-3 * np.array(table[column], float))
            fit = np.linalg.lstsq(known, size, rcond=None)[0]
            spread = np.std(size - known @ fit)
            print(
                f'    "{name}": _Dimension({np.exp(fit[0]):.4f}, {fit[1]:.3f}, {fit[2]:.3f}),  # persons ± {spread:.3f}'
            )
        tall, heavy = np.percentile(stature, [5, 50, 95]), np.percentile(mass, [5, 50, 95])
        together = np.corrcoef(stature, np.log(mass))[0, 1]
        print(f"}}  # stature {tall} m, mass {heavy} kg at 5, 50, 95 %; stature with ln(mass): {together:.3f}")


if __name__ == "__main__":
    main(sys.argv[1:])
