"""Workers that share a study, of which one is killed or falls asleep."""

import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.workspace import Criteria, free_joints, lifting_poses, starting_design
from exo_pin.workspace.optimisation import stored_study
from exo_pin.workspace.optimisation.descent import Descent
from exo_pin.workspace.optimisation.design_variables import DesignVariables
from exo_pin.workspace.optimisation.merit import Merit
from exo_pin.workspace.optimisation.stored_study import StoredStudy
from exo_pin.wrist import BodyShape

pytest.importorskip("optuna")
pytest.importorskip("cmaes")

ARM = ep.Arm.from_anthropometry(1.75, 75, sex="male")
LIMITS = Criteria(largest_shoulder_force=150.0, body=BodyShape.of(ep.Wearer(1.75, 75, "male")))
BUDGET, RUN, GENERATION = 360, 120, 24
SEARCH = {
    "poses": lifting_poses(counts=(3, 3, 2)), "constraints": LIMITS, "seed": 1, "budget": BUDGET, "run_length": RUN,
    "finer_step": 20.0,
}  # fmt: skip

#: Logs a line for every design that it evaluates. Its clock jumps when the other one has been killed, so that nobody
#: waits, and a busy machine makes no worker look silent.
_WORKER = """
import sys
import time
from pathlib import Path
sys.path.insert(0, {tests!r})
import exo_pin as ep
from test_workers import SEARCH, Merit, free_joints, start, stored_study

class Clock:
    sleep = time.sleep
    @staticmethod
    def time():
        return time.time() + (1e6 if Path({killed!r}).exists() else 0.0)

stored_study.time, stored_study.STALE = Clock, 1e5
evaluate, log = Merit.evaluate, open({log!r}, "w", buffering=1)

designs = []

def logged(self, *given):
    log.write("design\\n")
    designs.append(given)
    # The first one waits within its first run to be killed.
    while {log!r}.endswith("first.log") and len(designs) == {held}:
        time.sleep(0.01)
    return evaluate(self, *given)

# The two begin together.
while len(list(Path({log!r}).parent.glob("*.log"))) < 2:
    time.sleep(0.01)

Merit.evaluate = logged
# The check of the result afterwards is not what is tested here.
sys.modules[ep.optimise.__module__].reported = lambda *_: []
ep.optimise(ep.ShoulderExo.from_mechanism(start()), free_joints(4), storage={path!r}, **SEARCH)
"""


def start():
    return starting_design(ep.Actuator("cable", pull_limit=400.0), ARM, 4)


def merit():
    return Merit(DesignVariables(start(), free_joints(4)), SEARCH["poses"], LIMITS)


def lines(path):
    return len(path.read_text().splitlines()) if path.exists() else 0


def finished_runs(path):
    """What is stored of the runs, by number."""
    import optuna

    trials = optuna.load_study(study_name="study", storage=f"sqlite:///{path}").get_trials()
    return {trial.number: json.loads(trial.user_attrs["result"]) for trial in trials if trial.state.is_finished()}


@pytest.mark.full
def test_killed_worker_costs_the_designs_in_flight(tmp_path):
    """Two workers of one study; one gets SIGKILL within a run, and the other completes the study."""
    logs, path, killed = [tmp_path / "first.log", tmp_path / "second.log"], tmp_path / "study.db", tmp_path / "killed"
    here = str(Path(__file__).parent)
    StoredStudy(path, "other study", ("index",), {}, 24, RUN)  # so that the two do not both make the tables
    given = {"tests": here, "path": str(path), "killed": str(killed), "held": 3 * GENERATION}
    workers = [subprocess.Popen([sys.executable, "-c", _WORKER.format(log=str(log), **given)]) for log in logs]
    try:
        end = time.monotonic() + 240.0
        while (lines(logs[0]) < 3 * GENERATION or lines(logs[1]) < GENERATION) and time.monotonic() < end:
            assert workers[0].poll() is None
            time.sleep(0.01)
        workers[0].kill()
        workers[0].wait()
        killed.touch()
        assert workers[1].wait(timeout=240.0) == 0
    finally:
        for worker in workers:
            worker.kill()
            worker.wait()
    assert lines(logs[0]) == 3 * GENERATION  # killed within its first run
    runs = finished_runs(path)
    assert [run["evaluations"] for run in runs.values()] == [RUN] * (BUDGET // RUN)
    # Every finished run evaluates its best design once more.
    lost = lines(logs[0]) + lines(logs[1]) - BUDGET - len(runs)
    assert 0 <= lost <= GENERATION
    # The runs are those that a worker alone makes.
    for number, run in runs.items():
        alone = Descent(merit(), {"mean_shoulder_force": 0.05}, (1, number))
        alone.run(RUN)
        assert run["merit"] == pytest.approx(alone.value, rel=1e-6)


@pytest.mark.full
def test_sleeping_worker_leaves_its_run_to_the_one_that_took_it(tmp_path, monkeypatch):
    description = {"of": "the test"}
    sleeper, other = (StoredStudy(tmp_path / "study.db", "study", ("index",), description, 24, RUN) for _ in range(2))
    trial, state = sleeper.take(RUN)
    assert state is None
    run = Descent(merit(), {}, (1, trial.number))
    run.run(2 * GENERATION)
    assert sleeper.checkpoint(trial, run.stored())
    # The whole budget is in the hands of the first worker.
    assert other.take(RUN) is None
    monkeypatch.setattr(stored_study, "STALE", 0.0)
    taken, state = other.take(RUN)
    assert taken.number == trial.number
    assert Descent(merit(), {}, (1, 0), state).done == 2 * GENERATION
    assert not sleeper.checkpoint(trial, run.stored())
    sleeper.finish(trial, run.best.tolist(), 0.0, {"index": 1.0}, run.done)
    assert sleeper.runs() == []
    other.finish(taken, run.best.tolist(), 0.5, {"index": 0.25}, run.done)
    (finished,) = sleeper.runs()
    assert finished.merit == 0.5
    np.testing.assert_allclose(finished.point, run.best)


def test_run_of_a_worker_that_died_before_its_first_generation_starts_again(tmp_path, monkeypatch):
    first, second = (StoredStudy(tmp_path / "study.db", "study", ("index",), {}, 24, RUN) for _ in range(2))
    trial, _ = first.take(RUN)
    assert second.take(RUN) is None
    monkeypatch.setattr(stored_study, "STALE", 0.0)
    taken, state = second.take(RUN)
    assert (taken.number, state) == (trial.number, None)
