"""Pictures of results, drawn by a room that stands above the results.

A result has a method ``plot`` because that is where a user looks for it. Its room knows nothing of pictures: the method
passes itself on by name.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any


def drawn(kind: str, *arguments: Any) -> Any:
    """The figure that :mod:`exo_pin.view.plots.answer_plots` makes.

    Parameters
    ----------
    kind : str
        Name of its function.
    *arguments
        Passed on.

    Raises
    ------
    MissingExtra
        If matplotlib is not installed.
    """
    return getattr(import_module("exo_pin.view.plots.answer_plots"), kind)(*arguments)
