"""The scene of a device that is not a wrist: its links in a pose of the arm, with the forces on the arm."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.validation import FloatArray, as_single_rotation, require_method
from ...device.device_model import device_model
from ...device.parts.routes import PlacedRoute
from ...device.postures import placements
from ..colours import BLACK, GREEN, ORANGE, RED, SKY
from ..stage.force_arrows import GOOD_LENGTH, round_up
from ..stage.shapes import Arrow, flat_material, frustum, segment
from .chain_scene import ChainScene
from .pose_sliders import PoseSliders

if TYPE_CHECKING:
    from ...exo.shoulder_exo import ShoulderExo
    from ...reaction import Reaction

#: Radius of an arrow's shaft, m.
_SHAFT = 0.0075
#: Radius of a cable or spring along a route, m, and the colour of springs.
_ROUTE, _SPRING = 0.004, ORANGE
#: Axes and origin of the torso's frame, as those of the joints.
_TORSO = np.concatenate([np.eye(3), np.zeros((1, 3))])[None]


@checked
class DeviceScene(ChainScene):
    """A device on the arm, drawn by Meshcat, with the forces of :meth:`exo_pin.ShoulderExo.reaction`.

    Parameters
    ----------
    exo : ShoulderExo
        A device that is not a wrist, with an arm.
    labels : bool, optional
        As for :class:`.ChainScene`.

    Raises
    ------
    InvalidInput
        If ``exo`` is none, or has no arm.

    Examples
    --------
    >>> from exo_pin.view import DeviceScene
    >>> exo = ep.ShoulderExo.from_chain(ep.load("three-linear-actuators").chain_with_masses())
    >>> answer = DeviceScene(exo).show_pose(exo.pose(abduction=20))
    >>> round(float(answer.magnitude), 1)  # N
    10.5
    """

    def __init__(self, exo: ShoulderExo, labels: bool | None = None) -> None:
        require_method("exo", exo, "configurations", "a device that is not a wrist")
        self._exo: Any = exo
        self._answer: Reaction | None = None
        self._pose = exo.pose()
        super().__init__(exo.chain, exo.urdf, self._configuration(self._pose), labels)
        root = "/meshcat/forces"
        colours = {"shoulder": RED, "weight": GREEN, "cuff": SKY}
        self._arrows = {name: Arrow(self._stage, f"{root}/{name}", colour, _SHAFT) for name, colour in colours.items()}
        self._colours = colours
        model = device_model(exo.chain_device)
        #: Name, colour and route of what runs along one: cables black, springs orange.
        self._routes = [
            (f"{kind}_{i}", colour, place)
            for kind, colour, parts in (("drive", BLACK, model.drives), ("spring", _SPRING, model.springs))
            for i, (_, place) in enumerate(parts)
            if isinstance(place, PlacedRoute)
        ]
        self._drawn: set[str] = set()
        self._sliders = PoseSliders(self._stage, exo.side, lambda pose: self._move(pose, self._question))
        self.show_pose(self._pose)

    def show_pose(self, poses: Rotation, **question: Any) -> Reaction | None:
        """Draw a pose with its forces, and return the answer; None where the device has no arm with mass.

        Parameters
        ----------
        poses : Rotation
            Single.
        **question
            Of :meth:`exo_pin.ShoulderExo.reaction`.

        Returns
        -------
        Reaction or None

        Raises
        ------
        InvalidInput
            If the device does not reach the pose: the message has the nearest one.

        Examples
        --------
        >>> from exo_pin.view import DeviceScene
        >>> exo = ep.ShoulderExo.from_chain(ep.load("three-linear-actuators").chain_with_masses())
        >>> answer = DeviceScene(exo).show_pose(exo.pose(flexion=30))
        >>> bool(answer.magnitude == exo.reaction(exo.pose(flexion=30)).magnitude)  # N, as drawn
        True
        """
        with self._stage.update():
            self._move(as_single_rotation("poses", poses), question)
            self.camera()
        return self._answer

    def _move(self, pose: Rotation, question: dict[str, Any]) -> None:
        """Draw a pose, seen from where it is looked at."""
        q = self._configuration(pose)
        answer = None if self._exo.arm is None else self._exo.reaction(pose, **question)
        self._pose, self._answer, self._question = pose, answer, question
        self.show(q)
        self._sliders.follow(pose)

    def _configuration(self, pose: Rotation) -> FloatArray:
        q: FloatArray = self._exo.configurations(pose)
        if np.isnan(q).any():
            raise InvalidInput("expected a pose that the device reaches")
        return q

    def show(self, q: ArrayLike) -> None:
        """Draw a configuration as it is; the forces are those of the last pose where it is of that pose.

        Parameters
        ----------
        q : array_like
            Shape (nq,), of the chain.

        Examples
        --------
        >>> from exo_pin.view import DeviceScene
        >>> exo = ep.ShoulderExo.from_chain(ep.load("three-linear-actuators").chain_with_masses())
        >>> scene = DeviceScene(exo)
        >>> answer = scene.show_pose(exo.pose(flexion=30))
        >>> scene.show(exo.chain.close(exo.chain.neutral()))  # hanging again
        >>> round(float(np.rad2deg(2.0 * np.arccos(min(abs(scene.q[3]), 1.0)))), 6)  # degrees, of the arm
        0.0
        """
        super().show(q)
        if getattr(self, "_arrows", None) is None:
            return
        labels, forces = [], self._forces(np.asarray(q, dtype=float))
        with self._stage.update():
            largest = max((float(np.linalg.norm(force)) for _, force in forces.values()), default=1.0)
            scale = 0.1 / round_up(0.1 * max(largest, 1.0) / GOOD_LENGTH)
            for name, arrow in self._arrows.items():
                if name not in forces:
                    arrow.hide()
                    continue
                start, force = forces[name]
                arrow.show(start, scale * force)
                words = f"{name} {float(np.linalg.norm(force)):.0f} N"
                ends = [start.tolist(), (start + scale * force).tolist()]
                labels.append({"text": words, "at": ends[1], "arrow": ends, "colour": self._colours[name]})
            self._draw_routes(self._q)
            words = f"Forces on the arm: 10 cm = {0.1 / scale:g} N" if forces else ""
            self._stage.set_panel("legend", self._stage.panel("legend") | {"scale": words})
            self._stage.set_panel("labels", [*(self._labels(self._q) if self._named else []), *labels])
            self._stage.set_panel("numbers", self._numbers(self._q))

    def _draw_routes(self, q: FloatArray) -> None:
        """Cables and springs along routes as bars between their points, in the configuration."""
        model = device_model(self._exo.chain_device)
        poses = np.concatenate([_TORSO, placements(model.held, q)])
        for name, colour, route in self._routes:
            points = route.points(poses)
            for k, (start, end) in enumerate(itertools.pairwise(points)):
                path = f"/meshcat/routes/{name}/{k}"
                if path not in self._drawn:
                    shape = frustum(1.0, 1.0)
                    self._stage.viewer[path.removeprefix("/meshcat/")].set_object(shape, flat_material(colour))
                    self._drawn.add(path)
                self._stage.set_transform(path, segment(start, end, _ROUTE))

    def _forces(self, q: FloatArray) -> dict[str, tuple[FloatArray, FloatArray]]:
        """Points of attack and forces on the wearer's arm, m and N, base frame; what is fixed to it is the device's."""
        answer, arm = self._answer, self._exo.arm
        here = q[self._chain.configuration_slice(self._exo.chain_device.arm_joint)]
        if answer is None or not answer.has_answer or not np.allclose(np.abs(here @ self._pose.as_quat()), 1.0):
            return {}
        R = self._pose.as_matrix()
        cuff = self._chain.roles.cuff
        middle = np.zeros(3) if cuff is None else self._chain.placement(q, cuff).translation
        forces = {
            "shoulder": (np.zeros(3), np.array(answer.shoulder_force)),
            "cuff": (np.array(middle), np.array(answer.cuff_wrench[:3])),
        }
        if arm.person is not None:
            forces["weight"] = (R @ arm.person.centre_of_mass, arm.person.mass * self._exo.device.gravity)
        return forces

    def _numbers(self, q: FloatArray) -> dict[str, Any]:
        found = super()._numbers(q)
        answer = self._answer
        if answer is None:
            return found
        notes = [{"text": answer.verdict, "warn": not answer.held}]
        if not answer.has_answer:
            return found | {"headline": f"No solution: {str(answer.status).replace('_', ' ')}", "notes": notes}
        efforts = [
            {"name": name.replace("_", " "), "value": f"{round(float(value), 1) + 0.0:.1f} {unit}"}
            for (name, unit), value in zip(answer.drive_units, answer.actuator_forces, strict=True)
        ]
        shoulder = {"name": "force of the shoulder on the arm", "value": f"{float(answer.magnitude):.1f} N"}
        return found | {"values": [shoulder, *efforts], "notes": notes}
