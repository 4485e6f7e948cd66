"""Answers of the service as they are stored: replies, streams of samples, messages of ROS, its description."""

import json
import logging
import re

import msgspec
import numpy as np
import pytest
from answers import changes, each_of
from asked_in_turn import in_turn
from scipy.spatial.transform import Rotation

from exo_pin.design import preset_file
from exo_pin.service import ServiceOptions
from exo_pin.service.live_answers import LiveSession, Request, respond
from exo_pin.service.problems import reply
from exo_pin.service.ros_messages import sample_of_imus, sample_of_quaternion, wrench_of_answer
from exo_pin.service.sample_poses import SamplePoses, opening_of
from exo_pin.service.samples import Opening, Sample, SampledSensors, Stream

POSE = {"flexion": [20.0, 50.0], "abduction": [30.0, 60.0], "internal_rotation": [5.0, -10.0]}
WOMAN = {"height": 1.6, "mass": 55.0, "sex": "female", "elbow_flexion": 30.0, "degrees": True}
ABOUT = {"provenance", "notes", "version", "sha256"}
#: Python's own words for a status are others in each version.
TITLE = re.compile(r'"title":"[^"]*",')


def without_source(value):
    if isinstance(value, dict):
        of_problem = {"title"} if "kind" in value and "detail" in value else set()
        return {key: without_source(each) for key, each in value.items() if key not in ABOUT | of_problem}
    return [without_source(each) for each in value] if isinstance(value, list) else value


def replied(name, question):
    status, body = reply(name, question if isinstance(question, bytes) else json.dumps(question).encode())
    return status, without_source(json.loads(body))


def replies():
    """Every question that needs no more than the package, and every way to ask it wrongly."""
    cables, text = {"design": "four-cables", "id": 7}, preset_file("four-cables")
    given = [
        ("reaction", cables | {"poses": POSE, "load": {"force": [0.0, 0.0, -20.0], "at": [0.0, 0.0, -0.3]},
        "motion": {"angular_velocity": [0.5, 0.2, 0.1]}}), ("reaction",
        {"design": {"toml": text}, "side": "right", "poses": {"quaternions_xyzw": [0.0, 0.0, 0.6, 0.8]},
        "limits": [5, 60]}),
        ("workspace", {"design": "prototype", "poses": 45.0, "criteria": {"least_margin": 0.1}}), ("check", cables),
        ("accuracy", {"design": "prototype", "poses": {"flexion": 30.0}}),
        ("reaction", cables | {"poses": {"flexion": 400.0}, "person": WOMAN}),
        ("nearest_singularity", {"design": "prototype", "poses": {"flexion": 30.0}}),
    ]  # fmt: skip
    wrong = [
        {}, {"poses": {"flexon": 1}}, {"poses": {"flexion": "a"}}, {"poses": {"quaternions_xyzw": [0, 0, 0, 0]}},
        {"poses": {"quaternions_xyzw": [0, 0, 0]}}, {"poses": {"quaternions_xyzw": [0, 0, 0, 1], "flexion": 1}},
        {"poses": {"flexion": 1}, "load": {}}, {"poses": {"flexion": 1}, "side": ["left"]},
        {"poses": {"flexion": 1}, "question": "workspace"},
        {"poses": {"flexion": 1}, "design": {}}, {"poses": {"flexion": 1}, "design": {"toml": "a = "}},
        {"poses": {"flexion": 1}, "design": {"toml": 1}}, {"poses": {"flexion": 1}, "design": {"path": "x"}}, [1],
        {"poses": {"flexion": [1, 2], "abduction": [1, 2, 3]}}, {"poses": {"flexion": 1}, "person": {"height": 1.6}},
        {"poses": {"flexion": 1}, "limits": "some"}, b"", b"{", b"NaN", b"\xff",
        {"design": "four-cables", "poses": {"flexion": 1}, "split": "elastic"}, {"poses": {"flexion": 1}, "beauty": 1},
        {"poses": {"flexion": 1}, "design": "/etc/passwd"}, {"poses": {"flexion": 1}, "design": None}, {"poses": 3},
    ]  # fmt: skip
    return [(name, *replied(name, question)) for name, question in given], [
        replied("reaction", question) for question in wrong
    ]


