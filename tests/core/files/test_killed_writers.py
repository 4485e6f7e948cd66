"""Writers that are killed at any moment leave the old file or the new one."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from writer_loop import WRITERS


@pytest.fixture(scope="module")
def loop(tmp_path_factory):
    """The program that writes, the folder for both contents of every file, and how long each takes."""
    reference = tmp_path_factory.mktemp("reference")
    script = str(Path(__file__).parents[2] / "oracles" / "writer_loop.py")
    with subprocess.Popen(
        [sys.executable, script, str(reference)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as program:
        yield program, reference, {}
        program.stdin.close()


def killed(program, name, folder, number, delay):
    """Let a writer write for a while, then kill it."""
    program.stdin.write(f"{name} {folder}\n")
    program.stdin.flush()
    child = int(program.stdout.readline())
    time.sleep(delay)
    os.kill(child, number)
    assert program.stdout.readline() == "gone\n"


def check(loop, folder, name, number, count):
    program, reference, seconds = loop
    rng = np.random.default_rng(sum(map(ord, name)))
    files = WRITERS[name][1]
    if name not in seconds:
        program.stdin.write(f"{name}\n")
        program.stdin.flush()
        seconds[name] = float(program.stdout.readline())
    contents = {file: [(reference / name / k / file).read_bytes() for k in "01"] for file in files}
    assert contents[files[0]][0] != contents[files[0]][1]
    for file in files:
        shutil.copy(reference / name / "0" / file, folder)
    for delay in rng.uniform(0.0, 3.0 * seconds[name] + 0.005, count):
        killed(program, name, folder, number, delay)
        for file in files:
            assert (folder / file).read_bytes() in contents[file]
        left = [path for path in folder.iterdir() if path.name not in files]
        # A kill may leave something, under a name that says what it is.
        for path in left:
            assert re.fullmatch(r"\.(.+)\.[0-9a-f]{16}", path.name)[1] in files
            path.unlink()


@pytest.mark.full
@pytest.mark.parametrize("name", list(WRITERS)[:1])
def test_killed_writers_leave_whole_files(name, loop, tmp_path):
    """A signal that cannot be handled; the full set has SIGTERM, too, and all writers, each many times."""
    check(loop, tmp_path, name, signal.SIGKILL, 4)


@pytest.mark.parametrize("count", [pytest.param(25, marks=pytest.mark.full), pytest.param(300, marks=pytest.mark.long)])
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
@pytest.mark.parametrize("name", WRITERS)
def test_writers_killed_often_leave_whole_files(name, number, count, loop, tmp_path):
    check(loop, tmp_path, name, number, count)
