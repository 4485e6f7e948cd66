"""What is refused in a URDF, by name and line, and what is not."""

import os
import subprocess
import sys
from pathlib import Path

import pinocchio as pin
import pytest
from urdf_knee import BARE, GOOD, same_as_good

from exo_pin import FileFormatError
from exo_pin.chain import ClosedChain, read_closures


@pytest.mark.parametrize(
    ("encoding", "declared"),
    [("utf-8", "utf-8"), ("utf-8-sig", "utf-8"), ("utf-16", "utf-16"), ("utf-16-le", None), ("latin-1", "iso-8859-1")],
)
def test_the_encoding_is_that_of_the_file(encoding, declared, tmp_path):
    xml = GOOD.replace('name="knee"', 'name="kné"')
    xml = xml.replace('version="1.0"', f'version="1.0" encoding="{declared}"', 1) if declared else xml
    (tmp_path / "r.urdf").write_bytes(xml.encode(encoding))
    chain = ClosedChain.from_urdf(tmp_path / "r.urdf", BARE)
    same_as_good(chain)
    assert chain.model.names[1] == "kné"
    # A text has been decoded already, whatever it says.
    same_as_good(ClosedChain.from_urdf("\ufeff" + xml, BARE))


@pytest.mark.parametrize("content", [b"", b"\xff\xfe", b"\x00" * 100, b"<robot name='\xff'/>", b"\x7fELF", b"<"])
def test_bytes_that_are_no_text_are_refused(content, tmp_path):
    (tmp_path / "r.urdf").write_bytes(content)
    with pytest.raises(FileFormatError, match="not a URDF"):
        ClosedChain.from_urdf(tmp_path / "r.urdf", BARE)


def test_other_things_than_files_are_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe.urdf")
    for path, said in (
        (tmp_path / "pipe.urdf", "a pipe"),
        (tmp_path, "a folder"),
        ("/dev/zero", "a device"),
        (tmp_path / "none.urdf", "No such file"),
        ("zero\0byte", "null"),
        ("x" * 5000, "too long"),
        (7, "expected the path"),
    ):
        for read in (lambda path: ClosedChain.from_urdf(path, BARE), read_closures):
            with pytest.raises(FileFormatError, match=said):
                read(path)
    (tmp_path / "r.urdf").write_text(GOOD)
    os.mkfifo(tmp_path / "r.closures.toml")
    for closures, said in ((None, "a pipe"), ("", "No such file")):
        with pytest.raises(FileFormatError, match=said):
            ClosedChain.from_urdf(tmp_path / "r.urdf", closures)


@pytest.mark.parametrize(
    "path", sorted((Path(__file__).parents[4] / "urdf").glob("*.urdf")), ids=lambda path: path.stem
)
def test_the_published_files_mean_what_they_meant(path):
    chain, plain = ClosedChain.from_urdf(path, BARE), pin.buildModelFromXML(path.read_text())
    for ours, theirs in (
        (chain.model.inertias, plain.inertias),
        (chain.model.jointPlacements, plain.jointPlacements),
        (chain.model.joints, plain.joints),
        (chain.model.names, plain.names),
    ):
        assert list(ours) == list(theirs)


@pytest.mark.parametrize(
    "longest", [pytest.param(20000, marks=pytest.mark.full), pytest.param(100000, marks=pytest.mark.long)]
)
def test_thousands_of_links_are_read_or_refused(longest):
    # In a process of its own: what is tried here is whether it crashes.
    code = (
        "import sys, test_urdf_checking as t\n"
        "from exo_pin.core.errors import FileFormatError\n"
        f"t.ClosedChain.from_urdf(t.chained(999, 'fixed'), t.BARE)\n"
        "t.ClosedChain.from_urdf(t.chained(5000, 'fixed', deep=False), t.BARE)\n"
        f"for count, kind, deep in ((1000, 'fixed', 1), (5000, 'fixed', 1), ({longest}, 'fixed', 1),\n"
        "                          (5000, 'continuous', 1), (500, 'continuous', 1), (500, 'continuous', 0)):\n"
        "    try:\n"
        "        t.ClosedChain.from_urdf(t.chained(count, kind, deep), t.BARE)\n"
        "    except FileFormatError as error:\n"
        "        print(error)\n"
    )
    oracles = Path(__file__).parents[4] / "oracles"
    folders = os.pathsep.join([str(Path(__file__).parent), str(oracles), *sys.path])
    environment = {**os.environ, "PYTHONPATH": folders}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert [("too deep" in line, "too many" in line) for line in lines] == [(True, False)] * 4 + [(False, True)] * 2


def test_nested_elements_without_end_are_refused():
    with pytest.raises(FileFormatError, match="deep"):
        ClosedChain.from_urdf("<robot name='r'>" + "<gazebo>" * 100000, BARE)