def streams():
    """Samples in order, again, late and lost, by numbers, by a rate and by time alone; with clocks that drift."""

    def taken(rate, *samples):
        stream = Stream(rate)
        return [stream.take(Sample(t=t, seq=seq), arrived) for t, seq, arrived in samples]

    numbered = [
        (0.0, 3, 10.0),
        (0.01, 4, 10.03),
        (0.05, 8, 10.05),
        (0.05, 8, 10.06),
        (0.03, 6, 10.07),
        (0.09, None, 10.12),
        (0.1, 10, 30.1),
    ]
    timed = [
        (5.0, None, 1.0),
        (5.011, None, 1.02),
        (5.05, None, 1.05),
        (5.05, None, 1.09),
        (5.02, None, 1.1),
        (5.1, None, 1.1),
    ]
    return taken(None, *numbered), taken(100.0, *timed), taken(None, *timed), in_turn(
        rate=lambda: Stream(0.0), slow=lambda: Stream(0.5), fast=lambda: Stream(1.1e5), edge=lambda: Stream(1e5),
        time=lambda: Stream().take(Sample(t=float("nan")), 0.0),
    )  # fmt: skip


def poses():
    """Poses of samples in every form, by readings and by sensors that calibrate; and what is doubted of them."""
    turned = Rotation.from_euler("zyx", [0.3, 0.2, 0.1])
    q = turned.as_quat().tolist()
    plain = lambda **more: SamplePoses(Opening(open={}, **more), "right")  # noqa: E731
    forms = [
        {"quaternion_xyzw": q}, {"quaternion_wxyz": [q[3], *q[:3]]}, {"flexion": 20.0},
        {"abduction": 30.0, "internal_rotation": -5.0}, {"quaternion_xyzw": [1.01 * each for each in q]},
    ]  # fmt: skip
    wrong = {
        "none": {}, "both": {"quaternion_xyzw": q, "quaternion_wxyz": q},
        "mixed": {"quaternion_xyzw": q, "flexion": 3.0}, "sensor": {"flexion": 3.0, "arm_xyzw": q},
        "long": {"quaternion_xyzw": [1.03 * each for each in q]},
    }  # fmt: skip
    rough, doubts = plain(), []
    for k in range(250):
        turn = Rotation.from_rotvec([0.0, -0.01 * k, 0.002 * k]).as_quat()
        rough.pose(Sample(t=0.01 * k, quaternion_xyzw=tuple(np.roll(turn, 1).tolist())))
        doubts += [(k, rough.doubt)] if k in (48, 49, 98, 99, 199) else []
    one, still = (
        Sample(t=0.0, quaternion_xyzw=q),
        lambda span: SamplePoses(Opening({}, None, SampledSensors("x", span)), "left"),
    )
    refused = in_turn(
        **{name: lambda form=form: plain().pose(Sample(t=0.0, **form)) for name, form in wrong.items()},
        reading=lambda: plain(reading="upside-down").pose(one), first=lambda: plain(reading="w-first").pose(one),
        inverse=lambda: plain(reading="w-last").pose(Sample(t=0.0, quaternion_wxyz=q)), still=lambda: still(0.0),
        minutes=lambda: still(61.0), sensors=lambda: still(0.5).pose(Sample(t=0.0, arm_xyzw=q)),
        angles=lambda: still(0.5).pose(Sample(t=0.0, arm_xyzw=q, trunk_xyzw=q, flexion=3.0)),
        axis=lambda: plain(sensors=SampledSensors("w")),
    )  # fmt: skip
    return [plain().pose(Sample(t=0.0, **form)) for form in forms], doubts, plain().calibrating, refused


def calibrated():
    """Orientations of sensors on arm and trunk: nothing while they calibrate, then poses of the arm."""
    made, found = SamplePoses(Opening(open={}, sensors=SampledSensors("+x", 0.05)), "left"), []
    trunk, mount = Rotation.from_rotvec([0.0, 0.0, 0.7]), Rotation.from_rotvec([0.2, -0.1, 1.0])
    for k in range(12):
        lift = Rotation.from_rotvec([0.0, -0.1 * max(k - 6, 0), 0.0])
        sample = {"arm_xyzw": (trunk * lift * mount).as_quat().tolist(), "trunk_xyzw": trunk.as_quat().tolist()}
        pose = made.pose(Sample(t=0.01 * k, **sample))
        found.append((made.calibrating if pose is None else pose, made.doubt))
    return found


