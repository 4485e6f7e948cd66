"""What a device does to the person's arm, in a form that knows nothing of the device."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from ...core.conventions import WRENCH_MIRROR
from ...core.errors import InfeasibleBounds, InvalidInput
from ...core.errors.base import echo
from ...core.errors.checked import checked
from ...core.records import Record
from ...core.validation import FloatArray, as_choice, as_finite, as_real, set_fields
from ...load_case import Load, Motion
from ...load_case.pose_stacks import as_query, carried

if TYPE_CHECKING:
    from ..wearer import Person


@checked
@dataclass(frozen=True, eq=False)
class DeviceAction(Record):
    """Wrenches of a device with n limbs on the person's upper arm, for poses of shape (...).

    Attributes
    ----------
    constant : ndarray
        Shape (..., 6): force, N, and moment about the glenohumeral centre, N m, in {O_A}, that does not depend on the
        limb forces.
    limbs : ndarray
        Shape (..., n, 6): the same per newton of each limb force.
    lower, upper : ndarray
        Shape (..., n), N: bounds of the limb forces; equal where the forces are given. NaN rows have no result.
    least : {"effort", "contact"}
        What is made small where the limb forces are not given.
    chosen_by : str
        How the limb forces are chosen, for the reader.
    caution : str
        What the device cannot do, a sentence that comes before the result; empty if it can, or if that is not known.
    side_forces : int
        How many of the last of the n forces are side forces of limbs, and not forces of actuators.
    held : ndarray of bool
        Shape (...): whether the device can do by itself what it is asked; where it cannot, no relief is reported.
    drive_units : tuple of (str, str)
        Name and unit of each of the n forces; empty for limbs, whose tensions they are, N.

    Examples
    --------
    >>> lift = np.array([0.0, 0.0, 20.0, 0.0, -5.0, 0.0])  # N and N m: 20 N up, 5 N m of flexion
    >>> none = np.zeros((0, 6))
    >>> action = ep.DeviceAction(lift, none, np.zeros(0), np.zeros(0))
    >>> man, pose = ep.Person(1.75, 75, "male"), ep.shoulder_rotation(45, 0, 0, degrees=True)
    >>> answer = man.joint_contact(pose, device=action)
    >>> bool(answer.magnitude < answer.without_device.magnitude)  # the device relieves the joint
    True
    """

    constant: FloatArray
    limbs: FloatArray
    lower: FloatArray
    upper: FloatArray
    least: str = "effort"
    chosen_by: str = "given wrench"
    caution: str = ""
    side_forces: int = 0
    held: NDArray[np.bool_] | bool = True
    drive_units: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        numbers = {name: as_real(name, getattr(self, name)) for name in ("limbs", "lower", "upper")}
        set_fields(self, constant=as_finite("constant", self.constant, (6,), stack=True), **numbers)
        as_choice("what is made small", self.least, ("effort", "contact"))
        if self.limbs.ndim < 2 or self.limbs.shape[-1] != 6:
            raise InvalidInput(f"expected limbs to have shape (..., n, 6), got {self.limbs.shape}")
        n = self.limbs.shape[-2]
        for name in ("lower", "upper"):
            if getattr(self, name).shape[-1:] != (n,):
                raise InvalidInput(f"expected {name} to have shape (..., {n}), got {getattr(self, name).shape}")
        if not (isinstance(self.side_forces, int) and 0 <= self.side_forces <= n):
            raise InvalidInput(f"expected side_forces as a number of 0 to {n}, got {echo(self.side_forces)}")
        crossed = np.asarray(self.lower > self.upper)
        if crossed.any():
            raise InfeasibleBounds(np.flatnonzero(crossed.reshape(-1, n).any(axis=0)))

    def mirrored(self) -> DeviceAction:
        """Mirror image in the x-z plane; moments are pseudovectors, and so are the axes of side forces, X_i.

        Returns
        -------
        DeviceAction

        Examples
        --------
        >>> wrench = np.array([1.0, 2.0, 3.0, 0.1, 0.2, 0.3])
        >>> action = ep.DeviceAction(wrench, np.zeros((0, 6)), np.zeros(0), np.zeros(0))
        >>> action.mirrored().constant.tolist()
        [1.0, -2.0, 3.0, -0.1, 0.2, -0.3]
        """
        n, limbs = self.lower.shape[-1], self.limbs @ WRENCH_MIRROR
        turned = np.arange(n) >= n - self.side_forces
        return replace(
            self,
            constant=self.constant @ WRENCH_MIRROR,
            limbs=np.where(turned[:, None], -limbs, limbs),
            lower=np.where(turned, -self.upper, self.lower),
            upper=np.where(turned, -self.lower, self.upper),
        )

    def about(self, shift: FloatArray) -> DeviceAction:
        """The same wrenches with moments about a centre that is displaced by ``shift``, shape (3,), m.

        Parameters
        ----------
        shift : ndarray
            Shape (3,), m, from the old centre to the new one.

        Returns
        -------
        DeviceAction

        Examples
        --------
        >>> up = np.array([0.0, 0.0, 30.0, 0.0, 0.0, 0.0])
        >>> action = ep.DeviceAction(up, np.zeros((0, 6)), np.zeros(0), np.zeros(0))
        >>> action.about(np.array([0.02, 0.0, 0.0])).constant[3:].round(6)  # N m; 30 N, 20 mm behind it
        array([0. , 0.6, 0. ])
        """
        shift = as_finite("shift", shift, (3,))

        def moved(wrench: FloatArray) -> FloatArray:
            moment = wrench[..., 3:] - np.cross(shift, wrench[..., :3])
            return np.concatenate([wrench[..., :3], moment], axis=-1)

        return replace(self, constant=moved(self.constant), limbs=moved(self.limbs))

    def flat(self, shape: tuple[int, ...]) -> DeviceAction:
        """The same on a stack of N poses: constant wrench (N, 6), limb wrenches (N, n, 6) and bounds (N, n).

        Parameters
        ----------
        shape : tuple of int
            Of the stack.

        Returns
        -------
        DeviceAction

        Raises
        ------
        InvalidInput
            If they do not broadcast to the stack.

        Examples
        --------
        >>> action = ep.DeviceAction(np.zeros(6), np.ones((4, 6)), np.zeros(4), np.full(4, 100.0))
        >>> flat = action.flat((2, 3))
        >>> flat.constant.shape, flat.limbs.shape, flat.upper.shape
        ((6, 6), (6, 4, 6), (6, 4))
        """
        n, count = self.limbs.shape[-2], math.prod(shape)
        tails = {"constant": (6,), "limbs": (n, 6), "lower": (n,), "upper": (n,), "held": ()}
        try:
            spread: dict[str, Any] = {
                name: np.broadcast_to(getattr(self, name), (*shape, *tail)).reshape(count, *tail)
                for name, tail in tails.items()
            }
        except ValueError:
            raise InvalidInput(f"expected the device's wrenches to broadcast to the poses' shape {shape}") from None
        return replace(self, **spread)


def as_action(device: DeviceAction | ArrayLike) -> DeviceAction:
    """A device given as a wrench on the arm, shape (..., 6), or as an action."""
    if isinstance(device, DeviceAction):
        return device
    wrench = as_finite("device", device, (6,), stack=True)
    return DeviceAction(wrench, np.zeros((0, 6)), np.zeros(0), np.zeros(0))


#: Moment of an arm that is rounding, N m.
_NONE = 1e-9


def require_drives(device: Any) -> None:
    """Raise unless a device has drives that can set a share of the moments.

    Raises
    ------
    InvalidInput
        If none of its drives makes a moment: what it carries then follows from the pose.
    """
    if not device.driven_moments:
        raise InvalidInput(
            f"expected no share of the moments (forces, --share) for {device.name!r}, which has no drives that could "
            "set one: what its springs carry follows from the pose. Leave it out, and the answer says the share"
        )


def load_of_share(
    share: float, wearer: Person, gravity: FloatArray, poses: Rotation, motion: Motion | None, load: Load | None
) -> Load:
    """The load with which a device carries a share of the moments of the person's arm (weight, inertia and load).

    The rest of the moments, which the wearer's muscles carry, acts on the arm as a couple.

    Raises
    ------
    InvalidInput
        If the share is not between 0 and 1.
    """
    if not 0.0 <= share <= 1.0:
        raise InvalidInput(f"expected forces as a share of 0 to 1 of the arm's moments, got {share:g} (percent?)")
    query = as_query(poses, motion, load)
    moment = carried(wearer.arm, gravity, query, query.force, query.moment)[1]
    couple = query.moment - (1.0 - share) * moment
    return Load(query.force.reshape(*query.shape, 3), couple.reshape(*query.shape, 3))


def share_words(
    cuff: FloatArray, wearer: Person, gravity: FloatArray, poses: Rotation, motion: Motion | None, load: Load | None
) -> str:
    """What a device carries of the moments of the person's arm, and what it leaves to the muscles, in a clause.

    The share is 1 - |moment left| / |moment of the arm|; it is negative where the device adds to what the wearer must
    make.

    Parameters
    ----------
    cuff : ndarray
        Wrench of the cuff on the person's arm, shape (..., 6), about O, base frame; NaN where it is not known.
    wearer, gravity, poses, motion, load
        As in :func:`load_of_share`.
    """
    query = as_query(poses, motion, load)
    moment = carried(wearer.arm, gravity, query, query.force, query.moment)[1]
    bare = np.linalg.norm(moment, axis=-1)
    left = np.linalg.norm(moment + cuff.reshape(-1, 6)[:, 3:], axis=-1)
    known = np.isfinite(left)
    if not known.any():
        return "the share of the moments that it carries is not known"
    most = f"{left[known].max():.2f} N m"
    needed = known & (bare > _NONE)
    if not needed.any():
        return f"the arm needs no moment here; it leaves {most} to the wearer's muscles"
    shares = 100.0 * (1.0 - left[needed] / bare[needed])
    if len(bare) > 1:
        low, middle, high = (f"{value + 0.0:.0f}" for value in np.percentile(shares, (0.0, 50.0, 100.0)))
        return (
            f"it carries {low} to {high} % (median {middle} %) of the moments of the person's arm, and leaves "
            f"at most {most} to the wearer's muscles"
        )
    if shares[0] < 0.0:
        return f"it adds {-shares[0]:.0f} % to the moments of the person's arm: {most} for the wearer's muscles"
    return (
        f"it carries {shares[0] + 0.0:.0f} % of the moments of the person's arm here, and leaves {most} to the "
        "wearer's muscles"
    )
