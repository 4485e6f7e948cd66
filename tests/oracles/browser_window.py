"""A browser that a test asks what a page holds: Chromium through choreographer, with the options of drawing a scene."""

import asyncio
import base64
import contextlib
import logging
import os
import shutil
import sys
import tempfile
import threading
import time
from concurrent.futures import CancelledError
from pathlib import Path

from exo_pin.core.errors import BrowserFailed
from exo_pin.view import find_browser
from exo_pin.view.page.live_server import run_until_stopped

# choreographer's logger reads the program's arguments when it is imported, and takes "--l" for its own.
_arguments, sys.argv = sys.argv, sys.argv[:1]
try:
    import choreographer
    from choreographer.browsers import Chromium
    from choreographer.errors import BrowserClosedError, BrowserFailedError, ChannelClosedError
finally:
    sys.argv = _arguments
# To end, choreographer writes "{bye}" into its own pipe. Read together with a last answer of the browser it is no JSON,
# which is ignored, and reported with a traceback.
logging.getLogger("choreographer.channels.pipe").setLevel(logging.CRITICAL)

#: What choreographer raises when the browser ends; commands are cancelled then.
_ERRORS = (BrowserClosedError, BrowserFailedError, ChannelClosedError, CancelledError, OSError)
#: WebGL is drawn in software, so that it works without a screen and a graphics card; no page uses the network.
_ADDED = ("--use-angle=swiftshader", "--disable-quic", "--disable-background-networking", "--hide-scrollbars")
#: Options of choreographer that let a page read other sites and files; no page here does.
_REMOVED = ("--disable-web-security", "--allow-file-access-from-files")


class _Chromium(Chromium):
    def get_cli(self):
        return [*(option for option in super().get_cli() if option not in _REMOVED), *_ADDED]


class BrowserWindow:
    """A browser window without a screen, of a size in pixels. Use it in a ``with`` statement."""

    def __init__(self, size=(1280, 800), timeout=60.0):
        self._program, self._timeout = find_browser(), timeout
        self._folder = Path(tempfile.mkdtemp(prefix="exo_pin_browser_"))
        # A notebook has an event loop of its own in the main thread; the browser's runs in another thread.
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=run_until_stopped, args=(self._loop,), daemon=True)
        self._thread.start()
        self._browser = choreographer.Browser(
            self._program,
            browser_cls=_Chromium,
            # The sandbox needs a user that root is not.
            enable_sandbox=os.geteuid() != 0,
            enable_gpu=True,
            enable_extensions=False,
            tmp_dir=str(self._folder),
        )
        try:
            self._run(self._browser.open(), "the start")
            self._tab = self._browser.get_tab()
            self.resize(size)
        except BaseException:
            self.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def resize(self, size):
        """Give the page another width and height, pixels."""
        width, height = size
        self._command(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False
        )

    def open(self, url):
        """Open a page of a scene and wait until it is drawn."""
        self._command("Page.navigate", url=url)
        # All scripts have run, too: the first frame is drawn before the last one is read.
        self.wait_for("document.readyState === 'complete' && document.body.dataset.state !== undefined")
        if self.evaluate("document.body.dataset.state") == "failed":
            raise BrowserFailed(self._program, "it has no WebGL, so it cannot draw the scene")

    def open_html(self, html):
        """Open the text of a page, as a file."""
        path = self._folder / "scene.html"
        path.write_text(html, encoding="utf-8")
        self.open(path.as_uri())

    def evaluate(self, expression):
        """Value of a JavaScript expression in the page."""
        answer = self._command("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise BrowserFailed(self._program, str(answer["exceptionDetails"].get("exception", answer)))
        return answer["result"].get("value")

    def wait_for(self, condition):
        """Wait until a JavaScript expression is true."""
        end = time.monotonic() + self._timeout
        while not self.evaluate(f"Boolean({condition})"):
            if time.monotonic() > end:
                raise BrowserFailed(self._program, f"the page was not ready within {self._timeout:g} s")
            time.sleep(0.05)

    def screenshot(self):
        """The page as it looks now, PNG."""
        # Two frames on: what was set has been drawn by then.
        self.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))")
        return base64.b64decode(self._command("Page.captureScreenshot", format="png")["data"])

    def close(self):
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

    def _run(self, task, what):
        """Result of a coroutine of the browser's thread; ``what`` it does is for the message."""
        try:
            return asyncio.run_coroutine_threadsafe(asyncio.wait_for(task, self._timeout), self._loop).result()
        except TimeoutError:
            raise BrowserFailed(self._program, f"no answer to {what} within {self._timeout:g} s") from None
        except _ERRORS as error:
            raise BrowserFailed(self._program, f"it ended during {what}: {error}") from error

    def _command(self, method, **parameters):
        answer = self._run(self._tab.send_command(method, params=parameters), method)
        if "error" in answer:
            raise BrowserFailed(self._program, f"{method}: {answer['error'].get('message')}")
        return dict(answer["result"])
