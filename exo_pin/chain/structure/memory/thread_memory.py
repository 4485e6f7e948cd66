"""Scratch memory of a chain, of each thread its own, for one state and for stacks."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from functools import cached_property
from typing import Any

import numpy as np
import pinocchio as pin

from ....core.records import OneProcess
from ....core.validation import FloatArray
from ..closures import Closure
from ..constant_axes import ConstantAxes
from ..topology import Topology
from .chain_buffers import (
    PINOCCHIO,
    ChainBuffers,
    ProximalProblem,
    force_window,
    jacobian_window,
    pose_window,
    proximal_constraints,
)

#: Coordinates of all copies together: more are hardly faster, and take a larger Data.
_COORDINATES = 64


class Forest(OneProcess):
    """Copies of a tree side by side, so that one call of Pinocchio serves several samples of a stack.

    Parameters
    ----------
    model : pinocchio.Model
        The tree. The axes of its joints must be constant in their own frames.
    """

    def __init__(self, model: pin.Model) -> None:
        self._given, self._count = model, max(1, _COORDINATES // max(model.nv, 1))
        self._model = pin.Model()
        for k in range(self._count):
            first = k * (model.njoints - 1)
            for joint in range(1, model.njoints):
                parent, place = model.parents[joint], model.jointPlacements[joint]
                name = f"{model.names[joint]}/{k}"
                self._model.addJoint(first + parent if parent else 0, model.joints[joint], place, name)
        self._data, self._external = pin.Data(self._model), pin.StdVec_Force()
        for _ in range(self._model.njoints):
            self._external.append(pin.Force.Zero())
        shape = self._count, model.njoints - 1
        self._poses = pose_window(self._data.oMi, self._model.njoints)[1:].reshape(*shape, 4, 3)
        self._forces = force_window(self._data.f, self._model.njoints)[1:].reshape(*shape, 6)
        self._pushes = force_window(self._external, self._model.njoints)[1:].reshape(*shape, 6)
        self._J, self._dJ = (
            jacobian_window(matrix, self._model.nv).reshape(self._count, model.nv, 6)
            for matrix in (self._data.J, self._data.dJ)
        )

    def follow(self) -> None:
        """Take over gravity, masses and armatures of the given model, which may have changed."""
        given = self._given
        self._model.gravity = given.gravity
        self._model.armature = np.tile(given.armature, self._count)
        inertias = list(given.inertias)[1:]
        for k in range(1, self._model.njoints):
            self._model.inertias[k] = inertias[(k - 1) % len(inertias)]

    def kinematics(self, q: FloatArray, v: FloatArray | None = None) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Poses and Jacobians of n samples.

        Parameters
        ----------
        q, v : ndarray
            Shapes (n, nq) and (n, nv); without v no rates are computed.

        Returns
        -------
        poses : ndarray
            Shape (n, njoints, 4, 3): rows 0 to 2 are the columns of R, row 3 is p.
        J, dJ : ndarray
            Shape (n, nv, 6), world Jacobians, transposed, and their rates, zero without v.
        """
        poses, shape = np.empty((len(q), self._given.njoints, 4, 3)), (len(q), self._given.nv, 6)
        poses[:, 0, :3], poses[:, 0, 3] = np.eye(3), 0.0
        J, dJ = np.empty(shape), np.zeros(shape)
        for own, size in self._groups(len(q)):
            if v is None:
                pin.computeJointJacobians(self._model, self._data, self._whole(q[own]))
            else:
                at, speed = self._whole(q[own]), self._whole(v[own])
                pin.computeJointJacobiansTimeVariation(self._model, self._data, at, speed)
                dJ[own] = self._dJ[:size]
            poses[own, 1:] = self._poses[:size]
            J[own] = self._J[:size]
        return poses, J, dJ

    def rnea(
        self, q: FloatArray, v: FloatArray, a: FloatArray, external: FloatArray | None
    ) -> tuple[FloatArray, FloatArray]:
        """Generalised forces of n samples, shape (n, nv), and the joints' wrenches, shape (n, njoints, 6).

        Wrenches, also the ``external`` ones on the joints' bodies, are in the joints' own axes about their own origins.
        """
        tau, forces = np.empty(v.shape), np.zeros((len(q), self._given.njoints, 6))
        self._pushes[:] = 0.0
        for own, size in self._groups(len(q)):
            if external is not None:
                self._pushes[:size] = external[own, 1:]
            at, speed, rate = self._whole(q[own]), self._whole(v[own]), self._whole(a[own])
            found = pin.rnea(self._model, self._data, at, speed, rate, self._external)
            tau[own] = found.reshape((self._count, v.shape[1]))[:size]
            forces[own, 1:] = self._forces[:size]
        return tau, forces

    def integrate(self, q: FloatArray, move: FloatArray) -> FloatArray:
        """q ⊕ move of n samples, shape (n, nq)."""
        found = np.empty(q.shape)
        for own, size in self._groups(len(q)):
            there = pin.integrate(self._model, self._whole(q[own]), self._whole(move[own]))
            found[own] = there.reshape((self._count, q.shape[1]))[:size]
        return found

    def _groups(self, samples: int) -> Iterator[tuple[slice, int]]:
        """Samples that one call takes, and their number."""
        for first in range(0, samples, self._count):
            yield slice(first, first + self._count), min(self._count, samples - first)

    def _whole(self, rows: FloatArray) -> FloatArray:
        """Rows one after the other for all copies, where there are too few with the last repeated."""
        short = self._count - len(rows)
        return (np.concatenate([rows, np.repeat(rows[-1:], short, axis=0)]) if short else rows).ravel()


class ThreadMemory:
    """Base of a chain's state: what each thread overwrites with every call."""

    model: pin.Model
    topology: Topology
    axes: ConstantAxes
    closures: tuple[Closure, ...]
    _local: threading.local

    @property
    def buffers(self) -> ChainBuffers:
        """This thread's Pinocchio Data and buffers."""
        work = getattr(self._local, "buffers", None)
        if work is None:
            work = self._local.buffers = ChainBuffers(self.model, self.topology, self.axes)
        return work

    @property
    def forest(self) -> Forest | None:
        """This thread's memory for stacks, with the model's masses; None where the axes of joints are not constant."""
        if self.axes.differs or self.axes.ellipsoids:
            return None
        found = getattr(self._local, "forest", None)
        if found is None:
            found = self._local.forest = Forest(self.model)
        found.follow()
        return found

    @property
    def freed_chains(self) -> dict[int, Any]:
        """This thread's chains with one joint set free, by joint; derivatives of reactions change their models."""
        return self._local.__dict__.setdefault("freed", {})

    @cached_property
    def fits_pinocchio(self) -> bool:
        """Whether there are closures and Pinocchio's constrained dynamics can have each."""
        return bool(self.closures) and all(closure.kind.rules in PINOCCHIO for closure in self.closures)

    @property
    def proximal_problem(self) -> ProximalProblem:
        """This thread's memory for Pinocchio's constrained dynamics."""
        problem = getattr(self._local, "proximal", None)
        if problem is None:
            constraints = proximal_constraints(self.model, self.closures, self.topology)
            problem = self._local.proximal = ProximalProblem(self.model, self.buffers.data, constraints)
        return problem
