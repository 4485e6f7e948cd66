"""Errors of input: arguments, names, files, missing data and missing extras.

Errors of muscle models and their identification.
"""

from __future__ import annotations

import errno
from collections.abc import Iterable
from difflib import get_close_matches
from itertools import islice
from os import PathLike, fspath

from .base import ExoPinError, echo

#: What to do about the reasons for which a file is not written.
_ADVICE = {
    errno.ENOENT: "; make its folder first",
    errno.ENOSPC: "; make room, or choose another disk",
    errno.EDQUOT: "; make room, or choose another disk",
    errno.EACCES: "; the file, if there is one, and its folder must be writable",
    errno.EPERM: "; the file, if there is one, and its folder must be writable",
    errno.EROFS: "; choose another disk",
    errno.EPIPE: "; the program that reads the pipe has ended",
}


def nearest(name: str, known: Iterable[str]) -> str | None:
    """The known name that may be meant. Comparing takes the product of the lengths: no long names, and not many."""
    near = get_close_matches(name, islice(known, 1000), n=1) if len(name) <= 100 else []
    return near[0] if near else None


def hint(name: str, known: Iterable[str]) -> str:
    """The known name that may be meant, for a message; empty if none is near."""
    near = nearest(name, known)
    return "" if near is None else f" (did you mean {near!r}?)"


class InvalidInput(ExoPinError, ValueError):
    """An argument has a wrong type, shape, range or value.

    Examples
    --------
    >>> try:
    ...     ep.Arm(3.7, [0.0, 0.0, -0.3], np.diag([0.1, 0.1, 0.3]))  # no body: 0.3 exceeds 0.1 + 0.1
    ... except ValueError as error:  # it is one of these, too
    ...     print(str(error).split(": ")[1])
    principal moments [0.1 0.1 0.3] kg m² break the triangle inequality
    """


class UnknownName(InvalidInput):
    """A name (preset, key, frame, closure type, ...) does not exist.

    Attributes
    ----------
    kind : str
        What the name is of, for example ``"preset"``.
    name : str
        The name that was given.
    available : tuple of str
        The names that exist.

    Examples
    --------
    >>> try:
    ...     ep.load("prototyp")
    ... except ep.UnknownName as error:
    ...     print(error.name, "prototype" in error.available)
    prototyp True
    """

    def __init__(self, kind: str, name: object, available: Iterable[str], where: str = "") -> None:
        self.kind = kind
        self.name = name if isinstance(name, str) else echo(name)
        self.available = tuple(sorted(available))
        place = f" in {where}" if where else ""
        there = ", ".join(self.available) or "none"
        super().__init__(f"unknown {kind} {self.name!r}{place}{hint(self.name, self.available)}; there are: {there}")


class MissingData(ExoPinError, ValueError):
    """The computation needs a value that the mechanism does not have.

    What a source does not print is left out of its parameter set; it never defaults to 0 or 1.

    Attributes
    ----------
    missing : tuple of str
        Names of the values that are needed.

    Examples
    --------
    >>> exo = ep.load("appendix-d")  # the thesis prints no inertia of this arm
    >>> try:
    ...     exo.reaction(exo.pose(30), ep.Motion([1.0, 0.0, 0.0], [0.0, 0.0, 0.0]))
    ... except ep.MissingData as error:
    ...     print(error.missing)
    ('arm inertia',)
    """

    def __init__(self, missing: Iterable[str], needed_for: str, mechanism: str = "", advice: str = "") -> None:
        self.missing = tuple(missing)
        owner = f"design {mechanism!r} has no " if mechanism else "missing: "
        super().__init__(f"{owner}{' and '.join(self.missing)}, needed for {needed_for}{advice and f': {advice}'}")


class MissingExtra(ExoPinError, ImportError):
    """A package is needed that comes with an extra of exo_pin.

    Attributes
    ----------
    extra : str
        Name of the extra.
    problem : str
        What is wrong with the package that is installed; empty if there is none.
    """

    def __init__(self, extra: str, package: str, problem: str = "") -> None:
        self.extra, self.problem = extra, problem
        there = f" (what is installed {problem})" if problem else ""
        super().__init__(
            f"this needs {package}{there}: in the folder of exo_pin's sources run pip install '.[{extra}]'"
        )


