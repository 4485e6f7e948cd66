"""A movement that is played shows what is not held."""

from exo_pin.app.force_history import plot_of


def test_a_plot_marks_where_a_run_that_is_not_held_begins():
    held = [True, False, False, True, *[False] * 12]
    known = {"lines": [list(range(16)), [5.0] * 15 + [None], [None] * 16], "held": held, "words": ""}
    series = plot_of(["a", "b"], [known, None])["series"]
    assert [each.get("name") for each in series] == [None, "a: arm and device", "a: not held"]
    assert series[-1]["data"] == [[1, 5.0], [4, 5.0], [10, 5.0]]
