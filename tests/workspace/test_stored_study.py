"""Stored studies are data: whatever a storage is or holds is checked, and what is wrong with it is one typed error."""

import base64
import json
import math
import os
import pickle
import sqlite3
import subprocess
from types import SimpleNamespace

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.cli import main
from exo_pin.core.errors import StorageUnusable
from exo_pin.workspace import Criteria, free_joints, lifting_poses, starting_design
from exo_pin.workspace.optimisation import stored_study
from exo_pin.workspace.optimisation.descent import GENERATION, Descent
from exo_pin.workspace.optimisation.design_variables import DesignVariables
from exo_pin.workspace.optimisation.merit import Merit
from exo_pin.workspace.optimisation.stored_study import StoredStudy

pytest.importorskip("optuna")
pytest.importorskip("cmaes")

COUNT, RUN = 18, 48
RESULT = {"point": [0.5] * COUNT, "merit": 0.25, "objectives": {"index": 0.5}, "evaluations": RUN}


def opened(storage, description=None):
    return StoredStudy(storage, "study", ("index",), description or {"of": "the test"}, COUNT, RUN)


@pytest.fixture(scope="module")
def judge():
    arm = ep.Arm.from_anthropometry(1.75, 75, sex="male")
    start = starting_design(ep.Actuator("cable", pull_limit=400.0), arm, 3)
    criteria = Criteria(names=("singularity",))
    return Merit(DesignVariables(start, free_joints(3)), lifting_poses(counts=(2, 2, 2)), criteria)


@pytest.fixture(scope="module")
def state(judge):
    """A state as it is stored, after two generations."""
    run = Descent(judge, {}, (1, 0))
    run.run(2 * GENERATION)
    return json.loads(json.dumps(run.stored()))


@pytest.fixture
def study():
    return opened(None)


def write(path, key, text):
    """Change what is stored of the only run."""
    with sqlite3.connect(path) as file:
        file.execute("UPDATE trial_user_attributes SET value_json = ? WHERE key = ?", (json.dumps(text), key))
    file.close()


full = pytest.mark.full


@pytest.mark.parametrize(
    "name",
    ["a%20b.db", *(pytest.param(name, marks=full) for name in ("q?x=1.db", "a{b}#&+@:;.db", "ü y", ":memory:", "-"))],
)
def test_the_file_that_is_named_is_written_and_no_other(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    opened(name)
    opened(tmp_path / name)
    assert os.listdir(tmp_path) == [name]
    assert (tmp_path / name).read_bytes().startswith(b"SQLite")


@pytest.mark.parametrize(
    ("storage", "reason"),
    [
        ("", "the path of a file"),
        (3, "the path of a file"),
        (b"study.db", "the path of a file"),
        ("a\0b", "null byte"),
        ("none/study.db", "no folder"),
        (".", "folder"),
        ("/dev/null", "device"),
        ("text", "not a database"),
        ("ftp://host/study.db", "ftp"),
        ("redis://localhost/1", "Redis"),
        ("sqlite:///none/study.db", "unable to open"),
        ("sqlite:///{study}.db", "study"),
        ("sqlite://here:secret@there/study.db", "URL"),
        ("https://me:secret@host:x/y", "x"),
    ],
)
def test_every_storage_that_cannot_be_used_is_one_error(tmp_path, monkeypatch, capsys, storage, reason):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "text").write_text("no database, but long enough to be looked at\n" * 100)
    with pytest.raises(StorageUnusable, match=reason) as caught:
        opened(storage)
    assert "\n" not in str(caught.value)
    assert "secret" not in str(caught.value)
    assert os.listdir(tmp_path) == ["text"]
    assert capsys.readouterr() == ("", "")


