"""A device of any kind on its wearer, seen from in front and outside: one picture a posture, on one scale."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from ...core.errors import InvalidInput
from ...core.errors.checked import checked
from ...core.validation import FloatArray, as_rotation, require_method
from ...design.holding_frame import holding_bars
from ...device.clearance import link_capsules
from ...device.parts.routes import PlacedRoute
from ...wrist.clearance.gaps import own_body
from ..colours import BLACK, BLUE, SPRING
from .plot_style import capsule_outline, pyplot

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ...exo.shoulder_exo import ShoulderExo

_TORSO, _ARM, _FRAME, _LINK = "#DDE1E7", "#E3B698", "#8C96A3", "#33445A"
#: From where a left shoulder is seen, base frame.
_FROM = np.array([1.0, 0.75, 0.35])
#: Least length of a line that is drawn, and the bar of the scale, mm.
_LEAST, _BAR = 4.0, 200.0
#: Least distance of two numbers, mm.
_APART = 60.0
#: Width of all postures together, inches.
_WIDTH = 7.2


@checked
def posture_drawing(exo: ShoulderExo, poses: Rotation, titles: Sequence[str]) -> Figure:
    """Draw a device of any kind on its wearer, seen obliquely from in front and outside, a panel for each posture.

    Parameters
    ----------
    exo : ShoulderExo
        The device, with an arm. Body and arm are the capsules of clearances; without a wearer the device stands alone.
    poses : Rotation
        Shape (k,).
    titles : sequence of str
        Of the panels, k.

    Returns
    -------
    matplotlib.figure.Figure
        Drives have the numbers of their order, from 1, where they act. Links are lines between their joints, as thick
        as their shapes where these are known. A device that does not reach a posture is not drawn in it, and the panel
        says so.

    Examples
    --------
    >>> from exo_pin.view.plots import posture_drawing
    >>> exo = ep.load("urdf/serial-y-x-z.urdf").worn_by(ep.Wearer(1.75, 75, "male"))
    >>> figure = posture_drawing(exo, exo.pose(flexion=[0, 60]), ["hanging", "raised"])
    >>> [ax.get_title() for ax in figure.axes]
    ['hanging', 'raised']
    """
    require_method("exo", exo, "reaction", "a ShoulderExo")
    stack, named = as_rotation("poses", poses), tuple(titles)
    if stack.as_quat().ndim != 2 or len(named) != len(stack):
        raise InvalidInput(f"expected as many titles as poses of a flat stack, got {len(named)} of {stack.shape}")
    out = _FROM / np.linalg.norm(_FROM) * (1.0 if exo.side == "left" else np.array([1.0, -1.0, 1.0]))
    right = np.array([-out[1], out[0], 0.0]) / np.hypot(out[0], out[1])
    seen = np.stack([right, np.cross(out, right), out])
    body = own_body(exo.device.arm, exo.side)
    panels, ends = [], []
    for matrix, pose in zip(stack.as_matrix(), stack, strict=True):
        capsules = _body(body, matrix, seen)
        lines, numbers = _device(exo, pose, matrix, seen)
        panels.append((capsules, lines, numbers))
        ends += [
            rows[:, k : k + 2] + sign * rows[:, 6:] for rows, _ in capsules for k in (0, 3) for sign in (-1.0, 1.0)
        ]
        ends += [points[:, :2] for points, *_ in lines]
    corners = np.concatenate(ends)
    low, high = corners.min(axis=0) - 20.0, corners.max(axis=0) + 20.0
    height = _WIDTH / len(stack) * (high[1] - low[1]) / (high[0] - low[0])
    figure, axes = pyplot().subplots(1, len(stack), figsize=(_WIDTH, height + 0.3), squeeze=False)
    figure.subplots_adjust(left=0.0, right=1.0, bottom=0.0, top=height / (height + 0.3), wspace=0.0)
    for ax, panel, title in zip(axes[0], panels, named, strict=True):
        _draw(ax, *panel)
        if not panel[1]:
            ax.text(0.0, low[1] + 0.3 * (high[1] - low[1]), "not reached", fontsize=9.0)
        ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
        ax.set_title(title, fontsize=9.0)
        ax.axis("off")
    ax.plot([high[0] - _BAR - 10.0, high[0] - 10.0], [low[1] + 15.0] * 2, color=BLACK, linewidth=1.5)
    ax.text(high[0] - 10.0 - _BAR / 2.0, low[1] + 25.0, f"{_BAR:.0f} mm", ha="center", fontsize=8.0)
    return figure


def _draw(ax: Any, capsules: list[Any], lines: list[Any], numbers: list[tuple[str, FloatArray]]) -> None:
    """One posture: what is farther away first."""
    for rows, colour in capsules:
        for row in rows:
            outline = capsule_outline(row[:2], row[3:5], row[6])
            ax.fill(*outline, facecolor=colour, edgecolor="0.5", linewidth=0.6, alpha=0.9, zorder=2.0 + _far(row))
    for points, width, colour in lines:
        depth = 2.0 + _far(points.mean(axis=0)) if len(points) > 1 else 2.0
        ax.plot(points[:, 0], points[:, 1], color=colour, linewidth=width, solid_capstyle="round", zorder=depth)
    ax.plot(0.0, 0.0, "+", color=BLACK, markersize=7, zorder=9)
    for number, at in numbers:
        ax.text(
            *at[:2], number, fontsize=7.5, ha="center", va="center", zorder=10,
            bbox={"boxstyle": "circle,pad=0.15", "facecolor": "white", "edgecolor": BLUE, "linewidth": 0.8},
        )  # fmt: skip


def _far(row: FloatArray) -> float:
    """Order of drawing, 0 to 1, by how near to the viewer the middle is, mm."""
    depth = row[2] if len(row) == 3 else 0.5 * (row[2] + row[5])
    return float(1.0 / (1.0 + np.exp(-depth / 150.0)))


def _body(body: Any, matrix: FloatArray, seen: FloatArray) -> list[tuple[FloatArray, str]]:
    """Capsules of torso and arm as seen, rows of two ends and a radius, mm."""
    found = []
    if body is not None:
        for rows, turn, colour in ((body.torso, np.eye(3), _TORSO), (body.arm, matrix, _ARM)):
            both = [1e3 * rows[:, k : k + 3] @ turn.T @ seen.T for k in (0, 3)]
            found.append((np.concatenate([*both, 1e3 * rows[:, 6:7]], axis=1), colour))
    return found


def _device(exo: ShoulderExo, pose: Rotation, matrix: FloatArray, seen: FloatArray) -> tuple[list[Any], list[Any]]:
    """Lines of the device as seen (points, width, colour), and the numbers of its drives with their places, mm."""
    device = exo.chain_device
    q, chain = exo.configurations(pose), device.chain
    if np.isnan(q).any():
        return [], []
    data = chain.model.createData()
    pin.forwardKinematics(chain.model, data, q)
    every = np.array([np.vstack([place.rotation.T, place.translation]) for place in data.oMi])
    every[:, 3] -= every[device.arm_index, 3]

    def view(points: FloatArray) -> FloatArray:
        return np.asarray(1e3 * points @ seen.T)

    lines, limbs, links = [], [], []
    if exo.wrist is None:
        links = [*_shapes(device, every), *_sticks(device, every)]
    else:
        harness, cuff = holding_bars(exo.geometry)
        lines = [(view(np.asarray(bar)), 2.5, _FRAME) for bar in (*harness, *(bar @ matrix.T for bar in cuff))]
        ends = exo.geometry.platform_points @ matrix.T
        limbs = [np.stack(pair) for pair in zip(exo.geometry.base_points, ends, strict=True)]
        links = [(points, 0.0) for points in limbs]
    for points, radius in links:
        if np.ptp(view(points), axis=0).max() > _LEAST:
            lines.append((view(points), _width(radius), _LINK))
    numbers = []
    groups: list[tuple[Any, str]] = [(device.efforts, BLACK), (device.springs, SPRING)]
    for parts, colour in groups:
        for k, part in enumerate(parts):
            if part.route is not None:
                points = PlacedRoute(chain._state, part.route).points(every)
                lines.append((view(points), 1.3, colour))
                at = points[:2].mean(axis=0)
            elif k < len(limbs):
                at = 0.75 * limbs[k][0] + 0.25 * limbs[k][1]
            elif part.joint is not None:
                at = _motor(device, chain.model.getJointId(part.joint), every)
            if parts is device.efforts and k < len(device.drives):
                numbers.append((str(k + 1), view(at[None])[0]))
    return lines, _apart(numbers)


def _motor(device: Any, joint: int, every: FloatArray) -> FloatArray:
    """Where the motor of a joint is drawn, base frame, m: the thickest of the shapes next to it, else the joint."""
    near = (joint, int(device.chain.model.parents[joint]))
    shapes = zip(link_capsules(device).ends, _shapes(device, every), strict=True)
    own = [(radius, points.mean(axis=0)) for row, (points, radius) in shapes if int(row[6]) in near]
    return max(own, key=lambda pair: pair[0])[1] if own else every[joint, 3]


def _width(radius: float) -> float:
    """Width of a line that stands for a link of a radius, points."""
    return float(np.clip(120.0 * radius, 1.6, 6.0))


def _shapes(device: Any, every: FloatArray) -> Iterator[tuple[FloatArray, float]]:
    """Axes of the shapes of moving links in the base frame, shape (2, 3), and radii, m."""
    capsules = link_capsules(device)
    for row, radius in zip(capsules.ends, capsules.radii.tolist(), strict=True):
        yield _placed(every[int(row[6])], row[:6].reshape(2, 3)), radius


def _sticks(device: Any, every: FloatArray) -> Iterator[tuple[FloatArray, float]]:
    """Each link as lines between the places where others join it, in the base frame, m."""
    model, arm = device.chain.model, device.arm_index
    joined: list[list[FloatArray]] = [[] for _ in range(model.njoints)]
    for joint in range(1, model.njoints):
        parent = int(model.parents[joint])
        ends = np.stack([_placed(every[parent], model.jointPlacements[joint].translation), every[joint, 3]])
        joined[parent].append(ends[0])
        joined[joint].append(ends[1])
        if joint != arm:
            yield ends, 0.0  # a slide: from where it begins to where it is
    loops = device.chain._state.topology
    for body, at in zip(loops.joints.ravel().tolist(), loops.local[:, :, 3].reshape(-1, 3), strict=True):
        joined[body].append(_placed(every[body], at))
    for body, places in enumerate(joined):
        if body in (0, arm):
            continue
        points = np.unique(np.round(places, 6), axis=0)
        middle = points.mean(axis=0)
        if len(points) == 2:
            yield points, 0.0
        elif len(points) > 2:
            for point in points:
                yield np.stack([middle, point]), 0.0


def _placed(frame: FloatArray, points: FloatArray) -> FloatArray:
    """Points of a joint's axes, shape (..., 3), in the base frame; the frame is its axes and origin, shape (4, 3)."""
    return np.asarray(points @ frame[:3] + frame[3])


def _apart(numbers: list[tuple[str, FloatArray]]) -> list[tuple[str, FloatArray]]:
    """The numbers, moved up where they would cover one before."""
    found: list[tuple[str, FloatArray]] = []
    for number, place in numbers:
        at = place.copy()
        while any(np.linalg.norm(at[:2] - other[:2]) < _APART for _, other in found):
            at[1] += _APART / 2.0
        found.append((number, at))
    return found
