"""Chromium without a screen, through choreographer, with the options that drawing a scene needs."""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Sequence

# choreographer's logger reads the program's arguments when it is imported, and takes "--l" for its own.
_arguments, sys.argv = sys.argv, sys.argv[:1]
try:
    from choreographer import Browser
    from choreographer.browsers import Chromium
    from choreographer.errors import BrowserClosedError, BrowserFailedError, ChannelClosedError
finally:
    sys.argv = _arguments
# To end, choreographer writes "{bye}" into its own pipe. Read together with a last answer of the browser it is no JSON,
# which is ignored, and reported with a traceback.
logging.getLogger("choreographer.channels.pipe").setLevel(logging.CRITICAL)

__all__ = ["CHROMIUM_ERRORS", "chromium"]

#: What choreographer raises when the browser ends.
CHROMIUM_ERRORS = (BrowserClosedError, BrowserFailedError, ChannelClosedError)

#: WebGL is drawn in software, so that it works without a screen and a graphics card; no page uses the network.
_ADDED = ("--use-angle=swiftshader", "--disable-quic", "--disable-background-networking", "--hide-scrollbars")
#: Options of choreographer that let a page read other sites and files; no page here does.
_REMOVED = ("--disable-web-security", "--allow-file-access-from-files")


class _Chromium(Chromium):
    def get_cli(self) -> Sequence[str]:
        return [*(option for option in super().get_cli() if option not in _REMOVED), *_ADDED]


def chromium(program: str, folder: str) -> Browser:
    """A browser that is not open yet; ``folder`` gets its profile."""
    # The sandbox needs a user that root is not.
    sandbox = not (hasattr(os, "geteuid") and os.geteuid() == 0)
    return Browser(
        program, browser_cls=_Chromium, enable_sandbox=sandbox, enable_gpu=True, enable_extensions=False, tmp_dir=folder
    )
