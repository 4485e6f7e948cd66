"""What MuJoCo is asked before it reads a file: its size, its version, and the handler of its warnings."""

import os
import warnings

import mujoco
import numpy as np
import pytest
from mjcf_arm import arm, flag

from exo_pin import FileFormatError
from exo_pin.chain.formats.mjcf import mjcf_compiling
from exo_pin.chain.formats.mjcf.mjcf_compiling import outline
from exo_pin.chain.formats.mjcf.mjcf_reading import _evaluate
from exo_pin.core import errors

pytestmark = pytest.mark.usefixtures("plain")


@pytest.mark.parametrize(
    "text",
    [
        # A replicate counts as often as what is in it; four elements of a kilobyte are around.
        '<worldbody><replicate count="{}"><geom/></replicate></worldbody>',
        '<worldbody><composite count="1 {} 2"/></worldbody>',
        '<worldbody><flexcomp count="-2 {} 1"/></worldbody>',
        '<worldbody><replicate count="many"><replicate count="{}"><body/></replicate></replicate></worldbody>',
        '<worldbody><replicate count="0"><replicate count="{}"><body/></replicate></replicate></worldbody>',
        '<size nuser_geom="{}" nuser_body="49900" njmax="1000000000"/>',
        '<asset><texture width="2000" height="{}"/><mesh count="1000000000"/></asset>',
        '<asset><hfield nrow="{}" ncol="2000"/></asset>',
    ],
)
def test_what_a_file_asks_for_is_counted(text):
    """A hundred megabytes at most: 1e5 elements of a kilobyte, or 1e8 cells."""
    for count, allowed in ((49_900, True), (50_100, False)):
        whole = f"<mujoco>{text.format(count)}</mujoco>"
        if allowed:
            assert outline(whole, None) == ("mujoco", (), ())
            continue
        with pytest.raises(FileFormatError, match=r"more than 1e\+08 bytes of elements"):
            outline(whole, None)


def test_a_file_may_ask_for_all_of_it():
    """Two elements of a kilobyte around, and a replicate with one in it."""
    text = '<mujoco><worldbody><replicate count="{}"><geom/></replicate></worldbody></mujoco>'
    assert outline(text.format(49_999), None)[0] == "mujoco"
    with pytest.raises(FileFormatError, match=r"line 1: mujoco|geom"):
        outline(text.format(50_000), None)


def test_files_that_are_included_are_counted_once_and_their_numbers_read(tmp_path):
    (tmp_path / "leg.xml").write_text(
        '<mujocoinclude><body pos="0.1234 0 1"/><asset><mesh file="bone.stl" refpos="1 0 0"/></asset>'
        '<include file="leg.xml"/><include file="none.xml"/><include/></mujocoinclude>'
    )
    text = '<mujoco><include file="leg.xml"/><include file="leg.xml"/><body pos="0.5 0 0"/></mujoco>'
    assert outline(text, tmp_path) == ("mujoco", ("0.5", "0", "0", "0.1234", "0", "1"), ("bone",))
    # Of text that has no folder nothing is included.
    assert outline(text, None) == ("mujoco", ("0.5", "0", "0"), ())


@pytest.mark.parametrize(
    ("mesh", "moved"),
    [
        ('name="a" file="b.stl" refpos="1 0 0"', ("a",)), ('file="c/b.stl" refquat="0 1 0 0"', ("b",)),
        ('name="a" file="b.stl"', ()), ('name="a" refpos="0 0 1" refquat="0 1 0 0"', ("a",)),
    ],
)  # fmt: skip
def test_meshes_that_mujoco_moves_are_told(mesh, moved):
    assert (
        outline(f'<mujoco><asset><mesh {mesh}/><texture name="t" refpos="1 0 0"/></asset></mujoco>', None)[2] == moved
    )


@pytest.mark.parametrize(
    ("version", "is_read"),
    [("3.9.9", False), ("3.10.0", True), ("3.17.2", True), ("4.99.0rc1", True), ("5.0.0", False), ("2.30.0", False)],
)
def test_versions_of_mujoco_that_are_read(version, is_read, monkeypatch):
    monkeypatch.setattr(mujoco, "__version__", version)
    if is_read:
        assert mjcf_compiling.compile_mjcf(arm()).model.njnt == 3
        return
    with pytest.raises(errors.MissingExtra, match=f">=3.10,<5 .what is installed has version {version}"):
        mjcf_compiling.compile_mjcf(arm())


def test_a_child_of_a_fork_reads_while_its_parent_was_reading():
    with mjcf_compiling.mujoco_warnings(mujoco, []), warnings.catch_warnings():
        # Python warns of forks beside threads; this one takes a lock and ends.
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
        if child == 0:
            os._exit(0 if mjcf_compiling._HANDLER.acquire(blocking=False) else 1)
        assert os.waitpid(child, 0)[1] == 0


def test_contacts_are_not_computed_for_the_comparison_of_motions():
    source = mjcf_compiling.compile_mjcf(arm(world='<geom type="plane" size="1 1 1"/>', option=flag("spring")))
    data, flags = mujoco.MjData(source.model), source.model.opt.disableflags
    mujoco.mj_forward(source.model, data)
    contacts, M = data.ncon, _evaluate(source, data)
    assert contacts > 0
    assert (data.ncon, data.nefc, source.model.opt.disableflags) == (0, 0, flags)
    np.testing.assert_allclose(np.diag(M)[-3:], source.model.body_inertia[-1])
