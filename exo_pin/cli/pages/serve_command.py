"""``exo-pin serve``: questions over HTTP."""

from __future__ import annotations

import os
from functools import partial
from typing import Annotated

from ...core.optional_packages import require_extra
from ...service import ServiceOptions
from ...service import serve as served
from ..options import Seconds, Texts, called

#: Environment variable with the token.
TOKEN = "EXO_PIN_TOKEN"


def serve(
    *,
    host: Annotated[str, called("ADDRESS")] = "127.0.0.1",
    port: Annotated[int, called("N")] = 8600,
    name: Annotated[Texts, called("HOST")] = (),
    workers: Annotated[int | None, called("N")] = None,
    waiting: Annotated[int, called("N")] = 256,
    seconds: Seconds = 30.0,
    body: Annotated[int, called("BYTES")] = 2**20,
    memory: Annotated[int, called("MB")] = 2048,
    live: Annotated[int, called("N")] = 8,
    udp: Annotated[int | None, called("PORT")] = None,
) -> None:
    """Answer the questions of exo-pin batch over HTTP, for programs in any language (needs the extra 'service').

    Until Ctrl-C is pressed. Only this machine is answered, unless another address is given; then a token is needed,
    which stands in the environment variable EXO_PIN_TOKEN. No file of this machine is read for a question.

    Parameters
    ----------
    host : str
        Address to listen on; 0.0.0.0 is all of this machine.
    port : int
        Port to listen on; 0 takes one that is free.
    name : tuple of str
        Further name by which this machine is asked; may be repeated.
    workers : int, optional
        Processes that answer (default: one a processor).
    waiting : int
        Most questions that wait for a process; more are refused with status 503.
    seconds : float
        Time that an answer may take, s.
    body : int
        Largest question, bytes.
    memory : int
        Memory that a process may take for its answers, MB.
    live : int
        Most live streams at once, over WebSocket (/live) and UDP; 0 starts no process for them.
    udp : int, optional
        Take live streams over UDP, too, at this port.

    Examples
    --------
    exo-pin serve
    exo-pin serve --host 127.0.0.1 --port 0 --workers 1 --seconds 10

    Notes
    -----
    For other machines:
      EXO_PIN_TOKEN=$(openssl rand -hex 24) exo-pin serve --host 0.0.0.0 --name lab.example.org
    """
    require_extra("service")
    token = os.environ.get(TOKEN) or None
    options = ServiceOptions(host, port, token, name, workers, waiting, seconds, body, memory, live, udp)
    served(options, partial(print, flush=True))
