"""Every picture is as it was when somebody last looked at it; ``tests/oracles/describe.py`` shows and stores."""

import pytest
from describe import NAMES, changes
from drawn_figures import FIGURES, OF_PERSON
from drawn_scenes import PERSONS
from scenes import has_human
from words_apart import assert_words_are_apart

#: Figures whose words are turned, or whose axes are hidden.
TURNED = ("postures", "muscle_map", "slices")


@pytest.mark.parametrize("name", NAMES)
def test_a_picture_is_as_it_was_looked_at(name):
    if name in PERSONS or name in OF_PERSON:
        pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
        pytest.importorskip("clarabel", reason="needs the extra person: pip install '.[person]'")
    if name.startswith("human") and not has_human():
        pytest.skip("example-robot-data is not installed")
    found = changes(name)
    advice = f"to look at it: python tests/oracles/describe.py {name}; if it is good, store it: --store"
    assert not found, "\n    ".join([f"{len(found)} changes", *found[:12], advice])


@pytest.mark.full
@pytest.mark.parametrize("name", [name for name in FIGURES if not name.startswith(TURNED)])
def test_no_word_covers_another(name):
    assert_words_are_apart(FIGURES[name]())
