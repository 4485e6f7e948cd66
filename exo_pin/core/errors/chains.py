"""Errors of closed chains: loops that do not close, motions and forces that do not exist.

Errors of forces and accelerations of closed chains.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from .base import ExoPinError


def few(joints: tuple[str, ...]) -> str:
    """The first joints of a list, for a message."""
    return ", ".join(joints[:4]) + (", ..." if len(joints) > 4 else "")


#: Residuals below this, m and rad, may come from the rounding of a file with two or three decimals.
_ROUNDED = 0.02


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

    Examples
    --------
    >>> lever = '<body><joint axis="0 1 0"/><geom size="0.1"/><site name="tip" pos="1 0 0"/></body>'
    >>> wall, loop = '<site name="wall" pos="3 0 0"/>', '<connect site1="wall" site2="tip"/>'
    >>> mjcf = f"<mujoco><worldbody>{lever}{wall}</worldbody><equality>{loop}</equality></mujoco>"
    >>> try:
    ...     ep.ClosedChain.from_mjcf(mjcf).close([0.1])
    ... except ep.LoopNotClosed as error:
    ...     print(round(error.residual, 6))  # m: a lever of 1 m does not reach 3 m
    2.000001
    """

    def __init__(
        self, q: Any, residual: float, iterations: int, target: str = "", reached: float | None = None
    ) -> None:
        self.q, self.residual, self.iterations = q, float(residual), int(iterations)
        if reached is not None:
            text = (
                f"the branch ends after {100.0 * reached:.3g} % of the way: a link is stretched or folded, or the "
                "configuration is singular: give positions before it, or start on another branch"
            )
        elif target:
            text = (
                f"{target} does not reach its target: {self.residual:.3e} (m, rad) are left after {self.iterations} "
                "iterations: start from another configuration, or give a target within reach"
            )
        elif self.iterations:
            rounded = ""
            if self.residual < _ROUNDED:
                rounded = (
                    "; where the file's numbers are rounded, write them with six decimals or more, or state "
                    "geometry_tolerance (half a unit of the last decimal) in its closures file"
                )
            text = (
                f"the loops stay open: residual {self.residual:.3e} (m, rad) after {self.iterations} iterations, "
                "expected closed loops: start from another configuration, or check the lengths of the links" + rounded
            )
        else:
            text = f"the loops are open: residual {self.residual:.3e} (m, rad), expected closed loops: use close(q)"
        super().__init__(text)


