"""A program that writes one kind of file again and again until it is killed; see test_killed_writers.

It reads the name of a writer and a folder from its input. At the first name it writes the two contents of that kind
into its own folder and prints how long one takes; with a folder it forks and prints the number of the process that
writes there.
"""

import itertools
import os
import sys
import time
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import muscle
from exo_pin.chain import write_closures
from exo_pin.core.files import write_columns, write_figure
from exo_pin.design import preset
from exo_pin.study import StudyTable
from exo_pin.view import ChainScene, SceneRecording
from exo_pin.wrist_chain import AssumedMasses, mechanism_urdf


def _figure(k):
    drawn = Figure()
    drawn.subplots().plot(np.random.default_rng(k).normal(size=100))
    return drawn


def _named(exo, k):
    return exo.replace(name="device", title=f"version {k}")


# Made by the program at its first write, so that the names below cost a test run nothing.
@cache
def _exos():
    return [_named(ep.load("prototype"), k) for k in range(2)]


@cache
def _chains():
    names = ("prototype", "optimised-table-5-3")
    return [ep.ClosedChain.from_urdf(*mechanism_urdf(preset(name), assumed=AssumedMasses())) for name in names]


@cache
def _scenes():
    return [ChainScene(chain) for chain in _chains()]


@cache
def _tables():
    return [StudyTable([{"a": k, "b": float(row)} for row in range(500)]) for k in range(2)]


@cache
def _answers():
    turn = Rotation.from_rotvec(np.linspace(0, 0.5, 20)[:, None] * [1, 0, 0])
    swing = ep.Movement.from_samples(np.linspace(0, 1, 20), turn)
    return [_exos()[0].follow(swing, load=ep.Load([0, 0, -k])) for k in range(2)]


@cache
def _figures():
    return [_figure(k) for k in range(2)]


@cache
def _recordings():
    return [SceneRecording(np.array([0.0, 1.0]), None, b"x" * 2000, {"k": k}) for k in range(2)]


@cache
def _same_name():
    return [ep.ClosedChain(chain.model, replace(chain.description, name="a")) for chain in _chains()]


@cache
def _muscles():
    return muscle.muscle_model("best"), muscle.dynamic_model("tang-3-31")


def _static(folder, k):
    muscle.save_parameters(_muscles()[0], folder / "a.toml", identification={"k": k})


def _dynamic(folder, k):
    muscle.save_dynamic(_muscles()[1], folder / "a.toml", identification={"k": k})


#: What is called with a folder and which of two contents to write; and the files that it makes.
WRITERS = {
    "design": (lambda folder, k: _exos()[k].save(folder / "a.toml"), ["a.toml"]),
    "urdf": (
        lambda folder, k: _exos()[k].to_urdf(folder),
        ["device.urdf", "device.closures.toml", "device.device.toml"],
    ),
    "closures": (lambda folder, k: write_closures(_chains()[k].description, folder / "a.toml"), ["a.toml"]),
    "sdf": (lambda folder, k: _same_name()[k].to_sdf(folder), ["a.sdf"]),
    "table": (lambda folder, k: _tables()[k].to_csv(folder / "a.csv"), ["a.csv", "a.json"]),
    "movement": (lambda folder, k: write_columns(folder / "a.csv", _answers()[k].columns()), ["a.csv"]),
    "arrays": (lambda folder, k: write_columns(folder / "a.npz", _answers()[k].columns()), ["a.npz"]),
    "page": (lambda folder, k: _scenes()[k].save_html(folder / "a.html"), ["a.html"]),
    "recording": (lambda folder, k: _recordings()[k].save(folder / "a.html"), ["a.html"]),
    "figure": (lambda folder, k: write_figure(folder / "a.png", _figures()[k]), ["a.png"]),
    "muscle": (_static, ["a.toml"]),
    "dynamic": (_dynamic, ["a.toml"]),
}


def main():
    """Serve lines "name" and "name folder" until the input ends."""
    reference = Path(sys.argv[1])
    for line in sys.stdin:
        name, *folder = line.split()
        write, _ = WRITERS[name]
        if not folder:
            for k in range(2):
                (reference / name / str(k)).mkdir(parents=True)
                begin = time.perf_counter()
                write(reference / name / str(k), k)
            print(time.perf_counter() - begin, flush=True)
            continue
        child = os.fork()
        if child == 0:
            for k in itertools.cycle(range(2)):
                write(Path(*folder), k)
        print(child, flush=True)
        os.waitpid(child, 0)
        print("gone", flush=True)


if __name__ == "__main__":
    main()
