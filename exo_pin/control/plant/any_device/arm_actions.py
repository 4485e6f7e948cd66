"""What acts on the arm besides device and weight: a wearer's moments, payloads, and a torso that moves.

A torso moves the base frame {O_A} with shoulder and device, as the world sees it. Written in the moving frame, every
body of spatial inertia I and twist v needs besides what it needs at rest

    f = I (a_t + v_t × v) + v_t ×* I v + v ×* I v_t + v_t ×* I v_t

with v_t and a_t the torso's twist and spatial acceleration: for a point m (a_O - g + Ω' × r + Ω × (Ω × r) + 2 Ω × ṙ).
The part of gravity that turns with the torso is in a_t.

Source: Featherstone, Rigid Body Dynamics Algorithms (2008), Section 2.13 to 2.15.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pinocchio as pin

from ....chain.structure.chain_state import ChainState
from ....core.errors import InvalidInput, MissingData, SolverFailed
from ....core.errors.base import echo
from ....core.errors.checked import checked
from ....core.validation import FloatArray, as_finite, as_positive, as_real, require_type, set_fields, set_positive
from ....load_case import Load

if TYPE_CHECKING:
    from ..plant import Plant

#: Two times nearer than this, s, are one.
_SAME = 1e-9


def require_known(source: object, values: Mapping[str, Any], query: str) -> None:
    """Raise MissingData for values that nobody gave, or gave without a source."""
    missing = [name for name, value in values.items() if value is None]
    missing += [] if isinstance(source, str) and source.strip() else ["source"]
    if missing:
        raise MissingData(missing, query)


def check_span(record: Any) -> None:
    """Check that a record starts at a time of zero or more, s, and ends later, or never."""
    as_positive("start", record.start, zero=True)
    end = as_real("end", record.end)
    if end.shape != () or not end > record.start:
        raise InvalidInput(f"expected end after start, got {record.end!r} and {record.start!r}")


def load_at_shoulder(load: Load, R: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Force of a load on the arm and its moment about O, base frame, at an orientation of the arm, shape (3, 3)."""
    force, moment = (np.asarray(part, dtype=float) for part in (load.force, load.moment))
    if load.frame == "arm":
        force, moment = R @ force, R @ moment
    return force, moment + np.cross(R @ np.asarray(load.at), force)


class ArmState(NamedTuple):
    """Where the arm is and how it turns, as the wearer's moments are asked.

    Attributes
    ----------
    matrix : ndarray
        Shape (3, 3), {O_B} to {O_A}.
    angular_velocity : ndarray
        Shape (3,), rad/s, base frame.

    Examples
    --------
    >>> from exo_pin.control import ArmState
    >>> arm = ArmState(np.eye(3), np.array([0.0, 0.5, 0.0]))
    >>> -0.4 * arm.angular_velocity + 0.0  # N m, of a damper
    array([ 0. , -0.2,  0. ])
    """

    matrix: FloatArray
    angular_velocity: FloatArray


@checked
@dataclass(frozen=True)
class Payload:
    """A point mass that is part of the arm from a time to another.

    Parameters
    ----------
    mass : float
        kg.
    at : array_like
        Where the arm holds it, shape (3,), m, arm frame.
    start, end : float
        When it is caught, at rest, and dropped, s. With a start of zero it is there from the beginning.

    Raises
    ------
    InvalidInput
        If a number is out of its range.

    Examples
    --------
    >>> from exo_pin.control import Payload
    >>> exo, cup = ep.load("four-cables"), Payload(0.5, (0.0, 0.0, -0.5), end=0.05)
    >>> plant = ep.Plant(exo, payloads=cup)
    >>> run = plant.simulate(lambda t, seen: np.full(4, 0.1), 0.1, plant.held(exo.pose(30), np.full(4, 40.0)))
    >>> bool(np.abs(run.energy_residual).max() < 1e-7)  # J: what is dropped takes its energy with it
    True
    """

    mass: float
    at: tuple[float, float, float]
    start: float = 0.0
    end: float = np.inf

    def __post_init__(self) -> None:
        set_positive(self, "mass")
        set_fields(self, at=tuple(as_finite("at", self.at, (3,)).tolist()))
        check_span(self)

    def is_held(self, time: Any, before: bool = False) -> Any:
        """Whether the arm holds it just after times in s, or just before them; at zero it is there before, too.

        Parameters
        ----------
        time : array_like
            Shape (...), s.
        before : bool
            Whether before.

        Returns
        -------
        bool or ndarray of bool
            Shape (...).

        Raises
        ------
        InvalidInput
            For times that are no numbers.

        Examples
        --------
        >>> from exo_pin.control import Payload
        >>> cup = Payload(0.5, (0.0, 0.0, -0.5), start=0.2, end=1.0)
        >>> [cup.is_held(time) for time in (0.0, 0.2, 1.0)], [cup.is_held(time, True) for time in (0.0, 0.2, 1.0)]
        ([False, True, False], [False, False, True])
        """
        at = as_real("time", time)
        begun = (self.start <= 0.0) | (self.start < at - _SAME) if before else self.start <= at + _SAME
        held = begun & ((at - _SAME if before else at + _SAME) < self.end)
        return held if at.ndim else bool(held)


