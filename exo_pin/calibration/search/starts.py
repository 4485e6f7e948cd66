"""Where to start: the nominal design with many mountings, a linear fit of the squares of the lengths, and at random."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.validation import FloatArray, frozen
from ..estimation import CalibrationProblem, robust_scale, weights_of
from ..length_model import LengthModel
from .twins import best_combinations, placed

#: Starts of each kind.
_MOUNTINGS, _LINEAR, _RANDOM = 12, 6, 14
#: Poses that choose among mountings to start from.
_ENOUGH = 50
#: Random starts: joints off by this part of their distance from the centre.
_SCATTER = 0.5
_ROUNDS = 10
#: Share of the lengths that subsets leave out, and how many there are at random.
_LEFT_OUT, _PARTS = 0.4, 6


def starts(problem: CalibrationProblem, searched: Sequence[str]) -> FloatArray:
    """Vectors of unknowns, shape (S, p); the first is the nominal design.

    ``searched`` are mountings of which nothing is known. A robust loss lets the linear fit resist outliers, too.
    """
    model, measured, lengths, errors, _ = problem
    found = [np.zeros((1, model.size))]
    if searched:
        found.append(_mountings(model, measured, lengths, searched))
    found.append(_linear(model, measured, lengths, errors.loss))
    rng = np.random.default_rng(0)
    scatter = _SCATTER * model.reach * model.scales * rng.normal(size=(_RANDOM, model.size))
    for name in ("torso_mounting", "arm_mounting"):
        if name in model.places:
            scatter[:, model.places[name]] = Rotation.random(_RANDOM, rng).as_rotvec()
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


def _linear(model: LengthModel, measured: FloatArray, lengths: FloatArray, loss: str) -> FloatArray:
    """Devices from (l + o)² = |u|² + |v|² - 2 u vᵀ : S, which is linear in u vᵀ, |u|² + |v|² - o² and o.

    It needs no start, but ten poses or more in general position, eleven with length offsets unknown.
    """
    free = "length_offsets" in model.places
    columns = np.column_stack([np.ones(len(measured)), -2.0 * measured.reshape(-1, 9)])
    if len(measured) <= columns.shape[1] + free:
        return np.zeros((0, model.size))
    us, vs, offsets = list[FloatArray](), list[FloatArray](), model.offsets.copy()
    for i, own in enumerate(lengths.T):
        # An error of l is one of 2 l dl.
        left = np.column_stack([columns, -2.0 * own]) if free else columns
        right, weights = (own if free else own + offsets[i]) ** 2, np.ones(len(own))
        for _ in range(1 if loss == "linear" else _ROUNDS):
            root = np.sqrt(weights) / np.maximum(np.abs(own), 1e-3)
            found = np.linalg.lstsq(left * root[:, None], right * root, rcond=None)[0]
            misfit = (right - left @ found) / np.maximum(np.abs(own), 1e-3)
            weights = weights_of(misfit / max(float(robust_scale(misfit)), 1e-12), loss)
        if free:
            offsets[i] = found[10]
        u, sizes, v = np.linalg.svd(found[1:10].reshape(3, 3))
        total = found[0] + (offsets[i] ** 2 if free else 0.0)
        # |u|² and |v|² have this sum and this product.
        half, product = 0.5 * max(total, 2.0 * sizes[0]), sizes[0]
        long = np.sqrt(half + np.sqrt(max(half**2 - product**2, 0.0)))
        sides = np.array([long, -long, product / long, -product / long])
        us.append(sides[:, None] * u[:, 0])
        vs.append((product / sides)[:, None] * v[0])
    chosen = best_combinations(model, us, vs, 64)[:_LINEAR]
    at, to = (np.stack([x[k][chosen[:, k]] for k in range(len(us))], axis=1) for x in (us, vs))
    return placed(model, at, to, np.tile(offsets, (len(chosen), 1)))[0]


def subsets(lengths: FloatArray) -> FloatArray:
    """Weights that leave out lengths (N, n) which may be outliers together, shape (k, N n).

    They are the shortest of each limb, where a muscle hangs slack, the longest, and some at random.
    """
    ranks = np.argsort(np.argsort(lengths, axis=0), axis=0) / len(lengths)
    rng = np.random.default_rng(1)
    parts = [ranks >= _LEFT_OUT, ranks < 1.0 - _LEFT_OUT, *(rng.random((_PARTS, *lengths.shape)) >= _LEFT_OUT)]
    return np.array(parts, dtype=float).reshape(len(parts), -1)


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
