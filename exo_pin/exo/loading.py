"""Load a device: a preset, a design file, or the file of a robot."""

from __future__ import annotations

from collections.abc import Iterable
from os import PathLike, fspath
from typing import Any

from ..chain import ClosedChain
from ..core.conventions import as_side
from ..core.errors import InvalidInput, UnknownName
from ..core.errors.base import echo
from ..design import preset, presets, read_mechanism
from ..device.files.device_files import device_file_of, robot_of, roles_of
from .shoulder_exo import ShoulderExo


def _load_robot(robot: str, side: str | None, leave_out: Iterable[str], device_file: str | None = None) -> ShoulderExo:
    """A device from a robot's file, with the device file beside it if there is one."""
    beside = device_file_of(robot) if device_file is None else device_file
    named = None if beside is None else roles_of(beside)
    # Which joints of an SDF close its loops is its reader's choice; the arm hangs on the shoulder's.
    more = {"first_joint": named.shoulder} if named is not None and robot.endswith(".sdf") else {}
    chain = _ROBOTS[robot[robot.rindex(".") :]](robot, leave_out=leave_out, **more)
    exo = ShoulderExo.from_chain(chain, None, robot if robot.endswith(".urdf") else None, beside)
    return exo if side is None or as_side(side) == exo.side else exo.mirrored()


_ROBOTS: dict[str, Any] = {".urdf": ClosedChain.from_urdf, ".xml": ClosedChain.from_mjcf, ".sdf": ClosedChain.from_sdf}


def load(source: str | PathLike[str], side: str | None = None, leave_out: Iterable[str] = ()) -> ShoulderExo:
    """Load a design.

    Parameters
    ----------
    source : str or path-like
        Name of a preset (:func:`exo_pin.presets`), path of a ``.toml`` file, or of a robot: a ``.urdf`` file with its
        closures file beside it, an MJCF ``.xml`` or an ``.sdf``, and its ``.device.toml`` with springs, cables and
        roles; see :meth:`ShoulderExo.from_chain` and :mod:`exo_pin.device.files.device_files`.
    side : {"left", "right"}, optional
        The side of the body to wear it on; the other side is the mirror image. As written in the file if left out:
        all presets are left, and so is a robot whose device file does not say ``side = "right"``. Of such a robot,
        "right" is the mirror image; for one that was built as a right one give it a device file, or use
        :meth:`ShoulderExo.from_chain`.
    leave_out : iterable of str
        Of a robot, what to leave out of its file; see :meth:`ClosedChain.from_mjcf`.

    Returns
    -------
    ShoulderExo

    Raises
    ------
    UnknownName
        If there is no such preset or file; the message lists the presets.
    FileFormatError
        If the file has an unknown, missing or wrong key.

    Examples
    --------
    >>> exo = ep.load("prototype")
    >>> round(float(exo.arm.mass), 3)  # kg, the moving part of the device
    0.657
    """
    if not isinstance(source, (str, PathLike)):
        raise InvalidInput(f"expected the name of a preset or the path of a .toml file, got {echo(source)}")
    text = fspath(source)
    if text in presets():
        mechanism = preset(text)
    elif text.endswith(".device.toml"):
        return _load_robot(fspath(robot_of(text)), side, leave_out, text)
    elif text.endswith(".toml"):
        mechanism = read_mechanism(text)
    elif text.endswith(tuple(_ROBOTS)):
        return _load_robot(text, side, leave_out)
    else:
        raise UnknownName("preset, .toml, .urdf, .xml (MJCF) or .sdf file", text, presets())
    return ShoulderExo.from_mechanism(mechanism if side is None else mechanism.on_side(side))
