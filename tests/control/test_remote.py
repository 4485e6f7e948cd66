"""A controller in another process: the messages, the run that it gives, and messages that are lost, late or malformed.

Nothing here depends on how fast the machine is: what is late is made so by the other end.
"""

import json
import re
import socket
import subprocess
import sys
from threading import Thread

import numpy as np
import pytest

import exo_pin as ep
from exo_pin import InvalidInput, control

RATE, DURATION = 200.0, 0.05
SAMPLE = {
    "run": 1, "seq": 0, "t": 0.0, "quaternion_xyzw": [0.0, 0.0, 0.0, 1.0], "angular_velocity": [0.0, 0.0, 0.0],
    "pressures": [0.0, 0.0], "supply_pressure": 0.0, "lengths": [0.3, 0.4], "contraction_ratios": [0.1, 0.1],
}  # fmt: skip


@pytest.fixture(scope="module")
def exo():
    return ep.load("four-cables")


def model(exo):
    return control.ModelController(ep.Plant(exo), control.flexion(), rate=RATE)


def tracked(exo, controller="model"):
    return exo.track(control.flexion(), controller, duration=DURATION, rate=RATE).run


def same(one, other):
    return all((getattr(one, name) == getattr(other, name)).all() for name in ("commands", "tensions", "lengths"))


def answered(server, **changes):
    return json.loads(server.answer(json.dumps(SAMPLE | changes).encode()) or "null")


def test_a_sample_has_the_answer_of_its_controller():
    seen = []
    with control.ControllerServer(lambda t, measured: seen.append((t, measured)) or [0.25, 2.0]) as server:
        assert answered(server, t=0.5) == {"run": 1, "seq": 0, "commands": [0.25, 2.0]}
    t, measured = seen[0]
    assert t == 0.5
    assert measured.lengths.tolist() == [0.3, 0.4]
    assert measured.drive_positions is None
    assert measured.orientation.magnitude() == 0.0


def test_samples_that_come_again_late_or_not_are_counted_and_a_new_run_resets():
    class Counting:
        calls = resets = 0

        def __call__(self, t, measured):
            self.calls += 1
            return [self.calls / 100.0, 0.0]

        def reset(self):
            self.resets += 1

    with control.ControllerServer(own := Counting()) as server:
        found = [answered(server, seq=seq) for seq in (0, 4, 4, 3)]
        assert [each and each["commands"][0] for each in found] == [0.01, 0.02, 0.02, None]
        assert (server.lost, server.late, own.resets) == (3, 1, 1)
        answered(server, run=2)
        assert (server.lost, server.late, own.resets, own.calls) == (3, 1, 2, 3)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"t": "soon"}, r"\$\.t"),
        ({"t": None}, r"\$\.t"),
        ({"lengths": [0.3, None]}, r"\$\.lengths"),
        ({"unknown": 1}, "unknown"),
        ({"lengths": [0.3]}, "expected 1 pressures"),
        ({"faulty": [True]}, "expected 2 faulty"),
        ({"quaternion_xyzw": [0.0, 0.0, 0.0, 1.1]}, "length 1"),
        ({"quaternion_xyzw": [0.0, 0.0, 0.0, 0.9]}, "length 1"),
    ],
)
def test_what_is_no_sample_is_answered_with_the_error_and_the_next_one_is_served(changes, said):
    with control.ControllerServer(lambda t, measured: [0.0, 0.0]) as server:
        found = answered(server, **changes)
        assert found["error"] in ("ValidationError", "InvalidInput")
        assert re.search(said, found["detail"])
        for raw in (b"", b"\xff", b"[1]", b"{}"):
            assert "error" in json.loads(server.answer(raw))
        assert server.malformed == 5
        assert answered(server)["commands"] == [0.0, 0.0]


def test_a_run_over_udp_is_the_run_bit_for_bit(exo):
    with control.ControllerServer(model(exo)) as server:
        Thread(target=server.serve).start()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            stranger.sendto(b"no sample", server.address)
        for real_time in (False, True):
            with control.RemoteController(server.address, real_time) as remote:
                run = tracked(exo, remote)
            assert run.status == "completed"
            # By the clock it is the same where no deadline passed.
            assert same(run, tracked(exo)) or remote.missed
            assert len(remote.loop_times) == (9 if real_time else 0)
    server.stop()  # that has ended
    assert server.malformed == 1


#: A controller that says where it listens.
SERVER = f"""
import exo_pin as ep
from exo_pin import control
controller = control.ModelController(ep.Plant(ep.load("four-cables")), control.flexion(), rate={RATE})
with control.ControllerServer(controller) as server:
    print(*server.address, flush=True)
    server.serve()
"""


