"""A controller in another process, asked over UDP: as fast as it goes, or by the clock.

The process of the controller::

    plant = ep.Plant(ep.load("four-cables"))
    control.ControllerServer(control.ModelController(plant, control.flexion(), rate=500.0), port=9500).serve()

The process of the plant, which may be the simulated one, or anything that sends these messages::

    with control.RemoteController(("127.0.0.1", 9500), real_time=True) as remote:
        run = ep.load("four-cables").track(control.flexion(), remote, rate=500.0)
    print(np.percentile(remote.loop_times, [50, 99, 100]))

A message is one JSON object in one datagram, in SI and the base frame, with an entry for each of n drives. Numbers have
all digits, so a run is that of the same controller without a network, bit for bit. The plant sends samples::

    {"run": 1, "seq": 7, "t": 0.07, "quaternion_xyzw": [4], "angular_velocity": [3], "pressures": [n],
     "supply_pressure": 0.0, "lengths": [n], "contraction_ratios": [n], "drive_positions": [n] or null,
     "drive_speeds": [n] or null, "lost": false, "faulty": [n] or null}

They are those of :class:`.Measurement`. ``run`` and ``seq`` count up; a new ``run`` resets the controller. The answer
has the numbers of its sample: ``{"run": 1, "seq": 7, "commands": [n]}``, or ``error`` and ``detail`` in place of
commands. A sample that comes again gets the same answer, an older one gets none.
"""

from __future__ import annotations

import gc
import math
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from select import select
from threading import Lock
from traceback import format_exception_only
from typing import Any

import msgspec
import numpy as np
from scipy.spatial.transform import Rotation

from ..core.errors import ExoPinError, InvalidInput
from ..core.errors.base import echo, shown
from ..core.errors.checked import checked
from ..core.records import OneProcess
from ..core.validation import FloatArray, as_count, as_finite, as_positive, require_type
from .plant.state import Controller, Measurement

__all__ = ["ControllerServer", "RemoteController"]

_LONGEST = 65535
#: After it a sample is sent again where an answer is waited for, s; each time twice as long.
_AGAIN = 0.25
#: By how much the length of a quaternion may differ from 1.
_UNIT = 1e-6


