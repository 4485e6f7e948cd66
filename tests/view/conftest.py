"""A headless browser for tests of the page."""

import pytest
from browser_window import BrowserWindow
from page_pictures import SIZE

from exo_pin.core.errors import BrowserNotFound
from exo_pin.view import find_browser


@pytest.fixture(scope="session")
def needs_browser():
    """Skip where no headless browser is installed."""
    try:
        find_browser()
    except BrowserNotFound as missing:
        pytest.skip(str(missing))


@pytest.fixture(scope="module")
def browser(needs_browser):
    """One browser for the tests of a file."""
    with BrowserWindow(SIZE) as window:
        yield window
