"""Forces along measured movements beside the best that any smoothing allows: docs/evidence/measured_data.md.

::

    python benchmarks/measured_motion.py            # both tables, about two minutes
    python benchmarks/measured_motion.py --seeds 20 # more cases a row
    python benchmarks/measured_motion.py --records 120  # how many doubtful records are named, about two minutes

A movement with known ω and η (turns by 26° at 0.6 Hz and by 21° at 0.4 Hz, three seconds) is sampled with white noise
about each axis. "Least" is the error of the smoothing parameter that is best for the true forces, which no method can
know. Half of the cases are evenly sampled; the others have jitter of a third of the spacing, 5 % of the samples missing
at random and a gap of 5 % of the time. The second table is of a reach from rest to rest, with ends="free" and "rest".
"""

import argparse
import sys
import warnings
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "oracles"))

NOISES, RATES = (0.01, 0.1, 0.3, 1.0), (50, 100, 200, 1000)


def main():
    """Print the table."""
    import measured_movements as measured

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=6, help="cases a row, half of them with uneven samples")
    parser.add_argument("--records", type=int, default=0, help="count cautions over so many drawn movements instead")
    options = parser.parse_args()
    if options.records:
        _records(options.records)
        return
    seeds = options.seeds
    exo = measured.exo()
    heads = "noise, °|rate, Hz|noise found, °|interpolated, N|smoothed, N|least, N|away from ends, N|least, N"
    print(f"| {heads.replace('|', ' | ')} |")
    print("| --- " * 8 + "|")
    everywhere, inside = [], []
    for noise in NOISES:
        for rate in RATES:
            cases = [
                measured.measured_case(exo, seed, rate, noise, uneven=seed % 2 == 1, pace=1.5) for seed in range(seeds)
            ]
            middle = [np.median([case[k] for case in cases]) for k in range(5)]
            found = np.degrees(np.median([case.movement.noise.found for case in cases]))
            everywhere += [case.smooth / case.least for case in cases]
            inside += [case.inside / case.least_inside for case in cases]
            rough = f"{middle[4]:,.0f}" if np.isfinite(middle[4]) else "refused"
            cells = [f"{noise:g}", str(rate), f"{found:.3g}", rough, *(f"{value:.2g}" for value in middle[:4])]
            print(f"| {' | '.join(cells)} |", flush=True)
    print(f"\n|F_s|, root mean square: {cases[0].size:.0f} N. Smoothed / least in {len(everywhere)} cases:")
    for name, ratios in (("all samples", everywhere), ("without end effects", inside)):
        print(f"{name}: median {np.median(ratios):.2f}, mean {np.mean(ratios):.2f}, largest {max(ratios):.2f}")
    _ends(measured, exo, seeds)


def _ends(measured, exo, seeds):
    """Print what knowledge of rest at the ends is worth."""
    heads = "noise, °|rate, Hz|free, N|rest, N|free, within 0.1 s of the ends, N|rest, there, N"
    print(f"\n| {heads.replace('|', ' | ')} |\n{'| --- ' * 6}|")
    for noise in NOISES:
        for rate in RATES:
            (free, near), (rest, there) = np.median(
                [measured.end_errors(exo, seed, rate, noise)[0] for seed in range(seeds)], axis=0
            )
            cells = [f"{noise:g}", str(rate), *(f"{value:.2g}" for value in (free, rest, near, there))]
            print(f"| {' | '.join(cells)} |", flush=True)


def _records(count):
    """Print in how many clean and doubtful records of drawn movements a caution is found, and what it is worth."""
    import doubtful_records
    import measured_movements as measured

    from exo_pin.load_case import Movement

    exo, found = measured.exo(), {}
    for seed in range(count):
        record = doubtful_records.Record(seed)
        size = np.linalg.norm(measured.forces(exo, record.poses, record.motion), axis=1)
        for clean, group in ((True, record.clean()), (False, record.doubtful(size))):
            for name, samples in group.items():
                movement = Movement.from_samples(*samples)
                peak = np.linalg.norm(measured.forces(exo, movement.poses, movement.motion), axis=1)
                trusted = peak[~movement.noise.end_effects]
                off = abs((trusted if trusted.size else peak).max() / size.max() - 1.0)
                found.setdefault((clean, name), []).append((bool(movement.cautions), off > 0.1))
    print("| record | named | peak off by more than 10 % | of these named |\n| --- | ---: | ---: | ---: |")
    for (_, name), pairs in found.items():
        named, wrong = np.array(pairs).T
        print(f"| {name} | {named.sum()} of {count} | {wrong.sum()} | {(named & wrong).sum()} |")


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    main()
