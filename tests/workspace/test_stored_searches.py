"""Stored searches are data: they go on where they stand, and whatever else a storage is or holds is one typed error."""

import json
import math
import os
import pickle
import re
import sqlite3
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest
import small_searches
from small_searches import BOUNDS, EXO, GENERATION, RUN, searched

import exo_pin as ep
from exo_pin.core import errors
from exo_pin.workspace import CRITERIA
from exo_pin.workspace.optimisation.search_poses import SearchPoses

optuna = pytest.importorskip("optuna")
pytest.importorskip("cmaes")

pytestmark = pytest.mark.usefixtures("plain")
full = pytest.mark.full

GOOD = {"point": [0.5, 0.5], "merit": 0.25, "objectives": {"index": 0.5}, "evaluations": RUN}


@pytest.fixture(scope="module")
def ended(tmp_path_factory):
    """Bytes of a storage with a finished run, and what was found."""
    path = tmp_path_factory.mktemp("ended") / "study.db"
    found = searched(path)
    return path.read_bytes(), found


@pytest.fixture(scope="module")
def begun(tmp_path_factory):
    """Bytes of a storage whose only run was stopped in its second generation, and the state that it left."""
    path, own, calls = tmp_path_factory.mktemp("begun") / "study.db", CRITERIA["singularity"], []

    def stopped(at):
        calls.append(at)
        if len(calls) > GENERATION + 10:
            raise KeyboardInterrupt
        return own.margin(at)

    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(CRITERIA, "singularity", replace(own, margin=stopped))
        with pytest.raises(KeyboardInterrupt):
            searched(path)
    return path.read_bytes(), read(path, "progress")


def read(path, key):
    with sqlite3.connect(path) as file:
        rows = file.execute("SELECT value_json FROM trial_user_attributes WHERE key = ?", (key,)).fetchall()
    file.close()
    return json.loads(json.loads(rows[0][0]))


def write(path, key, text):
    """Change what is stored of the runs, or (key "description") of the study."""
    with sqlite3.connect(path) as file:
        if key == "description":
            file.execute("UPDATE study_user_attributes SET value_json = ?", (json.dumps(text),))
        else:
            file.execute("UPDATE trial_user_attributes SET value_json = ? WHERE key = ?", (json.dumps(text), key))
    file.close()


def put(path, content, key=None, value=None):
    """A storage of its own, with one thing changed."""
    path.write_bytes(content)
    if key is not None:
        write(path, key, value if isinstance(value, str) else json.dumps(value))
    return path


def taken_over(state):
    """What is stored of a run whose worker fell silent long ago."""
    return {"state": state, "beat": 0.0, "worker": "x"}


