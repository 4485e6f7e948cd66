"""Who works on which run of a stored study, and how many designs are left, with a clock that the test sets."""

from types import SimpleNamespace

import numpy as np
import pytest

from exo_pin import InvalidInput
from exo_pin.core.errors import StorageUnusable
from exo_pin.workspace.optimisation import stored_study
from exo_pin.workspace.optimisation.descent import GENERATION
from exo_pin.workspace.optimisation.stored_study import STALE, StoredStudy

pytest.importorskip("optuna")

RUN, POINT = 2 * GENERATION, [0.25, 0.5]
STATE = {"evaluations": GENERATION}


@pytest.fixture
def clock(monkeypatch):
    now = SimpleNamespace(value=1e6)
    monkeypatch.setattr(stored_study, "time", SimpleNamespace(time=lambda: now.value))
    return now


def worker(study=None, objectives=("index",)):
    """A study in memory; of another worker if one is given."""
    found = StoredStudy(None, "study", objectives, {"of": "the test"}, len(POINT), RUN)
    if study is not None:
        found._study = study._study
    return found


def end(study, trial, index=0.5, done=RUN):
    study.finish(trial, POINT, 1.5, {"index": index}, done)


def test_room_is_in_whole_generations_and_the_first_run_has_one(clock):
    study = worker()
    assert study.room(0) == GENERATION
    assert study.room(GENERATION - 1) == study.room(2 * GENERATION - 1) == GENERATION
    assert study.room(5 * GENERATION + 3) == 5 * GENERATION
    trial, state = study.take(5 * GENERATION)
    assert state is None
    # To all that work, what they have not finished is left; to one, less what the others may use.
    assert study.room(5 * GENERATION) == study.room(5 * GENERATION, trial) == 5 * GENERATION
    second, _ = worker(study).take(5 * GENERATION)
    assert study.room(5 * GENERATION, trial) == 5 * GENERATION - RUN
    end(study, trial)
    assert study.evaluations() == RUN
    assert study.room(5 * GENERATION) == 3 * GENERATION
    assert study.room(5 * GENERATION, second) == 3 * GENERATION
    assert study.room(RUN) == 0
    assert study.room(RUN - 1) == -GENERATION


def test_runs_are_taken_as_long_as_there_is_room_beside_the_others(clock):
    study = worker()
    taken = [worker(study).take(2 * RUN) for _ in range(2)]
    assert [(trial.number, state) for trial, state in taken] == [(0, None), (1, None)]
    assert worker(study).take(2 * RUN) is None
    assert worker(study).take(2 * RUN + GENERATION)[0].number == 2


@pytest.mark.parametrize("silence", [STALE + 0.5, -STALE - 0.5])
def test_a_run_is_taken_over_after_a_silence_from_where_it_stands(clock, silence):
    """A time in the future is no sign of life either. The first worker then stores nothing more."""
    first = worker()
    trial, _ = first.take(RUN)
    assert first.checkpoint(trial, STATE)
    second = worker(first)
    clock.value += np.sign(silence) * (STALE - 0.5)
    assert second.take(RUN) is None
    clock.value += np.sign(silence)
    again, state = second.take(RUN)
    assert (again.number, state) == (trial.number, STATE)
    assert not first.checkpoint(trial, {"evaluations": RUN})
    end(first, trial, 0.9)
    assert first.runs() == []
    assert second.checkpoint(again, STATE)
    end(second, again, 0.4)
    (run,) = first.runs()
    assert (run.number, run.point, run.merit, run.evaluations) == (0, POINT, 1.5, RUN)
    assert run.objectives["index"] == 0.4
    # A run that has ended is nobody's.
    assert not second.checkpoint(again, STATE)


def test_a_state_that_a_stranger_left_is_checked_before_it_is_taken_up(clock):
    first = worker()
    trial, _ = first.take(RUN)
    for done in (0, RUN + GENERATION + 1):
        first.checkpoint(trial, {"evaluations": done})
        clock.value += STALE + 1.0
        with pytest.raises(StorageUnusable, match="evaluations"):
            worker(first).take(RUN)
    first.checkpoint(trial, {"evaluations": RUN + GENERATION})
    clock.value += STALE + 1.0
    assert worker(first).take(RUN)[1] == {"evaluations": RUN + GENERATION}


def test_a_run_without_its_objective_has_ended_and_has_designs(clock):
    """An objective that could not be computed is no number in the storage; the run counts all the same."""
    study = worker(objectives=("index", "contact_force"))
    for number, force in enumerate((np.nan, 300.0)):
        trial, _ = study.take(4 * RUN)
        study.finish(trial, POINT, 1.0, {"index": 0.5, "contact_force": force}, GENERATION)
        assert trial.number == number
    first, second = study.runs()
    assert np.isnan(first.objectives["contact_force"])
    assert second.objectives["contact_force"] == 300.0
    assert np.isnan(first.objectives["device_mass"])
    assert study.evaluations() == 2 * GENERATION
    states = [trial.state.name for trial in study._study.get_trials()]
    assert states == ["FAIL", "COMPLETE"]
    assert [way.name for way in study._study.directions] == ["MAXIMIZE", "MINIMIZE"]


@pytest.mark.parametrize("name", ["", 3, None])
def test_a_study_has_a_name(name):
    with pytest.raises(InvalidInput, match="name of a study"):
        StoredStudy(None, name, ("index",), {}, 2, RUN)
