"""A scene in motion: played live, in real time, or recorded as a file that plays by itself."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Unpack

from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_finite, as_rotation
from ...reaction import Reaction
from ..stage.force_arrows import PoseForces
from ..stage.offset import Offset, offsets
from .page_output import Pages
from .recording import SceneRecording, as_times, play_frames, record_frames

if TYPE_CHECKING:
    from ...exo.shoulder_exo import ShoulderExo
    from ...reaction.assumptions import Question


class Playing(Pages):
    """Motions of a wrist with its forces; base of :class:`Scene`."""

    _exo: ShoulderExo

    def play(
        self, poses: Rotation, times: ArrayLike, pressures: ArrayLike | None = None, **query: Unpack[Question]
    ) -> Reaction | None:
        """Play a motion in the live page, in real time.

        Parameters
        ----------
        poses : Rotation
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
        stamps, answer, draw = self._motion(poses, times, pressures, query)
        play_frames(stamps, draw)
        return answer

    def record(
        self, poses: Rotation, times: ArrayLike, pressures: ArrayLike | None = None, **query: Unpack[Question]
    ) -> SceneRecording:
        """Record a motion; the arguments are those of :meth:`play`, and no time passes.

        Returns
        -------
        SceneRecording
            Its ``save`` writes one file that plays without a network.
        """
        stamps, answer, draw = self._motion(poses, times, pressures, query)
        return record_frames(self._stage, stamps, draw, answer)

    def _motion(
        self, poses: Rotation, times: ArrayLike, pressures: ArrayLike | None, query: Question
    ) -> tuple[FloatArray, Reaction | None, Callable[[int], None]]:
        """Times, forces, and what draws a frame; scale and legend are those of the motion from here on."""
        poses = as_rotation("poses", poses)
        stamps = as_times(times, "pose", poses.shape)
        air = [None] * len(stamps) if pressures is None else self._pressures(pressures, stamps.shape)
        answer = None if self._exo.arm is None else self._exo.reaction(poses, **query)
        forces = self._forces(poses, answer, query)
        self._plan(forces)
        centres = self._offsets(poses, query)

        def draw(index: int) -> None:
            self._draw(poses[index], forces[index], air[index], centres[index])

        return stamps, answer, draw

    def _offsets(self, poses: Rotation, query: Question) -> Sequence[Offset | None]:
        """Where the device's centre is in each pose, None if it is the shoulder's."""
        given = query.get("centre_offset")
        if given is None:
            return [None] * (1 if poses.single else len(poses))
        return offsets(given, poses, query.get("split", "spherical"))

    def _pressures(self, pressures: ArrayLike, shape: tuple[int, ...]) -> FloatArray:
        values = as_finite("pressures", pressures, (self._exo.geometry.limb_count,), stack=True)
        if values.shape[:-1] != shape:
            raise InvalidInput(f"expected pressures of shape {(*shape, values.shape[-1])}, got {values.shape}")
        return values

    @abstractmethod
    def _forces(self, poses: Rotation, answer: Reaction | None, query: Question) -> list[PoseForces | None]:
        """Forces of poses of shape () or (k,), a list of 1 or k."""

    @abstractmethod
    def _plan(self, forces: Sequence[PoseForces | None]) -> None:
        """Choose scale and legend for the poses to come."""

    @abstractmethod
    def _draw(
        self, pose: Rotation, forces: PoseForces | None, pressures: FloatArray | None, offset: Offset | None
    ) -> None:
        """Draw a pose."""
