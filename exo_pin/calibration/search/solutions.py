"""All devices that fit the measured lengths as well as the best one, and the one of them that is meant.

A descent from many starts at once, Levenberg-Marquardt on a stack of devices, finds the basins;
:func:`exo_pin.calibration.length_model.estimate` then takes each minimum to full accuracy.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...core.errors import SolverFailed
from ...core.validation import FloatArray
from ..length_model import FINEST, UNIT, CalibrationProblem, Estimate, estimate
from .starts import combined, devices_of, distances, in_sensors, limb_options, starts

#: Steps of a descent.
_STEPS = 60
#: A start has arrived when its unknowns move by less than this part of the joints' distance from the centre.
_STILL = 1e-6
#: Or when the cost falls by less than this part of it.
_LITTLE = 1e-4
#: Damping at the start, and the range that it may have.
_DAMPING, _LEAST, _MOST = 1e-3, 1e-9, 1e9
#: Tolerance, in scaled unknowns (m), where none is given: what is undetermined does not run away.
_LOOSE = 1.0
#: Costs that differ by no more than this many standard deviations squared cannot be told apart.
TOLD_APART = 4.0**2
#: Devices whose joints differ by less than this part of their distance from the centre are one.
_SAME = 1e-3
#: Minima taken to full accuracy; twins compared; of these, taken to their own minimum.
_MINIMA, _TWINS, _POLISHED = 4, 256, 16
#: Devices that are listed; the others are counted.
_LISTED = 64


def misfits(problem: CalibrationProblem, values: FloatArray) -> FloatArray:
    """Errors of lengths over their deviation, without correlations, shape (..., N, n)."""
    model, measured, lengths, errors, _ = problem
    if errors.orientation_noise == 0.0:
        return np.asarray((lengths - model.lengths(values, measured)) / errors.noise)
    found = model.evaluate(values, measured)
    turns = errors.orientation_noise**2 * (found.by_orientation**2).sum(axis=-1)
    return np.asarray((lengths - found.values) / np.sqrt(errors.noise**2 + turns))


def descend(problem: CalibrationProblem, starts: FloatArray) -> FloatArray:
    """Minima that are reached from starts of shape (S, p), in the same order."""
    model, measured, lengths, errors, prior = problem
    noise, turn = errors.noise, errors.orientation_noise
    stiff = model.scales**2 / np.minimum(prior, _LOOSE * model.scales) ** 2
    # In scaled unknowns.
    found, left, damping = starts / model.scales, np.arange(len(starts)), np.full(len(starts), _DAMPING)
    for _ in range(_STEPS):
        at = found[left]
        here = model.evaluate(at * model.scales, measured)
        deviation = np.sqrt(noise**2 + turn**2 * (here.by_orientation**2).sum(axis=-1))
        r = ((lengths - here.values) / deviation).reshape(len(at), -1)
        J = (here.by_unknowns / deviation[..., None]).reshape(*r.shape, -1) * model.scales
        across = np.swapaxes(J, 1, 2)
        H = across @ J + np.eye(model.size) * stiff
        down = (across @ r[..., None])[..., 0] - stiff * at
        damped = H + damping[left, None, None] * np.eye(model.size) * np.diagonal(H, axis1=1, axis2=2)[:, None]
        step = np.linalg.solve(damped, down[..., None])[..., 0]
        ahead = at + step
        new = ((lengths - model.lengths(ahead * model.scales, measured)) / deviation).reshape(r.shape)
        before, after = ((z**2).sum(axis=1) + (stiff * x**2).sum(axis=1) for z, x in ((r, at), (new, ahead)))
        better = after <= before
        found[left[better]] = ahead[better]
        damping[left] = np.clip(damping[left] * np.where(better, 0.1, 10.0), _LEAST, _MOST)
        arrived = np.abs(step).max(axis=1) <= _STILL * model.reach
        arrived |= better & (before - after <= _LITTLE * before)
        left = left[~arrived & (damping[left] < _MOST)]
        if len(left) == 0:
            break
    return found * model.scales


class _Search:
    """Costs of devices, in standard deviations squared and with one scale for all, and which are the same."""

    def __init__(self, problem: CalibrationProblem) -> None:
        self.problem, self.model, self.prior, self.errors = problem, problem.model, problem.prior, problem.errors
        self.scale, self.best, self.jacobian = 1.0, 0.0, np.zeros((0, problem.model.size))
        #: Whether what is asked for has tolerances; those of what is known decide nothing.
        self.has_tolerances = bool(np.isfinite(problem.prior[problem.model.asked]).any())

    def residuals(self, devices: FloatArray) -> FloatArray:
        """Of stated standard deviations, shape (K, N n)."""
        return misfits(self.problem, devices).reshape(len(devices), -1)

    def costs(self, devices: FloatArray) -> FloatArray:
        """Of devices (K, p)."""
        squares = (self.residuals(devices) ** 2).sum(axis=1) + ((devices / self.prior) ** 2).sum(axis=1)
        return np.asarray(squares / self.scale**2)

    def set_scale(self, devices: FloatArray) -> None:
        """That of the residuals of the best of these devices, and at least that of the stated noise."""
        r = self.residuals(devices)
        scale = float(np.sqrt((r**2).sum(axis=1).min() / max(r.shape[1] - self.model.size, 1)))
        self.scale = max(scale, FINEST / UNIT if self.errors.length_noise is None else 1.0)

    def minima(self, found: FloatArray) -> FloatArray:
        """The few best of these devices, to full accuracy, as far as they cannot be told apart; the best first."""
        self.set_scale(found)
        estimates, failure = list[Estimate](), None
        for values in self.candidates(found):
            try:
                estimates.append(estimate(self.problem, values))
            except SolverFailed as error:
                failure = error
        if failure is not None and not estimates:
            raise failure
        devices = np.stack([each.values for each in estimates])
        self.set_scale(devices)
        costs = self.costs(devices)
        first, self.best = int(costs.argmin()), float(costs.min())
        self.jacobian = estimates[first].jacobian / self.scale
        devices = devices[np.argsort(costs, kind="stable")]
        return devices[self.distinct(devices)]

    def candidates(self, found: FloatArray) -> list[FloatArray]:
        """The few best that are no twins of each other."""
        u, v = in_sensors(self.model, found)
        products = np.einsum("kni,knj->knij", u, v).reshape(len(found), -1) / self.model.reach
        kept = np.concatenate([products, self.model.length_offsets(found)], axis=1)
        chosen, costs = list[int](), self.costs(found)
        bound = costs.min() + max(4.0 * TOLD_APART, costs.min())
        for k in np.argsort(costs, kind="stable").tolist():
            if (
                costs[k] <= bound
                and np.abs(kept[chosen] - kept[k]).max(axis=1).min(initial=np.inf) > _SAME * self.model.reach
            ):
                chosen.append(k)
        return [found[k] for k in chosen[:_MINIMA]]

    def distinct(self, devices: FloatArray) -> NDArray[np.intp]:
        """Indices of devices that fit as well as the best and are not within the errors of one before them.

        Devices that differ along an undetermined direction are one, too, to first order.
        """
        kept, stiff = list[int](), 1.0 / self.prior / self.scale
        for k in np.flatnonzero(self.costs(devices) <= self.best + TOLD_APART).tolist():
            change = devices[k] - devices[kept]
            apart = ((change @ self.jacobian.T) ** 2).sum(axis=1) + ((stiff * change) ** 2).sum(axis=1)
            same = np.abs(change / self.model.scales).max(axis=1) < _SAME * self.model.reach
            if not (same | (apart <= TOLD_APART)).any():
                kept.append(k)
        return np.array(kept, dtype=np.intp)

    def all_devices(self, minima: FloatArray) -> tuple[FloatArray, int]:
        """All that cannot be told from the best, (K, p), at most 256, and how many there are."""
        model = self.model
        options = limb_options(model, minima, self.problem.measured)
        free = {"base_points", "platform_points"} <= set(model.places) - set(model.known) and not self.has_tolerances
        if free:
            # Limbs do not depend on each other: an option fits, or does not, whatever the others are.
            for i, own in enumerate(options):
                limbs = np.tile(np.stack([each[0] for each in options]), (len(own), 1, 1))
                limbs[:, i] = own
                devices = devices_of(model, limbs)
                options[i] = own[self.distinct(devices)]
        fit = combined(model, options, _TWINS)
        if self.has_tolerances or "length_scale" in model.places or (model.known and not free):
            # Tolerances say where in its frame a device is, and twins are of the nominal scale.
            fit = np.concatenate([minima, fit])
        fit = fit[self.distinct(fit)]
        return fit, math.prod(map(len, options)) if free else len(fit)


def solutions(problem: CalibrationProblem, searched: Sequence[str]) -> tuple[FloatArray, int]:
    """Search from several starts, enumerate the twins of what is found, choose the nearest to the nominal design.

    Parameters
    ----------
    problem : CalibrationProblem
        The measurements.
    searched : sequence of str
        Mountings of which nothing is known.

    Returns
    -------
    devices : ndarray
        Shape (k, p): unknowns of all devices that fit as well, the nearest first, at most 64.
    total : int
        How many there are.

    Raises
    ------
    SolverFailed
        If no start leads to a minimum.
    """
    model, search = problem.model, _Search(problem)
    found = descend(problem, starts(problem, searched))
    minima = search.minima(found)
    # Twins that fit nearly may fit as well once they are adjusted.
    twins = combined(model, limb_options(model, minima, problem.measured), _TWINS)
    near = twins[search.costs(twins) > search.best + TOLD_APART][:_POLISHED]
    if len(near):
        adjusted = descend(problem, near)
        fit = search.costs(adjusted) <= search.best + TOLD_APART
        minima = search.minima(np.concatenate([minima, adjusted[fit]]))
    devices, count = search.all_devices(minima)
    # Of equally near ones the better.
    order = np.lexsort((search.costs(devices), distances(model, devices).round(9)))
    return devices[order[:_LISTED]], count
