"""What a run of the plant warns of: extrapolated muscle laws, unsafe pressures, forces after a fault."""

import json

import numpy as np

import exo_pin as ep
from exo_pin.muscle import Supply


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
    assert named[0] in json.loads((tmp_path / "run.json").read_text())["cautions"]


def test_a_force_after_a_fault_depends_on_estimates():
    tracking = ep.experiment("four-cables-torn").replace(duration=0.7, faults=ep.Fault("torn", 0, 0.4)).run()
    assert "Forces after a fault depend on estimated data" in tracking.cautions[-1]
    force = np.linalg.norm(tracking.shoulder_force[tracking.times >= 0.4], axis=1).max()
    assert any(f"|F_s| reaches {force:.0f} N" in text for text in tracking.findings)
