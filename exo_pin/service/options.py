"""What a service is given: where it listens, who may ask, and how much a question may take."""

from __future__ import annotations

import os
from dataclasses import dataclass
from ipaddress import ip_address

from ..core.errors import InvalidInput
from ..core.records import Record
from ..core.validation import as_count, set_positive

#: Names of this machine.
LOOPBACK = ("localhost", "127.0.0.1", "::1")
_LAST_PORT = 2**16 - 1
#: Characters of a token that nobody guesses.
_LEAST_TOKEN = 16


@dataclass(frozen=True, eq=False)
class ServiceOptions(Record):
    """Options of a service.

    Attributes
    ----------
    host : str
        Address that it listens on.
    port : int
        Port; 0 for any that is free.
    token : str or None
        What a request has to know (``Authorization: Bearer TOKEN``). Needed on an address that other machines reach.
    names : tuple of str
        Names by which the machine may be asked (header ``Host``), besides those of this machine and ``host``.
    workers : int or None
        Processes that answer, each one question at a time; None for one a processor.
    waiting : int
        Most questions that wait for one of them; further ones have the status 503.
    seconds : float
        Time that an answer may take, s; a process that takes longer is ended.
    body : int
        Most bytes of a request.
    memory : int
        Memory that a process may take for its answers, MB.
    live : int
        Most live streams at once, which a process of their own answers; 0 for none.
    udp : int or None
        Port for live streams over UDP.

    Raises
    ------
    InvalidInput
        If a limit is not positive, or another machine could ask without a token.

    Examples
    --------
    >>> ep.service.ServiceOptions(workers=2, seconds=10.0).url
    'http://127.0.0.1:8600'
    """

    host: str = "127.0.0.1"
    port: int = 8600
    token: str | None = None
    names: tuple[str, ...] = ()
    workers: int | None = None
    waiting: int = 256
    seconds: float = 30.0
    body: int = 2**20
    memory: int = 2048
    live: int = 8
    udp: int | None = None

    def __post_init__(self) -> None:
        set_positive(self, "seconds")
        for name in ("workers", "waiting", "body", "memory"):
            if getattr(self, name) is not None:
                as_count(name, getattr(self, name), 1)
        as_count("live", self.live)
        as_count("port", self.port, most=_LAST_PORT)
        if self.udp is not None:
            as_count("udp", self.udp, 1, _LAST_PORT)
        if self.token is not None and (len(self.token) < _LEAST_TOKEN or not self.token.isascii()):
            raise InvalidInput(f"expected a token of at least {_LEAST_TOKEN} ASCII characters")
        if self.token is None and not is_loopback(self.host):
            raise InvalidInput(f"other machines reach {self.host}: give a token")

    @property
    def url(self) -> str:
        """Address of the service."""
        return f"http://{f'[{self.host}]' if ':' in self.host else self.host}:{self.port}"

    @property
    def processes(self) -> int:
        """Number of processes that answer."""
        return self.workers or len(os.sched_getaffinity(0))


def is_loopback(host: str) -> bool:
    """Whether only this machine reaches an address."""
    if host in LOOPBACK:
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False
