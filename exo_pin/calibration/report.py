"""A calibration as text, whether errors explain its residuals, what it took as known, and what an error of that does.

Least squares moves the unknowns x by dx = -(JᵀJ + P)⁺ Jᵀ J_k dk where a quantity k is wrong by dk; J and J_k are the
derivatives of the lengths over their errors, and P is of the tolerances. With joints unknown a wrong mounting turns all
joints of its ring, seen from the shoulder, and leaves no residual at all; a wrong scale makes all of them grow.
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ..core.errors import ExoPinError, ExoPinWarning
from ..core.results import Known
from ..core.validation import FloatArray
from .length_model import FINEST, GROUPS, UNIT, UNITS, CalibrationProblem, Estimate, LengthModel, labels, whitening

if TYPE_CHECKING:
    from .result import Calibration


#: Undetermined directions and outliers that are listed; the others are counted.
_LISTED = 8
#: Other devices that are listed, and from which distance, m, a joint of theirs counts as elsewhere.
_OTHERS, _ELSEWHERE = 3, 1e-4


def report(found: Calibration) -> str:
    """Verdict, residuals, unknowns with their standard deviations, what is undetermined, other devices, outliers."""
    lines = [found.verdict, "", *_fit(found), "", *_unknowns(found)]
    if found.known:
        lines += ["", "Taken as known, and what an error of it would do (standard deviations, in the body's frame):"]
        lines += [f"  {each}{'; would show in the residuals' if each.shows else ''}" for each in found.known]
    if found.undetermined:
        lines += ["", "Not determined by these measurements:"]
        if found.lengths.size < found.model.size:
            lines.append(f"  ({found.lengths.size} lengths for {found.model.size} unknowns: measure more poses)")
        lines += [f"  {direction}" for direction in found.undetermined[:_LISTED]]
        lines += _rest(len(found.undetermined))
        lines.append("  Measure other poses, or hold the unknowns near the nominal design with tolerances.")
    if found.device_count > 1:
        lines += ["", *_others(found)]
    outliers = found.outliers
    if len(outliers):
        lines += ["", f"{len(outliers)} residuals beyond four standard deviations:"]
        lines += [
            f"  pose {k}, limb {i + 1}: {1e3 * found.residuals[k, i]:+.2f} mm" for k, i in outliers[:_LISTED].tolist()
        ]
        lines += _rest(len(outliers))
    return "\n".join(lines)


def _rest(count: int) -> list[str]:
    return [f"  and {count - _LISTED} more"] if count > _LISTED else []


def _others(found: Calibration) -> list[str]:
    """Devices that fit as well: how far from the nominal design they are, and which joints are elsewhere."""
    lines = [
        f"Other devices that fit equally well ({found.device_count - 1}), the nearest to the nominal design first:"
    ]
    own = np.concatenate(found.joints)
    names = [part for name in ("base_points", "platform_points") for part in labels(name, found.model.limb_count)]
    for device in found.devices[1 : _OTHERS + 1]:
        apart = np.linalg.norm(np.concatenate(device.joints) - own, axis=1)
        moved = [f"{name} {1e3 * size:.3g}" for name, size in zip(names, apart, strict=True) if size > _ELSEWHERE]
        lines.append(f"  {1e3 * device.distance:.3g} mm from it; joints elsewhere by mm: {', '.join(moved) or 'none'}")
    return lines


def _fit(found: Calibration) -> list[str]:
    residuals = found.residuals
    size = 1e3 * float(np.sqrt((residuals**2).mean()))
    source = "found" if found.errors.length_noise is None else "stated"
    lines = [
        f"poses and limbs      {len(residuals)} x {residuals.shape[1]}, {found.degrees_of_freedom} degrees of freedom",
        f"residuals            {size:.3g} mm (root of the mean square), largest {1e3 * np.abs(residuals).max():.3g} mm",
        f"noise of a length    {1e3 * found.length_noise:.3g} mm ({source})",
    ]
    if np.isfinite(found.probability):
        lines.append(f"probability          {found.probability:.2g} (chi-square, of residuals as large or larger)")
    return lines


def _unknowns(found: Calibration) -> list[str]:
    """One row a joint, a length offset, or a vector."""
    model = found.model
    lines = [f"{'unknown':22}{'nominal':>24}{'found':>24}{'standard deviation':>24}"]
    for name, place in model.places.items():
        parts = labels(name, model.limb_count)
        unit, factor = UNITS[name]
        nominal = None
        if name.endswith("points"):
            ring = int(name == "platform_points")
            nominal, values = (model.base, model.platform)[ring], model.points(found.values)[ring]
        elif name == "length_offsets":
            values = found.length_offsets
        elif name.endswith("mounting"):
            values = getattr(found, name).as_rotvec()
        else:
            values = found.values[place]
        rows, deviations = (x.reshape(len(parts), -1) for x in (values, found.standard_deviations[place]))
        for i, part in enumerate(parts):
            start = None if nominal is None else factor * nominal[i]
            lines.append(_row(f"{part}, {unit}", start, factor * rows[i], factor * deviations[i]))
    return lines


def _row(name: str, nominal: FloatArray | None, found: FloatArray, deviation: FloatArray) -> str:
    columns = ["" if nominal is None else _numbers(nominal, 1), _numbers(found, 1), _numbers(deviation, 2)]
    return f"{name:22}" + "".join(f"{column:>24}" for column in columns)


def _numbers(values: FloatArray, digits: int) -> str:
    return " ".join(f"{value:7.{digits}f}" for value in values)


#: Residuals beyond this many standard deviations are outliers.
OUTLIER = 4.0
#: Share of the squares of residuals that names one length, and one limb.
_MOST, _ALL_BUT = 0.4, 0.9
#: Residuals that are less probable than this contradict the stated noise.
_IMPROBABLE = 1e-3
#: Standard deviation of a normal distribution over the median of its absolute values.
_MEDIAN = 1.4826
#: Standard deviation of the logarithm of that median of N normal residuals, times √N.
_SPREAD = 1.17
#: Scales may differ by chance by this many standard deviations.
_CHANCE = 5.0
#: Singular values below this part of the largest are zero; freedoms that a test of fit needs.
_RANK, _LEAST_FREEDOM = 1e-8, 10


def contradiction(problem: CalibrationProblem, found: Estimate, z: FloatArray, probability: float) -> str:
    """What residuals say against a device, one sentence, or nothing.

    Parameters
    ----------
    problem : CalibrationProblem
        The measurements.
    found : Estimate
        The device.
    z : ndarray
        Shape (N, n): residuals over their standard deviation, which is the stated one, or that of all of them.
    probability : float
        Of the chi-square test, where it applies; else NaN.
    """
    errors = problem.errors
    size, middle = float(np.sqrt((z**2).mean())), _MEDIAN * float(np.median(np.abs(z)))
    chance = np.exp(_CHANCE * _SPREAD / np.sqrt(z.size))
    stated = errors.length_noise is not None
    if probability < _IMPROBABLE:
        said = f"The residuals contradict the stated noise: they are {size:.2g} times as large"
        where = _where(z)
        return f"{said}: {where}." if where else f"{said}."
    if not stated and middle > 0.0 and size > chance * middle:
        return (
            "The residuals are not those of one normally distributed noise: their root of the mean square is "
            f"{size / middle:.2g} times what their median says ({_where(z) or 'outliers, a slack muscle?'})."
        )
    if _lack_of_fit(problem, found) < _IMPROBABLE:
        return (
            "The residuals change with the pose as no noise does: something that was taken as known is wrong, a muscle "
            "is slack, or the shoulder's centre moves."
        )
    return ""


def _where(z: FloatArray) -> str:
    """The one length, or the one limb, that most of the squares of residuals are of; nothing where it is none."""
    squares = z**2
    worst, limbs = np.unravel_index(int(squares.argmax()), z.shape), squares.sum(axis=0)
    if squares[worst] > _MOST * squares.sum():
        return f"most of it is pose {worst[0]}, limb {worst[1] + 1}, an outlier"
    if limbs.max() > _ALL_BUT * limbs.sum():
        return f"nearly all of it is of limb {limbs.argmax() + 1}, whose muscle may be slack or sensor wrong"
    return ""


def _lack_of_fit(problem: CalibrationProblem, found: Estimate) -> float:
    """Probability that residuals depend on the pose as much as these or more by chance (F test).

    The device is compared with a model of each limb in which (l + o)² is any linear function of 1 and the nine S_jk,
    and o a constant: what lengths would be with other joints, mountings and offsets, to first order, and more. NaN if
    there are too few lengths.
    """
    model, measured, noise = problem.model, problem.measured, problem.errors.noise
    here = model.evaluate(found.values, measured)
    count, n = here.values.shape
    columns = np.concatenate([np.ones((count, 1)), measured.reshape(-1, 9)], axis=1)
    smooth = np.zeros((count, n, n, 11))
    spread = model.length_scale(found.values) * here.values + model.length_offsets(found.values)
    for i in range(n):
        spans = spread[:, i]
        smooth[:, i, i] = np.column_stack([columns / spans[:, None], np.ones(count)])
    smooth = whitening(here, noise, problem.errors.orientation_noise) @ smooth.reshape(count, n, -1)
    small = found.jacobian * model.scales
    large = np.concatenate([small, smooth.reshape(count * n, -1) * noise], axis=1)
    left, ranks = list[float](), list[int]()
    for matrix in (small, large):
        u, sizes, _ = np.linalg.svd(matrix, full_matrices=False)
        u = u[:, sizes > _RANK * sizes[0]]
        r = found.residuals
        left.append(float(((r - u @ (u.T @ r)) ** 2).sum()))
        ranks.append(u.shape[1])
    freedom, more = count * n - ranks[1], ranks[1] - ranks[0]
    if freedom < _LEAST_FREEDOM or more == 0 or left[1] <= 0.0:
        return float("nan")
    return float(scipy.stats.f.sf((left[0] - left[1]) / more / (left[1] / freedom), more, freedom))


#: An error shows if it moves the residuals together by this many standard deviations.
_SHOWS = 3.0
#: Effects on the joints below this, m, are none.
_NONE = 1e-9
#: Poses in which the force is asked for, at most, and step of the joints, m.
_POSES, _STEP = 60, 1e-5


def known_quantities(found: Calibration) -> tuple[Known, ...]:
    """All quantities that are no unknowns and change the joints, largest effect on the joints first."""
    model = found.model
    base, platform = model.points(found.values)
    mountings = found.torso_mounting, found.arm_mounting
    full = LengthModel(base, platform, found.length_offsets, *mountings, GROUPS)
    values = np.zeros(full.size)
    for name in ("length_scale", "base_offset", "cuff_offset"):
        if name in model.places:
            values[full.places[name]] = found.values[model.places[name]]
    here = full.evaluate(values, found.poses.as_matrix())
    noise = found.errors.noise
    J = (whitening(here, noise, found.errors.orientation_noise) @ here.by_unknowns).reshape(-1, full.size) * full.scales
    names = [name for name in model.unknowns if name not in model.known]
    asked = np.concatenate([np.arange(full.size)[full.places[name]] for name in names])
    stiff = np.diag(full.scales[asked] / found.information.prior[model.asked])
    # Of the joints by the scaled unknowns; turns and scales of sensors move none.
    rows, slopes = full.joint_slopes.reshape(-1, full.size), force_slopes(found)
    scale = max(found.estimate.scale, FINEST / UNIT)
    known = []
    for name in GROUPS:
        if name in names:
            continue
        place = full.places[name]
        right = np.concatenate([J[:, place], np.zeros((len(asked), J[:, place].shape[1]))])
        move = -np.linalg.lstsq(np.concatenate([J[:, asked], stiff]), right, rcond=1e-10)[0]
        unit, factor = UNITS[name]
        size = 1.0 / factor
        if name in model.known:
            size = float(found.standard_deviations[model.places[name]].max())
        step = size / full.scales[place]
        joints = (rows[:, asked] @ move + rows[:, place]) * step
        left = np.linalg.norm((J[:, place] + J[:, asked] @ move) * step)
        moved = float(np.sqrt((joints**2).sum(axis=1)).max())
        if moved < _NONE:
            continue
        effects = {"joints_mm": 1e3 * moved}
        if slopes is not None:
            effects["F_s_percent"] = 100.0 * float(np.median(np.linalg.norm(slopes @ joints, axis=1)))
        shows = bool(left > _SHOWS * scale)
        known.append(Known(name.replace("_", " "), factor * size, unit, effects, shows, name in model.known))
    return tuple(sorted(known, key=lambda each: -each.effects["joints_mm"]))


def force_slopes(found: Calibration) -> FloatArray | None:
    """Derivatives of |F_s| over itself by the joints, (N', 6 n), 1/m, with the arm at rest in the measured poses.

    Of plain equilibrium, by central differences; of poses that have an answer. None where the design has no arm.
    """
    if found.nominal.arm is None:
        return None
    chosen = np.linspace(0, len(found.poses) - 1, min(len(found.poses), _POSES)).astype(int)
    arm = found.torso_mounting * found.poses[chosen] * found.arm_mounting
    geometry, joints = found.nominal.geometry, np.stack(found.joints)

    def sizes(there: FloatArray) -> FloatArray:
        moved = geometry.replace(base_points=there[0], platform_points=there[1])
        return np.asarray(found.nominal.replace(geometry=moved).reaction(arm, limits="none").magnitude)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExoPinWarning)  # poses are as measured, whatever an arm can reach
        try:
            here = sizes(joints)
            steps = _STEP * np.eye(joints.size).reshape(-1, *joints.shape)
            slopes = np.stack([(sizes(joints + d) - sizes(joints - d)) / (2.0 * _STEP) for d in steps], axis=1)
        except ExoPinError:
            return None
    slopes = slopes / here[:, None]
    known = np.isfinite(slopes).all(axis=1)
    return slopes[known] if known.any() else None
