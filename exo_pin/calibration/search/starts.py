"""Where to start: the nominal design with many mountings, a linear fit of the squares of the lengths, and at random."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ...core.validation import FloatArray, frozen
from ..length_model import CalibrationProblem, LengthModel

#: Missing the place of a known joint counts as much as moving an unknown one by a distance larger by one over this.
_MISSED = 0.01
#: Twins nearer than this part of the joints' distance from the centre are one.
_SAME = 1e-4
#: A mirror image is tried where lengths change by less than this part of that distance.
_NEARLY = 0.05


def limb_options(model: LengthModel, minima: FloatArray, measured: FloatArray) -> list[FloatArray]:
    """Of each limb u, v and o, shape (k_i, 7), that give its lengths in minima (m, p), nearly or exactly.

    The first is that of the first minimum. Where both rings are unknown, limbs of different minima may be combined.
    """
    u, v = in_sensors(model, minima)
    offsets, found = model.length_offsets(minima) / model.length_scale(minima)[:, None], []
    for i in range(model.limb_count):
        options = np.zeros((0, 7))
        for own, to, offset in zip(u[:, i], v[:, i], offsets[:, i], strict=True):
            for pair in _pairs(model.reach, own, to, measured):
                option = np.append(pair, offset)
                if np.abs(options - option).max(axis=1).min(initial=np.inf) > _SAME * model.reach:
                    options = np.concatenate([options, option[None]])
        found.append(options)
    return found


def combined(model: LengthModel, options: list[FloatArray], most: int) -> FloatArray:
    """Devices of one option a limb, (K, p), the nearest to the nominal one; their rings may not be the known ones."""
    chosen = best_combinations(model, [each[:, :3] for each in options], [each[:, 3:6] for each in options], most)
    return devices_of(model, np.stack([each[k] for each, k in zip(options, chosen.T, strict=True)], axis=1))


def devices_of(model: LengthModel, limbs: FloatArray) -> FloatArray:
    """Unknowns (K, p) of u, v and o of all limbs, shape (K, n, 7), nearest to the nominal design."""
    return placed(model, limbs[..., :3], limbs[..., 3:6], limbs[..., 6])[0]


def _pairs(reach: float, u: FloatArray, v: FloatArray, measured: FloatArray) -> FloatArray:
    """The four of a limb, and mirror images, (k, 6)."""
    ends, starts = measured @ v, u @ measured
    r = np.linalg.norm(v) / np.linalg.norm(u)
    pairs = [(s * u, v / s) for s in (1.0, -1.0, r, -r)]
    for points, mirror in ((ends, 0), (starts, 1)):
        middle = points.mean(axis=0)
        normal = np.linalg.svd(points - middle, full_matrices=False)[2][-1]
        away = (v if mirror else u) - middle
        image = middle + away - 2.0 * (away @ normal) * normal
        lengths, before = (np.linalg.norm(points - x, axis=1) for x in (image, middle + away))
        if np.sqrt(((lengths - before) ** 2).mean()) < _NEARLY * reach:
            pairs.append((u, image) if mirror else (image, v))
    return np.array(pairs).reshape(-1, 6)


def in_sensors(model: LengthModel, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """u_i and v_i of vectors of unknowns (..., p), shape (..., n, 3) each, in lengths as the sensors show them."""
    a, b = (points / model.length_scale(values)[..., None, None] for points in model.joints(values))
    torso, arm = (mounting.as_matrix() for mounting in model.mountings(values))
    return a @ torso, b @ np.swapaxes(arm, -1, -2)


def placed(model: LengthModel, u: FloatArray, v: FloatArray, offsets: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Unknowns, nearest to the nominal design, that have their joints there.

    Parameters
    ----------
    u, v : ndarray
        Shape (K, m, 3), of the first m limbs.
    offsets : ndarray
        Shape (K, n), o_i.

    Returns
    -------
    values : ndarray
        Shape (K, p); joints of limbs beyond m are nominal.
    missed : ndarray
        Shape (K, 2, m, 3), m: how far joints of base and platform stay from their places; where these are unknown
        instead, how far they have moved.
    """
    values, missed, m = np.zeros((len(u), model.size)), list[FloatArray](), u.shape[1]
    rings = (
        (u, model.base, model.torso, "torso_mounting", "base_offset", "base_points"),
        (v, model.platform, model.arm.inv(), "arm_mounting", "cuff_offset", "platform_points"),
    )
    for seen, nominal, start, mounting, offset, points in rings:
        turn = np.broadcast_to(start.as_matrix(), (len(u), 3, 3))
        # What is known but for a tolerance stays where it is.
        free = model.places.keys() - set(model.known)
        if mounting in free:
            turn = _turned(seen, nominal[:m], offset in free)
            # Q_T = exp(θ) Q_T0; Q_S = Q_S0 exp(θ), so that Q_Sᵀ = exp(-θ) Q_S0ᵀ.
            own = (Rotation.from_matrix(turn) * start.inv()).as_rotvec()
            values[:, model.places[mounting]] = own if mounting == "torso_mounting" else -own
        moved = seen @ np.swapaxes(turn, 1, 2) - nominal[:m]
        if offset in free:
            values[:, model.places[offset]] = moved.mean(axis=1)
            moved = moved - moved.mean(axis=1, keepdims=True)
        if points in model.places:
            values[:, model.places[points]][:, : 3 * m] = moved.reshape(len(u), -1)
        missed.append(moved)
    if "length_offsets" in model.places:
        values[:, model.places["length_offsets"]] = offsets - model.offsets
    return values, np.stack(missed, axis=1)


