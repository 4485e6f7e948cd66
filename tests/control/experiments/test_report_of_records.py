"""What a tracking says of made records, in which what happens and when is known."""

from dataclasses import fields, replace

import numpy as np
import pytest

import exo_pin as ep
from exo_pin.control.experiments.tracking_report import greatest_ratios

TIMES = np.linspace(0.0, 2.0, 101)
#: Abduction that is wanted, and reached: 3° off at first, and no farther than 50°.
WANTED = 40.0 * TIMES
REACHED = np.minimum(WANTED + 3.0, 50.0)


def abducted(angle):
    return ep.shoulder_rotation(20.0, angle, 0.0, degrees=True)


def recorded(tracking, **changes):
    """A tracking of 101 samples, each as the first one of a run, but for what is stated of the run."""
    count, run = len(tracking.times), tracking.run
    own = {each.name: getattr(run, each.name) for each in fields(run)}
    own = {name: np.repeat(value[:1], 101, axis=0) for name, value in own.items()
           if isinstance(value, np.ndarray) and value.shape[:1] == (count,)}  # fmt: skip
    n = run.plant.count
    made = replace(run, **(own | {"times": TIMES, "rotations": abducted(REACHED)} | changes))
    ratios = np.full((101, n), 0.1)
    return replace(tracking, run=made, wanted=abducted(WANTED), wanted_ratios=ratios, ratios=ratios.copy(),
                   missing_moment=np.zeros(101))  # fmt: skip


@pytest.fixture(scope="module")
def muscles():
    return ep.experiment("abduction-long").replace(duration=0.05).run()


@pytest.fixture(scope="module")
def motors():
    return ep.load("four-linear-actuators-worn").track("flexion", "model", duration=0.02)


def column(values, limb, where, value, n=3):
    """Values (101, n) with one limb's changed at some samples."""
    values = np.broadcast_to(np.asarray(values, dtype=float), (101, n)).copy()
    values[where, limb] = value
    return values


def test_a_start_that_is_off_and_an_angle_that_stands_still(muscles):
    found = recorded(muscles, tensions=np.ones((101, 3)))
    rest, still = found.findings
    angles = ", ".join(f"{angle:.1f}" for angle in found.angles(convention="thesis")[0])
    assert rest == f"at rest the arm hangs 3.0° from the wanted start, at θ = ({angles})°"
    # In the 0.24 s before 1.40 s it rises by 0.6°: more than 2° a second.
    assert still == "abduction stands still from 1.40 s on, at 50°"
    # Muscle 1 would have to be longer, and one is taut.
    long = replace(found, wanted_ratios=column(0.1, 0, 0, -0.19), ratios=column(0.1, 1, 0, -0.01))
    assert long.findings[0] == f"{rest}: muscle 1 would have to be 19 % longer than nominal there"
    for off, said in ((1.9, 0), (2.1, 1)):
        near = replace(found, run=replace(found.run, rotations=abducted(WANTED + off * (TIMES < 0.05))))
        assert len(near.findings) == said
    # Short of the end by less than 2° is no standing still, nor is a creeping of over 2° a second.
    for rotations, said in (
        (np.minimum(WANTED, 78.1), False), (np.minimum(WANTED, 50.0 + 2.2 * np.maximum(TIMES - 1.25, 0.0)), False),
        (np.minimum(WANTED, 50.0 + 1.8 * np.maximum(TIMES - 1.25, 0.0)), True),
    ):  # fmt: skip
        texts = replace(found, run=replace(found.run, rotations=abducted(rotations))).findings
        assert any("stands still" in text for text in texts) == said


def test_what_the_reference_needs_of_muscles_and_for_how_long(muscles):
    found, most = recorded(muscles, tensions=np.ones((101, 3))), greatest_ratios(muscles)
    wanted = column(column(column(0.1, 0, slice(50, 80), -0.2), 1, slice(75, 101), most[1] + 0.01), 2,
                    slice(25, 35), most[2] + 0.01)  # fmt: skip
    texts = replace(found, wanted_ratios=wanted).findings
    start = "the reference needs muscle"
    assert [text for text in texts if text.startswith(start)] == [
        f"{start} 1 longer than its nominal length for 30 % of the time, and it cannot be stretched",
        f"{start} 2 to contract by more than the {100 * most[1]:.0f} % that it can from 1.50 s on (abduction 60° "
        "wanted)",
        f"{start} 3 to contract by more than the {100 * most[2]:.0f} % that it can for 10 % of the time, first at "
        "0.50 s (abduction 20° wanted)",
    ]
    # Below 2 % of the time it is not worth a sentence.
    for count, said in ((2, False), (3, True)):
        few = replace(found, wanted_ratios=column(0.1, 0, slice(50, 50 + count), -0.2))
        assert any("longer than its nominal length" in text for text in few.findings) == said


