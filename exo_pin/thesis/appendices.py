"""Rows of Appendix C, the index of daily poses and its optimum, and of Appendix D, the forces of the example."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from scipy.spatial.transform import Rotation

from ..core.conventions import shoulder_rotation, thesis_rotation
from ..core.validation import FloatArray
from ..design import WristGeometry, preset
from ..load_case.case import Case
from ..load_case.ranges_of_motion import DAILY_RANGES
from ..reaction import Assumptions, solve
from ..wrist import inverse_kinematics
from ..wrist_chain.equilibrium import EquilibriumModel
from .rows import Row, row

#: Ranges of θy, θx and θz, degrees.
_RANGES = ((-110.0, 0.0), (-4.0, 96.0), (-85.0, 20.0))
_HALF_DIAGONAL = np.radians(95.0)
#: Table C-1: bounds of r_A, r_B, h_A, h_B, mm, and of the three α, degrees.
_BOUNDS = np.array([(50, 180), (90, 200), (41, 60), (58, 108), (-20, 0), (30, 60), (90, 120)], dtype=float)


def _axes(step: float) -> list[np.ndarray]:
    return [low + step * np.arange(int((high - low) / step + 1e-9) + 1) for low, high in _RANGES]


def _share(geometry: WristGeometry, both_ends: bool) -> float:
    """Percent of the poses of the 4° grid in which the universal joints are within the diamond."""
    theta_y, theta_x, theta_z = np.meshgrid(*_axes(4.0), indexing="ij")
    state = inverse_kinematics(geometry, shoulder_rotation(-theta_y, theta_x, -theta_z, degrees=True))
    inside = (np.abs(state.base_theta_x) + np.abs(state.base_theta_y) < _HALF_DIAGONAL).all(axis=-1)
    if both_ends:
        at_arm = np.abs(state.platform_theta_x) + np.abs(state.platform_theta_y)
        inside &= (at_arm < _HALF_DIAGONAL).all(axis=-1)
    return 100.0 * float(inside.mean())


def rows_of_c() -> list[Row]:
    """Rows of the ledger.

    Source: thesis (C-1), (C-2), Table 2-1, Table C-1, Table C-2.
    """
    return [*_daily_range(), *_index(), *_optimum()]


def _daily_range() -> list[Row]:
    """The summary of Table 2-1 from its surveys, and how far it spreads in the ball of rotation vectors."""
    # The two surveys that print where a range begins and ends; their angles are positive as named.
    murray, buckley = DAILY_RANGES[:2]
    flexion, abduction, internal = zip(murray.intervals, buckley.intervals, strict=True)
    summary = [
        -np.mean(flexion, axis=0)[1],
        np.max(abduction) - 100.0,
        np.max(abduction),
        -np.mean(internal, axis=0)[1],
        -np.min(internal),
    ]
    theta_y, theta_x, theta_z = np.meshgrid(*_axes(4.0), indexing="ij")
    along = shoulder_rotation(-theta_y, theta_x, -theta_z, degrees=True).as_rotvec()[..., 1]
    printed, meant = (100.0 * float((np.abs(along) <= most).mean()) for most in (2 / np.pi, np.pi / 2))
    return [
        row("appendix_c.summary_flexion", summary),
        row("appendix_c.Murray_Johnson_abduction", murray.abduction_deg[1]),
        row("appendix_c.poses_along_Y_in", [along.min(), along.max()], printed=[-2 / np.pi, 2 / np.pi],
            values=(printed, meant)),
    ]  # fmt: skip


def _optimum() -> list[Row]:
    circles = preset("optimised-table-c-2").geometry.circles
    assert circles is not None
    sizes = [1e3 * size for size in (circles.r_A, circles.r_B, circles.h_A, circles.h_B)]
    best = np.array([*sizes, *np.degrees(circles.alpha_A)])
    return [
        row("appendix_c.optimum_r_A_r_B", best.clip(*_BOUNDS.T), printed=best),
        row("appendix_c.optimum_of_h_A_printed", best[2]),
    ]  # fmt: skip


def _index() -> list[Row]:
    counts = {step: int(np.prod([len(axis) for axis in _axes(step)])) for step in (1.0, 2.0, 3.0, 4.0, 5.0)}
    (step,) = (step for step, count in counts.items() if count == 19656)
    optimised = preset("optimised-table-c-2").geometry
    at_29 = optimised.replace(h_A=0.029)
    centre = WristGeometry.from_circles(0.115, 0.145, 0.0505, 0.083, np.radians([-10.0, 45.0, 105.0]))
    best = [_share(optimised, False), _share(optimised, True), _share(at_29, False), _share(at_29, True)]
    start = [_share(centre, False), _share(centre, True)]
    return [
        row("appendix_c.increment_of_the", step, values=(counts[4.0], counts[2.0])),
        row("appendix_c.index_index_of_Table", best),
        row("appendix_c.index_index_of_the", start),
    ]  # fmt: skip


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


def rows_of_d() -> list[Row]:
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


def rows() -> list[Row]:
    """Rows of both appendices."""
    return [*rows_of_c(), *rows_of_d()]
