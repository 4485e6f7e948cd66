"""A model-based controller in real time: asked over UDP by the plant in another process, at 100 and 500 Hz.

    python benchmarks/real_time.py [seconds]

The loop's time goes from the instant at which a sample is due until its commands are there: how late the plant's
process wakes, both messages, and the controller. An answer is missed after four fifths of the period. Each run is
compared with ``exo.track`` in one process. Beside it, in one process: the controller's call, and ``mj_step`` of the
same device in MuJoCo (``exo.export``). The design is ``four-cables``. Other programs on the machine show in the worst
times; ``chrt -f 50 python benchmarks/real_time.py`` gives these processes the priority of real time. The table stands
on docs/evidence/benchmarks.md.
"""

from __future__ import annotations

import gc
import multiprocessing
import os
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

import exo_pin as ep
from exo_pin import control

DESIGN, RATES = "four-cables", (100.0, 500.0)


def serve(rate: float, told: Any) -> None:
    """The controller's process; its address goes into a queue."""
    controller = control.ModelController(ep.Plant(ep.load(DESIGN)), control.flexion(), rate=rate)
    with control.ControllerServer(controller) as server:
        told.put(server.address)
        server.serve()


def row(what: str, times: Any, more: str = "") -> None:
    """Print p50, p99 and the worst of times in s."""
    p50, p99, worst = 1e3 * np.percentile(times, [50, 99, 100])
    print(f"| {what} | {p50:.2g} | {p99:.2g} | {worst:.2g} | {more} |", flush=True)


def loop(rate: float, seconds: float) -> None:
    """A row for the loop of real time."""
    context = multiprocessing.get_context("spawn")
    told = context.Queue()
    process = context.Process(target=serve, args=(rate, told), daemon=True)
    process.start()
    exo, address = ep.load(DESIGN), told.get()
    own = exo.track(control.flexion(), "model", duration=seconds, rate=rate).run
    with control.RemoteController(address) as remote:
        same = exo.track(control.flexion(), remote, duration=seconds, rate=rate).run
    with control.RemoteController(address, real_time=True) as remote:
        run = exo.track(control.flexion(), remote, duration=seconds, rate=rate).run
    process.terminate()
    process.join()
    apart = [float(np.degrees((own.rotations * each.rotations.inv()).magnitude().max())) for each in (same, run)]
    missed = f"{len(remote.missed)} of {len(remote.loop_times)} missed"
    said = f"{missed}; {apart[1]:.2g}° from `track`, {apart[0]:g}° without a clock"
    row(f"loop at {rate:.0f} Hz, {seconds:g} s", remote.loop_times, said)


def timed(calls: Callable[[], Any], count: int) -> list[float]:
    """Time of each of some calls, s, without garbage collection."""
    times = []
    gc.collect()
    gc.disable()
    for _ in range(count):
        begin = time.perf_counter()
        calls()
        times.append(time.perf_counter() - begin)
    gc.enable()
    return times


def alone(rate: float, seconds: float) -> None:
    """Rows of the controller's call and of MuJoCo's step."""
    exo, seen = ep.load(DESIGN), []
    controller = control.ModelController(ep.Plant(exo), control.flexion(), rate=rate)

    def listening(t: float, measured: Any) -> Any:
        seen.append((t, measured))
        return controller(t, measured)

    exo.track(control.flexion(), listening, duration=seconds, rate=rate)
    controller.reset()
    calls = iter(seen)
    row("the controller alone", timed(lambda: controller(*next(calls)), len(seen)))
    with tempfile.TemporaryDirectory() as folder:
        model = mujoco.MjModel.from_xml_path(str(exo.export(Path(folder, "robot.xml"))[0]))
    model.opt.timestep, data = 1.0 / rate, mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    row("MuJoCo's `mj_step`, 2 ms of the device", timed(lambda: mujoco.mj_step(model, data), len(seen)))


def main() -> None:
    """Print a row for each rate, and for what is compared."""
    warnings.simplefilter("ignore")
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 5.0
    print(f"exo_pin {ep.__version__}, MuJoCo {version('mujoco')}, Python {sys.version.split()[0]}; ", end="")
    print(f"{os.cpu_count()} cores, load before {os.getloadavg()[0]:.1f} (an idle machine has 0)\n")
    print("| | p50, ms | p99, ms | worst, ms | |")
    print("| --- | --- | --- | --- | --- |")
    for rate in RATES:
        loop(rate, seconds)
    alone(RATES[-1], seconds)


if __name__ == "__main__":
    main()
