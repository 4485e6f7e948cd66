"""A Gymnasium environment on the plant, for learned controllers (extra ``gym``).

    from exo_pin.control.gym_env import ShoulderEnv

    env = ShoulderEnv(ep.load("four-cables"), control.flexion(), duration=2.0)

An action is a command to each drive for one control period, and a step is that of :meth:`exo_pin.Plant.simulate`: a
rollout has the states of a run under a controller that sends the same commands, bit for bit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import InvalidInput
from ..core.errors.base import echo
from ..core.optional_packages import optional
from ..core.validation import FloatArray, as_positive
from .controllers.planning import planner_of
from .plant.any_device.arm_actions import Payload, Wearer
from .plant.options import PlantOptions
from .plant.plant import Plant
from .plant.run import Run
from .trajectories.reference import Reference

if TYPE_CHECKING:
    import gymnasium

    _Env = gymnasium.Env[FloatArray, FloatArray]
else:
    gymnasium = optional("gym", "gymnasium")
    _Env = gymnasium.Env

#: Error that costs as much as a joint force of one weight of the arm, rad.
_ERROR = np.deg2rad(5.0)
#: Bounds of what is observed: rates of arm and drives, rad/s and m/s, and coordinates of endless drives, rad or m.
_RATE, _FAR = 50.0, 10.0


class ShoulderEnv(_Env):
    """A device with its wearer that shall hold the arm at a reference, with little force in the joint.

    Observed, in SI, base frame: the turn from the arm to the reference (rotation vector, rad), ω of arm and reference
    (rad/s), coordinates of the drives and their rates (m or rad). All are cut to their bounds.

    The reward of a step is -(error/5°)² - |F_s|/W, error the angle to the reference and W the weight of the arm, at its
    end. An episode is cut off (truncated) after its duration, and ends (terminated) where the motion cannot go on.

    Parameters
    ----------
    exo : ShoulderExo, Mechanism or Device
        With an arm and drives; see :class:`exo_pin.Plant`.
    reference : Reference or callable
        Where the arm shall be; or a function of a NumPy generator that draws one at every reset.
    duration : float
        Of an episode, s.
    rate : float
        Steps a second, Hz.
    options, wearer, payloads : optional
        As for :class:`exo_pin.Plant`.

    Attributes
    ----------
    plant : Plant
    state : PlantState
        Of the plant now.
    run : Run or None
        Of the last step.

    Raises
    ------
    MissingExtra
        If Gymnasium is not installed.

    Examples
    --------
    >>> from exo_pin.control import flexion
    >>> from exo_pin.control.gym_env import ShoulderEnv
    >>> env = ShoulderEnv(ep.load("four-cables"), flexion(), duration=0.1)
    >>> seen, _ = env.reset(seed=0)
    >>> seen, reward, terminated, truncated, _ = env.step(np.full(4, 0.1))
    >>> seen.shape, reward < 0.0, terminated, truncated  # 3 + 3 + 3 + 4 + 4 numbers
    ((17,), True, False, False)
    """

    metadata = {"render_modes": []}  # noqa: RUF012 - Gymnasium reads it from the class

    def __init__(
        self,
        exo: Any,
        reference: Reference | Callable[[np.random.Generator], Reference],
        duration: float = 2.0,
        rate: float = 100.0,
        options: PlantOptions | None = None,
        wearer: Wearer | Sequence[Wearer] = (),
        payloads: Payload | Sequence[Payload] = (),
    ) -> None:
        self.plant = Plant(exo, options, wearer=wearer, payloads=payloads)
        self.duration, self.rate = as_positive("duration", duration), as_positive("rate", rate)
        if not callable(reference):
            raise InvalidInput(f"expected a Reference, or a function that draws one, got {echo(reference)}")
        self._given = reference
        self.state: Any = None
        self.run: Run | None = None
        self._plans = planner_of(self.plant)
        n = self.plant.count
        tables = self.plant.tables
        self._weight = float(tables.mass * np.linalg.norm(tables.gravity))
        ends = np.array([(drive.shortest, drive.longest) for drive in self.plant.drives]).reshape(-1, 2)
        # Stops are elastic.
        low, high = np.clip(ends[:, 0] - 0.1, -_FAR, _FAR), np.clip(ends[:, 1] + 0.1, -_FAR, _FAR)
        rates = np.full(n, _RATE)
        self._low = np.concatenate([np.full(3, -np.pi), np.full(6, -_RATE), low, -rates])
        self._high = np.concatenate([np.full(3, np.pi), np.full(6, _RATE), high, rates])
        self.observation_space = gymnasium.spaces.Box(self._low, self._high, dtype=np.float64)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (n,), dtype=np.float64)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Begin at the reference's first pose, at rest, with the drives where they hold the arm.

        Parameters
        ----------
        seed : int, optional
            Of the generator that draws references.
        options : dict, optional
            None are known.

        Returns
        -------
        tuple
            What is observed, and nothing more.

        Examples
        --------
        >>> from exo_pin.control import flexion
        >>> from exo_pin.control.gym_env import ShoulderEnv
        >>> seen, _ = ShoulderEnv(ep.load("four-cables"), flexion()).reset()
        >>> bool(np.abs(seen[:3]).max() < 1e-9)  # rad: at the reference
        True
        """
        super().reset(seed=seed)
        if options:
            raise InvalidInput(f"expected no options of reset, got {', '.join(map(echo, options))}")
        draws = not hasattr(self._given, "duration")
        given: Any = self._given
        self.reference: Any = given(self.np_random) if draws else given
        pose = self._plans.attained(self.reference)(0.0).orientation
        least, greatest = self.plant.force_limits(self._plans.lengths(pose))
        efforts = self._plans.tensions(pose, None, greatest, least, None).tensions
        self.state = self.plant.held(pose, efforts)
        return self._seen(self._plans.lengths(pose), np.zeros(self.plant.count)), {}

    def step(self, action: FloatArray) -> tuple[FloatArray, float, bool, bool, dict[str, Any]]:
        """One control period with held commands.

        Parameters
        ----------
        action : ndarray
            Shape (n,), -1 to 1.

        Returns
        -------
        tuple
            What is observed, reward, whether it ended, whether time is up, and ``error`` in rad and ``F_s`` in N. The
            :class:`.Run` of the period is :attr:`run`.

        Examples
        --------
        >>> from exo_pin.control import flexion
        >>> from exo_pin.control.gym_env import ShoulderEnv
        >>> env = ShoulderEnv(ep.load("four-cables"), flexion())
        >>> _ = env.reset(seed=1)
        >>> sorted(env.step(np.full(4, 0.1))[4]), env.run.status
        (['F_s', 'error'], 'completed')
        """
        if self.state is None:
            raise InvalidInput("expected reset() before the first step")
        run = self.run = self.plant.simulate(lambda t, seen: action, 1.0 / self.rate, self.state, self.rate)
        self.state = run.state(float(run.times[-1]))
        seen = self._seen(run.lengths[-1], run.length_rates[-1])
        force = float(np.linalg.norm(run.shoulder_force[-1]))
        error = float(np.linalg.norm(seen[:3]))
        reward = -((error / _ERROR) ** 2) - force / self._weight
        truncated = self.state.time >= self.duration - 0.5 / self.rate
        return seen, reward, run.status != "completed", bool(truncated), {"error": error, "F_s": force}

    def _seen(self, coordinates: FloatArray, rates: FloatArray) -> FloatArray:
        """What is observed of the present state."""
        wanted = self.reference(self.state.time)
        turn = (wanted.orientation * self.state.orientation.inv()).as_rotvec()
        whole = [turn, self.state.angular_velocity, wanted.angular_velocity, coordinates, rates]
        return np.clip(np.concatenate(whole), self._low, self._high)
