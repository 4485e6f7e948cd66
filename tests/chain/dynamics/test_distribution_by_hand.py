"""Programs of undetermined forces that are made up, against closed forms, SciPy's SLSQP and vertices of polytopes."""

import itertools

import numpy as np
import pytest
import scipy

from exo_pin import InfeasibleForces, InvalidInput
from exo_pin.chain.dynamics.force_distribution import (
    Bound,
    ForceDistribution,
    bounds_of,
    interval,
    self_stress_within,
    without_rounding,
)

INF = np.inf
SHARP = 1e-9


def made(metric, *bounds):
    """Bounds as (constant, effect, lower, upper)."""
    given = [Bound(f"b{k}", c, np.array(e, dtype=float), low, high) for k, (c, e, low, high) in enumerate(bounds)]
    return ForceDistribution(np.array(metric, dtype=float), given, SHARP)


def random_program(seed, free=2, count=3):
    rng = np.random.default_rng(seed)
    metric, effects = rng.normal(size=(5, 1 + free)), rng.normal(size=(count, free))
    constants = rng.normal(size=count)
    inner = rng.normal(size=free)  # within all bounds
    here = constants + effects @ inner
    low, high = here - rng.uniform(0.1, 1.0, count), here + rng.uniform(0.1, 1.0, count)
    return made(metric, *zip(constants, effects, low, high, strict=True))


@pytest.mark.parametrize("seed", range(5))
def test_the_centre_is_the_least_and_the_basis_is_orthonormal_in_the_metric(seed):
    program = random_program(seed)
    constant, effect = program.metric[:, 0], program.metric[:, 1:]
    np.testing.assert_allclose(program.centre, -np.linalg.pinv(effect) @ constant, atol=1e-12)
    y = np.random.default_rng(seed).normal(size=2)
    least = constant + effect @ program.centre
    moved = constant + effect @ (program.centre + program.basis @ y)
    assert moved @ moved - least @ least == pytest.approx(program.scale**2 * (y @ y))
    assert program.scale == max(np.abs(constant).max(), *(abs(bound.constant) for bound in program.bounds))
    C, c, names = program.limits
    D, d = program.limits_of_y
    z = program.centre + program.basis @ y
    u = program.bounded_directions.T @ (z - program.centre) / program.scale
    np.testing.assert_allclose(C @ u - c, D @ y - d, atol=1e-12)
    np.testing.assert_array_equal(c, d)
    for k, bound in enumerate(program.bounds):
        value = bound.constant + bound.effect @ z
        np.testing.assert_allclose(
            (C @ u - c)[2 * k : 2 * k + 2] * program.scale, [value - bound.upper, bound.lower - value]
        )
        assert names[2 * k : 2 * k + 2] == (f"b{k} at most {bound.upper:.6g}", f"b{k} at least {bound.lower:.6g}")


def test_a_program_of_zeros_has_the_scale_one():
    assert made([[0.0, 1.0]]).scale == 1.0
    assert made([[0.0, 1.0]], (-3.0, [1.0], -1, 1)).scale == 3.0
    assert made(np.zeros((0, 1))).centre.shape == (0,)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("aimed", [False, True])
def test_the_least_within_bounds_is_that_of_slsqp(seed, aimed):
    program, rng = random_program(seed), np.random.default_rng(seed + 50)
    objective = (rng.normal(size=4), rng.normal(size=(4, 2))) if aimed else None
    constant, effect = objective if aimed else (program.metric[:, 0], program.metric[:, 1:])
    z = self_stress_within(program, objective)
    for bound in program.bounds:
        value = bound.constant + bound.effect @ z
        assert bound.lower - 1e-7 <= value <= bound.upper + 1e-7
    rows = np.array([bound.effect for bound in program.bounds])
    here = np.array([bound.constant for bound in program.bounds])
    ends = np.array([(bound.lower, bound.upper) for bound in program.bounds])
    best = scipy.optimize.minimize(
        lambda z: float(np.sum((constant + effect @ z) ** 2)),
        np.linalg.lstsq(rows, ends.mean(axis=1) - here, rcond=None)[0],
        jac=lambda z: 2.0 * effect.T @ (constant + effect @ z),
        method="SLSQP",
        constraints=scipy.optimize.LinearConstraint(rows, ends[:, 0] - here, ends[:, 1] - here),
        options={"ftol": 1e-14, "maxiter": 300},
    )
    assert float(np.sum((constant + effect @ z) ** 2)) == pytest.approx(best.fun, rel=1e-6, abs=1e-9)


