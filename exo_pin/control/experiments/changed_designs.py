"""Designs that experiments change: longer muscles, a fourth muscle, an arm that hangs outward."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput, MissingData
from ...core.validation import as_finite, as_positive, as_rotation, require_type
from ...design import Mechanism, WristGeometry
from ..plant.contraction import Contractions

#: End fittings of a limb with as much muscle as its joints leave room for, m: an assumption, two short yokes.
SHORT_FITTING = 0.025
#: Hole of the fourth muscle, degrees from the x axis. Figure 5-6 shows one without a number; of the holes every 10° it
#: is the one with which muscles that are long enough for both tests of 5.4.1 hold most of the abduction test.
ADDED_ANGLE = 160.0
#: Where the centre of mass of a left arm is in :func:`hung_outward`, m.
OUTWARD = -0.04
#: By how much points on a circle may be off, m.
_ROUND = 1e-6


def with_longer_muscles(mechanism: Mechanism, poses: Rotation, fitting: float = SHORT_FITTING) -> Mechanism:
    """The same joints with muscles that are as long as the limbs are at most in some poses, less short end fittings.

    Parameters
    ----------
    mechanism : Mechanism
        With muscles.
    poses : Rotation
        Stack, {O_B} to {O_A}: where the muscles shall not be stretched.
    fitting : float
        m, the same for all limbs.

    Returns
    -------
    Mechanism

    Notes
    -----
    Section 5.4.1 of the thesis asks for longer muscles.

    Examples
    --------
    >>> from exo_pin.control import with_longer_muscles
    >>> exo = ep.load("prototype")
    >>> poses = exo.pose(abduction=[0, 30, 60, 90])
    >>> longer = with_longer_muscles(exo.mechanism, poses, fitting=0.025)
    >>> muscles = [limb.stroke.nominal_length for limb in longer.limbs]
    >>> (1e3 * (exo.inverse_kinematics(poses).lengths.max(axis=0) - muscles)).round(6)  # mm: the fittings alone
    array([25., 25., 25.])
    """
    short = as_positive("fitting", fitting)
    contractions = Contractions(mechanism)
    if as_rotation("poses", poses).as_quat().size == 0:
        raise InvalidInput("expected one pose or more, got none")
    longest = np.asarray(contractions.lengths(poses)).reshape(-1, mechanism.limb_count).max(axis=0)
    if (longest <= 2.0 * short).any():
        raise InvalidInput(f"expected a fitting much shorter than the limbs, got {short:g} m")
    limbs = []
    for limb, most in zip(mechanism.limbs, longest.tolist(), strict=True):
        assert limb.stroke is not None
        limbs.append(replace(limb, stroke=replace(limb.stroke, nominal_length=most - short, end_fitting=short)))
    return mechanism.replace(limbs=limbs, name=f"{mechanism.name}, longer muscles")


def with_fourth_muscle(mechanism: Mechanism, angle_deg: float = ADDED_ANGLE) -> Mechanism:
    """One more muscle, of the kind of the last one, in another hole of the circles of base and cuff.

    Parameters
    ----------
    mechanism : Mechanism
        On circles, as (4-2), with three limbs.
    angle_deg : float
        Of the hole, from the x axis; degrees. Holes of a right shoulder are the mirror images of those of a left one.

    Returns
    -------
    Mechanism

    Raises
    ------
    MissingData
        If the joints of the mechanism do not lie on circles.

    Examples
    --------
    >>> from exo_pin.control import with_fourth_muscle
    >>> more = with_fourth_muscle(ep.load("prototype").mechanism)
    >>> from_centre = np.linalg.norm(more.geometry.platform_points, axis=1)
    >>> len(more.limbs), (from_centre / from_centre[0]).round(9)  # all joints of the cuff are on one circle
    (4, array([1., 1., 1., 1.]))
    """
    require_type("mechanism", mechanism, Mechanism, "a Mechanism")
    added = np.radians(float(as_finite("angle_deg", angle_deg, ())))
    rings = []
    # The base's circle lies across the y axis, the cuff's across the arm (4-2).
    for points, axis in ((mechanism.geometry.base_points, 1), (mechanism.geometry.platform_points, 2)):
        first, second = (0, 2) if axis == 1 else (0, 1)
        radius = np.hypot(points[:, first], points[:, second])
        if np.ptp(radius) > _ROUND or np.ptp(points[:, axis]) > _ROUND:
            raise MissingData(["circles of base and cuff"], "a fourth muscle in a hole of these", mechanism.name)
        point = np.empty(3)
        outward = -1.0 if axis == 2 and mechanism.side == "right" else 1.0
        point[first], point[second] = radius[0] * np.cos(added), outward * radius[0] * np.sin(added)
        point[axis] = points[0, axis]
        rings.append(np.vstack([points, point]))
    if np.linalg.norm(rings[0][:-1] - rings[0][-1], axis=1).min() < 1e-3:
        raise InvalidInput(f"expected a free hole, there is a limb at {angle_deg:g}° already")
    limbs = [*mechanism.limbs, mechanism.limbs[-1]]
    own = mechanism.geometry
    # On the same circles, so that the frames of the joints that were there stay.
    geometry = WristGeometry(rings[0], rings[1], own.base_axis, own.platform_axis, own.neutral)
    return mechanism.replace(geometry=geometry, limbs=limbs, name=f"{mechanism.name}, fourth muscle")


def hung_outward(mechanism: Mechanism, y: float | None = None) -> Mechanism:
    """The same design with the arm's centre of mass at another y in {O_B}, m, so that it hangs further out or in.

    Without ``y`` it lies 40 mm towards the body: y = -40 mm of a left shoulder, 40 mm of a right one.

    By Table 5-4 (y = 22.7 mm) the arm without muscles would hang at -6.8° of abduction, and its unit stops it at -5°.
    The dummy hung at +8.8°: what it carried there is not printed. Between the two, at 6.2°, lies a singular pose.

    Parameters
    ----------
    mechanism : Mechanism
        With an arm.
    y : float, optional
        m, in {O_B}.

    Returns
    -------
    Mechanism

    Examples
    --------
    >>> from exo_pin.control import hung_outward
    >>> exo = ep.load("prototype")
    >>> round(1e3 * float(hung_outward(exo.mechanism).arm.centre_of_mass[1]))  # mm in {O_B}
    -40
    """
    require_type("mechanism", mechanism, Mechanism, "a Mechanism")
    arm = mechanism.require_arm("another centre of mass")
    usual = OUTWARD if mechanism.side == "left" else -OUTWARD
    across = usual if y is None else float(as_finite("y", y, ()))
    centre = np.array([arm.centre_of_mass[0], across, arm.centre_of_mass[2]])
    return mechanism.replace(arm=replace(arm, centre_of_mass=centre), name=f"{mechanism.name}, arm hung outward")
