"""What is called possible and usual of a muscle: bounds of exact planes, digits of columns, single measurements."""

import numpy as np
import pytest
from scipy import stats

from exo_pin import InvalidInput
from exo_pin.muscle.identification.plausibility import as_measurements, require_possible
from exo_pin.muscle.identification.regimes import (
    SECOND_ORDER,
    design_matrix,
    leave_one_out_p,
    regimes,
    resolution_of,
    rounding_variance,
)

BAR, LENGTH = 1e5, 0.3


def plane(top=4.0, end=0.28, area=6.0, tube=0.4, diameter=0.02, length=LENGTH):
    """States of a muscle F = P (c_0 + c_1 ε) + s_0: greatest pressure, bar, strain where the pull ends there, pull over
    pressure times cross-section, least pressure that pulls, bar.
    """
    bar, strain = (grid.ravel() for grid in np.meshgrid(np.linspace(0.6, 1.0, 5) * top, np.linspace(0.0, 0.1, 5)))
    gain = area * np.pi / 4.0 * diameter**2 * BAR
    pull = bar * gain - bar * strain * (gain - tube * gain / top) / end - tube * gain
    return length * strain, BAR * bar, pull


USUAL = [  # what is changed, its bounds, the words, the unit and how it is written
    ("top", (1.0, 10.0), "a highest pressure", " bar", 1.0),
    ("end", (0.15, 0.6), "a pull that ends at a strain", " %", 100.0),
    ("area", (2.5, 16.0), "a pull over pressure times cross-section", "", 1.0),
    ("tube", (-0.6, 1.0), "a least pressure that pulls", " bar", 1.0),
]


@pytest.mark.parametrize(("name", "bounds", "words", "unit", "factor"), USUAL)
def test_what_is_unusual_is_said_with_its_bounds(name, bounds, words, unit, factor):
    assert as_measurements(*plane(), LENGTH, 0.02)[3] == ()
    for bound, outward in zip(bounds, (-1.0, 1.0), strict=True):
        for side in (-1.0, 1.0):
            value = bound + 0.02 * side * abs(bound)
            if name == "top" and value > 10.0:
                continue  # that is impossible
            cautions = as_measurements(
                *plane(**{name: value} | ({"tube": 0.1} if name == "top" else {})), LENGTH, 0.02
            )[3]
            low, high = (f"{factor * end:.2g}" for end in bounds)
            said = f"{words} of {factor * value:.2g}{unit} (usual {low} to {high})"
            assert any(said in text for text in cautions) == (side == outward), (value, cautions)


@pytest.mark.parametrize("factor", [0.001, 0.01, 0.1, 10.0, 100.0, 1000.0])
def test_a_length_in_another_unit_is_named(factor):
    x, p, f = plane(length=LENGTH)
    try:
        text = str(as_measurements(x, p, f, LENGTH / factor, 0.02)[3])
    except InvalidInput as refused:
        text = str(refused)
    assert "the nominal length looks like 300 mm" in text, text


@pytest.mark.parametrize(("slender", "unusual"), [(3.9, True), (4.1, False), (98.0, False), (102.0, True)])
def test_without_a_diameter_the_pull_bounds_the_slenderness(slender, unusual):
    """A cross-section that makes the pull six times the pressure on it."""
    diameter = LENGTH / slender
    (*_, cautions) = as_measurements(*plane(diameter=diameter), LENGTH)
    said = f"a length over diameter of {slender:.2g} (usual 4 to 1e+02)"
    assert (
        any(said in text and text.endswith("or give the diameter, if the muscle is so.") for text in cautions)
        == unusual
    )


