"""Chapter 5, the test rig and the prototype; Appendix C, the index of daily poses; Appendix D, forces of the example.

* The rig of Section 5.1: Tables 5-1 and 5-2, and what the text says of them.
* Mass and inertia of the moving part, Table 5-4, and the dimensions of Section 5.2.3 and Table 5-3.
* The tests of Section 5.4: lengths of the muscles, their strokes, and the four daily tasks. What the end fittings of
  the muscles add to their length is not printed. Differences of two lengths of one muscle do not depend on it, and
  these are compared with (4-1). Lengths that are printed as "around" so much count as rounded to 10 mm.
"""

from __future__ import annotations

import numpy as np
import scipy
from scipy.spatial.transform import Rotation

from ..core.conventions import shoulder_rotation, thesis_rotation
from ..core.validation import FloatArray
from ..design import CircleDimensions, WristGeometry, preset
from ..load_case.case import Case
from ..load_case.ranges_of_motion import ADL_BOX, DAILY_RANGES
from ..reaction import Assumptions, solve
from ..wrist import inverse_kinematics, singularity
from ..wrist_chain.equilibrium import EquilibriumModel
from .rows import Row, printed_table, row

#: |A_i| = |B_i| of the test rig, mm: all that is printed of it.
RIG_RADIUS = 219.2
STATIC, KINEMATICS, _POSES = (printed_table(name) for name in ("table_5_1", "table_5_2", "section_5_1_2"))
#: Both tests turn the arm by 90° in 5 s, at constant speed.
_SPEED = 90.0 / 5.0


def rows() -> list[Row]:
    """Rows of Chapter 5, of the index in Appendix C, and of the example of Appendix D.

    Source: thesis Table 5-1, Table 5-2, Table 5-6, Table 5-7, (C-1), (C-2), Table 2-1, Table C-1, Table C-2.
    """
    rig = [*_static_tests(), *_forward_kinematics()]
    tests = [*_dimensions(), *_abduction(), *_flexion(), *_strokes(), _daily_tasks()]
    return [*rig, *tests, *_daily_range(), *_index(), *_optimum(), *rows_of_d()]


def _fitted_lengths() -> FloatArray:
    """Lengths, mm, of the rings of (4-2), alike on base and platform, that come closest to Table 5-1."""
    matrices = Rotation.from_euler("XYZ", STATIC["angles"], degrees=True).as_matrix()

    def lengths(p: FloatArray) -> FloatArray:
        r, h, alpha = RIG_RADIUS * np.sin(p[0]), RIG_RADIUS * np.cos(p[0]), p[1:]
        A = np.stack([r * np.cos(alpha), -h + 0 * alpha, r * np.sin(alpha)], axis=1)
        B = np.stack([r * np.cos(alpha), r * np.sin(alpha), -h + 0 * alpha], axis=1)
        return np.linalg.norm(np.einsum("kij,nj->kni", matrices, B) - A, axis=-1)

    rng = np.random.default_rng(0)
    starts = np.column_stack([rng.uniform(0.2, 1.4, 20), rng.uniform(0, 2 * np.pi, (20, 3))])
    fits = [
        scipy.optimize.least_squares(lambda p: (lengths(p) - STATIC["estimated"]).ravel(), start) for start in starts
    ]
    return lengths(min(fits, key=lambda fit: fit.cost).x)


def _static_tests() -> list[Row]:
    far = STATIC["shifts"][-1]
    angles = np.linspace(80.0, 100.0, 201)
    geometry = preset("prototype").geometry
    determinants = singularity(geometry, thesis_rotation(angles, 0, 0, degrees=True)).determinant
    return [
        row("rig.estimated_lengths", _fitted_lengths()),
        row("rig.size_of_O_B_cases", np.abs(STATIC["estimated"] - STATIC["measured"]).max(axis=1),
            printed=np.linalg.norm(STATIC["shifts"], axis=1)),
        row("rig.largest_component", np.abs(STATIC["shifts"][:-1]).max()),
        row("rig.largest_component_of", np.abs(far).max(), values=(np.linalg.norm(far),)),
        row("rig.theta_x_of_the_singular", angles[np.abs(determinants).argmin()]),
    ]  # fmt: skip


