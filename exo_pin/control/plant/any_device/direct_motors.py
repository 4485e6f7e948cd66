"""Motors without a spring between them and their joint, all of a device at once; their friction, brakes and ends.

Along the effort of each, with x' the speed in its direction, before what its own inertia takes:

    T = F - c x' - (F_c + μ |F| + F_brake) z - stops

|F| is at most the limit, and at most the stall effort times what is left of the speed without load. z is the bristle of
the elastoplastic friction of :mod:`exo_pin.control.plant.equations.drive_kernels`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pinocchio as pin

from ....core.validation import FloatArray
from ..drives import DirectDrive
from ..equations.drive_kernels import FLOWS, slip

_INTACT, _EFFORT, _POWERED, _BRAKE = (FLOWS.index(name) for name in ("intact", "effort", "powered", "brake"))


class DirectMotors:
    """The direct drives of a device; see the module.

    Parameters
    ----------
    drives : sequence of DirectDrive
        m of them.
    places : sequence
        Where each stands in v of the tree, or its route.
    tree : pinocchio.Model
        To whose joints their inertias are added.

    Attributes
    ----------
    places : ndarray of int
        Shape (m,), in v of the tree; 0 of a route, whose drive has no inertia.
    inertia, copper : ndarray
        Shape (m,): kg m² or kg; loss of the windings over the effort squared, W/(N m)² or W/N².
    """

    def __init__(self, drives: Sequence[DirectDrive], places: Sequence[Any], tree: pin.Model) -> None:
        own = [drive.parameters for drive in drives]
        routed = np.array([not isinstance(place, int) for place in places], dtype=bool)
        self.places = np.array([place if isinstance(place, int) else 0 for place in places], dtype=int)
        self._lower, self._upper = (np.array([getattr(d, end) for d in drives]) for end in ("lower", "upper"))
        limit = np.array([drive.force_limit for drive in drives])
        self._speed = np.array([drive.speed_limit for drive in drives])
        self._stall = np.array([p.stall_ratio for p in own]) * limit
        self._viscous, self._coulomb, self._share, self.inertia = (
            np.where(routed, 0.0, [getattr(p, name) for p in own])
            for name in ("viscous", "coulomb", "load_friction", "inertia")
        )
        self._presliding = np.array([p.presliding for p in own])
        self._ends = np.array([(drive.shortest, drive.longest) for drive in drives]).reshape(-1, 2)
        self._stop = np.where(routed, 0.0, limit / np.array([p.stop_depth for p in own]))
        self._stop_time = np.array([p.stop_time for p in own])
        self.copper = np.array([drive.copper for drive in drives])
        for place, inertia in zip(self.places, self.inertia, strict=True):
            tree.armature[place] += inertia

    def efforts(
        self, x: FloatArray, speed: FloatArray, sign: FloatArray, z: FloatArray, act: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """T, F, z' and the power that friction and ends take, shape (m,) each.

        Parameters
        ----------
        x, speed, sign, z : ndarray
            Coordinates, speeds along the efforts, 1 where a coordinate grows along its effort and else -1, bristles.
        act : ndarray
            What acts on them, shape (m, len(FLOWS)).
        """
        relative = speed / self._speed
        most = np.minimum(self._upper, np.maximum(self._stall * (1.0 - relative), self._lower))
        least = np.maximum(self._lower, np.minimum(-self._stall * (1.0 + relative), self._upper))
        # A torn drive acts on nothing, and takes nothing.
        intact = act[:, _INTACT]
        source = intact * act[:, _POWERED] * np.minimum(np.maximum(act[:, _EFFORT], least), most)
        bound = self._coulomb + self._share * np.abs(source) + act[:, _BRAKE]
        rub, bends = self._viscous * speed, np.zeros(len(x))
        if bound.any():
            # A bristle that carries nothing is not followed: it would bound the steps.
            bends = np.where(bound > 0.0, bristle_rates(speed, z, self._presliding), 0.0)
            rub = rub + bound * z
        push, power, _ = self.stops(x, sign * speed)
        return intact * (source - rub + sign * push), source, bends, intact * (rub * speed + power)

    def stops(self, x: FloatArray, rate: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Force of elastic ends along x, the power that they take, and their energy."""
        depth = np.maximum(self._ends[:, 0] - x, x - self._ends[:, 1])
        if (depth <= 0.0).all():
            return (np.zeros(len(x)),) * 3
        side = np.where(x < self._ends[:, 0], 1.0, -1.0)
        elastic = self._stop * np.maximum(depth, 0.0)
        push = np.where(depth > 0.0, np.maximum(elastic - side * self._stop * self._stop_time * rate, 0.0), 0.0)
        return side * push, (elastic - push) * side * rate, 0.5 * elastic * np.maximum(depth, 0.0)


def bristle_rates(v: FloatArray, z: FloatArray, over: Any) -> FloatArray:
    """z' of some bristles."""
    # The plain form, of a handful of numbers.
    slipping = np.array([slip.plain(*each) for each in zip((v * z).tolist(), np.abs(z).tolist(), strict=True)])
    return np.asarray((v - slipping * np.abs(v) * z) / over)
