"""What a study searches, in words and digests, to tell it from others."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from ...design.io.mechanism_files import mechanism_table
from .merit import Merit
from .search_poses import Centre, described


def study_description(
    merit: Merit, objectives: tuple[str, ...], seed: int, run_length: int, refine: bool, centres: tuple[Centre, ...]
) -> dict[str, Any]:
    """What a study searches, to tell it from others."""
    space = merit.variables
    # Its title and sources say where numbers are from; the search does not depend on them.
    design = mechanism_table(space.mechanism.replace(title="", sources={}))
    text = {
        "objectives": objectives,
        "fit_strokes": merit.fit_strokes,
        "data of the design": _digest(design),
        "data of the poses": _digest([merit.poses.poses.as_matrix().tolist(), merit.poses.weights.tolist()]),
        "design": space.mechanism.name,
        "limbs": space.mechanism.limb_count,
        "variables": dict(zip(space.names, space.bounds.tolist(), strict=True)),
        "poses": len(merit.poses.weights),
        "criteria": repr(merit.criteria),
        "seed": seed,
        "run_length": run_length,
        "start": space.of_design() if refine else "random",
    }
    if space.by_geometry:
        text["cuff"] = "by geometry"
    if centres != (None,):
        text["centre_offset"] = [described(centre) for centre in centres]
    return text if merit.contact is None else {**text, "contact": merit.contact.description()}


def _digest(data: Any) -> str:
    """A short text that other data do not have."""
    return hashlib.sha256(repr(_rounded(data)).encode()).hexdigest()[:12]


def _rounded(data: Any) -> Any:
    """The same to nine decimals, which computers agree on."""
    if isinstance(data, Mapping):
        return {key: _rounded(value) for key, value in data.items()}
    if isinstance(data, list | tuple | np.ndarray):
        return [_rounded(value) for value in data]
    # + 0.0, so that no -0.0 differs from 0.0.
    return round(float(data), 9) + 0.0 if isinstance(data, float) else data
