"""How many good measurements the region of a muscle law loses, over 300 generated sets and the thesis's tables.

    python benchmarks/muscle_regions.py

A set is 20, 40 or 80 states of a muscle at rest (a law of the package, contraction 0 to 25 %, 1.5 to 4 bar, noise of
0.1 to 0.6 N). In half of the sets the braid carries a part of the weight below a contraction of 8 to 20 mm, with 10
to 40 N/mm: those states are bad, the others good. A bad state counts as kept if it lies more than five deviations
off the law.
"""

import argparse

import numpy as np

from exo_pin.muscle import find_region, identify_static, muscle_model, steady_states

LAWS = ("tang-optimised", "tang-3-25", "fitted-second-order")


def generated(rng, count, braid):
    """Contraction, pressure and force of a set, which states are good, and how far each is off the law in noises."""
    law, noise = muscle_model(LAWS[rng.integers(len(LAWS))]), rng.uniform(0.1, 0.6)
    x, p = np.empty(0), np.empty(0)
    while len(x) < count:
        more, air = rng.uniform(0.0, 0.075, count), rng.uniform(1.5e5, 4e5, count)
        pulls = law.unchecked_force(more, air) > 0.0
        x, p = np.append(x, more[pulls])[:count], np.append(p, air[pulls])[:count]
    edge = rng.uniform(0.008, 0.020) if braid else -1.0
    excess = rng.uniform(1e4, 4e4) * np.maximum(0.0, edge - x)
    force = law.unchecked_force(x, p) + excess + rng.normal(0.0, noise, count)
    return (x, p, force), x >= edge, excess / noise


def judged(sets, seed):
    """Rows of the table: counts by number of states and regimes."""
    rng = np.random.default_rng(seed)
    rows = []
    for braid in (False, True):
        for count in (20, 40, 80):
            lost = good = kept = bad = whole = again = 0
            for _ in range(sets // 6):
                columns, fine, off = generated(rng, count, braid)
                region = find_region(*columns, 0.3)
                selected = region.selected
                lost, good = lost + int((fine & ~selected).sum()), good + int(fine.sum())
                kept, bad = kept + int((selected & (off > 5.0)).sum()), bad + int((off > 5.0).sum())
                whole += int(selected[fine].all())
                inner = tuple(column[selected] for column in columns)
                again += int(find_region(*inner, 0.3).selected.all())
            rows.append((braid, count, sets // 6, good, lost, bad, kept, whole, again))
    return rows


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", type=int, default=300)
    parser.add_argument("--seed", type=int, default=50)
    given = parser.parse_args()
    print("| regimes | states | sets | good states | lost | bad states | kept | nothing lost | found again |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    rows = judged(given.sets, given.seed)
    for braid, count, sets, good, lost, bad, kept, whole, again in rows:
        print(f"| {1 + braid} | {count} | {sets} | {good} | {lost} | {bad} | {kept} | {whole} | {again} |")
    good, lost = sum(row[3] for row in rows), sum(row[4] for row in rows)
    print(f"\nlost {lost} of {good} good states, {100 * lost / good:.2f} %")
    cells, tables = steady_states(valid_only=True), steady_states()
    found = find_region(cells.contraction, cells.pressure, cells.force, 0.3).selected
    print(f"the thesis's valid cells alone: {int(found.sum())} of {len(found)} kept")
    both = find_region(tables.contraction, tables.pressure, tables.force, 0.3).selected
    fit = identify_static(tables.contraction, tables.pressure, tables.force, 0.3, select="region")
    valid = int((both & tables.called_valid).sum())
    rms = f"rms {fit.rms:.2f} N"
    print(f"all {len(both)} cells of Tables 3-1 and 3-2: {int(both.sum())} kept, with {valid} valid ones; {rms}")


if __name__ == "__main__":
    main()
