"""The page of ``exo-pin app`` in a browser without a screen, used as a person uses it: by keys and clicks."""

import json
import os
import re
import subprocess
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path

from browser_window import BrowserWindow
from process_tree import children, lives, wait_until

_CALL = "import sys; from exo_pin.cli import main; sys.exit(main(sys.argv[1:]))"
REPOSITORY = Path(__file__).parents[2]
_KEYS = {"ArrowRight": 39, "ArrowLeft": 37, "ArrowDown": 40, "Enter": 13, "Tab": 9, "Home": 36, "End": 35}

#: What is said of compiling, and where a busy machine takes long to end a page whose tasks are all done: none is named.
_HARMLESS = re.compile(r"compiling, once|Could not cancel \d+ tasks within timeout: $")


@contextmanager
def served(*arguments):
    """Address of the page, which a process of its own serves; what it says of errors has to be nothing."""
    with tempfile.TemporaryFile("w+") as errors:
        path = os.pathsep.join([str(REPOSITORY), *sys.path])
        # As users run it: what is not compiled yet is not waited for.
        around = {name: value for name, value in os.environ.items() if name != "EXO_PIN_COMPILE"}
        process = subprocess.Popen(
            [sys.executable, "-u", "-c", _CALL, "app", "--port", "0", *arguments],
            stdout=subprocess.PIPE, stderr=errors, text=True, env=around | {"PYTHONPATH": path},
        )  # fmt: skip
        try:
            said = process.stdout.readline()
            if not said:
                errors.seek(0)
                raise RuntimeError(errors.read())
            yield said.split()[0]
        finally:
            started = children(process.pid)
            process.terminate()
            process.wait(60)
            process.stdout.close()
            errors.seek(0)
            said = [line for line in errors.read().splitlines() if not _HARMLESS.search(line)]
            # Beside another failure it may be the reason.
            print(*said, sep="\n")
        wait_until(lambda: not any(map(lives, started)))
        assert said == []


class AppWindow(BrowserWindow):
    """A browser that has the page open."""

    def open(self, url):
        """Open the page, and wait for its answer and its picture."""
        self._command("Page.navigate", url=url)
        self.wait_for("document.querySelector('[data-moving=no]')")
        self.wait_for("document.querySelector('.scene iframe').contentDocument.body.dataset.state === 'drawn'")

    def text(self, selector):
        """What an element says."""
        return self.evaluate(f"document.querySelector({json.dumps(selector)}).innerText")

    def settled(self, condition):
        """Wait until the full answer is shown, and something of it is true."""
        self.wait_for(f"document.querySelector('[data-moving=no]') && ({condition})")

    def focus(self, selector):
        """Move the keyboard to an element."""
        self.evaluate(f"document.querySelector({json.dumps(selector)}).focus()")

    def downloads_to(self, folder):
        """Keep what the page gives."""
        self._command("Page.setDownloadBehavior", behavior="allow", downloadPath=str(folder))

    def give(self, selector, path):
        """Choose a file for an input of the page."""
        found = self._command("Runtime.evaluate", expression=f"document.querySelector({json.dumps(selector)})")
        self._command("DOM.setFileInputFiles", files=[str(path)], objectId=found["result"]["objectId"])

    def press(self, key, times=1):
        """Press a key."""
        for _ in range(times):
            for kind in ("keyDown", "keyUp"):
                self._command(
                    "Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=_KEYS[key]
                )  # fmt: skip

    def write(self, selector, text):
        """Put the keyboard into a box and write over what it holds."""
        self.focus(selector)
        self.evaluate(f"document.querySelector({json.dumps(selector)}).select()")
        self._command("Input.insertText", text=text)

    def choose(self, label, option):
        """Choose an option of a list."""
        self.click(f"[aria-label={json.dumps(label)}]")
        item = (
            f"[...document.querySelectorAll('.q-menu .q-item')].find((each) => each.innerText === {json.dumps(option)})"
        )
        self.wait_for(item)
        self.evaluate(f"{item}.click()")

    def click(self, selector):
        """Click on an element's middle."""
        self.evaluate(f"document.querySelector({json.dumps(selector)}).scrollIntoView({{block: 'center'}})")
        self.drag(selector, (0, 0))

    def drag(self, selector, by, steps=1):
        """Press on an element's middle, move by so many pixels, and let go."""
        x, y = self.evaluate(
            f"(() => {{ const b = document.querySelector({json.dumps(selector)}).getBoundingClientRect();"
            "return [b.left + b.width / 2, b.top + b.height / 2]; })()"
        )
        self.drag_from(x, y, by, steps)

    def drag_from(self, x, y, by, steps=1):
        """Press at a place, move by so many pixels, and let go."""
        self._mouse("mousePressed", x, y)
        for k in range(1, steps + 1):
            self._mouse("mouseMoved", x + by[0] * k / steps, y + by[1] * k / steps)
        self._mouse("mouseReleased", x + by[0], y + by[1])

    def _mouse(self, kind, x, y):
        self._command("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)
