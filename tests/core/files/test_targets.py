"""Pipes, devices, descriptors and links stay what they are when they are written to."""

import errno
import os
import stat
import subprocess
import sys
import threading

import pytest

from exo_pin import cli
from exo_pin.core.errors import FileNotWritten
from exo_pin.core.files import is_stream, write_bytes

NEW = b"the new one\n" * 1000
OLD = b"old\n" * 1000


def names(folder):
    return sorted(entry.name for entry in folder.iterdir())


def test_links_stay_and_their_target_is_replaced(tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    target = tmp_path / "b" / "target"
    target.write_bytes(OLD)
    (tmp_path / "a" / "inner").symlink_to("../b/target")
    (tmp_path / "outer").symlink_to("a/inner")
    write_bytes(tmp_path / "outer", NEW)
    assert target.read_bytes() == NEW
    assert not target.is_symlink()
    assert os.readlink(tmp_path / "outer") == "a/inner"
    assert os.readlink(tmp_path / "a" / "inner") == "../b/target"
    assert names(tmp_path / "b") == ["target"]


def test_a_fifo_gets_the_bytes_and_stays(tmp_path):
    path, got = tmp_path / "fifo", []
    os.mkfifo(path)
    reader = threading.Thread(target=lambda: got.append(path.read_bytes()))
    reader.start()
    write_bytes(path, NEW * 50)  # more than a pipe holds
    reader.join()
    assert got == [NEW * 50]
    assert stat.S_ISFIFO(path.stat().st_mode)
    assert names(tmp_path) == ["fifo"]


def test_a_fifo_whose_reader_ends_is_an_error_of_its_own(tmp_path):
    path = tmp_path / "fifo"
    os.mkfifo(path)
    reader = threading.Thread(target=lambda: path.open("rb").close())
    reader.start()
    with pytest.raises(FileNotWritten, match="the program that reads the pipe has ended") as caught:
        write_bytes(path, NEW * 1000)
    reader.join()
    assert caught.value.errno == errno.EPIPE
    assert caught.value.path == str(path)


def test_devices_stay_devices(tmp_path):
    (tmp_path / "link").symlink_to("/dev/null")
    for path in ("/dev/null", tmp_path / "link"):
        assert is_stream(path)
        write_bytes(path, NEW)
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)
    with pytest.raises(FileNotWritten, match="No space") as caught:
        write_bytes("/dev/full", NEW)
    assert caught.value.errno == errno.ENOSPC


@pytest.mark.parametrize("form", ["/dev/fd/{}", "/proc/self/fd/{}", "/proc/{pid}/fd/{}"])
def test_a_descriptor_gets_the_bytes(form, tmp_path):
    reading, writing = os.pipe()
    write_bytes(form.format(writing, pid=os.getpid()), b"through the pipe")
    os.close(writing)
    assert os.read(reading, 100) == b"through the pipe"
    os.close(reading)
    with pytest.raises(FileNotWritten):
        write_bytes(form.format(writing, pid=os.getpid()), b"x")


def run(code, *arguments, **options):
    """A program in a process of its own."""
    command = [sys.executable, "-c", code, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, **options)


def test_standard_output_in_a_file_is_written_at_its_place(tmp_path):
    code = """
from exo_pin.core.files import write_text
print("before")
write_text("/dev/stdout", "within\\n")
print("after")
"""
    with (tmp_path / "out").open("w") as out:
        subprocess.run([sys.executable, "-c", code], stdout=out, check=True)
    assert (tmp_path / "out").read_text() == "before\nwithin\nafter\n"
    assert run(code).stdout == "before\nwithin\nafter\n"
    assert names(tmp_path) == ["out"]


def test_command_writes_to_a_pipe_without_an_ending(tmp_path, capsys):
    reading, writing = os.pipe()
    assert cli.main(["muscle", "step", "--mass-kg", "1.3", "--from-bar", "2", "--to-bar", "3", "--mark",
                     "--out", f"/dev/fd/{writing}", "--duration-s", "0.05"]) == 0  # fmt: skip
    os.close(writing)
    assert os.read(reading, 60).startswith(b"time_s,contraction_mm")
    os.close(reading)
    assert capsys.readouterr().out.splitlines()[-1] == f"/dev/fd/{writing}"
