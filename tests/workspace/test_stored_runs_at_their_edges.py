"""Runs of a stored study: numbers at their edges, when a run has ended, and which studies are the same."""

import json
from types import SimpleNamespace

import pytest

from exo_pin import InvalidInput
from exo_pin.core.errors import StorageUnusable
from exo_pin.workspace.optimisation import stored_study
from exo_pin.workspace.optimisation.descent import GENERATION
from exo_pin.workspace.optimisation.stored_study import StoredStudy

RESULT = {"point": [0.5], "merit": 0.25, "objectives": {"index": 0.5}, "evaluations": 24}


@pytest.fixture
def study():
    pytest.importorskip("optuna", reason="needs the extra optimise: pip install '.[optimise]'")
    return StoredStudy(None, "study", ("index",), {"of": "the test", "by": "two"}, 1, 24)


@pytest.mark.parametrize(
    ("change", "good"),
    [
        ({"objectives": {"index": -5e-10}}, True),
        ({"objectives": {"index": -2e-9}}, False),
        ({"objectives": {"index": 1.0 + 5e-10}}, True),
        ({"objectives": {"index": 1.0 + 2e-9}}, False),
        ({"objectives": {"index": 0.5, "contact_force": 0.0}}, True),
        ({"objectives": {"index": 0.5, "peak_shoulder_force": 0.5}}, True),
        ({"objectives": {"index": 0.5, "mean_shoulder_force": -0.1}}, False),
        ({"objectives": {"index": 0.5, "worst_margin": -0.1}}, True),
        ({"evaluations": 0}, False),
        ({"evaluations": 1}, True),
        ({"evaluations": 24 + GENERATION}, True),
        ({"evaluations": 25 + GENERATION}, False),
    ],
)
def test_numbers_of_stored_runs_at_their_edges(study, change, good):
    trial = SimpleNamespace(number=0, user_attrs={"result": json.dumps({**RESULT, **change})})
    if good:
        with study.watched():
            assert study._run(trial).point == [0.5]
        return
    with pytest.raises(StorageUnusable), study.watched():
        study._run(trial)


def test_a_run_counts_when_it_has_ended_with_a_result(study):
    """Not before its end is stored, and not where a stranger has ended it without one."""
    trial, _ = study.take(240)
    trial.set_user_attr("result", json.dumps(RESULT))
    assert study.runs() == []
    study.finish(trial, [0.5], 0.25, {"index": 0.5}, 24)
    assert [run.number for run in study.runs()] == [0]
    other, _ = study.take(240)
    study._study.tell(other, state=study._optuna.trial.TrialState.FAIL)
    assert [run.number for run in study.runs()] == [0]


def test_a_run_that_another_ends_at_the_same_moment_has_ended(study, monkeypatch):
    trial, _ = study.take(240)
    study.finish(trial, [0.5], 0.25, {"index": 0.5}, 24)
    monkeypatch.setattr(study, "_is_mine", lambda _: True)
    monkeypatch.setattr(type(trial), "set_user_attr", lambda *_: None)
    study.finish(trial, [0.5], 0.125, {"index": 0.25}, 24)
    (run,) = study.runs()
    assert run.merit == 0.25


def test_a_study_is_the_same_in_whatever_order_it_is_described(study, monkeypatch):
    monkeypatch.setattr(study._optuna, "create_study", lambda **_: study._study)
    again = StoredStudy(None, "study", ("index",), {"by": "two", "of": "the test"}, 1, 24)
    assert again._study is study._study
    with pytest.raises(
        InvalidInput, match="searches something else: by was 'two' and is 'one', more was None and is 1;"
    ):
        StoredStudy(None, "study", ("index",), {"by": "one", "of": "the test", "more": 1}, 1, 24)


def test_a_worker_is_silent_after_half_a_minute(study, monkeypatch):
    now = SimpleNamespace(value=1e6)
    monkeypatch.setattr(stored_study, "time", SimpleNamespace(time=lambda: now.value))
    trial, _ = study.take(24)
    now.value += 29.0
    assert study.take(24) is None
    now.value += 2.0
    assert study.take(24)[0].number == trial.number


@pytest.mark.parametrize(("version", "good"), [(1, True), (2, False), (None, False)])
def test_studies_of_the_first_format_are_read(study, monkeypatch, version, good):
    description = {"of": "the test", "by": "two"}
    monkeypatch.setattr(study._optuna, "create_study", lambda **_: study._study)
    stored = description if version is None else {**description, "format": version}
    study._study.set_user_attr("description", json.dumps(stored, sort_keys=True))
    if good:
        assert StoredStudy(None, "study", ("index",), description, 1, 24).runs() == []
        return
    with pytest.raises(StorageUnusable, match="another version"):
        StoredStudy(None, "study", ("index",), description, 1, 24)
