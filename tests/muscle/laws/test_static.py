"""Static models: derivatives, inverses, validity, scaling, and the law of Chou and Hannaford against virtual work."""

import math

import numpy as np
import pytest

from exo_pin import InvalidInput, UnknownName
from exo_pin.muscle import (
    ChouHannaford,
    OutsideValidity,
    PolynomialModel,
    Validity,
    muscle_model,
    muscle_models,
)

WIDE = Validity(strain=(0.0, 0.25), pressure=(0.0, 4e5))


def all_models():
    fields = {"reference_length": 0.3, "validity": WIDE}
    extra = [
        ChouHannaford(name="chou", braid_length=0.36, turns=7.3, **fields),
    ]
    return [muscle_model(name) for name in muscle_models()] + extra


def inside(model, n=40, seed=3):
    """States inside the model's range, drawn from its box."""
    rng = np.random.default_rng(seed)
    x = rng.uniform(*model.validity.strain, 20 * n) * model.length
    p = rng.uniform(*model.validity.pressure, 20 * n)
    ok = ~np.ma.getmaskarray(model.force(x, p, outside="mark"))
    assert ok.sum() >= n
    return x[ok][:n], p[ok][:n]


@pytest.mark.parametrize("model", all_models(), ids=lambda m: m.name)
@pytest.mark.parametrize("length", [None, 0.15])
def test_derivatives_are_those_of_the_force(model, length):
    model = model if length is None else model.scaled(length)
    x, p = inside(model)
    # Central differences of polynomials of low degree: the error is h² times a third derivative, far below 1e-6.
    h, q = 1e-5 * model.length, 1.0
    slope = (model.unchecked_force(x + h, p) - model.unchecked_force(x - h, p)) / (2 * h)
    gain = (model.unchecked_force(x, p + q) - model.unchecked_force(x, p - q)) / (2 * q)
    stiffness, pressure_gain = model.stiffness(x, p), model.pressure_gain(x, p)
    np.testing.assert_allclose(stiffness, slope, rtol=1e-6, atol=1e-6 * np.abs(slope).max())
    np.testing.assert_allclose(pressure_gain, gain, rtol=1e-6, atol=1e-6 * np.abs(gain).max())


@pytest.mark.parametrize("name", muscle_models())
@pytest.mark.parametrize("length", [None, 0.25])
def test_inverses_come_back(name, length):
    model = muscle_model(name, nominal_length=length)
    x, p = inside(model)
    force = model.force(x, p)
    np.testing.assert_allclose(model.pressure_for(force, x), p, rtol=1e-9)
    # At a given force and pressure the stable contraction; in the range it is the only one.
    np.testing.assert_allclose(model.contraction_for(force, p), x, rtol=1e-9)
    assert (model.stiffness(x, p) < 0).all()


def test_second_order_inverse_is_the_stable_root_of_the_quadratic():
    model = muscle_model("tang-optimised")
    x, p = inside(model)
    force = model.force(x, p)
    c = model.coefficients
    a, b = c[2, 1] * p + c[2, 0], c[1, 1] * p + c[1, 0]
    root = (-b - np.sqrt(b**2 - 4 * a * (c[0, 1] * p + c[0, 0] - force))) / (2 * a)
    np.testing.assert_allclose(model.contraction_for(force, p), root, rtol=1e-10)


def test_outside_raises_with_the_bound_or_marks():
    model = muscle_model("best")
    with pytest.raises(OutsideValidity, match=r"strain at least 0\.0410.*got 0\.0333") as caught:
        model.force(0.010, 3e5)
    assert isinstance(caught.value, ValueError)
    with pytest.raises(OutsideValidity, match="pressure at most 406900 Pa, got 500000 Pa"):
        model.force(0.05, 5e5)
    with pytest.raises(OutsideValidity, match="cannot push"):
        model.force(0.075, 1.5e5)
    with pytest.raises(OutsideValidity, match="capability limit"):
        model.force(0.0124, 4.06e5)
    with pytest.raises(OutsideValidity, match="2 states") as caught:
        model.force([[0.05, 0.01], [0.02, 0.3]], 3e5)
    assert caught.value.index == (0, 1)
    assert caught.value.count == 2
    marked = model.force([0.05, 0.01, 0.075], [3e5, 3e5, 1.5e5], outside="mark")
    np.testing.assert_array_equal(marked.mask, [False, True, True])
    np.testing.assert_allclose(
        marked.data, model.unchecked_force(np.array([0.05, 0.01, 0.075]), np.array([3e5, 3e5, 1.5e5]))
    )
    with pytest.raises(UnknownName, match="mark, raise"):
        model.force(0.05, 3e5, outside="ignore")


