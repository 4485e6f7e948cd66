"""Pictures through a headless browser, if there is one: Chromium or a relative."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import os
import shutil
import tempfile
import threading
import time
from collections.abc import Coroutine
from concurrent.futures import CancelledError
from pathlib import Path
from typing import Any

from ...core.errors import BrowserFailed, BrowserNotFound, InvalidInput
from ...core.records import OneProcess

__all__ = ["BROWSERS", "BROWSER_VARIABLE", "Browser", "find_browser", "run_until_stopped"]

#: Names of browser programs, tried in this order, and the environment variable that names another one.
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
        width, height = _checked(size)
        self._program, self._timeout = find_browser(program), timeout
        # Imported when the first picture is made: pages and HTML files need no browser.
        from .chromium import CHROMIUM_ERRORS, chromium

        # choreographer cancels commands when the browser ends.
        self._errors = (*CHROMIUM_ERRORS, CancelledError, OSError)
        self._folder = Path(tempfile.mkdtemp(prefix="exo_pin_browser_"))
        # A notebook has an event loop of its own in the main thread; the browser's runs in another thread.
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=run_until_stopped, args=(self._loop,), daemon=True)
        self._thread.start()
        self._tab: Any = None
        self._browser = chromium(self._program, str(self._folder))
        try:
            self._run(self._browser.open(), "the start")
            self._tab = self._browser.get_tab()
            if self._tab is None:
                raise BrowserFailed(self._program, "it opened no page")
            self.resize((width, height))
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Browser:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def resize(self, size: tuple[int, int]) -> None:
        """Give the page another width and height, pixels."""
        width, height = _checked(size)
        self._command(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False
        )

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
        if not self._thread.is_alive():
            return
        try:
            with contextlib.suppress(BrowserFailed):  # it has ended already
                self._run(self._browser.close(), "closing")
        finally:
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join()
            shutil.rmtree(self._folder, ignore_errors=True)

    def _run(self, task: Coroutine[Any, Any, Any], what: str) -> Any:
        """Result of a coroutine of the browser's thread; ``what`` it does is for the message."""
        try:
            return asyncio.run_coroutine_threadsafe(asyncio.wait_for(task, self._timeout), self._loop).result()
        except TimeoutError:
            raise BrowserFailed(self._program, f"no answer to {what} within {self._timeout:g} s") from None
        except self._errors as error:
            raise BrowserFailed(self._program, f"it ended during {what}: {error}") from error

    def _command(self, method: str, **parameters: Any) -> dict[str, Any]:
        answer = self._run(self._tab.send_command(method, params=parameters), method)
        if "error" in answer:
            raise BrowserFailed(self._program, f"{method}: {answer['error'].get('message')}")
        return dict(answer["result"])


def _checked(size: tuple[int, int]) -> tuple[int, int]:
    width, height = (int(part) for part in size)
    if not (16 <= width <= 8192 and 16 <= height <= 8192):
        raise InvalidInput(f"expected a size of 16 to 8192 pixels each way, got {width} x {height}")
    return width, height


def run_until_stopped(loop: asyncio.AbstractEventLoop) -> None:
    """Run an event loop, and cancel what is left when it stops."""
    loop.run_forever()
    left = asyncio.all_tasks(loop)
    for task in left:
        task.cancel()
    if left:
        loop.run_until_complete(asyncio.gather(*left, return_exceptions=True))
    loop.close()
