"""The worked example of Appendix D, (D-31) to (D-36), and the acceleration of (D-8).

The example follows from (D-31) under a reading that the text does not state: the pose is Rz(θz) Rx(θx) Ry(θy), the
order of the shoulder's angles, not (4-7); the weight is the mass without g, 2 N; and the weight is left out of F_s0.
A search over 576 readings finds it (docs/evidence/thesis.md). The values beside the printed ones are those of
(4-7), with g and with the weight.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from scipy.spatial.transform import Rotation

from ..core.conventions import thesis_rotation
from ..core.validation import FloatArray
from ..design import preset
from ..load_case.case import Case
from ..reaction import Assumptions, solve
from ..wrist_chain.equilibrium import EquilibriumModel
from .rows import Row, row

#: (θx, θy, θz) of the example, rad.
ANGLES = (2 * np.pi / 7, np.pi / 4, -np.pi / 3)
#: (D-32) and (D-33), N.
PRINTED_TENSIONS = np.array([9.51, 25.6, 19.8])
PRINTED_FORCE = np.array([1.4, 34.3, -36.35])
_POSE_AND_WEIGHT = "R = Rz Rx Ry, weight without g (2 N)"
_NO_WEIGHT = f"{_POSE_AND_WEIGHT}, which F_s0 leaves out"


def example_pose() -> Rotation:
    """(θx, θy, θz) = (2π/7, π/4, -π/3)."""
    return thesis_rotation(*ANGLES)


@dataclass(frozen=True)
class OtherReading:
    """The example as the thesis seems to have computed it.

    Attributes
    ----------
    tensions : ndarray
        f_i, N.
    limb_force : ndarray
        F_s0 = Σ f_i s_i, N.
    side_directions : ndarray
        X_i in rows.
    """

    tensions: FloatArray
    limb_force: FloatArray
    side_directions: FloatArray

    @classmethod
    def computed(cls) -> OtherReading:
        """Solve the example."""
        mechanism = preset("appendix-d")
        assert mechanism.arm is not None
        x, y, z = ANGLES
        R = Rotation.from_euler("ZXY", [z, x, y]).as_matrix()
        a, b = mechanism.geometry.base_points, mechanism.geometry.platform_points @ R.T
        s = (b - a) / np.linalg.norm(b - a, axis=1, keepdims=True)
        X = -np.cross(a, b)
        X /= np.linalg.norm(X, axis=1, keepdims=True)
        weight = np.array([0.0, 0.0, -mechanism.arm.mass])
        f = np.linalg.solve(np.cross(b, s).T, np.cross(R @ mechanism.arm.centre_of_mass, weight))
        return cls(f, s.T @ f, X)

    def side_forces(self, limb_force: FloatArray) -> FloatArray:
        """g_i that make F_s zero, N."""
        return np.asarray(-np.linalg.solve(self.side_directions.T, limb_force))

    def bounded_side_forces(self) -> FloatArray:
        """g_i that make |F_s| least with |g_i| <= |f_i|, N."""
        most = np.abs(self.tensions)
        return np.asarray(scipy.optimize.lsq_linear(self.side_directions.T, -self.limb_force, (-most, most)).x)


def rows() -> list[Row]:
    """Rows of the ledger.

    Source: thesis (D-31), (D-32), (D-33), (D-35), (D-36).
    """
    mechanism = preset("appendix-d")
    model, pose = EquilibriumModel(mechanism), example_pose()
    spherical = solve(model, Case(pose))
    minimal = solve(model, Case(pose), Assumptions("minimal"))
    bounded = solve(model, Case(pose), Assumptions("minimal", constraint_bounds="actuator"))
    other = OtherReading.computed()
    g = other.bounded_side_forces()
    least = float(np.linalg.norm(other.limb_force + other.side_directions.T @ g))
    force = spherical.shoulder_force
    return [
        row("appendix_d.f_i", spherical.actuator_forces, reading=(_POSE_AND_WEIGHT, other.tensions)),
        row("appendix_d.F_s0_components", [*force[1:], spherical.magnitude],
            reading=(_NO_WEIGHT, [*other.limb_force[1:], np.linalg.norm(other.limb_force)])),
        row("appendix_d.F_s0_component_x", force[0], reading=(_NO_WEIGHT, other.limb_force[0]),
            values=(other.limb_force[0],)),
        row("appendix_d.g_i", minimal.constraint_forces,
            reading=(f"{_POSE_AND_WEIGHT}, from F_s0 as printed", other.side_forces(PRINTED_FORCE))),
        row("appendix_d.F_s_of_least_size", minimal.shoulder_force),
        row("appendix_d.least_F_s_with_g_i", bounded.magnitude, reading=(_NO_WEIGHT, least)),
        row("appendix_d.g_i_of_least_F_s", bounded.constraint_forces, reading=(_NO_WEIGHT, g)),
        _acceleration(),
    ]  # fmt: skip


def _acceleration() -> Row:
    """(D-8) against a second difference of a motion with constant angular acceleration at t = 0.

    Source: thesis (D-8).
    """
    C = np.array([0.02, 0.05, -0.2])
    omega, eta = np.array([0.7, -1.1, 0.4]), np.array([2.0, 1.0, -3.0])

    def centre(t: float) -> FloatArray:
        # Exact to second order in t: rotation vector ω t + η t²/2 (their cross product enters at third order).
        return np.asarray(Rotation.from_rotvec(omega * t + eta * t**2 / 2).apply(C))

    step = np.finfo(float).eps ** 0.25
    measured = (centre(step) - 2 * C + centre(-step)) / step**2
    turning = np.cross(omega, np.cross(omega, C))
    return row(
        "appendix_d.a_C_by_the_printed",
        measured,
        printed=-np.cross(eta, C) + turning,
        mended=np.cross(eta, C) + turning,
    )