def test_ends_of_the_range_are_inside():
    model = muscle_model("best").scaled(0.25)
    low, high = model.validity.strain
    for strain in (low, high):
        model.force(strain * 0.25, 2.5e5)
    for pressure in model.validity.pressure:
        model.capability(pressure)


def test_impossible_states_are_reported():
    model = muscle_model("best")
    with pytest.raises(OutsideValidity, match=r"reaches, got 300 N at a contraction of 0\.05 m"):
        model.pressure_for([20.0, 300.0], 0.05)
    marked = model.pressure_for([20.0, 300.0], 0.05, outside="mark")
    np.testing.assert_array_equal(marked.mask, [False, True])
    assert np.isnan(marked.data[1])
    with pytest.raises(OutsideValidity, match="at a pressure of 200000 Pa"):
        model.contraction_for(200.0, 2e5)
    # A force that a pressure below the range would give is found, and marked.
    low = model.pressure_for(2.0, 0.02, outside="mark")
    assert low.mask
    assert abs(model.unchecked_force(0.02, float(low.data)) - 2.0) < 1e-9


@pytest.mark.parametrize("bad", [np.nan, np.inf, "a", None, 1j])
def test_bad_input_is_named(bad):
    model = muscle_model("best")
    with pytest.raises(InvalidInput, match="contraction"):
        model.force(bad, 3e5)
    with pytest.raises(InvalidInput, match="pressure"):
        model.force(0.05, bad)
    with pytest.raises(InvalidInput, match="nominal_length"):
        model.scaled(bad)


def test_more_bad_input():
    model = muscle_model("best")
    with pytest.raises(InvalidInput, match="broadcast"):
        model.force(np.zeros(2), np.zeros(3))
    with pytest.raises(InvalidInput, match="above zero"):
        model.scaled(-0.1)
    with pytest.raises(UnknownName, match="tang-optimised"):
        muscle_model("tang-optimized")
    with pytest.raises(InvalidInput, match="lower below upper"):
        Validity(strain=(0.2, 0.1), pressure=(0, 1))
    with pytest.raises(InvalidInput, match="zero or more"):
        Validity(strain=(0.0, 0.1), pressure=(-1, 1))
    with pytest.raises(InvalidInput, match="whole numbers"):
        PolynomialModel(coefficients={(0.5, 1): 1.0}, name="", reference_length=0.3, validity=WIDE)
    with pytest.raises(InvalidInput, match="at least one term"):
        PolynomialModel(coefficients={}, name="", reference_length=0.3, validity=WIDE)
    with pytest.raises(InvalidInput, match="Validity"):
        PolynomialModel(coefficients={(0, 0): 1.0}, name="", reference_length=0.3, validity=None)


def test_stacks_broadcast():
    model = muscle_model("best")
    x = np.linspace(0.02, 0.05, 4)
    pressures = np.linspace(2.5e5, 4e5, 3)
    force = model.force(x[:, np.newaxis], pressures)
    np.testing.assert_allclose(force, [[float(model.force(a, p)) for p in pressures] for a in x], rtol=1e-14)
    found = model.pressure_for(np.array([[20.0], [30.0]]), x)
    np.testing.assert_allclose(found, [[float(model.pressure_for(f, a)) for a in x] for f in (20.0, 30.0)], rtol=1e-12)
    lifted = model.capability(np.array([[2e5, 2.5e5, 3e5]] * 2))
    np.testing.assert_allclose(lifted, [[float(model.capability(p)) for p in (2e5, 2.5e5, 3e5)]] * 2, rtol=1e-14)
    assert (np.diff(lifted) > 0.0).all()


