"""Equations of a device that gives way while its drives and brakes keep the coordinates of the rigid, aligned device.

The arm turns by v besides the displacements x of :mod:`.soft_equations`, idle motions that drives hold among them, and
the efforts f are unknown as well:

    T'(λ b - springs - B f) = 0        N'(λ b - springs - B f) = 0        c(v, x) = c(0, 0)

with c the coordinates of drives and brakes.

Weight, load and inertia are those of the arm as it is turned.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.validation import FloatArray
from ...load_case.pose_stacks import Query, arm_loads
from ..balance.device_loads import device_loads
from ..balance.device_state import NONE
from .soft_equations import SoftEquations, SoftPose

__all__ = ["LockedEquations"]

#: A unit of the efforts among the unknowns, over the largest effort or moment of the pose whose drives hold the arm.
_FORCE = 10.0


class LockedEquations(SoftEquations):
    """r of one pose with locked drives, in the unknowns v, x and f; see :class:`.SoftEquations` for parameters.

    Parameters
    ----------
    turned : callable
        Takes an orientation of the arm, shape (3, 3), and returns the question there, a stack of one.
    """

    #: Efforts are unknown, too, and are not zero where a path ends.
    _counts_anew = False

    def __init__(self, turned: Callable[[FloatArray], Query], *given: Any) -> None:
        super().__init__(*given)
        self._turned, self._rest = turned, (self.start.copy(), Rotation.from_matrix(self.matrix))
        drives = len(self.model.drives)
        if not self.soft.device.holds_alone:
            raise InvalidInput('split="elastic_locked" is of devices whose drives hold the arm about every axis')
        loads = device_loads(self.model, self.start[None], self.query)
        self._locked = loads.driven.coordinates[0].copy()
        self.columns = self._held_motions(loads.driven.B[0])
        own = self.columns.shape[1]
        self.size, self._ends = 3 + own + drives, (3, 3 + own)
        start = super().at(np.zeros(own), 1.0)
        # Turns of the arm, and what moves drives besides while it rests.
        values = np.linalg.svd(start.drive_effect, compute_uv=False)
        most = 3 + int((values > NONE * max(values.max(initial=0.0), np.abs(start.moment_of_f[:3]).max())).sum())
        if drives > most:
            raise InvalidInput(
                f"expected at most {most} drives and brakes with locked actuators, got {drives}: a device with "
                f'{most} freedoms cannot have more given lengths. split="elastic" lets the actuators adapt'
            )
        #: What a unit of f is, N or N m.
        self._unit = _FORCE * max(1e-6, float(np.abs(start.f).max(initial=0.0)), float(np.abs(start.moment).max()))

    def _held_motions(self, efforts: FloatArray) -> FloatArray:
        """Motions of the held tree at the start that load a spring or move a drive, scaled, orthonormal, (nv, m)."""
        model, idle = self.model, self._idle(self.start)
        out = np.zeros((model.held.nv, idle.shape[1]))
        out[model.moving] = idle
        of_free = np.zeros((model.free.nv, idle.shape[1]))
        of_free[model.v_of] = (out * model.held.topology.column[:, None])[model.v_from]
        felt = np.concatenate([idle[np.isin(model.moving, model.soft)], efforts.T @ of_free])
        _, s, Vt = np.linalg.svd(felt)
        return out @ Vt[: int((s > NONE * s.max(initial=0.0)).sum())].T

    def at(self, x: FloatArray, share: float) -> SoftPose:
        """The device at v, x and f."""
        v, own, f = np.split(x, self._ends)
        start, rest = self._rest
        turn = Rotation.from_rotvec(v) * rest
        self.matrix, f = turn.as_matrix(), self._unit * f
        self.start = start.copy()
        self.start[self.model.arm_q] = turn.as_quat()
        self.query, device = self._turned(self.matrix), self.soft.device
        self.on_cuff = arm_loads(device.require_arm("weight"), device.gravity, self.query)[2][0]
        self.preferred = f
        pose = super().at(own, share)
        residual = np.concatenate(
            [
                pose.moment[:3] - pose.moment_of_f[:3] @ f,
                pose.residual + pose.drive_effect @ (pose.f - f),
                pose.loads.driven.coordinates[0] - self._locked,
            ]
        )
        return pose._replace(f=f, stress=np.zeros((len(f), 0)), residual=residual)

    def opens(self, x: FloatArray, share: float) -> bool:
        """As of :meth:`.SoftEquations.opens`."""
        return super().opens(np.split(x, self._ends)[1], share)
