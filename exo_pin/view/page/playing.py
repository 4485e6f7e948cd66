"""A scene in motion: played live, in real time, or recorded as a file that plays by itself."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Iterator
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
        answer = None if self._exo.arm is None else self._exo.reaction(poses, **query)
        start = time.monotonic()
        for index in self._frames(poses, answer, air, self._offsets(poses, query)):
            pause = start + float(stamps[index] - stamps[0]) - time.monotonic()
            if pause > 0:
                time.sleep(pause)
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
        answer = None if self._exo.arm is None else self._exo.reaction(poses, **query)
        taker = FrameTaker(self._stage)
        for _ in self._frames(poses, answer, air, self._offsets(poses, query)):
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

    def _frames(
        self,
        poses: Rotation,
        answer: Reaction | None,
        pressures: FloatArray | None,
        centres: list[Offset] | None,
    ) -> Iterator[int]:
        """Draw pose after pose; a frame begins when the one before has been dealt with."""
        for index, pose in enumerate(poses):
            self._draw(
                pose,
                None if answer is None else PoseForces.of(answer, (index,)),
                None if pressures is None else pressures[index],
                None if centres is None else centres[index],
            )
            yield index

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
    def _draw(
        self, pose: Rotation, forces: PoseForces | None, pressures: FloatArray | None, offset: Offset | None
    ) -> None:
        """Draw a pose."""