class BeyondLimits(ExoPinError, RuntimeError):
    """The loops close, but only with joints outside their limits.

    Attributes
    ----------
    q : ndarray
        Shape (nq,), the closed configuration.
    joints : tuple of str
        The joints that are outside their limits there.

    Examples
    --------
    >>> limit = '<joint name="{1}" axis="0 1 0" range="-50 50"/>'
    >>> lever = '<body pos="{0} 0 0">' + limit + '<geom size="0.1"/><site name="{1}" pos="0 0 1"/></body>'
    >>> levers, loop = lever.format(0, "a") + lever.format(1.9, "b"), '<connect site1="a" site2="b"/>'
    >>> mjcf = f"<mujoco><worldbody>{levers}</worldbody><equality>{loop}</equality></mujoco>"
    >>> try:
    ...     ep.ClosedChain.from_mjcf(mjcf).close([0.5, -0.5], respect_limits=True)
    ... except ep.BeyondLimits as error:
    ...     print(error.joints, np.degrees(error.q).round(1))
    ('a', 'b') [ 71.8 -71.8]
    """

    def __init__(self, q: Any, joints: Iterable[str]) -> None:
        self.q, self.joints = q, tuple(joints)
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
    joints : tuple of str
        The joints that can still move.

    Examples
    --------
    >>> chain = ep.load("prototype").chain
    >>> try:
    ...     chain.dependent_motion(chain.close(chain.neutral()), ["limb_1_slide"], [0.1])
    ... except ep.UndeterminedMotion as error:
    ...     print(error.free, error.joints[0])  # of the three freedoms, with one slide given
    2 root_joint
    """

    def __init__(self, q: Any, free: int, joints: Iterable[str]) -> None:
        self.q, self.free, self.joints = q, int(free), tuple(joints)
        super().__init__(
            f"the given joints do not determine {self.free} freedom{'s' if self.free > 1 else ''} of the chain at this "
            f"configuration: {few(self.joints)} can still move: give more joints, move away from the singularity, "
            "or take out a joint that turns freely (such as a rod about itself)"
        )


class SingularConfiguration(ExoPinError, RuntimeError):
    """Every acceleration opens the loops in this state: the configuration is singular for its velocity.

    Attributes
    ----------
    q, v : ndarray
        The state, shapes (nq,) and (nv,).
    opening : float
        Least acceleration by which the loops open, characteristic lengths and rad a second squared.

    Examples
    --------
    >>> link = '<body pos="{} 0 0"><joint axis="0 1 0"/><geom size="0.1"/>{}</body>'
    >>> links = link.format(0, link.format(1, '<site name="tip" pos="1 0 0"/>')) + '<site name="wall" pos="2 0 0"/>'
    >>> loop = '<connect site1="tip" site2="wall"/>'
    >>> mjcf = f"<mujoco><worldbody>{links}</worldbody><equality>{loop}</equality></mujoco>"
    >>> try:  # two links, stretched out between fixed ends, whose middle moves
    ...     ep.ClosedChain.from_mjcf(mjcf).forward_dynamics([0.0, 0.0], [1.0, -2.0])
    ... except ep.SingularConfiguration as error:
    ...     print(round(error.opening**2, 6))  # (1 + 1 m/s²) over a characteristic length of √2 m, squared
    2.0
    """

    def __init__(self, q: Any, v: Any, opening: float) -> None:
        self.q, self.v, self.opening = q, v, float(opening)
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

    Examples
    --------
    >>> link = '<body pos="{} 0 0"><joint axis="0 1 0"/><geom size="0.1"/>{}</body>'
    >>> links = link.format(0, link.format(1, '<site name="tip" pos="1 0 0"/>')) + '<site name="wall" pos="2 0 0"/>'
    >>> loop = '<connect site1="tip" site2="wall"/>'
    >>> mjcf = f"<mujoco><worldbody>{links}</worldbody><equality>{loop}</equality></mujoco>"
    >>> try:  # two links, all but stretched out between fixed ends
    ...     ep.ClosedChain.from_mjcf(mjcf).forward_dynamics([1e-7, -2e-7])
    ... except ep.NearSingularConfiguration as error:
    ...     print(error.error > error.singular_value)
    True
    """

    def __init__(self, q: Any, singular_value: float, error: float) -> None:
        self.q, self.singular_value, self.error = q, float(singular_value), float(error)
        super().__init__(
            f"the configuration is too near a singular one: its smallest singular value, {self.singular_value:.2e}, "
            f"has an error of {self.error:.1e}, so forces and accelerations depend on rounding; close the loops "
            "more accurately (close(q, tolerance=1e-14)), or move away from the singular configuration; if the robot's "
            "file rounds right angles (1.5708), read it with right_angle_tolerance=2e-5"
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
        self.q, self.missing, self.joints = q, missing, tuple(joints)
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
        self.excess, self.bounds = float(excess), tuple(bounds)
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
    in_line : tuple of str
        Two of them, hinges that turn about one line there, as two of a ball that is written as hinges.

    Examples
    --------
    >>> tree = ep.ClosedChain(ep.load("four-cables").chain.model, ep.chain.Closures())  # loose limbs without mass
    >>> try:
    ...     tree.forward_dynamics(tree.neutral())
    ... except ep.MasslessMotion as error:
    ...     print(error.joints[0])
    limb_1_platform_y
    """

    def __init__(self, joints: Iterable[str], in_line: Iterable[str] = ()) -> None:
        self.joints, self.in_line = tuple(joints), tuple(in_line)
        said = "give the links mass (of a wrist's limbs, as Limb.base_body and Limb.platform_body), or take "
        said += "these joints out"
        if self.in_line:
            said = f"{' and '.join(self.in_line)} turn about one line here (gimbal lock): write a ball of hinges as a "
            said += "ball joint, or give the links between mass"
        super().__init__(
            f"moving {few(self.joints)} moves no mass, so forces do not determine the acceleration: {said}"
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
        self.time, self.q, self.v = float(time), q, v
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
        self.effect, self.joints = effect, tuple(joints)
        super().__init__(
            f"{effect} in {few(self.joints)} is not part of this function, and forces would be wrong "
            f"without it: {advice}"
        )
