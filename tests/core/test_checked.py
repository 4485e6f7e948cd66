"""Arguments that do not fit their annotations, names of files, and what a terminal and a spreadsheet would run."""

import os
import subprocess
import sys
import types
from collections.abc import Iterable, Mapping

import numpy as np
import pytest
from numpy.typing import ArrayLike

import exo_pin as ep
from exo_pin import InvalidInput, numerics
from exo_pin.core.errors.checked import checked


@checked
def example(
    count: int,
    weights: "ArrayLike | None" = None,
    names: Iterable[str] = (),
    table: "Mapping[str, float] | None" = None,
    *,
    loud: bool = False,
) -> float:
    """Fail in as many ways as Python does."""
    total = float(np.sum(weights @ np.ones(2))) if weights is not None else 0.0
    return total + sum(map(len, names)) + sum((table or {}).values()) + 1.0 / count.bit_length()


@checked
def side_of(exo: "ShoulderExo") -> str:  # noqa: F821 - a name for type checkers alone
    """The side of an exoskeleton."""
    return exo.side


def test_names_of_other_packages_do_not_hide_those_of_this_one(monkeypatch):
    monkeypatch.setitem(sys.modules, "another", types.SimpleNamespace(ShoulderExo=int))
    assert ep.ShoulderExo.__module__.startswith("exo_pin.")
    with pytest.raises(InvalidInput, match="expected exo to be of type ShoulderExo, got 3"):
        side_of(3)


#: Faults of the package: what a typing error, a lost check or a wrong index within a function raises.
FAULTS = [
    *(kind("planted") for kind in (AttributeError, AssertionError, IndexError, KeyError, NameError, OverflowError)),
    *(kind("planted") for kind in (RuntimeError, StopIteration, TypeError, ValueError, ZeroDivisionError)),
    np.linalg.LinAlgError("planted"),
]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: type(fault).__name__)
def test_a_fault_of_a_function_stays_what_it_is(fault):
    @checked
    def faulty(count: int, weights: "ArrayLike") -> None:
        raise fault

    with pytest.raises(type(fault), match="planted") as found:
        faulty(1, np.ones(3))
    assert found.value is fault


#: Functions within public questions, and a question that calls each.
PLACES = {
    "exo_pin.reaction.answer.chosen_forces": lambda exo: exo.reaction(exo.pose(30)),
    "exo_pin.reaction.answer.answered": lambda exo: exo.reaction(exo.pose([30, 40])),
    "exo_pin.wrist.kinematics.inverse.universal_angles": lambda exo: exo.inverse_kinematics(exo.pose(30)),
    "exo_pin.numerics.bounded.box_program._is_unique": lambda exo: numerics.least_force(*PROGRAM),
    "exo_pin.muscle.laws.static.broadcast": lambda exo: ep.muscle.muscle_model("best").force(0.05, 3e5),
    "exo_pin.wrist.kinematics.forward._result": lambda exo: exo.forward_kinematics([0.3, 0.3, 0.3]),
}
PROGRAM = np.ones(3), np.eye(3), -np.ones(3), np.ones(3)


@pytest.mark.parametrize("kind", [IndexError, ValueError, TypeError, AttributeError, RuntimeError])
@pytest.mark.parametrize("place", PLACES)
def test_a_fault_within_a_public_question_comes_out_as_it_is(place, kind, monkeypatch):
    def planted(*_, **__):
        raise kind("planted")

    exo = ep.load("prototype")
    monkeypatch.setattr(place, planted)
    with pytest.raises(kind, match="planted") as found:
        PLACES[place](exo)
    assert not isinstance(found.value, ep.ExoPinError)


def test_inherited_methods_are_checked_in_the_class_that_is_decorated():
    class Base:
        def twice(self, number: float) -> float:
            return 2.0 * number

        @classmethod
        def thrice(cls, number: float) -> float:
            return 3.0 * number

    # Only what the package defines is decorated.
    Base.twice.__module__ = Base.thrice.__func__.__module__ = "exo_pin.example"

    @checked
    class Child(Base):
        pass

    assert (Child().twice(2.0), Child.thrice(2.0)) == (4.0, 6.0)
    with pytest.raises(InvalidInput, match="expected number to be of type float, got None"):
        Child().twice(None)
    with pytest.raises(TypeError):
        Base().twice(None)


def test_a_flag_that_is_given_by_name_alone_is_no_part_of_a_row():
    @checked
    def row(*parts: float, loud: bool = False) -> float:
        return sum(parts) * (-1.0 if loud else 1.0)

    assert (row(1.0, 2.0), row(1.0, 2.0, loud=True)) == (3.0, -3.0)
    with pytest.raises(InvalidInput, match="expected loud to be True or False, got 1"):
        row(1.0, loud=1)


def run(code, **environment):
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, env={**os.environ, **environment}, check=True
    ).stdout


@pytest.mark.full
def test_commands_answer_on_a_terminal_that_knows_ascii_alone():
    code = "import sys; from exo_pin.cli import main; sys.argv = ['exo-pin', 'reaction', 'prototype']; main()"
    plain = run(code, PYTHONIOENCODING="ascii").decode("ascii")
    rich = run(code, PYTHONIOENCODING="utf-8").decode("utf-8")
    assert "°" in rich
    assert "\\x" not in plain
    assert "\\u" not in plain
    # The same answer, word by word, but for its signs.
    assert [len(line.split()) > 0 for line in plain.splitlines()] == [
        len(line.split()) > 0 for line in rich.splitlines()
    ]


def test_what_a_command_prints_does_not_move_the_cursor():
    code = (
        "from exo_pin.cli import make_output_printable; make_output_printable()\nprint('a\\x1b[2Jb\\tc\\u202ed\\udcff')"
    )
    assert run(code, PYTHONIOENCODING="utf-8") == b"a\\x1b[2Jb\tc\\u202ed\\udcff\n"
