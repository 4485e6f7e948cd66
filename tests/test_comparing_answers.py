"""What counts as another answer than the stored one, and what does not."""

import json
import warnings

import pytest
from answers import answer, changes, each_of, steady

import exo_pin as ep

STORED = {"force": 12.345678, "words": "12.3 N, of 2 limbs; there are: a, b", "rows": [1.0, 2.0], "none": None}


def asked(found):
    def question():
        if isinstance(found, Exception):
            raise found
        return found

    return question


def changed(folder, found, stored=STORED):
    (folder / "answers").mkdir()
    (folder / "answers" / "it.json").write_text(json.dumps(answer(asked(stored))))
    return changes(folder / "test_answers.py", "it", asked(found))


@pytest.mark.parametrize(
    "found",
    [
        STORED,
        STORED | {"force": 12.3457},
        STORED | {"new": 3},
        STORED | {"words": "12.4 N, of 2 limbs; there are: a, aa, b"},
    ],
)
def test_digits_and_what_comes_besides_are_no_change(tmp_path, found):
    assert changed(tmp_path, found) == []


@pytest.mark.parametrize(
    "found",
    [
        STORED | {"force": 12.36},
        STORED | {"force": -12.345678},
        STORED | {"force": float("nan")},
        {name: value for name, value in STORED.items() if name != "force"},
        STORED | {"words": "12.5 N, of 2 limbs; there are: a, b"},
        STORED | {"words": "12.3 N, of 3 limbs; there are: a, b"},
        STORED | {"words": "12.3 N, of 2 limbs; there are: a"},
        STORED | {"rows": [1.0, 2.0, 2.0]},
        STORED | {"none": 0.0},
        ep.InvalidInput("no"),
    ],
)
def test_another_answer_is_a_change(tmp_path, found):
    assert changed(tmp_path, found)


def test_errors_warnings_and_what_is_not_stored_are_changes(tmp_path):
    assert changed(tmp_path, ep.MissingData(["mass"], "it"), ep.InvalidInput("no"))
    assert changes(tmp_path / "test_answers.py", "other", asked(STORED)) != []

    def warned():
        warnings.warn("mind", ep.ExoPinWarning, stacklevel=1)
        return STORED

    (tmp_path / "answers" / "warned.json").write_text(json.dumps(answer(asked(STORED))))
    assert changes(tmp_path / "test_answers.py", "warned", warned)


def test_longer_questions_run_in_the_full_run():
    mark = each_of({"a": 1, "b": 2}, longer=["b"]).mark
    assert [(each.values[0], len(each.marks)) for each in mark.args[1]] == [("a", 0), ("b", 1)]
    with pytest.raises(AssertionError):
        each_of({"a": 1}, longer=["gone"])


def test_what_other_processors_round_otherwise_may_be_anything(tmp_path):
    other = {"force": 12.3459, "words": "12.3 N, of 2 limbs; there are: a, b", "rows": [1.0, 2.1], "none": [1]}
    found = steady(STORED, other)
    assert found == {"force": "…", "words": STORED["words"], "rows": [1.0, "…"], "none": "…"}
    assert steady(STORED, STORED) == STORED
    assert steady([1.0, 2.0], [1.0]) == "…"
    assert steady({"a": 1, "b": 2}, {"a": 1}) == {"a": 1}
    assert changed(tmp_path, STORED | {"force": 99.0, "rows": [1.0, 7.0], "none": "x"}, found) == []
    assert changes(tmp_path / "test_answers.py", "it", asked(STORED | {"rows": [1.1, 2.0]})) != []
