"""The application: addresses, who may ask, limits of a request, and health."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

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
from .options import LOOPBACK, ServiceOptions
from .problems import JSON, LOG, MEDIA, PAGES, encoded, problem
from .workers import Busy, Workers

#: Time in which a body has to arrive, s.
_ARRIVAL = 10.0
#: The one address that needs no token: it says that the service is there.
_OPEN = "/health"


def application(workers: Workers, options: ServiceOptions, live: Live | None = None) -> ASGIApp:
    """The service as an ASGI application."""

    async def ask(request: Request) -> Response:
        name = request.url.path[1:]
        media = _wanted(request) if name == "report" else JSON
        asked = f"{name}.{PAGES[media]}" if media in PAGES else name
        status, body = await _answered(workers, options, asked, request)
        headers = {"Retry-After": "1"} if status == 503 else {}
        return Response(body, status, headers, media if status == 200 else MEDIA)

    async def health(_: Request) -> Response:
        return Response(encoded({"status": "ok", "version": __version__}), media_type="application/json")

    routes: list[BaseRoute] = [Route(f"/{name}", ask, methods=["POST"]) for name in QUESTIONS]
    routes.append(Route(_OPEN, health))
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
