"""Mistakes planted in records of movement, and genuine records: counts stand in docs/evidence/hard_to_break.md.

::

    python benchmarks/planted_mistakes.py          # reading alone, seconds
    python benchmarks/planted_mistakes.py --doors  # every door that takes a record, five minutes
    python benchmarks/planted_mistakes.py --all    # each mistake in 16 drawn raises, a minute

Each mistake is planted in a generated record of a known movement. It counts as named where an error or a caution names
the planted cause before any other. Genuine records are the same movements, and those that look least like a raise, in
every format; a caution or an error is a false alarm.
"""

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "oracles"))


def main():
    """Print the tables."""
    import planted_records as planted

    import exo_pin as ep

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--doors", action="store_true", help="ask every door, not the reader alone")
    parser.add_argument("--all", action="store_true", help="each mistake in 16 drawn raises")
    options = parser.parse_args()
    planted.DRAWN = options.all
    print(
        "| mistake | records | refused | not refused | named first |"
        + (" doors that name it |" if options.doors else "")
    )
    print("| --- | ---: | ---: | ---: | ---: |" + (" ---: |" if options.doors else ""))
    total = np.zeros(6, dtype=int)
    for mistake, chosen in planted.MISTAKES:
        seeds = range(16) if options.all else chosen
        counts = np.zeros(6, dtype=int)
        for seed in seeds:
            with tempfile.TemporaryDirectory() as folder:
                path, given, word = mistake(Path(folder), seed)
                side = planted.side_of(seed)
                refused = _is_refused(ep, path, side, given)
                asked = planted.doors(path, side, given)
                names = list(asked) if options.doors else ["read_movement"]
                named = [planted.is_named(planted.answer(asked[name]), word) for name in names]
                counts += [1, refused, not refused, named[0], sum(named), len(named)]
        total += counts
        _row(mistake.__name__.replace("_", " "), counts, options.doors)
    _row("all", total, options.doors)
    if options.all:
        return
    alarms, count = _genuine(ep)
    print(f"\ngenuine records: {count}, false alarms: {alarms}")


def _row(name, counts, doors):
    cells = [name, *map(str, counts[:4])] + ([f"{counts[4]} of {counts[5]}"] if doors else [])
    print(f"| {' | '.join(cells)} |", flush=True)


def _is_refused(ep, path, side, given):
    try:
        ep.read_movement(path, side, reading=ep.RecordingOptions(**given))
    except ep.FileFormatError:
        return True
    return False


def _genuine(ep):
    import foreign_records as foreign

    alarms, count = 0, 0
    for side in ("left", "right"):
        truths = [foreign.movement(seed, side) for seed in range(3)]
        pairs = [(writer, truth) for writer in foreign.WRITERS.values() for truth in truths]
        plain = (foreign.clinical, foreign.quaternions, foreign.thesis, foreign.isb, foreign.mvnx)
        pairs += [(writer, truth) for writer in plain for truth in foreign.special_movements(side).values()]
        for writer, truth in pairs:
            with tempfile.TemporaryDirectory() as folder:
                path, given = writer(Path(folder), truth)
                count += 1
                try:
                    alarms += bool(ep.read_movement(path, side, reading=ep.RecordingOptions(**given)).cautions)
                except ep.FileFormatError:
                    alarms += 1
    return alarms, count


if __name__ == "__main__":
    main()
