"""Time of a pose of devices that are not wrists, over that of a wrist of four limbs in the same run.

::

    python benchmarks/device_postures.py
    python benchmarks/device_postures.py --postures   # the postures alone, without forces

Stacks are a grid of 5° over the thesis's box, a record of 100 Hz and scattered poses of that box. CPU time, one thread.
"""

import argparse
import time
from pathlib import Path

import numpy as np

import exo_pin as ep
from exo_pin.device.postures import configurations_of

ROOT = Path(__file__).parents[1]
#: Devices, and the most that a pose may take on a grid or record, in poses of the wrist; a scattered one may take 20.
DEVICES = {"serial-y-x-z": 6.0, "nesm": 6.0, "spherical-3rrr": 6.0, "3rps-passive-ball": 10.0}
WRIST = "four-cables"


def stacks(exo):
    """Poses by the name of the stack."""
    grid = np.meshgrid(np.arange(0.0, 111.0, 5.0), np.arange(0.0, 96.0, 5.0), np.arange(-20.0, 81.0, 25.0))
    t = np.arange(0.0, 10.0, 0.01)
    record = 50.0 - 45.0 * np.cos(1.3 * t), 40.0 - 35.0 * np.cos(0.9 * t), 20.0 * np.sin(0.7 * t)
    rng = np.random.default_rng(0)
    scattered = rng.uniform(0.0, 110.0, 1000), rng.uniform(0.0, 96.0, 1000), rng.uniform(-20.0, 80.0, 1000)
    angles = {"grid of 5°": [part.ravel() for part in grid], "record of 100 Hz": record, "scattered": scattered}
    return {name: exo.pose(*values) for name, values in angles.items()}


def time_a_pose(ask, poses, repeats=3):
    """CPU time, s, the best of some."""
    ask(poses[:300])
    best = np.inf
    for _ in range(repeats):
        start = time.process_time()
        ask(poses)
        best = min(best, time.process_time() - start)
    return best / len(poses)


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--postures", action="store_true", help="the postures alone")
    alone = parser.parse_args().postures
    wrist = ep.load(WRIST)
    unit = {name: time_a_pose(wrist.reaction, poses) for name, poses in stacks(wrist).items()}
    print(f"{WRIST}: " + ", ".join(f"{name} {1e6 * value:.1f} µs" for name, value in unit.items()))
    for device, most in DEVICES.items():
        exo = ep.load(ROOT / "urdf" / f"{device}.urdf")

        def postures(poses, device=exo.device):
            return configurations_of(device, poses)

        ask = postures if alone else exo.reaction
        for name, poses in stacks(exo).items():
            taken = time_a_pose(ask, poses)
            bar = 20.0 if name == "scattered" else most
            print(f"{device}, {name}: {1e6 * taken:.0f} µs, {taken / unit[name]:.1f} x (bar {bar:.0f} x)")


if __name__ == "__main__":
    main()
