"""Parts that the page is made of."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from typing import Any

from nicegui import ui


def tag(name: str, text: str) -> Any:
    """An element with a text."""
    with ui.element(name) as made:
        ui.html(escape(text), sanitize=False, tag="span")
    return made


def card(classes: str = "") -> Any:
    """A card of the page."""
    return ui.element("section").classes(f"card {classes}")


def choice(label: str, options: dict[str, str], value: str, change: Callable[[str], None]) -> Any:
    """A list to choose from; ``options`` are texts by value."""
    made = ui.select(options, label=label, value=value, on_change=lambda event: change(event.value))
    return made.props("dense outlined options-dense")


def reveal(strip: Any) -> None:
    """Show a part of the page, and scroll to it."""
    strip.set_visibility(True)
    ui.run_javascript(f"getHtmlElement({strip.id}).scrollIntoView({{block: 'nearest'}})")


class Slider(ui.slider):
    """A slider that leads: what the server has heard of it so far does not put it back while keys move it on."""

    LOOPBACK = False
