"""Doubtful records of movement are named, clean ones are not, counted over generated records with known forces."""

import collections

import doubtful_records
import measured_movements as measured
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.load_case import Movement, read_movement

EXO = measured.exo()
#: What the caution about each fault says, and the share of such records that it is found in at least.
WORDS = {
    "filtered": ("was filtered", 0.75),
    "polynomial": ("was filtered", 0.75),
    "slow sensor": ("slower than the record", 0.9),
    "stands still": ("stood still", 0.75),
    "gap": ("has no samples for", 0.9),
}


def size(poses, motion):
    return np.linalg.norm(measured.forces(EXO, poses, motion), axis=1)


def check_records(seeds):
    """Share of clean records with a caution, and of each fault with its own."""
    false, found, clean, count = 0, collections.Counter(), 0, len(seeds)
    for seed in seeds:
        record = doubtful_records.Record(seed)
        for each in record.clean().values():
            false += bool(Movement.from_samples(*each).cautions)
            clean += 1
        for name, each in record.doubtful(size(record.poses, record.motion)).items():
            found[name] += any(WORDS[name][0] in text for text in Movement.from_samples(*each).cautions)
    assert false <= 0.05 * clean
    assert {name: found[name] / count >= least for name, (_, least) in WORDS.items()} == dict.fromkeys(WORDS, True)


def test_doubtful_records_are_named_and_clean_ones_are_not():
    check_records(range(1))


@pytest.mark.parametrize("last", [pytest.param(14, marks=pytest.mark.full), pytest.param(42, marks=pytest.mark.long)])
def test_doubtful_records_are_named_and_clean_ones_are_not_in_many_records(last):
    check_records(range(2, last))


@pytest.mark.filterwarnings("ignore::exo_pin.NoisyMovement")
@pytest.mark.parametrize(
    ("seed", "fault", "least", "greatest"),
    [(7, "filtered", 1.5, 3.0), (7, "polynomial", 1.3, 3.0), (8, "slow sensor", 3.0, 9.0),
     (8, "stands still", 2.0, 4.0), (3, "gap", 0.3, 0.7)],
)  # fmt: skip
def test_cautions_are_about_records_whose_peaks_are_wrong(seed, fault, least, greatest):
    """A faulty record misses the peak by far, the raw one does not; the answer names the fault."""
    record = doubtful_records.Record(seed)
    true = size(record.poses, record.motion)
    raw = EXO.follow(Movement.from_samples(*record.clean()["raw"]), limits="none")
    assert raw.peak == pytest.approx(true.max(), rel=0.1)
    assert not raw.movement.cautions
    movement = Movement.from_samples(*record.doubtful(true)[fault])
    answer = EXO.follow(movement, limits="none")
    assert least < answer.peak / true.max() < greatest
    named = next(text for text in answer.cautions if WORDS[fault][0] in text)
    assert f"Caution: {named}" in str(answer)
    # The same through the other door for movements; without ω and η only the poses are in doubt.
    assert set(movement.cautions) <= set(EXO.reaction(movement, limits="none").cautions)
    assert set(EXO.follow(movement, static=True, limits="none").cautions).isdisjoint(movement.motion.cautions)


def test_nine_noisy_samples_are_refused_and_nine_exact_ones_named():
    record = doubtful_records.Record(8)
    nine = slice(40, 49)
    with pytest.raises(ep.InvalidInput, match=r"9 samples are too few .* noise multiplied"):
        Movement.from_samples(record.t[nine], measured.noisy(record.rng, record.poses[nine], np.radians(0.3)))
    few = Movement.from_samples(record.t[::50], record.poses[::50])
    assert "10 samples are too few" in few.cautions[0]


@pytest.mark.full
def test_peak_over_trusted_samples_comes_first():
    """In quick records the ends lead the peak: it is told apart."""
    led = 0
    for seed in range(8):
        rng, t = np.random.default_rng(seed), np.linspace(0.0, 0.8, 81)
        movement = Movement.from_samples(t, measured.noisy(rng, measured.reach(t, 0.8)[0], np.radians(0.5)))
        answer = EXO.follow(movement, limits="none")
        inside = ~movement.noise.end_effects
        if not inside.any():
            assert "all held samples" in answer.cautions[0]
            continue
        assert answer.peak == answer.reaction.magnitude[inside].max()
        assert t[answer.reaction.magnitude.tolist().index(answer.peak)] == answer.peak_time
        assert answer.largest == answer.reaction.magnitude.max() == answer.summary()["largest_with_end_effects_N"]
        if answer.largest > 1.01 * answer.peak:
            led += 1
            assert f"|F_s| reaches {answer.largest:.1f} N" in answer.cautions[0]
        # At rest the ends govern nothing.
        assert EXO.follow(movement, static=True, limits="none").trusted.all()
    assert led >= 4