@pytest.mark.full
def test_a_controller_in_another_process_gives_the_same_run(exo):
    with subprocess.Popen([sys.executable, "-c", SERVER], stdout=subprocess.PIPE, text=True) as process:
        try:
            host, port = process.stdout.readline().split()
            with control.RemoteController((host, int(port))) as remote:
                assert same(tracked(exo, remote), tracked(exo))
        finally:
            process.kill()


class Network:
    """What stands between plant and controller: ``passes`` gets a sample's number, the answer and how often it came."""

    def __init__(self, controller, passes):
        self.server, self._passes, self.times = control.ControllerServer(controller), passes, {}
        self._link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._link.bind(("127.0.0.1", 0))
        self.answers = []
        self._thread = Thread(target=self._serve)

    def __enter__(self):
        self._thread.start()
        return self._link.getsockname()

    def __exit__(self, *_):
        self._link.sendto(b"", self._link.getsockname())
        self._thread.join()
        self._link.close()
        self.server.__exit__()

    def _serve(self):
        while message := self._link.recvfrom(65535):
            data, sender = message
            if not data:
                return
            seq = json.loads(data)["seq"]
            self.times[seq] = self.times.get(seq, 0) + 1
            answer = self.server.answer(data)
            if self.times[seq] == 1:
                self.answers.append(answer)
            for each in self._passes(seq, self.answers, self.times[seq]):
                self._link.sendto(each, sender)


def test_lost_late_and_malformed_answers_leave_the_run_as_it_is(exo):
    def passes(seq, answers, times):
        if seq == 3 and times == 1:
            return []
        return [b"no answer", b"{}", *answers[max(seq - 2, 0) : seq], answers[seq]]

    network = Network(model(exo), passes)
    with network as address, control.RemoteController(address) as remote:
        assert same(tracked(exo, remote), tracked(exo))
    assert network.times[3] >= 2
    assert remote.late >= 8 + 9
    assert remote.malformed >= 2 * 10


def test_in_real_time_the_newest_commands_hold_until_others_come(exo):
    """Answers of samples 4 and 5 come with sample 6, in the wrong order, and its own never does."""

    def passes(seq, answers, times):
        return [answers[k] for k in {4: (), 5: (), 6: (5, 4)}.get(seq, (seq,))]

    network = Network(model(exo), passes)
    with network as address, control.RemoteController(address, real_time=True) as remote:
        run = tracked(exo, remote)
    sent = np.clip([json.loads(each)["commands"] for each in network.answers], -1.0, 1.0)
    newest = 0
    for seq in range(1, 10):
        held = np.flatnonzero((sent == run.commands[seq]).all(axis=1))
        # On a slow machine more than these are missed; never is one that is older, nor one that cannot have come.
        assert held.size
        newest, before = held.max(), newest
        assert before <= newest <= seq
        assert (newest == seq) == (seq not in remote.missed)
    assert {4, 5, 6} <= set(remote.missed)
    assert 4 not in (np.flatnonzero((sent == each).all(axis=1)).max() for each in run.commands[4:7])


def test_an_error_of_the_controller_ends_the_run_with_its_words(exo):
    def failing(t, measured):
        if t > 0.02:
            raise RuntimeError("no more")
        return np.full(4, 0.1)

    network = Network(failing, lambda seq, answers, times: [answers[seq]])
    with network as address, control.RemoteController(address) as remote:
        run = tracked(exo, remote)
    assert run.status.startswith("stopped at 0.025 s")
    assert "answers RuntimeError: RuntimeError: no more" in run.status


def test_nobody_there_and_arguments_that_do_not_fit_raise_typed_errors(exo):
    nobody = control.RemoteController(("127.0.0.1", 9), patience=0.05)
    with nobody, pytest.raises(InvalidInput, match="no controller answers at"):
        tracked(exo, nobody)
    with control.ControllerServer(model(exo)) as server, pytest.raises(InvalidInput, match="cannot listen"):
        control.ControllerServer(model(exo), port=server.address[1])
    for wrong in (lambda: control.ControllerServer(3), lambda: control.ControllerServer(model(exo), port=70000)):
        with pytest.raises(InvalidInput, match="expected"):
            wrong()
    for address, changes in ((("127.0.0.1", 9), {"deadline": 1.5}), (("127.0.0.1", 9), {"patience": 0.0}), (5, {})):
        with pytest.raises(InvalidInput, match="expected"):
            control.RemoteController(address, **changes)