def _turned(points: FloatArray, onto: FloatArray, shifted: bool) -> FloatArray:
    """Rotation matrices (K, 3, 3) that turn points (K, m, 3) onto others; after a shift, if so (Kabsch's algorithm)."""
    if shifted:
        points, onto = points - points.mean(axis=1, keepdims=True), onto - onto.mean(axis=0)
    left, _, right = np.linalg.svd(np.einsum("mi,kmj->kij", onto, points))
    left[:, :, 2] *= np.linalg.det(left @ right)[:, None]
    return np.asarray(left @ right)


def distances(model: LengthModel, values: FloatArray) -> FloatArray:
    """How far devices (..., p) are from the nominal one: root of the mean square over their joints, m, shape (...).

    Joints are seen from the shoulder's centre. Mountings do not count: where sensors sit says little of the device.
    """
    a, b = model.joints(values)
    moved = np.concatenate([a - model.base, b - model.platform], axis=-2)
    return np.asarray(np.sqrt((moved**2).sum(axis=-1).mean(axis=-1)))


def best_combinations(
    model: LengthModel, u: Sequence[FloatArray], v: Sequence[FloatArray], most: int
) -> NDArray[np.intp]:
    """One choice for each limb from lists of (k_i, 3): those whose rings are nearest to the nominal ones, (K, n).

    Limbs are added one by one, and the best choices kept. For rings that are unknown point by point, and not with their
    frame, the sum over limbs is the criterion, and the best are exactly those.
    """
    chosen = np.zeros((1, 0), dtype=np.intp)
    known = np.array([name not in model.places for name in ("base_points", "platform_points")])
    weights = np.where(known, 1.0 / _MISSED**2, 1.0)
    for i in range(len(u)):
        own = np.tile(np.arange(len(u[i])), len(chosen))[:, None]
        chosen = np.concatenate([np.repeat(chosen, len(u[i]), axis=0), own], axis=1)
        at, to = (np.stack([x[k][chosen[:, k]] for k in range(i + 1)], axis=1) for x in (u, v))
        values, missed = placed(model, at, to, model.offsets)
        score = ((missed**2).sum(axis=(2, 3)) * weights).sum(axis=1)
        for name in ("base_offset", "cuff_offset"):
            score = score + (i + 1) * (model.group(name, values) ** 2).sum(axis=1)
        chosen = chosen[np.argsort(score, kind="stable")[:most]]
    return chosen


#: Starts of each kind.
_MOUNTINGS, _LINEAR, _RANDOM = 12, 6, 14
#: Poses that choose among mountings to start from.
_ENOUGH = 50
#: Random starts: joints off by this part of their distance from the centre.
_SCATTER = 0.5


def starts(problem: CalibrationProblem, searched: Sequence[str]) -> FloatArray:
    """Vectors of unknowns, shape (S, p); the first is the nominal design.

    ``searched`` are mountings of which nothing is known.
    """
    model, measured, lengths = problem.model, problem.measured, problem.lengths
    found = [np.zeros((1, model.size))]
    if searched:
        found.append(_mountings(model, measured, lengths, searched))
    found.append(_linear(model, measured, lengths))
    rng = np.random.default_rng(0)
    scatter = _SCATTER * model.reach * model.scales * rng.normal(size=(_RANDOM, model.size))
    for name in ("torso_mounting", "arm_mounting"):
        if name in model.places:
            scatter[:, model.places[name]] = Rotation.random(_RANDOM, rng).as_rotvec()
    scatter[:, ~model.asked] = 0.0
    if "length_scale" in model.places:
        scatter[:, model.places["length_scale"]] = 0.0
    found.append(scatter)
    return _with_offsets(model, np.concatenate(found), measured, lengths)


