"""The rows that are not reproduced as read, searched for another reading.

What is varied, row by row:

- (D-32), (D-33): six orders of the three rotations, the sign of each angle (transposes among them), six directions of
  gravity, mass with or without g; for (D-33) besides the weight added, subtracted or left out.
- Table A-2, excitation: which of the eight points of Table A-1 the parabola is fitted to (three or more).
- Section A.3: the forces as printed, of (A-5) and of (A-6), and several measures of error and of spread.
- Section 4.2.2: signs of A_2, B_1, B_2 and of the matrix entries as printed or as they must be, l_3 as printed in
  either place, rounded directions, the sign of l (a·s), the column taken for the direction, R or its transpose, and
  four ways to take angles from a matrix that is no rotation.
- Table 5-1: six orders of rotation and the signs of the angles; joint centres anywhere at the printed 219.2 mm.
- Table 5-2: which printed angles belong to which lengths, and sine or cosine of the angle or its half.
- Section 5.2.3: tangent, cotangent, sine, cosine and their inverses of 60° and 30°.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import combinations, permutations, product

import numpy as np
import scipy
from numpy.typing import ArrayLike
from readings import Match, best_reading
from scipy.spatial.transform import Rotation

from exo_pin.core.validation import FloatArray
from exo_pin.design import preset
from exo_pin.muscle import muscle_model, table
from exo_pin.muscle.laws.static import BAR
from exo_pin.thesis.chapter_4 import PRINTED
from exo_pin.thesis.prototype import ANGLES, PRINTED_FORCE, PRINTED_TENSIONS, RIG_RADIUS, STATIC

__all__ = ["searches"]

Readings = Iterator[tuple[str, ArrayLike]]

#: The example of Scenario One, Section 4.2.2: joint centres, mm, as printed.
_A_1, _A_3 = (0.0, -29.825, 51.658), (44.7371, -29.825, -25.83)
_A_2 = [(-44.7371, y, z) for y in (-29.825, -25.829) for z in (-25.83, 86.43, -86.43, 51.658)]
_B_1 = [(0.0, y, -86.43) for y in (94.9, 51.658)]
_B_2 = [(x, -25.829, -86.43) for x in (-44.7371, 44.7371)]
_B_3 = (44.7371, -25.829, -86.43)
#: Entries of the third matrix that lost their signs, in both states.
_SIGNS = tuple(product((1.0, -1.0), repeat=2))
_LENGTHS = [(159.5270, 41.6830, 108.7461), (159.5270, 41.6830, 108.741)]


def searches(rig: bool = True) -> list[Match]:
    """Search all rows; those of the test rig, which take some seconds, only with ``rig``."""
    forces = list(_appendix_d())
    found = [
        best_reading("(D-32)", "f_i (N)", PRINTED_TENSIONS, 0.05, ((name, f) for name, f, _ in forces)),
        best_reading(
            "(D-32)", "f_i up to a common factor", PRINTED_TENSIONS, 0.05, ((name, f) for name, f, _ in forces), True
        ),
        best_reading(
            "(D-33)",
            "y and z of F_s0, and its size (N)",
            [*PRINTED_FORCE[1:], np.linalg.norm(PRINTED_FORCE)],
            0.05,
            ((name, [*force[1:], np.linalg.norm(force)]) for name, force in _with_weight(forces)),
        ),
        *_table_a_2(),
        *_section_a_3(),
        best_reading("Section 4.2.2", "orientation (degrees)", [-3.4815, 47.4355, 44.3940], 5e-3, _scenario_one()),
        *_section_5_2_3(),
    ]
    if rig:
        angle = "lengths (mm), from angles of Table 5-2"
        found += [
            best_reading("Table 5-2, inverse kinematics", angle, [277.0, 184.0, 182.6], 1.0, _rig_angles()),
            best_reading("Table 5-2, forward kinematics", angle, [271.4833, 182.4, 180.5], 1.0, _rig_angles()),
            # The angles are printed to 0.1°, which is up to 0.5 mm.
            best_reading("Table 5-1", "estimated lengths (mm)", STATIC["estimated"].ravel(), 1.0, _rig_lengths()),
        ]
    return found


def _turns(angles: FloatArray) -> Iterator[tuple[str, FloatArray]]:
    """Rotation matrices, shape (..., 3, 3), of angles about x, y, z, shape (..., 3), for all orders and signs."""
    for order, signs in product(permutations(range(3)), product((1, -1), repeat=3)):
        name = " ".join(
            f"R{'xyz'[k]}({'-' if sign < 0 else ''}θ{'xyz'[k]})" for k, sign in zip(order, signs, strict=True)
        )
        letters = "".join("XYZ"[k] for k in order)
        yield name, Rotation.from_euler(letters, angles[..., order] * signs).as_matrix()


def _appendix_d() -> Iterator[tuple[str, FloatArray, tuple[FloatArray, FloatArray]]]:
    """Name, tensions, and Σ f_i s_i with the weight."""
    mechanism = preset("appendix-d")
    assert mechanism.arm is not None
    a, B, C = mechanism.geometry.base_points, mechanism.geometry.platform_points, mechanism.arm.centre_of_mass
    for (name, R), axis, sign, (g, known) in product(
        _turns(np.array(ANGLES)), range(3), (1, -1), ((9.81, "with g"), (1.0, "without g"))
    ):
        b = B @ R.T
        s = (b - a) / np.linalg.norm(b - a, axis=1, keepdims=True)
        arms = np.cross(b, s).T
        if abs(np.linalg.det(arms)) < 1e-9:
            continue
        weight = sign * mechanism.arm.mass * g * np.eye(3)[axis]
        f = np.linalg.solve(arms, np.cross(R @ C, weight))
        yield f"{name}, weight {known} along {'+' if sign > 0 else '-'}{'xyz'[axis]}", f, (s.T @ f, weight)


def _with_weight(
    forces: list[tuple[str, FloatArray, tuple[FloatArray, FloatArray]]],
) -> Iterator[tuple[str, FloatArray]]:
    for name, _, (limbs, weight) in forces:
        for factor, how in ((0, "left out of F_s0"), (-1, "subtracted"), (1, "added")):
            yield f"{name}, {how}", limbs + factor * weight


def _table_a_2() -> Iterator[Match]:
    a1, printed = table("a-1"), table("a-2").row("excitation")
    x = a1.row("x_j_mm")[:8] / 1e3
    for label, data, numbers, rounding in (
        ("K_1, K_2, C_1", a1.row("L_j_N_per_bar")[:8], printed[:3], [0.0005, 0.0005, 0.05]),
        ("S_1, S_2, S_3", a1.row("J_j_N")[:8], printed[3:], [0.5, 0.05, 0.05]),
    ):
        readings = (
            ("points " + ", ".join(str(k + 1) for k in chosen), np.polyfit(x[list(chosen)], data[list(chosen)], 2))
            for size in range(3, 9)
            for chosen in combinations(range(8), size)
        )
        yield best_reading("Table A-2, excitation", f"{label} (m, bar)", numbers, rounding, readings)


def _section_a_3() -> Iterator[Match]:
    a3 = table("a-3")
    x, p, weight = a3.row("contraction_mm") / 1e3, a3.row("pressure_bar") * BAR, float(a3.row("actual_weight_N")[0])
    forces = {"as printed": a3.row("calculated_force_N")}
    for form in ("relaxation", "excitation"):
        forces[f"of the {form} form"] = muscle_model(f"tang-{form}").unchecked_force(x, p)
    errors: dict[str, Callable[[FloatArray], float]] = {
        "of the mean": lambda f: abs(f.mean() - weight),
        "mean size": lambda f: float(np.abs(f - weight).mean()),
        "root mean square": lambda f: float(np.sqrt(((f - weight) ** 2).mean())),
        "of the median": lambda f: abs(float(np.median(f)) - weight),
        "median size": lambda f: float(np.median(np.abs(f - weight))),
        "largest": lambda f: float(np.abs(f - weight).max()),
    }
    spreads: dict[str, Callable[[FloatArray], float]] = {
        "n - 1": lambda f: float(f.std(ddof=1)),
        "n": lambda f: float(f.std()),
        "about the weight": lambda f: float(np.sqrt(((f - weight) ** 2).sum() / (len(f) - 1))),
        "variance": lambda f: float(f.var(ddof=1)),
        "range": lambda f: float(np.ptp(f)),
        "of sizes": lambda f: float(np.abs(f - weight).std(ddof=1)),
    }
    parts = {f"{of} {name}": (measure, f) for name, f in forces.items() for of, measure in errors.items()}
    readings = ((name, 100 * measure(f) / weight) for name, (measure, f) in parts.items())
    yield best_reading("Section A.3", "error (%)", 1.5, 0.05, readings)
    others = ((f"{of} {name}", measure(f)) for name, f in forces.items() for of, measure in spreads.items())
    yield best_reading("Section A.3", "standard deviation (N)", 1.42, 0.005, others)


def _arctan(R: FloatArray) -> list[float]:
    """(4-22) as printed."""
    return [np.arctan(-R[1, 2] / R[2, 2]), np.arcsin(np.clip(R[0, 2], -1, 1)), np.arctan(-R[0, 1] / R[0, 0])]


def _arctan2(R: FloatArray, cosine: float) -> list[float]:
    """In the right quadrants, with cos θy."""
    return [np.arctan2(-R[1, 2], R[2, 2]), np.arctan2(R[0, 2], cosine), np.arctan2(-R[0, 1], R[0, 0])]


def _by_row(R: FloatArray) -> list[float]:
    return _arctan2(R, np.hypot(R[0, 0], R[0, 1]))


def _by_column(R: FloatArray) -> list[float]:
    return _arctan2(R, np.hypot(R[1, 2], R[2, 2]))


def _nearest(R: FloatArray) -> list[float]:
    """Of the nearest rotation."""
    U, _, V = np.linalg.svd(R)
    return _arctan(U @ np.diag([1.0, 1.0, np.linalg.det(U @ V)]) @ V)


_EXTRACTIONS: dict[str, Callable[[FloatArray], list[float]]] = {
    "(4-22)": _arctan, "by the first row": _by_row, "by the last column": _by_column, "nearest rotation": _nearest,
}  # fmt: skip


def _scenario_one() -> Readings:
    """Name and (θx, θy, θz), degrees, of each reading."""
    points = product(_A_2, _B_1, _B_2, _LENGTHS, _SIGNS, (2, 1, 0), (None, 2), (1.0, -1.0))
    for A_2, B_1, B_2, lengths, signs, column, decimals, sign in points:
        A, B = np.array([_A_1, A_2, _A_3]), np.array([B_1, B_2, _B_3])
        if abs(np.linalg.det(B)) < 1e-6:
            continue
        matrices = PRINTED["matrices"].copy()
        matrices[2, 0, 1] *= signs[0]
        matrices[2, 2, 2] *= signs[1]
        directions = matrices[:, :, column] if decimals is None else matrices[:, :, column].round(decimals)
        R = np.linalg.solve(B, A + sign * np.array(lengths)[:, None] * directions).T
        name = (
            f"A_2 {A_2}, B_1 {B_1}, B_2 {B_2}, l_3 {lengths[2]}, signs {signs}, column {column + 1}, "
            f"{'all' if decimals is None else decimals} decimals, sign {sign:+.0f}"
        )
        for turned, matrix in (("R", R), ("R transposed", R.T)):
            for how, angles in _EXTRACTIONS.items():
                yield f"{name}, {turned}, {how}", np.degrees(angles(matrix))


def _section_5_2_3() -> Iterator[Match]:
    for radius, printed, height in (("r_A", 136.30, 78.0), ("r_B", 118.8, 200.0)):
        functions = {"sin": np.sin, "cos": np.cos, "tan": np.tan}
        factors = {
            f"{name} {degrees}°": float(function(np.radians(degrees)))
            for (name, function), degrees in product(functions.items(), (30, 60))
        }
        readings = [(f"h {name}", height * factor) for name, factor in factors.items()]
        readings += [(f"h / {name}", height / factor) for name, factor in factors.items()]
        yield best_reading("Section 5.2.3", f"{radius} (mm)", printed, 0.05, readings)


def _rig_angles() -> Readings:
    rows = {
        "θ_xA, inverse": (-75.4, -59.4, 43.4), "θ_yA, inverse": (-7.7, -54.1, 39.7),
        "θ_xA, measured": (-83.6, 31.1, 34.4), "θ_yA, forward": (-4.62, -59.4, 43.4),
    }  # fmt: skip
    for (name, angles), order, half in product(rows.items(), permutations(range(3)), (1.0, 0.5)):
        turned = np.radians(angles)[list(order)] * half
        for word, value in (("sin", np.abs(np.sin(turned))), ("cos", np.cos(turned))):
            yield f"2 |A| {word} of {name}, limbs {order}, angle times {half:g}", 2.0 * RIG_RADIUS * value


def _rig_lengths() -> Readings:
    """Lengths between joint centres anywhere on the sphere of the print, fitted limb by limb."""
    rng = np.random.default_rng(0)

    def on_sphere(p: FloatArray) -> FloatArray:
        size = np.sin(p[0])
        return RIG_RADIUS * np.array([size * np.cos(p[1]), size * np.sin(p[1]), np.cos(p[0])])

    for name, matrices in _turns(np.radians(STATIC["angles"])):
        fitted = np.empty_like(STATIC["estimated"])
        for limb, lengths in enumerate(STATIC["estimated"].T):

            def errors(p: FloatArray, R: FloatArray = matrices, wanted: FloatArray = lengths) -> FloatArray:
                return np.asarray(np.linalg.norm(R @ on_sphere(p[2:]) - on_sphere(p[:2]), axis=1) - wanted)

            fits = [scipy.optimize.least_squares(errors, rng.uniform(0.0, 6.0, 4)) for _ in range(3)]
            fitted[:, limb] = errors(min(fits, key=lambda fit: fit.cost).x) + lengths
        yield name, fitted.ravel()


if __name__ == "__main__":
    print("\n".join(map(str, searches())))
