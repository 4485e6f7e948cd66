"""What a calibration found."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput
from ..core.errors.checked import checked
from ..core.records import Record
from ..core.results import Known, taken_as_known
from ..core.validation import FloatArray, as_positive, frozen, set_fields
from ..load_case import CentreOffset
from .information import Information, Undetermined
from .length_model import FINEST, UNIT, CalibrationProblem, Estimate, LengthModel, MeasurementErrors
from .report import OUTLIER, contradiction, known_quantities
from .search.starts import distances

if TYPE_CHECKING:
    from ..exo.shoulder_exo import ShoulderExo

#: No device is worn with its centre farther than this from the shoulder's, m.
_FARTHEST_CENTRE = 0.2
#: A device is meant if its distance from the nominal design is below this part of that of any other.
_CLEARLY_NEARER = 0.5


@dataclass(frozen=True, eq=False, repr=False)
class FittedDevice(Record):
    """Where the joints of a device are, with what was found beside them.

    Attributes
    ----------
    nominal : ShoulderExo
        The design that it is near.
    model : LengthModel
        Equations and unknowns; ``model.names`` names them.
    values : ndarray
        Shape (p,): the unknowns, as changes from the start (m, rad), in the order of ``model.names``.

    Examples
    --------
    >>> nominal = ep.load("three-linear-actuators")
    >>> poses = nominal.pose(np.linspace(0, 80, 20), np.linspace(60, 0, 20), np.linspace(-10, 50, 20))
    >>> lengths = nominal.inverse_kinematics(poses).lengths + 0.001
    >>> found = ep.calibrate(poses, lengths, nominal, unknowns="length_offsets")
    >>> base, platform = found.devices[0].joints
    >>> bool(np.allclose(base, nominal.geometry.base_points)), found.device_count  # only the encoders are off
    (True, 1)
    """

    nominal: ShoulderExo
    model: LengthModel
    values: FloatArray

    @cached_property
    def distance(self) -> float:
        """m, from the nominal design: root of the mean square over the joints, seen from the shoulder's centre."""
        return float(distances(self.model, self.values))

    @property
    def joints(self) -> tuple[FloatArray, FloatArray]:
        """Joint centres A_i in {O_A} and B_i in {O_B}, shape (n, 3) each, m, seen from the shoulder's centre."""
        return self.model.joints(self.values)

    @property
    def length_offsets(self) -> FloatArray:
        """o_i, shape (n,), m: joint distance minus measured length."""
        return self.model.length_offsets(self.values)

    @property
    def torso_mounting(self) -> Rotation:
        """Q_T, from the torso's sensor to {O_A}."""
        return self.model.mountings(self.values)[0]

    @property
    def arm_mounting(self) -> Rotation:
        """Q_S, from {O_B} to the arm's sensor."""
        return self.model.mountings(self.values)[1]

    @property
    def centre_offset(self) -> CentreOffset:
        """Where the device's centre is, seen from the shoulder's: ``base_offset`` and ``cuff_offset``, zero if known.

        With joints alone unknown these are seen from the shoulder's centre and hold any offset.
        """
        base, cuff = (self.model.group(name, self.values) for name in ("base_offset", "cuff_offset"))
        found = CentreOffset.together(np.zeros(3))
        # However large: of what was found the verdict judges, and not the check of an input.
        set_fields(found, base=frozen(base.copy()), cuff=frozen(cuff.copy()))
        return found

    @property
    def exo(self) -> ShoulderExo:
        """The calibrated design; use it with :attr:`centre_offset`."""
        base, platform = self.model.points(self.values)
        return self.nominal.replace(geometry=self.nominal.geometry.replace(base_points=base, platform_points=platform))

    def __repr__(self) -> str:
        return f"<{type(self).__name__} near {self.nominal.name!r}: {1e3 * self.distance:.3g} mm from it>"


