"""Who may see the page: those who have its address, from a browser on this machine; and how much they may send.

The rules are those of the live page (:mod:`exo_pin.view.page.live_server`): a random token begins every path, ``Host``
names this machine, and ``Origin`` is the page's own. All else gets status 403, a body that is too large 413.
"""

from __future__ import annotations

import secrets
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any

from ..view.page.live_server import is_of_this_machine
from .files import LARGEST

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]


class TokenGuard:
    """An ASGI application behind a token.

    Parameters
    ----------
    application : callable
        What answers those who may ask.
    token : str
        First part of every path.
    """

    def __init__(self, application: Any, token: str) -> None:
        self._application, self._prefix = application, f"/{token}/".encode()

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Answer, or refuse."""
        if scope["type"] not in ("http", "websocket"):
            await self._application(scope, receive, send)
            return
        headers = {name.lower(): value.decode("latin-1") for name, value in scope["headers"]}
        begins = scope["path"].encode()[: len(self._prefix)]
        is_here = is_of_this_machine(headers.get(b"host", ""), headers.get(b"origin"))
        if not (secrets.compare_digest(begins, self._prefix) and is_here):
            await _refuse(scope, receive, send, 403, b"Open the whole address that exo-pin app has given.")
            return
        size = headers.get(b"content-length", "0")
        # Without its length a body could grow without end.
        chunked = b"transfer-encoding" in headers
        if chunked or not (size.isdecimal() and int(size) <= LARGEST):
            await _refuse(scope, receive, send, 413, b"Too large.")
            return

        async def kept(message: Message) -> None:
            if message["type"] == "http.response.start":
                added = [(b"referrer-policy", b"no-referrer"), (b"x-content-type-options", b"nosniff")]
                message = {**message, "headers": [*message["headers"], *added]}
            await send(message)

        await self._application(scope, receive, kept)


async def _refuse(scope: Message, receive: Receive, send: Send, status: int, text: bytes) -> None:
    if scope["type"] == "websocket":
        # Before it is accepted: the server answers with 403.
        await receive()
        await send({"type": "websocket.close", "code": 1008})
        return
    await send({"type": "http.response.start", "status": status, "headers": [(b"content-type", b"text/plain")]})
    await send({"type": "http.response.body", "body": text})
