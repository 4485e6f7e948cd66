"""Start the service: processes first, then the port."""

from __future__ import annotations

import logging
import os
import socket
from collections.abc import Callable
from contextlib import ExitStack, closing
from dataclasses import replace
from typing import Any

from ..core.errors import InvalidInput
from ..core.optional_packages import require_extra
from ..core.validation import require_type
from .options import ServiceOptions

#: Samples of all streams that wait for their process.
_STREAMS_WAITING = 64
#: Connections at once; beyond it the server refuses.
_CONNECTIONS = 1000


def serve(options: ServiceOptions | None = None, announce: Callable[[str], Any] | None = None) -> None:
    """Answer questions over HTTP until the process is ended.

    Parameters
    ----------
    options : ServiceOptions, optional
        Where, for whom, and within which limits.
    announce : callable, optional
        Takes a line with the address, when the port is open.

    Raises
    ------
    MissingExtra
        Without the extra ``service``.
    InvalidInput
        If the address cannot be taken.

    Examples
    --------
    >>> from exo_pin.service import ServiceOptions, serve
    >>> serve(ServiceOptions(host="0.0.0.0"))  # other machines could ask
    Traceback (most recent call last):
    exo_pin.core.errors.inputs.InvalidInput: other machines reach 0.0.0.0: give a token
    """
    require_extra("service")
    import uvicorn

    from .application import application
    from .live import Live
    from .workers import Workers

    options = ServiceOptions() if options is None else options
    require_type("options", options, ServiceOptions)
    require_type("announce", announce, Callable | None, "a function")
    logging.basicConfig(format="%(asctime)s %(name)s %(levelname)s %(message)s")
    # Processes share the processors already.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    with _bound(options) as listener, ExitStack() as ended:
        options = replace(options, port=listener.getsockname()[1])

        def processes(count: int, waiting: int) -> Workers:
            return ended.enter_context(closing(Workers(count, options.seconds, waiting, options.memory)))

        workers = processes(options.processes, options.waiting)
        config = uvicorn.Config(
            application(workers, options, Live(processes(1, _STREAMS_WAITING), options) if options.live else None),
            ws_max_size=options.body,
            ws_per_message_deflate=False,
            log_level="warning",
            server_header=False,
            limit_concurrency=_CONNECTIONS,
            timeout_graceful_shutdown=5,
        )
        listener.listen(_CONNECTIONS)
        if announce is not None:
            announce(f"exo_pin answers at {options.url}, described at {options.url}/openapi.json")
        uvicorn.Server(config).run(sockets=[listener])


def _bound(options: ServiceOptions) -> socket.socket:
    """A socket that has the address, and does not listen yet."""
    family = socket.AF_INET6 if ":" in options.host else socket.AF_INET
    listener = socket.socket(family)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, True)
    try:
        listener.bind((options.host, options.port))
    except (OSError, OverflowError) as error:
        listener.close()
        raise InvalidInput(f"cannot listen on {options.host} port {options.port}: {error}") from error
    return listener