@checked
@dataclass(frozen=True, eq=False, repr=False)
class Calibration(FittedDevice):
    """Result of :func:`exo_pin.calibrate`: the device that fits and is nearest to the nominal design.

    Attributes
    ----------
    estimate : Estimate
        What least squares found, in its own weights.
    information : Information
        Covariance and what the data do not determine, for any function of the unknowns.
    poses : Rotation
        As measured, shape (N,).
    lengths : ndarray
        As measured, shape (N, n), m.
    errors : MeasurementErrors
        As stated.
    devices : tuple of FittedDevice
        All devices that fit as well, as far as their residuals can tell: this one and its discrete twins, the nearest
        to the nominal design first, at most 64.
    device_count : int
        How many there are.

    Examples
    --------
    >>> nominal = ep.load("three-linear-actuators")
    >>> poses = nominal.pose(np.linspace(0, 80, 30), np.linspace(60, 0, 30), np.linspace(-10, 50, 30))
    >>> lengths = nominal.inverse_kinematics(poses).lengths + np.random.default_rng(2).normal(0.0, 1e-4, (30, 3))
    >>> found = ep.calibrate(poses, lengths, nominal, unknowns="length_offsets")
    >>> round(1e3 * found.length_noise, 1), found.degrees_of_freedom  # mm; 90 lengths less three unknowns
    (0.1, 87)
    """

    estimate: Estimate
    information: Information
    poses: Rotation
    lengths: FloatArray
    errors: MeasurementErrors
    devices: tuple[FittedDevice, ...]
    device_count: int

    @property
    def covariance(self) -> FloatArray:
        """Shape (p, p), of :attr:`values`; an infinite variance and NaN where an unknown is not determined."""
        return self.information.covariance

    @property
    def standard_deviations(self) -> FloatArray:
        """Shape (p,), of :attr:`values`, m and rad; infinite where an unknown is not determined."""
        return self.information.standard_deviations

    def interval(self, probability: float = 0.95) -> FloatArray:
        """Where each of :attr:`values` lies with this probability, shape (p, 2); infinite where it is not determined.

        Parameters
        ----------
        probability : float
            Of the interval, above 0 and below 1.

        Returns
        -------
        numpy.ndarray
            Shape (p, 2), least and greatest, in the unit of each value (m or rad), in the order of ``model.names``; by
            Student's t where the noise is estimated from the residuals.

        Examples
        --------
        >>> nominal = ep.load("three-linear-actuators")
        >>> poses = nominal.pose(np.linspace(0, 80, 20), np.linspace(60, 0, 20), np.linspace(-10, 50, 20))
        >>> lengths = nominal.inverse_kinematics(poses).lengths + 0.002
        >>> found = ep.calibrate(poses, lengths, nominal, unknowns="length_offsets", length_noise=1e-3)
        >>> half = np.diff(found.interval(0.95)).ravel() / 2.0
        >>> (1e3 * half).round(2)  # mm: 1.96 · 1 mm/√20
        array([0.44, 0.44, 0.44])
        """
        as_positive("probability", probability)
        if probability >= 1.0:
            raise InvalidInput(f"expected a probability below 1, got {probability:g}")
        free = np.inf if self.errors.length_noise is not None else max(self.degrees_of_freedom, 1)
        half = scipy.stats.t(free).ppf(0.5 + 0.5 * probability) * self.standard_deviations
        return np.stack([self.values - half, self.values + half], axis=1)

    @property
    def undetermined(self) -> tuple[Undetermined, ...]:
        """What the measurements alone do not determine; empty if they determine all."""
        return self.information.undetermined

    @property
    def joint_deviations(self) -> FloatArray:
        """Standard deviations of :attr:`joints` in the body's frames, shape (2, n, 3), m, tolerances counted in."""
        slopes = self.model.joint_slopes
        spread = self.information.spread(slopes.reshape(-1, self.model.size))
        return frozen(np.sqrt(np.diag(spread)).reshape(slopes.shape[:3]))

    @cached_property
    def known(self) -> tuple[Known, ...]:
        """What was taken as known, and what an error of it does to the joints in the body's frames and to |F_s|.

        Each of its components is wrong with a standard deviation of ``size`` (that of its tolerance, where it has
        one). ``joints_mm`` is the largest standard deviation of a joint's coordinate that this makes, ``F_s_percent``
        the median of that of |F_s| with the arm at rest in the measured poses, where the design has an arm.
        """
        return known_quantities(self)

    @property
    def residuals(self) -> FloatArray:
        """Measured minus predicted lengths, shape (N, n), m."""
        return self.lengths - self.model.lengths(self.estimate.values, self.poses.as_matrix())

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
        return np.argwhere(np.abs(self.normalised_residuals) > OUTLIER)

    @property
    def degrees_of_freedom(self) -> int:
        """Lengths minus directions that they determine."""
        return self.lengths.size - self.information.rank

    @property
    def probability(self) -> float:
        """Of residuals as large as these or larger, if the stated noise is right (chi-square test).

        NaN if the noise was estimated from them, or if nothing is left.
        """
        if self.errors.length_noise is None or self.degrees_of_freedom <= 0:
            return float("nan")
        return float(scipy.stats.chi2.sf((self.estimate.residuals**2).sum(), self.degrees_of_freedom))

    @property
    def is_decided(self) -> bool:
        """Whether the nominal design is clearly nearer to this device than to any other that fits as well."""
        return len(self.devices) < 2 or self.distance < _CLEARLY_NEARER * self.devices[1].distance

    @cached_property
    def contradiction(self) -> str:
        """What speaks against this device: residuals that its errors do not explain; empty if they do."""
        off = max(float(np.linalg.norm(offset)) for offset in (self.centre_offset.base, self.centre_offset.cuff))
        if off > _FARTHEST_CENTRE:
            return f"The device's centre would be {1e3 * off:.3g} mm from the shoulder's: no device is worn like that."
        if self.errors.length_noise is None and self.length_noise < FINEST:
            return ""
        measured, prior = self.poses.as_matrix(), self.information.prior
        problem = CalibrationProblem(self.model, measured, self.lengths, self.errors, prior)
        return contradiction(problem, self.estimate, self.normalised_residuals, self.probability)

    @property
    def verdict(self) -> str:
        """What lengths cannot show first, then why not to rely on the device, then what is determined."""
        hidden = [each for each in self.known if not each.shows]
        first = taken_as_known(hidden, ", and errors of it do not show in lengths")
        return " ".join(part for part in (first, self._judgement) if part)

    @property
    def _judgement(self) -> str:
        size, lost, count = int(self.model.asked.sum()), len(self.undetermined), self.device_count
        bad = f"Not a good fit. {self.contradiction} Standard deviations do not hold." if self.contradiction else ""
        text = ""
        if lost:
            text = f"The measurements do not determine {lost} of {size} directions of the unknowns"
        elif not bad:
            worst = 1e3 * float(self.standard_deviations[self.model.asked].max())
            text = f"All {size} unknowns are determined, each to {worst:.2g} {self.model.unit}"
        if count > 1:
            near, other = (f"{1e3 * device.distance:.3g} mm" for device in self.devices[:2])
            text += f"{', among' if text else 'There are'} {count} devices that fit equally well: "
            if self.is_decided:
                text += f"this one is {near} from the nominal design, the next {other}"
            else:
                text += f"the nominal design does not decide between this one, {near} from it, and the next, {other}"
        return " ".join(part for part in (bad, text and f"{text}.") if part)

    def __str__(self) -> str:
        from .report import report

        return report(self)

    def __repr__(self) -> str:
        return f"<Calibration of {self.nominal.name!r}: {len(self.lengths)} poses, {self._judgement}>"
