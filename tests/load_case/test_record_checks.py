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


@pytest.mark.full
def test_a_run_of_the_plant_is_read_back(tmp_path):
    run = ep.experiment("held-abduction", "model").replace(duration=0.3).run()
    run.to_csv(tmp_path / "run.csv")
    found = read_movement(tmp_path / "run.csv")
    np.testing.assert_allclose((found.poses * run.run.rotations.inv()).magnitude(), 0.0, atol=2e-3)
    measured_run = ep.control.read_run(tmp_path / "run.csv")
    np.testing.assert_allclose(measured_run.lengths, run.run.lengths, rtol=1e-8)
    assert isinstance(measured_run.poses, Rotation)
