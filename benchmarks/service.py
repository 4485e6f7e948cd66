"""The running service: a fuzzer, many at once, memory over many answers, kills under load, a stream at 100 Hz.

python benchmarks/service.py fuzz      # needs: pip install schemathesis
python benchmarks/service.py load growth restart live
"""

import itertools
import json
import os
import random
import shutil
import socket
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "oracles"))

from service_client import Service, resident

import exo_pin as ep
from exo_pin.design import preset_file

CHECKS = "not_a_server_error,status_code_conformance,content_type_conformance,response_schema_conformance"


def questions(seed):
    """Questions of several kinds on several designs, without end."""
    rng = random.Random(seed)
    text = preset_file("four-cables")
    designs = ["four-cables", "prototype", "six-cables", "four-linear-actuators"]
    for number in itertools.count():
        name = rng.choice(["reaction"] * 6 + ["inverse_kinematics", "singularity", "remedy"])
        # A new design now and then, as a user who changes one has it.
        mine = {"toml": text.replace('name = "four-cables"', f'name = "mine-{number}"')}
        asked = {"design": mine if number % 50 == 0 else rng.choice(designs)}
        asked["poses"] = {key: rng.uniform(0.0, 60.0) for key in ("flexion", "abduction", "internal_rotation")}
        yield name, asked


def fuzz(count=150):
    """Let schemathesis ask what the description allows, and what it does not."""
    program = shutil.which("schemathesis")
    assert program, "pip install schemathesis"
    # It keeps what it finds where it runs.
    with Service("--seconds", "20", "--live", "0") as service, TemporaryDirectory() as folder:
        words = [program, "run", f"{service.url}/openapi.json", "--checks", CHECKS, "--max-examples", str(count)]
        words += ["--continue-on-failure", "--seed", "1", "--request-timeout", "120", "--suppress-health-check", "all"]
        return subprocess.run(words, check=False, cwd=folder).returncode


def load(count=2000, at_once=200):
    """Many at once: time of an answer, and answers that differ from those of the Python call."""
    exo = ep.load("four-cables")
    angles = [5.0 + 0.035 * k for k in range(count)]
    expected = exo.reaction(exo.pose(angles)).magnitude

    def ask(angle):
        start = time.perf_counter()
        status, found = service.ask("reaction", {"poses": {"flexion": angle}})
        return status, found["answer"]["magnitude"], time.perf_counter() - start

    with Service("--live", "0") as service, ThreadPoolExecutor(at_once) as pool:
        start = time.perf_counter()
        found = list(pool.map(ask, angles))
        took = time.perf_counter() - start
    times = sorted(each[2] for each in found)
    worst = max(abs(each[1] / own - 1.0) for each, own in zip(found, expected, strict=True))
    print(f"{count} answers, {at_once} at once: {count / took:.0f} a second, median {times[count // 2]:.2f} s, ")
    print(f"slowest {times[-1]:.2f} s; not 200: {sum(each[0] != 200 for each in found)}; ")
    print(f"largest difference from the Python call {worst:.1e}, relative")


def growth(first=2000, last=20000):
    """Memory of all processes from one number of answers to another."""
    begin = 0.0
    with Service("--workers", "1", "--live", "0") as service:
        for number, (name, asked) in enumerate(questions(3), 1):
            status, found = service.ask(name, asked)
            assert status in (200, 422), found
            if number % first == 0:
                now = sum(map(resident, service.processes()))
                begin = now if number == first else begin
                print(f"{number} answers: {now:.1f} MB, {now - begin:+.1f} MB", flush=True)
            if number == last:
                break


def restart(kills=5):
    """Kill the service under load and start it again on its port; no answer differs."""
    asked = {"poses": {"flexion": 60.0}}
    port, answers, lost = 0, set(), 0
    for _ in range(kills):
        service = Service("--live", "0", port=port)
        port = service.port
        with ThreadPoolExecutor(20) as pool:
            calls = [pool.submit(service.ask, "reaction", asked) for _ in range(500)]
            calls[100].result()
            service.process.kill()
            service.process.wait()
            service.process.stdout.close()
            for call in calls:
                if call.exception() is None:
                    answers.add(json.dumps(call.result()))
                else:
                    lost += 1
    print(f"{kills} kills under load: {500 * kills - lost} answers, {lost} connections lost, {len(answers)} answer")


def framed(text):
    """A message of WebSocket, with a mask of zeros."""
    return bytes((0x81, 0x80 | 126, *len(text).to_bytes(2, "big"), 0, 0, 0, 0)) + text.encode()


def live(seconds=180.0):
    """A recorded movement again and again at 100 Hz, beside a stream whose reader has stalled: times and answers."""
    from websockets.sync.client import connect

    exo = ep.load("four-cables")
    movement = ep.read_movement(Path(__file__).parents[1] / "examples" / "lift.csv", "left")
    own = exo.reaction(movement.poses).magnitude
    rows, count = movement.poses.as_quat().tolist(), int(100 * seconds)
    opening = json.dumps({"open": {"design": "four-cables"}, "rate": 100.0})
    sent, took, answers = {}, [], {}

    with Service("--workers", "1") as service, ExitStack() as streams:
        address = f"ws://127.0.0.1:{service.port}/live"

        def stall():
            """A reader that says what it wants, and reads nothing."""
            found = socket.create_connection(("127.0.0.1", service.port))
            found.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            head = (
                f"GET /live HTTP/1.1\r\nHost: 127.0.0.1:{service.port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            )
            found.sendall(f"{head}Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {'A' * 22}==\r\n\r\n".encode())
            found.recv(4096)
            found.sendall(framed(opening))
            return found

        def receive():
            while max(answers, default=-1) < count - 1:
                found = json.loads(stream.recv(timeout=30))
                took.append(time.perf_counter() - sent[found["seq"]])
                answers[found["seq"]] = found

        stream, stalled, closed = streams.enter_context(connect(address)), stall(), 0
        stream.send(opening)
        stream.recv()
        reader = threading.Thread(target=receive)
        reader.start()
        start = time.perf_counter()
        for number in range(count):
            time.sleep(max(0.0, start + 0.01 * number - time.perf_counter()))
            sample = json.dumps({"t": 0.01 * number, "seq": number, "quaternion_xyzw": rows[number % len(rows)]})
            sent[number] = time.perf_counter()
            stream.send(sample)
            try:
                stalled.sendall(framed(sample))
            except OSError:
                # The service gives up a reader that answers no ping; here comes the next one.
                closed, stalled = closed + 1, stall()
        reader.join()
        stalled.close()
    worst = max(abs(each["magnitude"] / own[number % len(own)] - 1.0) for number, each in answers.items())
    p50, p99 = (1e3 * sorted(took)[int(share * len(took))] for share in (0.5, 0.99))
    lost = {key: sum(each[key] for each in answers.values()) for key in ("skipped", "dropped")}
    print(
        f"{count} samples in {count / 100:.0f} s: {len(answers)} answers, {lost}; p50 {p50:.1f} ms, p99 {p99:.1f} ms, "
    )
    print(f"longest {1e3 * max(took):.0f} ms; largest difference from the Python call {worst:.1e}, relative; ")
    print(f"readers that stalled and were given up: {closed}")
    print(f"load of the machine in the last minute {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors")


if __name__ == "__main__":
    commands = {each.__name__: each for each in (fuzz, load, growth, restart, live)}
    sys.exit(max([commands[name]() or 0 for name in sys.argv[1:]], default=0))
