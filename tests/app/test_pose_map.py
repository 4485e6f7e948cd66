"""The map of the page beside single answers, and what a new question does to one that is being computed."""

import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import pytest
from places import URDF

from exo_pin.app import pose_map
from exo_pin.app.asked import Asked
from exo_pin.app.pose_map import ABDUCTIONS, FLEXIONS, PoseMap, chart_of, column_of_map, top_of

CABLES = Asked("four-cables", flexion=60.0, abduction=20.0, internal_rotation=10.0)


@pytest.mark.parametrize("design", ["four-cables", str(URDF / "spring-support.urdf")])
def test_a_column_has_the_answers_of_its_poses(design):
    exo = replace(CABLES, design=design).exo
    column = column_of_map(exo, 130.0, 10.0)
    for k in (0, 5, len(ABDUCTIONS) - 1):
        answer = exo.reaction(exo.pose(130.0, ABDUCTIONS[k], 10.0))
        # A support without drives leaves moments to its wearer, and has its force all the same.
        known = bool(answer.held) if design == "four-cables" else bool(answer.has_answer)
        assert (column[k] is not None) == known
        assert not known or column[k] == pytest.approx(float(answer.magnitude), rel=1e-9)
    assert None in column or design != "four-cables"


def test_a_chart_tells_poses_that_are_not_held_from_those_of_no_force():
    columns = {FLEXIONS[0]: [None, 0.0, *[50.0] * (len(ABDUCTIONS) - 2)]}
    chart = chart_of(columns, CABLES, 70.0)
    held, others, *rings = chart["series"]
    assert (chart["visualMap"]["max"], top_of(columns)) == (70.0, 50)
    assert [cell[:2] for cell in others["data"]] == [[0, 0]]
    assert held["data"][0] == [0, 1, 0.0]
    assert len(held["data"]) == len(ABDUCTIONS) - 1
    assert all(ring["data"] == [[10.0, 3.0]] for ring in rings)


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
