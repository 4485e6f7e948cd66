"""The cache of compiled code under processes that begin together, are killed, or have no room on the disk."""

import contextlib
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from hashlib import sha256

import numpy as np
import pytest

needs_jit = pytest.mark.skipif(
    os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"), reason="with NUMBA_DISABLE_JIT there is no compiled form"
)


def cut(path):
    os.truncate(path, path.stat().st_size // 2)


def empty(path):
    os.truncate(path, 0)


def change_a_bit(path):
    content = bytearray(path.read_bytes())
    content[-200] ^= 1
    path.write_bytes(content)


QUERY = (
    "import numpy as np, exo_pin as ep\n"
    "from exo_pin.core.compiled import compilations\n"
    "exo = ep.load('prototype')\n"
    "found = exo.reaction_map(exo.pose(np.linspace(0, 60, 400), 10, 0))\n"
    "print(float(found.shoulder_force.sum()), compilations())\n"
)


def start(folder):
    clean = {key: value for key, value in os.environ.items() if key != "NUMBA_DISABLE_JIT"}
    return subprocess.Popen(
        [sys.executable, "-c", QUERY],
        env={
            **clean,
            "PYTHONPATH": os.pathsep.join(sys.path),
            "NUMBA_CACHE_DIR": str(folder),
            "EXO_PIN_COMPILE": "auto",
        },
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def finished(process):
    """The sum of the forces, the number of compilations, and what was said."""
    out, said = process.communicate(timeout=300)
    assert process.returncode == 0, said
    total, count = out.split()
    return float(total), int(count), said


@pytest.fixture(scope="module")
def begun(tmp_path_factory):
    """A cache that three processes fill at once, and what they answer."""
    folder = tmp_path_factory.mktemp("together")
    return folder, [finished(process) for process in [start(folder) for _ in range(3)]]


@pytest.mark.full
def test_processes_that_begin_together_share_a_new_cache(begun):
    folder, answers = begun
    assert len({total for total, *_ in answers}) == 1
    assert not any("CacheUnusable" in said for *_, said in answers)
    assert finished(start(folder)) == (answers[0][0], 0, "")


@pytest.mark.full
def test_a_map_of_forces_survives_damage_of_all_files(begun, tmp_path):
    folder = tmp_path / "damaged"
    shutil.copytree(begun[0], folder)
    damages = (cut, empty, change_a_bit)
    files = sorted(folder.rglob("*.nbc"))
    for k, path in enumerate(files):
        damages[k % 3](path)
    again, compiled_anew, said = finished(start(folder))
    assert again == begun[1][0][0]
    assert compiled_anew == len(files) > 20
    assert said.count("CacheUnusable") == 1
    assert finished(start(folder)) == (again, 0, "")


@pytest.mark.full
def test_a_map_of_forces_on_a_disk_of_64_kb(tmp_path):
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", tmp_path], capture_output=True).returncode:
        pytest.skip("a disk can be mounted by root only")
    try:
        _, count, said = finished(start(tmp_path))
    finally:
        subprocess.run(["umount", tmp_path], check=True)
    assert count > 20
    assert said.count("CacheUnusable") == 1
    assert "No space left on device" in said


def check_entries(folder):
    """Every entry is whole, and what a kill left behind has a name that no reader asks for."""
    for path in folder.rglob("*"):
        if path.suffix == ".nbc":
            content = path.read_bytes()
            assert sha256(content[32:]).digest() == content[:32], path
        elif path.is_file():
            assert re.fullmatch(r"\..+\.nbc\.[0-9a-f]{16}", path.name), path


@needs_jit
@pytest.mark.parametrize("kills", [pytest.param(12, marks=pytest.mark.full), pytest.param(200, marks=pytest.mark.long)])
def test_a_kill_while_compiling_leaves_whole_entries(tmp_path, kills):
    """A program that compiles the same code for ever is killed at random moments."""
    program = (
        "import os, sys, itertools, numpy as np\n"
        "from exo_pin.core import compiled\n"
        "from exo_pin.core.compiled import Kernel\n"
        "def half(x):\n    return 0.5 * x\n"
        "half.__code__ = half.__code__.replace(co_filename=sys.argv[1])\n"
        "made = [None]\n"
        "def ask():\n"
        "    kernel = Kernel(half)\n"
        "    kernel.options['error_model'] = ('numpy', 'python')[next(turn) % 2]\n"
        "    for value in (1, 1.0, np.zeros(2), np.zeros((2, 2))):\n        kernel(value)\n"
        "turn = itertools.count()\n"
        "with compiled.mode('compiled'):\n"
        "    ask()\n"
        "    for line in sys.stdin:\n"
        "        child = os.fork()\n"
        "        while child == 0:\n            ask()\n"
        "        print(child, flush=True)\n"
        "        os.waitpid(child, 0)\n"
        "        print('gone', flush=True)\n"
    )
    own = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": os.pathsep.join(sys.path)}
    rng = np.random.default_rng(9)
    with subprocess.Popen(
        [sys.executable, "-c", program, __file__], env=own, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as job:
        for _ in range(kills):
            job.stdin.write("\n")
            job.stdin.flush()
            child = int(job.stdout.readline())
            time.sleep(rng.uniform(0.0, 0.5))
            os.kill(child, signal.SIGKILL)
            assert job.stdout.readline() == "gone\n"
            check_entries(tmp_path)
        job.stdin.close()
    assert len(list(tmp_path.rglob("*.nbc"))) == 4


@needs_jit
@pytest.mark.long
@pytest.mark.parametrize("kills", [40])
def test_a_killed_command_leaves_whole_entries(tmp_path, kills):
    """A map of forces, killed while it compiles what it lacks, again and again; the last one has all and answers."""
    rng = np.random.default_rng(10)
    for _ in range(kills):
        job = start(tmp_path)
        with contextlib.suppress(subprocess.TimeoutExpired):
            job.wait(rng.uniform(1.0, 20.0))
        job.kill()
        job.communicate()
        check_entries(tmp_path)
    total, _, said = finished(start(tmp_path))
    assert "CacheUnusable" not in said
    assert finished(start(tmp_path)) == (total, 0, "")


@needs_jit
@pytest.mark.parametrize(
    "after",
    [
        pytest.param(after, marks=pytest.mark.full if after in (0.5, 3.0) else pytest.mark.long)
        for after in (0.5, 1.5, 3.0, 6.0)
    ],
)
def test_ctrl_c_in_a_command_leaves_no_traceback_and_no_half_entry(tmp_path, after):
    own = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "EXO_PIN_COMPILE": "compiled"}
    command = [sys.executable, "-m", "exo_pin.cli", "reaction", "four-cables", "--flexion", "60"]
    job = subprocess.Popen(command, env=own, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    with contextlib.suppress(subprocess.TimeoutExpired):
        job.wait(after)
    job.send_signal(signal.SIGINT)
    _, said = job.communicate(timeout=300)
    assert job.returncode in (0, 130, -signal.SIGINT)
    assert "Traceback" not in said
    assert "ignored" not in said
    check_entries(tmp_path)
    assert not [path for path in tmp_path.rglob(".*") if path.is_file()]
