"""One muscle of the plant: the static law, slack, braid, series spring, air's volume."""

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.control.plant.equations.drive_kernels import (
    COLUMNS,
    air_volume,
    free_contraction,
    muscle_pull,
    static_law,
    tension,
)
from exo_pin.muscle import ConstantFriction, Muscle, muscle_model, muscle_models, table


def tables_of(exo, law="tang-optimised", **options):
    actuator = ep.Actuator("pneumatic muscle", force_law=law, supply_pressure=4e5)
    limbs = [ep.Limb(limb.kind, stroke=limb.stroke, actuator=actuator) for limb in exo.limbs]
    return ep.Plant(exo.mechanism.replace(limbs=limbs), ep.PlantOptions(**options)).tables


def limb_tension(t, i, contraction, pressure, shortening=0.0, bristle=0.0):
    row = t.muscles[i]
    return tension(t.law, row, i, row[0] + row[1] - contraction, -shortening, float(pressure), bristle)


@pytest.mark.parametrize("law", muscle_models())
def test_every_law_is_read_as_a_polynomial_and_scaled_by_strain(prototype, law):
    t = tables_of(prototype, law)
    rng = np.random.default_rng(1)
    for i, length in ((0, 0.15), (1, 0.25)):
        model = muscle_model(law, length)
        strain, bar = rng.uniform(0.0, 0.35, 30), rng.uniform(0.2, 4.0, 30)
        ours = np.array([static_law(t.law, i, x, p) for x, p in zip(strain, bar, strict=True)])
        np.testing.assert_allclose(ours[:, 0], model.unchecked_force(strain * length, bar * 1e5), atol=1e-7)
        inside = (strain > 0.05) & (strain < 0.19) & (bar > 1.3)
        x, p = strain[inside] * length, bar[inside] * 1e5
        np.testing.assert_allclose(ours[inside, 1] / length, model.stiffness(x, p, "mark").data, rtol=1e-6, atol=1e-4)
        np.testing.assert_allclose(ours[inside, 2] / 1e5, model.pressure_gain(x, p, "mark").data, rtol=1e-6, atol=1e-10)


def test_pull_is_the_muscle_s_own_in_its_range(prototype):
    t = tables_of(prototype, muscle_damping=None)
    muscle = Muscle(model=muscle_model("tang-optimised", 0.25), end_fitting=0.154, supply_pressure=3e5)
    contraction = np.linspace(0.045, 0.245, 40) * 0.25
    upper = muscle.force_limits(0.404 - contraction)[1]
    ours = [limb_tension(t, 1, x, 3e5)[0] for x in contraction]
    np.testing.assert_allclose(ours, upper, rtol=1e-12, atol=1e-12)
    assert min(ours) > 1.0


def test_a_slack_muscle_pulls_with_exactly_nothing_and_never_pushes(prototype):
    t = tables_of(prototype, muscle_friction=ConstantFriction(2.5))
    rng = np.random.default_rng(2)
    for bar in (0.0, 0.1, 0.8, 2.0, 4.0):
        free = free_contraction(t.law, 1, bar)[0] * 0.25
        for beyond in (1e-9, 1e-6, 0.01, 0.1):
            for speed, bristle in rng.uniform(-1.0, 1.0, (5, 2)):
                assert limb_tension(t, 1, max(free, 1e-9) + beyond, 1e5 * bar, speed, bristle)[0] == 0.0
        for x in rng.uniform(-0.01, 0.15, 40):
            for speed, bristle in rng.uniform(-1.0, 1.0, (4, 2)):
                pull = limb_tension(t, 1, x, 1e5 * bar, speed, bristle)[0]
                still = limb_tension(t, 1, x, 1e5 * bar)[0]
                assert 0.0 <= pull <= 2.0 * still + 1e-12
    assert limb_tension(t, 1, 0.03, 0.0)[0] == 0.0
    # Damping takes energy in either direction.
    assert limb_tension(t, 1, 0.03, 3e5, 0.2)[1] > 0.0
    assert limb_tension(t, 1, 0.03, 3e5, -0.2)[1] > 0.0


def test_a_slack_muscle_has_its_own_free_length(prototype):
    t = tables_of(prototype)
    free = free_contraction(t.law, 1, 2.0)
    bladder = limb_tension(t, 1, 0.12, 2e5)[2]
    assert bladder == pytest.approx(0.25 * free[0], rel=1e-12)
    assert abs(static_law(t.law, 1, free[0], 2.0)[0]) < 1e-10
    by_bar = (free_contraction(t.law, 1, 2.001)[0] - free_contraction(t.law, 1, 1.999)[0]) / 0.002
    assert free[1] == pytest.approx(by_bar, rel=1e-5)