def test_scaling_reads_the_law_at_equal_strain():
    # 25 % of a 150 mm muscle at 4 bar. Taking its 37.5 mm for those of the 300 mm muscle would give 3.7 times more.
    for name, scaled, naive in (("tang-optimised", 13.00, 47.57), ("tang-3-25", 12.79, 47.50)):
        model = muscle_model(name)
        short = muscle_model(name, nominal_length=0.15)
        assert abs(short.force(0.0375, 4e5) - scaled) < 0.005
        assert abs(model.force(0.0375, 4e5) - naive) < 0.005
        assert short.force(0.0375, 4e5) == model.force(0.075, 4e5)
        # The same strain over half the length: twice the stiffness.
        np.testing.assert_allclose(short.stiffness(0.03, 3e5), 2 * model.stiffness(0.06, 3e5), rtol=1e-12)
        assert short.capability(3e5) == model.capability(3e5)


def test_capability_is_the_lower_of_line_and_force_at_least_contraction():
    model = muscle_model("best")
    p = np.linspace(*model.validity.pressure, 30)
    most = model.capability(p)
    line = model.validity.capability[0] * p + model.validity.capability[1]
    force = model.unchecked_force(model.validity.strain[0] * 0.3, p)
    np.testing.assert_allclose(most, np.minimum(line, force))
    assert (line < force).any()
    assert (line > force).any()
    # Nothing inside the range pulls more.
    x = np.linspace(*model.validity.strain, 50) * 0.3
    inside_force = model.force(x[:, np.newaxis], p, outside="mark")
    assert (inside_force.max(axis=0) <= most + 1e-9).all()


def test_chou_hannaford_is_virtual_work():
    model = next(m for m in all_models() if m.name == "chou")
    x, p = inside(model)

    def volume(contraction):
        return 0.25 * np.pi * model.diameter(contraction) ** 2 * (0.3 - contraction)

    h = 1e-6
    # dL = -dx, so F = -P dV/dL = P dV/dx.
    np.testing.assert_allclose(model.force(x, p), p * (volume(x + h) - volume(x - h)) / (2 * h), rtol=1e-7)
    with pytest.raises(InvalidInput, match="thread"):
        model.diameter(-0.1)


def test_an_ideal_braid_pulls_as_its_angle_at_rest_says():
    """Against F = π r² P (a (1 - ε)² - b), a = 3/tan²α and b = 1/sin²α, the form of Tondu and Lopez in Table 2-4."""
    angle, length, radius = math.radians(25), 0.3, 0.003
    braid, turns = length / math.cos(angle), length * math.tan(angle) / (2 * math.pi * radius)
    chou = ChouHannaford(braid_length=braid, turns=turns, name="", reference_length=length, validity=WIDE)
    x, p = inside(chou)
    a, b = 3 / math.tan(angle) ** 2, 1 / math.sin(angle) ** 2
    expected = math.pi * radius**2 * p * (a * (1 - x / length) ** 2 - b)
    np.testing.assert_allclose(chou.force(x, p), expected, rtol=1e-12)
    np.testing.assert_allclose(chou.diameter(0.0), 2 * radius, rtol=1e-12)
    # The force vanishes where the threads stand at 54.7 degrees to the axis.
    longest = length - braid * math.cos(math.atan(math.sqrt(2)))
    assert abs(chou.unchecked_force(longest, 3e5)) < 1e-9


@pytest.mark.parametrize("name", muscle_models())
def test_every_set_has_its_source_and_behaves_like_a_muscle(name):
    model = muscle_model(name)
    assert model.source
    assert model.notes
    assert model.length == 0.3
    x, p = inside(model, n=200, seed=5)
    assert (model.pressure_gain(x, p) > 0).all()
    assert (model.stiffness(x, p) < 0).all()