#: Moment of the wearer on the arm about O, N m, base frame; or a force at O, N, and that moment.
Wearer = Callable[..., Any]


_NONE = np.zeros(3)


def acting(found: Any) -> tuple[FloatArray, FloatArray]:
    """Force at O and moment about it of what a wearer returned: a pair of these, or the moment alone."""
    pair = found if isinstance(found, tuple) and len(found) == 2 else (_NONE, found)
    try:
        force, moment = (np.asarray(part, dtype=np.float64) for part in pair)
    except (TypeError, ValueError):
        force, moment = _NONE, np.zeros(0)
    if force.shape != (3,) or moment.shape != (3,):
        raise InvalidInput(
            "expected a wearer to return a moment on the arm, three numbers in N m, or a force in N and a moment, got "
            f"{echo(found)}"
        )
    return force, moment


class TorsoState(NamedTuple):
    """How the torso moves at an instant, all of shape (3,), in the axes of {O_A}.

    Attributes
    ----------
    acceleration : ndarray
        Of O, less the change of gravity from a torso that stands upright, m/s².
    angular_velocity, angular_acceleration : ndarray
        Ω and Ω', rad/s and rad/s².
    """

    acceleration: FloatArray
    angular_velocity: FloatArray
    angular_acceleration: FloatArray


@checked
@dataclass(frozen=True, eq=False)
class Torso:
    """How the torso turns and accelerates, with the shoulder and the device on it.

    Parameters
    ----------
    turn : callable, optional
        From time in s to ``orientation`` of {O_A} in the world, ``angular_velocity`` and ``angular_acceleration``
        in the world's axes, such as a trajectory of :mod:`exo_pin.control`. The world is {O_A} of a torso that stands
        upright.
    acceleration : callable, optional
        From time in s to that of O in the world's axes, m/s².

    Raises
    ------
    InvalidInput
        If an argument is not usable.

    Examples
    --------
    >>> from exo_pin import control
    >>> dropped = control.Torso(acceleration=lambda t: np.array([0.0, 0.0, -9.81]))
    >>> exo = ep.load("urdf/prototype-shoulder.urdf")
    >>> plant = ep.Plant(exo, torso=dropped)
    >>> run = plant.simulate(lambda t, seen: [], 0.1, plant.state(exo.pose(flexion=40)))
    >>> bool(abs(run.angular_velocity).max() < 1e-9)  # rad/s: an arm that falls with its torso does not swing
    True
    """

    turn: Callable[[float], Any] | None = None
    acceleration: Callable[[float], Any] | None = None

    def __post_init__(self) -> None:
        require_type("turn", self.turn, Callable | None, "a function of time")
        require_type("acceleration", self.acceleration, Callable | None, "a function of time")

    def at(self, t: float, gravity: FloatArray) -> TorsoState:
        """The state at a time.

        Parameters
        ----------
        t : float
            s.
        gravity : ndarray
            Shape (3,), m/s², on a torso that stands upright.

        Returns
        -------
        TorsoState

        Raises
        ------
        SolverFailed
            If a number is not finite.

        Examples
        --------
        >>> from exo_pin import control
        >>> leaning = control.Torso(turn=control.AnglePath([0.0, 1.0], [[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]], "left"))
        >>> leaning.at(1.0, np.array([0.0, 0.0, -9.81])).acceleration.round(2)  # m/s²: as if O were pushed there
        array([ 4.7,  0. , -1.2])
        """
        given: Any = self.acceleration
        a: Any = _NONE if given is None else np.asarray(given(t), dtype=np.float64)
        w, e = _NONE, _NONE
        if self.turn is not None:
            now = self.turn(t)
            back = now.orientation.as_matrix().T
            a = back @ (a - gravity) + gravity
            w, e = back @ np.asarray(now.angular_velocity), back @ np.asarray(now.angular_acceleration)
        if not all(part.shape == (3,) and np.isfinite(part).all() for part in (a, w, e)):
            raise SolverFailed("the motion", np.inf, "the torso's motion is not three finite numbers each")
        return TorsoState(a, w, e)


