"""Equilibrium of a stack of poses of the elastic device, as an affine state for all splits and limits.

At the displaced geometry forces are affine in f and g, as in :mod:`exo_pin.wrist.forces.displaced`; and the law of the
guides, g_i = k_i t_i φ_i, is that of a device with the misfit t_i φ_i - S_i · δ there. The linear equations of that
device have the δ of the nonlinear equilibrium as their solution.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.validation import FloatArray
from .bent_guides import largest_deflection
from .displaced import Displaced
from .elastic_equilibrium import ElasticEquations
from .side_forces import SideWrenches, side_wrenches


class PartDisplacements(NamedTuple):
    """Displacements of the parts, N poses.

    Attributes
    ----------
    arm : ndarray
        Orientation of the arm, shape (N, 3, 3).
    displacement : ndarray
        δ, shape (N, 3), m.
    harness, cuff : ndarray
        Displacement and rotation vector of base ring against torso (base frame) and of platform against arm (arm
        frame), shape (N, 6), m and rad; zero where rigid.
    twist : ndarray
        φ_i of the guides, shape (N, n), rad.
    bending : ndarray
        Deflection of the guides from the line A_i B_i, over its length, shape (N, n); NaN where they have no stable
        shape.
    lengths : ndarray
        Of the limbs, shape (N, n), m.
    forces : ndarray or None
        f of locked actuators, shape (N, n), N.
    """

    arm: FloatArray
    displacement: FloatArray
    harness: FloatArray
    cuff: FloatArray
    twist: FloatArray
    bending: FloatArray
    lengths: FloatArray
    forces: FloatArray | None


class MovedDevice:
    """The device at given unknowns of the elastic equations.

    Parameters
    ----------
    equations : ElasticEquations
        Of N poses.
    rows : ndarray of int
        Some of the poses, k of them.
    x : ndarray
        Shape (k, m), the unknowns.

    Attributes
    ----------
    displaced : Displaced
        Its equilibrium, k poses, moments about the displaced centre of the arm's joint.
    misfit : ndarray
        Shape (k, n), m.
    loads : tuple of ndarray
        Of the displaced arm, as :func:`exo_pin.load_case.pose_stacks.arm_loads` returns.
    movement : PartDisplacements
        Displacements of the parts.
    """

    def __init__(self, equations: ElasticEquations, rows: NDArray[np.intp], x: FloatArray) -> None:
        at, arm = equations.place(rows, x, np.ones(len(rows)))
        self.loads = equations.loads(rows, arm)
        mechanism, query = equations.mechanism, equations.query_at(rows, at)
        side, turns = equations.sides(at, equations.ends[rows])
        lost = np.isnan(turns).any(axis=(1, 2))
        if lost.any():
            # No stable shape of a guide is near: no equilibrium either, and the forces of straight guides have no NaN.
            straight = side_wrenches(mechanism, at.matrices, at.base, at.cuff, at.base_points)
            pairs = zip(side, straight, strict=True)
            side = SideWrenches(
                *(np.where(lost.reshape(-1, *[1] * (one.ndim - 1)), other, one) for one, other in pairs)
            )
        self.displaced = Displaced(mechanism, query, at.base, at.cuff, *self.loads[:2], at.base_points, side)
        delta, (harness, cuff) = equations.centre(x), (x[:, part] for part in equations.parts[2:])
        self.misfit: FloatArray = side.deflection - (side.forces @ delta[..., None])[..., 0]
        ends = (mechanism.geometry.platform_points + at.cuff[:, None]) @ np.swapaxes(at.matrices, 1, 2)
        none = np.zeros((len(rows), 6))
        self.movement = PartDisplacements(
            arm,
            delta,
            harness if harness.size else none,
            cuff if cuff.size else none,
            side.twist,
            largest_deflection(turns),
            np.linalg.norm(ends - at.base_points - at.base[:, None], axis=-1),
            x[:, equations.parts[3].stop :] if equations.locked else None,
        )
