"""The one gate of recordings: from a file to poses of the arm that a person's arm can have had."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from os import PathLike, fspath

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.conventions import as_side
from ...core.errors import FileFormatError
from ...core.errors.checked import checked
from ...core.files.toml_tables import naming_file, read_toml
from ...core.records import Record
from ...core.validation import FloatArray, as_choice, as_finite, as_mapping, as_positive, set_fields
from ..trajectories import Movement
from .angles import CONVENTIONS, Angles, angles_of, known_columns
from .bodies import ROLES, Bodies, bodies_of
from .plausibility import AS_NAMED, READINGS, Reading, doubt, evidence, of_orientations
from .sources import Source, open_source

#: Readings that change the clock: s in a unit of the record.
_CLOCKS = {"milliseconds": 1e-3, "seconds": 1.0}
_SCHEMA = 1
_HALF_TURN = Rotation.from_quat([0.0, 0.0, 1.0, 0.0])
#: Signs of angles by reading, and the conventions that have it.
_SIGNS = {
    "minus-flexion": ("clinical angles", (-1.0, 1.0, 1.0)),
    "minus-abduction": ("clinical angles", (1.0, -1.0, 1.0)),
    "minus-elevation": ("ISB angles", (1.0, -1.0, 1.0)),
}
#: Conventions whose angles are mistaken for each other.
_OTHER_ORDER = {"clinical angles": CONVENTIONS[1], "thesis angles (4-7)": CONVENTIONS[0]}


@checked
@dataclass(frozen=True)
class RecordingOptions(Record):
    """What a recording does not say itself, and how to read it if it says something else than it holds.

    Attributes
    ----------
    reading : str
        What holds in place of what the file says, with commas between: names of :data:`READINGS`, such as "w-first",
        as the message of a doubtful record suggests them; "as-named" takes a record as it is, whatever the doubts.
    columns : path-like or None
        TOML file with ``schema = 1`` and a table ``[columns]``: known names of columns, and how the file calls them
        (with a minus before it for the other sign), such as ``flexion_deg = "-LShoulderAngles.x"``.
    sensors : mapping of str to str
        Which sensor is on "trunk", "arm" and "forearm": its name in the file, or a file of its own.
    forward : str or None
        The axis of the trunk's sensor that points forward: "x", "-x", "y", "-y", "z" or "-z".
    still : float
        How long the arm hangs still at the start of a record of sensors, s.
    rate : float or None
        Samples a second, of a file that counts them.
    duration : float or None
        Of a movement whose times are percent, s.
    start : array_like or None
        Pose in which the record begins: flexion, abduction and internal rotation, degrees.

    Examples
    --------
    >>> quaternions = ep.load("prototype").pose(np.linspace(0, 60, 21)).as_quat()[:, [3, 0, 1, 2]]  # w, x, y, z
    >>> table = np.c_[np.arange(21) / 20, quaternions]
    >>> np.savetxt("arm.csv", table, delimiter=",", header="time_s,qx,qy,qz,qw", comments="")
    >>> try:
    ...     ep.read_movement("arm.csv")
    ... except ep.FileFormatError as error:
    ...     print("w-first" in str(error))
    True
    >>> len(ep.read_movement("arm.csv", reading=ep.RecordingOptions("w-first")).times)
    21
    """

    reading: str = ""
    columns: str | PathLike[str] | None = None
    sensors: Mapping[str, str] = field(default_factory=dict)
    forward: str | None = None
    still: float = 0.5
    rate: float | None = None
    duration: float | None = None
    start: ArrayLike | None = None

    def __post_init__(self) -> None:
        for name in self.names:
            as_choice("reading", name, (AS_NAMED, *READINGS))
        sensors = as_mapping("sensors", self.sensors, "sensors by role")
        for role in sensors:
            as_choice("role of a sensor", role, ROLES)
        set_fields(self, sensors={role: fspath(given) for role, given in sensors.items()})
        for name in ("still", "rate", "duration"):
            if getattr(self, name) is not None:
                set_fields(self, **{name: as_positive(name, getattr(self, name))})
        if self.start is not None:
            set_fields(self, start=tuple(as_finite("start", self.start, (3,)).tolist()))

    @property
    def names(self) -> tuple[str, ...]:
        """The readings one by one."""
        return tuple(name.strip() for name in self.reading.split(",") if name.strip())


class _Record:
    """A file with its orientations, in any reading.

    Attributes
    ----------
    convention : str
        How its columns give orientations.
    times : ndarray or None
        Shape (N,), s, NaN where blank.
    there : ndarray of bool
        Shape (N,), rows that have an orientation and a time.
    """

    def __init__(self, path: str | PathLike[str], side: str, options: RecordingOptions, timed: bool) -> None:
        self.side, self.options = side, options
        self.source = open_source(path)
        if options.columns is not None:
            self.source = self.source.renamed(_column_map(options.columns))
        self.angles: Angles | None = angles_of(self.source, side)
        # Sensors are set to zero while the arm hangs, for some time.
        timed = timed or (self.angles is None and bool(self.source.bodies()))
        self.times = self.source.times(options.rate, options.duration) if timed else None
        for name in options.names if timed else ():
            if name in _CLOCKS:
                known = self.source.clocks()
                if not known:
                    raise FileFormatError("has no column of times whose unit may be another", path)
                self.times = np.asarray(self.source.numbers(known[:1])[:, 0] * _CLOCKS[name])
        self.bodies: Bodies | None = None
        if self.angles is None and self.times is not None:
            self.bodies = bodies_of(self.source, self.times, side, options.sensors)
        if self.angles is not None:
            self.convention = self.angles.convention.name
            there = np.asarray(np.isfinite(self.angles.values).all(axis=1))
        elif self.bodies is not None:
            self.convention = "segments" if self.bodies.segments else "sensors"
            there = self.bodies.there()
        else:
            raise FileFormatError(
                f"expected one of these sets of columns: {known_columns()}; got {', '.join(self.source.labels)}: say "
                "which is which, columns=... (--columns FILE)",
                path,
            )
        self.there: np.ndarray = there if self.times is None else np.asarray(there & np.isfinite(self.times))

    def read(self, *names: str) -> Reading:
        """The rows that are there, in readings by name."""
        own = [name for name in names if name in self.alternatives()]
        read = self._plain(own)
        for name in own:
            if name in (turned := of_orientations(read.poses, self.side)):
                read = read._replace(poses=turned[name]())
            elif name == "turned-trunk":
                forearm = None if read.forearm is None else read.forearm * [-1.0, -1.0, 1.0]
                read = read._replace(poses=_HALF_TURN * read.poses * _HALF_TURN, forearm=forearm)
        return read

    def _plain(self, names: list[str]) -> Reading:
        if self.bodies is not None:
            assert self.times is not None
            bodies = self.bodies.w_last() if "w-last" in names else self.bodies
            return bodies.poses(self.times, self.there, self.side, self.options.forward, self.options.still)
        angles = self.angles
        assert angles is not None
        values, scale = angles.values, angles.scale
        if "w-first" in names:
            values = np.roll(values, -1, axis=1)
        for name in names:
            if name in _SIGNS:
                values = values * np.array(_SIGNS[name][1])
        if "other-order" in names:
            angles = replace(angles, convention=_OTHER_ORDER[angles.convention.name])
        scale = 1.0 if "radians" in names else np.pi / 180.0 if "degrees" in names else scale
        times = None if self.times is None else self.times[self.there]
        return Reading(replace(angles, values=values).poses(self.there, self.side, scale), times)

    def elbow(self, read: Reading) -> FloatArray | None:
        """Flexion of the elbow in the rows that are there, rad."""
        if read.forearm is not None:
            return np.asarray(np.arccos((-read.forearm[:, 2]).clip(-1.0, 1.0)))
        known = None if self.angles is None else self.angles.elbow
        return None if known is None else np.asarray(known[self.there])

    def alternatives(self) -> list[str]:
        """Readings that this file may have."""
        if self.bodies is not None:
            return ["w-last", "inverse", "other-side", *([] if self.bodies.segments else ["turned-trunk"])]
        assert self.angles is not None
        kind = self.angles.convention
        if not kind.angles:
            return ["w-first"] * (kind.name == "quaternions") + ["inverse", "other-side", "y-up", "t-pose"]
        names = ["radians" if self.angles.scale != 1.0 else "degrees"]
        names += ["other-order"] if kind.name in _OTHER_ORDER else []
        names += [name for name, (convention, _) in _SIGNS.items() if convention == kind.name]
        # Clinical angles and those of the ISB have the same signs on both sides.
        return [*names, "inverse", "t-pose", *(["other-side", "y-up"] if kind.name == CONVENTIONS[1].name else [])]

    def readings(self, is_movement: bool = True) -> dict[str, Callable[[], Reading | None]]:
        """The other readings; None for one that the file cannot have."""
        own = self.options.names

        def read(name: str, unit: float = 1.0) -> Reading | None:
            try:
                found = self.read(*own, name)
            except FileFormatError:
                return None
            return found._replace(times=found.times * unit if is_movement and found.times is not None else None)

        found: dict[str, Callable[[], Reading | None]] = {
            name: partial(read, name) for name in self.alternatives() if name not in own
        }
        if self.times is not None:
            found |= {"seconds": partial(read, "seconds", 1e3), "milliseconds": partial(read, "milliseconds", 1e-3)}
        return found

    def stated(self) -> Reading:
        """As the file names it; where that cannot be, the error names a reading in which an arm hangs first."""
        try:
            return self.read(*self.options.names)
        except FileFormatError as error:
            for name, make in self.readings().items():
                read = make()
                if read is not None and (own := evidence(read, self.side)).is_possible and own.hanging:
                    said = f"{str(error).removeprefix(f'{error.path}: ')}; or {READINGS[name]}"
                    raise FileFormatError(f'{said}: reading="{name}" (--reading {name})', error.path) from None
            raise


def _column_map(path: str | PathLike[str]) -> dict[str, str]:
    table = read_toml(path)
    table.require_schema(_SCHEMA)
    columns = table.mapping("columns")
    table.finish()
    if not columns:
        raise FileFormatError("expected a table [columns] with names of columns", path, "columns")
    return columns


@dataclass(frozen=True, eq=False)
class RecordedPoses(Record):
    """Poses of the arm from a file, checked against what an arm can do.

    Attributes
    ----------
    poses : Rotation
        Shape (N,), {O_B} to {O_A}.
    times : ndarray or None
        Shape (N,), s.
    elbow : ndarray or None
        Flexion of the elbow, shape (N,), rad, where the file has it.
    format, convention : str
        What the file is, and how it gives orientations.
    cautions : tuple of str
        Doubts, a sentence each.
    source : Source
        The file, for its other columns.
    rows : ndarray of bool
        Rows of the file that the poses are of.
    """

    poses: Rotation
    times: FloatArray | None
    elbow: FloatArray | None
    format: str
    convention: str
    cautions: tuple[str, ...]
    source: Source
    rows: np.ndarray


def read_poses(
    path: str | PathLike[str], side: str, options: RecordingOptions | str | None = None, movement: bool = True
) -> RecordedPoses:
    """Poses of a recording, with times if they are one movement.

    Raises
    ------
    FileFormatError
        As :func:`read_movement`; of poses that are no movement only what stands against their orientations.
    """
    wanted = options if isinstance(options, RecordingOptions) else RecordingOptions("" if options is None else options)
    record = _Record(path, as_side(side), wanted, movement)
    with naming_file(path):
        read = record.stated()
        poses, times = read.poses, read.times
        cautions = []
        lost = int((~record.there).sum())
        if lost:
            cautions.append(f"{lost} of {len(record.there)} rows have no orientation or no time and count as gaps.")
        if AS_NAMED not in wanted.names and len(poses) > 1:
            angles = None if wanted.start is None else np.radians(np.atleast_2d(wanted.start))
            start = None if angles is None else CONVENTIONS[0].build(angles, side)[0]
            stated = read if movement else read._replace(times=None)
            found = doubt(stated, side, record.readings(movement), start)
            if found is not None and found.is_refused and movement:
                raise FileFormatError(found.text, path)
            cautions += [] if found is None else [found.text]
        return RecordedPoses(
            poses, times, record.elbow(read), record.source.format, record.convention, tuple(cautions), record.source,
            record.there,
        )  # fmt: skip


def movement_cautions(movement: Movement, side: str) -> tuple[str, ...]:
    """Doubts about a movement on an arm of this side; those of its record where it was read for this side.

    Parameters
    ----------
    movement : Movement
    side : {"left", "right"}
        Of the device that is asked.
    """
    if movement.judged_for == side:
        return movement.pose_cautions
    others = {name: (lambda make=make: Reading(make())) for name, make in of_orientations(movement.poses, side).items()}
    found = doubt(Reading(movement.poses), side, others)
    if found is None or not found.readings:
        return movement.pose_cautions
    return (
        found.text.partition(" It fits")[0] + f" It fits an arm where {READINGS[found.readings[0]]}.",
        *movement.pose_cautions,
    )


def read_movement(
    path: str | PathLike[str],
    side: str = "left",
    smoothing: str | None = "gcv",
    sensor_noise: float | None = None,
    ends: str = "free",
    reading: RecordingOptions | str | None = None,
) -> Movement:
    """Read a movement of the arm from a recording, in any of the known formats.

    **CSV** in any dialect. A time and one of: ``flexion_deg, abduction_deg, internal_rotation_deg`` (clinical signs,
    :func:`exo_pin.shoulder_rotation`); ``theta_x_deg, theta_y_deg, theta_z_deg`` ((4-7),
    :func:`exo_pin.thesis_rotation`); ``plane_of_elevation_deg, elevation_deg, axial_rotation_deg`` (ISB,
    :func:`exo_pin.isb_rotation`); the same with ``_rad``; ``qx, qy, qz, qw``; or ``r11, r12, ..., r33`` ({O_B} to
    {O_A}). Their order is free, and other columns are not read. **OpenSim** ``.mot`` and ``.sto``, by the coordinates
    of Rajagopal's model, MoBL-ARMS and arm26. **Sensors and segments** on trunk and upper arm: MVNX, OpenSense
    ``.sto``, Xsens DOT and Awinda, APDM. **C3D** and other tables by a map of columns. With a forearm, or an angle of
    the elbow, the movement has :attr:`Movement.elbow_flexion`.

    The time is ``time_s``, ``time_ms``, ``time_us`` or ``time_ns``; or ``time``, ``timestamp`` or ``t``, whose cells
    show the unit: dates of ISO 8601, counts from 1970 (in s, ms, µs or ns), or else ms where rows are more than 1
    apart, and s where they are nearer. A row in which an angle or the time is blank or NaN is a gap;
    :attr:`Movement.cautions` names such rows.

    What the file says is held against what an arm can do: its range of motion on this side, its speed, where it starts.
    If the arm cannot have moved like this and another reading of the file fits, the error names that reading. Lesser
    doubts are cautions.

    Parameters
    ----------
    path : path-like
        The file.
    side : {"left", "right"}
        Side of the body: which arm of the file, and whose clinical angles.
    smoothing : {"gcv", None}
        As in :meth:`Movement.from_samples`: how much to smooth is found from the data, or nothing is smoothed.
    sensor_noise : float, optional
        Standard deviation of the samples about each axis, rad, if it is known.
    ends : {"free", "rest"}
        As in :meth:`Movement.from_samples`: "rest" where the arm is at rest at the first and at the last sample.
    reading : RecordingOptions or str, optional
        What the file does not say itself; a text is :attr:`RecordingOptions.reading`.

    Returns
    -------
    Movement

    Raises
    ------
    FileFormatError
        If the path is no regular file, nothing in it gives orientations or more than one set of columns does, a cell is
        text or infinite (the line is named), the samples are no movement, or no arm moves like this and another reading
        fits.

    Examples
    --------
    >>> rows = [(0.1 * k, 3.0 * k, 0.0, 0.0) for k in range(12)]  # 30°/s
    >>> head = "time_s,flexion_deg,abduction_deg,internal_rotation_deg"
    >>> np.savetxt("lift.csv", rows, delimiter=",", header=head, comments="")
    >>> movement = ep.read_movement("lift.csv", smoothing=None)
    >>> np.degrees(movement.motion.angular_velocity[5]).round(3)  # flexion turns about -y
    array([  0., -30.,   0.])
    """
    read = read_poses(path, side, reading)
    assert read.times is not None
    with naming_file(path):
        movement = Movement.from_samples(read.times, read.poses, smoothing, sensor_noise, ends)
    cautions = (*read.cautions, *movement.pose_cautions)
    return replace(movement, pose_cautions=cautions, judged_for=as_side(side), elbow_flexion=read.elbow)
