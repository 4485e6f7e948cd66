"""Load a device: a preset, a design file, the file of a robot; or devices from the rows of a table."""

from __future__ import annotations

from collections.abc import Iterable
from os import PathLike, fspath, path
from typing import Any

from ..core.conventions import as_side
from ..core.errors import ExoPinError, FileFormatError, InvalidInput, UnknownName
from ..core.errors.base import echo
from ..core.files.csv_tables import read_csv
from ..design.io.mechanism_files import preset, presets
from ..design.parameters.names import values_of
from ..device.files.device_files import device_file_at, device_file_of, is_device_file, read_design, robot_of
from ..device.files.robot_files import read_robot
from ..muscle import muscle_model
from .shoulder_exo import ShoulderExo


def _load_robot(robot: str, side: str | None, leave_out: Iterable[str], device_file: str | None = None) -> ShoulderExo:
    """A device from a robot's file, with the device file beside it if there is one."""
    beside = device_file_of(robot) if device_file is None else device_file
    chain = read_robot(robot, beside, leave_out)
    exo = ShoulderExo.from_chain(chain, None, robot if robot.endswith(".urdf") else None, beside)
    return exo if side is None or as_side(side) == exo.side else exo.mirrored()


_ROBOTS = (".urdf", ".xml", ".sdf")
#: Columns that are no parameters.
_DESIGN, _NAME = "design", "name"


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
    if leave_out and not (text.endswith(_ROBOTS) or (text.endswith(".toml") and is_device_file(text))):
        raise InvalidInput(f"expected leave_out with a robot's file, got {', '.join(leave_out)} with {text}")
    if text in presets():
        exo = ShoulderExo.from_mechanism(preset(text))
    elif text.endswith(".toml") and is_device_file(text):
        found = fspath(device_file_at(text))
        return _load_robot(fspath(robot_of(found)), side, leave_out, found)
    elif text.endswith(".toml"):
        exo = load_design(text)
    elif text.endswith(_ROBOTS):
        return _load_robot(text, side, leave_out)
    else:
        raise UnknownName("preset, .toml, .urdf, .xml (MJCF) or .sdf file", text, presets())
    for each in exo.device.drives:
        # A law that cannot be read is refused here and not at the first question.
        driven = each.actuator and (each.actuator.tackle or each.actuator)
        if driven is not None and driven.force_law is not None:
            muscle_model(driven.force_law)
    return exo if side is None or as_side(side) == exo.side else exo.mirrored()


def load_design(path: str | PathLike[str]) -> ShoulderExo:
    """The design of a file that points to no other one."""
    mechanism, springs = read_design(path)
    exo = ShoulderExo.from_mechanism(mechanism)
    return exo.replace(springs=springs) if springs else exo


def load_designs(table: str | PathLike[str], side: str | None = None) -> tuple[ShoulderExo, ...]:
    r"""Designs of any kind from the rows of a CSV file, such as for :func:`exo_pin.study.compare`.

    Parameters
    ----------
    table : str or path-like
        The file. Its column ``design`` names a preset or a file, as :func:`exo_pin.load` takes it, seen from the
        table's folder; ``name`` is what the design is called, if there is such a column. All others are parameters, in
        the language of :func:`exo_pin.sweep` (``r_A_mm``, ``end_b[limb_1_base].x_mm``); a blank cell leaves the value
        of the design.
    side : {"left", "right"}, optional
        As of :func:`exo_pin.load`.

    Returns
    -------
    tuple of ShoulderExo
        One a row. Without a name of its own a design is called after its file and what is changed.

    Raises
    ------
    FileFormatError
        If there is no column ``design`` or no row, or a row does not make a design; the message names its line.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> table = Path(tempfile.mkdtemp(), "designs.csv")
    >>> _ = table.write_text("design,cuff_height_mm\nfour-cables,\nfour-cables,200\n")
    >>> designs = ep.load_designs(table)
    >>> [exo.name for exo in designs]
    ['four-cables', 'four-cables cuff_height_mm=200']
    >>> ep.study.compare(*designs, poses=designs[0].pose([0, 30, 60]))["can_hold"]
    array([1., 1.])
    """
    given = read_csv(table)
    if _DESIGN not in given.columns:
        raise FileFormatError(f"expected a column {_DESIGN!r}; the header has {', '.join(given.columns)}", table)
    if not given.rows:
        raise FileFormatError("expected at least one row", table)
    found = []
    for line, cells in zip(given.lines, given.rows, strict=True):
        row = dict(zip(given.columns, cells, strict=True))
        try:
            found.append(_designed(row, path.dirname(fspath(table)), side))
        except ExoPinError as error:
            raise FileFormatError(f"line {line}: {error}", table) from error
    return tuple(found)


def _designed(row: dict[str, str], folder: str, side: str | None) -> ShoulderExo:
    source, name = row.pop(_DESIGN), row.pop(_NAME, "")
    exo = load(source if source in presets() else path.join(folder, source), side)
    asked = {key: text for key, text in row.items() if text}
    values: dict[Any, Any] = {}
    for named, text in zip(exo.device.parameters(asked), asked.values(), strict=True):
        each = values_of(named, text)
        if len(each) != 1:
            raise InvalidInput(f"expected one value of {named.name}, got {text!r}")
        values[named] = named.in_si(each[0])
    words = " ".join((exo.name, *(f"{key}={text}" for key, text in asked.items())))
    if not values and not name:
        return exo
    return ShoulderExo.from_device(exo.device.with_values(values).replace(name=name or words))
