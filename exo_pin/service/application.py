"""The application: addresses, who may ask, limits of a request, health and metrics."""

from __future__ import annotations

import asyncio
import secrets
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, ProcessCollector
from prometheus_client.exposition import CONTENT_TYPE_PLAIN_0_0_4, generate_latest
from starlette.applications import Starlette
from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route
from starlette.types import ASGIApp, Receive, Scope, Send

from .. import __version__
from ..exo.questions import QUESTIONS
from .live import Live
from .openapi import openapi
from .options import LOOPBACK, ServiceOptions
from .problems import JSON, LOG, MEDIA, PAGES, encoded, problem
from .workers import Busy, Workers

#: Time in which a body has to arrive, s.
_ARRIVAL = 10.0
#: The one address that needs no token: it says that the service is there.
_OPEN = "/health"


def application(workers: Workers, options: ServiceOptions, live: Live | None = None) -> ASGIApp:
    """The service as an ASGI application."""
    metrics = Metrics(workers, live)
    described = encoded(openapi())

    async def ask(request: Request) -> Response:
        name, start = request.url.path[1:], time.perf_counter()
        media = _wanted(request) if name == "report" else JSON
        asked = f"{name}.{PAGES[media]}" if media in PAGES else name
        status, body = await _answered(workers, options, asked, request)
        metrics.count(name, status, time.perf_counter() - start)
        headers = {"Retry-After": "1"} if status == 503 else {}
        return Response(body, status, headers, media if status == 200 else MEDIA)

    async def health(_: Request) -> Response:
        return Response(encoded({"status": "ok", "version": __version__}), media_type="application/json")

    async def schema(_: Request) -> Response:
        return Response(described, media_type="application/json")

    async def measured(_: Request) -> Response:
        return Response(metrics.text(), headers={"Content-Type": CONTENT_TYPE_PLAIN_0_0_4})

    routes: list[BaseRoute] = [Route(f"/{name}", ask, methods=["POST"]) for name in QUESTIONS]
    routes += [Route(_OPEN, health), Route("/openapi.json", schema), Route("/metrics", measured)]
    if live is not None:
        routes.append(live.route)

    @asynccontextmanager
    async def running(_: Starlette) -> AsyncIterator[None]:
        datagrams = await live.listen() if live is not None else None
        yield
        if datagrams is not None:
            datagrams.close()

    app = Starlette(routes=routes, lifespan=running, exception_handlers={HTTPException: _refused, Exception: _failed})
    return Guard(app, options)


def _wanted(request: Request) -> str:
    """The first media type of ``Accept`` that a report has; else JSON."""
    wanted = [part.partition(";")[0].strip().lower() for part in request.headers.get("accept", "").split(",")]
    return next((each for each in wanted if each in (*PAGES, JSON)), JSON)


async def _answered(workers: Workers, options: ServiceOptions, name: str, request: Request) -> tuple[int, bytes]:
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind != JSON:
        return 415, problem(415, "MediaType", "expected the header Content-Type: application/json")
    try:
        async with asyncio.timeout(_ARRIVAL):
            body = await _body(request, options.body)
    except (TimeoutError, ClientDisconnect):
        return 408, problem(408, "TimeLimit", f"the request did not arrive within {_ARRIVAL:g} s")
    if body is None:
        return 413, problem(413, "SizeLimit", f"expected at most {options.body} bytes")
    try:
        return await workers.answer(name, body)
    except Busy as error:
        return 503, problem(503, "Busy", str(error))


async def _body(request: Request, most: int) -> bytes | None:
    """The body of a request; None where it is longer than it may be."""
    body = bytearray()
    async for part in request.stream():
        body += part
        if len(body) > most:
            return None
    return bytes(body)


async def _refused(_: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    body = problem(error.status_code, "Request", str(error.detail))
    return Response(body, error.status_code, error.headers, MEDIA)


async def _failed(_: Request, error: Exception) -> Response:
    LOG.error("a request had no answer", exc_info=error)
    return Response(problem(500, "InternalFault", "a fault of exo_pin, which its log describes"), 500, media_type=MEDIA)


class Metrics:
    """What is counted, for Prometheus."""

    def __init__(self, workers: Workers, live: Live | None) -> None:
        own = self._registry = CollectorRegistry()
        ProcessCollector("exo_pin", registry=own)
        self._requests = Counter("exo_pin_requests", "Answered requests.", ["question", "status"], registry=own)
        self._seconds = Histogram(
            "exo_pin_seconds", "Time from a request to its answer, s.", ["question"], registry=own
        )  # fmt: skip
        for name, help_, read in (
            ("busy", "Processes that work on an answer.", lambda: workers.busy),
            ("waiting", "Questions that wait for a process.", lambda: workers.waiting),
            ("streams", "Live streams.", lambda: 0 if live is None else live.open),
            ("restarts", "Processes that were ended and started again.", lambda: workers.restarts),
        ):
            Gauge(f"exo_pin_{name}", help_, registry=own).set_function(read)

    def count(self, question: str, status: int, seconds: float) -> None:
        """Count a request."""
        self._requests.labels(question, status).inc()
        self._seconds.labels(question).observe(seconds)

    def text(self) -> bytes:
        """All of it."""
        return generate_latest(self._registry)


class Guard:
    """Answers those who may ask; browsers send requests that another site has made, so names are checked.

    - ``Host`` names this machine, the address that the service listens on, or a name that it was given (a site whose
      name was made to point here has its own).
    - ``Origin``, which browsers send with what a page has asked for, is the same host and port.
    - The token, where there is one, stands in ``Authorization``.
    """

    def __init__(self, app: ASGIApp, options: ServiceOptions) -> None:
        self._app, self._token = app, options.token
        self._names = {*LOOPBACK, options.host, *options.names}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it."""
        refusal = self._refusal(scope) if scope["type"] in ("http", "websocket") else None
        if refusal is None:
            await self._app(scope, receive, send)
        elif scope["type"] == "http":
            status, kind, detail = refusal
            headers = {"WWW-Authenticate": "Bearer"} if status == 401 else {}
            await Response(problem(status, kind, detail), status, headers, MEDIA)(scope, receive, send)
        else:
            await send({"type": "websocket.close", "code": 1008, "reason": refusal[1]})

    def _refusal(self, scope: Scope) -> tuple[int, str, str] | None:
        headers = Headers(scope=scope)
        host, origin = headers.get("host", ""), headers.get("origin")
        if host_name(host) not in self._names:
            return 403, "Host", "this service is not asked by that name: start it with --name"
        if origin is not None and origin.partition("://")[2] != host:
            return 403, "Origin", "pages of other sites may not ask"
        given = headers.get("authorization", "")
        # A stream has the token in its first message, for no browser lets a page set the header.
        if self._token is None or scope["type"] == "websocket" or scope["path"] == _OPEN:
            return None
        if secrets.compare_digest(given.encode(), f"Bearer {self._token}".encode()):
            return None
        return 401, "Token", "expected the header Authorization: Bearer TOKEN"


def host_name(host: str) -> str:
    """The name in a header ``Host``, without its port."""
    return host[1:].partition("]")[0] if host.startswith("[") else host.partition(":")[0]