@pytest.mark.parametrize("spring", [None, 2000.0])
def test_the_bladder_s_slopes_are_its_derivatives_everywhere(prototype, spring):
    """Also at half a bar, where the capability line leaves no pull and the muscle is not slack yet."""
    t = tables_of(prototype, series_spring=spring)
    rng, step, at_no_pull = np.random.default_rng(11), 1e-7, 0
    for _ in range(2000):
        x, pressure = 0.25 * rng.uniform(-0.01, 0.06), 1e5 * rng.uniform(0.3, 0.6)
        pull, _, bladder, by_x, by_pressure = limb_tension(t, 1, x, pressure)
        at_no_pull += pull == 0.0 and x > 0.0 and abs(bladder - x) < 1e-12
        # On one side of a corner, if not on both.
        sides = [(limb_tension(t, 1, x + s, pressure)[2] - bladder) / s for s in (-step, step)]
        assert min(abs(by_x - side) for side in sides) < 1e-4, (x, pressure)
        sides = [(limb_tension(t, 1, x, pressure + s)[2] - bladder) / s for s in (-0.1, 0.1)]
        assert min(abs(by_pressure - side) for side in sides) < 1e-4 * max(abs(by_pressure), 1e-9), (x, pressure)
    assert at_no_pull > 20


def test_the_braid_is_as_stiff_as_table_a_1_says(prototype):
    rows = dict(zip(table("a-1").rows, table("a-1").printed, strict=True))
    x, J = [], []
    for side in "ij":
        for a, b in zip(rows[f"x_{side}_mm"], rows[f"J_{side}_N"], strict=True):
            # x_1 of the relaxation lost its sign in print.
            if a != "/" and (float(a) < 0 or a == "5.01"):
                x.append(-abs(float(a)) * 1e-3)
                J.append(float(b))
    assert len(x) == 6
    fitted = -np.dot(x, J) / np.dot(x, x)
    assert ep.PlantOptions().braid_stiffness == pytest.approx(fitted, rel=1e-3)
    t = tables_of(prototype)
    assert limb_tension(t, 1, -2e-3, 0.0)[0] == pytest.approx(2960.0 * 0.3 / 0.25 * 2e-3, rel=1e-12)


@pytest.mark.parametrize("contraction", [-4e-3, 0.0, 0.02, 0.04])
def test_a_series_spring_carries_what_the_muscle_pulls(prototype, contraction):
    stiffness = 1500.0
    plain, sprung = tables_of(prototype), tables_of(prototype, series_spring=stiffness)
    pull, _, _, by_x, by_pressure = limb_tension(sprung, 1, contraction, 3e5)
    own = muscle_pull(plain.law, plain.muscles[1], 1, contraction + pull / stiffness, 3.0)[0]
    assert pull == pytest.approx(own, rel=1e-10)
    step = 1e-7
    ends = [limb_tension(sprung, 1, contraction + s, 3e5)[2] for s in (-step, step)]
    assert by_x == pytest.approx((ends[1] - ends[0]) / (2 * step), abs=2e-5)
    ends = [limb_tension(sprung, 1, contraction, 3e5 + s)[2] for s in (-10.0, 10.0)]
    assert by_pressure == pytest.approx((ends[1] - ends[0]) / 20.0, rel=1e-4, abs=1e-12)
    # The muscle pulls over a longer way, and softer.
    assert limb_tension(sprung, 1, 0.06, 3e5)[0] < limb_tension(plain, 1, 0.06, 3e5)[0] + 1e-12


def test_the_air_s_volume_does_the_work_of_its_law(prototype):
    """P dV = F dx of (3-5), from which thread and turns were fitted."""
    t, x = tables_of(prototype), 0.03
    row = t.muscles[1]
    volume, area = air_volume(row, x)
    assert area == pytest.approx((air_volume(row, x + 1e-6)[0] - air_volume(row, x - 1e-6)[0]) / 2e-6, rel=1e-8)
    model = muscle_model("fitted-chou-hannaford", 0.25)
    assert 2e5 * area == pytest.approx(float(model.unchecked_force(x, 2e5)), rel=1e-12)
    diameter = float(model.diameter(x))
    tube = row[COLUMNS.index("dead_volume")]
    assert volume - tube == pytest.approx(0.25 * np.pi * diameter**2 * (0.25 - x), rel=1e-12)
