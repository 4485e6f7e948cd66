"""The same numbers, bit for bit, wherever they are computed: here, in processes, on workers of Dask."""

import os
import pickle
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import InvalidInput, MissingData
from exo_pin.workspace import CRITERIA, Criterion, population

WEARERS = [ep.Wearer(1.525, 51, "female"), ep.Wearer(1.626, 67, "female"), ep.Wearer(1.87, 111, "male")]
LIMITS = ep.Criteria(largest_shoulder_force=150.0)


def designs():
    return [ep.load("four-linear-actuators"), ep.load("four-cables-worn")]


def assert_same(one, other):
    assert list(one) == list(other)
    for name in one:
        np.testing.assert_array_equal(one[name], other[name])


@pytest.fixture(scope="module")
def here():
    return population(designs(), WEARERS, 12.0, LIMITS)


def test_threads_and_blocks(here):
    with ThreadPoolExecutor(2) as pool:
        assert_same(population(designs(), WEARERS, 12.0, LIMITS, executor=pool), here)


@pytest.mark.full
def test_processes(here):
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        assert_same(population(designs(), WEARERS, 12.0, LIMITS, executor=pool), here)
        with pytest.raises(MissingData, match="largest_shoulder_force"):
            population(designs(), WEARERS, 12.0, ["shoulder_force"], executor=pool)


@pytest.mark.full
def test_dask(here):
    distributed = pytest.importorskip("distributed")
    exo, person = ep.load("four-linear-actuators"), ep.Person(1.75, 75, "male")
    poses = exo.pose(np.linspace(0.0, 100.0, 40), 20.0)
    alone = exo.joint_contact(poses, person, outside="mark")
    finer = population(designs(), WEARERS, 6.0, LIMITS)
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        pool = client.get_executor()
        assert_same(population(designs(), WEARERS, 12.0, LIMITS, executor=pool), here)
        sent = exo.joint_contact(poses, person, outside="mark", executor=pool)
        parameters = {"cuff_height_mm": [180.0, 200.0, 220.0]}
        grid = ep.adl_box(50.0)
        assert_same(ep.sweep(exo, parameters, grid, executor=pool), ep.sweep(exo, parameters, grid))
        # A worker that dies takes its tasks with it, and Dask repeats them elsewhere.
        workers = sorted(client.scheduler_info()["workers"])
        client.submit(os._exit, 1, workers=workers[:1], pure=False)
        assert_same(population(designs(), WEARERS, 6.0, LIMITS, executor=pool), finer)
        assert workers[0] not in client.scheduler_info()["workers"]
    for name in ("force", "activations", "muscle_forces", "status"):
        np.testing.assert_array_equal(getattr(sent, name), getattr(alone, name))
    assert pickle.dumps(sent.force) == pickle.dumps(alone.force)


def test_what_cannot_be_sent_to_another_process_is_said():
    exo = ep.load("four-cables")
    local = type("Local", (), {"force_limits": staticmethod(lambda length: (0.0 * length, 400.0 + 0.0 * length))})()
    with ThreadPoolExecutor(1) as pool, pytest.raises(InvalidInput, match="another process can be sent"):
        ep.sweep(exo, {"cuff_height_mm": [180, 185]}, exo.pose([0, 30]), executor=pool, limits=local)
    stroke, mine = CRITERIA["stroke"], Criterion("stroke", "m", "mine", "#117733", np.max, 0.05)
    assert pickle.loads(pickle.dumps(stroke)) is stroke
    assert pickle.loads(pickle.dumps(mine)) == mine


class LosesTheLast(ThreadPoolExecutor):
    """An executor whose map drops its last block, as a queue that is closed too early does."""

    def map(self, function, *blocks, **options):
        return list(super().map(function, *blocks, **options))[:-1]


def test_an_executor_that_loses_results_is_refused():
    exo = ep.load("four-cables")
    with LosesTheLast(2) as pool:
        with pytest.raises(InvalidInput, match=r"each of 3 persons, got 2"):
            population([exo], WEARERS, 40.0, LIMITS, executor=pool)
        with pytest.raises(InvalidInput, match=r"each of 5 designs, got 4"):
            ep.sweep(exo, {"cuff_height_mm": [180, 185, 190, 195, 200]}, exo.pose([0, 30]), executor=pool)