def _forward_kinematics() -> list[Row]:
    off = np.concatenate(
        [KINEMATICS["inverse"] - KINEMATICS["forward"], KINEMATICS["inverse_B"] - KINEMATICS["forward_B"]]
    )
    differences = np.abs(_POSES["sensor"] - _POSES["estimate"])
    theta = np.radians(KINEMATICS["measured_angles"])
    lengths = -2 * RIG_RADIUS * np.sin(theta)
    # Y_A points from A_i to O, and the limb has -sin θ_xA along it, whatever θ_yA is.
    reached = np.hypot(lengths * np.cos(theta), RIG_RADIUS + lengths * np.sin(theta))
    return [
        row("rig.differences_of_measured", differences),
        row("rig.largest_difference", np.abs(off).max()),
        row("rig.largest_error_of", differences.max()),
        row("rig.error_of_the_potentiometers", 100 * (305 - 300) / 300),
        row("rig.theta_xA_for_the", np.degrees(np.arcsin(-KINEMATICS["inverse"] / (2 * RIG_RADIUS)))),
        row("rig.l_i_for_the_measured", lengths),
        row("rig.B_i", reached),
    ]  # fmt: skip


def _dimensions() -> list[Row]:
    """Mass properties and dimensions.

    Source: thesis Table 5-3, Table 5-4.
    """
    arm, circles = preset("prototype").arm, preset("prototype").geometry.circles
    assert arm is not None
    assert arm.inertia is not None
    assert circles is not None
    parallel = arm.inertia_about_origin - arm.inertia
    tensor = printed_table("table_5_4")["inertia"]
    printed = 0.5 * (tensor + tensor.T) * 1e-9
    as_printed = np.linalg.eigvalsh(printed - parallel)
    negated = np.linalg.eigvalsh(printed * (2 * np.eye(3) - 1) - parallel)
    best, other = preset("optimised-table-5-3").geometry.circles, preset("optimised-table-c-2").geometry.circles
    assert best is not None
    assert other is not None
    built, wanted = np.degrees(circles.alpha_A), np.degrees(best.alpha_A)
    slope = np.tan(np.radians(60.0))
    return [
        row("dimensions.distance_of_the", np.linalg.norm(arm.centre_of_mass) * 1e3),
        row("dimensions.principal_moments", np.linalg.eigvalsh(arm.inertia), printed=as_printed, mended=negated),
        row("dimensions.I_yz_and_I_zy_integrals", -arm.inertia_about_origin[[1, 2], [2, 1]] * 1e9),
        row("dimensions.r_A_h_A_tan_60", circles.h_A * slope * 1e3),
        row("dimensions.r_B_h_B_tan_60", circles.h_B / slope * 1e3),
        row("dimensions.alpha_of_the_optimised", 10 * np.round(wanted / 10), printed=[40.0, *built[1:]],
            values=(", ".join(f"{gap:.1f}" for gap in np.diff(built)),)),
        row("dimensions.optimised_r_A_r_B", _millimetres_and_degrees(other), printed=_millimetres_and_degrees(best)),
    ]  # fmt: skip


def _millimetres_and_degrees(circles: CircleDimensions) -> list[float]:
    sizes = (circles.r_A, circles.r_B, circles.h_A, circles.h_B)
    return [*(1e3 * size for size in sizes), *np.degrees(circles.alpha_A).tolist()]


def _lengths(theta_x: float, theta_y: float, theta_z: float) -> FloatArray:
    """l_i of (4-1), mm, at the angles of Section 5.4, Y-X-Z in degrees."""
    pose = shoulder_rotation(-theta_y, theta_x, -theta_z, degrees=True)
    return np.asarray(1e3 * inverse_kinematics(preset("prototype").geometry, pose).lengths)


def _abduction() -> list[Row]:
    rest, start, end = _lengths(0, 0, 0), _lengths(8.8, -13.4, -8.8), _lengths(90, 0, 0)
    late, later = _lengths(3.5 * _SPEED, 0, 0), _lengths(4 * _SPEED, 0, 0)
    equal = "the fittings of muscles 2 and 3 are alike"
    return [
        row("motion_tests.abduction_at_3_5", 3.5 * _SPEED),
        row("motion_tests.muscle_1_from_200", rest[0] - start[0]),
        row("motion_tests.muscle_1_from_200_mm", rest[0] - later[0], values=(rest[0] - 200, later[0] - 150)),
        row("motion_tests.muscle_2_from_around", late[1] - end[1]),
        row("motion_tests.lengths_of_muscles", end[1] - end[2], values=(end[1], equal)),
    ]  # fmt: skip


