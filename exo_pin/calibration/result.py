"""What a calibration found."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..core.records import Record
from ..core.validation import FloatArray, frozen
from ..load_case import CentreOffset
from .estimation import UNIT, Estimate, MeasurementErrors
from .information import Information
from .length_model import LengthModel
from .plausibility import as_orientations
from .ring_position import RingPosition
from .undetermined import Undetermined

if TYPE_CHECKING:
    from ..exo.shoulder_exo import ShoulderExo

__all__ = ["Calibration"]

#: Residuals beyond this many standard deviations are named as outliers.
_OUTLIER = 4.0
#: Residuals this many times as large as the stated noise contradict it.
_CONTRADICTS = 1e-3


@dataclass(frozen=True, eq=False, repr=False)
class Calibration(Record):
    """Result of :func:`exo_pin.calibrate`.

    Attributes
    ----------
    nominal : ShoulderExo
        The design that it started from.
    model : LengthModel
        Equations and unknowns; ``model.names`` names them.
    estimate : Estimate
        What least squares found, in its own weights.
    information : Information
        Covariance and what the data do not determine, for any function of the unknowns.
    orientations : Rotation
        As measured, shape (N,).
    lengths : ndarray
        As measured, shape (N, n), m.
    errors : MeasurementErrors
        As stated.
    """

    nominal: ShoulderExo
    model: LengthModel
    estimate: Estimate
    information: Information
    orientations: Rotation
    lengths: FloatArray
    errors: MeasurementErrors

    @property
    def values(self) -> FloatArray:
        """Shape (p,): the unknowns, as changes from the start (m, rad), in the order of ``model.names``."""
        return frozen(np.array(self.estimate.values))

    @property
    def covariance(self) -> FloatArray:
        """Shape (p, p), of :attr:`values`; an infinite variance and NaN where an unknown is not determined."""
        return self.information.covariance

    @property
    def standard_deviations(self) -> FloatArray:
        """Shape (p,), of :attr:`values`, m and rad; infinite where an unknown is not determined."""
        return self.information.standard_deviations

    @property
    def undetermined(self) -> tuple[Undetermined, ...]:
        """What the measurements alone do not determine; empty if they determine all."""
        return self.information.undetermined

    @property
    def joints(self) -> tuple[FloatArray, FloatArray]:
        """Joint centres A_i in {O_A} and B_i in {O_B}, shape (n, 3) each, m, seen from the shoulder's centre."""
        return self.model.joints(self.estimate.values)

    @property
    def length_offsets(self) -> FloatArray:
        """o_i, shape (n,), m: joint distance minus measured length."""
        return self.model.length_offsets(self.estimate.values)

    @property
    def torso_mounting(self) -> Rotation:
        """Q_T, from the torso's sensor to {O_A}."""
        return self.model.mountings(self.estimate.values)[0]

    @property
    def arm_mounting(self) -> Rotation:
        """Q_S, from {O_B} to the arm's sensor."""
        return self.model.mountings(self.estimate.values)[1]

    @functools.cached_property
    def rings(self) -> tuple[RingPosition, RingPosition]:
        """How the rings of joints are displaced as wholes from their nominal places, base and platform."""
        base, platform = (
            RingPosition.of(self.model, self.estimate.values, self.information, ring) for ring in ("base", "platform")
        )
        return base, platform

    @property
    def centre_offset(self) -> CentreOffset:
        """Where the device's centre is, seen from the shoulder's: ``base_offset`` and ``cuff_offset``, zero if known.

        With joints alone unknown these are seen from the shoulder's centre and hold any offset; :attr:`rings` then says
        how each ring as a whole is displaced.
        """
        values = self.estimate.values
        return CentreOffset(self.model.group("base_offset", values), self.model.group("cuff_offset", values))

    @property
    def exo(self) -> ShoulderExo:
        """The calibrated design; use it with :attr:`centre_offset`."""
        values, shape = self.estimate.values, self.model.base.shape
        base = self.model.base + self.model.group("base_points", values, shape)
        platform = self.model.platform + self.model.group("platform_points", values, shape)
        return self.nominal.replace(geometry=self.nominal.geometry.replace(base_points=base, platform_points=platform))

    def predict(self, orientations: Rotation) -> tuple[FloatArray, FloatArray]:
        """Lengths that the calibrated device would show, and their standard deviations.

        What is undetermined does not matter for poses like the measured ones; for others it may, and the standard
        deviation is then infinite.

        Parameters
        ----------
        orientations : Rotation
            Stack of shape (...), as measured by the same sensors.

        Returns
        -------
        lengths, standard_deviations : ndarray
            Shape (..., n), m.
        """
        shape = orientations.shape if isinstance(orientations, Rotation) else ()
        poses = as_orientations(orientations)
        here = self.model.evaluate(self.estimate.values, poses.as_matrix())
        spread = [np.diag(self.information.spread(rows)) for rows in here.by_unknowns]
        return here.values.reshape(*shape, -1), np.sqrt(spread).reshape(*shape, -1)

    @property
    def residuals(self) -> FloatArray:
        """Measured minus predicted lengths, shape (N, n), m."""
        return self.lengths - self.model.lengths(self.estimate.values, self.orientations.as_matrix())

    @property
    def normalised_residuals(self) -> FloatArray:
        """The same, made independent with standard deviation 1, shape (N, n)."""
        scale = self.estimate.scale if self.estimate.scale > 0.0 else 1.0
        return (self.estimate.residuals / scale).reshape(self.lengths.shape)

    @property
    def length_noise(self) -> float:
        """Standard deviation of a measured length, m: as stated, else as found."""
        stated = self.errors.length_noise
        return UNIT * self.estimate.scale if stated is None else stated

    @property
    def outliers(self) -> NDArray[np.intp]:
        """Pose and limb, from 0, of residuals beyond four standard deviations, shape (k, 2)."""
        return np.argwhere(np.abs(self.normalised_residuals) > _OUTLIER)

    @property
    def degrees_of_freedom(self) -> int:
        """Lengths minus directions that they determine."""
        return self.lengths.size - self.information.rank

    @property
    def probability(self) -> float:
        """Of residuals as large as these or larger, if the stated noise is right (chi-square test).

        NaN if the noise was estimated from them, if nothing is left, or for a robust loss.
        """
        if self.errors.length_noise is None or self.errors.loss != "linear" or self.degrees_of_freedom <= 0:
            return float("nan")
        return float(scipy.stats.chi2.sf((self.estimate.residuals**2).sum(), self.degrees_of_freedom))

    @property
    def verdict(self) -> str:
        """One sentence."""
        lost = len(self.undetermined)
        worst = float(self.standard_deviations.max())
        if lost:
            text = f"The measurements do not determine {lost} of {self.model.size} directions of the unknowns."
        else:
            text = f"All {self.model.size} unknowns are determined, each to {1e3 * worst:.2g} {self.model.unit}."
        if self.probability < _CONTRADICTS:
            text += " The residuals contradict the stated noise."
        return text

    def __str__(self) -> str:
        from .report import report

        return report(self)

    def __repr__(self) -> str:
        return f"<Calibration of {self.nominal.name!r}: {len(self.lengths)} poses, {self.verdict}>"
