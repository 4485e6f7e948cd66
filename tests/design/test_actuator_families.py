import pytest

from exo_pin.design.actuator_families import fitting_stroke


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


def test_a_cable_takes_any_length_down_to_its_free_length():
    assert ends(fitting_stroke("cable", 0.03, 2.0)) == pytest.approx((0.03, 2.0))


def test_a_linear_actuator_is_twice_its_stroke_and_its_dead_length():
    # Retracted 0.25 m = 0.1 m dead length and 0.15 m of stroke; extended 0.4 m.
    assert ends(fitting_stroke("linear", 0.25, 0.4)) == pytest.approx((0.25, 0.4))
    # A shorter stroke in the same limb leaves room for a fitting.
    stroke = fitting_stroke("linear", 0.3, 0.4)
    assert stroke.end_fitting == pytest.approx(0.4 - 0.3)
    assert ends(stroke) == pytest.approx((0.3, 0.4))
