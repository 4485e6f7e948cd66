"""Files of a device for other programs, with the device file beside them that holds what their formats cannot say."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from ...chain import ClosedChain, Roles
from ...chain.formats.chain_writing import written_chain
from ...chain.formats.joint_data import joint_data
from ...chain.structure.description import Cable
from ...core.errors import InvalidInput, MissingExtra
from ...core.files import as_file_stem, require_ending, write_text
from ...core.files.atomic import is_stream, require_writable
from ...core.files.toml_tables import toml_text
from ...core.validation import FloatArray
from ...design import Mechanism
from ..chain_device import ChainDevice
from ..chain_roles import cables_of, is_same_arm
from ..device_model import device_model
from ..postures import closed_at_rest, configurations_of
from .device_files import ENDING, SCHEMA, read_device
from .device_writing import design_text, device_tables, device_text
from .robot_files import read_robot, robot_tables

#: Formats in which a device is saved, the first that holds its robot.
_SAVED = (".urdf", ".xml", ".sdf")
_MARK = "Written by exo_pin"
#: Data of joints that have to come back.
_OF_JOINTS = ("damping", "friction", "armature", "stiffness")
#: Coordinates, m and rad, that are zero.
_ZERO = 1e-12
#: Share of a mass or of a length of 1 m by which two files of one robot may differ.
_SAME = 1e-6


class Exported(list[Path]):
    """The files that an export has written, the robot's first.

    Attributes
    ----------
    beside : tuple of str
        What the robot's file alone cannot say, in words; the files beside it do.
    lost : tuple of str
        What is in no file.
    worn : dict
        Of a device on a person's model: the person's ``arm`` with what the device moves, and ``gravity`` in {O_A}, as
        arguments of ``exo.replace``.
    """

    def __init__(
        self,
        files: Iterable[Path] = (),
        beside: tuple[str, ...] = (),
        lost: tuple[str, ...] = (),
        worn: Mapping[str, Any] = MappingProxyType({}),
    ) -> None:
        super().__init__(files)
        self.beside, self.lost, self.worn = beside, lost, dict(worn)

    @property
    def statement(self) -> str:
        """What the robot's file alone lacks, and what is lost, in sentences; empty if nothing is."""
        parts = []
        if self.beside:
            held = " and ".join(file.name for file in self[1:]) + (" have" if len(self) > 2 else " has")
            parts.append(f"{self[0].name} alone lacks, and {held}: {'; '.join(self.beside)}.")
        if self.lost:
            parts.append(f"Lost, in no file: {'; '.join(self.lost)}.")
        return "\n".join(parts)


@dataclass(frozen=True, eq=False)
class DeviceFiles:
    """Texts of the files of a device.

    Attributes
    ----------
    texts : dict of str to str
        By what follows the stem of their names: ``.xml``, ``.device.toml``.
    beside, lost : tuple of str
        See :class:`Exported`.
    """

    texts: dict[str, str]
    beside: tuple[str, ...] = ()
    lost: tuple[str, ...] = ()

    def write(self, target: Path) -> Exported:
        """Write them beside each other, that of the robot as ``target``; to a stream the robot's alone."""
        require_writable(target)
        robot, *others = self.texts
        if is_stream(target):
            write_text(target, self.texts[robot])
            return Exported([target], (), (*self.beside, *self.lost))
        names = [target, *(target.with_suffix(ending) for ending in others)]
        for name, text in zip(names, self.texts.values(), strict=True):
            write_text(name, text)
        return Exported(names, self.beside, self.lost)


