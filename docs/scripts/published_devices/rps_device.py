"""3RPS with a passive ball: three cylinders tilt and move a platform, whose cuff holds the arm in a ball that slides.

Limb i turns about r_i on the torso, is as long as its drive says and ends in a ball on the platform, so that the ball
stays in the plane through A_i across r_i. These three planes, which all hold the direction n of the base, leave the
platform a translation along n and two tilts (Jeong and others 2001, reference [20] of the thesis, Section 2.2.2: one
translation and two rotations). Its centre drifts sideways when it tilts, so that a platform that is fixed to an arm
whose shoulder is at rest cannot move at all: three planes take what the ball joint leaves. So the arm lies in the
platform's cuff by a passive ball that slides along it: two forces across the arm are all that passes, and turning about
the arm is left to the wearer. One of the four freedoms is the cuff's place along the arm, which the drives set.

* **Dimensions**: none are published. Found, with the cuff at two thirds of the upper arm, for the directions of the arm
  in the thesis's box, by ``benchmarks/device_search.py``: small forces of the drives for those of the cuff and of the
  cuff for those of the drives, limbs that are clear of the body, and lengths within a ratio of about two; rounded to
  millimetres and degrees.
* **Assumed**: masses of bars, joints and cylinder halves; 400 N a drive, as the cables of ``six-cables`` have. Their
  travel is that of the box, also where the cuff slides along the arm, and a margin.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from exo_pin.core.errors import SolverFailed
from exo_pin.core.validation import FloatArray
from exo_pin.wrist_chain.assumed_masses import AssumedMasses

from .device_document import (
    CUFF_RADIUS,
    CUFF_SHARE,
    UPPER_ARM,
    DeviceDocument,
    DeviceFiles,
    JointDrive,
    framework,
    ring,
    rod_body,
)

#: Direction n of the base, degrees from x to y and up from there.
BASE_DIRECTION = (81.0, -39.0)
#: Circles of the joints about n through O, m: how far along n, and radius; of the platform seen from the cuff's ball.
BASE_HEIGHT, BASE_RADIUS = 0.143, 0.244
PLATFORM_HEIGHT, PLATFORM_RADIUS = -0.357, 0.210
#: Directions of the first joint on both, degrees; the others follow by 120°.
BASE_ANGLE, PLATFORM_ANGLE = 71.0, 49.0
#: Rings of the ball about the arm, m, and the axis of the largest one, the platform's, where that is along n: the mean
#: direction of the arm in the box, from which it is tilted least. They are clear of the arm at all tilts there.
_RINGS, _RING_AXIS = (CUFF_RADIUS, CUFF_RADIUS + 0.012, 0.110, 0.125), (0.28, 0.84, -0.46)
#: Least and greatest length of the limbs in the box, and a margin, m; greatest push and pull, N, as of the cables.
LENGTHS, _FORCE = (0.23, 0.60), 400.0
AT = CUFF_SHARE * UPPER_ARM


def base_axes() -> FloatArray:
    """Across n, across both, and n itself as rows, shape (3, 3)."""
    turn, rise = np.radians(BASE_DIRECTION)
    n = np.array([np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)])
    level = np.cross([0.0, 0.0, 1.0], n)
    level = level / np.linalg.norm(level)
    return np.stack([level, np.cross(n, level), n])


def joints() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Places A_i and axes r_i of the hinges, base frame, and balls seen from the cuff's with the platform along n.

    Shape (3, 3) each, one a row, m.
    """
    axes, thirds = base_axes(), np.radians([0.0, 120.0, 240.0])

    def circle(angle: float) -> FloatArray:
        turns = np.radians(angle) + thirds
        return np.outer(np.cos(turns), axes[0]) + np.outer(np.sin(turns), axes[1])

    rays = circle(BASE_ANGLE)
    A = BASE_HEIGHT * axes[2] + BASE_RADIUS * rays
    b = PLATFORM_HEIGHT * axes[2] + PLATFORM_RADIUS * circle(PLATFORM_ANGLE)
    return A, np.cross(axes[2], rays), b


