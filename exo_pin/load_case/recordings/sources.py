"""Files of recordings as columns of numbers by name, whatever program wrote them.

* tables: CSV in any dialect, OpenSim ``.mot`` and ``.sto``, OpenSense ``.sto``, Xsens DOT, Awinda and APDM exports;
* MVNX: orientations of all segments, frames of type "normal";
* C3D: points and rotations, with the package ezc3d.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from os import PathLike, fspath
from xml.etree import ElementTree as ET

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.errors import FileFormatError
from ...core.errors.base import echo
from ...core.files.atomic import read_file
from ...core.files.csv_tables import NO_NUMBER, CsvTable
from ...core.files.dialects import Layout, read_layout
from ...core.optional_packages import optional
from ...core.records import Record
from ...core.validation import FloatArray

#: Units of columns, as they are written and as names end in them; others are not looked at.
_UNITS = {"s": "s", "sec": "s", "second": "s", "seconds": "s", "ms": "ms", "us": "us", "µs": "us", "μs": "us"}
_UNITS |= {"ns": "ns", "deg": "deg", "degree": "deg", "degrees": "deg", "°": "deg", "rad": "rad", "radians": "rad"}
#: How the parts of an orientation are named, with the body before them: w, x, y, z, or a matrix with columns first.
_PARTS = (
    re.compile(r"(?P<body>.*?)_?quat(?:ernion)?_(?P<part>[wxyz])"),
    re.compile(r"(?P<body>.*?)_?quat(?:ernion)?_q(?P<part>[0-3])"),
    re.compile(r"(?P<body>.+)/orientation/(?P<part>scalar|[xyz])"),
    re.compile(r"(?P<body>.+)[._]q(?P<part>[wxyz])"),
    re.compile(r"(?P<body>.*?)_?mat\[(?P<part>[123]\]\[[123])\]"),
)
_PLACE = {"x": 0, "y": 1, "z": 2, "w": 3, "1": 0, "2": 1, "3": 2, "0": 3, "scalar": 3}
#: Columns of times with their unit, s; where the numbers show it; and where they count samples.
TIMES = {"time_s": 1.0, "time_ms": 1e-3, "time_us": 1e-6, "time_ns": 1e-9, "sampletimefine": 1e-6}
PLAIN_TIMES = ("time", "timestamp", "t")
COUNTERS = ("frame", "frame#", "frames", "packetcounter", "sample")
PERCENT = ("time_percent", "time_%", "percent")
#: Since 1970, in s: from 2001 to 2286.
_EPOCH = (1e9, 1e10)
_WRAPS = {"sampletimefine": 2.0**32, "packetcounter": 2.0**16}
#: Digits of a fraction of a second that Python reads.
_FRACTION = re.compile(r"(?<=:[0-9]{2})[.,]([0-9]+)")
_MVNX = "{http://www.xsens.com/mvn/mvnx}"
_CLAIMED = "the file declares entities or a document type, which no recording needs"


@dataclass(frozen=True, eq=False)
class Source(Record):
    """What a file holds.

    Attributes
    ----------
    path : path-like
        The file.
    format : str
        What it is, in words.
    names, labels : tuple of str
        Columns as they are compared, and as the file names them.
    table : CsvTable or None
        Cells of a text.
    arrays : mapping of str to ndarray
        Columns of a file that holds numbers, shape (N,); they come before those of the table.
    header : mapping of str to str
        Entries before the table.
    """

    path: str | PathLike[str]
    format: str
    names: tuple[str, ...]
    labels: tuple[str, ...]
    table: CsvTable | None = None
    arrays: Mapping[str, FloatArray] = field(default_factory=dict)
    header: Mapping[str, str] = field(default_factory=dict)

    def numbers(self, names: Sequence[str]) -> FloatArray:
        """Columns, shape (N, len(names)); NaN where a cell is blank."""
        if all(name in self.arrays for name in names):
            return np.stack([self.arrays[name] for name in names], axis=1)
        assert self.table is not None
        return self.table.numbers(names, gaps=True)

    def renamed(self, columns: Mapping[str, str]) -> Source:
        """The same with columns by known names, its times if none are named; a minus before a label turns the sign."""
        clocks = {*TIMES, *PLAIN_TIMES, *COUNTERS, *PERCENT}
        if not clocks & set(columns):
            columns = {name: name for name in self.names if name in clocks} | dict(columns)
        arrays = dict(self.arrays)
        for name, label in columns.items():
            own = self.name_of(label.removeprefix("-"))
            arrays[name] = (-1.0 if label.startswith("-") else 1.0) * self.numbers((own,))[:, 0]
        # What is mapped stands for all that the file holds, so that nothing is there twice.
        labels = tuple(columns.values())
        return Source(self.path, self.format, tuple(columns), labels, self.table, arrays, self.header)

    def name_of(self, label: str) -> str:
        """The compared name of a column as the file names it."""
        if label in self.labels:
            return self.names[self.labels.index(label)]
        if label in self.names:
            return label
        raise FileFormatError(f"no column {echo(label)}; there are {', '.join(self.labels)}", self.path)

    def bodies(self) -> dict[str, FloatArray]:
        """Orientations of sensors or segments by name, quaternions x, y, z, w of shape (N, 4); NaN where missing."""
        found: dict[str, dict[str, str]] = {}
        for name in self.names:
            for pattern in _PARTS:
                if match := pattern.fullmatch(name):
                    found.setdefault(match["body"], {})[match["part"]] = name
                    break
        bodies = {}
        for body, parts in found.items():
            if len(parts) == 4:
                order = sorted(parts, key=_PLACE.__getitem__)
                bodies[body] = self.numbers([parts[part] for part in order])
            elif len(parts) == 9:
                # Mat[2][1] is the second row of the first column.
                values = self.numbers([parts[f"{row}][{column}"] for row in "123" for column in "123"])
                bodies[body] = as_quaternions(values.reshape(-1, 3, 3), self.path)
        return bodies

    def clocks(self) -> list[str]:
        """Columns of times, in s or a unit of it, that hold something."""
        known = [name for name in (*TIMES, *PLAIN_TIMES) if name in self.names]
        # Awinda leaves its clock empty.
        empty = self.table is not None and "sampletimefine" in known and not _finite_cells(self.table, "sampletimefine")
        return [name for name in known if not (empty and name == "sampletimefine")]

    @property
    def period(self) -> float:
        """Time after which the clock begins again, s; infinite of one that does not."""
        return min((_WRAPS[name] * TIMES[name] for name in self.clocks() if name in _WRAPS), default=np.inf)

    def times(self, rate: float | None, duration: float | None) -> FloatArray:
        """Times of all rows, s, NaN where blank.

        Parameters
        ----------
        rate : float, optional
            Samples a second of a file that counts them.
        duration : float, optional
            s, of a file whose times are percent.
        """
        known = self.clocks()
        counted = [name for name in COUNTERS if name in self.names]
        percent = [name for name in PERCENT if name in self.names]
        if len(known) > 1:
            raise self._wrong_times(known)
        if rate is not None:
            return self._of_counter((known + counted)[:1], rate)
        if known:
            return self._of_clock(known[0])
        if percent:
            if duration is None:
                raise FileFormatError(
                    f"column {percent[0]} has no unit of time: say how long the movement takes, duration=... "
                    "(--duration S)",
                    self.path,
                )
            return np.asarray(self.numbers(percent[:1])[:, 0] * duration / 100.0)
        stated = next(
            (self.header[name] for name in ("update rate", "outputrate", "sample rate") if name in self.header), ""
        )
        if number := re.match(r"[0-9.]+", stated):
            return self._of_counter(counted[:1], float(number[0]))
        if counted:
            raise FileFormatError(
                f"column {counted[0]} counts samples: say how many there are a second, rate=... (--rate HZ)", self.path
            )
        raise self._wrong_times(known)

    def _wrong_times(self, found: list[str]) -> FileFormatError:
        return FileFormatError(
            f"expected one column of times, {', '.join(list(TIMES)[:4])} or {', '.join(PLAIN_TIMES)}; "
            f"got {', '.join(found) or ', '.join(self.labels)}",
            self.path,
        )

    def _of_counter(self, names: list[str], rate: float) -> FloatArray:
        if not names:
            count = len(next(iter(self.arrays.values()))) if self.table is None else len(self.table.rows)
            return np.arange(count) / rate
        counts = self._unwrapped(names[0])
        return np.asarray((counts - counts[np.isfinite(counts)][:1]) / rate)

    def _unwrapped(self, name: str) -> FloatArray:
        """Numbers of a column; one that begins again goes on."""
        counts = self.numbers((name,))[:, 0]
        if (size := _WRAPS.get(name)) is None:
            return counts
        return np.asarray(counts + size * np.cumsum(np.diff(counts, prepend=counts[:1]) < -0.5 * size))

    def _of_clock(self, name: str) -> FloatArray:
        if name not in self.arrays and self.table is not None:
            cells = _finite_cells(self.table, name)
            if cells and any(sign in cells[0] for sign in ":T") and len(cells) == len(self.table.rows):
                seconds = _seconds_of_dates(cells)
                if seconds is not None:
                    return np.array(seconds)
        given = self._unwrapped(name)
        known = given[np.isfinite(given)]
        if known.size < 2:
            return given
        first, unit, steps = float(known[0]), TIMES.get(name), np.diff(known)
        epoch = [each for each in (1.0, 1e-3, 1e-6, 1e-9) if _EPOCH[0] <= first * each < _EPOCH[1]]
        if unit is None:
            if not epoch and len(known) > 2 and (steps == 1.0).all():
                raise FileFormatError(
                    f"column {name} counts {first:g}, {first + 1:g}, {first + 2:g}, ...: frame numbers? Say how many "
                    "there are a second, rate=... (--rate HZ). If they are ms, name the column time_ms",
                    self.path,
                )
            unit = epoch[0] if epoch else 1.0 if float(np.median(steps)) < 1.0 else 1e-3
        return np.asarray((given - first) * unit if unit in epoch else given * unit)


def as_quaternions(matrices: FloatArray, path: str | PathLike[str]) -> FloatArray:
    """Quaternions of matrices (N, 3, 3), NaN where an entry is missing; of none that is no rotation."""
    found = np.full((len(matrices), 4), np.nan)
    there = np.isfinite(matrices).all(axis=(1, 2))
    known = matrices[there]
    square = np.abs(known @ known.transpose(0, 2, 1) - np.eye(3)).max(initial=0.0)
    if square > 1e-2 or (np.linalg.det(known) < 0.0).any():
        raise FileFormatError("expected rotation matrices: rows of unit length at right angles, right-handed", path)
    found[there] = Rotation.from_matrix(known).as_quat() if there.any() else 0.0
    return found


def open_source(path: str | PathLike[str]) -> Source:
    """Read a file of any of the known formats.

    Raises
    ------
    FileFormatError
        If it cannot be read.
    MissingExtra
        For a C3D file without ezc3d.
    """
    ending = fspath(path).lower().rpartition(".")[2] if isinstance(path, str | PathLike) else ""
    if ending == "mvnx":
        return _read_mvnx(path)
    if ending == "c3d":
        return _read_c3d(path)
    layout = read_layout(path, _UNITS)
    names = layout.table.columns
    if layout.header.get("datatype", "").lower() == "quaternion":
        return _opensense(layout, path)
    if "datatype" not in layout.header and ("nrows" in layout.header or "indegrees" in layout.header):
        return _opensim(layout, path)
    if "sampletimefine" in names or "packetcounter" in names:
        what = "Xsens Awinda" if "update rate" in layout.header else "Xsens DOT"
    elif any("/orientation/" in name for name in names):
        what = "APDM"
    else:
        what = "CSV"
    what += f" with {layout.dialect}" if layout.dialect and what == "CSV" else ""
    return Source(path, what, names, layout.labels, layout.table, {}, layout.header)


def _opensim(layout: Layout, path: str | PathLike[str]) -> Source:
    """Coordinates of a model; a path such as ``/jointset/acromial_r/arm_flex_r/value`` is named by its coordinate."""
    names = [name.removesuffix("/value").rpartition("/")[2] for name in layout.table.columns]
    names = [full if full.endswith("/speed") else name for full, name in zip(layout.table.columns, names, strict=True)]
    # Those that occur twice keep their whole names.
    named = tuple(
        full if names.count(name) > 1 else name for full, name in zip(layout.table.columns, names, strict=True)
    )
    table = layout.table
    renamed = CsvTable(path, named, table.rows, table.lines, table.comments)
    return Source(path, "OpenSim motion", named, layout.labels, renamed, {}, layout.header)


def _opensense(layout: Layout, path: str | PathLike[str]) -> Source:
    """Quaternions w,x,y,z in cells."""
    table = layout.table
    arrays = {"time": table.numbers(("time",), gaps=True)[:, 0]}
    for place, name in enumerate(table.columns):
        if name == "time":
            continue
        values = np.full((len(table.rows), 4), np.nan)
        for index, row in enumerate(table.rows):
            try:
                w, x, y, z = map(float, row[place].split(","))
            except ValueError:
                if row[place].strip(" ,").lower() not in ("", "nan"):
                    message = f"line {table.lines[index]}: expected w,x,y,z in column {name}, got {echo(row[place])}"
                    raise FileFormatError(message, path) from None
            else:
                values[index] = x, y, z, w
        arrays |= {f"{name}.q{part}": values[:, k] for k, part in enumerate("xyzw")}
    return Source(path, "OpenSense orientations", tuple(arrays), table.columns, None, arrays, layout.header)


def _read_mvnx(path: str | PathLike[str]) -> Source:
    content = read_file(path)
    if b"<!DOCTYPE" in content or b"<!ENTITY" in content:
        raise FileFormatError(_CLAIMED, path)
    try:
        root = ET.fromstring(content)
    except ET.ParseError as error:
        raise FileFormatError(f"not MVNX: {error}", path) from error
    space = _MVNX if root.tag.startswith(_MVNX) else ""
    labels = [each.get("label", "") for each in root.iter(f"{space}segment")]
    frames = [each for each in root.iter(f"{space}frame") if each.get("type") == "normal"]
    if not labels or not frames:
        raise FileFormatError("expected MVNX with segments and frames of type normal", path)
    try:
        times = np.array([float(frame.get("time", "nan")) for frame in frames])
        values = np.array([(frame.findtext(f"{space}orientation") or "").split() for frame in frames], dtype=np.float64)
    except ValueError as error:
        raise FileFormatError(f"not MVNX: {error}", path) from error
    if values.shape[1] != 4 * len(labels):
        raise FileFormatError(
            f"expected 4 numbers of orientation a segment, got {values.shape[1]} of {len(labels)}", path
        )
    arrays = {"time_ms": times}
    for k, label in enumerate(labels):
        arrays |= {f"{label.lower()}.q{part}": values[:, 4 * k + j] for j, part in enumerate("wxyz")}
    return Source(path, "Xsens MVNX", tuple(arrays), ("time", *labels), None, arrays, {})


def _read_c3d(path: str | PathLike[str]) -> Source:
    content = read_file(path)
    if content[1:2] != b"\x50":
        raise FileFormatError("not C3D: its second byte is not 80", path)
    try:
        data = optional("recordings", "ezc3d").c3d(fspath(path))
        point = data["parameters"]["POINT"]
        labels = [str(label) for label in point["LABELS"]["value"]]
        rate = float(np.ravel(point["RATE"]["value"])[0])
        points = np.asarray(data["data"]["points"], dtype=np.float64)
    except (RuntimeError, OSError, KeyError, IndexError, ValueError) as error:
        raise FileFormatError(f"not C3D that can be read: {error}", path) from error
    arrays = {"time_s": np.arange(points.shape[2]) / rate}
    for k, label in enumerate(labels[: points.shape[1]]):
        arrays |= {f"{label}.{part}": points[j, k] for j, part in enumerate("xyz")}
    turned = np.asarray(data["data"].get("rotations", np.zeros((4, 4, 0, 0))), dtype=np.float64)
    if turned.size and "ROTATION" in data["parameters"] and turned.shape[3] == points.shape[2]:
        named = data["parameters"]["ROTATION"]["LABELS"]["value"]
        for k, label in enumerate(str(each) for each in named[: turned.shape[2]]):
            quaternions = as_quaternions(np.moveaxis(turned[:3, :3, k], -1, 0), path)
            arrays |= {f"{label.lower()}.q{part}": quaternions[:, j] for j, part in enumerate("xyzw")}
    return Source(path, "C3D", tuple(arrays), tuple(arrays), None, arrays, {})


def _seconds_of_dates(cells: list[str]) -> list[float] | None:
    """Times of day or dates of ISO 8601 as s from the first; None where they are not."""
    found: list[datetime] = []
    for cell in cells:
        text = _FRACTION.sub(lambda digits: "." + digits[1][:6].ljust(6, "0"), cell.strip())
        hour = re.match(r"[0-9]{1,2}(?=:)", text)
        text = f"1970-01-01T{hour[0]:0>2}{text[hour.end() :]}" if hour else text
        try:
            time = datetime.fromisoformat(text)
        except ValueError:
            return None
        found.append(time if time.tzinfo else time.replace(tzinfo=UTC))
    return [(time - found[0]).total_seconds() for time in found]


def _finite_cells(table: CsvTable, name: str) -> list[str]:
    """Cells of a column that hold something."""
    place = table.columns.index(name)
    return [row[place] for row in table.rows if row[place].lower() not in NO_NUMBER]
