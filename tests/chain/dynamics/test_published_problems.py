"""Problems that others published, with their values; A02 is in test_change_points.py, and benchmarks time them all."""

import numpy as np
import published_problems as problems
import pytest

#: Maker, largest error, m or rad: that of the printed digits, or of the integrator's tolerance.
PROBLEMS = [
    (problems.pendulum, 1e-7),
    (problems.squeezer, 1e-7),
    (problems.bricard, 1e-6),
    (problems.diagonal_spring, 1e-7),
    pytest.param(problems.governor, 1e-6, marks=pytest.mark.full),
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