class _Sample(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """A measurement on the wire."""

    run: int
    seq: int
    t: float
    quaternion_xyzw: tuple[float, float, float, float]
    angular_velocity: tuple[float, float, float]
    pressures: list[float]
    supply_pressure: float
    lengths: list[float]
    contraction_ratios: list[float]
    drive_positions: list[float] | None = None
    drive_speeds: list[float] | None = None
    lost: bool = False
    faulty: list[bool] | None = None

    @classmethod
    def of(cls, run: int, seq: int, t: float, seen: Measurement) -> _Sample:
        lists: dict[str, Any] = {
            name: None if value is None else np.asarray(value).tolist()
            for name, value in seen._asdict().items()
            if name != "orientation"
        }
        return cls(run, seq, t, tuple(seen.orientation.as_quat().tolist()), **lists)

    def measurement(self) -> Measurement:
        if abs(math.hypot(*self.quaternion_xyzw) - 1.0) > _UNIT:
            raise InvalidInput(f"expected quaternion_xyzw of length 1, got {self.quaternion_xyzw}")
        count, arrays = len(self.lengths), dict[str, Any]()
        for name in ("pressures", "lengths", "contraction_ratios", "drive_positions", "drive_speeds", "faulty"):
            value = getattr(self, name)
            if value is not None and len(value) != count:
                raise InvalidInput(f"expected {count} {name}, one a drive as of lengths, got {len(value)}")
            arrays[name] = None if value is None else np.array(value)
        # A quaternion that is normalised again differs in its last digit.
        pose = Rotation(np.array(self.quaternion_xyzw), normalize=False)
        rate = np.array(self.angular_velocity)
        return Measurement(pose, rate, supply_pressure=self.supply_pressure, lost=self.lost, **arrays)


class _Answer(msgspec.Struct, omit_defaults=True, frozen=True):
    """Commands on the wire, or why there are none."""

    run: int | None = None
    seq: int | None = None
    commands: list[float] = []
    error: str = ""
    detail: str = ""


@contextmanager
def _without_collection() -> Iterator[None]:
    """A time in which Python does not look for garbage by itself."""
    was = gc.isenabled()
    gc.collect()
    gc.freeze()
    gc.disable()
    try:
        yield
    finally:
        gc.unfreeze()
        if was:
            gc.enable()


@checked
class ControllerServer(OneProcess):
    """A controller that answers samples of a plant over UDP; messages are described in :mod:`exo_pin.control.remote`.

    Parameters
    ----------
    controller : callable
        From time in s and :class:`.Measurement` to commands; its ``reset()`` is called at the first sample of a run.
    host : str
        Address to listen at; whoever reaches it is answered.
    port : int
        0 for any that is free.

    Attributes
    ----------
    address : tuple of (str, int)
        Where it listens.
    lost, late, malformed : int
        Samples that have not come, that came after newer ones, and messages that are no samples.

    Raises
    ------
    InvalidInput
        If the address cannot be used.

    Examples
    --------
    >>> from exo_pin import control
    >>> with control.ControllerServer(lambda t, seen: [0.5]) as server:
    ...     server.answer(b"no sample")[:41]
    b'{"error":"DecodeError","detail":"JSON is '
    """

    def __init__(self, controller: Controller, host: str = "127.0.0.1", port: int = 0) -> None:
        require_type("controller", controller, Controller, "a function (t, measurement) -> commands")
        self._controller = controller
        self._newest, self._sent, self._is_stopped, self._serving = (-1, -1), b"", False, Lock()
        self.lost = self.late = self.malformed = 0
        where = (host, as_count("port", port, most=65535))
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind(where)
        except (OSError, TypeError, ValueError) as error:
            self._socket.close()
            raise InvalidInput(f"cannot listen at {echo(host)}, port {port}: {error}") from error
        self.address: tuple[str, int] = self._socket.getsockname()

    def answer(self, message: bytes) -> bytes:
        """The answer of a message, empty where there is none.

        Parameters
        ----------
        message : bytes
            A sample.

        Returns
        -------
        bytes
            Commands, or what is wrong with the message or with the controller.

        Examples
        --------
        >>> from exo_pin import control
        >>> sample = b'{"run": 1, "seq": 0, "t": 0.0, "quaternion_xyzw": [0, 0, 0, 1], "angular_velocity": [0, 0, 0],'
        >>> sample += b'"pressures": [0], "supply_pressure": 0, "lengths": [0.3], "contraction_ratios": [0]}'
        >>> with control.ControllerServer(lambda t, seen: seen.lengths + 0.2) as server:
        ...     server.answer(sample)
        b'{"run":1,"seq":0,"commands":[0.5]}'
        """
        try:
            sample = msgspec.json.decode(message, type=_Sample)
            seen = sample.measurement()
        except (msgspec.DecodeError, UnicodeError, ExoPinError) as error:
            self.malformed += 1
            return msgspec.json.encode(_Answer(error=type(error).__name__, detail=shown(str(error))))
        at = (sample.run, sample.seq)
        if at == self._newest:
            return self._sent
        if at < self._newest:
            self.late += 1
            return b""
        if sample.run == self._newest[0]:
            self.lost += sample.seq - self._newest[1] - 1
        elif callable(reset := getattr(self._controller, "reset", None)):
            reset()
        self._newest = at
        try:
            commands = as_finite("the controller's commands", self._controller(sample.t, seen), (len(sample.lengths),))
            found = _Answer(*at, commands.tolist())
        except Exception as error:
            text = shown(format_exception_only(error)[-1].strip())
            found = _Answer(*at, error=type(error).__name__, detail=text)
        self._sent = msgspec.json.encode(found)
        return self._sent

    def serve(self, silence: float | None = None) -> None:
        """Answer until :meth:`stop`; garbage is collected between answers alone.

        Parameters
        ----------
        silence : float, optional
            Time without a message after which it ends, s.

        Examples
        --------
        >>> from exo_pin import control
        >>> with control.ControllerServer(lambda t, seen: [0.5]) as server:
        ...     server.serve(silence=0.01)
        """
        wait = None if silence is None else as_positive("silence", silence)
        with self._serving, _without_collection():
            while not self._is_stopped and select([self._socket], [], [], wait)[0]:
                try:
                    message, sender = self._socket.recvfrom(_LONGEST)
                    if not self._is_stopped and (found := self.answer(message)):
                        self._socket.sendto(found, sender)
                except ConnectionError:  # Windows says so when a plant is no more
                    continue
                gc.collect(0)

    def stop(self) -> None:
        """End :meth:`serve`, from another thread; so does the end of ``with``.

        Examples
        --------
        >>> from exo_pin import control
        >>> with control.ControllerServer(lambda t, seen: [0.5]) as server:
        ...     server.stop()
        ...     server.serve()
        """
        self._is_stopped = True
        with suppress(OSError):  # it has ended, and is closed
            self._socket.sendto(b"", self.address)

    def __enter__(self) -> ControllerServer:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()
        with self._serving:
            self._socket.close()


@checked
class RemoteController(OneProcess):
    """The controller of a :class:`ControllerServer`, for the plant: it sends samples and waits for the commands.

    Without a clock a sample whose answer is missing is sent again. In real time the clock begins with the first answer
    of a run; a sample is sent when its time has come, and where the answer is missing at the deadline the newest
    commands that came hold. A run that keeps the deadlines is the one without a clock, bit for bit. The first run
    compiles; make one without a clock before.

    Parameters
    ----------
    address : tuple of (str, int)
        Host and port of the controller.
    real_time : bool
        Whether to keep to the clock.
    deadline : float
        Share of the period, 0 to 1, after which an answer counts as missed in real time; the plant needs the rest.
    patience : float
        How long an answer is waited for otherwise, s. The controller's process may have to compile.

    Attributes
    ----------
    loop_times : list of float
        Of the samples in real time, from the instant at which each was due until its commands were there or missed, s.
    missed : list of int
        Numbers of the samples of this run whose answers were not there at the deadline.
    late, malformed : int
        Answers that came after their deadline or again, and messages that are no answers.

    Raises
    ------
    InvalidInput
        If an argument is not usable; in a run, if nobody answers, or the answer is an error.

    Examples
    --------
    >>> from threading import Thread
    >>> from exo_pin import control
    >>> exo = ep.load("four-cables")
    >>> with control.ControllerServer(control.ModelController(ep.Plant(exo), control.flexion())) as server:
    ...     Thread(target=server.serve).start()
    ...     with control.RemoteController(server.address) as remote:
    ...         run = exo.track("flexion", remote, duration=0.05).run
    >>> bool((run.tensions == exo.track("flexion", "model", duration=0.05).run.tensions).all())
    True
    """

    def __init__(
        self, address: tuple[str, int], real_time: bool = False, deadline: float = 0.8, patience: float = 120.0
    ) -> None:
        if as_positive("deadline", deadline) > 1.0:
            raise InvalidInput(f"expected deadline as a share of the period, up to 1, got {deadline:g}")
        self._real_time, self._deadline, self._patience = real_time, deadline, as_positive("patience", patience)
        self._socket, self._kept = socket.socket(socket.AF_INET, socket.SOCK_DGRAM), ExitStack()
        try:
            self._socket.connect(address)
        except (OSError, OverflowError, TypeError, ValueError) as error:
            self._socket.close()
            raise InvalidInput(f"expected address as host and port, got {echo(address)}: {error}") from error
        self._address, self._run = address, 0
        self.reset()

    def reset(self) -> None:
        """Begin a run: the controller's process resets its controller with the first sample.

        Examples
        --------
        >>> from exo_pin import control
        >>> with control.RemoteController(("127.0.0.1", 9500)) as remote:
        ...     remote.reset()
        ...     remote.loop_times
        []
        """
        # Runs of another plant's process before this one have smaller numbers, too.
        self._run = max(self._run + 1, int(1e3 * time.time()))
        self._seq, self._begun, self._before = -1, 0.0, 0.0
        self._held, self._held_of = np.zeros(0), -1
        self.loop_times: list[float] = []
        self.missed: list[int] = []
        self.late = self.malformed = 0

    def __call__(self, t: float, measurement: Measurement) -> FloatArray:
        """Commands at a sample; see :class:`.Controller`."""
        self._seq += 1
        message = msgspec.json.encode(_Sample.of(self._run, self._seq, t, measurement))
        if self._seq == 0 or not self._real_time:
            self._ask(message)
            self._begun = time.perf_counter() - t
        else:
            due = self._begun + t
            time.sleep(max(0.0, due - time.perf_counter()))
            self._send(message)
            if not self._answered(time.perf_counter() + self._deadline * (t - self._before)):
                self.missed.append(self._seq)
            self.loop_times.append(time.perf_counter() - due)
        self._before = t
        return self._held

    def _ask(self, message: bytes) -> None:
        """Send a sample until it is answered."""
        last, wait = time.perf_counter() + self._patience, _AGAIN
        while (now := time.perf_counter()) < last:
            self._send(message)
            if self._answered(min(now + wait, last)):
                return
            wait *= 2.0
        raise InvalidInput(f"no controller answers at {echo(self._address)} within {self._patience:g} s")

    def _send(self, message: bytes) -> None:
        try:
            self._socket.send(message)
        except ConnectionError:  # what was sent before found nobody
            self._socket.send(message)

    def _answered(self, until: float) -> bool:
        """Take answers until that of the newest sample comes, or until a time of the clock."""
        while (left := until - time.perf_counter()) > 0.0 and select([self._socket], [], [], left)[0]:
            try:
                found = msgspec.json.decode(self._socket.recv(_LONGEST), type=_Answer)
            except ConnectionError:  # nobody listens there yet
                time.sleep(min(left, 1e-2))
                continue
            except (msgspec.DecodeError, UnicodeError):
                self.malformed += 1
                continue
            is_own = (found.run, found.seq) == (self._run, self._seq)
            if found.error and (is_own or found.seq is None):
                raise InvalidInput(f"the controller's process answers {found.error}: {found.detail}")
            self.malformed += found.seq is None
            self.late += found.seq is not None and not is_own
            if found.seq is not None and found.run == self._run and found.commands and found.seq > self._held_of:
                self._held, self._held_of = np.array(found.commands), found.seq
            if is_own:
                return True
        return False

    def __enter__(self) -> RemoteController:
        if self._real_time:
            self._kept.enter_context(_without_collection())
        return self

    def __exit__(self, *_: object) -> None:
        self._kept.close()
        self._socket.close()
