"""Questions as plain data: a JSON text asks what the method of that name answers, and what is wrong is named."""

import json

import numpy as np
import pytest
from places import URDF

import exo_pin as ep
from exo_pin.exo.questions import QUESTIONS, answer, answered, understood

CABLES = ep.load("four-cables")
POSE = {"flexion": 60, "abduction": 20}
WEARER = {"height": 1.7, "mass": 70, "sex": "female"}


def said(question, **members):
    """Answer of a question as a line of JSON."""
    return answered(json.dumps({"question": question, **members}), 7)


@pytest.mark.parametrize(
    "question", ["reaction", "inverse_kinematics", "singularity", "workspace", "accuracy", "check"]
)
def test_an_answer_is_that_of_the_method(question):
    members = {} if question == "check" else {"poses": POSE}
    arguments = [] if question == "check" else [CABLES.pose(**POSE)]
    if question == "workspace":
        members["criteria"], arguments = ["forces"], [CABLES.pose([60, 30], 20), ["forces"]]
        members["poses"] = {"flexion": [60, 30], "abduction": 20}
    told = said(question, **members, id=[1])
    assert (told["line"], told["id"], told["question"], told["error"]) == (7, [1], question, None)
    found = getattr(CABLES, question)(*arguments)
    if question == "workspace":
        assert told["answer"]["index"] == pytest.approx(float(found.index))
    else:
        own = json.loads(json.dumps(ep.core.results.plain(found.document())))
        assert {key: value for key, value in json.loads(json.dumps(told["answer"])).items() if key in own} == own
    assert told["answer"]["device"]["name"] == "four-cables"
    assert set(QUESTIONS) >= {question}


def test_members_become_arguments():
    turn = CABLES.pose(**POSE)
    load, motion = (
        {"force": [0, 0, -10], "at": [0, 0, -0.5]},
        {"angular_velocity": [0, 1, 0], "angular_acceleration": [1, 0, 0]},
    )
    asked = {
        "question": "reaction", "poses": {"quaternions_xyzw": turn.as_quat().tolist()}, "load": load, "motion": motion,
        "worn_by": WEARER, "side": "right", "limits": "none",
    }  # fmt: skip
    name, exo, arguments = understood(asked)
    assert (name, exo.side, exo.arm.wearer.height) == ("reaction", "right", 1.7)
    want = ep.load("four-cables", side="right").worn_by(ep.Wearer(1.7, 70, "female"))
    force = want.reaction(turn, ep.Motion(**motion), ep.Load(**load), limits="none").shoulder_force
    np.testing.assert_allclose(exo.reaction(**arguments).shoulder_force, force, rtol=1e-12)
    np.testing.assert_allclose(answer(asked)["shoulder_force"], force, rtol=1e-12)
    _, _, arguments = understood({"question": "joint_contact", "poses": POSE, "person": WEARER, "side": "right"})
    assert (arguments["person"].side, arguments["person"].height) == ("right", 1.7)
    _, _, arguments = understood({"question": "workspace", "criteria": {"least_margin": 0.1}, "load": None})
    assert (arguments["criteria"].least_margin, arguments["load"]) == (0.1, None)
    # One design is read once.
    assert understood(asked)[1] is exo


def test_a_design_may_stand_in_the_question(tmp_path):
    ep.load("prototype").save(tmp_path / "mine.toml")
    text = (tmp_path / "mine.toml").read_text()
    robot = {key: (URDF / f"spring-support{end}").read_text() for key, end in (
        ("urdf", ".urdf"), ("closures", ".closures.toml"), ("device", ".device.toml"))}  # fmt: skip
    for design, name in (({"toml": text}, "prototype"), (robot, "spring-support")):
        for side in (None, "left", "right"):
            exo = understood({"question": "check", "design": design, "side": side}, files=False)[1]
            assert (exo.name, exo.side) == (name, side or "left")
    told = said("check", design={"toml": "schema = 1\nname = 3\n"})
    assert told["error"]["kind"] == "FileFormatError"
    assert "design.toml" in told["error"]["message"]
    assert "/" not in told["error"]["message"].split("design.toml")[0]


