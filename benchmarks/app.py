"""Answers of the page while an arm moves: processor time, and how many come in a second (python benchmarks/app.py).

A question is asked 90 times a second, more often than by a slider; the newest is answered and drawn. On a machine that
does nothing else the two columns agree; else the first tells what one core could do.
"""

import sys
import time
import warnings
from dataclasses import replace
from threading import Event

import numpy as np

from exo_pin.app.asked import Asked
from exo_pin.app.following import Following

DESIGNS = ("four-linear-actuators-worn", "four-cables", "prototype", "urdf/spring-support.urdf")


def rates(design, seconds=5.0):
    """Answers in a second of processor time, and in a second."""
    rests, shown = Event(), []
    following = Following(lambda _, answer: (shown.append(answer), answer.moving or rests.set()), lambda *_: None)
    asked = Asked(design)
    following.ask(asked)
    rests.wait()
    shown.clear()
    begins, spent = time.perf_counter(), time.process_time()
    while (now := time.perf_counter() - begins) < seconds:
        following.ask(replace(asked, flexion=60.0 + 30.0 * np.sin(now)))
        time.sleep(1.0 / 90.0)
    spent = time.process_time() - spent
    following.close(wait=True)
    return len(shown) / spent, len(shown) / seconds


def main():
    """Print a table."""
    warnings.simplefilter("ignore")
    print("| device | answers a second of one core | answers a second |\n| --- | --- | --- |")
    for design in sys.argv[1:] or DESIGNS:
        of_core, of_time = rates(design)
        print(f"| {design} | {of_core:.0f} | {of_time:.0f} |", flush=True)


if __name__ == "__main__":
    main()