def test_among_equals_of_the_objective_the_metric_decides():
    """The objective sees the first number only; the metric's least has the second at one half of it."""
    program = made([[0, 1, 0], [0, 1, -2]], (0.0, [1.0, 0.0], 2.0, 3.0))
    z = self_stress_within(program, (np.zeros(1), np.array([[1.0, 0.0]])))
    np.testing.assert_allclose(z, [2.0, 1.0], atol=1e-6)
    np.testing.assert_allclose(self_stress_within(made([[0, 1, 0], [4, 0, 2]]), None), [0.0, -2.0], atol=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_intervals_are_those_of_the_vertices(seed):
    program, rng = random_program(seed), np.random.default_rng(seed + 99)
    effect, constant = rng.normal(size=2), float(rng.normal())
    rows = np.concatenate([[bound.effect, -bound.effect] for bound in program.bounds])
    sides = np.concatenate([
        [bound.upper - bound.constant, bound.constant - bound.lower] for bound in program.bounds
    ])  # fmt: skip
    values = []
    for pair in itertools.combinations(range(len(rows)), 2):
        A = rows[list(pair)]
        if abs(np.linalg.det(A)) < 1e-9:
            continue
        vertex = np.linalg.solve(A, sides[list(pair)])
        if (rows @ vertex <= sides + 1e-9).all():
            values.append(constant + effect @ vertex)
    np.testing.assert_allclose(interval(program, constant, effect), [min(values), max(values)], atol=1e-8)


def test_intervals_without_an_end_without_an_effect_and_beyond_the_bounds():
    one_sided = made([[1.0, 1.0]], (0.0, [1.0], 2.0, INF))
    np.testing.assert_allclose(interval(one_sided, 10.0, np.array([3.0])), [16.0, INF])
    np.testing.assert_allclose(interval(one_sided, 10.0, np.array([-3.0])), [-INF, 4.0])
    # What no bound holds can be any number; what nothing changes is one.
    held = made([[1.0, 1.0, 0.0], [0.0, 0.0, 1.0]], (0.0, [1.0, 0.0], -1.0, 1.0))
    assert interval(held, 5.0, np.array([0.0, 1.0])) == (-INF, INF)
    np.testing.assert_allclose(interval(held, 5.0, np.array([2.0, 0.5 * SHARP])), [3.0, 7.0])
    assert interval(held, 5.0, np.array([2.0, 2.0 * SHARP])) == (-INF, INF)
    assert interval(made([[1.0, 1.0]]), 4.0, np.zeros(1)) == (4.0, 4.0)
    assert held.bounded_directions.shape == (2, 1)
    assert made([[1.0, 1.0]], (0.0, [0.5 * SHARP], -1, 1)).bounded_directions.shape == (1, 0)
    assert made([[1.0, 1.0]], (0.0, [2.0 * SHARP], -1, 1)).bounded_directions.shape == (1, 1)


def test_bounds_that_contradict_each_other_are_named_with_how_much_is_missing():
    program = made(
        [[1.0, 1.0]], (0.0, [1.0], 2.0, INF), (0.0, [2.0], -INF, 1.0), (0.0, [1.0], -9.0, 9.0), (0.0, [1.0], -INF, 8.0)
    )
    with pytest.raises(InfeasibleForces) as refused:
        self_stress_within(program, None)
    # The least t with 2 - z <= t and 2 z - 1 <= t.
    assert refused.value.excess == pytest.approx(1.0)
    assert sorted(refused.value.bounds) == ["b0 at least 2", "b1 at most 1"]
    # Without a self-stress the values themselves count.
    none = made([[1.0]], (3.0, [], 0.0, 2.0))
    with pytest.raises(InfeasibleForces) as refused:
        self_stress_within(none, None)
    assert refused.value.excess == pytest.approx(1.0)
    assert self_stress_within(made([[1.0]], (3.0, [], 0.0, 3.0)), None).shape == (0,)
    assert self_stress_within(made([[1.0]]), None).shape == (0,)


def test_rounding_is_taken_out_row_by_row_and_direction_by_direction():
    effect = np.array([[1.0, 0.0], [0.5 * SHARP, 0.0], [2.0 * SHARP, 0.0]])
    found = without_rounding(effect, SHARP)
    np.testing.assert_allclose(found, [[1.0, 0.0], [0.0, 0.0], [2.0 * SHARP, 0.0]], atol=1e-16)
    # Rows that are parallel but for rounding change along one direction.
    parallel = np.array([[1.0, 1.0], [1.0, 1.0 + 0.5 * SHARP]])
    assert np.linalg.matrix_rank(parallel, tol=1e-12) == 2
    assert np.linalg.matrix_rank(without_rounding(parallel, SHARP), tol=1e-12) == 1
    apart = np.array([[1.0, 1.0], [1.0, 1.0 + 1e-3]])
    np.testing.assert_allclose(without_rounding(apart, SHARP), apart, atol=1e-15)


def test_bounds_are_of_each_component_that_has_one_with_their_margins():
    constant, effect = np.array([1.0, 2.0, 3.0]), np.arange(6.0).reshape(3, 2)
    found = bounds_of(
        "xyz", constant, effect, ([-INF, 0.0, -INF], [INF, INF, 5.0]), "it", (-0.5, np.array([1.0, 2.0, 3.0]))
    )
    assert [(bound.name, bound.constant, bound.lower, bound.upper) for bound in found] == [
        ("y", 2.0, -0.5, INF), ("z", 3.0, -INF, 8.0),
    ]  # fmt: skip
    np.testing.assert_array_equal([bound.effect for bound in found], effect[1:])
    assert [(bound.lower, bound.upper) for bound in bounds_of("xyz", constant, effect, (-1, 4), "it")] == [
        (-1.0, 4.0)
    ] * 3
    assert len(bounds_of("xyz", constant, effect, (2.0, 2.0), "it")) == 3
    for wrong in ((0.0,), (0.0, 1.0, 2.0), ([0.0, 0.0], 1.0), (np.nan, 1.0), (0.0, np.nan), 3.0):
        with pytest.raises(InvalidInput, match="expected it as"):
            bounds_of("xyz", constant, effect, wrong, "it")
    for wrong in ((2.0, 1.0), ([0.0, 0.0, 2.0], 1.0), (INF, INF), (-INF, -INF)):
        with pytest.raises(InvalidInput, match="lower bounds at most"):
            bounds_of("xyz", constant, effect, wrong, "it")
