"""How many files of the package a plain question passes: what one reads from the question to the answer."""

import sys
from importlib import import_module
from pathlib import Path

import pytest

import exo_pin as ep
from exo_pin.core import compiled

FOLDER = Path(ep.__file__).parent
ASK = ["reaction", "--flexion", "60", "--abduction", "30"]


def files_passed(question):
    """Files whose functions are entered when a question is put again; kernels run plain, so that they count."""
    passed = set()

    def note(frame, event, _):
        code = frame.f_code
        if event == "call" and code.co_name != "<module>" and FOLDER in Path(code.co_filename).parents:
            passed.add(Path(code.co_filename).relative_to(FOLDER).as_posix())

    with compiled.mode("plain"):
        question()  # what is set up once is no part of the path
        sys.setprofile(note)
        try:
            question()
        finally:
            sys.setprofile(None)
    return passed


def test_the_command_of_the_readme_passes_few_files(capsys):
    passed = files_passed(lambda: import_module("exo_pin.cli").main(ASK))
    assert "The device can hold this pose." in capsys.readouterr().out
    assert {"cli/reaction_command.py", "wrist_chain/equilibrium.py", "numerics/vectors.py"} <= passed
    assert len(passed) <= 50, sorted(passed)


@pytest.mark.parametrize("name", ["prototype", "four-cables"])
def test_a_reaction_within_limits_passes_fifteen_files_without_the_kernels_of_numerics_and_muscle_laws(name):
    exo = ep.load(name)
    pose = exo.pose(60, 30, 0)
    passed = files_passed(lambda: exo.reaction(pose))
    assert {"reaction/solve_case.py", "wrist_chain/equilibrium.py", "reaction/answer.py"} <= passed
    # Kernels run plain here, as Python files of numerics; the prototype's muscles have a law, which gives their limits.
    own = [path for path in passed if not path.startswith(("core/compiled", "core/plain_math", "numerics/", "muscle/"))]
    assert len(own) <= 15, sorted(own)
    assert len([path for path in passed if path.startswith(("core/", "numerics/"))]) <= 6
