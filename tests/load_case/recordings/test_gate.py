"""The gate of recordings: planted mistakes are named at every door, genuine records pass without a word."""

import foreign_records as foreign
import numpy as np
import planted_records as planted
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.control import read_run
from exo_pin.load_case.recordings.plausibility import Evidence

#: All records with a mistake; of these some in default runs.
ALL = [(mistake, seed) for mistake, seeds in planted.MISTAKES for seed in seeds]
QUICK = {"w_first-0", "radians_as_degrees-0", "transposed-2", "frames_in_t-0", "seconds_as_milliseconds-4", "no_rest-2"}


def named(case):
    return f"{case[0].__name__}-{case[1]}"


def of(cases):
    """Cases as parameters of a test, those that are not quick marked."""
    marks = [() if named(case) in QUICK else pytest.mark.full for case in cases]
    return [pytest.param(case, id=named(case), marks=mark) for case, mark in zip(cases, marks, strict=True)]


@pytest.mark.parametrize(
    ("name", "most"),
    [("speed", 30.0), ("noise", np.radians(2.0)), ("from_start", np.radians(20.0)), ("outside", 0.01), ("aside", 0.01),
     ("leaning", np.radians(45.0))],
)  # fmt: skip
def test_an_arm_can_have_moved_like_this_only_within_all_limits(name, most):
    zero = Evidence(0.0, True, False, 0.0, 1.0, 0.0, 0.3, 0.0, 0.0, 0.0)
    assert zero._replace(**{name: 0.999 * most}).is_possible
    assert not zero._replace(**{name: 1.001 * most}).is_possible


@pytest.mark.parametrize("case", of(ALL))
def test_planted_mistakes_are_named(tmp_path, case):
    (mistake, seed), side = case, planted.side_of(case[1])
    path, options, word = mistake(tmp_path, seed)
    text = planted.answer(lambda: ep.read_movement(path, side, reading=ep.RecordingOptions(**options)).cautions)
    assert planted.is_named(text, word), text
    if word.startswith("reading="):
        # What the message says to give cures it.
        name = word.split('"')[1]
        cured = ep.read_movement(path, side, reading=ep.RecordingOptions(**{**options, "reading": name}))
        assert not cured.cautions
        accepted = {**options, "reading": "as-named"}
        text = planted.answer(lambda: ep.read_movement(path, side, reading=ep.RecordingOptions(**accepted)).cautions)
        assert "reading=" not in text


@pytest.mark.full
@pytest.mark.parametrize("case", [case for case in ALL if named(case) in QUICK], ids=named)
def test_every_door_names_planted_mistakes(tmp_path, case):
    path, options, word = case[0](tmp_path, case[1])
    for name, door in planted.doors(path, planted.side_of(case[1]), options).items():
        text = planted.answer(door)
        assert planted.is_named(text, word), (name, text)


@pytest.mark.full
@pytest.mark.parametrize(("heading", "said"), [(90.0, "points up or down, not forward"), (130.0, "from upright")])
def test_a_trunk_that_would_not_stand_upright_names_the_other_order(tmp_path, monkeypatch, heading, said):
    """A sensor with z forward and x to the side, whose numbers in another order let z point up."""
    monkeypatch.setattr(foreign, "ON_TRUNK", foreign.ON_TRUNK * Rotation.from_euler("z", 90.0, degrees=True))
    standing = Rotation.from_euler("z", heading, degrees=True)
    monkeypatch.setattr(foreign, "trunk", lambda truth: Rotation.concatenate([standing] * len(truth.t)))
    truth = foreign.movement(0, "left")
    truth = truth._replace(elbow=0.0 * truth.t)

    def text():
        path, options = foreign.opensense(tmp_path, truth)
        return planted.answer(lambda: ep.read_movement(path, reading=ep.RecordingOptions(**options)).cautions)

    assert not text()
    monkeypatch.setattr(foreign, "wxyz", Rotation.as_quat)
    assert said in text()
    assert planted.is_named(text(), 'reading="w-last"')


@pytest.mark.full
@pytest.mark.parametrize("side", ["left", "right"])
def test_movements_of_an_arm_pass(tmp_path, side):
    for name, truth in foreign.special_movements(side).items():
        for writer in (foreign.clinical, foreign.quaternions):
            assert not ep.read_movement(writer(tmp_path, truth)[0], side).cautions, name


def test_poses_of_a_run_are_doubted_too(tmp_path):
    truth = foreign.movement(1, "left")
    rows = np.c_[truth.poses.as_quat(scalar_first=True)[::10], np.full((len(truth.t[::10]), 1), 300.0)].tolist()
    path = foreign.lines(tmp_path / "run.csv", [], ("qx", "qy", "qz", "qw", "length_1_mm"), rows)
    with pytest.warns(ep.SuspectMeasurements, match="w-first"):
        read_run(path)
    assert (read_run(path, reading="w-first").poses * truth.poses[::10].inv()).magnitude().max() < 1e-5
