"""What a search says it has found, of results that are given."""

from types import SimpleNamespace

import exo_pin as ep
from exo_pin.workspace import optimisation


def run(number, merit, evaluations):
    return SimpleNamespace(number=number, point=[0.5], merit=merit, objectives={}, evaluations=evaluations)


def candidate(number, *indices, works=True, **objectives):
    checks = tuple(SimpleNamespace(works=works, workspace=SimpleNamespace(index=index)) for index in indices)
    exo = ep.load("four-cables")
    return optimisation.Candidate(exo, run(number, 0.1, 24), checks, {"index": min(indices), **objectives})


def test_words_of_what_was_found():
    first, second = candidate(2, 0.9, 0.8, device_mass=1.25), candidate(4, 0.85, 0.85, works=False, device_mass=0.5)
    runs = (run(2, 0.1, 48), run(4, 0.2, 24))
    names, values = ("index", "device_mass"), ({"index": 0.8}, {"index": 0.85})
    found = optimisation.Optimised((first, second), runs, names, values, stopped=True)
    assert (first.index, first.check, first.works, second.works) == (0.8, first.checks[0], True, False)
    assert found.best_candidate is second
    assert found.best is second.design
    assert found.evaluations == 72
    assert found.spread == (0.8, 0.85)
    lines = str(found).splitlines()
    assert lines[:3] == [
        "2 runs, 72 designs evaluated, 2 reported.",
        "Inside on the full grid, over the runs: 80.0 to 85.0 %.",
        "The search was stopped by hand: this is the best so far.",
    ]
    assert "Run 2 (index 0.8, device_mass 1.25 on the full grid): the design works." in lines
    assert "Run 4 (index 0.85, device_mass 0.5 on the full grid)." in lines
    assert any(line.startswith("Moving mass besides the arm: ") for line in lines)
    start = candidate(-1, 0.8, device_mass=2.0)
    one = str(optimisation.Optimised((second,), runs[1:], names, values[1:], start))
    assert one.startswith(
        "1 run, 24 designs evaluated, 1 reported.\nThe start: 80.0 % of the full grid. The best: 85.0 %.\n"
    )
    assert "device_mass: 2 of the start, 0.5 of the best." in one
    assert "stopped by hand" not in one
    kept = str(optimisation.Optimised((start,), runs[1:], ("index",), values[1:], start))
    assert "The best: 80.0 %, which is the start: no run was better." in kept
    assert "The start (index 0.8 on the full grid): the design works." in kept