def carried_along(
    state: ChainState, centre: FloatArray, bodies: FloatArray, owners: Any, own: TorsoState
) -> FloatArray:
    """Generalised forces of a torso that moves, shape (nv,), where the Jacobians' rates were computed last.

    Parameters
    ----------
    state : ChainState
    centre : ndarray
        O in the chain's world, shape (3,), m.
    bodies : ndarray
        Which joint carries which, of :func:`.carried_joints`.
    owners : ndarray of int
        The joint of each coordinate in v.
    own : TorsoState
    """
    model, data = state.model, state.buffers.data
    at_origin = pin.SE3(np.eye(3), centre)
    vt = at_origin.act(pin.Motion(_NONE, own.angular_velocity))
    at = at_origin.act(pin.Motion(own.acceleration, own.angular_acceleration))
    forces = np.zeros((model.njoints, 6))
    for k in range(1, model.njoints):
        v, body = data.oMi[k].act(data.v[k]), data.oMi[k].act(model.inertias[k])
        forces[k] = (body * (at + vt.cross(v)) + vt.cross(body * (v + vt)) + v.cross(body * vt)).vector
    return -np.asarray(np.einsum("ci,ci->c", state.buffers.J, (bodies @ forces)[owners]))


class ArmBody(NamedTuple):
    """Mass, kg, centre of mass, (3,), m, and inertia about O, (3, 3), kg m², of what turns with the arm, arm frame."""

    mass: float
    centre: FloatArray
    inertia: FloatArray


def arm_loads(
    plant: Plant, body: ArmBody, times: FloatArray, R: FloatArray, w: FloatArray, e: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Force at O and moment about it of the given force, payloads with inertia, and the torso, shape (N, 3) each.

    Parameters
    ----------
    plant : Plant
    body : ArmBody
        What the torso takes along: the moving part, or the person's arm alone.
    times : ndarray
        Shape (N,), s.
    R, w, e : ndarray
        Rotation matrices of the arm, shape (N, 3, 3), ω and η, shape (N, 3), rad/s and rad/s², base frame.
    """
    tables, torso = plant.tables, plant.torso
    force = np.tile(tables.force, (len(times), 1))
    moment = np.cross(R @ tables.point, force)
    bodies: list[tuple[Any, float, FloatArray, FloatArray]] = [(True, *body)]
    for own in plant.payloads:
        at, held = np.array(own.at), own.is_held(times, before=True)[:, None]
        arm = R @ at
        push = np.where(held, own.mass * (tables.gravity - np.cross(e, arm) - np.cross(w, np.cross(w, arm))), 0.0)
        force, moment = force + push, moment + np.cross(arm, push)
        bodies.append((held, own.mass, at, own.mass * (at @ at * np.eye(3) - np.outer(at, at))))
    if torso is not None:
        a, W, E = (np.array(part) for part in zip(*(torso.at(float(t), tables.gravity) for t in times), strict=True))
        for held, mass, centre, inertia in bodies:
            C, about = R @ centre, R @ inertia @ R.transpose(0, 2, 1)
            swing = np.cross(E, C) + np.cross(W, np.cross(W, C)) + 2.0 * np.cross(W, np.cross(w, C))
            spin = _turned(about, E + np.cross(W, w)) + np.cross(W, _turned(about, W + w))
            spin = spin + np.cross(w, _turned(about, W)) + mass * np.cross(C, a)
            force, moment = force - np.where(held, mass * (a + swing), 0.0), moment - np.where(held, spin, 0.0)
    return force, moment


def _turned(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("kij,kj->ki", matrices, vectors))
