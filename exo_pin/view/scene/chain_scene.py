"""The scene of any closed chain: links, joints and closures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...chain import ClosedChain
from ...core.errors import InvalidInput, LoopNotClosed
from ...core.validation import FloatArray, as_finite
from ..colours import BLUE, GREY, ORANGE, PURPLE
from ..picture.chain_picture import ChainPicture, closure_words
from ..stage.shapes import draw_ground
from ..stage.stage import Stage
from .page_output import Pages, viewpoint_of_points
from .scene_recording import SceneRecording, as_times, play_frames, record_frames

#: A gap of a loop larger than this is reported and drawn, m and rad.
_OPEN = 1e-6
#: More labels than this would hide the mechanism.
_MOST_LABELS = 9


class ChainScene(Pages):
    """A closed chain in a configuration, drawn by Meshcat.

    Links look as in their URDF; links that have no visuals are rods between the joints that they join. Closures are
    marked, and an open one has a line across its gap. A scene needs no browser and no server; :meth:`serve`,
    :meth:`save_html` and :meth:`save_png` show it. Base frame: the chain's world, z up.

    Parameters
    ----------
    chain : ClosedChain
        The chain.
    urdf : path-like or str, optional
        The URDF that it was read from, or its XML: a chain does not keep its visuals. Meshes are looked for beside it.
    q : array_like, optional
        Shape (nq,), the first configuration; left out, the closed one next to all joints at zero.
    labels : bool, optional
        Whether actuated joints and closures are named; if left out, where they are few.

    Raises
    ------
    InvalidInput
        If ``chain`` is none, or q does not fit it.

    Examples
    --------
    >>> from exo_pin.view import ChainScene
    >>> chain = ep.load("four-cables").chain
    >>> q = ChainScene(chain).move({"root_joint": ep.shoulder_rotation(20.0, 0.0, 0.0, degrees=True).as_quat()})
    >>> bool(np.abs(chain.residual(q)).max() < 1e-9)  # m: what is drawn is closed
    True
    """

    def __init__(
        self,
        chain: ClosedChain,
        urdf: str | PathLike[str] | None = None,
        q: ArrayLike | None = None,
        labels: bool | None = None,
    ) -> None:
        if not isinstance(chain, ClosedChain):
            raise InvalidInput(f"expected a ClosedChain, got {type(chain).__name__}")
        self._stage = Stage()
        self._chain = chain
        few = len(chain.roles.actuated) + len(chain.closures) <= _MOST_LABELS
        self._named = few if labels is None else bool(labels)
        start = self._start() if q is None else self._chain._state.configuration(q)
        with self._stage.update():
            self._stage.plain()
            self._picture = ChainPicture(self._stage, chain, urdf, start)
            self._q = start
            lowest, size = float(self._picture.corners(start)[:, 2].min()), self._picture.size
            draw_ground(self._stage, lowest - 0.03 * size, 1.3 * size)
            self.camera()
            self.show(start)

    @property
    def chain(self) -> ClosedChain:
        """The chain that is drawn."""
        return self._chain

    @property
    def q(self) -> FloatArray:
        """The configuration that is drawn, shape (nq,)."""
        return self._q.copy()

    @property
    def messages(self) -> tuple[str, ...]:
        """What could not be drawn, and why."""
        return tuple(self._picture.notes)

    def show(self, q: ArrayLike) -> None:
        """Draw a configuration as it is, closed or not; the page has the gap of its loops.

        Parameters
        ----------
        q : array_like
            Shape (nq,).

        Examples
        --------
        >>> from exo_pin.view import ChainScene
        >>> chain = ep.load("six-cables").chain
        >>> scene, pulled = ChainScene(chain), chain.neutral()
        >>> pulled[chain.configuration_slice("limb_1_slide")] += 0.05  # m
        >>> scene.show(pulled)
        >>> round(1e3 * float(np.linalg.norm(chain.residual(scene.q))), 6)  # mm of the gap that is drawn
        50.0
        """
        configuration = self._chain._state.configuration(q)
        self._freedoms = None
        with suppress(LoopNotClosed):
            self._freedoms = self._chain.mobility(configuration).degrees_of_freedom
        with self._stage.update():
            self._is_open = float(np.abs(self._chain.residual(configuration)).max(initial=0.0)) > _OPEN
            self._draw(configuration)
            self._write_legend()

    def move(self, joints: Mapping[str, ArrayLike]) -> FloatArray:
        """Set joints to the given values, and close the loops with the others.

        Parameters
        ----------
        joints : mapping of str to array_like
            Coordinates by joint, rad and m.

        Returns
        -------
        ndarray
            Shape (nq,), the closed configuration that is drawn.

        Raises
        ------
        UnknownName
            If there is no such joint.
        LoopNotClosed
            If the loops do not close with these joints held; the scene stays as it was.

        Examples
        --------
        >>> from exo_pin.view import ChainScene
        >>> exo = ep.load("three-linear-actuators")
        >>> scene, slides = ChainScene(exo.chain), exo.chain.roles.actuated
        >>> lifted, hanging = (scene.move({"root_joint": exo.pose(flexion=angle).as_quat()}) for angle in (30, 0))
        >>> travel = [(lifted - hanging)[exo.chain.configuration_slice(name)][0] for name in slides]
        >>> shortened = -np.diff(exo.inverse_kinematics(exo.pose(flexion=[0, 30])).lengths, axis=0)[0]
        >>> bool(np.allclose(np.abs(travel), np.abs(shortened)))  # m, of the three limbs
        True
        """
        q = self._q.copy()
        for joint, value in joints.items():
            part = self._chain.configuration_slice(joint)
            q[part] = as_finite(joint, np.atleast_1d(value), (part.stop - part.start,))
        closed = self._chain.close(q, hold=tuple(joints))
        self.show(closed)
        return closed

    def play(self, configurations: ArrayLike, times: ArrayLike) -> None:
        """Play a motion in the live page, in real time.

        Parameters
        ----------
        configurations : array_like
            Shape (k, nq), m and rad.
        times : array_like
            Shape (k,), s, rising.

        Examples
        --------
        >>> from exo_pin.view import ChainScene
        >>> exo = ep.load("three-linear-actuators")
        >>> scene = ChainScene(exo.chain)
        >>> path = [scene.move({"root_joint": exo.pose(flexion=angle).as_quat()}) for angle in (0, 10, 20)]
        >>> scene.play(path, [0.0, 0.01, 0.02])  # s
        >>> scene.q.tolist() == path[-1].tolist()
        True
        """
        play_frames(*self._motion(configurations, times))

    def record(self, configurations: ArrayLike, times: ArrayLike) -> SceneRecording:
        """Record a motion; the arguments are those of :meth:`play`, and no time passes.

        Parameters
        ----------
        configurations, times : array_like
            Shape (k, nq), m and rad, and (k,), s, rising.

        Returns
        -------
        SceneRecording
            Its ``save`` writes one file that plays without a network. It holds no forces.

        Examples
        --------
        >>> from exo_pin.view import ChainScene
        >>> chain = ep.load("three-linear-actuators").chain
        >>> q = chain.close(chain.neutral())
        >>> film = ChainScene(chain).record([q, q, q], [0.0, 0.5, 1.0])
        >>> film.times, film.reaction
        (array([0. , 0.5, 1. ]), None)
        """
        return record_frames(self._stage, *self._motion(configurations, times), None)

    def _draw(self, q: FloatArray) -> None:
        with self._stage.update():
            self._q = np.array(q)
            self._picture.show(q)
            self._stage.set_panel("labels", self._labels(q) if self._named else [])
            self._stage.set_panel("numbers", self._numbers(q))

    def _labels(self, q: FloatArray) -> list[dict[str, Any]]:
        frames = self._chain.placements(q)
        labels = [
            {"text": name, "at": frames[name].translation.tolist(), "colour": BLUE}
            for name in self._chain.roles.actuated
            if name in frames
        ]
        for closure, (a, _) in zip(self._picture.loops, self._picture.closure_frames(q), strict=True):
            labels.append({"text": closure_words(closure), "at": a.translation.tolist(), "colour": PURPLE})
        return labels

    def _numbers(self, q: FloatArray) -> dict[str, Any]:
        gap, beyond = float(np.abs(self._chain.residual(q)).max(initial=0.0)), self._chain.beyond_limits(q)
        notes = [
            *self._picture.notes,
            *([f"the loops have a gap of {gap:.2g} (m, rad)"] if gap > _OPEN else []),
            *([f"beyond their limits: {', '.join(beyond)}"] if beyond else []),
        ]
        return {
            "title": self._chain.description.name,
            "pose": ", ".join(self._coordinates(name, q) for name in self._chain.roles.actuated),
            "values": [] if self._freedoms is None else [{"name": "degrees of freedom", "value": f"{self._freedoms}"}],
            "notes": [{"text": note, "warn": True} for note in notes],
        }

    def _coordinates(self, joint: str, q: FloatArray) -> str:
        value = q[self._chain.configuration_slice(joint)]
        if len(value) != 1:
            return joint
        in_metres = bool(self._chain.metres[self._chain.velocity_slice(joint)].all())
        size = 1e3 * value[0] if in_metres else np.degrees(value[0])
        # Adding zero turns -0 into 0.
        return f"{joint} {round(float(size), 1) + 0.0:g}{' mm' if in_metres else '°'}".replace("-", "−")

    def _write_legend(self) -> None:
        closures, gaps = self._chain.closures, [closure.distance is not None for closure in self._chain.closures]
        drawn = {
            (BLUE, "actuated joint"): self._picture.balls & set(self._chain.roles.actuated),
            (GREY, "joint"): self._picture.balls - set(self._chain.roles.actuated),
            (PURPLE, "closes a loop"): closures,
            (ORANGE, "constant distance"): any(gaps),
            (ORANGE, "gap of an open loop"): self._is_open and not all(gaps),
        }
        items = [{"glyph": "line", "colour": colour, "text": text} for (colour, text), there in drawn.items() if there]
        self._stage.set_panel("legend", {"scale": "", "items": items, "bars": []})

    def _viewpoint(self, towards: FloatArray | None) -> tuple[FloatArray, FloatArray, list[float]]:
        return viewpoint_of_points(self._picture.corners(self._q), self._picture.size, towards)

    def _start(self) -> FloatArray:
        try:
            return self._chain.close(self._chain.reference_configuration())
        except LoopNotClosed as error:
            return np.asarray(error.q)

    def _motion(self, configurations: ArrayLike, times: ArrayLike) -> tuple[FloatArray, Callable[[int], None]]:
        """Times, and what draws a frame."""
        given = as_finite("configurations", configurations, (None, self._chain.model.nq))
        stamps = as_times(times, "configuration", given.shape[:1])
        path = [self._chain._state.configuration(q) for q in given]
        return stamps, lambda index: self._draw(path[index])
