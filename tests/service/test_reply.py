"""Bodies of requests: the answer is that of the Python call, and what is wrong is a problem document."""

import json

import numpy as np
import pytest
from places import REPOSITORY

import exo_pin as ep
from exo_pin.cli.documents.registry import schema
from exo_pin.design import preset_file
from exo_pin.exo.questions import QUESTIONS, answered
from exo_pin.service.problems import reply

jsonschema = pytest.importorskip("jsonschema")


def asked(question, name="reaction"):
    status, body = reply(name, json.dumps(question).encode())
    found = json.loads(body)
    said = found["schema"].partition("/")[0].removeprefix("exo_pin.")
    assert list(jsonschema.Draft202012Validator(schema(said)).iter_errors(found)) == []
    return status, found


def test_the_answer_is_that_of_the_python_call_and_of_a_batch():
    exo = ep.load("four-cables", side="right")
    load = {"force": [0.0, 0.0, -20.0]}
    question = {"side": "right", "poses": {"flexion": [60.0, 20.0]}, "load": load, "id": 7}
    status, found = asked(question)
    own = exo.reaction(exo.pose([60.0, 20.0]), load=ep.Load(**load)).document()
    assert status == 200
    assert found["id"] == 7
    assert {**found["answer"], "device": 0} == json.loads(json.dumps({**own, "device": 0}))
    assert found == answered(json.dumps({**question, "question": "reaction"}))


@pytest.mark.parametrize(
    "poses", [{"flexion": 30.0}, {"quaternions_xyzw": [0.0, -np.sin(np.pi / 12), 0.0, np.cos(np.pi / 12)]}]
)
def test_a_design_stands_in_the_question(poses):
    text = preset_file("four-cables").replace('name = "four-cables"', 'name = "mine"')
    status, found = asked({"design": {"toml": text}, "poses": poses})
    assert status == 200
    assert found["answer"]["device"]["name"] == "mine"
    exo = ep.load("four-cables")
    assert found["answer"]["magnitude"] == pytest.approx(float(exo.reaction(exo.pose(30.0)).magnitude), rel=1e-9)


def test_a_robot_stands_in_the_question():
    own = REPOSITORY / "urdf" / "serial-y-x-z.urdf"
    texts = {"urdf": own.read_text(), "closures": own.with_suffix(".closures.toml").read_text()}
    status, found = asked({"design": texts, "poses": {"flexion": 40.0}})
    exo = ep.load(own)
    assert status == 200
    assert found["answer"]["magnitude"] == pytest.approx(float(exo.reaction(exo.pose(40.0)).magnitude), rel=1e-9)


#: Questions that have no answer: error and a part of what it says.
WRONG = [
    ({}, "InvalidInput", "expected poses"),
    ({"poses": {"flexon": 1}}, "UnknownName", "did you mean 'flexion'"),
    ({"poses": {"flexion": "a"}}, "InvalidInput", "flexion"),
    ({"poses": {"quaternions_xyzw": [0, 0, 0, 0]}}, "InvalidInput", "unit quaternions"),
    ({"poses": {"quaternions_xyzw": [0, 0, 0]}}, "InvalidInput", "quaternions_xyzw"),
    ({"poses": {"quaternions_xyzw": [0, 0, 0, 1], "flexion": 1}}, "InvalidInput", "alone"),
    ({"poses": {"flexion": 1}, "load": {}}, "InvalidInput", "expected force in load"),
    ({"poses": {"flexion": 1}, "side": ["left"]}, "InvalidInput", "expected side"),
    ({"poses": {"flexion": 1}, "question": "workspace"}, "InvalidInput", "expected question 'reaction'"),
    ({"poses": {"flexion": 1}, "design": {}}, "InvalidInput", "toml alone, or with urdf"),
    ({"poses": {"flexion": 1}, "design": {"toml": "a = "}}, "FileFormatError", "design.toml"),
    ({"poses": {"flexion": 1}, "design": {"toml": 1}}, "InvalidInput", "text of a file"),
    ({"poses": {"flexion": 1}, "design": {"path": "x"}}, "UnknownName", "member of design"),
    ([1], "InvalidInput", "JSON object"),
]  # fmt: skip


