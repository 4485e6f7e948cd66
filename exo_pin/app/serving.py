"""The server of the page, on this machine alone."""

from __future__ import annotations

import secrets
import signal
import threading
import warnings
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

from ..core.optional_packages import optional, require_extra
from ..view.page.browser import live_page, viewer_script
from ..view.page.live_server import free_socket
from .asked import Asked
from .guard import TokenGuard
from .pose_map import end_workers

#: Where the search for a free port starts.
FIRST_PORT = 7100
#: How long a page is kept for a browser that has lost its connection, s.
_AWAY = 60.0
#: Pages that are open at once.
_MOST_PAGES = 8


def serve_app(
    asked: Asked | None = None, port: int | None = None, opened: bool = False, said: Callable[[str], None] = print
) -> None:
    """Serve the page on 127.0.0.1 until the program is interrupted.

    Parameters
    ----------
    asked : Asked, optional
        The question that a new page begins with.
    port : int, optional
        First port to try, 7100 if left out; a used one moves on to the next, 0 takes any free one.
    opened : bool
        Whether to open the page in a browser.
    said : callable
        Gets the address, without whose token nobody can see the page.

    Raises
    ------
    MissingExtra
        If the extra ``app`` is not installed.
    InvalidInput
        If no port is free.
    """
    require_extra("app")
    token = secrets.token_urlsafe(18)
    listening = free_socket(FIRST_PORT if port is None else port)
    address = f"http://127.0.0.1:{listening.getsockname()[1]}/{token}/"
    # Threads share their filters: cautions stand in the answers.
    warnings.simplefilter("ignore")
    uvicorn = optional("app", "uvicorn")
    application = _application(Asked() if asked is None else asked, token)
    settings = uvicorn.Config(application, log_level="error", lifespan="on")
    said(f"{address} (Ctrl-C ends it)")
    if opened:
        webbrowser.open(address)
    with _ended_as_by_keys():
        uvicorn.Server(settings).run(sockets=[listening])


@contextmanager
def _ended_as_by_keys() -> Iterator[None]:
    """End the processes behind the page with its server, which a signal to terminate ends as Ctrl-C does."""
    is_main = threading.current_thread() is threading.main_thread()
    before = signal.signal(signal.SIGTERM, signal.default_int_handler) if is_main else None
    try:
        yield
    finally:
        end_workers()
        if is_main:
            signal.signal(signal.SIGTERM, before)


def _application(asked: Asked, token: str) -> TokenGuard:
    """Page, scenes and sockets behind a token."""
    nicegui, fastapi = optional("app", "nicegui"), optional("app", "fastapi")
    from .page.visit import Visit  # here, because its module needs the extra

    visits: set[Visit] = set()

    @nicegui.ui.page("/", title="exo_pin")
    def page() -> None:
        if len(visits) >= _MOST_PAGES:
            nicegui.ui.label(f"{_MOST_PAGES} pages are open already: close one, and load this again.")
            return
        visit = Visit(asked)
        visits.add(visit)

        def leave() -> None:
            visits.discard(visit)
            visit.close()

        nicegui.ui.context.client.on_delete(leave)

    answer, routing = optional("app", "starlette.responses").Response, optional("app", "starlette.routing")
    for path, text, kind in (("", live_page, "text/html"), ("viewer.js", viewer_script, "text/javascript")):
        give = partial(lambda text, kind, _: answer(text(), media_type=kind), text, kind)
        nicegui.app.routes.append(routing.Route(f"/scene/{{key}}/{path}", give))

    async def scene(websocket: Any) -> None:
        feeds = {key: feed for visit in visits for key, feed in visit.feeds.items()}
        feed = feeds.get(websocket.path_params["key"])
        if feed is None:
            await websocket.close(1008)
        else:
            await feed.serve(websocket)

    async def live(websocket: Any) -> None:
        for visit in visits:
            if secrets.compare_digest(visit.live.key.encode(), websocket.path_params["key"].encode()):
                await visit.live.serve(websocket)
                return
        await websocket.close(1008)

    nicegui.app.routes.append(routing.WebSocketRoute("/scene/{key}/socket", scene))
    nicegui.app.routes.append(routing.WebSocketRoute("/live/{key}", live))
    outer = fastapi.FastAPI(openapi_url=None)
    nicegui.ui.run_with(outer, mount_path=f"/{token}", show_welcome_message=False, reconnect_timeout=_AWAY)
    return TokenGuard(outer, token)
