"""Histories along movements: noise of linear forces, integrals by hand, a cuff that slips."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.load_case import MeasurementNoise
from exo_pin.reaction import MovementReaction

NAN = np.nan


def movement(count, covariance, poses=None, per_axis=0.01, method="gcv", end_effects=None):
    """A movement with a noise of its own."""
    rng = np.random.default_rng(count)
    ends = np.zeros(count, dtype=bool) if end_effects is None else np.array(end_effects)
    noise = MeasurementNoise(method, per_axis, None, 5.0, np.broadcast_to(covariance, (count, 3, 3)).copy(), ends)
    times = np.cumsum(rng.uniform(0.05, 0.2, count))
    poses = Rotation.random(count, rng=rng) if poses is None else poses
    return ep.Movement(times, poses, ep.Motion(*rng.normal(size=(2, count, 3))), noise)


def propagated(exo, moved, k, static, load=None):
    """Deviation of F_s at a sample, to first order: turn, ω and η have the covariance of its noise about each axis."""

    def force(turn, omega, eta):
        given = moved.motion.angular_velocity[k] + omega, moved.motion.angular_acceleration[k] + eta
        motion = None if static else ep.Motion(*given)
        return exo.reaction(Rotation.from_rotvec(turn) * moved.poses[k], motion, load).shoulder_force

    variance, step = 0.0, 1e-5
    for axis in np.eye(3):
        steps = [step * axis * part[:, None] for part in np.eye(3)]
        changes = np.array([force(*one) - force(*-one) for one in steps]) / (2.0 * step)
        variance += np.trace(changes.T @ moved.noise.covariance[k] @ changes)
    return np.sqrt(variance)


@pytest.mark.parametrize("static", [False, True])
def test_noise_of_a_movement_is_that_of_its_forces(static):
    rng = np.random.default_rng(3)
    exo = ep.load("prototype").worn_by(ep.Person(1.75, 75, "male")).replace(limbs=None)
    root = rng.normal(size=(7, 3, 3)) * 1e-6
    poses = exo.pose(rng.uniform(30.0, 60.0, 7), rng.uniform(40.0, 60.0, 7))
    moved = movement(7, root @ np.swapaxes(root, 1, 2), poses)
    found = exo.follow(moved, static=static).force_noise
    np.testing.assert_allclose(found, [propagated(exo, moved, k, static) for k in range(7)], rtol=1e-4)
    assert exo.follow(moved, static=static).typical_force_noise == np.median(found)


@pytest.fixture(scope="module", params=["some", "none", "still"])
def history(request):
    """Histories in which some, none or all samples are trusted; the last ones cannot be held."""
    exo = ep.load("four-cables-worn").replace(interfaces=ep.Interfaces(cuff_area=0.012))
    angles = np.array([0.0, 20.0, 40.0, 70.0, 90.0, 100.0, 30.0, 10.0])
    poses = exo.pose(angles, np.linspace(20.0, 80.0, 8))
    ends = np.array([1, 1, 0, 0, 0, 0, 0, 1], dtype=bool) if request.param != "none" else np.ones(8, dtype=bool)
    moved = movement(8, 1e-6 * np.eye(3), poses, end_effects=ends)
    motion = None if request.param == "still" else ep.Motion(*np.full((2, 8, 3), 0.1))
    moments = np.zeros((8, 3))
    moments[[4, 7]] = [900.0, 0.0, 0.0]
    reaction = exo.reaction(poses, motion, ep.Load([0.0, 0.0, -40.0], moments, at=[0.0, 0.0, -0.3]))
    assert reaction.held.tolist() == [True] * 4 + [False, True, True, False]
    return request.param, MovementReaction(moved, reaction, np.array([NAN, 1.0, 2.0, 9.0, NAN, 3.0, 4.0, 5.0]))


def test_peak_and_integrals_are_those_of_the_samples_that_count(history):
    kind, found = history
    held, size, times = found.reaction.held, found.reaction.magnitude, found.movement.times
    trusted = np.ones(8, dtype=bool) if kind == "still" else ~found.movement.noise.end_effects
    np.testing.assert_array_equal(found.trusted, trusted)
    counted = held & trusted if kind != "none" else held
    np.testing.assert_array_equal(found.counted, counted)
    best = max(np.flatnonzero(counted), key=lambda k: size[k])
    assert (found.peak, found.peak_time) == (size[best], times[best])
    assert found.largest == max(size[k] for k in np.flatnonzero(held))
    time = impulse = square = 0.0
    for k in range(7):
        if counted[k] and counted[k + 1]:
            dt = times[k + 1] - times[k]
            time, impulse = time + dt, impulse + dt * (size[k] + size[k + 1]) / 2.0
            square += dt * (size[k] ** 2 + size[k + 1] ** 2) / 2.0
    assert time > 0.0
    assert found.time_counted == pytest.approx(time, rel=1e-12)
    assert found.impulse == pytest.approx(impulse, rel=1e-12)
    assert found.rms == pytest.approx(np.sqrt(square / time), rel=1e-12)
    assert found.fraction_not_holdable == 1.0 - held.sum() / 8.0
    assert found.typical_force_noise == 3.5
    told = found.summary()
    assert list(told) == [
        "duration_s", "peak_N", "peak_time_s", "largest_with_end_effects_N", "rms_N", "impulse_N_s", "time_counted_s",
        "fraction_not_holdable", "singular_crossings", "force_noise_N",
    ]  # fmt: skip
    assert told["duration_s"] == times[-1] - times[0]
    weight = found.reaction.body_weight
    share = 100.0 * found.peak / weight
    assert (
        f"Largest force of the shoulder on the arm: {found.peak:.1f} N, {share:.1f} % of body weight, at "
        f"{found.peak_time:.4g} s."
    ) in str(found)
    assert sum(int(part.split()[0]) for part in str(found).split("status: ")[1].splitlines()[0].split(", ")) == 8


def test_a_soft_cuff_slips_by_its_compliance():
    bare = ep.load("four-cables-worn")
    cuff = ep.Interface.of([2e3, 3e3, 1e3], [10.0, 20.0, 5.0], at=[0.01, 0.0, -0.15])
    exo = bare.replace(interfaces=ep.Interfaces(cuff=cuff))
    found = exo.reaction(exo.pose([30.0, 60.0], [30.0, 10.0]))
    R = found.case.poses.as_matrix()
    for k in range(2):
        force, moment = R[k].T @ found.cuff_wrench[k, :3], R[k].T @ found.cuff_wrench[k, 3:]
        about = moment - np.cross([0.01, 0.0, -0.15], force)
        slip = np.append(force / [2e3, 3e3, 1e3], about / [10.0, 20.0, 5.0])
        np.testing.assert_allclose(found.cuff_slip[k], slip, atol=1e-12)
    moved, turned = (np.linalg.norm(part, axis=1).max() for part in np.split(found.cuff_slip, 2, axis=1))
    assert f"slips up to {1e3 * moved:.1f} mm and turns up to {np.degrees(turned):.1f}°." in found.cuff_text()
    assert found.cuff_pressure is None
    np.testing.assert_allclose(found.columns()["cuff_slip_m"], np.linalg.norm(found.cuff_slip[:, :3], axis=1))
    alone = ep.ShoulderExo(bare.geometry, ep.Arm(3.0, [0.0, 0.0, -0.25], device=True), limbs=[ep.Limb("SPS")] * 4)
    unworn = alone.reaction(alone.pose(30, 30))
    assert unworn.cuff_text() == ""
    assert not any("cuff" in name for name in unworn.columns())
