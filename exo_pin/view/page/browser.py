"""Pictures through a headless browser, if there is one: Chromium or a relative, spoken to by its DevTools protocol."""

from __future__ import annotations

import asyncio
import base64
import json
import os
import shutil
import subprocess
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import TracebackType
from typing import Any

from tornado.websocket import WebSocketClientConnection, websocket_connect

from ...core.errors import BrowserFailed, BrowserNotFound, InvalidInput
from ...core.records import OneProcess

__all__ = ["BROWSERS", "BROWSER_VARIABLE", "Browser", "find_browser"]

#: Programs that are looked for, and the environment variable that names another one.
BROWSERS = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
    "microsoft-edge",
    "brave-browser",
)
BROWSER_VARIABLE = "EXO_PIN_BROWSER"

#: WebGL is drawn in software, so that it works without a screen and a graphics card; nothing is asked of a network.
_OPTIONS = (
    "--headless=new",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--no-default-browser-check",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-extensions",
    "--hide-scrollbars",
    "--disable-dev-shm-usage",
    "--remote-debugging-port=0",
)
_LARGEST_MESSAGE = 200 * 1024 * 1024


def find_browser(program: str | None = None) -> str:
    """Path of a browser that can draw without a screen.

    Parameters
    ----------
    program : str, optional
        Its name or path. Left out: what ``EXO_PIN_BROWSER`` names, else the first of :data:`BROWSERS` that is there.

    Raises
    ------
    BrowserNotFound
        If there is none.
    """
    named = program or os.environ.get(BROWSER_VARIABLE)
    for name in (named,) if named else BROWSERS:
        found = shutil.which(name)
        if found is not None:
            return found
    raise BrowserNotFound((named,) if named else BROWSERS, BROWSER_VARIABLE)


class Browser(OneProcess):
    """A browser window without a screen. Use it in a ``with`` statement.

    Parameters
    ----------
    size : (int, int)
        Width and height of the page, pixels.
    program : str, optional
        See :func:`find_browser`.
    timeout : float
        How long to wait for a page, s.

    Raises
    ------
    BrowserNotFound
        If there is no browser.
    BrowserFailed
        If it does not start.
    """

    def __init__(self, size: tuple[int, int] = (1280, 800), program: str | None = None, timeout: float = 60.0) -> None:
        width, height = (int(part) for part in size)
        if not (16 <= width <= 8192 and 16 <= height <= 8192):
            raise InvalidInput(f"expected a size of 16 to 8192 pixels each way, got {width} x {height}")
        self._program, self._timeout, self._size = find_browser(program), timeout, (width, height)
        self._folder = Path(tempfile.mkdtemp(prefix="exo_pin_browser_"))
        self._number = 0
        # Notebooks run a loop of their own in the main thread; this one has its own.
        self._pool = ThreadPoolExecutor(1)
        self._loop = asyncio.new_event_loop()
        # A sandbox needs a user that root is not.
        root = ["--no-sandbox"] if hasattr(os, "geteuid") and os.geteuid() == 0 else []
        command = [self._program, *_OPTIONS, *root, f"--user-data-dir={self._folder / 'profile'}", "about:blank"]
        self._socket: WebSocketClientConnection | None = None
        self._process: subprocess.Popen[bytes] | None = None
        try:
            self._process = subprocess.Popen(
                command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
            )
            self._socket = self._run(self._connect(self._process))
            self._command(
                "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False
            )
        except OSError as error:
            self.close()
            raise BrowserFailed(self._program, f"it does not start: {error}") from error
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Browser:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def open(self, url: str) -> None:
        """Open a page of a scene and wait until it is drawn."""
        self._command("Page.navigate", url=url)
        self.wait_for("document.body && document.body.dataset.state !== undefined")
        if self.evaluate("document.body.dataset.state") == "failed":
            raise BrowserFailed(self._program, "it has no WebGL, so it cannot draw the scene")

    def open_html(self, html: str) -> None:
        """Open the text of a page, as a file."""
        path = self._folder / "scene.html"
        path.write_text(html, encoding="utf-8")
        self.open(path.as_uri())

    def evaluate(self, expression: str) -> Any:
        """Value of a JavaScript expression in the page."""
        answer = self._command("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise BrowserFailed(self._program, str(answer["exceptionDetails"].get("exception", answer)))
        return answer["result"].get("value")

    def wait_for(self, condition: str) -> None:
        """Wait until a JavaScript expression is true."""
        end = time.monotonic() + self._timeout
        while not self.evaluate(f"Boolean({condition})"):
            if time.monotonic() > end:
                raise BrowserFailed(self._program, f"the page was not ready within {self._timeout:g} s")
            time.sleep(0.05)

    def screenshot(self) -> bytes:
        """The page as it looks now, PNG."""
        # Two frames on: what was set has been drawn by then.
        self.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))")
        return base64.b64decode(self._command("Page.captureScreenshot", format="png")["data"])

    def picture(self, html: str) -> bytes:
        """A still picture of a scene's page, without its controls, PNG."""
        self.open_html(html)
        self.evaluate("document.body.classList.add('still')")
        return self.screenshot()

    def close(self) -> None:
        """End the browser and remove its files."""
        if self._process is not None and self._process.poll() is None:
            self._process.terminate()
            try:
                self._process.wait(10)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        self._pool.submit(self._loop.close).result()
        self._pool.shutdown()
        shutil.rmtree(self._folder, ignore_errors=True)

    def _run(self, job: Any) -> Any:
        return self._pool.submit(self._loop.run_until_complete, job).result()

    async def _connect(self, process: subprocess.Popen[bytes]) -> WebSocketClientConnection:
        """Wait for the port that the browser has chosen, and take hold of its page."""
        told = self._folder / "profile" / "DevToolsActivePort"
        end = time.monotonic() + self._timeout
        while not (told.is_file() and len(told.read_text().splitlines()) >= 2):
            if process.poll() is not None:
                raise BrowserFailed(self._program, f"it ended with status {process.returncode}")
            if time.monotonic() > end:
                raise BrowserFailed(self._program, f"it did not start within {self._timeout:g} s")
            await asyncio.sleep(0.05)
        port, path = told.read_text().splitlines()[:2]
        browser = await websocket_connect(f"ws://127.0.0.1:{port}{path}", max_message_size=_LARGEST_MESSAGE)
        targets = await self._ask(browser, "Target.getTargets", {})
        page = next(target for target in targets["targetInfos"] if target["type"] == "page")
        browser.close()
        return await websocket_connect(
            f"ws://127.0.0.1:{port}/devtools/page/{page['targetId']}", max_message_size=_LARGEST_MESSAGE
        )

    def _command(self, method: str, **parameters: Any) -> dict[str, Any]:
        assert self._socket is not None
        return self._run(self._ask(self._socket, method, parameters))

    async def _ask(self, socket: WebSocketClientConnection, method: str, parameters: dict[str, Any]) -> dict[str, Any]:
        self._number += 1
        number = self._number
        await socket.write_message(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            try:
                text = await asyncio.wait_for(socket.read_message(), self._timeout)
            except TimeoutError:
                raise BrowserFailed(self._program, f"no answer to {method} within {self._timeout:g} s") from None
            if text is None:
                raise BrowserFailed(self._program, "it closed the connection")
            answer = json.loads(text)
            if answer.get("id") == number:
                if "error" in answer:
                    raise BrowserFailed(self._program, f"{method}: {answer['error'].get('message')}")
                return dict(answer["result"])
