"""Errors of forces and accelerations of closed chains."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from .base import ExoPinError
from .chains import few


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

    Examples
    --------
    >>> body = '<body><joint axis="0 1 0" name="pendulum"/><geom mass="2" size="0.05" pos="0.5 0 0"/></body>'
    >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody>{body}</worldbody></mujoco>")
    >>> try:
    ...     chain.inverse_dynamics([0.0], actuated=())
    ... except ep.UndrivenMotion as error:
    ...     print(error.joints, error.missing.round(2))  # N m: 2 kg, level, half a metre out
    ('pendulum',) [-9.81]
    """

    def __init__(self, q: Any, missing: Any, joints: Iterable[str]) -> None:
        self.q = q
        self.missing = missing
        self.joints = tuple(joints)
        super().__init__(
            f"no actuator makes this motion: a generalised force of {float(abs(missing).max()):.3g} (N, N m) is "
            f"missing in {few(self.joints)}; name more actuators, "
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

    Examples
    --------
    >>> body = '<body><joint name="lift" type="slide" axis="0 0 1"/><geom mass="2" size="0.05"/></body>'
    >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody>{body}</worldbody></mujoco>")
    >>> try:
    ...     chain.inverse_dynamics([0.0], actuated=["lift"], effort_bounds={"lift": (0.0, 15.0)})
    ... except ep.InfeasibleForces as error:
    ...     print(round(error.excess, 2))  # N that are missing: 2 kg weigh 19.62 N
    4.62
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

    Examples
    --------
    >>> chain = ep.load("four-cables").chain  # its limbs have no mass
    >>> try:
    ...     chain.forward_dynamics(chain.close(chain.neutral()), method="proximal")
    ... except ep.MasslessMotion as error:
    ...     print(error.joints[0])
    limb_1_platform_y
    """

    def __init__(self, joints: Iterable[str]) -> None:
        self.joints = tuple(joints)
        super().__init__(
            f"moving {few(self.joints)} moves no mass, so forces "
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

    Examples
    --------
    >>> slide = '<body><joint name="slide" type="slide" axis="0 0 1" range="-1 0"/><geom size="0.1"/></body>'
    >>> crank = '<body><joint name="crank" axis="0 1 0"/><geom size="0.1"/></body>'
    >>> cam = '<joint joint1="slide" joint2="crank" polycoef="0 0 0.1 0 0"/>'  # lifts by 0.1 of the angle squared
    >>> mjcf = f"<mujoco><worldbody>{slide}{crank}</worldbody><equality>{cam}</equality></mujoco>"
    >>> try:
    ...     ep.ClosedChain.from_mjcf(mjcf).forward_dynamics([0.0, 0.0], [0.0, 1.0], stops=True)
    ... except ep.MotionBlocked as error:
    ...     print(error.joints)
    ('slide',)
    """

    def __init__(self, joints: Iterable[str]) -> None:
        self.joints = tuple(joints)
        super().__init__(
            f"the loops move {few(self.joints)} into the stop at "
            "this velocity, whatever forces act, so that no motion is possible: expected limits that the chain can "
            "reach and leave, or another velocity"
        )


class SimulationStopped(ExoPinError, RuntimeError):
    """A motion cannot be integrated any further; the message has the reason.

    Attributes
    ----------
    time : float
        Time of the last state, s.
    q, v : ndarray
        The state there, shapes (nq,) and (nv,).

    Examples
    --------
    >>> body = '<body><joint type="slide" axis="1 0 0"/><geom mass="1" size="0.05"/></body>'
    >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody>{body}</worldbody></mujoco>")
    >>> switch = lambda time, q, v: [-5.0 if v[0] > 0.0 else 5.0]  # without end once it stands still
    >>> try:
    ...     chain.simulate([0.0], [1.0], [0.0, 1.0], switch)
    ... except ep.SimulationStopped as error:
    ...     print(round(error.time, 3))  # s: 1 m/s of 1 kg against 5 N
    0.2
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
            f"{effect} in {few(self.joints)} is not part of this function, and forces would be wrong "
            f"without it: {advice}"
        )
