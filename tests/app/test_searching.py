"""The search of the page ends when it is told to, and says what cannot be searched."""

import threading

import pytest

from exo_pin.app.asked import Asked
from exo_pin.app.searching import Search

BOUNDS = {"cuff_height_mm": (160.0, 270.0), "A[1].radius_mm": (200.0, 300.0)}


@pytest.fixture(autouse=True)
def _optimisers():
    pytest.importorskip("optuna")
    pytest.importorskip("cmaes")


@pytest.mark.full
def test_a_search_is_watched_and_stopped():
    looks, some = [], threading.Event()

    def show(found):
        looks.append(found)
        some.set()

    search = Search(show)
    search.start(Asked("four-cables").exo, BOUNDS)
    assert some.wait(120.0)
    process = search._process
    search.stop()
    process.join(30.0)
    assert not process.is_alive()
    assert not search.works
    assert looks[0].refusal == ""
    assert "designs tried" in looks[0].words


@pytest.mark.full
def test_what_cannot_be_searched_is_said():
    ended, looks = threading.Event(), []
    search = Search(lambda found: (looks.append(found), found is None and ended.set()))
    search.start(Asked("four-cables").exo, {"nothing_mm": (0.0, 1.0)})
    assert ended.wait(120.0)
    assert "nothing_mm" in looks[0].words
    assert not search.works
