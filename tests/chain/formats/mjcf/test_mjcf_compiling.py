"""The handler of MuJoCo's warnings in processes that fork."""

import os
import warnings

import mujoco

from exo_pin.chain.formats.mjcf import mjcf_compiling


def test_a_child_of_a_fork_reads_while_its_parent_was_reading():
    with mjcf_compiling.mujoco_warnings(mujoco, []), warnings.catch_warnings():
        # Python warns of forks beside threads; this one takes a lock and ends.
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
        if child == 0:
            os._exit(0 if mjcf_compiling._HANDLER.acquire(blocking=False) else 1)
        assert os.waitpid(child, 0)[1] == 0
