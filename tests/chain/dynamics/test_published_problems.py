"""Problems that others published, with their values; A02 is in test_change_points.py, and benchmarks time them all."""

import numpy as np
import published_problems as problems
import pytest

import exo_pin as ep

#: Maker, largest error, m or rad: that of the printed digits, or of the integrator's tolerance.
PROBLEMS = [
    (problems.pendulum, 1e-7),
    (problems.squeezer, 1e-7),
    (problems.bricard, 1e-6),
    (problems.diagonal_spring, 1e-7),
    (problems.governor, 1e-6),
]


@pytest.mark.parametrize(("make", "bound"), PROBLEMS)
def test_the_motion_has_the_published_values(make, bound):
    problem = make()
    run, error = problem.run()
    assert error < bound
    assert run.energy_drift < 1e-7
    assert run.opening.max() < 1e-11
    # None of them passes a singular configuration.
    assert not run.events


def test_the_squeezer_starts_with_the_published_accelerations():
    problem = problems.squeezer()
    a = problem.chain.forward_dynamics(problem.q, problem.v, problem.efforts).a
    np.testing.assert_allclose(a[:2], [14222.4439199541, -10666.8329399656], rtol=1e-10)


def test_a_strong_damper_costs_no_steps():
    # 2 kg on a damper, d/m = 2e4/s, for a minute, pulled by its weight times cos t.
    block = '<joint name="z" type="slide" axis="0 0 -1" damping="4e4"/><geom size="0.1" mass="2"/>'
    chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{block}</body></worldbody></mujoco>")
    times, pull = np.linspace(0.0, 60.0, 7), 2 * 9.81
    run = chain.simulate([0.0], [0.0], times, lambda t, q, v: [pull * (np.cos(t) - 1.0)])
    # m v' + d v = pull cos t, long after the start.
    late, T = times[1:], 2 / 4e4
    np.testing.assert_allclose(run.v[1:, 0], pull / 4e4 * (np.cos(late) + T * np.sin(late)) / (1 + T * T), rtol=1e-7)
    assert run.steps < 500  # an explicit method would need 200,000