class FileFormatError(InvalidInput):
    """A file cannot be read, or its content does not have the expected format.

    Attributes
    ----------
    path : str or None
        The file.
    key : str or None
        Dotted name of the offending key, for example ``"geometry.circles.base_radius"``.

    Examples
    --------
    >>> np.savetxt("mine.toml", [ep.design.preset_file("prototype").replace("mass_g", "mass_lb")], "%s")
    >>> try:
    ...     ep.load("mine.toml")
    ... except ep.FileFormatError as error:
    ...     print(error.key)
    arm.mass_kg or mass_g
    """

    def __init__(self, message: str, path: str | PathLike[str] | None = None, key: str | None = None) -> None:
        self.path, self.key = None if path is None else fspath(path), key
        super().__init__(f"{self.path}: {message}" if self.path is not None else message)


class FileNotWritten(InvalidInput):
    """The system refuses to write a file.

    An old file is unchanged. A pipe or a device may have received a part of the content.

    Attributes
    ----------
    path : str
        The file.
    errno : int or None
        The system's number of the reason, as in :mod:`errno`.
    """

    def __init__(self, path: str | PathLike[str], error: OSError) -> None:
        self.path, self.errno = fspath(path), error.errno
        advice = _ADVICE.get(error.errno or 0, "")
        super().__init__(f"cannot write {self.path!r}: {error.strerror or error}{advice}")


class StorageUnusable(InvalidInput):
    """The storage of a study cannot be opened, read or written, or what it holds is no study of this version.

    Attributes
    ----------
    storage : str
        Its path or URL, without the password.
    reason : str
        What is wrong with it.
    """

    def __init__(self, storage: object, reason: str) -> None:
        kind, mark, rest = str(storage).partition("://")
        login, at, place = rest.rpartition("@")
        user, has_password, _ = login.partition(":")
        self.storage = f"{kind}{mark}{user}:***{at}{place}" if has_password else str(storage)
        self.reason = reason
        super().__init__(f"storage {self.storage!r:.200}: {reason}")


class NonConvexBound(InvalidInput):
    """The bound ``|g_i| <= |f_i|`` is not convex where f_i is itself chosen and may take both signs.

    Examples
    --------
    >>> points = ep.load("four-cables").geometry
    >>> exo = ep.ShoulderExo(points, ep.Arm.from_anthropometry(1.75, 75, "male"))  # four UPU limbs of any sign
    >>> try:
    ...     exo.reaction(exo.pose(30), split="minimal", constraint_bounds="actuator")
    ... except ep.NonConvexBound as error:
    ...     print(str(error).split("; ")[0])
    |g_i| <= |f_i| needs limb forces that equilibrium determines
    """


class InfeasibleBounds(InvalidInput):
    """A lower bound is above its upper bound.

    Attributes
    ----------
    limbs : tuple of int
        Indices of the limbs concerned, from 0.

    Examples
    --------
    >>> exo = ep.load("prototype")
    >>> try:
    ...     exo.reaction(exo.pose(30), split="minimal", constraint_bounds=([0.0, 5.0, 0.0], [9.0, 3.0, 9.0]))
    ... except ep.InfeasibleBounds as error:
    ...     print(error.limbs)  # its side force would have to be 5 N or more, and 3 N or less
    (1,)
    """

    def __init__(self, limbs: Iterable[int]) -> None:
        self.limbs = tuple(int(i) for i in limbs)
        super().__init__(f"lower bound above upper bound for limb index {', '.join(map(str, self.limbs))}")


