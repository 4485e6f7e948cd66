"""Which processes a process has started, and which of them live."""

import time
from pathlib import Path


def children(pid):
    """Numbers of the processes that any thread of a process has started."""
    tasks = Path(f"/proc/{pid}/task").glob("*/children")
    return sorted(int(number) for task in tasks for number in task.read_text().split())


def lives(pid):
    """Whether a process works or waits."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def wait_until(condition, seconds=60.0):
    """Wait for what other processes do."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)
