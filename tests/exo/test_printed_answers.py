"""What is printed of a pose, beside a stored text: words as they are, numbers to their last digit.

``PYTHONPATH=tests/oracles python tests/exo/test_printed_answers.py`` stores it again; read the difference.
"""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from places import URDF

import exo_pin as ep
from exo_pin.exo.first_answer import answer_in_parts
from exo_pin.exo.pose_report import report_on_pose
from exo_pin.exo.questions import answered

pytestmark = pytest.mark.usefixtures("plain")
STORED = Path(__file__).with_name("printed_answers.txt")
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?!\w)")
MAN = ep.Wearer(1.755, 85, "male", payload=0.5, elbow_flexion=0.5)


def printed(exo, angles, person=None, offset=None, **query):
    if offset is not None:
        query["centre_offset"] = 1e-3 * np.array(offset)
    answer = exo.reaction(exo.pose(*angles), **query)
    asked = (*angles, 0.0, 0.0, 0.0)[:3]
    told = report_on_pose(exo, answer, person, angles=asked, offset=offset)
    texts = [str(told), told.explained()]
    verdict, reason, lines, drives = answer_in_parts(told, moving=answer.case.motion is not None)
    texts.append("\n".join([verdict, reason, *map(" | ".join, lines), *map(" | ".join, drives)]))
    return "\n\n".join(texts)


def batch(**question):
    found = answered(json.dumps(question), 3)
    answer = found["answer"] or {}
    kept = {key: value for key, value in answer.items() if len(json.dumps(value)) < 300}
    found["answer"] = {key: value for key, value in kept.items() if key not in ("residual", "kkt", "gap")} or None
    return json.dumps(found, indent=1, sort_keys=True)


def toml(name):
    return (Path(ep.__file__).parent / "design" / "presets" / f"{name}.toml").read_text()


CASES = {
    "held": lambda: printed(ep.load("four-cables-worn"), (60, 30)),
    "not held, with a better pose": lambda: printed(ep.load("four-cables-worn"), (60, 30), limits=30.0),
    "beyond": lambda: printed(ep.load("prototype").worn_by(MAN), (60, 30), split="minimal"),
    "singular": lambda: printed(ep.load("prototype").worn_by(MAN), (0, 90)),
    "almost singular": lambda: printed(ep.load("prototype").worn_by(MAN), (0, 88), limits="none"),
    "right, off and loaded": lambda: printed(
        ep.load("four-linear-actuators-worn", side="right").worn_by(MAN),
        (50, 20, 10),
        offset=(4.0, -3.0, 2.0),
        load=ep.Load([0.0, 5.0, -10.0], at=[0.0, 0.0, -0.3]),
    ),
    "limits unknown": lambda: printed(ep.load("prototype").replace(limbs=None), (30, 30)),
    "moving": lambda: printed(
        ep.load("four-linear-actuators-worn"), (60, 30), motion=ep.Motion([0.0, 1.0, 0.5], [0.0, -8.0, 0.0])
    ),
    "passive": lambda: printed(ep.load(URDF / "spring-support.urdf").worn_by(MAN), (60, 0)),
    "serial": lambda: printed(ep.load(URDF / "serial-y-x-z.urdf").worn_by(MAN), (50, 30), limits=40.0),
    "batch": lambda: batch(id=7, question="reaction", design="four-cables", poses={"flexion": 60, "abduction": 30}),
    "batch of a person": lambda: batch(
        question="reaction", design="four-cables", worn_by={"height": 1.7, "mass": 70, "sex": "female"}, side="right",
        poses={"flexion": 60}, load={"force": [0, 0, -10], "at": [0, 0, -0.3]}, limits="none",
    ),
    "batch of a file": lambda: batch(
        question="inverse_kinematics", design={"toml": toml("prototype")}, poses={"flexion": 10}
    ),
    "refused": lambda: "\n".join(
        batch(**question)
        for question in (
            {"question": "reactions"},
            {"question": "reaction", "design": "four-cable", "poses": {"flexion": 1}},
            {"question": "reaction", "poses": {"flexion": 1}, "frce": 1},
            {"question": "reaction"},
            {"question": "reaction", "design": {"toml": "", "urdf": ""}, "poses": {"flexion": 1}},
            {"question": "reaction", "design": {}, "poses": {"flexion": 1}},
            {"question": "reaction", "poses": {"quaternion": [0, 0, 0, 2]}},
            {"question": "reaction", "poses": {"flexion": 1}, "load": {"force": [0, 0]}},
        )
    ),
}  # fmt: skip


def stored():
    return dict(part.split("\n", 1) for part in STORED.read_text(encoding="utf-8").split("\n== ")[1:])


@pytest.mark.parametrize("name", CASES)
def test_an_answer_prints_what_is_stored(name):
    ours, theirs = CASES[name]().strip(), stored()[name].strip()
    assert NUMBER.split(ours) == NUMBER.split(theirs)
    for one, other in zip(NUMBER.findall(ours), NUMBER.findall(theirs), strict=True):
        digits = min(9, len(other.partition(".")[2]))
        assert float(one) == pytest.approx(float(other), rel=1e-4, abs=1.01 * 10.0**-digits)


def test_all_that_is_stored_is_made():
    assert list(stored()) == list(CASES)


if __name__ == "__main__":
    texts = "".join(f"\n== {name}\n{make().strip()}\n" for name, make in CASES.items())
    STORED.write_text(texts, encoding="utf-8")
