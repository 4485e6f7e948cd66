"""The worked example of Appendix D, (D-31) to (D-36), and the acceleration of (D-8)."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ..core.conventions import thesis_rotation
from ..core.validation import FloatArray
from ..design import preset
from ..reaction import reaction
from ..wrist_chain import EquilibriumModel
from .rows import Row, compare

__all__ = ["example_pose", "rows"]

_WHY = "does not follow from (D-31): no Euler order, transpose, gravity axis, limb order or sign of B_i gives it"


def example_pose() -> Rotation:
    """(θx, θy, θz) = (2π/7, π/4, -π/3)."""
    return thesis_rotation(2 * np.pi / 7, np.pi / 4, -np.pi / 3)


def rows() -> list[Row]:
    """Rows of the ledger.

    Source: thesis (D-31), (D-32), (D-33), (D-35), (D-36).
    """
    mechanism = preset("appendix-d")
    assert mechanism.arm is not None
    model, pose = EquilibriumModel(mechanism), example_pose()
    spherical = reaction(model, pose)
    minimal = reaction(model, pose, split="minimal")
    bounded = reaction(model, pose, split="minimal", constraint_bounds="actuator")
    weight = mechanism.arm.mass * 9.81
    # |F_s0| as printed needs limbs that pull at least that much less the weight (triangle inequality).
    needed = float(np.linalg.norm(np.array([1.4, 34.3, -36.35]) + np.array([0.0, 0.0, -weight])))
    return [
        compare("(D-32)", "f_i", "N", [9.51, 25.6, 19.8], spherical.actuator_forces, 0.05, note=_WHY, digits=2),
        compare("(D-33)", "F_s0", "N", [1.4, 34.3, -36.35], spherical.shoulder_force, 0.05, note=_WHY, digits=2),
        compare("(D-32), (D-33)", "sum of the printed |f_i|, against the least that the printed F_s0 needs", "N",
                9.51 + 25.6 + 19.8, needed, 0.05, digits=1,
                note="with the sign of (D-30) the printed tensions are too small for the printed force"),
        compare("(D-35)", "g_i", "N", [-137.2, -13.5, -128.6], minimal.constraint_forces, 0.05, note=_WHY, digits=1),
        compare("(D-36)", "F_s of least size, no bound", "N", [125.6e-6, -2.5e-6, -36.8e-6], minimal.shoulder_force,
                2e-4, digits=6, note="zero, as it must be: without bounds the minimum is trivial"),
        compare("Appendix D, last line", "least |F_s| with |g_i| <= |f_i|", "N", 34.8, bounded.magnitude, 0.05,
                note=_WHY, digits=2),
        compare("Appendix D, last line", "g_i of least |F_s| with |g_i| <= |f_i|", "N", [-9.5, 25.6, 19.8],
                bounded.constraint_forces, 0.05, note=_WHY, digits=2),
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
