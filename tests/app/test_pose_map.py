"""What a new question does to a map that is being computed."""

import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from exo_pin.app import pose_map
from exo_pin.app.asked import Asked
from exo_pin.app.pose_map import FLEXIONS, PoseMap

CABLES = Asked("four-cables", flexion=60.0, abduction=20.0, internal_rotation=10.0)


def test_a_new_question_drops_the_map_of_the_last(monkeypatch):
    begun, go, shown = threading.Event(), threading.Event(), []

    def column(exo, flexion, internal_rotation):
        begun.set()
        assert go.wait(30.0)
        return [exo.device.name, internal_rotation]

    with ThreadPoolExecutor(1) as executor:
        monkeypatch.setattr(pose_map, "workers", lambda: executor)
        monkeypatch.setattr(pose_map, "column_of_map", column)
        drawn = PoseMap(shown.append)
        drawn.ask(CABLES)
        assert begun.wait(30.0)
        drawn.ask(replace(CABLES, internal_rotation=0.0))
        drawn.ask(replace(CABLES, internal_rotation=0.0, flexion=5.0))  # another pose of the same box
        go.set()
    assert len(shown) == len(FLEXIONS)
    assert shown[-1] == {flexion: ["four-cables", 0.0] for flexion in FLEXIONS}
