"""Documents of --json: each is as its schema says, schemas name units, and nothing wrong passes."""

import copy
import json
import re

import numpy as np
import pytest
from command_line import options_of, run

import exo_pin as ep
from exo_pin import FileFormatError, UnknownName
from exo_pin.cli import COMMANDS
from exo_pin.cli.documents.registry import DOCUMENTS, kind_of, schema
from exo_pin.core import schema as schemas
from exo_pin.exo.questions import answered

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


def problems(document):
    """What a document has that its schema does not allow."""
    name = schemas.checked_identifier(document, list(DOCUMENTS))
    return list(jsonschema.Draft202012Validator(schema(name)).iter_errors(document))


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
    assert found["schema"] == f"exo_pin.{ASKED[line]}/1"
    assert problems(found) == []
    assert fooled(found, np.random.default_rng(3)) == []
    if line.split()[0] not in ("thesis", "record"):
        exo = ep.load(line.split()[1]) if "--experiment" not in line else ep.load("prototype")
        assert found["device"]["sha256"]
        assert found["device"]["arm"]["mass_kg"] == pytest.approx(exo.arm.mass) or "--person" in line


def fooled(document, rng, count=40):
    """Wrong documents that the schema lets pass: a name too many, one too few, another version, another type."""
    validator = jsonschema.Draft202012Validator(schema(schemas.checked_identifier(document, list(DOCUMENTS))))
    root = schema(schemas.checked_identifier(document, list(DOCUMENTS)))
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


@pytest.mark.parametrize("name", DOCUMENTS)
def test_schemas_describe_and_have_units(name):
    found = schema(name)
    jsonschema.Draft202012Validator.check_schema(found)
    assert found["$id"] == schemas.identifier(name)
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


#: Units that names of members ask for.
FITTING = {
    r"(_|^)(force|forces|magnitude|compression|shear|tensions)$|^body_weight$": ("N", "N, N m"),
    r"(_|^)(wrench|wrenches)$": ("N, N m",),
    r"moment$": ("N m",),
    r"lengths$|clearance$|(?<!per)_mm$": ("m", "m, rad", "mm"),
    r"percent": ("%",),
    r"pressure$": ("Pa",),
    r"theta_[xy]$|_rad$": ("rad",),
    r"^times$|^time_s$": ("s",),
    r"angular_velocity": ("rad/s",),
}


@pytest.mark.parametrize("name", DOCUMENTS)
def test_units_fit_the_names(name):
    for kind in (kind_of(name), *schemas.reachable(kind_of(name))):
        for key, member in schemas.members(kind).items():
            for pattern, units in FITTING.items():
                if member.unit and re.search(pattern, key):
                    assert member.unit in units, f"{kind.__name__}.{key}: {member.unit}"


def test_other_versions_are_refused_by_name(tmp_path, capsys):
    for said, message in (("exo_pin.reaction/0", "an older version"), ("exo_pin.reaction/2", "a newer version")):
        with pytest.raises(FileFormatError, match=rf"expected exo_pin\.reaction/1, got {said}, which {message}"):
            schemas.checked_identifier({"schema": said}, ["reaction"])
        (tmp_path / "old.json").write_text(json.dumps({"schema": said}))
        assert run(capsys, "schema", str(tmp_path / "old.json"))[0] == 2
    for document in ({}, [], {"schema": 1}, {"schema": "reaction"}):
        with pytest.raises(FileFormatError, match=r"exo_pin\.NAME/VERSION"):
            schemas.checked_identifier(document, ["reaction"])
    with pytest.raises(UnknownName, match="did you mean 'reaction'"):
        schemas.checked_identifier({"schema": "exo_pin.reacton/1"}, ["reaction"])
    (tmp_path / "new.json").write_text(json.dumps({"schema": "exo_pin.reaction/1"}))
    assert "exo_pin.reaction/1: Forces between" in run(capsys, "schema", str(tmp_path / "new.json"))[1]
    (tmp_path / "no.json").write_text("{")
    assert "is no JSON" in run(capsys, "schema", str(tmp_path / "no.json"))[2]


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
def test_no_line_stops_a_batch():
    rng = np.random.default_rng(11)
    full = QUESTION | {
        "id": 1, "side": "left", "split": "minimal", "constraint_bounds": [-20, 20], "limits": "design",
        "posture": "rest", "worn_by": {"height": 1.75, "mass": 75, "sex": "male"},
        "motion": {"angular_velocity": [0, 0, 1], "angular_acceleration": [0, 0, 0]}, "centre_offset": [0.0, 0.01, 0.0],
    }  # fmt: skip
    failed = 0
    for number in range(400):
        text = json.dumps(wrong(full, rng))
        if number % 4 == 0:
            cut = int(rng.integers(len(text)))
            text = text[:cut] + chr(int(rng.integers(32, 1000))) * int(rng.integers(3)) + text[cut + 1 :]
        found = answered(text.encode("utf-8", "surrogatepass")[: None if number % 7 else -3], number)
        json.dumps(found, allow_nan=False)
        assert (found["answer"] is None) != (found["error"] is None), text
        assert problems(found) == [], text
        failed += found["error"] is not None
    assert 200 < failed < 400
