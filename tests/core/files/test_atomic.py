"""Files appear whole or not at all."""

import errno
import os
import re
import resource
import shutil
import signal
import stat
import tempfile
from pathlib import Path

import matplotlib.figure
import numpy as np
import pytest

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.core.errors import FileNotWritten
from exo_pin.core.files import write_bytes, write_figure

OLD, NEW = b"old\n" * 1000, b"the new one\n" * 1000
NOBODY = 65534


def names(folder):
    return sorted(entry.name for entry in folder.iterdir())


def mode_of(path):
    return stat.S_IMODE(path.stat().st_mode)


@pytest.mark.parametrize("umask", [0o022, 0o077, 0o002])
def test_a_new_file_has_the_mode_of_the_umask(umask, tmp_path):
    before = os.umask(umask)
    try:
        write_bytes(tmp_path / "new", NEW)
    finally:
        os.umask(before)
    assert (tmp_path / "new").read_bytes() == NEW
    assert mode_of(tmp_path / "new") == 0o666 & ~umask
    assert names(tmp_path) == ["new"]


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o664, 0o755])
def test_mode_of_an_existing_file_is_unchanged(mode, tmp_path):
    path = tmp_path / "file"
    path.write_bytes(OLD)
    path.chmod(mode)
    write_bytes(str(path), NEW)
    assert path.read_bytes() == NEW
    assert mode_of(path) == mode
    assert names(tmp_path) == ["file"]


def test_the_longest_names_are_written(tmp_path):
    """255 bytes, whatever they spell: the name of the file beside it is no longer than that."""
    for name in ("n" * 255, "é" * 127, "腕" * 85):
        for content in (OLD, NEW):
            write_bytes(tmp_path / name, content)
        assert (tmp_path / name).read_bytes() == NEW
    assert len(names(tmp_path)) == 3


def test_set_user_and_group_bits_are_cleared(tmp_path):
    path = tmp_path / "file"
    path.write_bytes(OLD)
    path.chmod(0o4755)
    write_bytes(path, NEW)
    assert mode_of(path) == 0o755


def as_unprivileged_user(function):
    """Call a function in a child process, as somebody who is not root; return whether it ended well."""
    child = os.fork()
    if child == 0:
        try:
            if os.geteuid() == 0:
                os.setgroups([])
                os.setgid(NOBODY)
                os.setuid(NOBODY)
            function()
            os._exit(0)
        finally:
            os._exit(1)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def test_what_may_not_be_written_is_refused():
    # Not in pytest's own folder, which is closed to others.
    folder = Path(tempfile.mkdtemp())
    path = folder / "file"
    path.write_bytes(OLD)

    def refused():
        with pytest.raises(FileNotWritten, match="must be writable") as caught:
            write_bytes(path, NEW)
        assert caught.value.errno == errno.EACCES

    try:
        for folder_mode, file_mode in ((0o777, 0o444), (0o555, 0o666)):
            folder.chmod(folder_mode)
            path.chmod(file_mode)
            assert as_unprivileged_user(refused)
            assert path.read_bytes() == OLD
        folder.chmod(0o777)
        assert as_unprivileged_user(lambda: write_bytes(path, NEW))
        assert path.read_bytes() == NEW
        assert names(folder) == ["file"]
    finally:
        shutil.rmtree(folder)


def test_a_refusal_of_the_system_names_the_file(tmp_path, monkeypatch):
    path = tmp_path / "file"
    path.write_bytes(OLD)
    monkeypatch.setattr(os, "access", lambda *_, **__: False)
    with pytest.raises(FileNotWritten, match=re.escape(str(path))) as caught:
        write_bytes(path, NEW)
    assert caught.value.errno == errno.EACCES
    assert path.read_bytes() == OLD


@pytest.mark.parametrize("step", ["write", "fsync", "fchmod", "replace"])
@pytest.mark.parametrize(
    "error", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt(), MemoryError()]
)
def test_no_failure_leaves_anything_behind(step, error, tmp_path, monkeypatch):
    path = tmp_path / "file"
    path.write_bytes(OLD)

    def fail(*_):
        raise error

    monkeypatch.setattr(os, step, fail)
    with pytest.raises(FileNotWritten if isinstance(error, OSError) else type(error)):
        write_bytes(path, NEW)
    monkeypatch.undo()
    assert path.read_bytes() == OLD
    assert names(tmp_path) == ["file"]


def test_a_full_disk_leaves_the_old_file(tmp_path):
    path = tmp_path / "file"
    path.write_bytes(OLD)
    before, handler = resource.getrlimit(resource.RLIMIT_FSIZE), signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (5000, before[1]))
    try:
        with pytest.raises(FileNotWritten, match="File too large") as caught:
            write_bytes(path, NEW)
        with pytest.raises(FileNotWritten):
            write_figure(tmp_path / "picture.png", figure())
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)
    assert caught.value.errno == errno.EFBIG
    assert path.read_bytes() == OLD
    assert names(tmp_path) == ["file"]


def figure():
    drawn = matplotlib.figure.Figure()
    drawn.subplots().plot(np.random.default_rng(0).normal(size=500))
    return drawn


def test_an_unknown_ending_writes_nothing(tmp_path):
    with pytest.raises(InvalidInput, match="xyz"):
        write_figure(tmp_path / "a.xyz", figure())
    assert names(tmp_path) == []


def test_every_file_of_the_package_is_written_here():
    """No writing around the one writer, but for the browser's own page in its folder and pictures into memory."""
    pattern = re.compile(r"\.write_(text|bytes)\(|\bsavefig\(|mkstemp|NamedTemporaryFile|open\([^)]*[\"'][wax]b?[\"']")
    folder = Path(ep.__file__).parent
    found = {
        (str(path.relative_to(folder)), line.strip())
        for path in folder.rglob("*.py")
        for line in path.read_text(encoding="utf-8").splitlines()
        if pattern.search(line) and not line.lstrip().startswith((">>> ", "... "))  # examples are not run by imports
    }
    allowed = {"core/files/atomic.py", "view/page/browser.py", "view/plots/muscle_plots.py", "report/design_report.py"}
    assert {place for place, _ in found} <= allowed
