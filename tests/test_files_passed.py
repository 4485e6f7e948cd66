"""How many files of the package a plain question passes: what one reads from the question to the answer."""

import os
import sys
from importlib import import_module
from pathlib import Path

import pytest
from places import URDF

import exo_pin as ep
from exo_pin.core import compiled

FOLDER = Path(ep.__file__).parent
ASK = ["reaction", "--flexion", "60", "--abduction", "30"]


def files_passed(question, mode="plain"):
    """Files whose functions are entered when a question is put again; kernels that run plain count with their parts."""
    passed = set()

    def note(frame, event, _):
        code = frame.f_code
        if event == "call" and code.co_name != "<module>" and FOLDER in Path(code.co_filename).parents:
            passed.add(Path(code.co_filename).relative_to(FOLDER).as_posix())

    with compiled.mode(mode):
        question()  # what is set up once is no part of the path
        sys.setprofile(note)
        try:
            question()
        finally:
            sys.setprofile(None)
    return passed


def test_the_command_of_the_readme_passes_few_files(capsys):
    passed = files_passed(lambda: import_module("exo_pin.cli").main(ASK))
    assert "YES, it holds." in capsys.readouterr().out
    assert {"cli/reaction_command.py", "wrist_chain/equilibrium.py", "numerics/vectors.py"} <= passed
    assert len(passed) <= 53, sorted(passed)


@pytest.mark.parametrize(("name", "most"), [("prototype", 14), ("four-cables", 14)])
def test_a_reaction_within_limits_passes_few_files_without_the_kernels_of_numerics_and_muscle_laws(name, most):
    exo = ep.load(name)
    pose = exo.pose(60, 30, 0)
    passed = files_passed(lambda: exo.reaction(pose))
    assert {"reaction/solve_case.py", "wrist_chain/equilibrium.py", "reaction/answer.py"} <= passed
    # Kernels run plain here, as Python files of numerics; the prototype's muscles have a law, which gives their limits.
    own = [path for path in passed if not path.startswith(("core/compiled", "core/plain_math", "numerics/", "muscle/"))]
    assert len(own) <= most, sorted(own)
    assert len([path for path in passed if path.startswith(("core/", "numerics/"))]) <= 6


@pytest.mark.skipif(
    os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"), reason="kernels count where they run plain"
)
def test_a_reaction_of_a_serial_device_passes_24_files():
    exo = ep.load(URDF / "serial-y-x-z.urdf")
    pose = exo.pose(60, 30)
    passed = files_passed(lambda: exo.reaction(pose), "compiled")
    assert {"reaction/device_poses.py", "device/equilibrium.py", "device/balance/balanced_forces.py"} <= passed
    assert len(passed) <= 24, sorted(passed)