@pytest.mark.parametrize("text", [b"", b"{", b"NaN", b"\xff", b"[" * 100_000])
def test_what_is_no_json_is_said(text):
    status, body = reply("reaction", text)
    assert (status, json.loads(body)["kind"]) == (400, "NoJSON")


@pytest.mark.parametrize("ending", [".toml", ".urdf", ".xml", ".device.toml"])
def test_no_file_is_read_for_a_question(ending, tmp_path):
    secret = tmp_path / f"mine{ending}"
    secret.write_text(preset_file("four-cables"))
    for path in (str(secret), f"../{secret.name}", f"urdf/{secret.name}", f"file://{secret}"):
        status, found = asked({"design": path, "poses": {"flexion": 1}})
        assert (status, found["kind"]) == (422, "UnknownName")


def test_texts_of_a_design_lead_to_no_file():
    device = REPOSITORY / "urdf" / "prototype.device.toml"
    assert device.is_file()
    for texts in (
        {"toml": f'schema = 1\ndevice = "{device}"\n'},
        {"urdf": '<robot name="a"><link name="b"/></robot>', "device": f'schema = 1\nrobot = "{device}"\n'},
        {"urdf": f'<!DOCTYPE a [<!ENTITY b SYSTEM "{device}">]><robot name="a">&b;</robot>'},
    ):
        status, found = asked({"design": texts, "poses": {"flexion": 1}})
        assert status == 422, texts
        assert "prototype-whole" not in found["detail"]


@pytest.mark.full
def test_a_report_has_the_pages_of_the_python_call(tmp_path):
    pytest.importorskip("fpdf", reason="needs the extra report")
    question = {"design": "four-cables", "person": {"height": 1.6, "mass": 45.0, "sex": "female"}, "arm_speed": 20.0}
    found = ep.load("four-cables").report(ep.Person(1.6, 45, "female"), arm_speed=20.0)
    found.save(tmp_path / "own.html")
    assert reply("report.html", json.dumps(question).encode()) == (200, (tmp_path / "own.html").read_bytes())
    status, pdf = reply("report.pdf", json.dumps(question).encode())
    assert (status, pdf[:5], pdf.count(b"/Type /Page\n")) == (200, b"%PDF-", 2)
    status, document = asked(question, "report")
    assert (status, document["answer"]["verdict"]) == (200, found.verdict)


@pytest.mark.parametrize("pages", ["report", "report.pdf"])
def test_a_report_reads_no_file(pages):
    status, found = asked({"file": "/etc/passwd"}, pages)
    assert (status, found["kind"]) == (422, "UnknownName")


def test_a_fault_of_the_package_is_logged_and_not_shown(monkeypatch, caplog):
    def broken(*_, **__):
        raise ZeroDivisionError("/home/somebody/secret")

    monkeypatch.setattr(ep.ShoulderExo, "check", broken)
    status, found = asked({}, "check")
    assert (status, found["kind"]) == (500, "InternalFault")
    assert "secret" not in json.dumps(found)
    assert "ZeroDivisionError" in caplog.text


def test_the_description_has_every_question_and_valid_schemas():
    openapi = pytest.importorskip("exo_pin.service.openapi", reason="needs the extra service").openapi()
    assert {f"/{name}" for name in QUESTIONS} < set(openapi["paths"])
    for definition in openapi["components"]["schemas"].values():
        jsonschema.Draft202012Validator.check_schema(definition)
    # The schema of a question allows what is answered, and refuses what is not.
    body = openapi["paths"]["/reaction"]["post"]["requestBody"]["content"]["application/json"]["schema"]
    checks = jsonschema.Draft202012Validator(body | {"components": openapi["components"]})
    assert checks.is_valid({"poses": {"flexion": [1, 2]}, "load": {"force": [0, 0, 1]}, "design": {"toml": "x"}})
    for question, _, said in WRONG:
        if "JSON object" not in said and "alone" not in said and "unit" not in said and "design.toml" not in said:
            assert not checks.is_valid(question), question