class NotAWrist(ExoPinError, RuntimeError):
    """A closed form of the wrist was called for a robot that is not a wrist, or is not recognised as one.

    Attributes
    ----------
    robot : str
        Its name.
    reason : str
        Why.

    Examples
    --------
    >>> pendulum = "<mujoco><worldbody><body><joint/><geom size='0.05' pos='0 0 -0.3'/></body></worldbody></mujoco>"
    >>> try:
    ...     ep.wrist_chain.wrist_of(ep.ClosedChain.from_mjcf(pendulum))
    ... except ep.NotAWrist as error:
    ...     print(error.reason)
    its closures file names no arm with three limbs or more among its roles
    """

    def __init__(self, robot: str, reason: str) -> None:
        self.robot, self.reason = robot, reason
        super().__init__(f"{robot!r} has no wrist's closed form: {reason}")


class AbsentAttribute(ExoPinError, AttributeError):
    """A device has no such attribute: it belongs to devices of another kind.

    Attributes
    ----------
    attribute : str
        Its name.
    """

    def __init__(self, attribute: str, instead: str = "") -> None:
        self.attribute = attribute
        super().__init__(f"a device that is not a wrist has no attribute {attribute!r}{instead and f'; {instead}'}")


class OutsideValidity(InvalidInput):
    """A state lies outside the range in which a muscle model was identified.

    Attributes
    ----------
    model : str
        Name of the model.
    reason : str
        The bound that is broken, with its value and the value that came.
    count : int
        Number of states outside.
    index : tuple of int
        Position of the first of them in the (broadcast) stack; empty for a single state.

    Examples
    --------
    >>> try:
    ...     ep.muscle.muscle_model("best").force(0.005, 3e5)  # contracted by 5 mm: the law begins at 20
    ... except ep.muscle.OutsideValidity as error:
    ...     print(error.reason)
    expected strain at least 0.0410567, got 0.0166667
    """

    def __init__(self, model: str, reason: str, count: int = 1, index: tuple[int, ...] = ()) -> None:
        self.model = model
        self.reason = reason
        self.count = int(count)
        self.index = tuple(int(i) for i in index)
        where = f" at index {self.index}" if self.index else ""
        many = f" ({self.count} states are outside)" if self.count > 1 else ""
        super().__init__(
            f"muscle model {model!r} does not hold{where}: {reason}{many}; outside='mark' (--mark) marks such values"
        )


class OutsideRangeOfMotion(InvalidInput):
    """A pose lies outside the range of motion of the wearer's anatomical model.

    Attributes
    ----------
    reason : str
        The angle, its value and its limits.
    count : int
        Number of poses outside.
    index : tuple of int
        Position of the first of them in the stack; empty for a single pose.

    Examples
    --------
    >>> person = ep.Person(1.75, 75, "male")
    >>> poses = ep.shoulder_rotation([30, 60, 60], [0, 0, -90], 0, degrees=True)
    >>> try:
    ...     person.joint_contact(poses)
    ... except ep.OutsideRangeOfMotion as error:
    ...     print(error.index, error.count)
    (2,) 1
    """

    def __init__(self, reason: str, count: int = 1, index: tuple[int, ...] = ()) -> None:
        self.reason, self.count, self.index = reason, int(count), tuple(int(i) for i in index)
        where = f" at index {self.index}" if self.index else ""
        many = f" ({self.count} poses are outside)" if self.count > 1 else ""
        super().__init__(
            f"the person's arm cannot take this pose{where}: {reason}{many}. Choose a pose within these limits, or "
            "outside='mark' to mark such poses in the result"
        )


class NotIdentifiable(ExoPinError, ValueError):
    """The data cannot determine the requested coefficients.

    Attributes
    ----------
    coefficients : tuple of str
        Names of the coefficients.

    Examples
    --------
    >>> states = ep.muscle.steady_states(valid_only=True)
    >>> same = np.full(25, 3e5)  # Pa: data of one pressure do not determine what pressure does
    >>> try:
    ...     ep.muscle.identify_static(states.contraction, same, states.force, 0.3)
    ... except ep.muscle.NotIdentifiable as error:
    ...     print(len(error.coefficients))
    6
    """

    def __init__(self, message: str, coefficients: tuple[str, ...] = ()) -> None:
        self.coefficients = tuple(coefficients)
        super().__init__(message)
