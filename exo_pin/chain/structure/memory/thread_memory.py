"""Scratch memory of a chain, of each thread its own."""

from __future__ import annotations

import threading
from functools import cached_property
from typing import Any

import pinocchio as pin

from ..closures import Closure
from ..constant_axes import ConstantAxes
from ..topology import Topology
from .chain_buffers import PINOCCHIO, ChainBuffers, ProximalProblem, proximal_constraints
from .forest import Forest


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
