"""Errors of closed chains: loop closure, motion, forces."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from .base import ExoPinError

__all__ = [
    "BeyondLimits",
    "InfeasibleForces",
    "LoopNotClosed",
    "MasslessMotion",
    "NearSingularConfiguration",
    "SimulationStopped",
    "SingularConfiguration",
    "UndeterminedMotion",
    "UndrivenMotion",
    "UnsupportedDynamics",
]


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
        The joints that are outside their limits there.
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
        Shape (nv,), the part of the generalised force that no actuator supplies, N and N m.
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
        The bounds that contradict each other.
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


class SingularConfiguration(ExoPinError, RuntimeError):
    """No acceleration satisfies the loop-closure constraints in this state.

    Attributes
    ----------
    q, v : ndarray
        The state, shapes (nq,) and (nv,).
    opening : float
        Acceleration by which the loops would part at least, characteristic lengths and rad a second squared.
    """

    def __init__(self, q: Any, v: Any, opening: float) -> None:
        self.q = q
        self.v = v
        self.opening = float(opening)
        super().__init__(
            f"the chain is in a singular configuration, and no acceleration fits its velocity: the loops "
            f"would part by {self.opening:.3g} (lengths and rad a second squared)"
        )


class NearSingularConfiguration(ExoPinError, RuntimeError):
    """A configuration is so near a singular one that forces or accelerations would depend on rounding.

    Attributes
    ----------
    q : ndarray
        Shape (nq,).
    singular_value : float
        The smallest singular value that is not zero, of a matrix whose entries are of order one.
    error : float
        How well it is known, given how well the loops are closed.
    """

    def __init__(self, q: Any, singular_value: float, error: float) -> None:
        self.q = q
        self.singular_value = float(singular_value)
        self.error = float(error)
        super().__init__(
            f"the configuration is too near a singular one: its smallest singular value, {self.singular_value:.2e}, is "
            f"known to {self.error:.1e} only, so forces and accelerations would depend on rounding; close the loops "
            "more accurately (close(q, tolerance=1e-14)), or move away from the singular configuration"
        )


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
            f"the motion was integrated to {self.time:.6g} s, where {reason}: as a rule the chain is in a singular "
            "configuration there, from which more than one motion goes on"
        )


class UnsupportedDynamics(ExoPinError, ValueError):
    """Forces of a chain depend on something that is not modelled.

    Attributes
    ----------
    effect : str
        What it is, for example ``"dry friction"``.
    joints : tuple of str
        The joints that have it.
    """

    def __init__(self, effect: str, joints: Iterable[str], advice: str) -> None:
        self.effect = effect
        self.joints = tuple(joints)
        more = ", ..." if len(self.joints) > 4 else ""
        super().__init__(
            f"{effect} in {', '.join(self.joints[:4])}{more} is not modelled, and forces would be wrong without it: "
            f"{advice}"
        )