def _with_offsets(model: LengthModel, values: FloatArray, measured: FloatArray, lengths: FloatArray) -> FloatArray:
    """The same with length offsets that fit best, if they are unknown."""
    if "length_offsets" in model.places:
        place, values = model.places["length_offsets"], values.copy()
        values[:, place] = 0.0
        values[:, place] = np.median(model.lengths(values, measured) - lengths, axis=1)
    return values


def _body_axes() -> Rotation:
    """The 24 mountings along the axes of the body, none at all first."""
    turns = Rotation.create_group("O")
    return turns[np.argsort(turns.magnitude(), kind="stable")]


def _mountings(model: LengthModel, measured: FloatArray, lengths: FloatArray, searched: Sequence[str]) -> FloatArray:
    """Sensors are often mounted with their axes along those of the body, in another order or sense."""
    chosen = np.linspace(0, len(measured) - 1, min(_ENOUGH, len(measured))).astype(int)
    torsos, arms = (
        _body_axes() if name in searched else Rotation.identity(1) for name in ("torso_mounting", "arm_mounting")
    )
    torso, arm = (torsos * model.torso).as_matrix(), (model.arm * arms).as_matrix()
    ends = np.einsum("kij,sjl,ml->ksmi", measured[chosen], arm, model.platform)
    seen = np.einsum("tij,ksmj->tskmi", torso, ends)
    misfit = lengths[chosen] + model.offsets - np.linalg.norm(seen - model.base, axis=-1)
    if "length_offsets" in model.places:
        misfit -= np.median(misfit, axis=2, keepdims=True)
    best = np.argsort(np.abs(misfit).mean(axis=(2, 3)).round(9), axis=None, kind="stable")[:_MOUNTINGS]
    t, s = np.unravel_index(best, misfit.shape[:2])
    values = np.zeros((len(best), model.size))
    for name, turns in (("torso_mounting", torsos[t]), ("arm_mounting", arms[s])):
        if name in searched:
            values[:, model.places[name]] = turns.as_rotvec()
    return values


def _linear(model: LengthModel, measured: FloatArray, lengths: FloatArray) -> FloatArray:
    """Devices from (l + o)² = |u|² + |v|² - 2 u vᵀ : S, which is linear in u vᵀ, |u|² + |v|² - o² and o.

    It needs no start, but ten poses or more in general position, eleven with length offsets unknown.
    """
    free = "length_offsets" in model.places
    columns = np.column_stack([np.ones(len(measured)), -2.0 * measured.reshape(-1, 9)])
    if len(measured) <= columns.shape[1] + free:
        return np.zeros((0, model.size))
    us, vs, offsets = list[FloatArray](), list[FloatArray](), np.zeros(model.limb_count)
    for i, own in enumerate(lengths.T):
        # An error of l is one of 2 l dl.
        left = np.column_stack([columns, -2.0 * own]) if free else columns
        right, root = own**2, 1.0 / np.maximum(np.abs(own), 1e-3)
        found = np.linalg.lstsq(left * root[:, None], right * root)[0]
        if free:
            offsets[i] = found[10]
        u, sizes, v = np.linalg.svd(found[1:10].reshape(3, 3))
        total = found[0] + offsets[i] ** 2
        # |u|² and |v|² have this sum and this product.
        half, product = max(0.5 * total, sizes[0]), sizes[0]
        long = np.sqrt(half + np.sqrt(half**2 - product**2))
        sides = np.array([long, -long, product / long, -product / long])
        us.append(sides[:, None] * u[:, 0])
        vs.append((product / sides)[:, None] * v[0])
    chosen = best_combinations(model, us, vs, 64)[:_LINEAR]
    at, to = (np.stack([x[k][chosen[:, k]] for k in range(len(us))], axis=1) for x in (us, vs))
    return placed(model, at, to, np.tile(offsets, (len(chosen), 1)))[0]


def with_offsets(model: LengthModel, measured: FloatArray, lengths: FloatArray) -> LengthModel:
    """The model with length offsets near those of the data, if they are unknown."""
    offsets = _with_offsets(model, np.zeros((1, model.size)), measured, lengths)
    return replace(model, offsets=model.length_offsets(offsets[0]))


def near_body_axes(model: LengthModel, values: FloatArray, searched: Sequence[str]) -> tuple[LengthModel, FloatArray]:
    """The same device as changes from a model whose mountings are the nearest along the axes of the body."""
    values = values.copy()
    for name in searched:
        turns, own = _body_axes(), Rotation.from_rotvec(model.group(name, values))
        is_torso = name == "torso_mounting"
        rest = own * turns.inv() if is_torso else turns.inv() * own
        k = int(rest.magnitude().round(9).argmin())
        model = replace(model, **({"torso": turns[k] * model.torso} if is_torso else {"arm": model.arm * turns[k]}))
        values[model.places[name]] = rest[k].as_rotvec()
    return model, frozen(values)
