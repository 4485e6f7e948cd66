"""Answers of the page's parts as they are stored: words, figures, dimensions, maps, histories, samples and files."""

import json
import time
from dataclasses import replace
from unittest import mock

import numpy as np
import pytest
from answers import changes, each_of
from asked_in_turn import in_digits, in_turn
from places import URDF

import exo_pin as ep
from exo_pin.app.asked import Asked
from exo_pin.app.dimensions import dimensions_of
from exo_pin.app.files import LARGEST_DESIGN, PageFiles
from exo_pin.app.following import answered
from exo_pin.app.force_history import history
from exo_pin.app.live_samples import LiveSamples
from exo_pin.app.pose_map import ABDUCTIONS, FLEXIONS, chart_of, column_of_map, rings_at, top_of
from exo_pin.app.searching import Found
from exo_pin.app.words import answer_html, figures

SUPPORT = str(URDF / "spring-support.urdf")
CHANGED = Asked(
    "four-cables", (("cuff_height_mm", 200.0), ("A[1].radius_mm", 250.0)), flexion=30.0, payload=0.7, elbow=20.0
)
MOVING = Asked(flexion=40.123456, angular_velocity=(0.1, -2.0, 0.0), angular_acceleration=(0.0, -10.0, 1.5))
CASES = {
    "worn": Asked("four-linear-actuators-worn", flexion=60.0, abduction=30.0),
    "not held": Asked("prototype", height=1.6, mass=45.0, sex="female", flexion=45.0), "changed": CHANGED,
    "moving": MOVING,
    "flaccid": Asked(height=1.6, mass=45.0, sex="female", strength=0.0, payload=0.5, flexion=40.0, side="right",
    girth=300.0), "support": Asked(SUPPORT, elbow=45.0, clothing=4.0, flexion=70.0, shown="support"),
    "unknown": Asked(str(URDF / "nesm.urdf"), flexion=-30.0, abduction=100.0, strength=80.0, shown="nesm"),
    "refused": Asked("<script>"), "light": Asked(mass=1.0), "beyond": Asked("four-cables", flexion=20.0,
    abduction=-60.0),
}  # fmt: skip


def questions():
    """What a question is, what it asks in Python, and what dragging makes of it."""
    found = {}
    for name in ("changed", "moving", "flaccid", "support"):
        asked = CASES[name]
        here, joints = asked.pose.apply(asked.hand), asked.joints
        found[name] = {
            "name": asked.name, "angles": asked.angles, "anywhere": (asked.anywhere.angles, asked.anywhere.motion),
            "motion": asked.motion, "hand": asked.hand, "joints": joints, "python": asked.python(),
            "drags": [asked.with_hand_at(here + np.array(off)) for off in ((0.0, 0.0, 0.0), (0.1, 0.05, 0.1),
            (-0.3, 0.4, 0.9))],
            "person": (asked.person.height, asked.person.payload, asked.person.strength, asked.person.arm_girth,
            asked.person.clothing, asked.person.side), "dimensions": dimensions_of(asked.bare.device),
            "moved": [asked.with_joint_at(each, joints[each] + [0.01, -0.02, 0.03]).changes for each in [*joints][::3]],
            "twice": asked.changed("scale", 0.9).changes,
        }  # fmt: skip
    return found


def words():
    """What the page says, in full and while the arm moves."""
    found = {}
    for name, asked in CASES.items():
        for moving in (False, True):
            shown = answered(asked, moving)
            report = shown.report
            found[f"{name}{' moving' * moving}"] = {
                "refusal": shown.refusal, "page": answer_html(shown).split("><"),
                "figures": [] if report is None else figures(report), "parts": shown.parts,
            }  # fmt: skip
    return found


