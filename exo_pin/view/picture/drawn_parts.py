"""What a closed chain draws besides its links: cables and springs along routes, springs in joints, efforts of drives.

It reads chain, drives, brakes and springs of a device and nothing that only one kind has. A drive or spring along a
route pulls where its route meets the arm. A slide's effort is drawn where the body beyond the slide is joined to the
next one on the way to the arm: at the end of a telescopic limb.
"""

from __future__ import annotations

import itertools
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from ...core.records import OneProcess
from ...core.validation import FloatArray
from ...device.parts.laws import covered_force
from ...device.parts.routes import PlacedRoute
from ..colours import BLACK, GREY, SPRING
from ..stage.force_arrows import DrawnForce
from ..stage.shapes import coil, flat_material, frustum, placement, segment
from ..stage.stage import Stage, mg

#: Radius of a cable along a route, of a spring's turns, of its wire, and distance of two turns, m; length of a coil in
#: a joint, m.
_CABLE, _COIL, _WIRE, _PITCH, _IN_JOINT = 0.003, 0.011, 0.0022, 0.014, 0.05


#: A shape whose middle is nearer to an axis than this lies on it; radius of the balls at the ends of routes, m.
_ON_AXIS, _BALL = 0.005, 0.007


class _SlideEnd(NamedTuple):
    """Where the effort of a slide enters the next body on the way to the arm: a joint's place or a loop's end."""

    joint: int
    local: FloatArray
    #: 1.0 where this body is beyond the slide, -1.0 where it is before it.
    sign: float


