"""The arm's pose from orientations of trunk, upper arm and forearm: segments of MVNX, or sensors strapped on anyhow.

A sensor turns with its bone. While the arm hangs still at the start of the record, the bone's pose is known, and with
it how the sensor sits: R_bone(t) = R_s(t) R_s(0)ᵀ R_bone(0). There the trunk is upright and faces where a stated axis
of its sensor points, seen from above. The ground's z is up.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from ...core.errors import FileFormatError
from ...core.records import Record
from ...core.validation import FloatArray
from .plausibility import Reading
from .sources import Source, open_source

#: Words in the names of bodies.
_WORDS = {
    "trunk": ("t8", "torso", "trunk", "thorax", "sternum", "chest"),
    "arm": ("upperarm", "humerus", "arm"),
    "forearm": ("forearm", "lowerarm", "ulna", "radius"),
}
ROLES = tuple(_WORDS)
#: Largest turn of a sensor, rad, while the arm hangs still.
_STILL = np.radians(8.0)
#: Least horizontal part of the axis that points forward.
_HORIZONTAL = 0.5
_SIGNS = {"r": "right", "l": "left"}


@dataclass(frozen=True, eq=False)
class Bodies(Record):
    """Orientations of the bodies by role, quaternions x, y, z, w of shape (N, 4), NaN where missing.

    ``segments`` tells that the axes are those of MVNX's segments, x forward, y left, z up in the T-pose.
    """

    arm: FloatArray
    trunk: FloatArray
    forearm: FloatArray | None
    segments: bool
    path: str | PathLike[str]

    def w_last(self) -> Bodies:
        """With the numbers of each quaternion, which are read as w, x, y, z, as x, y, z, w."""
        forearm = None if self.forearm is None else np.roll(self.forearm, 1, axis=1)
        return replace(self, arm=np.roll(self.arm, 1, axis=1), trunk=np.roll(self.trunk, 1, axis=1), forearm=forearm)

    def there(self) -> np.ndarray:
        """Rows in which all bodies are known, shape (N,)."""
        parts = [each for each in (self.arm, self.trunk, self.forearm) if each is not None]
        return np.asarray(np.isfinite(np.hstack(parts)).all(axis=1))

    def poses(self, times: FloatArray, rows: np.ndarray, side: str, forward: str | None, still: float) -> Reading:
        """The arm, and what trunk and forearm show, in some rows."""
        if not rows.any():
            raise FileFormatError("no row has the orientations of all bodies, and a time", self.path)
        parts = [self._rotations(each, rows) for each in (self.trunk, self.arm)]
        forearm = None if self.forearm is None else self._rotations(self.forearm, rows)
        if self.segments:
            turn = Rotation.from_euler("x", -90.0 if side == "right" else 90.0, degrees=True)
            trunk, arm = parts[0], parts[1] * turn
            forearm = None if forearm is None else forearm * turn
            leaning = float(np.arccos(np.clip(trunk[0].as_matrix()[2, 2], -1.0, 1.0)))
        else:
            first = times[rows] - times[rows][0] <= still
            zero = [self._at_rest(each, first) for each in (*parts, *([] if forearm is None else [forearm]))]
            facing, leaning = self._facing(zero[0], forward)
            trunk, arm = (part * rest.inv() * facing for part, rest in zip(parts, zero, strict=False))
            forearm = None if forearm is None else forearm * zero[2].inv() * facing
        along = None if forearm is None else (arm.inv() * forearm).apply([0.0, 0.0, -1.0])
        return Reading(trunk.inv() * arm, times[rows], leaning, along)

    def _rotations(self, quaternions: FloatArray, rows: np.ndarray) -> Rotation:
        own = quaternions[rows]
        size = np.linalg.norm(own, axis=1)
        if not (np.abs(size - 1.0) < 0.02).all():
            raise FileFormatError(
                f"expected unit quaternions, got one of length {size[np.nanargmax(np.abs(size - 1.0))]:g}", self.path
            )
        return Rotation.from_quat(own)

    def _at_rest(self, part: Rotation, first: np.ndarray) -> Rotation:
        mean = part[first].mean()
        spread = float((mean.inv() * part[first]).magnitude().max())
        if spread > _STILL:
            raise FileFormatError(
                f"the sensors turn by {np.degrees(spread):.0f}° in the first samples, where the arm must hang still: "
                "cut the record, or say how long it hangs, still=... (--still S)",
                self.path,
            )
        return mean

    def _facing(self, trunk: Rotation, forward: str | None) -> tuple[Rotation, float]:
        """From {O_A} to the ground while the arm hangs, and how far the axis is from the horizontal, rad."""
        match = re.fullmatch(r"([+-]?)([xyz])", forward or "")
        if match is None:
            raise FileFormatError(
                "these are sensors: say which axis of the trunk's sensor points forward, such as forward='z' "
                "(--forward z; x, y, z, -x, -y or -z)",
                self.path,
            )
        axis = trunk.apply(np.eye(3)["xyz".index(match[2])]) * (-1.0 if match[1] == "-" else 1.0)
        flat = np.array([axis[0], axis[1], 0.0])
        size = float(np.linalg.norm(flat))
        if size < _HORIZONTAL:
            raise FileFormatError(
                f"axis {forward} of the trunk's sensor points up or down, not forward: name another (--forward)",
                self.path,
            )
        up = np.array([0.0, 0.0, 1.0])
        facing = Rotation.from_matrix(np.stack([flat / size, np.cross(up, flat / size), up], axis=1))
        return facing, float(np.arctan2(abs(axis[2]), size))


def bodies_of(source: Source, times: FloatArray, side: str, sensors: Mapping[str, str]) -> Bodies | None:
    """Orientations of the bodies of a file by role; None where it holds none.

    Raises
    ------
    FileFormatError
        If a body cannot be found by its name, or there is none on the trunk.
    """
    found = source.bodies()
    if not found:
        return None
    chosen = {}
    for role in ROLES:
        given = sensors.get(role)
        names = [name for name in found if given is not None and name.lower() == given.lower()]
        name = _guessed(found, role, side) if given is None else next(iter(names), None)
        if name is not None:
            chosen[role] = found[name]
        elif given is not None and Path(given).is_file():
            chosen[role] = _of_file(given, times, source.period)
        elif given is not None:
            raise _unknown(source, found, f"no {role} {given!r}.")
    missing = [role for role in ("arm", "trunk") if role not in chosen]
    if missing:
        raise _unknown(source, found, f"which is on the {missing[0]}?")
    return Bodies(chosen["arm"], chosen["trunk"], chosen.get("forearm"), source.format == "Xsens MVNX", source.path)


def _unknown(source: Source, found: Mapping[str, FloatArray], what: str) -> FileFormatError:
    names = ", ".join(name or "one sensor" for name in found)
    return FileFormatError(
        f"{what} There are: {names}. Give sensors={{'trunk': NAME, 'arm': NAME}} (--sensor trunk=NAME); a file of its "
        "own may stand for NAME",
        source.path,
    )


def _guessed(found: Mapping[str, FloatArray], role: str, side: str) -> str | None:
    """The body of a role by its name; None where there is none or several."""
    if role == "arm" and len(found) == 1:
        return next(iter(found))
    fits: dict[str, bool] = {}
    for name in found:
        plain = re.sub("[^a-z0-9]", "", name.lower())
        if not any(word in plain for word in _WORDS[role]):
            continue
        if role == "arm" and any(word in plain for word in _WORDS["forearm"]):
            continue
        sides = {word for word in ("left", "right") if word in plain}
        sides |= {_SIGNS[sign] for sign in re.findall(r"(?:^|[_. ])([rl])(?=$|[_. ])", name.lower())}
        if not sides or side in sides:
            fits[name] = side in sides
    own = [name for name, is_own in fits.items() if is_own] or list(fits)
    return own[0] if len(own) == 1 else None


def _of_file(path: str, times: FloatArray, period: float) -> FloatArray:
    """The one sensor of another file at given times, shape (N, 4), by clocks that begin again after ``period``, s.

    NaN outside its record.
    """
    other = open_source(path)
    found = other.bodies()
    if len(found) != 1:
        raise FileFormatError(f"expected one sensor, got {len(found)}", path)
    values = next(iter(found.values()))
    clock = other.times(None, None)
    if other.period == period < np.inf and np.isfinite(clock).any() and np.isfinite(times).any():
        # Of two files one may begin just after the clock has begun again.
        clock = clock + period * np.round((np.nanmean(times) - np.nanmean(clock)) / period)
    there = np.isfinite(values).all(axis=1) & np.isfinite(clock)
    rotations = np.full((len(times), 4), np.nan)
    if there.sum() > 1:
        within = (times >= clock[there].min()) & (times <= clock[there].max())
        rotations[within] = Slerp(clock[there], Rotation.from_quat(values[there]))(times[within]).as_quat()
    return rotations
