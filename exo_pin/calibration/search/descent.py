"""Least squares from many starts at once: Levenberg-Marquardt on a stack of devices.

It finds the basins; :func:`exo_pin.calibration.estimation.estimate` then takes each minimum to full accuracy.
"""

from __future__ import annotations

import numpy as np

from ...core.validation import FloatArray
from ..estimation import Problem, robust_scale, weights_of

_STEPS = 60
#: Steps with first weights.
_FIRST = 12
#: A start has arrived when its unknowns move by less than this part of the joints' distance from the centre.
_STILL = 1e-6
#: Or when the cost falls by less than this part of it.
_LITTLE = 1e-4
#: Damping at the start, and the range that it may have.
_DAMPING, _LEAST, _MOST = 1e-3, 1e-9, 1e9
#: Tolerance, in scaled unknowns (m), where none is given: what is undetermined does not run away.
_LOOSE = 1.0


def misfits(problem: Problem, values: FloatArray) -> FloatArray:
    """Errors of lengths over their deviation, without correlations, shape (..., N, n)."""
    model, measured, lengths, errors, _ = problem
    if errors.orientation_noise == 0.0:
        return np.asarray((lengths - model.lengths(values, measured)) / errors.noise)
    found = model.evaluate(values, measured)
    turns = errors.orientation_noise**2 * (found.by_orientation**2).sum(axis=-1)
    return np.asarray((lengths - found.values) / np.sqrt(errors.noise**2 + turns))


def descend(problem: Problem, starts: FloatArray, first: FloatArray | None = None) -> FloatArray:
    """Minima that are reached from starts of shape (S, p), in the same order.

    For some steps residuals may have weights ``first`` (S, N n), such as zero where an outlier is suspected.

    With a robust loss the scale of the residuals is that of each device as it moves, at least the stated noise: far
    from a minimum no length is an outlier, so that the loss has few minima of its own.
    """
    model, measured, lengths, errors, prior = problem
    noise, turn = errors.noise, errors.orientation_noise
    stiff = model.scales**2 / np.minimum(prior, _LOOSE * model.scales) ** 2
    found, left, damping = starts.copy(), np.arange(len(starts)), np.full(len(starts), _DAMPING)
    for count in range(_STEPS):
        at = found[left]
        here = model.evaluate(at, measured)
        deviation = np.sqrt(noise**2 + turn**2 * (here.by_orientation**2).sum(axis=-1))
        r = ((lengths - here.values) / deviation).reshape(len(at), -1)
        scale = np.ones((len(at), 1))
        if errors.is_robust:
            scale = np.maximum(robust_scale(r), 0.0 if errors.length_noise is None else 1.0)[:, None]
        weights = weights_of(r / np.maximum(scale, 1e-12), errors.loss)
        if first is not None and count < _FIRST:
            weights = weights * first[left]
        J = (here.by_unknowns / deviation[..., None]).reshape(*r.shape, -1) * model.scales
        weighted = np.swapaxes(J * weights[..., None], 1, 2)
        H = weighted @ J + np.eye(model.size) * stiff
        down = (weighted @ r[..., None])[..., 0] - stiff * at / model.scales
        damped = H + damping[left, None, None] * np.eye(model.size) * np.diagonal(H, axis1=1, axis2=2)[:, None]
        step = np.linalg.solve(damped, down[..., None])[..., 0]
        ahead = at + step * model.scales
        new = ((lengths - model.lengths(ahead, measured)) / deviation).reshape(r.shape)
        before, after = (
            (weights * z**2).sum(axis=1) + (stiff * (x / model.scales) ** 2).sum(axis=1)
            for z, x in ((r, at), (new, ahead))
        )
        better = after <= before
        found[left[better]] = ahead[better]
        damping[left] = np.clip(damping[left] * np.where(better, 0.1, 10.0), _LEAST, _MOST)
        if first is not None and count < _FIRST:
            continue
        arrived = np.abs(step).max(axis=1) <= _STILL * model.reach
        arrived |= better & (before - after <= _LITTLE * before)
        left = left[~arrived & (damping[left] < _MOST)]
        if len(left) == 0:
            break
    return found
