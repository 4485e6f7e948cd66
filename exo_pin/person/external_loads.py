"""A device's wrenches along a movement as external loads for OpenSim.

OpenSim's tools take a table of forces, points and torques over time (``.sto``) and a file that says which body each
acts on (``.xml``). Its ground has x forward, y up and z to the right: a vector (x, y, z) of {O_A} is (x, z, -y) there.

The cuff's wrench acts on the humerus, about the origin of that body, which is the glenohumeral centre in the models of
Holzbaur, Saul and Seth. The harness's wrench acts on the torso, about the place of the glenohumeral centre at rest,
which the torso's frame of the model has to give.
"""

from __future__ import annotations

import io
from os import PathLike
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import InvalidInput
from ..core.errors.checked import checked
from ..core.files import write_text
from ..core.validation import FloatArray, as_finite, as_real, as_rising

#: From {O_A} to OpenSim's ground.
_TO_GROUND = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
_XML_VERSION = "40000"


@checked
def write_external_loads(
    path: str | PathLike[str],
    times: ArrayLike,
    cuff_wrench: ArrayLike,
    harness_wrench: ArrayLike | None = None,
    *,
    humerus: str = "humerus",
    torso: str = "thorax",
    centre_in_torso: ArrayLike | None = None,
) -> tuple[Path, Path]:
    """Write what a device does to arm and torso along a movement.

    Parameters
    ----------
    path : path-like
        The ``.xml`` file; the table goes beside it with the ending ``.sto``.
    times : array_like
        Shape (N,), s, rising.
    cuff_wrench : array_like
        On the arm, shape (N, 6): force, N, and moment about the glenohumeral centre, N m, {O_A}; ``cuff_wrench`` of a
        :class:`exo_pin.Reaction`, or ``device_wrench`` of a :class:`exo_pin.JointContact`.
    harness_wrench : array_like, optional
        On the torso, shape (N, 6), about O; ``harness_wrench`` of a Reaction.
    humerus, torso : str
        Names of the bodies in the OpenSim model.
    centre_in_torso : array_like, optional
        Place of the glenohumeral centre at rest in the torso's frame of the model, shape (3,), m; needed with
        ``harness_wrench``.

    Returns
    -------
    xml, sto : Path
        The files.

    Raises
    ------
    InvalidInput
        If the ending is another, times do not rise, shapes do not fit, or a wrench has no value at some time.

    Examples
    --------
    >>> from pathlib import Path
    >>> exo = ep.load("four-cables")
    >>> lift = ep.Movement.from_samples(np.linspace(0, 1, 6), exo.pose(np.linspace(20, 40, 6)), smoothing=None)
    >>> forces = exo.follow(lift).reaction
    >>> _ = ep.write_external_loads("device.xml", lift.times, forces.cuff_wrench)
    >>> len(Path("device.sto").read_text().splitlines()[-1].split())  # time, force, point and moment
    10
    """
    xml = Path(path)
    if xml.suffix.lower() != ".xml":
        raise InvalidInput(f"expected a file that ends in .xml, got {str(path)!r}")
    stamps = as_rising("times", times)
    loads = [("cuff", humerus, np.zeros(3), _in_ground("cuff_wrench", cuff_wrench, len(stamps)))]
    if harness_wrench is not None:
        if centre_in_torso is None:
            raise InvalidInput("harness_wrench needs centre_in_torso, the point about which its moments are given")
        point = as_finite("centre_in_torso", centre_in_torso, (3,))
        loads.append(("harness", torso, point, _in_ground("harness_wrench", harness_wrench, len(stamps))))
    sto = xml.with_suffix(".sto")
    write_text(sto, _table(stamps, loads))
    write_text(xml, _description(sto.name, loads))
    return xml, sto


def _in_ground(name: str, wrench: ArrayLike, count: int) -> FloatArray:
    """A wrench in OpenSim's axes, shape (N, 6)."""
    values = as_real(name, wrench)
    if values.shape != (count, 6):
        raise InvalidInput(f"expected {name} to have shape ({count}, 6), one row a time, got {values.shape}")
    lost = ~np.isfinite(values).all(axis=1)
    if lost.any():
        raise InvalidInput(
            f"{name} has no value at {int(lost.sum())} times, the first with index {int(np.argmax(lost))}: leave these "
            "times out, or change the movement or the device"
        )
    return np.concatenate([values[:, :3] @ _TO_GROUND.T, values[:, 3:] @ _TO_GROUND.T], axis=1)


def _table(times: FloatArray, loads: list[tuple[str, str, FloatArray, FloatArray]]) -> str:
    columns, names = [times], ["time"]
    for name, _, point, wrench in loads:
        for kind, values in (("force_v", wrench[:, :3]), ("force_p", np.tile(point, (len(times), 1)))):
            names += [f"{name}_{kind}{axis}" for axis in "xyz"]
            columns += list(values.T)
        names += [f"{name}_torque_{axis}" for axis in "xyz"]
        columns += list(wrench[:, 3:].T)
    text = io.StringIO()
    text.write(f"external loads\nversion=1\nnRows={len(times)}\nnColumns={len(names)}\ninDegrees=no\nendheader\n")
    text.write("\t".join(names) + "\n")
    np.savetxt(text, np.stack(columns, axis=1), fmt="%.17g", delimiter="\t")
    return text.getvalue()


def _description(table: str, loads: list[tuple[str, str, FloatArray, FloatArray]]) -> str:
    document = ET.Element("OpenSimDocument", Version=_XML_VERSION)
    group = ET.SubElement(document, "ExternalLoads", name="device")
    objects = ET.SubElement(group, "objects")
    for name, body, _, _ in loads:
        force = ET.SubElement(objects, "ExternalForce", name=name)
        for tag, text in (
            ("applied_to_body", body),
            ("force_expressed_in_body", "ground"),
            ("point_expressed_in_body", body),
            ("force_identifier", f"{name}_force_v"),
            ("point_identifier", f"{name}_force_p"),
            ("torque_identifier", f"{name}_torque_"),
        ):
            ET.SubElement(force, tag).text = text
    ET.SubElement(group, "datafile").text = table
    ET.indent(document)
    return '<?xml version="1.0" encoding="UTF-8" ?>\n' + ET.tostring(document, encoding="unicode") + "\n"
