"""The picture of the page of exo-pin app, by a headless browser (python docs/scripts/app_picture.py FILE)."""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "oracles"))

from app_window import AppWindow, served

#: Pixels of the page.
SIZE = (1280, 1000)

#: What it is asked.
ASKED = "four-linear-actuators-worn --person 1.60,55,female --payload 1 --flexion 60 --abduction 20"


def main() -> None:
    """Write the picture to the file that is named."""
    with served(*ASKED.split()) as url, AppWindow(SIZE) as window:
        window.open(url)
        # The map is a canvas, which does not say when it is complete.
        time.sleep(25.0)
        Path(sys.argv[1]).write_bytes(window.screenshot())


if __name__ == "__main__":
    main()