def test_mean_and_impulse_are_over_the_samples_of_the_peak():
    rng, t = np.random.default_rng(1), np.linspace(0.0, 1.2, 121)
    movement = Movement.from_samples(t, measured.noisy(rng, measured.reach(t, 1.2)[0], np.radians(0.5)))
    answer = EXO.follow(movement, limits="none")
    rows, size = answer.counted, answer.reaction.magnitude
    assert rows.any()
    assert not rows.all()
    inside = slice(int(rows.argmax()), len(rows) - int(rows[::-1].argmax()))
    assert rows[inside].all()
    assert answer.time_counted == pytest.approx(np.ptp(t[inside]))
    assert answer.impulse == pytest.approx(np.trapezoid(size[inside], t[inside]))
    assert answer.rms == pytest.approx(np.sqrt(np.trapezoid(size[inside] ** 2, t[inside]) / np.ptp(t[inside])))
    assert answer.rms <= answer.peak


def rows(header, times, poses, blank=()):
    """Text of a CSV file of quaternions with a column of notes; the rows in ``blank`` have no orientation."""
    lines = [
        f"{time!r},note {k},{','.join(['', 'NaN', 'na', ' '] if k in blank else map(repr, q))}"
        for k, (time, q) in enumerate(zip(times, poses.as_quat().tolist(), strict=True))
    ]
    return "\n".join([f"{header},remark,qx,qy,qz,qw", *lines])


@pytest.mark.parametrize(
    ("header", "factor", "start"),
    [
        ("time_s", 1.0, 0.0),
        ("time_ms", 1e3, 5.0),
        ("time_us", 1e6, 0.0),
        ("time", 1.0, 3.0),
        ("t", 1e3, 0.0),
        ("timestamp", 1.0, 1.7e9),
        ("time_s", 1.0, 1.7e9),
        ("timestamp", 1e3, 1.7e12),
        ("time", 1e9, 1.7e18),
    ],
)
def test_units_of_time_are_told_apart_and_other_columns_left_alone(tmp_path, header, factor, start):
    t = np.linspace(0.0, 2.0, 101)
    poses, motion = measured.movement(t)
    (tmp_path / "record.csv").write_text(rows(header, (start + factor * t).tolist(), poses))
    found = read_movement(tmp_path / "record.csv")
    assert found.duration == pytest.approx(2.0, abs=1e-6)
    assert found.times[0] == pytest.approx(0.0 if start > 1e8 else start / factor)
    error = np.abs(found.motion.angular_acceleration - motion.angular_acceleration)
    assert error.max() < 0.05 * np.abs(motion.angular_acceleration).max()
    assert not found.cautions


def test_milliseconds_that_are_called_seconds_are_named(tmp_path):
    t = np.linspace(0.0, 2.0, 101)
    (tmp_path / "record.csv").write_text(rows("time_s", (1e3 * t).tolist(), measured.movement(t)[0]))
    assert "are these milliseconds (column time_ms)" in read_movement(tmp_path / "record.csv").cautions[0]


def test_blank_cells_are_gaps(tmp_path):
    t = np.linspace(0.0, 2.0, 101)
    poses, _ = measured.movement(t)
    (tmp_path / "record.csv").write_text(rows("time_s", t.tolist(), poses, blank=(7, 8, *range(40, 60))))
    found = read_movement(tmp_path / "record.csv")
    assert len(found.times) == 79
    assert found.cautions[0] == "22 of 101 rows have no orientation or no time and count as gaps."
    assert "no samples for 0.42 s after t = 0.78 s" in found.cautions[1]
    np.testing.assert_array_equal(found.times, np.delete(t, [7, 8, *range(40, 60)]))


@pytest.mark.full
def test_a_run_of_the_plant_is_read_back(tmp_path):
    run = ep.experiment("held-abduction", "model").replace(duration=0.3).run()
    run.to_csv(tmp_path / "run.csv")
    found = read_movement(tmp_path / "run.csv")
    np.testing.assert_allclose((found.poses * run.run.rotations.inv()).magnitude(), 0.0, atol=2e-3)
    measured_run = ep.control.read_run(tmp_path / "run.csv")
    np.testing.assert_allclose(measured_run.lengths, run.run.lengths, rtol=1e-8)
    assert isinstance(measured_run.poses, Rotation)


def test_doubts_about_a_record_reach_the_run_that_follows_it(tmp_path):
    t = np.linspace(0.0, 1.0, 51)
    poses = ep.shoulder_rotation(20.0 + 10.0 * t**2 * (3 - 2 * t), 20.0, 0.0, degrees=True)
    (tmp_path / "lift.csv").write_text(rows("time_s", t.tolist(), poses, blank=range(20, 40)))
    reference = ep.control.read_reference(tmp_path / "lift.csv")
    assert any("no samples for" in text for text in reference.cautions)
    tracking = ep.load("four-cables").track(str(tmp_path / "lift.csv"), duration=0.1)
    assert tracking.cautions[: len(reference.cautions)] == reference.cautions
