"""What the server of the page gives to whom, asked as a browser asks, with pages that only tell who was there."""

import asyncio

import pytest

pytest.importorskip("nicegui", reason="needs the extra app")
pytest.importorskip("websockets", reason="needs the extra service")
import httpx
import nicegui
import uvicorn
from nicegui import Client
from websockets.asyncio.client import connect
from websockets.exceptions import InvalidStatus

from exo_pin.app.asked import Asked
from exo_pin.app.page import visit
from exo_pin.app.serving import serve_app
from exo_pin.view.page.browser import live_page, viewer_script

CABLES = Asked("four-cables")


class Sockets:
    """Answers a browser's socket by a word."""

    def __init__(self, word, key=""):
        self.word, self.key = word, key

    async def serve(self, websocket):
        await websocket.accept()
        await websocket.send_text(self.word)
        await websocket.close(1000)


MADE = []


class Visit:
    """A page that nothing is drawn on."""

    def __init__(self, asked):
        number = len(MADE)
        self.asked, self.is_open = asked, True
        self.feeds, self.live = (
            {f"scene{number}": Sockets(f"picture {number}")},
            Sockets(f"follows {number}", f"arm{number}"),
        )
        MADE.append(self)

    def close(self):
        self.is_open = False


async def heard(address):
    """What a socket says; of one that is refused the status."""
    try:
        async with connect(address.replace("http", "ws", 1)) as socket:
            return await socket.recv()
    except InvalidStatus as refused:
        return refused.response.status_code


async def ask(base, browser):
    """A browser's questions."""
    page = await browser.get(base)
    assert "<title>exo_pin</title>" in page.text
    assert [each.asked for each in MADE] == [CABLES]
    for path, text, kind in (("", live_page(), "text/html"), ("viewer.js", viewer_script(), "text/javascript")):
        given = await browser.get(f"{base}scene/scene0/{path}")
        assert given.text == text
        assert given.headers["content-type"].startswith(kind)
    assert (await browser.get(base[:-3])).status_code == 403
    first = [*Client.instances.values()]
    for _ in range(7):
        assert "already: close one" not in (await browser.get(base)).text
    scenes = [await heard(f"{base}scene/scene{k}/socket") for k in (0, 7, 8)]
    arms = [await heard(f"{base}live/arm{k}") for k in (0, 7, 8)]
    assert (scenes, arms) == (["picture 0", "picture 7", 403], ["follows 0", "follows 7", 403])
    # No more than eight, until one is left.
    assert "8 pages are open already: close one, and load this again." in (await browser.get(base)).text
    assert len(MADE) == 8
    for each in first:
        each.delete()
    assert [each.is_open for each in MADE] == [False] + 7 * [True]
    assert await heard(f"{base}scene/scene0/socket") == await heard(f"{base}live/arm0") == 403
    assert "already: close one" not in (await browser.get(base)).text
    assert len(MADE) == 9


def test_pages_scenes_and_sockets_are_given_to_who_has_the_address(monkeypatch, capsys):
    said, asked = [], []

    async def both(server, sockets):
        serving = asyncio.create_task(server.serve(sockets))
        while not server.started:
            await asyncio.sleep(0.01)
        async with httpx.AsyncClient() as browser:
            await ask(said[0].split()[0], browser)
        asked.append(server)
        server.should_exit = True
        await serving

    monkeypatch.setattr(uvicorn.Server, "run", lambda *given, sockets: asyncio.run(both(*given, sockets)))
    monkeypatch.setattr(visit, "Visit", Visit)
    # An application that has served is one that has not, for the tests that come later.
    monkeypatch.setattr(nicegui.app, "middleware_stack", None)
    monkeypatch.setattr("exo_pin.app.serving.warnings.simplefilter", [].append)
    serve_app(CABLES, 0, said=said.append)
    assert len(asked) == 1
    assert capsys.readouterr().err == ""