def platform_turn(direction: FloatArray, at: float = AT, steps: int = 12) -> FloatArray:
    """Rotation of the platform from n for a direction of the arm, shape (3, 3), with its cuff ``at`` along the arm, m.

    The planes of the limbs hold the balls, r_i · (at d + Q b_i) = 0: Newton's steps, from the arm along n onwards.

    Raises
    ------
    SolverFailed
        If the platform does not reach there.
    """
    _, r, b = joints()
    n = base_axes()[2]
    way = Rotation.align_vectors([direction], [n])[0].as_rotvec()
    Q = np.eye(3)
    for share in np.arange(1, steps + 1) / steps:
        d = Rotation.from_rotvec(share * way).apply(n)
        Q = Rotation.from_rotvec(way / steps).as_matrix() @ Q
        for _ in range(30):
            turned = b @ Q.T
            gap = np.einsum("ij,ij->i", r, at * d + turned)
            if np.abs(gap).max() < 1e-16:
                break
            Q = Rotation.from_rotvec(-np.linalg.solve(np.cross(turned, r), gap)).as_matrix() @ Q
        if np.abs(gap).max() > 1e-12:
            raise SolverFailed("the platform's planes", float(np.abs(gap).max()), f"with the arm along {direction}")
    return Q


def rps_device() -> DeviceFiles:
    """The device's files."""
    A, r, b = joints()
    down = np.array([0.0, 0.0, -1.0])
    centre = AT * down
    balls = b @ platform_turn(down).T  # from the cuff's ball, with the arm hanging
    assumed = AssumedMasses()
    cross = assumed.cross_body(), framework("cross", joints=[np.zeros(3)])[1]
    sleeve = framework("platform", [ring(-AT + 0.04), ring(-AT - 0.04)])
    device = DeviceDocument("3rps-passive-ball", _NOTES, sleeve)
    x, y, z = np.eye(3)
    reach = JointDrive((-AT, UPPER_ARM - AT), 0.0)
    slider, about, across_arm = (framework("cross", [ring(0.0, radius)]) for radius in _RINGS[:3])
    device.hinge("cuff_slide", "cuff", "cuff_slider", slider, down, centre, reach, kind="prismatic")
    device.hinge("cuff_ball_z", "cuff_slider", "cuff_ring", about, z)
    device.hinge("cuff_ball_x", "cuff_ring", "cuff_cross", across_arm, x)
    turn = platform_turn(down)
    hold = ring(0.0, _RINGS[3], turn @ _RING_AXIS)
    # Out from the cuff, and past arm and shoulder to the balls.
    corners = [ball - PLATFORM_HEIGHT * turn @ base_axes()[2] for ball in balls]
    struts = [np.stack([hold[int(np.argmax(hold @ out))], out, end]) for out, end in zip(corners, balls, strict=True)]
    device.hinge("cuff_ball_y", "cuff_cross", "platform", framework("platform", [hold, *struts], list(balls)), y)
    for i in range(3):
        name, foot = f"limb_{i + 1}", A[i] - centre - balls[i]
        length = float(np.linalg.norm(foot))
        along = foot / length
        across = np.cross(along, r[i])
        upper = rod_body("platform_half", assumed.platform_half(length), along, 0.55 * length)
        lower = rod_body("base_half", assumed.base_half(length), -along, 0.75 * length)
        device.hinge(f"{name}_ball_1", "platform", f"{name}_cross", cross, r[i], balls[i])
        device.hinge(f"{name}_ball_2", f"{name}_cross", f"{name}_spin", cross, across)
        device.hinge(f"{name}_ball_3", f"{name}_spin", f"{name}_upper", upper, along)
        travel = JointDrive((LENGTHS[0] - length, LENGTHS[1] - length), _FORCE)
        device.hinge(f"{name}_slide", f"{name}_upper", f"{name}_lower", lower, along, foot, travel, kind="prismatic")
        device.hinge(f"{name}_hinge", f"{name}_lower", f"{name}_base", framework("base", joints=[np.zeros(3)]), r[i])
        device.hold(f"{name}_base", "rigid", f"{name}_base", A[i])
    return device.finish()


_NOTES = (
    "3RPS: three cylinders tilt a platform, whose cuff holds the arm in a passive ball that slides along it.",
    "Kind: Jeong and others 2001 (thesis reference 20), whose dimensions are not published.",
    "Dimensions: found, least force of a drive for a force of the cuff over the thesis's box (Appendix C).",
    "Masses of bars (13 mm aluminium tube), joints (50 g), cylinder halves and 400 N a drive are assumed.",
)