@pytest.mark.parametrize(
    "name",
    ["a%20b.db", *(pytest.param(name, marks=full) for name in ("q?x=1.db", "a{b}#&+@:;.db", "ü y", ":memory:", "-"))],
)
def test_the_file_that_is_named_is_written_and_no_other(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    first = searched(name, budget=GENERATION)
    assert searched(tmp_path / name, budget=GENERATION).runs == first.runs
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
    with pytest.raises(errors.StorageUnusable, match=reason) as caught:
        searched(storage)
    assert "\n" not in str(caught.value)
    assert "secret" not in str(caught.value)
    assert os.listdir(tmp_path) == ["text"]
    assert capsys.readouterr() == ("", "")


class Attack:
    """Makes a folder where it is unpickled."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return os.mkdir, (str(self.path),)


def test_a_storage_cannot_run_the_code_of_its_sender(tmp_path, ended, begun):
    harm = tmp_path / "harm"
    code = pickle.dumps(Attack(harm)).decode("latin-1")
    for content, key, value in (
        (ended[0], "result", code), (ended[0], "description", code), (begun[0], "progress", code),
        (begun[0], "progress", taken_over(code)),
    ):  # fmt: skip
        with pytest.raises(errors.StorageUnusable):
            searched(put(tmp_path / "study.db", content, key, value))
    assert not harm.exists()
    pickle.loads(code.encode("latin-1"))  # it would have
    assert harm.exists()


def test_a_finished_search_comes_back_and_goes_on_where_it_stands(tmp_path, ended):
    content, found = ended
    path = put(tmp_path / "study.db", content)
    assert [(run.number, run.evaluations) for run in found.runs] == [(0, RUN)]
    again = searched(path)
    assert again.runs == found.runs
    np.testing.assert_array_equal(again.best.geometry.base_points, found.best.geometry.base_points)
    assert searched(path, budget=GENERATION).runs == found.runs
    # More of it is what a search in memory finds.
    more = searched(path, budget=RUN + GENERATION)
    assert more.runs == searched(budget=RUN + GENERATION).runs
    assert more.runs[:1] == found.runs
    assert [run.evaluations for run in more.runs] == [RUN, GENERATION]
    stored = optuna.load_study(study_name="study", storage=f"sqlite:///{path}")
    assert [way.name for way in stored.directions] == ["MAXIMIZE"]
    # Another name is another study.
    assert [run.evaluations for run in searched(path, name="other", budget=1).runs] == [GENERATION]


def test_several_runs_say_how_far_they_are_apart():
    found = searched(budget=2 * RUN)
    low, high = sorted(100.0 * each["index"] for each in found.values)
    assert f"Inside on the full grid, over the runs: {low:.1f} to {high:.1f} %." in str(found).splitlines()
    assert high > 0.0


def test_a_refinement_says_how_its_start_and_its_best_compare(ended):
    name = "worst_margin"
    found = searched(variables={"A[1].radius": (0.01, 0.9)}, refine=True, objectives=("index", name))
    assert not found.stopped
    start, best = found.start, found.best_candidate
    kept = ", which is the start: no run was better" if best is start else ""
    lines = str(found).splitlines()
    assert f"The start: {100 * start.index:.1f} % of the full grid. The best: {100 * best.index:.1f} %{kept}." in lines
    assert f"{name}: {start.objectives[name]:.4g} of the start, {best.objectives[name]:.4g} of the best." in lines
    assert not any("stopped by hand" in line for line in lines)
    assert "The search was stopped by hand: this is the best so far." in str(replace(found, stopped=True))
    assert not any("of the start" in line or "stopped" in line for line in str(ended[1]).splitlines())


def test_a_study_of_another_version_or_of_something_else_is_refused(tmp_path, ended):
    path = tmp_path / "study.db"
    with sqlite3.connect(put(path, ended[0])) as file:
        (text,) = file.execute("SELECT value_json FROM study_user_attributes").fetchone()
    file.close()
    description = json.loads(json.loads(text))
    for other in ({**description, "format": 2}, {k: v for k, v in description.items() if k != "format"}):
        with pytest.raises(errors.StorageUnusable, match="another version"):
            searched(put(path, ended[0], "description", other))
    with pytest.raises(ep.InvalidInput, match="searches something else: seed was 0 and is 1;"):
        searched(put(path, ended[0]), seed=1)
    # Other joints are another design, rounded ones are not.
    geometry = EXO.geometry
    for by in (1e-12, 1e-6):
        moved = EXO.replace(geometry=geometry.replace(platform_points=geometry.platform_points + by))
        if by < 1e-9:
            assert searched(put(path, ended[0]), exo=moved).runs == ended[1].runs
        else:
            with pytest.raises(ep.InvalidInput, match=r"data of the design was '.*' and is"):
                searched(put(path, ended[0]), exo=moved)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"objectives": ("index", "worst_margin")}, ["objectives"]),
        ({"fit_strokes": True}, ["fit_strokes"]),
        ({"poses": EXO.pose([0.0, 40.0, 81.0])}, ["data of the poses"]),
        ({"poses": SearchPoses(EXO.pose([0.0, 40.0, 80.0]), [1.0, 1.0, 2.0])}, ["data of the poses"]),
        ({"poses": EXO.pose([0.0, 40.0])}, ["data of the poses", "poses"]),
        ({"variables": {**BOUNDS, "A[1].radius": (0.1, 0.31)}}, ["variables"]),
        ({"constraints": ep.Criteria(names=("singularity",), least_margin=0.2)}, ["criteria"]),
        ({"seed": 3}, ["seed"]),
        ({"run_length": RUN + GENERATION}, ["run_length"]),
        ({"refine": True, "variables": {"A[1].radius": (0.01, 0.9), "A[2].elevation": (-1.5, 1.5)}},
         ["start", "variables"]),
        ({"cuff_by_geometry": True}, ["cuff", "data of the design"]),
        ({"centre_offset": [0.0, 0.01, 0.0]}, ["centre_offset"]),
        ({"exo": EXO.replace(name="other")}, ["data of the design", "design"]),
    ],
)  # fmt: skip
def test_a_study_goes_on_with_nothing_else_than_it_began(tmp_path, ended, change, said):
    with pytest.raises(ep.InvalidInput, match="searches something else") as refusal:
        searched(put(tmp_path / "study.db", ended[0]), **change)
    assert re.findall(r"(?:: |, )([a-z_ ]+) was ", str(refusal.value)) == said


#: What a record may not be, and some that it may.
WRONG = [
    {"point": [0.5]}, {"point": [1e6, 0.5]}, {"point": "0.5"}, {"point": [None] * 2}, {"point": [True] * 2},
    {"evaluations": -1000}, {"evaluations": 0}, {"evaluations": RUN + GENERATION + 1}, {"evaluations": 10**9},
    {"evaluations": 47.5}, {"evaluations": True}, {"merit": math.inf}, {"merit": "good"}, {"objectives": None},
    {"objectives": {"beauty": 1.0}}, {"objectives": {"index": 1.0 + 2e-9}}, {"objectives": {"index": -2e-9}},
    {"objectives": {"index": math.nan}}, {"objectives": {"index": 0.5, "mean_shoulder_force": -0.1}}, {"more": 1},
]  # fmt: skip
RIGHT = [
    {"objectives": {"index": 1.0 + 5e-10}}, {"objectives": {"index": -5e-10}}, {"evaluations": 1},
    {"evaluations": RUN + GENERATION}, {"objectives": {"index": 0.5, "peak_shoulder_force": 0.5, "worst_margin": -0.1}},
]  # fmt: skip


#: A search takes a tenth of a second: a sample of the cases, and all of them.
EVERY = pytest.mark.parametrize("step", [6, pytest.param(1, marks=full)])


@EVERY
def test_records_of_runs_are_checked(tmp_path, ended, step):
    path = tmp_path / "study.db"
    for change in WRONG[::step]:
        with pytest.raises(errors.StorageUnusable, match="run 0"):
            searched(put(path, ended[0], "result", {**GOOD, **change}))
    for text in ("[" * 100_000, "no JSON", "[]", '{"evaluations": ' + "9" * 5000 + "}")[::step]:
        with pytest.raises(errors.StorageUnusable):
            searched(put(path, ended[0], "result", text))
    for change in RIGHT[::step]:
        (run,) = searched(put(path, ended[0], "result", {**GOOD, **change}), budget=1).runs
        assert (run.number, run.point, run.merit) == (0, [0.5, 0.5], 0.25)
        assert run.evaluations == {**GOOD, **change}["evaluations"]
        assert math.isnan(run.objectives["mean_shoulder_force"])


def test_a_run_is_taken_over_from_where_it_stands(tmp_path, begun, ended):
    """Of a worker that is silent, or whose clock is far ahead; with the numbers that the run would have had."""
    content, progress = begun
    assert progress["state"]["evaluations"] == GENERATION
    for beat in (1e300, 0.0):
        path = put(tmp_path / "study.db", content, "progress", {**progress, "beat": beat})
        found = searched(path)
        (run,), (whole,) = found.runs, ended[1].runs
        assert (run.number, run.evaluations) == (0, RUN)
        # cmaes stores its matrix without the half that symmetry gives, so to rounding.
        assert run.merit == pytest.approx(whole.merit, rel=1e-6)
    # Before its first generation it begins again.
    path = put(tmp_path / "study.db", content, "progress", taken_over(None))
    assert searched(path).runs == ended[1].runs


@EVERY
def test_wrong_states_are_reported(tmp_path, begun, step):
    """Of other kinds, with something missing, not above zero, of part of a generation, or beyond their sizes."""
    content, progress = begun
    state, path, wrong = progress["state"], tmp_path / "study.db", []
    for key, right in state.items():
        wrong.append({name: kept for name, kept in state.items() if name != key})
        for value in ("x", [], [0.5], 1e300, math.nan, [1e300], [[0.5]], {}, True):
            given = [value] * len(right) if isinstance(right, list) and isinstance(value, float) else value
            if (key, value) != ("value", True):  # a merit may be so
                wrong.append({**state, key: given})
    wrong += [{**state, "step": step} for step in (0.0, -1.0)]
    wrong += [{**state, "covariance": [first, *state["covariance"][1:]]} for first in (-1.0, 0.0)]
    wrong += [{**state, "evaluations": done} for done in (0, 25, GENERATION - 1, -GENERATION, 10**6 * GENERATION)]
    largest = {
        "mean": 1e6, "step": 1e4, "covariance": 1e12, "step_path": 1e3, "covariance_path": 1e12, "recent_values": 1e12
    }  # fmt: skip
    for key, most in largest.items():
        for beyond in (1.001 * most, -1.001 * most):
            given = state[key]
            wrong.append({**state, key: [*given[:-1], beyond] if isinstance(given, list) else beyond})
    for each in wrong if step == 1 else wrong[:: 2 * step + 1]:
        with pytest.raises(errors.StorageUnusable):
            searched(put(path, content, "progress", taken_over(each)))


@full
def test_any_state_that_is_accepted_can_be_searched(tmp_path, begun):
    """Random numbers of all sizes: refused, or the search ends without an error of Python."""
    rng, accepted, (content, progress) = np.random.default_rng(5), 0, begun
    for _ in range(60):
        wrong = dict(progress["state"])
        for key in rng.choice(["mean", "step", "covariance", "step_path", "covariance_path", "recent_values"], 2):
            size = 10.0 ** rng.uniform(-15.0, 7.0)
            wrong[key] = (size * rng.uniform(-0.2, 1.0, np.shape(wrong[key]))).tolist()
        path = put(tmp_path / "study.db", content, "progress", taken_over(wrong))
        with np.errstate(all="ignore"):
            try:
                found = searched(path, budget=RUN)
            except errors.StorageUnusable:
                continue
        accepted += 1
        assert np.abs(np.array(found.runs[0].point) - 0.5).max() <= 0.5
    assert accepted > 8


@full
def test_a_damaged_file_is_reported(tmp_path, ended):
    whole, rng, refused = ended[0], np.random.default_rng(0), 0
    damaged = [whole[:size] for size in rng.integers(1, len(whole), 10)]
    for _ in range(20):
        content = np.frombuffer(whole, np.uint8).copy()
        content[rng.integers(0, len(content), 2000)] = rng.integers(0, 256, 2000)
        damaged.append(content.tobytes())
    for content in damaged:
        try:
            searched(put(tmp_path / "study.db", content), budget=1)
        except errors.StorageUnusable:
            refused += 1
    assert refused > 10


@full
def test_a_full_disk_is_reported(tmp_path):
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", tmp_path], capture_output=True).returncode:
        pytest.skip("a disk can be mounted by root only")
    try:
        with pytest.raises(errors.StorageUnusable, match="full"):
            searched(tmp_path / "study.db")
    finally:
        subprocess.run(["umount", "--lazy", tmp_path], check=True)


#: A worker of its own, which waits within its run to be killed, or searches with a clock that is a million seconds on.
_WORKER = """
import sys, time
from dataclasses import replace
sys.path.insert(0, {oracles!r})
from exo_pin.core import compiled
from exo_pin.workspace import CRITERIA
from small_searches import searched

own, kill = CRITERIA["singularity"], {kill}

def margin(at):
    print("design", flush=True)
    margin.count += 1
    while kill and margin.count > 30:
        time.sleep(0.01)
    return own.margin(at)

margin.count = 0
CRITERIA["singularity"] = replace(own, margin=margin)
if not kill:
    now = time.time
    time.time = lambda: now() + 1e6
with compiled.mode("plain"):
    searched({path!r})
"""


@full
def test_a_killed_worker_costs_the_designs_in_flight(tmp_path, ended):
    """One gets SIGKILL within a run, and another completes the study with the runs of one that worked alone."""
    path, oracles = str(tmp_path / "study.db"), os.path.dirname(small_searches.__file__)
    code = [_WORKER.format(oracles=oracles, path=path, kill=kill) for kill in (True, False)]
    with subprocess.Popen([sys.executable, "-c", code[0]], stdout=subprocess.PIPE, text=True) as first:
        for _ in range(31):
            assert first.stdout.readline() == "design\n"
        time.sleep(0.1)
        first.kill()
    second = subprocess.run([sys.executable, "-c", code[1]], capture_output=True, text=True, check=True)
    (run,), (alone,) = searched(path).runs, ended[1].runs
    assert run.merit == pytest.approx(alone.merit, rel=1e-6)
    # The first generation was stored: the second is made anew, the best evaluated once more, and the result checked.
    assert GENERATION < second.stdout.count("design") < 2 * GENERATION + 20
