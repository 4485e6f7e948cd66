"""Planar four-bar and five-bar by hand: geometry, rates, Newton-Euler of every link. It shares nothing with exo_pin.

Angles are absolute, links are straight rods along e(θ) = (cos θ, sin θ). Loop equations and their two derivatives are
solved as 2x2 systems; the forces are one linear system of three equations a link.
"""

from typing import NamedTuple

import numpy as np


def e(angle):
    return np.array([np.cos(angle), np.sin(angle)])


def n(angle):
    return np.array([-np.sin(angle), np.cos(angle)])


def cross(a, b):
    return a[0] * b[1] - a[1] * b[0]


class Turning(NamedTuple):
    """A link's absolute angle with its rate and acceleration."""

    angle: float
    rate: float
    acceleration: float

    def arm(self, length):
        """Second derivative of length e(θ)."""
        return length * (self.acceleration * n(self.angle) - self.rate**2 * e(self.angle))


def dyad(start, end, lengths, branch):
    """Angles of two links from ``start`` over a knee to ``end``: the law of cosines."""
    first, second = lengths
    across = end - start
    distance = np.hypot(*across)
    cosine = (first**2 + distance**2 - second**2) / (2 * first * distance)
    if abs(cosine) >= 1.0:
        return None
    angle = np.arctan2(across[1], across[0]) + branch * np.arccos(cosine)
    rest = end - start - first * e(angle)
    return angle, np.arctan2(rest[1], rest[0])


def rates(angles, lengths, right, right_rate):
    """Rates of two links of which first e(θ1) + second e(θ2) moves at ``right`` and accelerates at ``right_rate``."""
    matrix = np.column_stack([lengths[0] * n(angles[0]), lengths[1] * n(angles[1])])
    speeds = np.linalg.solve(matrix, right)
    bent = right_rate + lengths[0] * speeds[0] ** 2 * e(angles[0]) + lengths[1] * speeds[1] ** 2 * e(angles[1])
    accelerations = np.linalg.solve(matrix, bent)
    return [Turning(*item) for item in zip(angles, speeds, accelerations, strict=True)]


class Link(NamedTuple):
    """A rigid body in the plane: centre of mass, its acceleration, angular acceleration, mass, moment of inertia."""

    centre: np.ndarray
    acceleration: np.ndarray
    turning: float
    mass: float
    inertia: float


def rod_link(start, start_acceleration, turning, length, direction=1.0):
    """A 1 kg rod from ``start`` along ``direction`` e(θ); its moment of inertia as tests/mechanisms.py states it."""
    half = direction * length / 2
    return Link(
        start + half * e(turning.angle),
        start_acceleration + turning.arm(half),
        turning.acceleration,
        1.0,
        length**2 / 12 + 1e-7,
    )


def newton_euler(links, pins, motors, loads, gravity, welds=()):
    """Forces of the pins, torques of the motors, and what the welds transmit.

    Parameters
    ----------
    links : sequence of Link
    pins : mapping
        Name to (link that receives, link that gives, point); -1 is the ground.
    motors : mapping
        Name to (link that receives, link that gives).
    loads : sequence
        (link, point, force, moment).
    gravity : (2,)
    welds : mapping
        As ``pins``; they transmit a moment too.

    Returns
    -------
    dict
        Name to force (2,), torque, or (force, moment) of a weld.
    """
    welds = dict(welds)
    columns = 2 * len(pins) + len(motors) + 3 * len(welds)
    matrix, right = np.zeros((3 * len(links), columns)), np.zeros(3 * len(links))
    for k, link in enumerate(links):
        right[3 * k : 3 * k + 2] = link.mass * (link.acceleration - gravity)
        right[3 * k + 2] = link.inertia * link.turning
    for link, point, force, moment in loads:
        right[3 * link : 3 * link + 2] -= force
        right[3 * link + 2] -= moment + cross(point - links[link].centre, force)
    places, column = {}, 0
    for name, (to, by, point) in [*pins.items(), *welds.items()]:
        places[name] = column
        for link, sign in ((to, 1.0), (by, -1.0)):
            if link >= 0:
                lever = point - links[link].centre
                matrix[3 * link : 3 * link + 2, column : column + 2] += sign * np.eye(2)
                matrix[3 * link + 2, column : column + 2] += sign * np.array([-lever[1], lever[0]])
                if name in welds:
                    matrix[3 * link + 2, column + 2] += sign
        column += 3 if name in welds else 2
    for name, (to, by) in motors.items():
        places[name] = column
        for link, sign in ((to, 1.0), (by, -1.0)):
            if link >= 0:
                matrix[3 * link + 2, column] += sign
        column += 1
    assert matrix.shape == (column, column)
    found = np.linalg.solve(matrix, right)
    out = {name: found[places[name] : places[name] + 2] for name in pins}
    out |= {name: (found[places[name] : places[name] + 2], found[places[name] + 2]) for name in welds}
    return out | {name: found[places[name]] for name in motors}