def test_muscles_that_run_out_of_stroke_or_hang_loose(muscles):
    most = greatest_ratios(muscles)
    pressures = column(column(1e5, 1, slice(30, 50), 0.49e5), 1, slice(50, 101), 0.51e5)
    tensions = column(column(1.0, 0, slice(0, 51), 0.0), 2, slice(0, 50), 0.0)
    found = recorded(muscles, pressures=pressures, tensions=tensions)
    # Short, but empty, from 0.6 s on, and filled from 1 s on.
    found = replace(found, ratios=column(column(0.1, 1, slice(30, 101), most[1] - 0.009), 2, 60, most[2] - 0.011))
    assert found.findings[1] == "muscle 2 runs out of stroke at 1.00 s, at abduction 43°"
    # Muscles hang loose in many poses: half of the time is worth a sentence.
    assert found.findings[3:] == ("muscle 1 is slack for 50 % of the time",)


def test_motors_at_the_ends_of_their_strokes_and_forces(motors):
    shortest = np.array([drive.shortest for drive in motors.run.plant.drives])
    positions = column(shortest + 1e-3, 1, slice(60, 101), shortest[1] - 1e-6, n=4)
    limits = np.array([drive.force_limit for drive in motors.run.plant.drives])
    forces = column(column(0.99 * limits, 2, 40, limits[2], n=4), 3, slice(0, 10), -limits[3], n=4)
    found = recorded(motors, drive_positions=positions, motor_forces=forces)
    assert "actuator 2 runs out of stroke at 1.20 s, at abduction 50°" in found.findings
    at_limit = [text for text in found.findings if "force limit" in text]
    said = "the motor of actuator {} is at its force limit for {} % of the time"
    assert at_limit == [said.format(3, "1.0"), said.format(4, "9.9")]


@pytest.mark.parametrize(("apart", "said"), [(2.9, True), (3.1, False)])
def test_lengths_that_are_right_while_the_arm_is_not(muscles, apart, said):
    lengths = muscles.run.plant.contractions.lengths(abducted(WANTED[-1])) + 1e-3 * np.array([apart, -1.0, 0.0])
    found = recorded(muscles, lengths=np.tile(lengths, (101, 1)), tensions=np.ones((101, 3)))
    text = f"the lengths end within {apart:.1f} mm of those wanted and the arm 30.0° off: "
    assert any(each.startswith(text) for each in found.findings) == said


def test_faults_are_told_with_what_the_shoulder_gets_after_them(muscles):
    tensions = np.ones((101, 3)) * np.where(TIMES < 1.0, 500.0, 100.0)[:, None]
    made = recorded(muscles, tensions=tensions)
    force, off = np.linalg.norm(made.shoulder_force, axis=1), np.degrees(made.error)
    for limbs, start, who in (((0, 2), 1.0, "muscle 1, muscle 3"), ((0, 1, 2), 1.5, "all drives"), ((0,), 3.0, None)):
        faults = tuple(ep.Fault("torn", limb, start=start) for limb in limbs)
        # The controller is a function, which may remember: there is no run without faults beside it.
        study = made.experiment.replace(faults=faults, duration=4.0, controller=lambda t, seen: [0.0, 0.0, 0.0])
        texts = [text for text in replace(made, experiment=study).findings if "torn" in text]
        after = start <= TIMES
        assert texts == ([] if who is None else [
            f"{who}: torn from {start:g} s on; with the estimates as they are |F_s| reaches {force[after].max():.0f} N "
            f"and the arm is up to {off[after].max():.0f}° off"
        ])  # fmt: skip