@pytest.mark.parametrize(
    ("asked", "kind", "words"),
    [
        ([1], "InvalidInput", "a question to be a JSON object"),
        ({"question": "why"}, "UnknownName", "reaction"),
        ({"question": "reaction"}, "InvalidInput", "expected poses in the question"),
        ({"question": "reaction", "poses": POSE, "progress": True}, "UnknownName", "progress"),
        ({"question": "reaction", "poses": POSE, "schema": "exo_pin.sweep/1"}, "UnknownName", "batch_question"),
        ({"question": "check", "side": 1}, "InvalidInput", "left or right"),
        ({"question": "check", "design": 3}, "InvalidInput", "the name of a design"),
        ({"question": "check", "design": {"toml": "", "urdf": ""}}, "InvalidInput", "got toml, urdf"),
        ({"question": "check", "design": {"toml": "", "device": ""}}, "InvalidInput", "got toml, device"),
        ({"question": "check", "design": {"closures": ""}}, "InvalidInput", "got closures"),
        ({"question": "check", "design": {"stl": ""}}, "UnknownName", "member of design"),
        ({"question": "check", "design": {"toml": 1}}, "InvalidInput", "the text of a file"),
        ({"question": "check", "worn_by": {"height": 1.7}}, "InvalidInput", "expected mass in worn_by"),
        ({"question": "reaction", "poses": {"flexion": 1, "elbow": 2}}, "UnknownName", "member of poses"),
        ({"question": "reaction", "poses": {"quaternions_xyzw": [0, 0, 0, 1.002]}}, "InvalidInput", "length 1.002"),
        (
            {"question": "reaction", "poses": {"quaternions_xyzw": [[0, 0, 0, 1], [0, 0, 0, 0.9]]}},
            "InvalidInput",
            "0.9",
        ),
        ({"question": "reaction", "poses": {"quaternions_xyzw": [0, 0, 0, 1], "flexion": 1}}, "InvalidInput", "alone"),
        ({"question": "joint_contact", "poses": POSE, "person": 3}, "InvalidInput", "person to be a JSON object"),
    ],
)
def test_what_is_wrong_is_named(asked, kind, words):
    told = answered(json.dumps(asked))
    assert (told["error"]["kind"], told["answer"], told["line"]) == (kind, None, 1)
    assert words in told["error"]["message"]


def test_edges_of_what_is_read():
    # Within a thousandth a quaternion is a unit one, and is taken as that.
    near = said("inverse_kinematics", poses={"quaternions_xyzw": [[0, 0, 0, 1.0005], [0, 0, 0, 1]]})["answer"][
        "lengths"
    ]
    np.testing.assert_allclose(near[0], near[1], rtol=1e-12)
    for text in (b'{"question": NaN}', "{", b"\xff", '{"question": "check", "id": Infinity}'):
        told = answered(text)
        assert (told["answer"], told["question"], told["id"]) == (None, None, None)
        assert told["error"]["message"]
    assert "expected JSON, got NaN" in answered(b'{"question": NaN}')["error"]["message"]
    assert answered('{"question": 3}')["question"] is None
    # A server takes no file of its own by a name.
    for design in ("four-cables", str(URDF / "nesm.urdf")):
        if design == "four-cables":
            assert understood({"question": "check", "design": design}, files=False)[1].name == design
        else:
            assert understood({"question": "check", "design": design})[1].name == "nesm"
            with pytest.raises(ep.UnknownName, match="design"):
                understood({"question": "check", "design": design}, files=False)
    # A robot without an arm has no device to describe.
    for name in ("prototype-wrist", "serial-y-x-z"):
        robot = str(URDF / f"{name}.urdf")
        assert ("device" in answer({"question": "check", "design": robot})) == ep.load(robot).has_arm
    # What is doubted on the way stands beside the answer, and beside an error.
    assert any("60° in radians" in text for text in said("reaction", poses={"flexion": 1.0471975511965976})["warnings"])
    told = said("reaction", poses={"flexion": 1.0471975511965976}, limits="push")
    assert told["error"]["kind"] == "UnknownName"
    assert any("radians" in text for text in told["warnings"])