def files_of_device(device: ChainDevice, chain: ClosedChain, target: Path, ending: str) -> DeviceFiles:
    """The files of a device, checked: they are read back, and what comes back otherwise is ``lost``.

    Parameters
    ----------
    device : ChainDevice
        The device.
    chain : ClosedChain
        Its chain, with the arm of who wears it.
    target : Path
        The robot's file, after which the device file names it.
    ending : {".urdf", ".xml", ".sdf"}
        Of its format.

    Raises
    ------
    InvalidInput
        If the format has no joint for one of the device's, which the message names, or a spring has a law of its own
        kind.
    """
    if not np.isfinite(configurations_of(device, Rotation.identity())).all():
        raise InvalidInput(f"expected {device.name!r} to close with the arm hanging, which its files are written with")
    # Joints that settle are followed from here, and not from where they hang.
    q = closed_at_rest(device_model(device))
    cables = cables_of(device.drives, device.springs) if ending == ".xml" else ()
    native = type(chain)(chain.model, replace(chain.description, cables=cables))
    written = written_chain(native._state, ending, q)
    worn = device.replace(chain=chain)
    tables = robot_tables(chain, written.restated, ending, _rest(chain, q))
    text = device_text(worn, target.name, tables)
    text = text or toml_text({"schema": SCHEMA, "name": device.name, "robot": target.name})
    texts = written.texts | {ENDING: _headed(device.name, text)}
    beside = (*_of_parts(worn, ending, cables), *_of_gravity(tables), *written.lost)
    return DeviceFiles(texts, beside, _lost(worn, texts, target, ending))


def files_of_robot(chain: ClosedChain, ending: str) -> DeviceFiles:
    """The files of a robot that is no device, because its roles name no arm: what a device file would hold is lost."""
    with tempfile.TemporaryDirectory() as folder:
        {".urdf": chain.to_urdf, ".xml": chain.to_mjcf}.get(ending, chain.to_sdf)(folder)
        files = sorted(Path(folder).iterdir(), key=lambda file: file.suffix != ending)
        texts = {"".join(file.suffixes[-2:]): file.read_text(encoding="utf-8") for file in files}
    has_more = ending != ".urdf" and replace(chain.roles, actuated=()) != Roles()
    return DeviceFiles(texts, (), ("the roles of its parts",) if has_more else ())


def files_of_design(
    design: Mechanism, chain: ClosedChain, heavy: ClosedChain, target: Path, ending: str, urdf: Mapping[str, str]
) -> DeviceFiles:
    """The files of a wrist, whose device file holds its design.

    Parameters
    ----------
    design : Mechanism
        The design.
    chain, heavy : ClosedChain
        Its chain, as it is and with masses for simulators.
    target, ending
        As for :func:`files_of_device`.
    urdf : mapping of str to str
        Texts of URDF and closures file, by their endings, of the chain with masses.
    """
    real = {str(name): chain.model.inertias[chain.model.getJointId(name)] for name in list(chain.model.names)[1:]}
    q = heavy.close(heavy.reference_configuration())
    written = written_chain(heavy._state, ending, q, real)
    texts = dict(urdf) if ending == ".urdf" else dict(written.texts)
    tables = robot_tables(heavy, written.restated, ending, {})
    texts[ENDING] = _headed(design.name, design_text(design, target.name, tables))
    own = "the limits, actuators and stiffnesses of its limbs, and whose arm it is"
    beside = (own, *_of_gravity(tables), *written.lost)
    if ending != ".urdf":
        beside = ("which part is the arm, and the limbs", *beside)
    with tempfile.TemporaryDirectory() as folder:
        try:
            read = _read_back(folder, texts, target)
        except MissingExtra as error:
            return DeviceFiles(texts, beside, (f"not checked: {target.name}: {error}",))
        other = different_part(read, chain)
    return DeviceFiles(texts, beside, () if other is None else (other,))


