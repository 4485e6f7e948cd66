"""Load a device: a preset, a design file, or the file of a robot."""

from __future__ import annotations

from collections.abc import Iterable
from os import PathLike, fspath

from ..core.conventions import as_side
from ..core.errors import InvalidInput, UnknownName
from ..core.errors.base import echo
from ..design import preset, presets, read_mechanism
from ..device.files.device_files import device_file_at, device_file_of, is_device_file, robot_of
from ..device.files.robot_files import read_robot
from .shoulder_exo import ShoulderExo


def _load_robot(robot: str, side: str | None, leave_out: Iterable[str], device_file: str | None = None) -> ShoulderExo:
    """A device from a robot's file, with the device file beside it if there is one."""
    beside = device_file_of(robot) if device_file is None else device_file
    chain = read_robot(robot, beside, leave_out)
    exo = ShoulderExo.from_chain(chain, None, robot if robot.endswith(".urdf") else None, beside)
    return exo if side is None or as_side(side) == exo.side else exo.mirrored()


_ROBOTS = (".urdf", ".xml", ".sdf")


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
    elif text.endswith(".toml") and is_device_file(text):
        found = fspath(device_file_at(text))
        return _load_robot(fspath(robot_of(found)), side, leave_out, found)
    elif text.endswith(".toml"):
        mechanism = read_mechanism(text)
    elif text.endswith(_ROBOTS):
        return _load_robot(text, side, leave_out)
    else:
        raise UnknownName("preset, .toml, .urdf, .xml (MJCF) or .sdf file", text, presets())
    return ShoulderExo.from_mechanism(mechanism if side is None else mechanism.on_side(side))