class DrawnParts(OneProcess):
    """Cables, springs and efforts of a device.

    Parameters
    ----------
    stage : Stage
        Where they are drawn.
    device : ChainDevice
        Any with ``chain``, ``efforts``, ``springs``, ``arm_index``, ``unit_of`` and ``moment_of_wearer``.
    root : str
        Node that they are drawn under.
    """

    def __init__(self, stage: Stage, device: Any, root: str) -> None:
        self._stage, self._device, self._root = stage, device, f"/meshcat/{root}"
        self._model, self._data = device.chain.model, device.chain.model.createData()
        state = device.chain._state
        self._routes = {
            f"{kind}_{i}": PlacedRoute(state, part.route)
            for kind, parts in (("drive", device.efforts), ("spring", device.springs))
            for i, part in enumerate(parts)
            if part.route is not None
        }
        self._made: set[str] = set()

    @property
    def legend(self) -> list[dict[str, str]]:
        """What cables and springs look like."""
        there = {
            (BLACK, "line", "cable"): any(name.startswith("drive") for name in self._routes),
            (SPRING, "coil", "spring"): bool(self._device.springs),
        }
        return [
            {"glyph": glyph, "colour": colour, "text": text}
            for (colour, glyph, text), is_there in there.items()
            if is_there
        ]

    def place(self, q: FloatArray) -> FloatArray:
        """Move to a configuration, shape (nq,); the ends of all routes, shape (k, 3), m."""
        self._jacobian = pin.computeJointJacobians(self._model, self._data, q).copy()
        self._q = q
        self._poses = np.array([np.vstack([place.rotation.T, place.translation]) for place in self._data.oMi])
        self._points = {name: route.points(self._poses) for name, route in self._routes.items()}
        return np.concatenate([np.zeros((0, 3)), *self._points.values()])

    def show(self, q: FloatArray) -> None:
        """Draw cables and springs at q, shape (nq,)."""
        self.place(q)
        for name, points in self._points.items():
            pieces = list(itertools.pairwise(points))
            longest = int(np.argmax([np.linalg.norm(end - start) for start, end in pieces]))
            is_spring = name.startswith("spring")
            for k, (start, end) in enumerate(pieces):
                self._piece(f"routes/{name}/{k}", start, end, is_spring, is_spring and k == longest)
            for end in (0, -1):
                self._ball(f"routes/{name}/end_{-end}", points[end])
        for i, spring in enumerate(self._device.springs):
            if spring.joint is not None:
                middle, axis, _ = self._joint(spring.joint)
                half = 0.5 * _IN_JOINT * axis
                self._piece(f"springs/{i}", middle - half, middle + half, True, True)

    def _piece(self, name: str, start: FloatArray, end: FloatArray, is_spring: bool, coiled: bool) -> None:
        path, length = f"{self._root}/{name}", float(np.linalg.norm(end - start))
        if path not in self._made:
            self._made.add(path)
            turns = max(round(length / _PITCH), 3)
            shape = coil(turns, max(length, _COIL), _COIL, _WIRE) if coiled else frustum(1.0, 1.0)
            material = flat_material(SPRING if is_spring else BLACK)
            self._stage.set_object(path, shape, material)
        radius = 1.0 if coiled else _WIRE if is_spring else _CABLE
        self._stage.set_transform(path, segment(start, end, radius))

    def _ball(self, name: str, at: FloatArray) -> None:
        path = f"{self._root}/{name}"
        if path not in self._made:
            self._made.add(path)
            self._stage.set_object(path, mg.Sphere(_BALL), flat_material(GREY))
        self._stage.set_transform(path, placement(1.0, at))

    def forces(self, q: FloatArray, efforts: FloatArray, without: tuple[str, ...] = ()) -> list[DrawnForce]:
        """Efforts of drives and brakes, forces of springs, and what the wearer adds, at q, shape (nq,).

        ``efforts`` are those of an answer, shape (p,); ``without`` are joints whose drives are drawn elsewhere.
        """
        self.place(q)
        device, found = self._device, []
        for i, (drive, (name, _)) in enumerate(zip(device.efforts, device.drive_units, strict=False)):
            effort = float(efforts[i])
            if drive.joint is None:
                found += self._along_route(f"drive_{i}", name, effort)
            elif drive.joint not in without:
                along = -effort if drive.pulls else effort
                found += self._in_joint(f"drive_{i}", name, drive.joint, along, "turn")
        for i, spring in enumerate(device.springs):
            if spring.joint is None:
                x = float(np.linalg.norm(np.diff(self._points[f"spring_{i}"], axis=0), axis=1).sum())
                found += self._along_route(f"spring_{i}", spring.name, float(covered_force(spring.law, x)))
            else:
                x = float(q[device.chain.configuration_slice(spring.joint)][0])
                force = -float(covered_force(spring.law, x))
                found += self._in_joint(f"spring_{i}", spring.name, spring.joint, force, "spring turns")
        moment = device.moment_of_wearer(np.asarray(efforts)[None])[0]
        return [*found, DrawnForce("wearer", "wearer", np.zeros(3), moment, "wearer")]

    def _along_route(self, key: str, name: str, tension: float) -> list[DrawnForce]:
        joints, points = self._routes[key].joints, self._points[key]
        on_arm = joints == self._device.arm_index
        meets = np.flatnonzero(on_arm[1:] != on_arm[:-1])
        k = int(meets[-1]) if meets.size else len(points) - 2
        at, other = (points[k], points[k + 1]) if on_arm[k] else (points[k + 1], points[k])
        away = (other - at) / max(float(np.linalg.norm(other - at)), 1e-9)
        return pulls_or_pushes(key, name, at, away, tension, ("part pulls", "part pushes"))

    def _in_joint(self, key: str, name: str, joint: str, effort: float, turning: str) -> list[DrawnForce]:
        middle, axis, slides = self._joint(joint)
        if not slides:
            middle = middle + self._along_axes[joint] * axis
            return [DrawnForce(f"{key}/turn", turning, middle, effort * axis, name)]
        joint_index, local, sign = self._slide_ends[joint]
        at = local @ self._poses[joint_index, :3] + self._poses[joint_index, 3]
        # Positive efforts make the slide longer: its far side is pushed along the axis, its near side against it.
        return pulls_or_pushes(key, name, at, -sign * axis, -effort, ("part pulls", "part pushes"))

    def _joint(self, name: str) -> tuple[FloatArray, FloatArray, bool]:
        """Place and axis of a joint of one coordinate, shape (3,), m, base frame, and whether it slides."""
        column = self._jacobian[:, self._device.chain.velocity_slice(name).start]
        slides = float(np.linalg.norm(column[3:])) < 1e-9
        axis = column[:3] if slides else column[3:]
        index = self._model.getJointId(name)
        return self._poses[index, 3].copy(), axis / np.linalg.norm(axis), slides

    @cached_property
    def _along_axes(self) -> dict[str, float]:
        """How far along its axis the motor of each hinge is, m: the widest shape on it, or beside what it turns."""
        model, chain, found = self._model, self._device.chain, {}
        data = model.createData()
        jacobian = pin.computeJointJacobians(model, data, chain.neutral())
        shapes = []
        for shape in chain.description.shapes:
            frame = model.frames[model.getFrameId(shape.frame)]
            if shape.frame != chain.roles.arm:
                centre = data.oMi[frame.parentJoint].act((frame.placement * shape.place).translation)
                shapes.append((frame.parentJoint, centre, shape.size[0] if shape.size else 0.0))
        for part in (*self._device.efforts, *self._device.springs):
            if part.joint is None:
                continue
            joint = int(model.getJointId(part.joint))
            axis, origin = jacobian[3:, chain.velocity_slice(part.joint).start], data.oMi[joint].translation
            own = [
                (body, centre - origin, size) for body, centre, size in shapes if body in (joint, model.parents[joint])
            ]
            on_axis = [(size, at @ axis) for _, at, size in own if np.linalg.norm(np.cross(at, axis)) < _ON_AXIS]
            turned = [at @ axis for body, at, _ in own if body == joint]
            found[part.joint] = float(max(on_axis)[1] if on_axis else np.mean(turned) if turned else 0.0)
        return found

    @cached_property
    def _slide_ends(self) -> dict[str, _SlideEnd]:
        model, device, loops = self._model, self._device, self._device.chain._state.topology
        joined: list[tuple[int, int, FloatArray, FloatArray]] = [
            (int(model.parents[j]), j, np.array(model.jointPlacements[j].translation), np.zeros(3))
            for j in range(1, model.njoints)
        ]
        joined += [(a, b, *at) for (a, b), at in zip(loops.joints.tolist(), loops.local[:, :, 3], strict=True)]
        return {
            part.joint: _end_of(model.getJointId(part.joint), joined, model.parents, device.arm_index)
            for part in (*device.efforts, *device.springs)
            if part.joint is not None
        }


