"""Equations of drives and arm at single states, against formulas written anew and against another integration."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.control.plant.equations.drive_kernels import (
    AIR,
    COLUMNS,
    MOTOR_COLUMNS,
    air_volume,
    free_contraction,
    motor_energy,
    motor_force,
    motor_rates,
    motor_tension,
    muscle_pull,
    pressures_for,
    slip,
    static_law,
    static_tensions,
    tension,
)
from exo_pin.control.plant.equations.plant_kernels import (
    SHOULDER,
    advance,
    observe,
    rates,
    state_parts,
    stop_moment,
    tolerances,
)
from exo_pin.control.plant.state import still_tables
from exo_pin.muscle import ConstantFriction
from exo_pin.muscle.valve.flow import ATMOSPHERE, GAS_CONSTANT, REFERENCE_TEMPERATURE, mass_flow

#: F = -3 + 20 P + (2 - 60 P) ε in N, of strain and bar.
LAW = np.array([[[-3.0, 20.0], [2.0, -60.0]]])
MUSCLE = {"nominal_length": 0.3, "end_fitting": 0.1, "capability_slope": 15.0, "capability_intercept": 2.0,
          "braid_stiffness": 4e3, "damping_1": -1.0, "damping_2": 0.8, "friction": 0.5, "friction_2": 200.0,
          "friction_1": -80.0, "friction_0": 6.0, "friction_load": 0.1, "ratio": 2.0, "count": 3.0,
          "pulley_friction": 0.02, "thread": 0.33, "turns": 1.5, "dead_volume": 2e-5}  # fmt: skip


def muscle(**changes):
    return np.array([(MUSCLE | changes).get(name, 0.0) for name in COLUMNS])


@pytest.mark.parametrize("bar", [0.05, 0.2, 0.9, 3.0])
def test_pull_of_a_muscle_free_on_its_line_and_taut(bar):
    force, slope, gain = static_law(LAW, 0, 0.1, bar)
    assert (force, slope, gain) == pytest.approx((-3 + 20 * bar + 0.1 * (2 - 60 * bar), 2 - 60 * bar, 14.0))
    starts, limit = -3.0 + 20.0 * bar, 15.0 * bar + 2.0
    free = starts / (60.0 * bar - 2.0) if starts > 0.0 else 0.0
    strain, by_bar, there = free_contraction(LAW, 0, bar)
    assert (strain, there) == (pytest.approx(free), True)
    step = 1e-6
    ends = [free_contraction(LAW, 0, bar + side * step)[0] for side in (1, -1)]
    assert by_bar == pytest.approx((ends[0] - ends[1]) / (2 * step), rel=1e-6, abs=1e-12)
    for x in (-0.002, 0.01, 0.05, 0.2):
        pull, bladder, by_x, by_bar, free_by_bar = muscle_pull(LAW, muscle(), 0, x, bar)
        inside = min(max(x, 0.0), 0.3 * free)
        own = min(max(starts + (2 - 60 * bar) * inside / 0.3, 0.0), limit) if free > 0.0 else 0.0
        assert (pull, bladder) == (pytest.approx(own + 4e3 * max(-x, 0.0), abs=1e-9), pytest.approx(inside))
        for found, index in ((by_x, 0), (by_bar, 1)):
            move = 1e-7 * np.eye(2)[index]
            ahead, behind = (muscle_pull(LAW, muscle(), 0, x + s * move[0], bar + s * move[1]) for s in (1, -1))
            assert found == pytest.approx((ahead[0] - behind[0]) / 2e-7, rel=1e-5, abs=1e-6)
            if index:
                assert free_by_bar == pytest.approx((ahead[1] - behind[1]) / 2e-7, rel=1e-5, abs=1e-6)
    # A law without a zero below one half.
    assert free_contraction(np.array([[[-3.0, 20.0], [2.0, -20.0]]]), 0, 3.0) == (0.5, 0.0, False)


@pytest.mark.parametrize("spring", [0.0, 2e3])
@pytest.mark.parametrize("z", [-0.6, 0.0, 1.0])
def test_tension_of_muscles_over_a_tackle_with_spring_damping_and_friction(spring, z):
    row = muscle(spring_stiffness=spring)
    for x, speed, pressure in ((0.03, -0.2, 3e5), (0.03, 0.3, 3e5), (0.002, 0.1, 2e5), (-0.001, 0.0, 2e5)):
        length, bar = 0.4 - 2.0 * x, pressure / 1e5
        found, loss, bladder, by_x, by_p = tension(LAW, row, 0, length, speed, pressure, z)
        # The spring's extension d: k d = S(x + d).
        d = 0.0
        for _ in range(200 if spring else 0):
            d = muscle_pull(LAW, row, 0, x + d, bar)[0] / spring * 0.5 + 0.5 * d
        pull, own = muscle_pull(LAW, row, 0, x + d, bar)[:2]
        assert bladder == pytest.approx(own, abs=1e-9)
        shortening = -speed / 2.0
        opposing = bar * max(-shortening + 0.8, 0.0) * shortening
        factor = (bar - 0.1 * pull / 9.81) * ((200.0 * bladder - 80.0) * bladder + 6.0)
        opposing += (0.5 + max(factor, 0.0) + 0.02 * pull) * z
        opposing = min(max(opposing, -pull), pull)
        assert found == pytest.approx(3.0 * (pull - opposing) / 2.0, rel=1e-7)
        assert loss == pytest.approx(3.0 * opposing * shortening, rel=1e-7)
        for slope, move in ((by_x, (-1e-6, 0.0)), (by_p, (0.0, 1.0))):
            ends = [tension(LAW, row, 0, length + s * move[0], speed, pressure + s * move[1], z)[2] for s in (1, -1)]
            assert slope == pytest.approx((ends[0] - ends[1]) / (2 * max(np.abs(move))), rel=1e-4, abs=1e-10)
    assert tension(LAW, row, 0, 0.1, 0.3, 1e5, z)[:2] == (0.0, 0.0)


def test_air_of_a_braid_and_pressures_for_tensions():
    row = muscle()
    volume, slope = air_volume(row, 0.05)
    # (3-2) to (3-4): a cylinder of length L whose thread b winds n times.
    radius = np.sqrt(0.33**2 - 0.25**2) / (2.0 * np.pi * 1.5)
    assert volume == pytest.approx(np.pi * radius**2 * 0.25 + 2e-5)
    ends = [air_volume(row, 0.05 + side * 1e-6)[0] for side in (1, -1)]
    assert slope == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-6)
    rows, law = np.array([row] * 4), np.repeat(LAW, 4, axis=0)
    lengths, out = np.array([0.36, 0.36, 0.36, 0.10]), np.empty(4)
    most = np.empty(4)
    static_tensions(law, rows, lengths, 3e5, most)
    pressures_for(law, rows, lengths, np.array([20.0, 1e4, 0.0, 20.0]), 3e5, out)
    reached = [tension(law, row, 0, 0.36, 0.0, p, 0.0)[0] for p in out[:3]]
    assert reached == pytest.approx([20.0, most[0], 0.0], abs=1e-4)
    assert out[1] == 3e5
    # Ready to pull, and vented where it is too short to.
    assert tension(law, row, 0, 0.36, 0.0, out[2] + 10.0, 0.0)[0] > 0.0
    assert out[3] == 0.0


DRIVE = {"present": 1.0, "inverse_mass": 0.25, "force_limit": 90.0, "stall_force": 200.0, "no_load_speed": 0.5,
         "viscous": 30.0, "coulomb": 4.0, "load_friction": 0.05, "presliding": 1e-4, "stiffness": 5e4, "damping": 40.0,
         "pushes": 1.0, "shortest": 0.3, "longest": 0.5, "stop_stiffness": 1e5, "stop_damping": 300.0, "copper": 0.01,
         "along": -1.0}  # fmt: skip


def drive(**changes):
    return np.array([(DRIVE | changes).get(name, 0.0) for name in MOTOR_COLUMNS])


@pytest.mark.parametrize("changes", [{}, {"play": 4e-4}, {"pushes": 0.0}, {"along": 1.0, "play": 4e-4}])
@pytest.mark.parametrize("s", [0.299, 0.4, 0.502])
@pytest.mark.parametrize("gap", [-1e-3, -1e-4, 1e-4, 1e-3])
def test_energy_of_a_motor_drive_is_what_comes_less_what_is_lost(changes, s, gap):
    row = drive(**changes)
    along, half, speed, rate, z = row[-1], 0.5 * changes.get("play", 0.0), 0.03, -0.02, 0.4
    length = s - along * gap
    stretch = max(gap - half, 0.0) + (min(gap + half, 0.0) if row[11] else 0.0)
    pull, lost = motor_tension(row, length, speed, s, rate)
    damped = 40.0 * along * (rate - speed)
    if changes.get("play") or not row[11]:
        damped = np.clip(damped, -5e4 * abs(stretch), 5e4 * abs(stretch))
    assert pull == pytest.approx(5e4 * stretch + damped)
    assert lost == pytest.approx(damped * along * (rate - speed))
    found, acceleration, bristle, force, loss, electric = motor_rates(
        row, (70.0, 1.0, 3.0, 1.0), length, speed, s, rate, z)  # fmt: skip
    assert (found, force) == (pull, motor_force(row, 70.0, along * rate))
    assert bristle == pytest.approx(rate / 1e-4)
    friction = 30.0 * rate + (4.0 + 0.05 * abs(pull) + 3.0) * z
    depth, side = (0.3 - s, 1.0) if s < 0.3 else (s - 0.5, -1.0)
    stop = side * max(1e5 * depth - side * 300.0 * rate, 0.0) if depth > 0.0 else 0.0
    assert acceleration == pytest.approx(0.25 * (along * (force - pull) - friction + stop))
    assert electric == pytest.approx(0.01 * force**2 + along * force * rate)
    step = 1e-7
    ahead, behind = (
        motor_energy(row, length + d * speed, s + d * rate, rate + d * acceleration, 1.0) for d in (step, -step)
    )
    # Along the coordinate the motor gives F s', and the arm takes T l'.
    assert (ahead - behind) / (2 * step) == pytest.approx(along * (force * rate - pull * speed) - loss, rel=1e-5)
    torn = motor_rates(row, (70.0, 0.0, 0.0, 0.0), length, speed, s, rate, z)
    assert (torn[0], torn[3]) == (0.0, 0.0)


def exact(plant, y, q):
    """Rates by the equations of the module's docstring, of arm and shoulder; tensions from the drives' kernels."""
    t, parts = plant.tables, state_parts(y)
    R = (Rotation.from_rotvec(parts["turn"]) * Rotation.from_quat(q)).as_matrix()
    w, z = parts["angular_velocity"], parts["shoulder_friction"]
    M = np.cross(R @ t.centre, t.mass * t.gravity) + np.cross(R @ t.point, t.force)
    limbs = []
    for i in range(len(t.base)):
        b = R @ t.platform[i]
        length = np.linalg.norm(b - t.base[i])
        s = (b - t.base[i]) / length
        speed = float(w @ np.cross(b, s))
        if t.motors[i, 0] > 0.0:
            pull = motor_tension(t.motors[i], length, speed, parts["drives"][i], parts["drive_speeds"][i])[0]
        else:
            gauge = parts["drives"][i] - ATMOSPHERE
            pull = tension(t.law, t.muscles[i], i, length, speed, gauge, parts["drive_friction"][i])[0]
        M = M + pull * np.cross(s, b)
        limbs.append((length, speed, pull))
    stop, taken, _ = stop_moment(R, w, *t.shoulder[4:9]) if t.shoulder[3] else (np.zeros(3), 0.0, 0.0)
    rub = t.shoulder[0] * w + t.shoulder[1] * z
    inertia = R @ t.inertia @ R.T
    acceleration = np.linalg.solve(inertia, M + np.array(stop) - rub - np.cross(w, inertia @ w))
    sliding = slip(float(w @ z), float(np.linalg.norm(z))) * np.linalg.norm(w)
    return acceleration, (w - sliding * z) / t.shoulder[2], taken + float(rub @ w), np.array(limbs), inertia, R


OPTIONS = {"shoulder_viscous": 0.02, "shoulder_coulomb": 0.1, "muscle_friction": ConstantFriction(1.0)}


@pytest.fixture(scope="module", params=["prototype", "a manifold", "three-linear-actuators"])
def moving(request):
    """A plant with friction, stops and a load, its flows and a lively state."""
    manifold = {"supply": ep.Supply(5e5, ep.Valve(2e-8, 0.3), 1e-3)} if request.param == "a manifold" else {}
    exo = ep.load("prototype" if manifold else request.param)
    load = ep.Load([3.0, -2.0, -9.0], at=[0.0, 0.02, -0.3])
    plant = ep.Plant(exo, ep.PlantOptions(**OPTIONS, **manifold), load=load)
    n, rng = plant.count, np.random.default_rng(11)
    y, q = np.zeros(13 + 7 * n), ep.thesis_rotation(62.0, -20.0, -15.0, degrees=True).as_quat()
    parts = state_parts(y)
    parts["turn"][:], parts["angular_velocity"][:] = [0.02, -0.01, 0.03], [0.8, -1.2, 2.0]
    parts["shoulder_friction"][:], parts["drive_friction"][:] = [0.5, -0.4, 0.55], rng.uniform(-0.9, 0.9, n)
    lengths = plant.contractions.lengths(Rotation.from_rotvec(parts["turn"]) * Rotation.from_quat(q))
    motors = plant.tables.motors[:, 0] > 0.0
    parts["drives"][:] = np.where(motors, lengths - 1e-4, ATMOSPHERE + np.array([1.0e5, 0.7e5, 2.0e5]))
    parts["drive_speeds"][:], parts["manifold"][:] = np.where(motors, 0.01, 0.0), ATMOSPHERE + 4e5
    flows = np.zeros((n, 10))
    flows[:, :6] = np.where(motors[:, None], 0.0, [2e-9, 0.3, 1e-9, 0.25, 5e-10, 0.4])
    flows[:, 6:9] = [1.0, 60.0, 1.0]
    return plant, flows, q, y


def test_rates_of_a_plant_are_those_of_its_equations(moving):
    plant, flows, q, y = moving
    t, out = plant.tables, np.full(len(y), np.nan)
    rates(t, flows, q, y, out)
    acceleration, sliding, loss, limbs, _, _ = exact(plant, y, q)
    found, parts = state_parts(out), state_parts(y)
    np.testing.assert_allclose(found["angular_velocity"], acceleration, rtol=1e-9)
    np.testing.assert_allclose(found["shoulder_friction"], sliding, rtol=1e-9)
    assert found["shoulder_loss"][0] == pytest.approx(loss)
    # exp(ξ + h ξ') is exp(h ω) exp(ξ).
    w = parts["angular_velocity"]
    ends = [Rotation.from_rotvec(parts["turn"] + h * found["turn"]) for h in (1e-5, -1e-5)]
    np.testing.assert_allclose((ends[0] * ends[1].inv()).as_rotvec() / 2e-5, w, rtol=1e-8)
    drawn = vented = 0.0
    for i, (length, speed, pull) in enumerate(limbs):
        if t.motors[i, 0] > 0.0:
            expected = motor_rates(t.motors[i], flows[i, [7, 8, 9, 6]], length, speed, parts["drives"][i],
                                   parts["drive_speeds"][i], parts["drive_friction"][i])  # fmt: skip
            own = [found[name][i] for name in ("drive_speeds", "drive_friction", "drive_loss", "electric_energy")]
            assert own == pytest.approx([expected[1], expected[2], expected[4], max(expected[5], 0.0)])
            assert found["drives"][i] == parts["drive_speeds"][i]
            assert found["source_work"][i] == pytest.approx(-expected[3] * parts["drive_speeds"][i])
        else:
            p, row, z = parts["drives"][i], t.muscles[i], parts["drive_friction"][i]
            _, lost, bladder, by_x, by_p = tension(t.law, row, i, length, speed, p - ATMOSPHERE, z)
            volume, area = air_volume(row, bladder)
            fill, fill_ratio, vent, vent_ratio, leak, leak_ratio = flows[i, :6]
            taken = mass_flow(parts["manifold"][0], p, fill, fill_ratio)
            left = mass_flow(p, ATMOSPHERE, vent, vent_ratio) + mass_flow(p, ATMOSPHERE, leak, leak_ratio)
            grows = area * (by_x * -speed + by_p * found["drives"][i])
            air = GAS_CONSTANT * REFERENCE_TEMPERATURE * (taken - left)
            assert volume * found["drives"][i] == pytest.approx(t.air[0] * (air - p * grows))
            assert found["source_work"][i] == pytest.approx((p - ATMOSPHERE) * grows)
            assert found["drive_loss"][i] == pytest.approx(lost)
            bristle = -speed - slip(-speed * z, abs(z)) * abs(speed) * z
            assert found["drive_friction"][i] == pytest.approx(bristle / row[COLUMNS.index("presliding")])
            assert (found["drive_speeds"][i], found["electric_energy"][i]) == (0.0, 0.0)
            drawn, vented = drawn + taken, vented + left
        assert found["tension_work"][i] == pytest.approx(-pull * speed)
    assert found["air_vented"][0] == pytest.approx(vented)
    if t.air[4] == 0.0:
        assert (found["air_used"][0], found["manifold"][0]) == (pytest.approx(drawn), 0.0)
    else:
        fresh = mass_flow(5e5 + ATMOSPHERE, parts["manifold"][0], 2e-8, 0.3)
        assert found["air_used"][0] == pytest.approx(fresh)
        rate = t.air[0] * GAS_CONSTANT * REFERENCE_TEMPERATURE * (fresh - drawn) / 1e-3
        assert found["manifold"][0] == pytest.approx(rate)


def test_tables_hold_what_design_and_options_state():
    supply = ep.Supply(5e5, ep.Valve(2e-8, 0.3), 1e-3)
    stops = {"shoulder_presliding": 3e-3, "stop_stiffness": 70.0, "stop_damping": 2.0, "polytropic_exponent": 1.3}
    for side in (1.0, -1.0):
        exo = ep.load("prototype", side="left" if side > 0.0 else "right")
        plant = ep.Plant(exo, ep.PlantOptions(**OPTIONS, **stops, supply=supply))
        t, joint = plant.tables, exo.mechanism.shoulder
        assert dict(zip(SHOULDER, t.shoulder.tolist(), strict=True)) == {
            "viscous": 0.02, "coulomb": 0.1, "presliding": 3e-3, "stops": 1.0, "stop_centre": joint.abduction_centre,
            "stop_half": joint.half_diagonal, "side": side, "stop_stiffness": 70.0, "stop_damping": 2.0,
        }  # fmt: skip
    values = dict(zip(AIR, t.air.tolist(), strict=True))
    assert values == {"exponent": 1.3, "supply": 5e5 + ATMOSPHERE, "regulator": 2e-8, "regulator_ratio": 0.3,
                      "manifold": 1e-3}  # fmt: skip
    for i, drive in enumerate(plant.drives):
        length = t.muscles[i, COLUMNS.index("nominal_length")]
        for x, p in ((0.01, 2e5), (0.05, 3.5e5)):
            found = static_law(t.law, i, x / length, p / 1e5)[0]
            assert found == pytest.approx(float(drive.model.unchecked_force(x, p)), abs=1e-7)
    arm = exo.arm
    about = arm.inertia + arm.mass * (arm.centre_of_mass @ arm.centre_of_mass * np.eye(3)
                                      - np.outer(arm.centre_of_mass, arm.centre_of_mass))  # fmt: skip
    np.testing.assert_allclose(t.inertia, about, atol=1e-12)
    np.testing.assert_allclose(t.inverse @ about, np.eye(3), atol=1e-10)
    np.testing.assert_allclose(t.centre, arm.centre_of_mass)
    free = ep.Plant(ep.load("three-linear-actuators"), ep.PlantOptions(second_flange=True, shoulder_coulomb=0.0)).tables
    assert (free.shoulder[3], free.shoulder[2], free.air.tolist()) == (0.0, 1.0, [0.0, ATMOSPHERE, 0.0, 0.0, 0.0])


def test_a_plant_that_stands_still_has_its_forces_without_friction_and_flow(moving):
    tables = moving[0].tables
    still = still_tables(tables, 0.7)
    for name, columns, kept in (
        ("air", AIR, {"exponent": 0.0}), ("shoulder", SHOULDER, {"viscous": 0.7, "coulomb": 0.0}),
        ("muscles", COLUMNS, dict.fromkeys(("friction", "friction_2", "friction_1", "friction_0", "friction_load",
                                            "pulley_friction"), 0.0)),
        ("motors", MOTOR_COLUMNS, {"inverse_mass": 0.0}),
    ):  # fmt: skip
        expected = getattr(tables, name).copy()
        for column, value in kept.items():
            expected[..., columns.index(column)] = value
        np.testing.assert_array_equal(getattr(still, name), expected)
    np.testing.assert_array_equal(still.base, tables.base)


def test_what_a_run_reports_of_a_state(moving):
    plant, flows, q, y = moving
    y = y.copy()
    state_parts(y)["turn"][:] = 0.0
    n = plant.count
    motion, limbs, energy = np.zeros((1, 9)), np.zeros((1, n, 6)), np.zeros((1, 2))
    observe(q[None], y[None], flows[None, :, 6:], plant.tables, motion, limbs, energy)
    t, parts = plant.tables, state_parts(y)
    acceleration, _, _, own, inertia, R = exact(plant, y, q)
    w = parts["angular_velocity"]
    np.testing.assert_allclose(motion[0, :3], acceleration, rtol=1e-9)
    np.testing.assert_allclose(motion[0, 3:6], -t.shoulder[0] * w - t.shoulder[1] * parts["shoulder_friction"])
    np.testing.assert_allclose(limbs[0, :, :3], own, rtol=1e-9)
    assert energy[0, 0] == pytest.approx(0.5 * w @ inertia @ w)
    stored = stop_moment(R, w, *t.shoulder[4:9])[2] if t.shoulder[3] else 0.0
    weight = -t.mass * t.gravity @ (R @ t.centre) - t.force @ (R @ t.point)
    assert energy[0, 1] == pytest.approx(weight + stored)
    for i in np.flatnonzero(t.motors[:, 0]):
        s, rate = parts["drives"][i], parts["drive_speeds"][i]
        assert limbs[0, i, 4] == pytest.approx(motor_force(t.motors[i], 60.0, -rate))
        assert limbs[0, i, 5] == pytest.approx(motor_energy(t.motors[i], own[i, 0], s, rate, 1.0))


def test_an_integration_ends_where_another_one_does(moving):
    plant, flows, q, y = moving
    t, duration = plant.tables, 2e-3

    def slope(_, state):
        out = np.zeros(len(state))
        rates(t, flows, q, state, out)
        return out

    other = solve_ivp(slope, (0.0, duration), y, rtol=1e-9, atol=tolerances(t, 1e-9)).y[:, -1]
    end, turned = y.copy(), q.copy()
    done, steps, ahead, left = advance(t, flows, turned, end, duration, 1e-4, 1e-8, tolerances(t, 1e-8))
    assert (done, left) == (0, 0.0)
    assert steps > 3
    assert ahead > 0.0
    there = Rotation.from_rotvec(other[:3]) * Rotation.from_quat(q)
    assert (Rotation.from_quat(turned) * there.inv()).magnitude() < 1e-8
    assert np.linalg.norm(turned) == pytest.approx(1.0, abs=1e-14)
    assert not end[:3].any()
    np.testing.assert_allclose(end[3:], other[3:], rtol=1e-5, atol=1e-7)
