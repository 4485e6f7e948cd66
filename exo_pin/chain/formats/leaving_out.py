"""What a reader leaves out of a robot's file: what has no effect, and what the caller names.

Physics that a chain cannot hold is refused, unless the caller names it in ``leave_out``. What was left out stands in
the ``left_out`` of the closures, one entry for each name.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from types import MappingProxyType

from ...core.errors import FileFormatError
from ...core.records import OneProcess
from ...core.validation import as_choice, as_texts

#: What can be left out by name, and what that is.
LEAVE_OUT = MappingProxyType(
    {
        "actuator_rotors": "rotors and damping of actuators that act on tendons, sites or ball joints",
        "ball_limits": "limits of ball and free joints",
        "fluid": "density and viscosity of the air",
        "free_joint_rotors": "rotors and dry friction of free joints",
        "gravcomp": "MuJoCo's compensation of gravity",
        "empty_limits": "limits with the lower one above the upper one: the joint has none",
        "idle_forces": "ranges of force or control without 0, which make an actuator push without control",
        "inertia_rules": "rules that inertias obey: no moment is negative, or above the sum of the others",
        "nonlinear_springs": "what of springs and dampers is not linear",
        "tendons": "springs, damping, friction, rotors, limits and couplings of tendons",
    }
)
#: So many things of one name are said one by one.
_SAID = 6


class LeftOut(OneProcess):
    """What one reading leaves out.

    Parameters
    ----------
    leave_out : iterable of str
        Names of :data:`LEAVE_OUT`.
    error : callable
        Makes the error of the file, or of an element, from a message.

    Raises
    ------
    UnknownName
        If there is no such name.
    """

    def __init__(
        self, leave_out: Iterable[str] = (), error: Callable[[str], FileFormatError] = FileFormatError
    ) -> None:
        given = leave_out if isinstance(leave_out, str) else tuple(leave_out)
        self._named = {as_choice("thing to leave out", name, LEAVE_OUT) for name in as_texts("leave_out", given)}
        self._error, self._found = error, dict[str, list[str]]()

    def named(self, name: str, what: str, advice: str, error: Callable[[str], FileFormatError] | None = None) -> None:
        """Leave out what changes the motion.

        Parameters
        ----------
        name : str
            Of :data:`LEAVE_OUT`.
        what, advice : str
            What it is and where, and how to do without it.
        error : callable, optional
            The error of the element.

        Raises
        ------
        FileFormatError
            If the caller did not name it.
        """
        if name not in self._named:
            raise (error or self._error)(
                f'{what}: {advice}, or leave it out with leave_out=["{name}"] (--leave-out {name})'
            )
        self.say(name, what)

    def say(self, name: str, what: str) -> None:
        """Note what has no effect on the motion, or is no part of a chain."""
        self._found.setdefault(name, []).append(what)

    def has(self, *names: str) -> bool:
        """Whether something of these names was left out."""
        return not self._found.keys().isdisjoint(names)

    @property
    def report(self) -> tuple[str, ...]:
        """One entry for each name: the name, and what was left out."""
        return tuple(f"{name}: {'; '.join(_shortened(whats))}" for name, whats in self._found.items())


def _shortened(whats: list[str]) -> list[str]:
    unique = list(dict.fromkeys(whats))
    return unique if len(unique) <= _SAID else [*unique[: _SAID - 1], f"and {len(unique) - _SAID + 1} more"]
