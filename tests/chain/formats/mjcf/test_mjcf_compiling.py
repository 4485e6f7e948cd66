"""What MuJoCo is asked before it reads a file: its size, its version, and the handler of its warnings."""

import os
import warnings

import mujoco
import pytest
from mjcf_arm import arm

from exo_pin.chain.formats.mjcf import mjcf_compiling
from exo_pin.core import errors

pytestmark = pytest.mark.usefixtures("plain")


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
