"""Motions through flat parallelograms: problem A02 of the IFToMM benchmarks, N windows of bars of 1 m and 1 kg.

While the windows stay parallelograms all cranks turn by one angle φ from the x axis, with
φ'' = -c cos φ, c = 3 g (3 N + 1) / (2 (4 N + 1)).
"""

import numpy as np
import pytest
from published_problems import parallel_windows, windows

from exo_pin.core.errors import SimulationStopped

#: Place of the first crank's end at 1, 5 and 10 s from upright with 1 m/s, m.
A02 = {
    1: ((-0.26071268, -0.96541644), (-0.94490819, -0.32733549), (0.47838506, 0.87815018)),
    2: ((-0.19502030, -0.98079921), (-0.81131046, -0.58461555), (0.32845811, 0.94451854)),
    40: ((-0.11535688, -0.99332411), (-0.54019005, -0.84154305), (0.18051223, 0.98357274)),
}


def moved(N, kind, start, speed, times):
    """A run from cranks at an angle, rad, with a speed, rad/s, and the largest error of the first crank's end, m."""
    problem = parallel_windows(N, kind, start, speed, times)
    run, error = problem.run()
    return run, np.column_stack([np.sin(run.q[:, 0]), np.cos(run.q[:, 0])]), error


@pytest.mark.parametrize(
    ("N", "kind"),
    [
        (1, "revolute"),
        (1, "spherical"),
        (2, "revolute"),
        (2, "spherical"),
        pytest.param(40, "spherical", marks=pytest.mark.full),
    ],
)
def test_windows_stay_parallelograms(N, kind):
    run, end, error = moved(N, kind, np.pi / 2, -1.0, np.linspace(0.0, 10.0, 101))
    np.testing.assert_allclose(end[[10, 50, 100]], A02[N], atol=2e-6)
    assert error < 2e-6
    assert run.energy_drift < 1e-7
    assert np.array_equal(run.opening[np.isfinite(run.opening)], run.opening)
    assert run.opening.max() < 1e-9
    # The cranks turn once in less than two seconds, and are flat twice a turn.
    crossings = [event for event in run.events if event.kind == "crossing"]
    assert len(crossings) == len(run.events) == 10
    assert "b0" in crossings[0].joints
    for event in crossings:
        k = int(np.searchsorted(run.times, event.time))
        assert end[k - 1, 1] * end[k, 1] < 0.0


@pytest.mark.full
@pytest.mark.parametrize("kind", ["revolute", "spherical"])
@pytest.mark.parametrize(("N", "count"), [(1, 25), (3, 10), (10, 4)])
def test_no_start_speed_is_silently_wrong(N, count, kind):
    right = 0
    speeds = np.random.default_rng(N).uniform(0.2, 2.0, count)
    for speed in speeds:
        try:
            right += moved(N, kind, np.pi / 2, -speed, np.linspace(0.0, 10.0, 21))[2] < 1e-3
        except SimulationStopped:
            continue
    assert right == len(speeds)


@pytest.mark.parametrize("short", [0.1, 0.003, 1e-4, -1e-4, -0.003, -0.1])
def test_cranks_may_turn_back_next_to_the_line(short):
    # From hanging, with the speed that takes them to an angle above the line, or short of it.
    c = 3 * 9.81 * 4 / (2 * 5)
    run, _, error = moved(1, "revolute", -np.pi / 2, np.sqrt(2 * c * (np.sin(short) + 1)), np.linspace(0.0, 2.0, 21))
    assert error < 1e-4
    assert all(event.kind == "crossing" for event in run.events)
    assert bool(run.events) == (short >= 0.003)


def test_a_flat_window_at_rest_is_not_decided():
    # It may fall as a parallelogram or as an antiparallelogram.
    chain = windows(1, "spherical")
    with pytest.raises(SimulationStopped, match="singular"):
        chain.simulate([np.pi / 2, -np.pi / 2, np.pi / 2], np.zeros(3), np.linspace(0.0, 1.0, 11))