def different_part(one: ClosedChain, other: ClosedChain) -> str | None:
    """The first joint or closure in which two chains of one robot differ, in words; None if they are the same."""
    names = [[str(name) for name in chain.model.names[1:]] for chain in (one, other)]
    if sorted(names[0]) != sorted(names[1]):
        return f"the joints {', '.join(sorted({*names[0]} ^ {*names[1]}))}"
    for name in names[0]:
        i, j = one.model.getJointId(name), other.model.getJointId(name)
        places = one.model.jointPlacements[i], other.model.jointPlacements[j]
        bodies = one.model.inertias[i], other.model.inertias[j]
        if not places[0].isApprox(places[1], _SAME):
            return f"the place of joint {name!r}"
        if np.abs(_ten(bodies[0]) - _ten(bodies[1])).max() > _SAME * max(bodies[1].mass, _SAME):
            return f"the mass of what joint {name!r} carries"
    loops = [{loop.name: loop for loop in chain.closures} for chain in (one, other)]
    if loops[0].keys() != loops[1].keys():
        return f"the closures {', '.join(sorted(loops[0].keys() ^ loops[1].keys()))}"
    for name, loop in loops[0].items():
        there = loops[1][name]
        apart = [
            np.abs(np.subtract(getattr(a, key), getattr(b, key))).max()
            for a, b in ((loop.placement_a, there.placement_a), (loop.placement_b, there.placement_b))
            for key in ("translation", "quaternion")
        ]
        if (loop.type, loop.frame_a, loop.frame_b) != (there.type, there.frame_a, there.frame_b) or max(apart) > _SAME:
            return f"the closure {name!r}"
    return None


def save_device(device: ChainDevice, chain: ClosedChain, path: str | PathLike[str]) -> list[Path]:
    """Save a device: its device file, and beside it the robot's, a URDF if it holds the robot, else an MJCF or SDF.

    Parameters
    ----------
    device, chain
        As for :func:`files_of_device`.
    path : path-like
        ``NAME.device.toml``, or ``NAME.toml``, which then names the device file.

    Returns
    -------
    list of Path
        What was written.

    Raises
    ------
    InvalidInput
        If no format holds the device, or a file beside ``path`` is there that is not of a device saved there before.
    """
    require_ending("the file", path, (".toml",))
    target = Path(path)
    require_writable(target)
    stem = as_file_stem(target.name.removesuffix(".toml").removesuffix(".device"))
    files, first = None, None
    for ending in _SAVED:
        try:
            files = files_of_device(device, chain, target.with_name(stem + ending), ending)
        except InvalidInput as error:
            first = first or error
            continue
        if not files.lost:
            break
        first = first or InvalidInput(f"{ending} does not hold {'; '.join(files.lost)} of {device.name!r}")
    if files is None or files.lost:
        assert first is not None
        raise first
    texts = {target.with_name(stem + key): text for key, text in files.texts.items()}
    if target.name != stem + ENDING:
        pointer = toml_text({"schema": SCHEMA, "device": stem + ENDING})
        texts[target] = f"# The device {device.name}. {_MARK}.\n{pointer}"
    return _write_together(texts, target)


def _write_together(texts: Mapping[Path, str], target: Path) -> list[Path]:
    """Write files of which none may be another's, that at ``target`` last; new ones go again if one cannot be written.

    Raises
    ------
    InvalidInput
        If a file is there that is not of a device that was saved at ``target`` before.
    """
    saved_before = target.exists() and _is_saved(target)
    there = [path for path in texts if path.exists()]
    for path in there:
        own = path == target or (saved_before and _MARK in path.read_text(encoding="utf-8", errors="replace"))
        if not own:
            raise InvalidInput(f"{path} is there, and is no part of a device that was saved as {target.name}: move it")
        require_writable(path)
    try:
        for path, text in sorted(texts.items(), key=lambda item: item[0] == target):
            write_text(path, text)
    except BaseException:
        for path in texts:
            if path not in there:
                with contextlib.suppress(OSError):
                    path.unlink()
        raise
    return list(texts)


def _is_saved(target: Path) -> bool:
    text = target.read_text(encoding="utf-8", errors="replace")
    return _MARK in text and (target.name.endswith(ENDING) or "\ndevice = " in text)


def _headed(name: str, text: str) -> str:
    return f"# What the robot's file leaves out of {' '.join(name.split())}. {_MARK}.\n{text}"


def _rest(chain: ClosedChain, q: FloatArray) -> dict[str, FloatArray]:
    """Coordinates at rest of joints that are not zero there."""
    neutral = chain.neutral()
    apart = {str(name): chain.configuration_slice(name) for name in list(chain.model.names)[1:]}
    return {name: q[own] for name, own in apart.items() if np.abs(q[own] - neutral[own]).max() > _ZERO}


