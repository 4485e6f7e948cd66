"""Long computations: their progress, shown when ``progress=True``, and many tasks on any executor."""

from __future__ import annotations

import functools
import itertools
import os
import pickle
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any, TypeVar

from .errors import InvalidInput
from .validation import require_method

if TYPE_CHECKING:
    from concurrent.futures import Executor

T = TypeVar("T")
_Found = TypeVar("_Found")


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


def mapped(
    function: Callable[[T], _Found],
    tasks: Sequence[T],
    executor: Executor | None,
    what: str,
    progress: bool = False,
    block: int = 1,
) -> list[_Found]:
    """Results of a function of one argument, in the order of the tasks; the same wherever they are computed.

    Parameters
    ----------
    function : callable
        Of a module, so that other processes find it.
    tasks : sequence
        What it is called with, one after the other.
    executor : concurrent.futures.Executor or None
        Where: a pool of processes or threads, or that of Dask (``client.get_executor()``), of mpi4py
        (``MPIPoolExecutor``) or another; here if None.
    what : str
        Text before the progress bar.
    progress : bool
        Whether to show it.
    block : int
        Tasks that are sent at once: enough that sending them takes no time beside them.

    Raises
    ------
    InvalidInput
        If ``executor`` is none, a task cannot be sent to it, or it does not return one result a task.
    """
    if executor is None:
        return [function(task) for task in track(tasks, what, progress)]
    require_method("executor", executor, "map", "an executor of concurrent.futures")
    blocks = [tasks[first : first + block] for first in range(0, len(tasks), block)]
    if tasks:
        _require_picklable(tasks[0])
    sent = executor.map(functools.partial(_each, function), blocks)
    found = list(track(itertools.chain.from_iterable(sent), what, progress, total=len(tasks)))
    if len(found) != len(tasks):
        raise InvalidInput(
            f"expected an executor that gives a result for each of {len(tasks)} {what}, got {len(found)}: its map lost "
            "or repeated some"
        )
    return found


def _each(function: Callable[[T], _Found], tasks: Sequence[T]) -> list[_Found]:
    return [function(task) for task in tasks]


def _require_picklable(task: Any) -> None:
    try:
        pickle.dumps(task)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise InvalidInput(f"expected values and options that another process can be sent: {error}") from error


def end_with_parent() -> None:
    """End this process when the one that has started it ends, however that ends: one that is killed tells nobody."""
    threading.Thread(target=_wait_for_parent, name="exo_pin parent", daemon=True).start()


def _wait_for_parent() -> None:
    from multiprocessing import connection, parent_process  # here: they take time to import

    parent = parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os._exit(1)
