"""Histories along movements: noise of linear forces, integrals by hand, cautions word by word, files read back."""

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


def test_noise_is_computed_at_25_samples_or_at_all():
    exo = ep.load("prototype").worn_by(ep.Person(1.75, 75, "male")).replace(limbs=None)
    poses = exo.pose(np.linspace(0.0, 60.0, 60), 50.0)
    moved = movement(60, 1e-12 * np.eye(3), poses)
    at = np.flatnonzero(np.isfinite(exo.follow(moved).force_noise))
    assert len(at) == 25
    assert at[[0, -1]].tolist() == [0, 59]
    assert set(np.diff(at)) == {2, 3}
    # At all of them where other data of the question have a value for each sample.
    push = np.ones((60, 3))
    for question in ({"load": ep.Load(push)}, {"limits": (-1e4 * push, 1e4)}, {"limits": (-1e4, [1e4 * push[0]] * 60)}):
        assert np.isfinite(exo.follow(moved, **question).force_noise).all()
    assert np.isfinite(exo.follow(moved, load=ep.Load(push[0]), limits=(-1e4, 1e4)).force_noise).sum() == 25
    # Not at samples without forces, here at the singular pose.
    lost = movement(
        60, 1e-12 * np.eye(3), ep.thesis_rotation(np.where(np.arange(60) < 50, 90.0, 20.0), 0, 0, degrees=True)
    )
    assert np.flatnonzero(np.isfinite(exo.follow(lost).force_noise)).tolist() == [*range(50, 60)]


@pytest.mark.parametrize(("per_axis", "expected"), [(0.0, 0.0), (1e-13, 0.0), (NAN, NAN)])
def test_no_noise_and_unknown_noise(per_axis, expected):
    exo = ep.load("four-cables")
    moved = movement(4, np.zeros((3, 3)), exo.pose([20.0, 30.0, 40.0, 50.0], 30.0), per_axis=per_axis)
    found = exo.follow(moved)
    np.testing.assert_array_equal(found.force_noise, np.full(4, expected))
    assert not any("noise" in text for text in found.cautions)


def test_cautions_of_the_ends_and_of_noise_word_by_word():
    exo = ep.load("four-cables")
    advice = "Record a second before and after the movement, or state that the arm rests at both ends (ends)."
    poses, load = exo.pose(np.full(4, 40.0), 30.0), np.zeros((4, 3))
    load[:, 2] = [-90.0, -10.0, -20.0, -5.0]

    def followed(ends, load=load, poses=poses, motion=True, method="gcv", noise=NAN):
        own = movement(4, 1e-12 * np.eye(3), poses, method=method, end_effects=ends)
        reaction = exo.reaction(poses, own.motion if motion else None, ep.Load(load, at=[0.0, 0.0, -0.3]))
        assert reaction.held.all()
        # Shares of the force in the median sample of those whose noise is known.
        noise = np.broadcast_to(noise, 4)
        size = np.median(reaction.magnitude[np.isfinite(noise) | ~np.isfinite(noise).any()])
        return MovementReaction(own, reaction, noise * size)

    outer, every = [True, False, False, True], [True] * 4
    assert followed(outer, motion=False).cautions == followed([False] * 4).cautions
    assert followed(every).cautions[0] == (
        f"The ends of the record or a gap govern the accelerations of all held samples. {advice}"
    )
    found = followed(outer)
    size, times = found.reaction.magnitude, found.movement.times
    assert size[0] > 1.1 * size[1:3].max()
    assert found.cautions[0] == (
        f"The ends of the record or a gap govern the accelerations of 2 of 4 samples. |F_s| reaches {size[0]:.1f} N "
        f"there, at {times[0]:.3g} s, and {size[1:3].max():.1f} N elsewhere. {advice}"
    )
    assert followed([False, True, True, False]).cautions == followed([False] * 4).cautions
    for method, words in (
        ("interpolation", 'smooth the movement, Movement.from_samples(..., smoothing="gcv")'),
        ("gcv", "the sensor, its rate or the record do not allow better forces; static=True leaves ω and η out"),
    ):
        noisy = followed([False] * 4, method=method, noise=[0.101, 0.3, 0.1, NAN])
        typical, median = noisy.typical_force_noise, np.median(noisy.reaction.magnitude[:3])
        assert noisy.cautions[0] == (
            f"Measurement noise makes up {100 * typical / median:.0f} % of the shoulder force ({typical:.3g} of "
            f"{median:.3g} N in the median sample): {noisy.movement.noise}; {words}."
        )
    for quiet in ([0.0, 0.0, 0.0, NAN], [0.09, 0.3, 0.01, 0.01], NAN):
        assert followed([False] * 4, noise=quiet).cautions == followed([False] * 4).cautions
    with pytest.warns(ep.NoisyMovement, match="Measurement noise makes up"):
        exo.follow(movement(4, 1.0 * np.eye(3), poses))


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


def test_a_movement_that_is_held_nowhere_has_no_peak(history):
    found = history[1]
    lost = ep.load("four-cables").reaction(found.movement.poses, load=ep.Load(np.zeros(3), [900.0, 0.0, 0.0]))
    none = MovementReaction(found.movement, lost, np.full(8, NAN))
    assert not lost.held.any()
    for value in (none.peak, none.peak_time, none.rms, none.largest, none.typical_force_noise):
        assert np.isnan(value)
    assert none.impulse == none.time_counted == 0.0
    assert none.fraction_not_holdable == 1.0
    assert "Largest force" not in str(none)


def test_columns_have_what_the_answer_has(history):
    found = history[1]
    table = found.columns()
    for name, values in (
        ("time_s", found.movement.times),
        ("omega_y_rad_s", found.movement.motion.angular_velocity[:, 1]),
        ("eta_z_rad_s2", found.movement.motion.angular_acceleration[:, 2]),
        ("F_s_x_N", found.reaction.shoulder_force[:, 0]),
        ("F_s_noise_N", found.force_noise),
        ("end_effects", found.movement.noise.end_effects),
        ("status", found.reaction.status),
    ):
        np.testing.assert_array_equal(table[name], values)


def test_the_cuff_is_in_balance_with_what_it_says(history):
    found = history[1].reaction
    R, force = found.case.poses.as_matrix(), found.cuff_wrench[:, :3]
    along = -np.einsum("ki,ki->k", R[:, :, 2], force)
    across = np.linalg.norm(np.cross(R[:, :, 2], force), axis=1)
    np.testing.assert_allclose(found.cuff_pull, along, atol=1e-10)
    np.testing.assert_allclose(found.cuff_pressure, across / 0.012, rtol=1e-9)
    assert found.cuff_slip is None
    held = found.held
    most = max(along[held], key=abs)
    words = (
        f"The cuff pulls along the arm with up to {abs(most):.0f} N, towards the {'shoulder' if most < 0 else 'hand'}"
    )
    pressure = f"mean force over area on the skin is up to {across[held].max() / 12.0:.1f} kPa, on 120 cm²."
    assert found.cuff_text() == f"{words}. Across the arm, its {pressure}"
    lost = int(np.flatnonzero(~held)[0])
    assert f"with {abs(along[lost]):.0f} N" in found.cuff_text((lost,))
    assert [name for name in found.columns() if "cuff" in name] == ["cuff_pull_N", "cuff_pressure_Pa"]


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
