import numpy as np
import pytest

import exo_pin as ep
from exo_pin import InvalidInput, UnknownName
from exo_pin.design import ACTUATOR_FAMILIES
from exo_pin.design.actuator_families import LEAST_LENGTH, fitting_stroke, stroke_of_length


def ends(stroke):
    """Shortest and longest joint-to-joint length."""
    return (
        stroke.end_fitting + stroke.shortest * stroke.nominal_length,
        stroke.end_fitting + stroke.longest * stroke.nominal_length,
    )


def test_a_muscle_contracts_by_a_quarter():
    # 0.44 m at rest, of which 0.04 m are fittings: 0.1 m of contraction.
    assert ends(fitting_stroke("pneumatic muscle", 0.34, 0.44)) == pytest.approx((0.34, 0.44))
    stroke = fitting_stroke("pneumatic muscle", 0.35, 0.44)
    assert (stroke.nominal_length, stroke.shortest, stroke.end_fitting) == pytest.approx((0.4, 0.75, 0.04))
    with pytest.raises(InvalidInput, match="cannot be shorter than 340 mm"):
        fitting_stroke("pneumatic muscle", 0.33, 0.44)


def test_a_cable_takes_any_length_down_to_its_free_length():
    assert ends(fitting_stroke("cable", 0.03, 2.0)) == pytest.approx((0.03, 2.0))
    with pytest.raises(InvalidInput, match="30 mm"):
        fitting_stroke("cable", 0.02, 2.0)


def test_a_linear_actuator_is_twice_its_stroke_and_its_dead_length():
    # Retracted 0.25 m = 0.1 m dead length and 0.15 m of stroke; extended 0.4 m.
    assert ends(fitting_stroke("linear", 0.25, 0.4)) == pytest.approx((0.25, 0.4))
    # A shorter stroke in the same limb leaves room for a fitting.
    stroke = fitting_stroke("linear", 0.3, 0.4)
    assert stroke.end_fitting == pytest.approx(0.4 - 0.3)
    assert ends(stroke) == pytest.approx((0.3, 0.4))
    with pytest.raises(InvalidInput, match="choose another family"):
        fitting_stroke("linear", 0.24, 0.4)


@pytest.mark.parametrize("family", ACTUATOR_FAMILIES)
def test_a_fitted_stroke_takes_what_was_demanded(family):
    rng = np.random.default_rng(0)
    fitted = 0
    for _ in range(50):
        long = rng.uniform(0.15, 0.6)
        short = rng.uniform(0.3, 1.0) * long
        share = {"pneumatic muscle": 0.75, "cable": 0.0, "linear": 0.5}[family]
        if short < share * long + (1.0 - share) * LEAST_LENGTH[family]:
            with pytest.raises(InvalidInput):
                fitting_stroke(family, short, long)
            continue
        fitted += 1
        low, high = ends(fitting_stroke(family, short, long))
        assert low <= short + 1e-12
        assert high == pytest.approx(long)
    assert fitted >= 5


def test_every_family_has_its_sizes_and_others_are_refused():
    assert set(LEAST_LENGTH) == set(ACTUATOR_FAMILIES)
    with pytest.raises(UnknownName):
        fitting_stroke("spring", 0.1, 0.2)
    with pytest.raises(InvalidInput, match="shortest <= longest"):
        fitting_stroke("cable", 0.3, 0.2)


def test_speed_and_power_survive_a_file(tmp_path):
    exo = ep.load("prototype")
    actuator = ep.Actuator("cable", pull_limit=300.0, speed_limit=0.25, power_limit=40.0)
    exo = exo.replace(limbs=[ep.Limb("SPS", actuator=actuator)] * 3)
    exo.save(tmp_path / "mine.toml")
    assert ep.load(tmp_path / "mine.toml").limbs[0].actuator == actuator
    for field in ("speed_limit", "power_limit"):
        with pytest.raises(InvalidInput, match=field):
            ep.Actuator("cable", **{field: 0.0})


def test_travel_limit_of_a_cable_that_a_muscle_pulls():
    stroke = fitting_stroke("cable", 0.30, 0.50, travel_limit=0.25)
    assert ends(stroke) == pytest.approx((0.25, 0.50))
    # A limit beyond the free length of the cable changes nothing.
    assert fitting_stroke("cable", 0.30, 0.50, travel_limit=2.0) == fitting_stroke("cable", 0.30, 0.50)
    with pytest.raises(InvalidInput, match="200 mm is needed, and 150 mm"):
        fitting_stroke("cable", 0.30, 0.50, travel_limit=0.15)
    muscle = fitting_stroke("pneumatic muscle", 0.40, 0.44, travel_limit=0.05)
    assert ends(muscle) == pytest.approx((0.39, 0.44))


def test_travel_limit_is_stored(tmp_path):
    actuator = ep.Actuator("cable", pull_limit=200.0, travel_limit=0.25)
    exo = ep.load("four-cables")
    exo = exo.replace(limbs=[ep.Limb("SPS", stroke=each.stroke, actuator=actuator) for each in exo.limbs])
    exo.save(tmp_path / "design.toml")
    assert ep.load(tmp_path / "design.toml").limbs[0].actuator == actuator
    with pytest.raises(InvalidInput, match="travel_limit"):
        ep.Actuator("cable", travel_limit=-0.1)


@pytest.mark.parametrize("family", ACTUATOR_FAMILIES)
def test_stroke_of_an_actuator_that_is_so_long(family):
    stroke = stroke_of_length(family, 0.5)
    short, long = ends(stroke)
    assert ends(fitting_stroke(family, short, long)) == pytest.approx((short, long))
    if family != "cable":  # of which the free length is all
        with pytest.raises(InvalidInput, match="cannot be shorter"):
            fitting_stroke(family, short - 1e-6, long)
    assert ends(stroke_of_length(family, 0.5, 0.1)) == pytest.approx(
        (short + 0.1 - stroke.end_fitting, long + 0.1 - stroke.end_fitting)
    )


def test_actuator_shorter_than_its_dead_length_is_refused():
    with pytest.raises(InvalidInput, match="longer than 100 mm"):
        stroke_of_length("linear", 0.08)


@pytest.mark.parametrize("family", ["pneumatic muscle", "cable", "linear"])
def test_travel_limit_bounds_the_stroke_of_a_given_length(family):
    short, long = ends(stroke_of_length(family, 0.5, travel_limit=0.05))
    assert long - short == pytest.approx(0.05)
    wide = stroke_of_length(family, 0.5, travel_limit=2.0)
    assert wide == stroke_of_length(family, 0.5)
