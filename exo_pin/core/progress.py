"""Progress of long computations, shown when ``progress=True``."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from importlib import import_module
from typing import TypeVar

T = TypeVar("T")


def track(items: Sequence[T] | Iterable[T], what: str, show: bool, total: int | None = None) -> Iterator[T]:
    """Iterate over ``items``, with a bar on standard error if ``show``.

    Parameters
    ----------
    items : iterable
        What to iterate over.
    what : str
        Text before the bar.
    show : bool
        Whether to show it; never by itself.
    total : int, optional
        Number of items, if ``items`` has no length.
    """
    if not show:
        yield from items
        return
    # Imported by name, and only here: no other module uses it, and it has no types of its own.
    yield from import_module("tqdm").tqdm(items, desc=what, total=total, leave=False)
