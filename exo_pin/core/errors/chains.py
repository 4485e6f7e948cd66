"""Errors of closed chains: loops that do not close, motions and forces that do not exist."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from .base import ExoPinError


def _few(joints: tuple[str, ...]) -> str:
    """The first joints of a list, for a message."""
    return ", ".join(joints[:4]) + (", ..." if len(joints) > 4 else "")


class LoopNotClosed(ExoPinError, RuntimeError):
    """No closed configuration was found.

    Attributes
    ----------
    q : ndarray
        Shape (nq,), the best configuration reached.
    residual : float
        Largest loop residual there, in m and rad.
    iterations : int
        Number of iterations.
    """

    def __init__(self, q: Any, residual: float, iterations: int) -> None:
        self.q = q
        self.residual = float(residual)
        self.iterations = int(iterations)
        if self.iterations:
            text = (
                f"the loops stay open: residual {self.residual:.3e} (m, rad) after {self.iterations} iterations, "
                "expected closed loops: start from another configuration, or check the lengths of the links"
            )
        else:
            text = (
                f"the loops are open: residual {self.residual:.3e} (m, rad), expected a closed configuration: close it"
            )
        super().__init__(text)


class BeyondLimits(ExoPinError, RuntimeError):
    """The loops close, but only with joints outside their limits.

    Attributes
    ----------
    q : ndarray
        Shape (nq,), the closed configuration.
    joints : tuple of str
        The joints that are outside their limits there.
    """

    def __init__(self, q: Any, joints: Iterable[str]) -> None:
        self.q = q
        self.joints = tuple(joints)
        super().__init__(
            f"the loops close only beyond the limits of {', '.join(self.joints)}: start from another configuration, or "
            "do not respect the limits"
        )


class UndeterminedMotion(ExoPinError, RuntimeError):
    """The motion of the given joints does not determine that of all others.

    Attributes
    ----------
    q : ndarray
        Shape (nq,), the configuration.
    free : int
        Number of undetermined freedoms.
    """

    def __init__(self, q: Any, free: int) -> None:
        self.q = q
        self.free = int(free)
        super().__init__(
            f"the given joints do not determine {self.free} freedom{'s' if self.free > 1 else ''} of the chain at this "
            "configuration: give more joints, or a configuration farther from the singularity"
        )


class UndrivenMotion(ExoPinError, RuntimeError):
    """No efforts of the actuators make the motion.

    Attributes
    ----------
    q : ndarray
        Shape (nq,), the configuration.
    missing : ndarray
        Shape (nv,), the generalised force that no actuator or closure makes, N and N m.
    joints : tuple of str
        Joints where a generalised force is missing, the largest first.
    """

    def __init__(self, q: Any, missing: Any, joints: Iterable[str]) -> None:
        self.q = q
        self.missing = missing
        self.joints = tuple(joints)
        super().__init__(
            f"no actuator makes this motion: a generalised force of {float(abs(missing).max()):.3g} (N, N m) is "
            f"missing in {_few(self.joints)}; name more actuators, "
            "or compute the motion of the chain by forward_dynamics"
        )


class InfeasibleForces(ExoPinError, RuntimeError):
    """No forces within the bounds make the motion.

    Attributes
    ----------
    excess : float
        Least amount, N or N m, by which all bounds would have to be relaxed.
    bounds : tuple of str
        The conflicting bounds.
    """

    def __init__(self, excess: float, bounds: Iterable[str]) -> None:
        self.excess = float(excess)
        self.bounds = tuple(bounds)
        super().__init__(
            f"no forces within the bounds make this motion: {', '.join(self.bounds)} are in conflict, relax them by "
            f"{self.excess:.3g} (N, N m) or more"
        )


class MasslessMotion(ExoPinError, ValueError):
    """Some motion of the chain has no inertia, so forces do not determine an acceleration.

    Attributes
    ----------
    joints : tuple of str
        Joints that move in it, the most moved first.
    """

    def __init__(self, joints: Iterable[str]) -> None:
        self.joints = tuple(joints)
        super().__init__(
            f"moving {_few(self.joints)} moves no mass, so forces "
            "do not determine the acceleration: give the links mass (of a wrist's limbs, as Limb.base_body and "
            "Limb.platform_body), or take these joints out"
        )


class MotionBlocked(ExoPinError, RuntimeError):
    """Every acceleration that keeps the loops closed moves a joint into its stop, whatever forces act.

    The velocity alone causes it: a joint at its stop has an acceleration J̇ v that no other joint can change, as at the
    dead centre of a crank.

    Attributes
    ----------
    joints : tuple of str
        The joints at their stops that are moved into them.
    """

    def __init__(self, joints: Iterable[str]) -> None:
        self.joints = tuple(joints)
        super().__init__(
            f"the loops move {_few(self.joints)} into the stop at "
            "this velocity, whatever forces act, so that no motion is possible: expected limits that the chain can "
            "reach and leave, or another velocity"
        )


class SingularConfiguration(ExoPinError, RuntimeError):
    """Every acceleration opens the loops in this state: the configuration is singular for its velocity.

    Attributes
    ----------
    q, v : ndarray
        The state, shapes (nq,) and (nv,).
    opening : float
        Least acceleration by which the loops open, characteristic lengths and rad a second squared.
    """

    def __init__(self, q: Any, v: Any, opening: float) -> None:
        self.q = q
        self.v = v
        self.opening = float(opening)
        super().__init__(
            f"the configuration is singular and every acceleration opens the loops, by {self.opening:.3g} "
            "(characteristic lengths and rad a second squared) or more: start from another configuration or velocity"
        )


class NearSingularConfiguration(ExoPinError, RuntimeError):
    """A configuration is so near a singular one that forces or accelerations depend on rounding.

    Attributes
    ----------
    q : ndarray
        Shape (nq,).
    singular_value : float
        The smallest singular value that is not zero, of a matrix whose entries are of order one.
    error : float
        Its error, from the residual of the loops and rounding.
    """

    def __init__(self, q: Any, singular_value: float, error: float) -> None:
        self.q = q
        self.singular_value = float(singular_value)
        self.error = float(error)
        super().__init__(
            f"the configuration is too near a singular one: its smallest singular value, {self.singular_value:.2e}, "
            f"has an error of {self.error:.1e}, so forces and accelerations depend on rounding; close the loops "
            "more accurately (close(q, tolerance=1e-14)), or move away from the singular configuration; if the robot's "
            "file rounds right angles (1.5708), read it with right_angle_tolerance=2e-5"
        )


class SimulationStopped(ExoPinError, RuntimeError):
    """A motion cannot be integrated any further; the message has the reason.

    Attributes
    ----------
    time : float
        Time of the last state, s.
    q, v : ndarray
        The state there, shapes (nq,) and (nv,).
    """

    def __init__(self, time: float, q: Any, v: Any, reason: str) -> None:
        self.time = float(time)
        self.q = q
        self.v = v
        super().__init__(f"the simulation stopped at {self.time:.6g} s: {reason}")


class UnsupportedDynamics(ExoPinError, ValueError):
    """Forces of a chain depend on an effect that the function does not compute.

    Attributes
    ----------
    effect : str
        Its name, for example ``"dry friction"``.
    joints : tuple of str
        The joints that have it.
    """

    def __init__(self, effect: str, joints: Iterable[str], advice: str) -> None:
        self.effect = effect
        self.joints = tuple(joints)
        super().__init__(
            f"{effect} in {_few(self.joints)} is not part of this function, and forces would be wrong "
            f"without it: {advice}"
        )


class SamplesFailed(ExoPinError, RuntimeError):
    """Some samples of a stack have no answer; all others have theirs.

    Attributes
    ----------
    failures : dict of int to ExoPinError
        What was wrong, by the sample's place in the stack.
    result : object
        The answer of the whole stack. In the rows of these samples its numbers are NaN.
    """

    def __init__(self, failures: dict[int, ExoPinError], count: int, result: Any) -> None:
        self.failures, self.result = failures, result
        shown = "; ".join(f"sample {k}: {error}" for k, error in list(failures.items())[:3])
        more = "; ..." if len(failures) > 3 else ""
        super().__init__(
            f"{len(failures)} of {count} samples failed: {shown}{more}. The error's failures lists all, its result has "
            "the others' answers"
        )
