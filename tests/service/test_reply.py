"""Bodies of requests lead to no file, and faults are not shown."""

import json

import pytest
from places import REPOSITORY

import exo_pin as ep
from exo_pin.cli.documents.registry import schema
from exo_pin.design import preset_file
from exo_pin.service.problems import reply

jsonschema = pytest.importorskip("jsonschema")


def asked(question, name="reaction"):
    status, body = reply(name, json.dumps(question).encode())
    found = json.loads(body)
    said = found["schema"].partition("/")[0].removeprefix("exo_pin.")
    assert list(jsonschema.Draft202012Validator(schema(said)).iter_errors(found)) == []
    return status, found


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
