"""From files to a Pinocchio tree and its closures."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

import numpy as np
import pinocchio as pin

from ..errors import FileFormatError, InvalidInput, UnknownName
from .closures import Closures
from .files import read_closures

__all__ = ["load_model"]

_ROOT_MODELS = {
    "spherical": pin.JointModelSpherical,
    "free_flyer": pin.JointModelFreeFlyer,
    "planar": pin.JointModelPlanar,
    "translation": pin.JointModelTranslation,
}


def load_model(
    urdf: str | PathLike[str], closures: Closures | str | PathLike[str] | None, root_joint: str | None
) -> tuple[pin.Model, Closures]:
    """See :meth:`ClosedChain.from_urdf`."""
    text, path = _urdf_text(urdf)
    if closures is None:
        if path is None:
            raise InvalidInput("expected closures, because the URDF is no file that they could stand beside")
        closures = path.with_suffix(".closures.toml")
    if not isinstance(closures, Closures):
        closures = read_closures(closures)
    root = closures.root
    hangs = root.joint if root_joint is None else root_joint
    if hangs != "fixed" and hangs not in _ROOT_MODELS:
        raise UnknownName("root joint", hangs, ("fixed", *_ROOT_MODELS))
    if "<mimic" in text:
        raise FileFormatError("mimic joints are not read; say what couples them as a closure", path)
    try:
        if hangs == "fixed":
            model = pin.buildModelFromXML(text)
        else:
            model = pin.buildModelFromXML(text, _ROOT_MODELS[hangs](), root.name)
    except (RuntimeError, ValueError) as error:
        raise FileFormatError(f"not a URDF that Pinocchio reads: {error}", path) from error
    model.gravity.linear = np.array(root.gravity)
    return model, closures


def _urdf_text(urdf: str | PathLike[str]) -> tuple[str, Path | None]:
    """The XML, and the file that it came from."""
    if isinstance(urdf, str) and urdf.lstrip().startswith("<"):
        return urdf, None
    try:
        return Path(urdf).read_text(encoding="utf-8"), Path(urdf)
    except (OSError, UnicodeDecodeError) as error:
        raise FileFormatError(f"cannot be read: {error}", urdf) from error