def _flexion() -> list[Row]:
    rest, stalled, end = _lengths(0, 0, 0), _lengths(0, -70, 0), _lengths(0, -90, 0)
    return [
        row("motion_tests.muscle_1_from_200_to", rest[0] - end[0]),
        row("motion_tests.muscle_1_from_200_mm_at", rest[0] - stalled[0]),
        row("motion_tests.contraction_of_muscle", 100 * (250.0 - 110.0) / 250.0,
            reading=("of the 6-150 that muscle 1 is", 100 * (150.0 - 110.0) / 150.0)),
    ]  # fmt: skip


def _strokes() -> list[Row]:
    limbs = preset("prototype").limbs
    assert limbs is not None
    long = limbs[1].stroke
    assert long is not None
    return [
        row("motion_tests.least_length_of", 1e3 * long.nominal_length * long.shortest,
            reading=("70 % as in Section 5.4.3", 0.70 * 1e3 * long.nominal_length)),
        row("motion_tests.stroke_shortest", [100 * long.shortest, 100 * long.longest]),
        row("motion_tests.stroke_shortest_and", [100 * long.shortest, 100 * long.longest]),
    ]  # fmt: skip


def _daily_tasks() -> Row:
    """Shares of Table 5-7, and what the stroke alone would leave if l_i were the muscle's own length."""
    low = np.array([0.75 * 150.0, 0.75 * 250.0, 0.75 * 250.0])
    high = np.array([150.0, 250.0, 250.0])
    lengths = 1e3 * inverse_kinematics(preset("prototype").geometry, ADL_BOX.poses(4.0)).lengths
    share = 100.0 * float(((lengths > low) & (lengths < high)).all(axis=-1).mean())
    return row("motion_tests.share_of_four_tasks", [np.nan] * 4, values=(share,))


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
    best = np.array(_millimetres_and_degrees(circles))
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


def _other_reading() -> tuple[FloatArray, FloatArray, FloatArray]:
    """The example as the thesis seems to have computed it: f_i and F_s0 = Σ f_i s_i, N, and X_i in rows."""
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
    return f, s.T @ f, X


def rows_of_d() -> list[Row]:
    """Rows of the ledger.

    Source: thesis (D-31), (D-32), (D-33), (D-35), (D-36).
    """
    mechanism = preset("appendix-d")
    model, pose = EquilibriumModel(mechanism), thesis_rotation(*ANGLES)
    spherical = solve(model, Case(pose))
    minimal = solve(model, Case(pose), Assumptions("minimal"))
    bounded = solve(model, Case(pose), Assumptions("minimal", constraint_bounds="actuator"))
    tensions, limb_force, X = _other_reading()
    most = np.abs(tensions)
    # g_i that make |F_s| least with |g_i| <= |f_i|, and those that make F_s as printed zero.
    g = scipy.optimize.lsq_linear(X.T, -limb_force, (-most, most)).x
    balanced = -np.linalg.solve(X.T, PRINTED_FORCE)
    least = float(np.linalg.norm(limb_force + X.T @ g))
    force = spherical.shoulder_force
    return [
        row("appendix_d.f_i", spherical.actuator_forces, reading=(_POSE_AND_WEIGHT, tensions)),
        row("appendix_d.F_s0_components", [*force[1:], spherical.magnitude],
            reading=(_NO_WEIGHT, [*limb_force[1:], np.linalg.norm(limb_force)])),
        row("appendix_d.F_s0_component_x", force[0], reading=(_NO_WEIGHT, limb_force[0]),
            values=(limb_force[0],)),
        row("appendix_d.g_i", minimal.constraint_forces,
            reading=(f"{_POSE_AND_WEIGHT}, from F_s0 as printed", balanced)),
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
    speeding = np.cross(eta, C)
    return row("appendix_d.a_C_by_the_printed", measured, printed=turning - speeding, mended=turning + speeding)
