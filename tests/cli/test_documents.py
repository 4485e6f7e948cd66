"""Documents of --json: each is as its schema says, schemas name units, and nothing wrong passes."""

import contextlib
import copy
import functools
import io
import json
import re

import numpy as np
import pytest
from command_line import options_of, run

import exo_pin as ep
from exo_pin.cli import COMMANDS, main

jsonschema = pytest.importorskip("jsonschema")
MAN = ["--person", "1.75,75,male"]
#: The document of each question.
ASKED = {
    "reaction four-cables --flexion 60": "pose",
    "reaction four-cables --compare --offset 5 0 0": "pose",
    "reaction prototype --flexion 60": "pose",
    "reaction urdf/serial-y-x-z.urdf --flexion 60": "pose",
    f"reaction four-cables --flexion 60 {' '.join(MAN)} --muscles": "pose",
    "reaction four-cables --to 90,0,0 --poses 3": "reaction",
    "reaction four-cables --trajectory examples/lift.csv": "movement_reaction",
    "person four-cables --flexion 60": "joint_contact",
    "kinematics four-cables --flexion 60": "kinematics",
    "kinematics urdf/serial-y-x-z.urdf --flexion 40": "kinematics",
    "singularity prototype --flexion 60": "singular_pose",
    "singularity urdf/serial-y-x-z.urdf --flexion 60": "device_singularity",
    "workspace four-cables --step 45": "workspace_summary",
    "tasks four-cables --step 40": "study_table",
    f"tasks four-cables --day --step 40 {' '.join(MAN)}": "study_table",
    "compare four-cables four-linear-actuators --step 60": "study_table",
    "sweep four-cables --vary scale=0.9,1 --step 60": "study_table",
    f"workspace four-cables-worn --step 45 {' '.join(MAN)}": "workspace_summary",
    f"report four-linear-actuators-worn {' '.join(MAN)}": "design_report",
    "parts four-linear-actuators-worn --step 45": "parts",
    "uncertainty four-cables --flexion 60": "force_uncertainty",
    f"uncertainty four-cables --flexion 60 --all 8 {' '.join(MAN)}": "total_uncertainty",
    "check four-cables": "report",
    "forces four-cables": "robot_forces",
    "track --experiment abduction --no-progress": "track_summary",
    "thesis --section 5.1.2": "thesis",
    "record examples/lift.csv": "record_summary",
    "optimise four-cables --refine --vary cuff_height_mm=150:250 --budget 20 --run-length 20 --step 40": "optimised",
}
QUICK = ("reaction four-cables --to 90,0,0 --poses 3", "kinematics four-cables --flexion 60")


