"""Which questions a range over the assumptions asks, and what it makes of the answers, without muscles."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from contact_results import some_contact

import exo_pin as ep
from exo_pin.person import ContactRange
from exo_pin.person.contact.assumption_range import _drawn, contact_range

PERSON = ep.Person(1.75, 75, "male", cuff_strength=0.9, scapular_motion=0.8, elbow_flexion=0.3, side="right")
GIVEN = ep.ContactOptions(socket_turn=0.1, centre_shift=(0.001, 0.002, -0.003))
CHANGES = {
    "cubed activations": {"power": 3},
    "volume weights": {"weights": "volume"},
    "passive forces on": {"passive": True},
    "no condition on the socket": {"cone": None},
    "socket 10° forward": {"socket_turn": 0.1 + np.pi / 18},
    "socket 10° backward": {"socket_turn": 0.1 - np.pi / 18},
    "rotator cuff of 56 %": {"cuff_strength": 0.9 * 0.56},
    "scapula moves by 70 %": {"scapular_motion": 0.8 * 0.7},
    "centre -5 mm forwards": {"centre_shift": (-0.004, 0.002, -0.003)},
    "centre +5 mm forwards": {"centre_shift": (0.006, 0.002, -0.003)},
    "centre -5 mm to the left": {"centre_shift": (0.001, -0.003, -0.003)},
    "centre +5 mm to the left": {"centre_shift": (0.001, 0.007, -0.003)},
    "centre -5 mm up": {"centre_shift": (0.001, 0.002, -0.008)},
    "centre +5 mm up": {"centre_shift": (0.001, 0.002, 0.002)},
}


def asked(options=GIVEN):
    """The questions themselves in place of answers."""
    return contact_range(
        lambda pose, person, *, options, **more: SimpleNamespace(pose=pose, person=person, options=options, more=more),
        "pose",
        PERSON,
        options,
        gravity="g",
    )


def same(one, other):
    """Whether two records agree in all but rounding."""
    for name, value in vars(other).items():
        if isinstance(value, (float, np.ndarray)):
            np.testing.assert_allclose(getattr(one, name), value, rtol=1e-12, atol=1e-15, err_msg=name)
        else:
            assert getattr(one, name) == value, name


def test_each_variant_changes_one_assumption():
    found = asked()
    assert list(found.variants) == list(CHANGES)
    for name, change in CHANGES.items():
        question = found.variants[name]
        assert (question.pose, question.more) == ("pose", {"gravity": "g"})
        of_person = {key: value for key, value in change.items() if hasattr(PERSON, key)}
        same(question.person, replace(PERSON, **of_person))
        same(question.options, replace(GIVEN, **{key: change[key] for key in change if key not in of_person}))
    assert found.reference.person is PERSON
    assert found.reference.options is GIVEN


def test_what_was_asked_for_is_turned_into_its_opposite():
    other = asked(ep.ContactOptions(power=3, weights="volume", passive=True, cone=None)).variants
    assert list(other)[:4] == ["squared activations", "equal weights", "passive forces off", "rotator cuff of 56 %"]
    assert other["squared activations"].options.power == 2
    assert other["equal weights"].options.weights == "equal"
    assert other["passive forces off"].options.passive is False
    assert len(other) == len(CHANGES) - 3
    same(asked(None).reference.options, ep.ContactOptions())


def test_persons_of_the_band_differ_as_documented():
    persons = asked().persons
    assert len(persons) == 60
    for question, size in zip(persons, ep.Wearer.drawn(60), strict=True):
        who, options = question.person, question.options
        assert (who.height, who.mass, who.sex) == (size.height, size.mass, size.sex)
        assert (who.side, who.elbow_flexion) == ("right", 0.3)
        same(options, replace(GIVEN, socket_turn=options.socket_turn))
    cuffs, motions, turns = np.array(
        [(q.person.cuff_strength / 0.9, q.person.scapular_motion / 0.8, q.options.socket_turn - 0.1) for q in persons]
    ).T
    # Even from the least to 1, and normal of 10°, cut at 20°: means and spreads within three standard errors of 60.
    for values, low in ((cuffs, 0.56), (motions, 0.7)):
        assert low < values.min() < low + 0.1 * (1.0 - low)
        assert 1.0 - 0.1 * (1.0 - low) < values.max() < 1.0
        assert values.mean() == pytest.approx(0.5 * (low + 1.0), abs=3.0 * (1.0 - low) / np.sqrt(12.0 * 60.0))
    assert np.abs(turns).max() == pytest.approx(np.radians(20.0), rel=1e-12)
    assert np.degrees(turns).mean() == pytest.approx(0.0, abs=4.0)
    assert np.degrees(turns).std() == pytest.approx(9.5, abs=2.7)
    assert np.abs(np.corrcoef([cuffs, motions, turns])[np.triu_indices(3, 1)]).max() < 0.4
    # Among more both ends are reached.
    turns = [options.socket_turn - GIVEN.socket_turn for _, options in _drawn(PERSON, GIVEN, 200)]
    np.testing.assert_allclose(np.degrees([min(turns), max(turns)]), [-20.0, 20.0], rtol=1e-12)
    # The same persons each time.
    again = asked().persons
    assert [q.options.socket_turn for q in again] == [q.options.socket_turn for q in persons]


def ranged(forces, persons, bare=None):
    """A range of given contact forces, N, the first of which is the reference."""
    withouts = [None] * len(forces) if bare is None else [some_contact(one) for one in bare]
    reference, *variants = [
        some_contact(force, without_device=without) for force, without in zip(forces, withouts, strict=True)
    ]
    named = {f"variant {k}": each for k, each in enumerate(variants)}
    return ContactRange(reference, named, tuple(some_contact(force) for force in persons))


def test_lowest_and_highest_leave_out_what_has_no_result():
    nan = np.nan
    found = ranged([[300.0, nan, nan], [250.0, 400.0, nan], [500.0, nan, nan]], [[1.0, 1.0, 1.0]])
    np.testing.assert_array_equal(found.lowest, [250.0, 400.0, nan])
    np.testing.assert_array_equal(found.highest, [500.0, 400.0, nan])
    assert found.relief_percent is None


def test_relief_is_that_of_the_variants():
    found = ranged([[300.0, np.nan], [250.0, 400.0]], [[1.0, 1.0]], bare=[[600.0, 500.0], [1000.0, 500.0]])
    low, high = found.relief_percent
    np.testing.assert_allclose(low, [50.0, 20.0])
    np.testing.assert_allclose(high, [75.0, 20.0])
    assert str(found).splitlines()[0].split() == ["N", "%", "BW", "relief", "%"]
    assert str(found).splitlines()[1].split() == ["as", "given", "300", "40", "50"]


def test_band_holds_nine_of_ten_persons():
    """Of 21 persons of 10, 11 ... 30 % of 750 N."""
    shares = np.arange(10.0, 31.0)
    rows = [[7.5 * share, np.nan, 7.5 * share if share > 19.0 else np.nan] for share in shares]
    found = ranged([[1.0, 1.0, 1.0]], rows)
    np.testing.assert_allclose(found.band[0], [11.0, np.nan, 20.5])
    np.testing.assert_allclose(found.band[1], [29.0, np.nan, 29.5])
    last, note = str(found).splitlines()[-2:]
    assert last == "21 persons who differ in size, rotator cuff, socket and scapular rhythm, nine of ten: 16 to 29 % BW"
    assert note == "medians over the poses that have a result"
    assert "relief" not in str(found)


def test_a_single_pose_has_no_medians():
    text = str(ranged([150.0, np.nan], [150.0, 150.0]))
    assert [line.split() for line in text.splitlines()[1:3]] == [
        ["as", "given", "150", "20"],
        ["variant", "0", "-", "-"],
    ]
    assert text.endswith("nine of ten: 20 to 20 % BW")