def test_numbers_of_a_record(muscles):
    tensions = np.linspace(10.0, 60.0, 303).reshape(101, 3)
    made = recorded(muscles, tensions=tensions, tension_work=np.tile([0.0, 1.0, 2.0], (101, 1)),
                    air_used=np.linspace(0.0, 2e-3, 101))  # fmt: skip
    numbers, force, error = made.summary(), np.linalg.norm(made.shoulder_force, axis=1), np.degrees(made.error)
    air = 2e-3 * 1e5 / 1.185 * np.log(501325.0 / 101325.0)  # isothermal, of air of 1.185 kg/m³ at 1 bar
    expected = {
        "start_deg": 3.0, "end_deg": 50.0, "wanted_end_deg": 80.0, "furthest_deg": 50.0, "end_error_deg": 30.0,
        "rms_error_deg": np.sqrt((error**2).mean()), "peak_F_s_N": force.max(), "mean_F_s_N": force.mean(),
        "end_F_s_N": force[-1], "peak_tension_N": 60.0, "tension_work_J": 3.0, "air_energy_J": air, "air_used_g": 2.0,
        "mean_power_W": air / 2.0,
    }  # fmt: skip
    for name, value in expected.items():
        assert numbers[name] == pytest.approx(value, rel=2e-3), name
    assert numbers.keys() - expected.keys() == {"reachable_share", "rms_error_reachable_deg"}
    assert "abduction ends at 50° of 80°, the arm 30.0° off" in made.verdict
    # The other way: the least angle is the furthest.
    down = replace(made, wanted=abducted(80.0 - WANTED), run=replace(made.run, rotations=abducted(83.0 - REACHED)))
    assert down.summary()["furthest_deg"] == pytest.approx(33.0)
    table = made.columns()
    for name, values in {"tension_2_N": tensions[:, 1], "abduction_deg": REACHED, "wanted_abduction_deg": WANTED,
                         "F_s_N": force, "error_deg": error, "time_s": TIMES, "tension_work_J": 3.0,
                         "F_s_z_N": made.shoulder_force[:, 2], "energy_in_J": made.air_energy}.items():  # fmt: skip
        np.testing.assert_allclose(table[name], np.broadcast_to(values, 101), atol=1e-9, err_msg=name)


def test_what_device_joint_and_person_bore(motors):
    more = 1.0 + TIMES[:, None]
    # Beyond what a shoulder can do from 1 s on.
    turned = ep.shoulder_rotation(30.0, 10.0, np.where(TIMES < 1.0, 0.0, 170.0), degrees=True)
    run = recorded(motors, rotations=turned, tensions=more * [10, 20, 30, 40], tension_work=more * [1.0, 2, 3, 4],
                   electric_energy=more**2 * [1.0, 1, 0, 1], angular_velocity=more * [1.0, -2.0, 0.5]).run  # fmt: skip
    numbers, cuff, needed = run.summary(), run.cuff_wrench, run.needed_moment
    force = np.linalg.norm(run.shoulder_force, axis=1)
    power = np.abs((cuff[:, 3:] * run.angular_velocity).sum(axis=1))
    expected = {
        "mean_F_s_N": force.mean(), "peak_F_s_N": force.max(), "device_work_J": 2.0 * 10.0,
        "electric_energy_J": 3.0 * (9.0 - 1.0), "wearer_work_J": run.wearer_work[-1] - run.wearer_work[0],
        "peak_cuff_force_N": np.linalg.norm(cuff[:, :3], axis=1).max(),
        "peak_cuff_moment_N_m": np.linalg.norm(cuff[:, 3:], axis=1).max(),
        "peak_wearer_moment_N_m": np.linalg.norm(run.wearer_moment, axis=1).max(), "peak_cuff_power_W": power.max(),
        "assistance": (needed * cuff[:, 3:]).sum() / (needed**2).sum(), "outside_s": 1.01,
    }  # fmt: skip
    assert numbers == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(("share", "said"), [(1.0009, False), (1.0011, True)])
def test_pressures_above_the_safe_one_are_named(muscles, share, said):
    safe = muscles.run.plant.drives[1].supply_pressure
    run = recorded(muscles, pressures=column(1e5, 1, 40, share * safe)).run
    text = f"Muscle 2 reaches {share * safe / 1e5:.3g} bar, above its greatest safe pressure of {safe / 1e5:.3g} bar"
    assert any(each.startswith(text) for each in run.cautions) == said
    pulling = recorded(muscles, tensions=column(0.0, 0, slice(0, 50), 1.0)).run
    inside = 100.0 * pulling.in_range[:50, 0].mean()
    words = [text for text in pulling.cautions if text.startswith("The force laws of the muscles were identified in")]
    assert words == ([] if inside == 100.0 else [text for text in words if f"(muscle 1: {inside:.0f} %)" in text])