def maps():
    """Columns of a map, the chart, and its rings."""
    asked = replace(CHANGED, flexion=20.0, abduction=35.0)
    columns = {flexion: column_of_map(exo, flexion, 10.0) for exo in (asked.exo,) for flexion in FLEXIONS[::7]}
    free = column_of_map(CASES["support"].exo, 50.0, 0.0)
    said = Found(96, 0.4321, 0.21, {"scale": 0.9}).words, Found().words, Found(refusal="No.").words
    return (
        columns,
        free,
        top_of(columns),
        top_of({}),
        chart_of(columns, asked, 70.0),
        rings_at(asked),
        FLEXIONS,
        ABDUCTIONS,
        said,
    )


def histories():
    """Forces along movements, with and without muscles, longer than what is drawn."""
    short = ep.load("four-cables").worn_by(ep.Person(1.7, 70, "male"))
    path = ep.control.AnglePath([0.0, 0.5], np.radians([[10.0, 20.0, 0.0], [120.0, 40.0, 10.0]]))
    return [
        history(CASES["worn"].exo, path.movement(1000.0), None),
        history(short, path.movement(20.0), ep.Person(1.7, 70, "male")),
        history(CASES["support"].exo, path.movement(10.0), None),
    ]


def samples():
    """Replies to samples of a stream, in order, lost, late, and wrong, and what is said of them."""
    live, found = LiveSamples("of-the-page-token", "right"), []
    messages = [
        {"t": 0.0}, {"open": {}, "token": "wrong"}, {"open": {"design": "x"}, "token": "of-the-page-token"},
        {"open": {}, "token": "of-the-page-token", "rate": 0.0}, {"open": {}, "token": "of-the-page-token",
        "rate": 100.0}, {"t": 0.0, "flexion": 10.0}, {"t": 0.01, "seq": 1, "abduction": 20.0},
        {"t": 0.05, "seq": 5, "quaternion_wxyz": [0.9, 0.1, 0.3, np.sqrt(0.09)]},
        {"t": 0.06, "seq": 6, "quaternion_xyzw": [0.1, 0.2, 0.3, 2.0]}, {"t": 0.03, "seq": 3, "flexion": 1.0},
        {"t": 0.08, "seq": 8, "internal_rotation": -15.0}, {"t": 0.09, "seq": 9, "flexon": 1.0}, {"t": 0.1, "seq": 10},
    ]  # fmt: skip
    for message in messages:
        said = live.take(json.dumps(message))
        found.append([None if said is None else json.loads(said) | {"title": ""}, live.newest()])
    later, waiting = time.monotonic() + 7.0, LiveSamples("of-the-page-token", "left").words
    with mock.patch.object(time, "monotonic", return_value=later):
        silent = live.words
    return found, live.take(b"\xff") is not None, live.words.partition(" ms ")[2], waiting, silent


def files():
    """Files that the page keeps and writes, and those that it refuses."""
    pages = PageFiles()
    try:
        (name, content), (other, packed) = pages.design(CHANGED), pages.design(CASES["support"])
        return (name, in_digits(content.decode()).splitlines()), (other, packed[:2] == b"PK"), in_turn(
            kept=lambda: pages.keep("a\\b\\mine.TOML", b"x").rpartition("/")[2],
            ending=lambda: pages.keep("mine.exe", b"x"), hidden=lambda: pages.keep(".toml", b"x"),
            large=lambda: pages.keep("a.toml", b"x" * (LARGEST_DESIGN + 1), most=LARGEST_DESIGN),
            edge=lambda: pages.keep("a.csv", b"x" * 10, (".csv", ".txt"), 10).rpartition("/")[2],
            two=lambda: pages.keep("a.toml", b"x", (".csv", ".txt")), report=lambda: pages.report(CHANGED, ".html")[0],
        )  # fmt: skip
    finally:
        pages.close()


ASKED = {each.__name__: each for each in (questions, words, maps, histories, samples, files)}

#: Those that take longer than 0.15 s.
LONGER = {"words", "histories", "maps", "files"}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    assert not changes(__file__, name, ASKED[name])
