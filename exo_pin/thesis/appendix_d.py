"""The worked example of Appendix D, (D-31) to (D-36), and the acceleration of (D-8).

The example follows from (D-31) under a reading that the text does not state: the pose is Rz(θz) Rx(θx) Ry(θy), the
order of the shoulder's angles, not (4-7); the weight is the mass without g, 2 N; and the weight is left out of F_s0.
A search over 576 readings finds it (docs/thesis.md). The values beside the printed ones are those of (4-7), with g and
with the weight.
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
from ..wrist_chain import EquilibriumModel
from .rows import Row, compare

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
    right = "computed: the data of (D-31) with (4-7) and 9.81 m/s²"
    return [
        compare("(D-32)", "f_i", "N", PRINTED_TENSIONS, spherical.actuator_forces, 0.05,
                reading=(_POSE_AND_WEIGHT, other.tensions), note=right, digits=2),
        compare("(D-33)", "F_s0, components y and z, and magnitude", "N", [*PRINTED_FORCE[1:], 50.0],
                [*force[1:], spherical.magnitude], 0.05,
                reading=(_NO_WEIGHT, [*other.limb_force[1:], np.linalg.norm(other.limb_force)]), note=right, digits=2),
        compare("(D-33)", "F_s0, component x", "N", PRINTED_FORCE[0], force[0], 0.05,
                reading=(_NO_WEIGHT, other.limb_force[0]), digits=2,
                note=f"the reading of the other components gives {other.limb_force[0]:.2f} N, but (D-35) follows from "
                "1.4 N"),
        compare("(D-35)", "g_i", "N", [-137.2, -13.5, -128.6], minimal.constraint_forces, 0.05,
                reading=(f"{_POSE_AND_WEIGHT}, from F_s0 as printed", other.side_forces(PRINTED_FORCE)),
                note=right, digits=1),
        compare("(D-36)", "F_s of least size, no bound", "N", [125.6e-6, -2.5e-6, -36.8e-6], minimal.shoulder_force,
                2e-4, digits=6, note="zero, as it must be: without bounds the minimum is trivial"),
        compare("Appendix D, last line", "least |F_s| with |g_i| <= |f_i|", "N", 34.8, bounded.magnitude, 0.05,
                reading=(_NO_WEIGHT, least), note=right, digits=2),
        compare("Appendix D, last line", "g_i of least |F_s| with |g_i| <= |f_i|", "N", [-9.5, 25.6, 19.8],
                bounded.constraint_forces, 0.05, reading=(_NO_WEIGHT, g), note=right, digits=2),
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
    return compare(
        "(D-8)",
        "a_C by the printed formula, for ω = (0.7, -1.1, 0.4), η = (2, 1, -3), C = (0.02, 0.05, -0.2)",
        "m/s²",
        -np.cross(eta, C) + turning,
        measured,
        1e-6,
        mended=np.cross(eta, C) + turning,
        note="the sign of the first term: a_C = η × C + ω × (ω × C)",
    )
