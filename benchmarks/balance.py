"""Poses that random devices with idle freedoms are said to hold: are their efforts in balance, by own virtual work.

::

    python benchmarks/balance.py [--devices 400]

Devices and virtual work are those of tests/oracles/idle_devices.py, which ask the package for no force: 0 to 3 idle
freedoms, hinges in series, limbs between balls, rings that slip, slides that are driven, braked or held by nobody.
"""

import argparse
import sys
import warnings
from collections import Counter
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import exo_pin as ep

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "oracles"))
from idle_devices import VirtualWork, random_device

#: Miss of a row of virtual work, over the largest load, that is rounding; moment of the wearer, N m, that is none.
BALANCED, NO_MOMENT = 1e-8, 1e-6


def counted(seed, found):
    """Count three poses of one device."""
    device, _ = random_device(seed)
    exo = ep.ShoulderExo.from_device(device)
    poses = Rotation.from_rotvec(np.random.default_rng(1000 + seed).uniform(-0.8, 0.8, (3, 3)))
    answer, n = exo.reaction(poses), len(device.efforts)
    for k, q in enumerate(exo.configurations(poses)):
        if not np.isfinite(q).all():
            found["out of reach"] += 1
            continue
        work, f = VirtualWork(device, q), answer.actuator_forces[k]
        least = work.least_moment()
        found["poses"] += 1
        found["held"] += bool(answer.held[k])
        found["held, out of balance"] += bool(answer.held[k]) and not work.residual(f[:n], np.zeros(3)) < BALANCED
        found["without equilibrium"] += least is None
        found["without equilibrium, not said"] += (least is None) != (answer.equilibrium_status[k] == "no_equilibrium")
        helped = least is not None and np.abs(least).max() > NO_MOMENT
        found["with a moment of the wearer"] += helped
        found["with a moment of the wearer, held"] += helped and bool(answer.held[k])


def main():
    """Print the counts."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--devices", type=int, default=400)
    found = Counter()
    warnings.simplefilter("ignore", ep.OutsideHumanRange)
    for seed in range(parser.parse_args().devices):
        counted(seed, found)
    print("; ".join(f"{name} {count}" for name, count in found.items()))
    sys.exit(any(found[name] for name in found if ", " in name))


if __name__ == "__main__":
    main()
