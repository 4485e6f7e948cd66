"""Writing mechanisms as files: one URDF and one closures file each, and the published set."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from ..chain.formats.closures_file import closures_text
from ..chain.structure.description import Closures
from ..core.errors.checked import checked
from ..core.files import as_file_stem, write_files
from ..design.mechanism import Mechanism
from .assumed_masses import AssumedMasses
from .wrist_urdf import mechanism_urdf

_BESIDE = Path(__file__).parents[1] / "urdf"
#: Every published wrist, the prototype whole and its shoulder with the arm, the dummy's shoulder unit, and the devices
#: that the wrist is compared with: in a wheel within the package, else the repository's folder ``urdf``.
PUBLISHED = _BESIDE if _BESIDE.is_dir() else Path(__file__).parents[2] / "urdf"
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
    return write_files(folder, {f"{stem}.urdf": xml, f"{stem}.closures.toml": closures_beside(closures, stem)})[0]


@checked
def write_published_urdf(folder: str | PathLike[str]) -> list[Path]:
    """Write the files of :data:`PUBLISHED` to a folder and return the paths."""
    return write_files(folder, {path.name: path.read_text(encoding="utf-8") for path in sorted(PUBLISHED.iterdir())})


def closures_beside(closures: Closures, stem: str) -> str:
    """The closures file of ``stem.urdf``."""
    return closures_text(closures, f"What {stem}.urdf leaves out: its root, its loops, its roles. Written by exo_pin.")