def schema(name):
    """The schema of a kind of document; without a name a line of each."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        assert main(["schema", *name.split()]) == 0
    return json.loads(out.getvalue()) if name else out.getvalue()


@functools.cache
def schema_of(identifier):
    return schema(re.fullmatch(r"exo_pin\.(\w+)/\d", identifier)[1])


def problems(document):
    """What a document has that its schema does not allow."""
    return list(jsonschema.Draft202012Validator(schema_of(document["schema"])).iter_errors(document))


@pytest.mark.parametrize(
    "line", [pytest.param(line, marks=() if line in QUICK else pytest.mark.full) for line in ASKED]
)
def test_documents_are_as_their_schemas_say(line, capsys):
    if "person" in line:
        pytest.importorskip("myo_sim", reason="needs the extra person")
    if line.startswith("report"):
        pytest.importorskip("fpdf", reason="needs the extra report")
    if "optimise" in line:
        pytest.importorskip("optuna", reason="needs the extra optimise")
    status, out, _ = run(capsys, *line.split(), "--json")
    assert status == 0
    found = json.loads(out)
    assert found["schema"] == schema(ASKED[line])["$id"]
    assert problems(found) == []
    assert fooled(found, np.random.default_rng(3)) == []
    if line.split()[0] not in ("thesis", "record"):
        exo = ep.load(line.split()[1]) if "--experiment" not in line else ep.load("prototype")
        assert found["device"]["sha256"]
        assert found["device"]["arm"]["mass_kg"] == pytest.approx(exo.arm.mass) or "--person" in line


def fooled(document, rng, count=40):
    """Wrong documents that the schema lets pass: a name too many, one too few, another version, another type."""
    root = schema_of(document["schema"])
    validator = jsonschema.Draft202012Validator(root)
    members = root["$defs"][root["$ref"].rpartition("/")[2]]["properties"]
    passed = [] if not validator.is_valid({**document, "surplus": 1}) else ["surplus"]
    passed += [] if not validator.is_valid({**document, "schema": f"{document['schema']}0"}) else ["schema"]
    passed += [] if not validator.is_valid({k: v for k, v in document.items() if k != "units"}) else ["units"]
    for name in rng.permutation(list(document))[:count]:
        said = members[name]
        # An object of free form holds anything.
        if {"type", "$ref", "anyOf", "const"} & set(said) and said.get("type") != "object":
            wrong = {**document, name: {"surplus": [{}]}}
            passed += [str(name)] if validator.is_valid(wrong) and not re.search('"object"', json.dumps(said)) else []
    return passed


def test_every_command_with_json_is_asked():
    with_json = {name for name in COMMANDS if any("--json" in option.names for option in options_of(name))}
    assert with_json == {line.split()[0] for line in ASKED}


@pytest.mark.parametrize("name", re.findall(r"^(\w+)", schema(""), re.MULTILINE))
def test_schemas_describe_and_have_units(name):
    found = schema(name)
    jsonschema.Draft202012Validator.check_schema(found)
    assert re.fullmatch(rf"exo_pin\.{name}/[12]", found["$id"])
    for title, definition in found["$defs"].items():
        for key, member in definition.get("properties", {}).items():
            assert key in (
                "schema",
                "units",
                "device",
                "provenance",
                "quaternions_xyzw",
                "verdict",
                "cautions",
            ) or member.get("description"), f"{title}.{key}"


QUESTION = {"question": "reaction", "design": "four-cables", "poses": {"flexion": 60.0}, "load": {"force": [0, 0, -5]}}


def test_a_bad_line_is_an_error_line_and_the_rest_goes_on(tmp_path, capsys):
    path = tmp_path / "q.jsonl"
    lines = [
        "",
        json.dumps(QUESTION | {"id": 7}),
        "{",
        json.dumps(QUESTION | {"poses": {"flexon": 1}}),
        json.dumps(QUESTION),
    ]
    path.write_text("\n".join(lines))
    status, out, err = run(capsys, "batch", str(path))
    found = [json.loads(line) for line in out.splitlines()]
    assert status == 1
    assert err == ""
    assert [each["line"] for each in found] == [2, 3, 4, 5]
    assert [each["error"] is None for each in found] == [True, False, False, True]
    assert "did you mean 'flexion'" in found[2]["error"]["message"]
    assert found[0]["id"] == 7
    exo = ep.load("four-cables")
    answer = exo.reaction(exo.pose(60.0), load=ep.Load([0.0, 0.0, -5.0]))
    assert found[3]["answer"]["magnitude"] == pytest.approx(float(answer.magnitude))
    assert found[3]["answer"]["device"]["name"] == "four-cables"
    for each in found:
        assert problems(each) == []
    path.write_text(lines[1])
    assert run(capsys, "batch", str(path))[0] == 0


def wrong(value, rng):
    """A value with one thing changed, at any depth."""
    junk = (None, True, -1, 1e308, "", "a\x00", [], {}, [[]], {"flexion": None}, [1, "2"], 10**400, "nan", {"": 0})
    if not value or not isinstance(value, dict | list) or rng.random() < 0.3:
        return junk[rng.integers(len(junk))]
    changed = copy.deepcopy(value)
    keys = list(changed) if isinstance(changed, dict) else list(range(len(changed)))
    key = keys[rng.integers(len(keys))]
    if rng.random() < 0.2:
        del changed[key]
    elif rng.random() < 0.2 and isinstance(changed, dict):
        changed[f"{key}x"] = changed.pop(key)
    else:
        changed[key] = wrong(changed[key], rng)
    return changed


@pytest.mark.full
def test_no_line_stops_a_batch(tmp_path, capsys):
    rng = np.random.default_rng(11)
    full = QUESTION | {
        "id": 1, "side": "left", "split": "minimal", "constraint_bounds": [-20, 20], "limits": "design",
        "posture": "rest", "worn_by": {"height": 1.75, "mass": 75, "sex": "male"},
        "motion": {"angular_velocity": [0, 0, 1], "angular_acceleration": [0, 0, 0]}, "centre_offset": [0.0, 0.01, 0.0],
    }  # fmt: skip
    lines = []
    for number in range(400):
        text = json.dumps(wrong(full, rng))
        if number % 4 == 0:
            cut = int(rng.integers(len(text)))
            text = text[:cut] + chr(int(rng.integers(32, 1000))) * int(rng.integers(3)) + text[cut + 1 :]
        lines.append(text.encode("utf-8", "surrogatepass")[: None if number % 7 else -3])
    (tmp_path / "lines.jsonl").write_bytes(b"\n".join(lines))
    status, out, _ = run(capsys, "batch", str(tmp_path / "lines.jsonl"))
    found = [json.loads(line, parse_constant=pytest.fail) for line in out.splitlines()]
    assert status == 1
    assert len(found) == sum(map(bool, map(bytes.strip, lines)))
    for each in found:
        assert (each["answer"] is None) != (each["error"] is None)
        assert problems(each) == []
    assert 200 < sum(each["error"] is not None for each in found) < 400