def _of_parts(device: ChainDevice, ending: str, cables: tuple[Cable, ...]) -> list[str]:
    """What a robot's file has no words for, of the parts of a device, whose cables it has."""
    native = {own.name for own in cables}
    found = [] if ending == ".urdf" else ["which part is the arm, the shoulder and the cuff"]
    springs = [own.name for own in device.springs if own.name not in native]
    if springs:
        found.append(f"the springs {', '.join(springs)}")
    routed = [own.name for own in device.drives if own.route is not None]
    if routed and not native:
        found.append(f"the cables {', '.join(routed)}")
    if device.brakes:
        found.append(f"the brakes {', '.join(own.name for own in device.brakes)}")
    if len(routed) < len(device.drives):
        found.append("limits of the drives")
    soft = [key for key in ("cuff", "harness") if getattr(device.interfaces, key) is not None]
    soft += [own.link for own in device.soft_links]
    soft += ["shoulder"] if device.shoulder.stiffness is not None else []
    if soft:
        found.append(f"the stiffness of {', '.join(soft)}")
    if device.arm is not None and (device.arm.body_mass is not None or device.arm.wearer is not None):
        found.append("whose arm it is")
    return found


def _of_gravity(tables: Mapping[str, Any]) -> tuple[str, ...]:
    """What an SDF of a model lacks where the torso leans: gravity is its world's."""
    return ("the direction of gravity",) if "gravity_m_s2" in tables else ()


def _read_back(folder: str, texts: Mapping[str, str], target: Path) -> ClosedChain:
    """The chain of some files."""
    own = Path(folder) / target.name
    for key, text in texts.items():
        write_text(own.with_suffix(key), text)
    return read_robot(own, own.with_suffix(ENDING))


def _lost(device: ChainDevice, texts: Mapping[str, str], target: Path, ending: str) -> tuple[str, ...]:
    """In what the device differs that its files are read as."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            chain = _read_back(folder, texts, target.with_suffix(ending))
        except MissingExtra as error:
            return (f"not checked: {target.name}: {error}",)
        beside = (Path(folder) / target.name).with_suffix(ENDING)
        again = read_device(beside, chain, None)
    return tuple(_differences(device, again))


def _differences(one: ChainDevice, other: ChainDevice) -> list[str]:
    tables = device_tables(one), device_tables(other)
    keys = (tables[0].keys() | tables[1].keys()) - {"arm"}
    found = [key.replace("_", " ") for key in keys if tables[0].get(key) != tables[1].get(key)]
    if not is_same_arm(one.arm, other.arm):
        found.append("the arm")
    roles = one.chain.roles, other.chain.roles
    found += [f"the role {key}" for key, value in vars(roles[0]).items() if value != getattr(roles[1], key)]
    return sorted(found) + _different_joints(one.chain, other.chain)


def _different_joints(one: ClosedChain, other: ClosedChain) -> list[str]:
    """Joints that are gone, or have other data."""
    data = [
        dict(zip(map(str, chain.model.names), joint_data(chain.model, chain.description.joints), strict=True))
        for chain in (one, other)
    ]
    found = [f"joint {name!r}" for name in sorted(data[0].keys() ^ data[1].keys())]
    for name in sorted(data[0].keys() & data[1].keys()):
        a, b = data[0][name], data[1][name]
        unlike = [key for key in _OF_JOINTS if not np.allclose(getattr(a, key), getattr(b, key), rtol=1e-12, atol=0.0)]
        found += [f"{key} of joint {name!r}" for key in unlike]
    masses = [sum(inertia.mass for inertia in chain.model.inertias) for chain in (one, other)]
    if abs(masses[0] - masses[1]) > 1e-9 * masses[0]:
        found.append("masses of links")
    return found


def _ten(inertia: pin.Inertia) -> FloatArray:
    return np.concatenate([[inertia.mass], inertia.mass * inertia.lever, np.asarray(inertia.inertia).reshape(-1)])
