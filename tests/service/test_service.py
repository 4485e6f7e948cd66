"""The running service: who may ask, limits, and that it outlives what it is asked."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest
from places import page
from process_tree import lives, wait_until
from service_client import Service

import exo_pin as ep

pytest.importorskip("starlette", reason="needs the extra service")
pytestmark = pytest.mark.full
POSE = {"poses": {"flexion": 60.0}}
TOKEN = "a-token-of-some-length"


@pytest.fixture(scope="module")
def service():
    with Service("--live", "0", "--workers", "2", "--seconds", "300", "--body", "20000") as running:
        yield running


@pytest.mark.parametrize(
    ("method", "path", "body", "headers", "status", "kind"),
    [
        ("GET", "/reaction", None, {}, 405, "Request"),
        ("GET", "/nowhere", None, {}, 404, "Request"),
        ("POST", "/reaction", "{}", {"Content-Type": "text/plain"}, 415, "MediaType"),
        ("POST", "/reaction", " " * 20001, {"Content-Type": "application/json"}, 413, "SizeLimit"),
        ("GET", "/health", None, {"Host": "example.org"}, 403, "Host"),
        ("GET", "/health", None, {"Host": "127.0.0.1.example.org"}, 403, "Host"),
        ("GET", "/health", None, {"Origin": "http://example.org"}, 403, "Origin"),
        ("GET", "/health", None, {"Origin": "null"}, 403, "Origin"),
    ],
)
def test_what_is_refused_is_a_problem_document(service, method, path, body, headers, status, kind):
    found, received, text = service.send(method, path, body, headers)
    assert (found, json.loads(text)["kind"]) == (status, kind)
    assert received["content-type"] == "application/problem+json"


@pytest.mark.parametrize(
    ("accept", "begins"), [("application/pdf", b"%PDF-"), ("text/html;q=0.9", b"<!DOC"), ("*/*", b"{")]
)
def test_a_report_is_what_the_request_accepts(service, accept, begins):
    pytest.importorskip("fpdf", reason="needs the extra report")
    headers = {"Content-Type": "application/json", "Accept": accept}
    status, received, body = service.send("POST", "/report", '{"design": "four-cables"}', headers)
    assert (status, body[:5].startswith(begins)) == (200, True)
    assert received["content-type"].startswith(accept.partition(";")[0] if begins != b"{" else "application/json")
    status, received, body = service.send("POST", "/report", '{"design": "nothing"}', headers)
    assert (status, received["content-type"]) == (422, "application/problem+json")


def test_two_hundred_ask_at_once_and_all_have_the_answer_of_the_python_call(service):
    exo = ep.load("four-cables")
    angles = [float(k % 80) for k in range(200)]
    expected = [float(each.magnitude) for each in (exo.reaction(exo.pose(angle)) for angle in angles)]
    before = service.metric('exo_pin_requests_total{question="reaction",status="200"}') if angles is None else 0
    with ThreadPoolExecutor(200) as pool:
        found = list(pool.map(lambda angle: service.ask("reaction", {"poses": {"flexion": angle}}), angles))
    assert [status for status, _ in found] == [200] * 200
    # The service compiles, and one pose here does not: they agree to rounding.
    assert [each["answer"]["magnitude"] for _, each in found] == pytest.approx(expected, rel=1e-9)
    assert service.metric('exo_pin_requests_total{question="reaction",status="200"}') >= before + 200


def test_a_process_that_ends_is_replaced(service):
    workers = service.processes()[1:]
    before = service.metric("exo_pin_restarts")
    for pid in workers:
        # The one of multiprocessing that keeps account of resources is none of them.
        with open(f"/proc/{pid}/cmdline", "rb") as file:
            if b"spawn_main" in file.read():
                os.kill(pid, signal.SIGKILL)
    with ThreadPoolExecutor(2) as pool:
        lost = list(pool.map(lambda _: service.ask("reaction", POSE), range(2)))
    assert {status for status, _ in lost} <= {500}
    assert service.metric("exo_pin_restarts") == before + 2
    assert service.ask("reaction", POSE)[0] == 200


def test_an_answer_that_takes_too_long_or_too_much_is_ended():
    with Service("--live", "0", "--workers", "1", "--seconds", "2", "--waiting", "1", "--memory", "300") as service:
        status, found = service.ask("workspace", {"poses": 1.0, "design": "prototype"})
        assert (status, found["kind"]) in ((422, "TimeLimit"), (422, "MemoryLimit"))
        assert service.metric("exo_pin_restarts") == 1
        with ThreadPoolExecutor(4) as pool:
            # The new process is being prepared: one question is with it, one waits, and the others are refused.
            statuses = sorted(pool.map(lambda _: service.ask("reaction", POSE)[0], range(4)))
        assert statuses == [200, 200, 503, 503]


def test_a_token_is_needed_where_there_is_one():
    with Service("--live", "0", "--workers", "1", "--name", "lab.example.org", token=TOKEN) as service:
        assert service.send("GET", "/health")[0] == 200
        for given in ({}, {"Authorization": "Bearer "}, {"Authorization": f"Bearer {TOKEN}x"}):
            status, headers, _ = service.send("GET", "/openapi.json", None, given)
            assert (status, headers["www-authenticate"]) == (401, "Bearer")
        known = {
            "Authorization": f"Bearer {TOKEN}",
            "Host": "lab.example.org:80",
            "Origin": "https://lab.example.org:80",
        }
        assert service.send("GET", "/openapi.json", None, known)[0] == 200


def test_killed_under_load_it_starts_again_on_its_port_and_leaves_no_process():
    service = Service("--live", "0", "--workers", "2")
    left = service.processes()
    with ThreadPoolExecutor(8) as pool:
        load = [pool.submit(service.ask, "reaction", POSE) for _ in range(400)]
        load[40].result()
        service.process.kill()
        service.process.wait()
        service.process.stdout.close()
        wait_until(lambda: not any(map(lives, left)))
        with Service("--live", "0", "--workers", "1", port=service.port) as again:
            answer = again.ask("reaction", POSE)[1]["answer"]
        done = [each.result()[1]["answer"] for each in load if each.exception() is None]
    # Those before it, but for what the other threads had under way.
    assert len(done) > 32
    assert all(each == answer for each in done)


#: How the code of a page is run.
RUN = {"python": [sys.executable, "-c"], "curl": ["bash", "-c"], "javascript": ["node", "--input-type=module", "-e"]}


@pytest.mark.parametrize("client", RUN)
def test_the_lines_of_the_page_ask_the_service(client, service):
    program = RUN[client][0]
    if client != "python" and shutil.which(client if client == "curl" else program) is None:
        pytest.skip(f"needs {client}")
    text = page("service")
    code = re.search(rf"<!-- client: {client} -->\n```\w+\n(.*?)```", text, re.DOTALL)[1]
    assert code.count("http://127.0.0.1:8600") == 1
    assert code.count("\n") <= 11
    code = code.replace("http://127.0.0.1:8600", service.url)
    done = subprocess.run([*RUN[client], code], capture_output=True, text=True, check=True, timeout=120)
    shown = re.search(r"print `(.*?)`", text)[1]
    if client == "curl":
        answer = json.loads(done.stdout)["answer"]
        done.stdout = f"{answer['verdict']} {answer['magnitude']:.2f} {answer['units']['magnitude']}"
    assert done.stdout.strip() == shown
    exo = ep.load("four-cables")
    own = exo.reaction(exo.pose(60.0), load=ep.Load([0.0, 0.0, -20.0]))
    assert shown == f"{own.verdict} {float(own.magnitude):.2f} N"