class Attack:
    """Runs a command where it is unpickled."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return os.mkdir, (str(self.path),)


@pytest.mark.parametrize(
    "where", ["state", *(pytest.param(k, marks=full) for k in ("progress", "result", "description"))]
)
def test_a_storage_cannot_run_the_code_of_its_sender(tmp_path, monkeypatch, where):
    harm, path = tmp_path / "harm", tmp_path / "study.db"
    code = base64.b64encode(pickle.dumps(Attack(harm))).decode()
    monkeypatch.setattr(stored_study, "STALE", 0.0)
    study = opened(path)
    trial, _ = study.take(RUN)
    if where == "result":
        study.finish(trial, RESULT["point"], 0.25, {"index": 0.5}, RUN)
    if where == "description":
        with sqlite3.connect(path) as file:
            file.execute("UPDATE study_user_attributes SET value_json = ?", (json.dumps(code),))
        file.close()
    else:
        write(path, where, code)
        write(path, "progress", json.dumps({"state": code, "beat": 0.0, "worker": "x"}) if where == "state" else code)
    with pytest.raises(StorageUnusable):
        opened(path).take(RUN)
    assert not harm.exists()
    pickle.loads(base64.b64decode(code))  # it would have
    assert harm.exists()


@full
def test_a_study_of_another_version_is_refused(tmp_path):
    path = tmp_path / "study.db"
    opened(path)
    for description in ({"of": "the test"}, {"of": "the test", "format": 2}):
        with sqlite3.connect(path) as file:
            file.execute("UPDATE study_user_attributes SET value_json = ?", (json.dumps(json.dumps(description)),))
        file.close()
        with pytest.raises(StorageUnusable, match="another version"):
            opened(path)


#: What a record may not be; a function changes the record.
WRONG_RESULTS = {
    "a point of one number": {"point": [0.5]},
    "a point far away": {"point": [1e6] + [0.5] * (COUNT - 1)},
    "a point that is none": {"point": "0.5"},
    "a point of nothing": {"point": [None] * COUNT},
    "flags": {"point": [True] * COUNT},
    "too few designs": {"evaluations": -1000},
    "too many designs": {"evaluations": 10**9},
    "part of a design": {"evaluations": 47.5},
    "a flag": {"evaluations": True},
    "a merit that is not finite": {"merit": math.inf},
    "a merit in words": {"merit": "good"},
    "no objectives": {"objectives": None},
    "an unknown objective": {"objectives": {"beauty": 1.0}},
    "a share above one": {"objectives": {"index": 1.5}},
    "NaN": {"objectives": {"index": math.nan}},
    "more than there should be": {"more": 1},
}


def read(study, text):
    with study.watched():
        return study._run(SimpleNamespace(number=0, user_attrs={"result": text}))


@pytest.mark.parametrize("case", WRONG_RESULTS)
def test_wrong_results_are_reported(study, case):
    with pytest.raises(StorageUnusable, match="run 0"):
        read(study, json.dumps({**RESULT, **WRONG_RESULTS[case]}))


@pytest.mark.parametrize("text", ["", "no JSON", "[]", "[" * 100_000, '{"evaluations": ' + "9" * 5000 + "}", 7])
def test_what_is_no_record_is_reported(study, text):
    with pytest.raises(StorageUnusable):
        read(study, text)


def test_results_come_back_as_they_were_stored(study):
    trial, _ = study.take(RUN)
    point = np.random.default_rng(0).uniform(size=COUNT).tolist()
    study.finish(trial, point, 1.25, {"index": 0.5, "mean_shoulder_force": math.nan}, RUN)
    (run,) = study.runs()
    assert (run.number, run.point, run.merit, run.evaluations) == (0, point, 1.25, RUN)
    assert run.objectives["index"] == 0.5
    assert math.isnan(run.objectives["mean_shoulder_force"])


@full
def test_a_command_reports_a_wrong_study_in_one_line(tmp_path, capsys):
    path = tmp_path / "study.db"
    query = ["optimise", "--limbs", "3", "--family", "cable", "--device", "prototype", "--person", "1.75,75,male"]
    query += ["--criteria", "singularity", "--budget", "24", "--run-length", "24", "--storage", str(path)]
    assert main(query) == 0
    write(path, "result", json.dumps({**RESULT, "point": [0.5]}))
    capsys.readouterr()
    assert main(query) == 2
    out, said = capsys.readouterr()
    assert (out, said.count("\n")) == ("", 1)
    assert "study.db" in said
    assert "(18,)" in said


def test_a_state_comes_back_as_it_was_stored(judge, state):
    assert Descent(judge, {}, (1, 0), state).stored() == state


@pytest.mark.parametrize("value", ["x", [], [0.5], -1.0, 1e300, math.nan, [1e300], [[0.5]], {}, True])
def test_wrong_states_are_reported(judge, state, value):
    for key, right in state.items():
        if key == "value" and value in (-1.0, True):
            continue  # a merit may be so
        wrong = value
        if isinstance(right, list) and isinstance(value, float):
            wrong = [value] * len(right)
            if value == -1.0 and key not in ("best", "covariance"):
                continue
        with pytest.raises(InvalidInput, match="state"):
            Descent(judge, {}, (1, 0), {**state, key: wrong})
        with pytest.raises(InvalidInput, match="state"):
            Descent(judge, {}, (1, 0), {name: kept for name, kept in state.items() if name != key})


@full
def test_any_state_that_is_accepted_can_be_searched(judge, state):
    """Random numbers of all sizes: refused, or the search ends without an error of Python."""
    rng, accepted = np.random.default_rng(5), 0
    for _ in range(200):
        wrong = dict(state)
        for key in rng.choice(["mean", "step", "covariance", "step_path", "covariance_path", "recent_values"], 2):
            size = 10.0 ** rng.uniform(-15.0, 7.0)
            wrong[key] = (size * rng.uniform(-0.2, 1.0, np.shape(state[key]))).tolist()
        try:
            run = Descent(judge, {}, (1, 0), wrong)
        except InvalidInput:
            continue
        accepted += 1
        with np.errstate(all="ignore"):
            run.run(RUN + 2 * GENERATION)
        assert np.abs(run.best - 0.5).max() <= 0.5
    assert accepted > 30


@pytest.mark.parametrize("beat", [1e300, *(pytest.param(k, marks=full) for k in (float("nan"), "nan"))])
def test_a_run_whose_worker_writes_from_the_future_is_taken_over(tmp_path, beat):
    path = tmp_path / "study.db"
    opened(path).take(RUN)
    write(path, "progress", json.dumps({"state": None, "beat": beat, "worker": "x"}))
    trial, state = opened(path).take(RUN)
    assert (trial.number, state) == (0, None)


@full
def test_a_damaged_file_is_reported(tmp_path):
    path = tmp_path / "study.db"
    study = opened(path)
    trial, _ = study.take(RUN)
    study.finish(trial, RESULT["point"], 0.25, {"index": 0.5}, RUN)
    whole, rng, refused = path.read_bytes(), np.random.default_rng(0), 0
    damaged = [whole[:size] for size in rng.integers(1, len(whole), 10)]
    for _ in range(20):
        content = np.frombuffer(whole, np.uint8).copy()
        content[rng.integers(0, len(content), 2000)] = rng.integers(0, 256, 2000)
        damaged.append(content.tobytes())
    for content in damaged:
        path.write_bytes(content)
        try:
            opened(path).runs()
        except StorageUnusable:
            refused += 1
    assert refused > 10


@full
def test_a_full_disk_is_reported(tmp_path):
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", tmp_path], capture_output=True).returncode:
        pytest.skip("a disk can be mounted by root only")
    try:
        with pytest.raises(StorageUnusable, match="full"):
            opened(tmp_path / "study.db")
    finally:
        subprocess.run(["umount", "--lazy", tmp_path], check=True)