def test_bounds_of_what_a_muscle_can_do():
    for strain, bar, possible in [
        (-0.0499, 1.0, True), (-0.0501, 1.0, False), (0.3999, 1.0, True), (0.4001, 1.0, False),
        (0.1, 0.0, True), (0.1, -0.001, False), (0.1, 9.999, True), (0.1, 10.001, False),
    ]:  # fmt: skip
        states = np.array([0.1 * LENGTH, strain * LENGTH]), np.array([BAR, bar * BAR]), LENGTH
        if possible:
            require_possible(*states)
        else:
            with pytest.raises(InvalidInput, match="write the unit in the header"):
                require_possible(*states)
    x, p, f = plane()
    for share, refused in ((0.049, False), (0.051, True)):
        f[0] = -share * f.max()
        if refused:
            with pytest.raises(InvalidInput, match="measurement 1 alone is out of this range"):
                as_measurements(x, p, f, LENGTH, 0.02)
        else:
            as_measurements(x, p, f, LENGTH, 0.02)
    # Single rows: no more than a tenth of them.
    x, p, f = plane()
    for count, alone in ((2, True), (3, False)):
        with pytest.raises(InvalidInput) as caught:
            as_measurements(np.where(np.arange(25) < count, 1e3 * x + 100.0, x), p, f, LENGTH, 0.02)
        assert ("measurement 1, 2 alone" in str(caught.value)) == alone
    with pytest.raises(InvalidInput, match="a pull that rises with the pressure at one contraction"):
        as_measurements(x, p, f.max() + f.min() - f, LENGTH, 0.02)


@pytest.mark.parametrize(
    ("values", "step"),
    [([0.0, 0.0], 0.0), ([], 0.0), ([0.25, 0.1, 3.0], 0.01), ([3e5, 2.4e5], 1e4), ([np.pi, 1.0], 0.0), ([20, 300], 10)],
)
def test_the_last_digit_of_a_column(values, step):
    assert resolution_of(np.array(values, dtype=float)) == pytest.approx(step, rel=1e-12)


def test_rounding_adds_the_variance_of_its_steps_by_the_slopes_of_the_law():
    rng = np.random.default_rng(1)
    x, p = rng.uniform(0.01, 0.08, 2000), rng.uniform(1.0, 4.0, 2000) * BAR

    def law(x, p):
        return (p / BAR) * (900.0 * x**2 - 330.0 * x + 20.0) + 40.0 * x**2 - 11.0 * x - 3.0

    rounded = x.round(3), (p / BAR).round(1) * BAR, law(x, p).round(0)
    off = rounded[2] - law(*rounded[:2])
    assert rounding_variance(*rounded, SECOND_ORDER) == pytest.approx((off**2).mean(), rel=0.05)
    assert rounding_variance(x, p, law(x, p), SECOND_ORDER) == 0.0


def test_each_measurement_against_the_law_of_all_others():
    rng = np.random.default_rng(2)
    matrix, force = rng.normal(size=(14, 3)), rng.normal(size=14)
    found = leave_one_out_p(matrix, force, 0.0)
    for i in range(14):
        rest = np.arange(14) != i
        values, squares = np.linalg.lstsq(matrix[rest], force[rest], rcond=None)[:2]
        spread = squares[0] / 10.0 * (1.0 + matrix[i] @ np.linalg.inv(matrix[rest].T @ matrix[rest]) @ matrix[i])
        t = (force[i] - matrix[i] @ values) / np.sqrt(spread)
        assert found[i] == pytest.approx(2.0 * stats.t(10).sf(abs(t)), rel=1e-9)
    # A stated variance, larger than what is found, counts; without freedom nothing is unlikely.
    assert (leave_one_out_p(matrix, force, 100.0) > 0.5).all()
    assert leave_one_out_p(matrix[:4], force[:4], 0.0).tolist() == [1.0] * 4


@pytest.mark.parametrize(("planted", "size"), [((), 40), ((7,), 39), ((7, 30), 38)])
def test_one_law_its_outliers_and_where_it_ends(planted, size):
    rng = np.random.default_rng(3)
    x, p = np.linspace(0.08, 0.0, 40), rng.uniform(2.0, 4.0, 40) * BAR
    law = (p / BAR) * (900.0 * x**2 - 330.0 * x + 20.0) + 5.0
    f = law + rng.normal(0.0, 0.05, 40)
    f[list(planted)] += 20.0
    matrix, order, found, outliers = regimes(x, p, f, SECOND_ORDER, 0.01)
    assert (found, sorted(outliers)) == (size, list(planted))
    assert order.tolist() == [i for i in range(40) if i not in planted]
    columns = design_matrix(x, p, SECOND_ORDER)
    np.testing.assert_allclose(matrix, columns / np.linalg.norm(columns, axis=0), rtol=1e-12)
    # A braid that takes over below 20 mm of contraction.
    stiff = f + np.where(x < 0.02, 2e4 * (0.02 - x), 0.0)
    if not planted:
        assert abs(regimes(x, p, stiff, SECOND_ORDER, 0.01)[2] - (x >= 0.02).sum()) <= 1
