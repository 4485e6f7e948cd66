"""A pose update of the viewer on the Python side: forces asked, shapes placed, commands packed for the page.

    python benchmarks/view.py [--poses 200]

Beside it, in the same run, the same pose in a new scene, which is what a viewer does that sends everything again; and
how many commands and bytes go to the page. The bar is 10 ms an update. The human figure is drawn where it is installed.
"""

from __future__ import annotations

import argparse
import statistics
import time

import numpy as np
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.view import Scene

BAR = 10e-3


def updates(scene: Scene, poses: list[Rotation]) -> tuple[float, float, float]:
    """Median time of an update, s, and mean commands and bytes of one."""
    sent: list[bytes] = []
    publish = scene._stage._publish

    def counted(commands: list[bytes]) -> None:
        sent.extend(commands)
        publish(commands)

    scene.show(poses[0])
    scene._stage._publish = counted  # type: ignore[method-assign]
    times = []
    for pose in poses[1:]:
        start = time.perf_counter()
        scene.show(pose)
        times.append(time.perf_counter() - start)
    return statistics.median(times), len(sent) / len(times), sum(map(len, sent)) / len(times)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--poses", type=int, default=200)
    count = parser.parse_args().poses
    exo = ep.load("prototype").worn_by(ep.Arm.from_anthropometry(1.75, 75, "male"))
    turn = np.linspace(10.0, 100.0, count)
    poses = list(ep.shoulder_rotation(turn, 0.5 * turn, 0.2 * turn, degrees=True))
    print(f"{'':34} {'update, ms':>11} {'commands':>9} {'bytes':>8} {'new scene, ms':>14} {'bar, ms':>8}")
    for limbs in ("rods", "muscles"):
        for offset in (False, True):
            scene = Scene(exo, limbs=limbs)
            query = {"centre_offset": [0.0, 0.0, 0.01]} if offset else {}
            show = scene.show
            scene.show = lambda pose, show=show, query=query: show(pose, **query)  # type: ignore[method-assign]
            update, commands, size = updates(scene, poses)
            start = time.perf_counter()
            for pose in poses[:5]:
                Scene(exo, limbs=limbs).show(pose, **query)
            anew = (time.perf_counter() - start) / 5
            name = f"prototype, {limbs}{', 10 mm off' if offset else ''}"
            human = "" if scene.messages else ", person"
            print(
                f"{name + human:34} {1e3 * update:11.2f} {commands:9.0f} {size:8.0f} "
                f"{1e3 * anew:14.0f} {1e3 * BAR:8.0f}"
            )


if __name__ == "__main__":
    main()