def sessions():
    """Replies of a process to the messages of a stream, from its opening to its end."""
    opening = Opening(open={"design": "four-cables", "side": "right", "limits": [5.0, 60.0]})
    contact = Opening(open={"question": "joint_contact", "design": "four-cables", "person": WOMAN})
    sent = [
        Request("a", sample=Sample(t=0.1)), Request("a", opening),
        Request("a", sample=Sample(t=0.1, flexion=40.0, abduction=20.0), seq=4, delay=0.03),
        Request("a", sample=Sample(t=0.2, flexion=40.0, internal_rotation=-200.0)), Request("a", sample=Sample(t=0.2)),
        Request("a"), Request("a", sample=Sample(t=0.3, flexion=1.0)),
        Request("b", Opening(open={"poses": {"flexion": 1}})), Request("b", Opening(open={"question": "workspace"})),
        Request("b", Opening(open={"design": "nothing"})), Request("b", Opening(open={"split": "best"})),
        Request("b", contact),
        Request("b", sample=Sample(t=0.1, flexion=40.0)),
        Request("b", sample=Sample(t=0.1, flexion=40.0, abduction=-150.0)),
    ]  # fmt: skip
    found = []
    for each in sent:
        status, body = respond(msgspec.json.encode(each))
        found.append((status, without_source(json.loads(body))))
    given = (
        (b'{"open": {}, "token": "a"}', "b"),
        (b'{"open": {}}', "b"),
        (b"{}", None),
        (b'{"x": 1}', None),
        (b"\xff", None),
    )
    first = [without_source(json.loads(opening_of(*each))) for each in given]
    return found, first, opening_of(b'{"open": {}, "rate": 50, "token": "a"}', "a").rate, LiveSession(opening).name


def messages():
    """Messages of ROS to samples, and answers to them."""

    def stamped(sec, nanosec, name="orientation", **more):
        turn = {name: {"x": 0.1, "y": 0.2, "z": 0.3, "w": 0.927}, "orientation_covariance": [0.0]}
        return {"header": {"stamp": {"sec": sec, "nanosec": nanosec}}} | turn | more

    def wrench(t=1.5, **answer):
        return lambda: wrench_of_answer({"t": t, **answer}, "torso")

    early, late, force = stamped(3, 250000000), stamped(3, 265000000), [1.0, 2.0, 3.0]
    refused = in_turn(
        apart=lambda: sample_of_imus(early, stamped(3, 280000000)), header=lambda: sample_of_quaternion({}),
        blind=lambda: sample_of_imus(early, late | {"orientation_covariance": [-1.0]}),
        field=lambda: sample_of_quaternion(early), force=wrench(3.2500000004, shoulder_force=force),
        joint=wrench(joint_force=[1.0, 2.0, 4.0], shoulder_force=force), none=wrench(verdict="No."),
        lost=wrench(shoulder_force=[None, 1.0, 2.0], detail="Lost."),
    )  # fmt: skip
    numbered = sample_of_quaternion(stamped(3, 5000000, "quaternion"), 4)
    return numbered, sample_of_imus(early, late), sample_of_imus(late, early, 0), refused


def options():
    """Addresses of the service, and options that are refused."""
    own, token = ServiceOptions, "0123456789abcdef"
    told = [own(host="::1", port=0, udp=65535), own(host="lab.example.org", token=token, names=("other",), workers=3)]
    refused = in_turn(
        open=lambda: own(host="0.0.0.0"), short=lambda: own(host="x.org", token=token[:15]), udp=lambda: own(udp=0),
        signs=lambda: own(token=token[:-1] + "ä"), workers=lambda: own(workers=0), live=lambda: own(live=-1),
        seconds=lambda: own(seconds=float("nan")), port=lambda: own(port=65536), body=lambda: own(body=0),
        memory=lambda: own(memory=0.5), waiting=lambda: own(waiting=0), near=lambda: own(host="127.0.0.9").url,
    )  # fmt: skip
    return told[0].url, told[0].host, told[1], own().url, refused


def bare(schema):
    """A part of the description without words and without the names of presets."""
    if isinstance(schema, list):
        return [*map(bare, schema)]
    left_out = ("description", "summary", "enum")
    return {k: bare(v) for k, v in schema.items() if k not in left_out} if isinstance(schema, dict) else schema


