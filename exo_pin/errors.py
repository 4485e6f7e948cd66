"""What can go wrong, one class a kind, each with its evidence as attributes."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from os import PathLike, fspath
from typing import Any

__all__ = [
    "BeyondLimits",
    "BrowserFailed",
    "BrowserNotFound",
    "ExoPinError",
    "FileFormatError",
    "InfeasibleBounds",
    "InfeasibleForces",
    "InvalidInput",
    "LoopNotClosed",
    "MasslessMotion",
    "MissingData",
    "MissingExtra",
    "NonConvexBound",
    "NotAWrist",
    "SimulationStopped",
    "SolverFailed",
    "UndeterminedMotion",
    "UndrivenMotion",
    "UnknownName",
]


class ExoPinError(Exception):
    """Base of every error that exo_pin raises on purpose."""


class InvalidInput(ExoPinError, ValueError):
    """An argument has a wrong type, shape, range or value."""


class UnknownName(InvalidInput):
    """A name (preset, key, frame, closure type, ...) that nothing answers to.

    Attributes
    ----------
    kind : str
        What was looked for, for example ``"preset"``.
    name : str
        The name that was asked for.
    available : tuple of str
        The names there are.
    """

    def __init__(self, kind: str, name: object, available: Iterable[str], where: str = "") -> None:
        self.kind = kind
        self.name = str(name)
        self.available = tuple(sorted(available))
        near = get_close_matches(self.name, self.available, n=1)
        hint = f" (did you mean {near[0]!r}?)" if near else ""
        place = f" in {where}" if where else ""
        there = ", ".join(self.available) if self.available else "none"
        super().__init__(f"unknown {kind} {self.name!r}{place}{hint}; there are: {there}")


class MissingData(ExoPinError, ValueError):
    """The question needs a value that the mechanism does not have.

    What a source does not print is left out of its parameter set; it never defaults to 0 or 1.

    Attributes
    ----------
    missing : tuple of str
        Names of the values that are needed.
    """

    def __init__(self, missing: Iterable[str], needed_for: str, mechanism: str = "") -> None:
        self.missing = tuple(missing)
        owner = f"mechanism {mechanism!r} has no " if mechanism else "missing: "
        super().__init__(f"{owner}{', '.join(self.missing)}, which {needed_for} needs")


class MissingExtra(ExoPinError, ImportError):
    """A package is needed that comes with an extra of exo_pin.

    Attributes
    ----------
    extra : str
        Name of the extra.
    """

    def __init__(self, extra: str, package: str) -> None:
        self.extra = extra
        super().__init__(f"this needs {package}: pip install 'exo_pin[{extra}]'")


class BrowserNotFound(ExoPinError, RuntimeError):
    """A still picture needs a browser that draws without a screen, and there is none.

    Attributes
    ----------
    programs : tuple of str
        What was looked for.
    """

    def __init__(self, programs: Iterable[str], variable: str) -> None:
        self.programs = tuple(programs)
        super().__init__(
            f"a still picture needs a headless browser, and none of these is there: {', '.join(self.programs)}. "
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


class FileFormatError(InvalidInput):
    """A file cannot be read as what it should be.

    Attributes
    ----------
    path : str or None
        The file.
    key : str or None
        Dotted name of the offending key, for example ``"geometry.circles.base_radius"``.
    """

    def __init__(self, message: str, path: str | PathLike[str] | None = None, key: str | None = None) -> None:
        self.path = None if path is None else fspath(path)
        self.key = key
        super().__init__(f"{self.path}: {message}" if self.path is not None else message)


class LoopNotClosed(ExoPinError, RuntimeError):
    """No closed configuration was found.

    Attributes
    ----------
    q : ndarray
        Shape (nq,), the best configuration reached.
    residual : float
        Largest loop residual there, in m and rad.
    iterations : int
        Iterations spent.
    """

    def __init__(self, q: Any, residual: float, iterations: int) -> None:
        self.q = q
        self.residual = float(residual)
        self.iterations = int(iterations)
        super().__init__(
            f"the loops stay open: residual {self.residual:.3e} (m, rad) after {self.iterations} iterations"
        )


class BeyondLimits(ExoPinError, RuntimeError):
    """The loops close, but only with joints outside their limits.

    Attributes
    ----------
    q : ndarray
        Shape (nq,), the closed configuration.
    joints : tuple of str
        The joints that stand outside their limits there.
    """

    def __init__(self, q: Any, joints: Iterable[str]) -> None:
        self.q = q
        self.joints = tuple(joints)
        super().__init__(f"the loops close only beyond the limits of {', '.join(self.joints)}")


class UndeterminedMotion(ExoPinError, RuntimeError):
    """The motion of the given joints leaves others free.

    Attributes
    ----------
    q : ndarray
        Shape (nq,), the configuration.
    free : int
        How many freedoms are left.
    """

    def __init__(self, q: Any, free: int) -> None:
        self.q = q
        self.free = int(free)
        super().__init__(
            f"the given joints leave {self.free} freedom{'s' if self.free > 1 else ''} of the chain open at this "
            "configuration: give more joints, or keep away from the singularity"
        )


class UndrivenMotion(ExoPinError, RuntimeError):
    """The actuators and closures cannot make the motion, whatever they give.

    Attributes
    ----------
    q : ndarray
        Shape (nq,), the configuration.
    missing : ndarray
        Shape (nv,), the generalised force that nothing makes, N and N m.
    joints : tuple of str
        Joints of which a generalised force is missing, the largest first.
    """

    def __init__(self, q: Any, missing: Any, joints: Iterable[str]) -> None:
        self.q = q
        self.missing = missing
        self.joints = tuple(joints)
        super().__init__(
            f"no actuator makes this motion: a generalised force of {float(abs(missing).max()):.3g} (N, N m) is "
            f"missing in {', '.join(self.joints[:4])}{', ...' if len(self.joints) > 4 else ''}; name more actuators, "
            "or ask forward_dynamics how the chain moves"
        )


class InfeasibleForces(ExoPinError, RuntimeError):
    """No forces within the bounds make the motion.

    Attributes
    ----------
    excess : float
        How far, N or N m, the bounds would have to give at least if all gave alike.
    bounds : tuple of str
        The bounds that stand in each other's way.
    """

    def __init__(self, excess: float, bounds: Iterable[str]) -> None:
        self.excess = float(excess)
        self.bounds = tuple(bounds)
        super().__init__(
            f"no forces within the bounds make this motion: {', '.join(self.bounds)} would have to give "
            f"{self.excess:.3g} (N, N m)"
        )


class MasslessMotion(ExoPinError, ValueError):
    """Some motion of the chain moves no mass, so no acceleration follows from forces.

    Attributes
    ----------
    joints : tuple of str
        Joints that move in it, the most moved first.
    """

    def __init__(self, joints: Iterable[str]) -> None:
        self.joints = tuple(joints)
        super().__init__(
            f"moving {', '.join(self.joints[:4])}{', ...' if len(self.joints) > 4 else ''} moves no mass, so no "
            "acceleration follows from the forces: give the links mass (of a wrist's limbs, as Limb.base_body and "
            "Limb.platform_body), or take these joints out"
        )


class NotAWrist(ExoPinError, RuntimeError):
    """A closed form of the wrist was asked of a robot that is none, or is not known to be one.

    Attributes
    ----------
    robot : str
        Its name.
    reason : str
        Why.
    """

    def __init__(self, robot: str, reason: str) -> None:
        self.robot = robot
        self.reason = reason
        super().__init__(f"{robot!r} has no wrist's closed form: {reason}")


class NonConvexBound(InvalidInput):
    """The bound ``|g_i| <= |f_i|`` is not convex where f_i is itself chosen and may take both signs."""


class InfeasibleBounds(InvalidInput):
    """A lower bound stands above its upper bound.

    Attributes
    ----------
    limbs : tuple of int
        Indices of the limbs concerned, from 0.
    """

    def __init__(self, limbs: Iterable[int]) -> None:
        self.limbs = tuple(int(i) for i in limbs)
        super().__init__(f"lower bound above upper bound for limb index {', '.join(map(str, self.limbs))}")


class SolverFailed(ExoPinError, RuntimeError):
    """A numerical solver did not reach its accuracy.

    Attributes
    ----------
    solver : str
        Name of the solver.
    residual : float
        The residual it stopped at.
    """

    def __init__(self, solver: str, residual: float, detail: str = "") -> None:
        self.solver = solver
        self.residual = float(residual)
        tail = f": {detail}" if detail else ""
        super().__init__(f"{solver} stopped at residual {self.residual:.3e}{tail}")


class SimulationStopped(ExoPinError, RuntimeError):
    """A motion cannot be followed any further, as a rule because it has run into a singular configuration.

    Attributes
    ----------
    time : float
        How far it was followed, s.
    q, v : ndarray
        The state there, shapes (nq,) and (nv,).
    """

    def __init__(self, time: float, q: Any, v: Any, reason: str) -> None:
        self.time = float(time)
        self.q = q
        self.v = v
        super().__init__(
            f"the motion was followed to {self.time:.6g} s, where {reason}: as a rule the chain stands in a singular "
            "configuration there, from which more than one motion goes on"
        )
