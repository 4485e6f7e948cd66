"""Closed-loop forward and inverse kinematics, along paths that keep to one assembly branch."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from ...core.errors import InvalidInput, LoopNotClosed
from ...core.validation import FloatArray, as_finite, frozen
from ..structure.closures import Closure
from ..structure.description import Closures
from .closing import Closing

__all__ = ["Paths"]

#: Largest step along a path, rad and characteristic lengths. A branch is lost only where two come nearer than that.
_PATH_STEP = 0.1
#: Steps are halved where the loops do not follow, so many times.
_HALVINGS = 12
#: A corrected step that moves more than this many times its prediction has left its branch.
_JUMP = 0.5
_CLOSED = 1e-12
_STEPS = 30


class Paths(Closing):
    """Configurations of a closed chain on the branch of a known one."""

    def forward_kinematics(
        self, positions: ArrayLike, near: ArrayLike, joints: Iterable[str] | None = None
    ) -> FloatArray:
        """The configuration at given positions of some joints, on the branch of a known one.

        The joints go there along a straight line, in steps that the loops follow, so the answer is on the same
        assembly branch as ``near``. What they leave free moves least. :meth:`placement` then tells where any frame is.

        Parameters
        ----------
        positions : array_like
            Coordinates in q of ``joints``, in their order.
        near : array_like
            Shape (nq,), a closed configuration.
        joints : iterable of str, optional
            The actuated joints of the roles if left out.

        Returns
        -------
        ndarray
            Shape (nq,), closed.

        Raises
        ------
        LoopNotClosed
            If the branch ends before: a limb is stretched or folded, or the path meets a singularity.
        InvalidInput
            If no joints are given and the roles name none.
        """
        names = self._actuated(joints)
        index = np.concatenate([np.arange(self._model.nq)[self.configuration_slice(name)] for name in names])
        held = self.velocity_indices(names)
        start = self._closed(near)
        goal = start.copy()
        goal[index] = as_finite("positions", positions, (len(index),))
        goal = self._configuration(goal)
        whole = pin.difference(self._model, start, goal)
        scale = np.where(self._topology.metres, 1.0 / self._topology.length, 1.0)
        reach = float(np.abs(whole[held] * scale[held]).max(initial=0.0))

        def at(fraction: float, q: FloatArray) -> FloatArray:
            """q with its given joints moved on to a fraction of their way."""
            here = pin.integrate(self._model, start, fraction * whole)
            moved = q.copy()
            moved[index] = goal[index] if fraction == 1.0 else here[index]
            return moved

        def correct(fraction: float, q: FloatArray) -> FloatArray:
            return self._close(at(fraction, q), held, _CLOSED, _STEPS)[0]

        return self._follow(start, reach, correct)

    def inverse_kinematics(
        self,
        frame: str,
        target: pin.SE3,
        near: ArrayLike,
        kind: str = "rigid",
        hold: Iterable[str] = (),
    ) -> FloatArray:
        """The configuration that brings a frame to a place, on the branch of a known one.

        The frame goes there along a screw, in steps that the loops follow.

        Parameters
        ----------
        frame : str
            A frame of the model.
        target : pinocchio.SE3
            Where its origin and axes shall be, world frame.
        near : array_like
            Shape (nq,), a closed configuration.
        kind : str
            What of the target counts, as a closure type: "rigid" for the whole pose, "spherical" for the origin
            alone, "revolute" for origin and z axis, and so on.
        hold : iterable of str
            Joints that must not move.

        Returns
        -------
        ndarray
            Shape (nq,), closed and at the target to 1e-12.

        Raises
        ------
        LoopNotClosed
            If the frame cannot get there on this branch.
        """
        if not isinstance(target, pin.SE3):
            raise InvalidInput(f"expected target to be a pinocchio.SE3, got {type(target).__name__}")
        as_finite("target", target.homogeneous, (4, 4))
        start = self._closed(near)
        held = self.velocity_indices(hold)
        origin = self.placement(start, frame)
        if kind == "spherical":
            # Only the point counts: a straight line, without turning.
            target = pin.SE3(origin.rotation, target.translation)
        way = pin.log6(origin.actInv(target))
        reach = max(float(np.linalg.norm(way.linear)) / self._topology.length, float(np.linalg.norm(way.angular)))

        # One more closure holds the frame to its place in the world.
        given = self._data_of_file
        task = Closure(" task", kind, frame, "universe")
        extended = Paths(self._model, Closures(given.name, given.root, (*given.closures, task)))
        local = extended._topology.local.copy()
        task_frame, seen = local[-1, 1], frozen(local.view())
        extended._topology = dataclasses.replace(extended._topology, local=seen)

        def correct(fraction: float, q: FloatArray) -> FloatArray:
            place = target if fraction == 1.0 else origin * pin.exp6(fraction * way)
            task_frame[:3], task_frame[3] = place.rotation.T, place.translation
            return extended._close(q, held, _CLOSED, _STEPS)[0]

        return self._follow(start, reach, correct)

    def _follow(
        self, start: FloatArray, reach: float, correct: Callable[[float, FloatArray], FloatArray]
    ) -> FloatArray:
        """Go from start to the end of a path in steps, halving those that the loops do not follow.

        The first guess of each step goes on as the last one went; a step that ends far from its guess may have
        changed its branch and is halved, too.
        """
        step = 1.0 / max(1, int(np.ceil(reach / _PATH_STEP)))
        smallest = step / 2**_HALVINGS
        scale = np.where(self._topology.metres, 1.0 / self._topology.length, 1.0)
        fraction, q = 0.0, start
        rate = np.zeros(self._model.nv)
        while fraction < 1.0:
            target = fraction + step if fraction + step < 1.0 - 1e-9 else 1.0
            guess = pin.integrate(self._model, q, (target - fraction) * rate)
            try:
                found = correct(target, guess)
                moved = pin.difference(self._model, q, found)
                jumped = bool(np.abs(scale * pin.difference(self._model, guess, found)).max(initial=0.0) > _JUMP)
                if jumped:
                    raise LoopNotClosed(guess, self._workspace.residual(guess), _STEPS)
            except LoopNotClosed:
                if step <= smallest:
                    raise
                step /= 2
                continue
            rate = moved / (target - fraction)
            q, fraction = found, target
        return q

    def _actuated(self, joints: Iterable[str] | None) -> tuple[str, ...]:
        names = self.roles.actuated if joints is None else (joints,) if isinstance(joints, str) else tuple(joints)
        if not names:
            raise InvalidInput("expected joints, because the closures file's roles name no actuated ones")
        return names