def description():
    """Questions of the description with all that they take, and the names of its schemas."""
    whole = pytest.importorskip("exo_pin.service.openapi", reason="needs the extra service").openapi()
    paths = {}
    for address, methods in whole["paths"].items():
        for method, about in methods.items():
            body = about.get("requestBody", {}).get("content", {}).get("application/json", {}).get("schema", {})
            paths[f"{method} {address}"] = {
                "says": about.get("summary"), "takes": sorted(body.get("properties", {})),
                "needs": body.get("required"),
                "codes": {c: [*e.get("content", ())] for c, e in about["responses"].items()},
            }  # fmt: skip
    post = whole["paths"]["/reaction"]["post"]["requestBody"]["content"]["application/json"]["schema"]
    reaction = {key: value for key, value in post["properties"].items() if key != "design"}
    schemas = {name: sorted(each.get("properties", {})) for name, each in whole["components"]["schemas"].items()}
    rest = {key: value for key, value in whole.items() if key not in ("paths", "components", "info")}
    wholly = {name: whole["components"]["schemas"][name] for name in ("Wearer", "Load", "Criteria", "ProblemDocument")}
    asked = whole["paths"]["/workspace"]["post"]["requestBody"]
    wholly |= {"report": bare(whole["paths"]["/report"]["post"]), "workspace": bare(asked)}
    about = whole["info"]["license"], whole["components"].get("securitySchemes"), wholly
    return paths, reaction, schemas, rest, *about


def application():
    """Who may ask, what is accepted, and what becomes of a request that is too long, leaves, or has to wait."""
    pytest.importorskip("starlette", reason="needs the extra service")
    from asked_application import TellingWorkers, asked

    from exo_pin.service.application import application as made
    from exo_pin.service.problems import LOG

    app = made(TellingWorkers(), ServiceOptions(host="127.0.0.1", token="0123456789abcdef", body=20, names=("lab",)))
    key = {"Authorization": "Bearer 0123456789abcdef"}
    open_app = made(TellingWorkers(), ServiceOptions(body=20))
    jobs = {
        "plain": {}, "edge": {"body": b"x" * 20}, "long": {"body": b"x" * 21}, "parts": {"parts": [b"abc", b"de"]},
        "leaves": {"parts": [b"abc", None]}, "busy": {"body": b"wait"}, "wrong": {"body": b"wrong"},
        "text": {"Content_Type": "text/plain"}, "kind": {"Content_Type": " Application/JSON ; charset=utf-8"},
        "pdf": {"path": "/report", "Accept": "text/x, Application/PDF;q=0.9, text/html"},
        "html": {"path": "/report", "Accept": "text/html"}, "any": {"path": "/report", "Accept": "*/*"},
        "first": {"path": "/report", "Accept": "application/json, text/html"}, "other": {"Accept": "application/pdf"},
        "refused": {"path": "/report", "Accept": "text/html", "body": b"wrong"}, "get": {"method": "GET"},
        "nowhere": {"path": "/nowhere"}, "health": {"method": "GET", "path": "/health"}, "named": {"Host": "lab:80"},
        "host": {"Host": "example.org"}, "six": {"Host": "[::1]:8600"}, "page": {"Origin": "http://127.0.0.1:8600"},
        "site": {"Origin": "http://example.org"}, "socket": {"kind": "websocket", "Host": "example.org"},
    }  # fmt: skip
    told = {name: asked(app, **key, **job) for name, job in jobs.items()}
    for name, more in (("none", {}), ("bad", {"Authorization": "Bearer 0123456789abcdeg"})):
        told[name] = asked(app, **more)
    log = logging.Handler()
    log.emit = lambda record: told.update(log=[record.getMessage(), record.exc_info[0].__name__])
    LOG.addHandler(log)
    told["broken"] = asked(app, **key, body=b"break")
    LOG.removeHandler(log)
    told["freely"], told["health alone"] = asked(open_app), asked(app, "GET", "/health")[0]
    counts = [line for line in asked(app, "GET", "/metrics", **key)[2].splitlines() if line.startswith("exo_pin_")]
    told["counts"] = [
        line for line in counts if "requests_total" in line or "exo_pin_busy" in line or "waiting" in line
    ]
    told["schema"] = len(json.loads(asked(app, "GET", "/openapi.json", **key)[2])["paths"])
    told["health"] = json.loads(told["health"][2])["status"]
    return {
        name: [*each[:2], TITLE.sub("", each[2])] if isinstance(each, tuple) else each for name, each in told.items()
    }


ASKED = {
    each.__name__: each
    for each in (replies, streams, poses, calibrated, sessions, messages, options, description, application)
}

#: Those that take longer than 0.15 s.
LONGER = {"description", "replies", "application"}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    if name == "sessions":
        pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    assert not changes(__file__, name, ASKED[name])
