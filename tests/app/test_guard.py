"""Who may see the page, and how much they may send."""

import asyncio

import pytest

from exo_pin.app.files import LARGEST
from exo_pin.app.guard import TokenGuard

TOKEN = "a-secret"
HERE = ((b"host", b"127.0.0.1:7100"),)


async def _page(scope, receive, send):
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": b"the page"})


def answer(path=f"/{TOKEN}/", headers=HERE, kind="http"):
    """Status and headers of an answer; of a socket what it was sent."""
    sent = []

    async def receive():
        return {"type": "websocket.connect"}

    async def send(message):
        sent.append(message)

    asyncio.run(TokenGuard(_page, TOKEN)({"type": kind, "path": path, "headers": headers}, receive, send))
    return sent[0]


def test_who_has_the_address_may_look():
    for headers in (
        HERE,
        (*HERE, (b"origin", b"http://127.0.0.1:7100")),
        ((b"host", b"localhost"),),
        ((b"host", b"[::1]:80"),),
    ):
        got = answer(headers=headers)
        assert got["status"] == 200
        assert got["headers"] == [(b"referrer-policy", b"no-referrer"), (b"x-content-type-options", b"nosniff")]
    assert answer("", (), "lifespan") == {"type": "http.response.start", "status": 200, "headers": []}


WRONG = ("/", f"/{TOKEN}", f"/{TOKEN}x/", "/wrong/", f"//{TOKEN}/", f"/{TOKEN.upper()}/", "/é/")


@pytest.mark.parametrize("path", WRONG)
def test_a_wrong_token_is_refused(path):
    assert answer(path)["status"] == 403
    assert answer(path, kind="websocket") == {"type": "websocket.close", "code": 1008}


@pytest.mark.parametrize(
    "headers",
    [
        (),
        ((b"host", b"evil.example"),),
        ((b"host", b"evil.example:7100"), (b"origin", b"http://evil.example:7100")),
        ((b"host", b"127.0.0.1.evil.example"),),
        ((b"host", b"0.0.0.0"),),
        (*HERE, (b"origin", b"http://evil.example")),
        (*HERE, (b"origin", b"http://127.0.0.1:7101")),
        (*HERE, (b"origin", b"null")),
    ],
)
def test_other_sites_and_machines_are_refused(headers):
    assert answer(headers=headers)["status"] == 403
    assert answer(headers=headers, kind="websocket")["type"] == "websocket.close"


@pytest.mark.parametrize(
    "header",
    [
        (b"content-length", str(LARGEST + 1).encode()),
        (b"content-length", b"-1"),
        (b"content-length", b"many"),
        (b"transfer-encoding", b"chunked"),
    ],
)
def test_large_bodies_are_refused(header):
    assert answer(headers=(*HERE, header))["status"] == 413
    assert answer(headers=(*HERE, (b"content-length", str(LARGEST).encode())))["status"] == 200
