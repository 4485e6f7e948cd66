"""Cost of the daily box over persons and designs, and what a second worker gives.

``python benchmarks/population.py``
Two hundred persons and two designs, here, in a pool of two processes and on two workers of Dask; then fewer persons.
"""

import argparse
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context

import numpy as np

import exo_pin as ep
from exo_pin.workspace import population

DESIGNS = ("four-linear-actuators", "four-cables-worn")


@contextmanager
def dask(workers):
    """An executor of Dask with so many workers on this machine."""
    from distributed import Client, LocalCluster

    with (
        LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):
        yield client.get_executor()


def timed(persons, executor=None):
    """Seconds that so many persons take, and their table."""
    start = time.perf_counter()
    table = population(map(ep.load, DESIGNS), ep.Wearer.drawn(persons), executor=executor)
    return time.perf_counter() - start, table


def rows(persons) -> Iterator[tuple[str, int, float, float]]:
    """Where, persons, seconds, and times as fast as here."""
    timed(2)  # compiled before the clock runs
    alone, expected = timed(persons)
    yield "here", persons, alone, 1.0
    for name, pool in (("2 processes", ProcessPoolExecutor(2, get_context("spawn"))), ("Dask, 2 workers", dask(2))):
        with pool as executor:
            timed(4, executor)  # workers import and load compiled code
            took, table = timed(persons, executor)
        for column in table:
            np.testing.assert_array_equal(table[column], expected[column])
        yield name, persons, took, alone / took
    for fewer in (persons // 4, persons // 2):
        yield "here", fewer, timed(fewer)[0], float("nan")
    for design in DESIGNS:
        share = expected["index"][expected["design"] == design]
        print(f"{design}: {share.min():.1%} to {share.max():.1%} of the poses, half of the persons above "
              f"{np.median(share):.1%}")  # fmt: skip


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--persons", type=int, default=200)
    print("| where | persons | s | times as fast |\n| --- | --- | --- | --- |")
    for name, count, took, ratio in rows(parser.parse_args().persons):
        print(f"| {name} | {count} | {took:.2f} | {'' if np.isnan(ratio) else f'{ratio:.2f}'} |")
