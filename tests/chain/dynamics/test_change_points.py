"""Motions through flat parallelograms: problem A02 of the IFToMM benchmarks, N windows of bars of 1 m and 1 kg.

While the windows stay parallelograms all cranks turn by one angle φ from the x axis, with
φ'' = -c cos φ, c = 3 g (3 N + 1) / (2 (4 N + 1)).
"""

import numpy as np
import pytest
from published_problems import parallel_windows

from exo_pin.chain import ClosedChain

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
        assert event.order == 1
        assert abs(event.branch[0]) > 0.5
        k = int(np.searchsorted(run.times, event.time))
        assert end[k - 1, 1] * end[k, 1] < 0.0


@pytest.mark.parametrize("short", [0.1, 0.003, 1e-4, -1e-4, -0.003, -0.1])
def test_cranks_may_turn_back_next_to_the_line(short):
    # From hanging, with the speed that takes them to an angle above the line, or short of it.
    c = 3 * 9.81 * 4 / (2 * 5)
    run, _, error = moved(1, "revolute", -np.pi / 2, np.sqrt(2 * c * (np.sin(short) + 1)), np.linspace(0.0, 2.0, 21))
    assert error < 1e-4
    assert all(event.kind == "crossing" for event in run.events)
    assert bool(run.events) == (short >= 0.003)


def test_branches_of_one_tangent_are_told_apart_by_their_curvature():
    """A parallelogram that a second crank pushes to its flat pose and draws back, at its own dead centre.

    There the first crank turns by -s² of the driving angle s, so that parallelogram and antiparallelogram leave along
    one tangent, in which only the driving crank and its rod move.
    """
    mass = '<inertial mass="1" pos="{} 0 0" diaginertia=".01 .05 .05"/>'
    hinge = '<joint name="{}" axis="0 -1 0"/>'

    def bar(name, at, length, inside="", site=""):
        return (
            f'<body pos="{at}">{hinge.format(name)}{mass.format(length / 2)}'
            f'{inside}<site name="{name}_end" pos="{length} 0 0"/>{site}</body>'
        )

    # The driving crank, 0.3 m, stands 1.3 m below the first crank's end, at right angles to it; the rod is 1 m.
    bodies = bar("first", "0 0 0", 1.0, bar("coupler", "1 0 0", 2.0)) + bar("second", "2 0 0", 1.0)
    bodies += bar("driver", "1 0 -1.3", 0.3, bar("rod", "0.3 0 0", 1.0))
    text = (
        f'<mujoco><option gravity="0 0 0"/><worldbody>{bodies}</worldbody><equality>'
        '<connect name="window" site1="coupler_end" site2="second_end"/>'
        '<connect name="push" site1="rod_end" site2="first_end"/></equality></mujoco>'
    )
    chain = ClosedChain.from_mjcf(text)
    names = list(chain.model.names)[1:]
    crank = np.pi / 2 - 0.4
    start = np.zeros(5)
    # Of two circles: about the first crank's hinge, and about the driving crank's end.
    end = np.array([1.0, -1.3]) + 0.3 * np.array([np.cos(crank), np.sin(crank)])
    apart = np.hypot(*end)
    tip = apart / 2 * end / apart + np.sqrt(1.0 - (apart / 2) ** 2) * np.array([-end[1], end[0]]) / apart
    first = np.arctan2(tip[1], tip[0])
    values = {"first": first, "coupler": -first, "second": first, "driver": crank}
    values["rod"] = np.arctan2(*(tip - end)[::-1]) - crank
    start = chain.close(np.array([values[name] for name in names]))
    assert abs(start[names.index("second")] - first) < 1e-9
    J = chain.constraint_jacobian(start)
    motion = np.linalg.svd(J)[2][-1]
    run = chain.simulate(start, motion / motion[names.index("driver")], np.linspace(0.0, 0.8, 41))
    turned = run.q[:, names.index("second")]
    np.testing.assert_allclose(turned, run.q[:, names.index("first")], atol=1e-6)
    assert turned.max() > -1e-3
    assert turned[-1] < -0.02
    (crossing,) = run.events
    assert (crossing.kind, crossing.order) == ("crossing", 2)
    assert abs(run.q[np.searchsorted(run.times, crossing.time), names.index("driver")] - np.pi / 2) < 0.05
    # Cranks and coupler stand still along the common tangent.
    assert {names[k] for k in np.flatnonzero(np.abs(crossing.branch) > 1e-3)} == {"driver", "rod"}
