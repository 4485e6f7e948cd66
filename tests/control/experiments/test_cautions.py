"""What a run of the plant warns of: extrapolated muscle laws, unsafe pressures, forces after a fault."""

import importlib

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import InvalidInput
from exo_pin.muscle import Supply

#: The module, which has the name of its function.
MODULE = importlib.import_module("exo_pin.control.experiments.sensitivity")


def test_share_of_the_identified_range_counts_where_muscles_pull():
    tracking = ep.experiment("held-abduction").run()
    run = tracking.run
    pulls = run.tensions > 0.0
    shares = [round(100 * run.in_range[pulls[:, i], i].mean()) for i in range(3) if pulls[:, i].any()]
    whole = round(100 * run.in_range[pulls].mean())
    assert 0 < whole < 99
    said = tracking.cautions[0]
    assert f"identified in {whole} % of the states in which they pull" in said
    assert [int(part.split(" %")[0]) for part in said.split(": ")[1:]] == shares
    assert str(tracking).splitlines()[1] == f"Caution: {said}"
    # Motors have no such law.
    assert ep.experiment("four-cables-abduction").replace(duration=0.2).run().cautions == ()


def test_pressures_above_the_safe_one_are_named(tmp_path):
    full = ep.experiment("held-abduction", lambda t, seen: [1.0, -1.0, 0.5]).replace(duration=1.0)
    assert not any("safe" in text for text in full.run().cautions)
    tracking = full.replace(supply=Supply(19e5)).run()
    most = tracking.run.pressures.max(axis=0)
    named = [text for text in tracking.cautions if "above its greatest safe pressure of 4 bar" in text]
    assert [text.split(" bar")[0] for text in named] == [
        f"Muscle {i + 1} reaches {value / 1e5:.3g}" for i, value in enumerate(most) if value > 4.004e5
    ]
    assert named
    tracking.to_csv(tmp_path / "run.csv")
    assert f"# {named[0]}" in (tmp_path / "run.csv").read_text()


def test_a_force_after_a_fault_is_a_band_over_the_estimates(monkeypatch):
    few = [MODULE.MOTOR_CHANGES[0], *(each for each in MODULE.MOTOR_CHANGES if each[0] == "axial stiffness")]
    monkeypatch.setattr(MODULE, "MOTOR_CHANGES", few)
    study = ep.experiment("four-cables-torn").replace(duration=0.7, faults=ep.Fault("torn", 0, 0.4))
    table = ep.control.sensitivity(study)
    assert len(table["fault_F_s_N"]) == 1 + len(few)
    tracking = study.run()
    force = np.linalg.norm(tracking.shoulder_force[tracking.times >= 0.4], axis=1)
    assert table["fault_F_s_N"][0] == pytest.approx(force.max(), abs=1e-6)
    least, greatest = MODULE.band_of(table)
    assert (least, greatest) == (table["fault_F_s_N"].min(), table["fault_F_s_N"].max())
    assert greatest > 1.1 * least
    monkeypatch.setattr(MODULE, "MOTOR_CHANGES", [])
    assert ep.control.fault_band(study) == (table["fault_F_s_N"][0],) * 2
    assert "control.fault_band" in tracking.cautions[-1]
    with pytest.raises(InvalidInput, match="with faults"):
        ep.control.fault_band(study.replace(faults=()))