def _end_of(slide: int, joined: list[tuple[int, int, FloatArray, FloatArray]], parents: Any, arm: int) -> _SlideEnd:
    """Where the nearer of a slide's two bodies is joined to the next one on the way to the arm."""
    before = int(parents[slide])
    links = [link for link in joined if {link[0], link[1]} != {slide, before} and 0 not in link[:2]]
    steps, reached = {arm: (slide, np.zeros(3))}, [arm]
    for body in reached:
        for a, b, at_a, at_b in links:
            for here, there, at in ((a, b, at_b), (b, a, at_a)):
                if here == body and there not in steps:
                    steps[there] = there, at
                    reached.append(there)
    # A slide that nothing joins to the arm has its own place.
    body = next((body for body in reached if body in (slide, before)), slide)
    return _SlideEnd(*steps.get(body, (slide, np.zeros(3))), 1.0 if body == slide else -1.0)


def pulls_or_pushes(
    key: str, name: str, at: FloatArray, away: FloatArray, tension: float, kinds: tuple[str, str] = ("pull", "push")
) -> list[DrawnForce]:
    """The arrows of a part that pulls along ``away`` or pushes up to ``at``, shape (3,) each; one of them is zero."""
    pull, push = np.maximum(tension, 0.0), np.maximum(-tension, 0.0)
    return [
        DrawnForce(f"{key}/pull", kinds[0], at, pull * away, f"{name} pulls"),
        DrawnForce(f"{key}/push", kinds[1], at, -push * away, f"{name} pushes", True),
    ]
