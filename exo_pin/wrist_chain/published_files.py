"""Writing mechanisms as files: one URDF and one closures file each, and the set that comes with the repository."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from ..chain.formats.closures_file import closures_text
from ..chain.structure.description import Closures
from ..core.errors.checked import checked
from ..core.files import as_file_stem, write_files
from ..design.io.mechanism_files import preset, published
from ..design.mechanism import Mechanism
from .assumed_masses import AssumedMasses
from .devices import device_texts
from .wrist_urdf import dummy_shoulder_urdf, mechanism_urdf

#: Cables in place of limbs: a few grams, for simulators.
_CABLES = AssumedMasses(0.01, 0.01, base_half_radius=0.002, platform_half_radius=0.002, cross_mass=0.002)
_SUFFIX = {"whole": "", "wrist": "-wrist", "shoulder": "-shoulder", "floating": "-floating"}


@checked
def write_urdf(
    mechanism: Mechanism, folder: str | PathLike[str], part: str = "whole", assumed: AssumedMasses | None = None
) -> Path:
    """Write a mechanism's URDF and the closures file beside it.

    Each file appears whole or not at all, first the URDF, then the closures: if writing stops between the two, the
    URDF is new and the closures file is old.

    Parameters
    ----------
    mechanism : Mechanism
        The design; the files are called after it.
    folder : path-like
        Where to; made if it is not there.
    part : {"whole", "wrist", "shoulder", "floating"}
        See :func:`mechanism_urdf`.
    assumed : AssumedMasses, optional
        Masses for links that have none; simulators need them.

    Returns
    -------
    Path
        The URDF.

    Raises
    ------
    InvalidInput
        If the folder cannot be made, the mechanism's name is no file name, or for what :func:`mechanism_urdf`
        refuses.

    Examples
    --------
    >>> from exo_pin.wrist_chain import write_urdf
    >>> path = write_urdf(ep.load("prototype").mechanism, "robot", part="wrist")
    >>> exo = ep.ClosedChain.from_urdf(path)
    >>> exo.mobility(exo.close(exo.neutral())).degrees_of_freedom  # turns about O without a ball joint
    3
    """
    as_file_stem(mechanism.name)
    xml, closures = mechanism_urdf(mechanism, part, assumed)
    stem = f"{mechanism.name}{_SUFFIX[part]}"
    return write_files(folder, {f"{stem}.urdf": xml, f"{stem}.closures.toml": _closures_file(closures, stem)})[0]


def published_urdf() -> dict[str, str]:
    """The files of the repository's ``urdf`` folder, name to text.

    Every published wrist, the prototype whole and its shoulder with the arm, the dummy's shoulder unit, and the devices
    that the wrist is compared with, six cables among them.
    """
    assumed = AssumedMasses()
    prototype = preset("prototype")
    parts = {f"{name}-wrist": mechanism_urdf(preset(name), "wrist", assumed) for name in published()}
    parts["prototype"] = mechanism_urdf(prototype, "whole", assumed)
    parts["prototype-shoulder"] = mechanism_urdf(prototype, "shoulder")  # Table 5-4 gives all that it has
    parts["six-cables"] = mechanism_urdf(preset("six-cables"), "whole", _CABLES)
    parts["dummy-shoulder"] = dummy_shoulder_urdf(prototype.arm, assumed)
    texts: dict[str, str] = {}
    for stem, (xml, closures) in parts.items():
        texts[f"{stem}.urdf"] = xml
        texts[f"{stem}.closures.toml"] = _closures_file(closures, stem)
    return texts | device_texts()


@checked
def write_published_urdf(folder: str | PathLike[str]) -> list[Path]:
    """Write :func:`published_urdf` to a folder and return the paths."""
    return write_files(folder, published_urdf())


def _closures_file(closures: Closures, stem: str) -> str:
    return closures_text(closures, f"What {stem}.urdf leaves out: its root, its loops, its roles. Written by exo_pin.")
