"""Forces of many samples at once: a trajectory's efforts, multipliers and reactions.

Each sample is answered alone; one without an answer marks itself.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.errors import ExoPinError, InvalidInput, SamplesFailed, UnknownName
from ...core.errors.checked import checked
from ...core.progress import track
from ...core.records import Record
from ...core.validation import LARGEST, FloatArray, as_mapping, as_real, frozen
from ..kinematics import closing
from ..kinematics.loops import project_acceleration, project_velocity
from ..structure.chain_state import ChainState
from .reactions import ClosedForces
from .wrenches import JointReaction, transmitting_part

#: Forces of one sample at q, v and a, under wrenches on frames.
One = Callable[[FloatArray, FloatArray | None, FloatArray | None, Mapping[str, FloatArray] | None], ClosedForces]


@checked
@dataclass(frozen=True, eq=False)
class ClosedForcesStack(Record):
    """Forces in a closed chain in n samples, such as those of a trajectory.

    A sample without an answer has its reason in ``status`` and ``failures``; its numbers are NaN, and no other sample
    is affected. The others are as :meth:`ClosedChain.inverse_dynamics` has them one by one.

    Attributes
    ----------
    q, v, a : ndarray
        Shapes (n, nq), (n, nv), (n, nv), the motion to which the forces belong.
    tau, friction : ndarray
        Shape (n, nv), efforts and dry friction, N or N m.
    multipliers : ndarray
        λ, shape (n, rows).
    residual : ndarray
        Shape (n,), the largest error of the equations of motion, N and N m.
    undetermined : ndarray of int
        Shape (n,), dimension of the self-stresses; -1 without an answer.
    effort_is_unique : ndarray of bool
        Shape (n, nv), false without an answer.
    status : ndarray of str
        Shape (n,): "ok", or the error's name in words: "loop_not_closed", "undriven_motion", ...
    failures : mapping of int to ExoPinError
        The errors, by sample.

    Examples
    --------
    >>> rod = '<joint name="hinge" axis="0 1 0"/><inertial mass="2" pos="0 0 -0.5" diaginertia="1 1 1"/>'
    >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{rod}</body></worldbody></mujoco>")
    >>> forces = chain.inverse_dynamics(np.deg2rad([[0.0], [30.0], [90.0]]), actuated=["hinge"])
    >>> forces.tau[:, 0].round(3), forces.status.tolist()  # N m: m g r sin q
    (array([0.   , 4.905, 9.81 ]), ['ok', 'ok', 'ok'])
    """

    q: FloatArray
    v: FloatArray
    a: FloatArray
    tau: FloatArray
    friction: FloatArray
    multipliers: FloatArray
    residual: FloatArray
    undetermined: NDArray[np.int64]
    effort_is_unique: NDArray[np.bool_]
    status: NDArray[np.str_]
    failures: Mapping[int, ExoPinError]
    state: ChainState = field(repr=False)
    _forces: Mapping[int, ClosedForces] = field(repr=False)  # of samples with an answer

    def __len__(self) -> int:
        return len(self.q)

    def __str__(self) -> str:
        lines = [f"forces of {len(self)} samples, {len(self) - len(self.failures)} with an answer"]
        for name in self.state.roles.actuated if len(self) > len(self.failures) else ():
            low, high = (np.round(of(self.effort(name), axis=0), 6) + 0.0 for of in (np.nanmin, np.nanmax))
            lines.append(f"effort of {name:24} from {low} to {high}")
        lines += [f"sample {k}: {error}" for k, error in list(self.failures.items())[:3]]
        return "\n".join([*lines, *(["..."] if len(self.failures) > 3 else [])])

    def effort(self, joint: str) -> FloatArray:
        """Effort of a joint's actuator, shape (n, nv of the joint), N or N m.

        Parameters
        ----------
        joint : str
            Name of a joint of the tree.

        Returns
        -------
        ndarray
            Shape (n, nv of the joint), N or N m.

        Examples
        --------
        >>> rod = '<joint name="hinge" axis="0 1 0"/><inertial mass="2" pos="0 0 -0.5" diaginertia="0.1 0.1 0.1"/>'
        >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{rod}</body></worldbody></mujoco>")
        >>> forces = chain.inverse_dynamics(np.zeros((2, 1)), a=[[1.0], [2.0]], actuated=["hinge"])
        >>> forces.effort("hinge").round(6).tolist()  # N m, of an inertia of 0.6 kg m²
        [[0.6], [1.2]]
        """
        return self.tau[:, self.state.velocity_slice(joint)].copy()

    def joint_reaction(
        self,
        joint: str,
        on: str | None = None,
        at: str | ArrayLike = "origin",
        in_frame: str = "world",
        intervals: bool = True,
    ) -> JointReaction:
        """Wrench that a tree joint or a closure transmits, in every sample.

        Parameters, and what is raised, are those of :meth:`exo_pin.chain.ClosedForces.joint_reaction`.

        Parameters
        ----------
        joint, on, at, in_frame, intervals
            As there.

        Returns
        -------
        JointReaction
            A stack of n.

        Examples
        --------
        >>> rod = '<joint name="hinge" axis="0 1 0"/><inertial mass="2" pos="0 0 -0.5" diaginertia="1 1 1"/>'
        >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{rod}</body></worldbody></mujoco>")
        >>> forces = chain.inverse_dynamics(np.zeros((3, 1)), [[0.0], [2.0], [4.0]], actuated=["hinge"])
        >>> forces.joint_reaction("hinge").wrench[:, 2].round(2)  # N: m (g + ω² r)
        array([19.62, 23.62, 35.62])
        """
        part = transmitting_part(self.state, joint)
        receiver = self.state.body_names[part.receiver] if on is None else on
        return self._reaction(joint, receiver, lambda forces: forces.joint_reaction(joint, on, at, in_frame, intervals))

    def wrench_on(
        self, body: str, at: str | ArrayLike = "origin", in_frame: str = "world", intervals: bool = True
    ) -> JointReaction:
        """Total wrench of all joints and closures on a body, in every sample.

        Parameters, and what is raised, are those of :meth:`exo_pin.chain.ClosedForces.wrench_on`.

        Parameters
        ----------
        body, at, in_frame, intervals
            As there.

        Returns
        -------
        JointReaction
            A stack of n.

        Examples
        --------
        >>> exo = ep.load("three-linear-actuators")
        >>> chain = exo.chain
        >>> q = chain.close(chain.neutral())
        >>> forces = chain.inverse_dynamics(np.stack([q, q]), external={"arm": [[0.0] * 6, [0, 0, -10, 0, 0, 0]]})  # N
        >>> on_arm = forces.wrench_on("arm", intervals=False).wrench[:, 2]
        >>> (on_arm - 9.81 * exo.arm.mass).round(9) + 0.0  # N: its weight, and in the second sample the load
        array([ 0., 10.])
        """
        self.state.body_index(body)
        name = "all joints and closures"
        return self._reaction(name, body, lambda forces: forces.wrench_on(body, at, in_frame, intervals))

    def _reaction(self, name: str, receiver: str, of: Callable[[ClosedForces], JointReaction]) -> JointReaction:
        found = {k: of(forces) for k, forces in self._forces.items()}
        count, free = len(self), max((one.undetermined for one in found.values()), default=0)
        wrench, interval = np.full((count, 6), np.nan), np.full((count, 6, 2), np.nan)
        unique, directions = np.zeros((count, 6), dtype=np.bool_), np.zeros((count, 6, free))
        for k, one in found.items():
            wrench[k], unique[k], interval[k] = one.wrench, one.unique, one.interval
            directions[k, :, : one.undetermined] = one.directions
        return JointReaction(name, receiver, frozen(wrench), frozen(unique), frozen(directions), frozen(interval))


def stack_of_forces(
    state: ChainState,
    motion: tuple[ArrayLike, ArrayLike | None, ArrayLike | None],
    external: Mapping[str, ArrayLike] | None,
    one: One,
    close: bool,
    progress: bool,
) -> ClosedForcesStack:
    """Forces of n samples.

    Parameters
    ----------
    state : ChainState
        The chain.
    motion : tuple of array_like
        q, v, a of shapes (n, nq), (n, nv) and (n, nv); zero for None.
    external : mapping or None
        Frame name to wrench, shape (6,) or (n, 6).
    one : callable
        :data:`One`.
    close : bool
        Whether to close the loops and to project the motion.
    progress : bool
        Whether to show a bar.
    """
    q = as_real("q", motion[0])
    if q.ndim != 2 or q.shape[1] != state.nq:
        raise InvalidInput(f"expected q to have shape (n, {state.nq}), got {q.shape}")
    v, a = (
        None if rates is None else _shaped(name, rates, len(q), state.nv)
        for name, rates in zip("va", motion[1:], strict=True)
    )
    wrenches = {
        name: _shaped(f"external[{name!r}]", given, len(q), 6)
        for name, given in as_mapping("external", external, "frames to wrenches").items()
    }
    errors: dict[int, ExoPinError] = {}
    if close:
        _close(state, q, errors, progress)
        a = np.zeros((len(q), state.nv)) if a is None and v is not None else a
    found = dict[int, ClosedForces]()
    for k in track([k for k in range(len(q)) if k not in errors], "forces", progress):
        try:
            speed, rate = (None if rates is None else rates[k] for rates in (v, a))
            if close:
                speed, rate = projected(state, q[k], speed, rate)
            forces = one(q[k], speed, rate, {name: given[k] for name, given in wrenches.items()} or None)
        except UnknownName:  # a mistake of the question, not of the sample
            raise
        except ExoPinError as error:
            errors[k] = error
            continue
        for rates, own in ((v, speed), (a, rate)):
            if rates is not None:
                rates[k] = own
        found[k] = forces

    def filled(of: Callable[[ClosedForces], Any], empty: Any, *shape: int) -> Any:
        """Values of the samples, ``empty`` where there is no answer."""
        out = np.full((len(q), *shape), empty)
        for k, forces in found.items():
            out[k] = of(forces)
        return frozen(out)

    v, a = (np.zeros((len(q), state.nv)) if rates is None else rates for rates in (v, a))
    words = {k: re.sub(r"(?<!^)(?=[A-Z])", "_", type(error).__name__).lower() for k, error in errors.items()}
    return ClosedForcesStack(
        q=frozen(q),
        v=frozen(v),
        a=frozen(a),
        tau=filled(lambda forces: forces.tau, np.nan, state.nv),
        friction=filled(lambda forces: forces.friction, np.nan, state.nv),
        multipliers=filled(lambda forces: forces.multipliers, np.nan, state.row_count),
        residual=filled(lambda forces: forces.residual, np.nan),
        undetermined=filled(lambda forces: forces.undetermined, -1),
        effort_is_unique=filled(lambda forces: forces.effort_is_unique, False, state.nv),
        status=frozen(np.array([words.get(k, "ok") for k in range(len(q))])),
        failures=MappingProxyType(dict(sorted(errors.items()))),
        state=state,
        _forces=MappingProxyType(found),
    )


def projected(
    state: ChainState, q: FloatArray, v: ArrayLike | None, a: ArrayLike | None
) -> tuple[FloatArray | None, FloatArray | None]:
    """The nearest velocity and acceleration that keep the loops closed; None stays where nothing moves."""
    if v is None and a is None:
        return None, None
    still = np.zeros(state.nv)
    speed = None if v is None else project_velocity(state, q, v)
    return speed, project_acceleration(state, q, still if speed is None else speed, still if a is None else a)


def _shaped(name: str, value: ArrayLike, count: int, size: int) -> FloatArray:
    """Real numbers of shape (count, size), of which every sample may have the same; they need not be finite."""
    array = as_real(name, value)
    if array.shape not in ((size,), (count, size)):
        raise InvalidInput(f"expected {name} to have shape ({count}, {size}) or ({size},), got {array.shape}")
    return np.array(np.broadcast_to(array, (count, size)))


def _close(state: ChainState, q: FloatArray, errors: dict[int, ExoPinError], progress: bool) -> None:
    """Close the loops of samples in place; those that do not close keep what they had."""
    some = np.flatnonzero((np.abs(q) <= LARGEST).all(axis=1))  # and no NaN
    try:
        q[some] = closing.close(state, q[some], progress=progress)
    except SamplesFailed as failed:
        errors.update({int(some[k]): error for k, error in failed.failures.items()})
        q[some] = np.where(np.isnan(failed.result), q[some], failed.result)
