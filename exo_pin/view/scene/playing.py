"""The scene of a device in motion: played live, in real time, or recorded, also of a run of the plant."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Unpack

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.validation import FloatArray, as_finite, as_positive, as_rotation
from ...load_case import Load, Motion
from ...reaction import Reaction
from ...reaction.constraints.limb_limits import given_forces
from ..picture.drawn_device import DrawnDevice, Placed
from ..picture.mechanism_picture import Offset, offsets
from ..stage.force_arrows import DrawnForce, ShownForces
from .page_output import Pages
from .scene_recording import SceneRecording, as_times, play_frames, record_frames

if TYPE_CHECKING:
    from ...control.plant.run import Run
    from ...exo.shoulder_exo import ShoulderExo
    from ...reaction.assumptions import Question
    from .scene_of_exo import Scene


#: Most limbs whose forces a motion determines.
_DETERMINED = 3


def record_run(scene: Scene, run: Run, frames_a_second: float = 25.0) -> SceneRecording:
    """Record a run of the plant, in real time.

    Parameters
    ----------
    scene : Scene
        Of the design that was run.
    run : Run
        From :meth:`exo_pin.control.Plant.simulate`.
    frames_a_second : float
        At most; frames are samples of the run.

    Returns
    -------
    SceneRecording
        Arm, pressures, and the forces that this motion takes: those of the reaction query with the run's own motion
        and moments of friction and stops. Limb forces are the run's tensions, as in
        :meth:`exo_pin.control.plant.run.Run.reaction`. Without pressures if all limbs have motors.

    Raises
    ------
    InvalidInput
        If the run has only one sample.
    """
    if len(run.times) < 2:
        raise InvalidInput("expected a run of two samples or more: this one ended where it began")
    first, last = float(run.times[0]), float(run.times[-1])
    count = max(int((last - first) * as_positive("frames_a_second", frames_a_second)), 1)
    wanted = np.linspace(first, last, count + 1)
    # The samples nearest to these times: between samples tensions and motion would not balance.
    after = np.clip(np.searchsorted(run.times, wanted), 1, len(run.times) - 1)
    nearer = wanted - run.times[after - 1] < run.times[after] - wanted
    rows = np.unique(np.where(nearer, after - 1, after))
    given = run.load()
    query: dict[str, Any] = {
        "motion": Motion(run.angular_velocity[rows], run.angular_acceleration[rows]),
        "load": Load(given.force, np.asarray(given.moment)[rows], given.at),
    }
    if run.plant.count > _DETERMINED:
        query["limits"] = given_forces(run.tensions[rows])
    pressures = None if run.plant.motors.all() else np.maximum(run.pressures[rows], 0.0)
    return scene.record(run.rotations[rows], run.times[rows], pressures, **query)


class Frame(NamedTuple):
    """What is drawn of a pose: forces and arrows where the device has an arm, pressures of muscles in Pa."""

    placed: Placed
    forces: ShownForces | None
    arrows: list[DrawnForce]
    pressures: FloatArray | None


class Playing(Pages):
    """Motions of a device with its forces; base of :class:`Scene`."""

    _exo: ShoulderExo
    _drawn: DrawnDevice

    def play(
        self, poses: Rotation, times: ArrayLike, pressures: ArrayLike | None = None, **query: Unpack[Question]
    ) -> Reaction | None:
        """Play a motion in the live page, in real time.

        Parameters
        ----------
        poses : Rotation
            Poses, shape (k,), {O_B} to {O_A}.
        times : array_like
            Shape (k,), s, rising.
        pressures : array_like, optional
            Of the muscles, as in :meth:`show`, shape (k, n), gauge, Pa.
        **query
            Further arguments of :meth:`exo_pin.ShoulderExo.reaction`, such as ``motion``, which broadcast to (k,).

        Returns
        -------
        Reaction or None
            Forces of all poses.

        Examples
        --------
        >>> from exo_pin.view import Scene
        >>> exo = ep.load("three-linear-actuators")
        >>> answer = Scene(exo, human=False).play(exo.pose(flexion=[30, 31]), [0.0, 0.02])  # s
        >>> answer.magnitude.round(1)  # N
        array([26.3, 25.9])
        """
        stamps, answer, draw = self._motion(poses, times, pressures, query)
        play_frames(stamps, draw)
        return answer

    def record(
        self, poses: Rotation, times: ArrayLike, pressures: ArrayLike | None = None, **query: Unpack[Question]
    ) -> SceneRecording:
        """Record a motion; the arguments are those of :meth:`play`, and no time passes.

        Parameters
        ----------
        poses, times, pressures, **query
            As for :meth:`play`: k poses {O_B} to {O_A} at rising times, s, pressures (k, n), gauge, Pa.

        Returns
        -------
        SceneRecording
            Its ``save`` writes one file that plays without a network.

        Examples
        --------
        >>> from exo_pin.view import Scene
        >>> exo = ep.load("four-linear-actuators")
        >>> path = exo.pose(flexion=[0, 45, 90])
        >>> film = Scene(exo, human=False).record(path, [0.0, 1.0, 2.0], load=ep.Load([0.0, 0.0, -10.0]))
        >>> film.reaction.magnitude.round(1)  # N, with 10 N in the hand
        array([51.9, 41.7, 53.1])
        """
        stamps, answer, draw = self._motion(poses, times, pressures, query)
        return record_frames(self._stage, stamps, draw, answer)

    def _motion(
        self, poses: Rotation, times: ArrayLike, pressures: ArrayLike | None, query: Question
    ) -> tuple[FloatArray, Reaction | None, Callable[[int], None]]:
        """Times, forces, and what draws a frame; scale and legend are those of the motion from here on."""
        poses = as_rotation("poses", poses)
        stamps = as_times(times, "pose", poses.shape)
        air = None if pressures is None else self._pressures(pressures, stamps.shape)
        answer, frames = self._frames(poses, air, query)
        self._plan(frames)

        def draw(index: int) -> None:
            self._draw(frames[index])

        return stamps, answer, draw

    def _frames(
        self, poses: Rotation, pressures: FloatArray | None, query: Question
    ) -> tuple[Reaction | None, list[Frame]]:
        """The answer for poses of shape () or (k,), and 1 or k frames."""
        answer = None if self._exo.device.arm is None else self._exo.reaction(poses, **query)
        each = [poses] if poses.single else [poses[k] for k in range(len(poses))]
        places = zip(each, self._drawn.configurations(poses), self._offsets(poses, query), strict=True)
        air = [None] * len(each) if pressures is None else list(np.atleast_2d(pressures))
        frames = []
        for placed, forces, own in zip(
            (Placed(*place) for place in places), self._forces(poses, answer, query), air, strict=True
        ):
            arrows = [] if forces is None else self._drawn.forces(placed, forces)
            frames.append(Frame(placed, forces, arrows, own))
        return answer, frames

    def _offsets(self, poses: Rotation, query: Question) -> Sequence[Offset | None]:
        """Where the device's centre is in each pose, None if it is the shoulder's."""
        given = query.get("centre_offset")
        if given is None:
            return [None] * (1 if poses.single else len(poses))
        return offsets(given, poses, query.get("split", "spherical"))

    def _pressures(self, pressures: ArrayLike, shape: tuple[int, ...]) -> FloatArray:
        if self._exo.wrist is None:
            raise InvalidInput("pressures are those of a wrist's muscles, and this device has no such limbs")
        values = as_finite("pressures", pressures, (self._exo.wrist.geometry.limb_count,), stack=True)
        if values.shape[:-1] != shape:
            raise InvalidInput(f"expected pressures of shape {(*shape, values.shape[-1])}, got {values.shape}")
        return values

    @abstractmethod
    def _forces(self, poses: Rotation, answer: Reaction | None, query: Question) -> list[ShownForces | None]:
        """Forces of poses of shape () or (k,), a list of 1 or k."""

    @abstractmethod
    def _plan(self, frames: Sequence[Frame]) -> None:
        """Choose scale and legend for the poses to come."""

    @abstractmethod
    def _draw(self, frame: Frame) -> None:
        """Draw a pose."""
