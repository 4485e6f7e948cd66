"""How light the start is: CPU time of fresh processes, as ratios to the import of the libraries they need.

Run ``python benchmarks/start.py``. Medians of interleaved pairs; the compiled cache is an empty folder or a filled one.
"""

from __future__ import annotations

import os
import resource
import statistics
import subprocess
import sys
import tempfile

PAIRS = 7
LIBRARIES = ["-c", "import pinocchio, numpy, scipy.spatial"]
FIRST = [
    "-c",
    "import exo_pin as ep; ep.load('prototype').reaction(ep.shoulder_rotation(60, 0, 0, degrees=True)).shoulder_force",
]
COMMAND = ["-m", "exo_pin.cli"]
CASES = {
    "first reaction": FIRST,
    "exo-pin reaction --flexion 60": [*COMMAND, "reaction", "prototype", "--flexion", "60"],
    "exo-pin --version": [*COMMAND, "--version"],
    "exo-pin --help": [*COMMAND, "--help"],
}


def cpu_time(arguments: list[str], cache: str) -> float:
    """User and system time of a Python process, s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    environment = {**os.environ, "NUMBA_CACHE_DIR": cache}
    subprocess.run([sys.executable, *arguments], env=environment, stdout=subprocess.DEVNULL, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    """Print a table."""
    with tempfile.TemporaryDirectory() as warm:
        subprocess.run([sys.executable, *COMMAND, "warm-up"], env={**os.environ, "NUMBA_CACHE_DIR": warm}, check=True)
        print(f"{'':32s}{'cache':>8s}{'CPU s':>10s}{'ratio':>8s}")
        for name, arguments in CASES.items():
            for cache in ("empty", "filled"):
                own, libraries = [], []
                for _ in range(PAIRS):
                    with tempfile.TemporaryDirectory() as cold:
                        own.append(cpu_time(arguments, warm if cache == "filled" else cold))
                    libraries.append(cpu_time(LIBRARIES, warm))
                ratio = statistics.median(a / b for a, b in zip(own, libraries, strict=True))
                print(f"{name:32s}{cache:>8s}{statistics.median(own):10.2f}{ratio:8.2f}")


if __name__ == "__main__":
    main()
