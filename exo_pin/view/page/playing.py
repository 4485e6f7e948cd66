"""A scene in motion: played live, in real time, or recorded as a file that plays by itself."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_finite, as_rotation
from ...reaction import Reaction
from ..scene.force_arrows import PoseForces
from ..scene.offset_marks import Offset, offsets
from ..scene.stage import Stage
from .recording import FrameTaker, Recording

if TYPE_CHECKING:
    from ...exo.shoulder_exo import ShoulderExo

__all__ = ["Playing"]


class Playing(ABC):
    """Motions of a wrist with its forces; base of :class:`Scene`."""

    _stage: Stage
    _exo: ShoulderExo

    def play(
        self, orientations: Rotation, times: ArrayLike, pressures: ArrayLike | None = None, **query: Any
    ) -> Reaction | None:
        """Play a motion in the live page, in real time.

        Parameters
        ----------
        orientations : Rotation
            Poses, shape (k,).
        times : array_like
            Shape (k,), s, rising.
        pressures : array_like, optional
            As in :meth:`show`, shape (k, n).
        **query
            Further arguments of :meth:`exo_pin.ShoulderExo.reaction`, such as ``motion``, which broadcast to (k,).

        Returns
        -------
        Reaction or None
            Forces of all poses.
        """
        poses, stamps, air = self._motion(orientations, times, pressures)
        answer = None if self._exo.arm is None else self._exo.holding_reaction(poses, **query)
        forces = self._planned(poses, answer, query)
        centres = self._offsets(poses, query)
        start = time.monotonic()
        for index in range(len(stamps)):
            late = time.monotonic() - start
            # A machine that is too slow for all frames leaves some out, and never the last.
            if index + 1 < len(stamps) and stamps[index + 1] - stamps[0] < late:
                continue
            time.sleep(max(float(stamps[index] - stamps[0]) - late, 0.0))
            self._frame(index, poses, forces, air, centres)
        return answer

    def record(
        self, orientations: Rotation, times: ArrayLike, pressures: ArrayLike | None = None, **query: Any
    ) -> Recording:
        """Record a motion; the arguments are those of :meth:`play`, and no time passes.

        Returns
        -------
        Recording
            Its ``save`` writes one file that plays without a network.
        """
        poses, stamps, air = self._motion(orientations, times, pressures)
        answer = None if self._exo.arm is None else self._exo.holding_reaction(poses, **query)
        forces = self._planned(poses, answer, query)
        centres = self._offsets(poses, query)
        taker = FrameTaker(self._stage)
        for index in range(len(stamps)):
            self._frame(index, poses, forces, air, centres)
            taker.take()
        return taker.finish(stamps, answer)

    def _motion(
        self, orientations: Rotation, times: ArrayLike, pressures: ArrayLike | None
    ) -> tuple[Rotation, FloatArray, FloatArray | None]:
        """Poses, times and pressures that fit each other."""
        poses = as_rotation("orientations", orientations)
        stamps = as_finite("times", times, (None,))
        if poses.shape != stamps.shape or not len(stamps):
            raise InvalidInput(f"expected a time for every pose, got poses {poses.shape} and times {stamps.shape}")
        if (np.diff(stamps) <= 0).any():
            raise InvalidInput("expected times that rise")
        return poses, stamps, None if pressures is None else self._pressures(pressures, stamps.shape)

    def _planned(self, poses: Rotation, answer: Reaction | None, query: dict[str, Any]) -> list[PoseForces | None]:
        """Forces of all poses; the arrows' scale and the legend are theirs from here on."""
        forces = self._forces(poses, answer, query)
        self._plan(forces)
        return forces

    def _frame(
        self,
        index: int,
        poses: Rotation,
        forces: list[PoseForces | None],
        pressures: FloatArray | None,
        centres: list[Offset] | None,
    ) -> None:
        self._draw(
            poses[index],
            forces[index],
            None if pressures is None else pressures[index],
            None if centres is None else centres[index],
        )

    def _offsets(self, poses: Rotation, query: dict[str, Any]) -> list[Offset] | None:
        """Where the device's centre is in each pose, None if it is the shoulder's."""
        given = query.get("centre_offset")
        return None if given is None else offsets(given, poses, query.get("split", "spherical"))

    def _pressures(self, pressures: ArrayLike, shape: tuple[int, ...]) -> FloatArray:
        values = as_finite("pressures", pressures, (self._exo.geometry.limb_count,), stack=True)
        if values.shape[:-1] != shape:
            raise InvalidInput(f"expected pressures of shape {(*shape, values.shape[-1])}, got {values.shape}")
        return values

    @abstractmethod
    def _forces(self, poses: Rotation, answer: Reaction | None, query: dict[str, Any]) -> list[PoseForces | None]:
        """Forces of poses of shape () or (k,), a list of 1 or k."""

    @abstractmethod
    def _plan(self, forces: Sequence[PoseForces | None]) -> None:
        """Choose scale and legend for the poses to come."""

    @abstractmethod
    def _draw(
        self, pose: Rotation, forces: PoseForces | None, pressures: FloatArray | None, offset: Offset | None
    ) -> None:
        """Draw a pose."""
