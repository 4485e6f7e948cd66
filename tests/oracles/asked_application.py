"""Requests to the application of the service, without a network and with workers that only tell what they are asked."""

import asyncio
import contextlib
import json

from exo_pin.service.workers import Busy


class TellingWorkers:
    """Answers with the name of the question and the length of its body, is busy, or breaks."""

    busy, waiting, restarts = 1, 2, 3

    async def answer(self, name, body):
        if body == b"wait":
            raise Busy("too many questions wait")
        if body == b"break":
            raise ZeroDivisionError
        return (422 if body == b"wrong" else 200), json.dumps([name, len(body)]).encode()


async def _asked(app, method, path, body, headers, parts, kind):
    """Status, headers and text of a response; ``None`` as a part is a client that leaves."""
    pieces = [body] if parts is None else list(parts)
    events = [
        {"type": "http.disconnect"} if piece is None
        else {"type": "http.request", "body": piece, "more_body": k < len(pieces) - 1}
        for k, piece in enumerate(pieces)
    ]  # fmt: skip
    sent = []
    scope = {
        "type": kind, "http_version": "1.1", "method": method, "path": path, "raw_path": path.encode(),
        "query_string": b"", "headers": [(n.lower().encode(), v.encode("latin-1")) for n, v in headers.items()],
        "scheme": "http", "server": ("127.0.0.1", 80), "client": ("127.0.0.1", 5), "root_path": "",
    }  # fmt: skip

    async def receive():
        return events.pop(0) if events else {"type": "http.disconnect"}

    async def send(message):
        sent.append(message)

    with contextlib.suppress(ZeroDivisionError):
        await app(scope, receive, send)
    if kind == "websocket":
        return sent
    text = b"".join(each.get("body", b"") for each in sent[1:]).decode()
    own = {name.decode(): value.decode() for name, value in sent[0]["headers"] if name != b"content-length"}
    return sent[0]["status"], own, text


def asked(app, method="POST", path="/reaction", body=b"{}", parts=None, kind="http", **headers):
    """What the application answers; headers by name with underscores, a JSON body from this machine if left out."""
    given = {"Host": "127.0.0.1:8600", "Content-Type": "application/json"}
    given |= {name.replace("_", "-"): value for name, value in headers.items()}
    return asyncio.run(_asked(app, method, path, body, given, parts, kind))
