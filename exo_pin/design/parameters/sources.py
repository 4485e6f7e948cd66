"""Sources of a design whose parts are replaced: a citation must not vouch for other numbers."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np


def is_unchanged(mechanism: object, changes: Mapping[str, Any], key: str) -> bool:
    """Whether changes leave the value of a key such as ``limbs[0].stroke.end_fitting`` as it is."""
    first, *steps = re.findall(r"\w+", key)
    if first not in changes:
        return True
    here: Any = getattr(mechanism, first, None)
    there: Any = changes[first]
    for step in steps:
        if here is there:
            return True
        try:
            here, there = (item[int(step)] if step.isdigit() else getattr(item, step) for item in (here, there))
        except (AttributeError, IndexError, KeyError, TypeError, ValueError):
            return False
    return bool(np.array_equal(here, there))


def sources_after(sources: Mapping[str, str], changed: set[str]) -> dict[str, str]:
    """Sources of a mechanism some of whose parts have been replaced: a citation must not vouch for other numbers."""
    marked = {}
    for key, text in sources.items():
        part = re.split(r"[.\[]", key)[0]
        if part == "arm" and "arm" in changed:
            continue
        stale = part in changed or (key == "mechanism" and "geometry" in changed)
        marked[key] = f"changed from: {text}" if stale and not text.startswith("changed from: ") else text
    return marked
