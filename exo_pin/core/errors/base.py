"""Base class of all errors, and the one place where what a message echoes is cut and made printable.

Categories of warnings, and the place that a warning names.

Errors of solvers and of other programs.
"""

from __future__ import annotations

import re
import sys
import warnings
from collections.abc import Iterable
from typing import Any

from ..records import freeze, read_only_arrays

#: Longest message, and longest word in one (a name, path or number), characters.
LONGEST, WORD = 2000, 500
_CUT = " [... cut ...] "
_LONG_WORD = re.compile(rf"\S{{{WORD + 1},}}")


def shown(text: str) -> str:
    """A text for a terminal: at most :data:`LONGEST` characters, cut in the middle, control characters as escapes.

    A file may hold texts of any length, and escape sequences that would change the terminal or hide parts of a message.
    Long words are cut first, so that what is said about them remains.
    """
    # Once more afterwards, because escapes are longer than what they stand for.
    return _short("".join(c if c.isprintable() or c == "\n" else repr(c)[1:-1] for c in _short(text)))


def _short(text: str) -> str:
    return _cut(_LONG_WORD.sub(lambda word: _cut(word[0], WORD), text), LONGEST)


def _cut(text: str, longest: int) -> str:
    left = longest - len(_CUT)
    return text if len(text) <= longest else text[: left - left // 3] + _CUT + text[-(left // 3) :]


def echo(value: object) -> str:
    """What a message shows of any value, also where Python cannot print it: an integer of 5,000 digits, deep lists."""
    try:
        return f"{value!r:.80}"
    except Exception:
        return f"a value of type {type(value).__name__}"


class ExoPinError(Exception):
    """Base of every error that exo_pin raises on purpose.

    Its message is ``shown``; the attributes hold the whole evidence.

    Errors survive pickling, so they reach the parent of a process pool: same class, message and attributes. Python
    would call ``__init__`` with the message alone, which takes other arguments here, and a process pool waits for
    ever for an answer that cannot be unpickled.

    Examples
    --------
    >>> try:
    ...     ep.Wearer(height=175, mass=75, sex="male")  # cm
    ... except ep.ExoPinError as error:
    ...     print(error)
    expected a height of 0.5 to 2.6 m, got 175; did you mean 1.75 m?
    """

    def __init__(self, *args: object) -> None:
        super().__init__(*(shown(str(arg)) for arg in args))

    def __reduce__(self) -> tuple[Any, ...]:
        state = dict(vars(self))
        return _error_again, (type(self), self.args), (state, read_only_arrays(state))

    def __setstate__(self, state: Any) -> None:
        attributes, arrays = state
        freeze(arrays)
        vars(self).update(attributes)


def _error_again(kind: type[ExoPinError], args: tuple[Any, ...]) -> ExoPinError:
    """Make an error without its own ``__init__``; that of Python's class sets what ``str`` shows."""
    error = kind.__new__(kind, *args)
    python = next(base for base in kind.__mro__ if base.__module__ == "builtins")
    python.__init__(error, *args)  # type: ignore[misc]
    return error


class ExoPinWarning(UserWarning):
    """Base of exo_pin's warnings: results are computed as requested, and may mislead or take longer than usual.

    Examples
    --------
    >>> import warnings
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("error", ep.ExoPinWarning)
    ...     try:
    ...         ep.load("prototype").pose(abduction=1.57)
    ...     except ep.ExoPinWarning as warning:
    ...         print(warning)
    abduction = 1.57° is 90° in radians; this function takes degrees
    """

    def __init__(self, *args: object) -> None:
        super().__init__(*(shown(str(arg)) for arg in args))


class CacheUnusable(ExoPinWarning):
    """Machine code cannot be read from the cache on disk or stored there: results are the same, and take longer."""


class BranchChanged(ExoPinWarning):
    """Loops close only on another assembly branch than that of the configuration that was given.

    Examples
    --------
    >>> import warnings
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("error", ep.ExoPinWarning)  # refuse such configurations
    """


class NoisyMovement(ExoPinWarning):
    """Measurement noise makes up much of the forces along a movement.

    Examples
    --------
    >>> import warnings
    >>> exo, times = ep.load("four-cables"), np.linspace(0.0, 0.2, 21)
    >>> jerky = exo.pose(45 + 0.02 * (-1.0) ** np.arange(21))  # ±0.02° from sample to sample
    >>> with warnings.catch_warnings(record=True) as told:
    ...     warnings.simplefilter("always")
    ...     _ = exo.follow(ep.Movement.from_samples(times, jerky, smoothing=None))
    >>> str(told[0].message).split(" (")[0]
    'Measurement noise makes up 73 % of the shoulder force'
    """


class OutsideHumanRange(ExoPinWarning):
    """A pose that a human shoulder of that side does not reach, or a number that looks like one in another unit.

    Examples
    --------
    >>> import warnings
    >>> with warnings.catch_warnings(record=True) as told:
    ...     warnings.simplefilter("always")
    ...     _ = ep.load("prototype").pose(abduction=-90)  # through the trunk
    >>> str(told[0].message).split("; ")[0]
    'this pose cannot be reached by a human left shoulder'
    """


class SuspectMeasurements(ExoPinWarning):
    """Measurements look mislabelled, or given in another frame, order or unit than expected.

    Examples
    --------
    >>> import warnings
    >>> exo = ep.load("prototype")
    >>> pose = exo.pose(np.linspace(0, 60, 9), [10, 30, 20] * 3, [0, 20, -10] * 3)
    >>> swapped = exo.inverse_kinematics(pose).lengths[:, [1, 0, 2]]  # two columns of a table
    >>> with warnings.catch_warnings(record=True) as told:
    ...     warnings.simplefilter("always")
    ...     _ = ep.calibrate(pose, swapped, exo)
    >>> str(told[0].message).split(": ")[1]
    'column 2 is limb 1, column 1 is limb 2'
    """


def warn(text: str, category: type[Warning]) -> None:
    """Warn at the line outside the package that has called it."""
    frame, level = sys._getframe(1), 2
    while frame.f_back is not None and frame.f_globals.get("__name__", "").startswith("exo_pin."):
        frame, level = frame.f_back, level + 1
    warnings.warn(text, category, stacklevel=level)


class BrowserNotFound(ExoPinError, RuntimeError):
    """A still picture needs a browser that draws without a screen, and there is none.

    Attributes
    ----------
    programs : tuple of str
        The programs that were searched for.
    """

    def __init__(self, programs: Iterable[str], variable: str) -> None:
        self.programs = tuple(programs)
        super().__init__(
            f"a still picture needs a headless browser, and none of these is installed: {', '.join(self.programs)}. "
            f"Install one (Debian: chromium) or name it in {variable}; save_html and --html need none"
        )


class BrowserFailed(ExoPinError, RuntimeError):
    """A browser did not draw a scene.

    Attributes
    ----------
    program : str
        The browser.
    """

    def __init__(self, program: str, reason: str) -> None:
        self.program = program
        super().__init__(f"{program}: {reason}")


class SolverFailed(ExoPinError, RuntimeError):
    """A numerical solver did not reach its accuracy.

    Attributes
    ----------
    solver : str
        Name of the solver.
    residual : float
        The residual it stopped at.

    Examples
    --------
    >>> exo = ep.load("prototype")
    >>> try:
    ...     exo.uncertainty(exo.pose(abduction=90))  # plates parallel: singular
    ... except ep.SolverFailed as error:
    ...     print(error.solver, error.residual)
    uncertainty inf
    """

    def __init__(self, solver: str, residual: float, detail: str = "") -> None:
        self.solver, self.residual = solver, float(residual)
        tail = f": {detail}" if detail else ""
        super().__init__(f"{solver} stopped at residual {self.residual:.3e}{tail}")
