"""An arm on a two-bar linkage in the plane of flexion, whose elbow has a closed form."""

import math

import numpy as np

import exo_pin as ep
from exo_pin.device import ChainDevice

JOINT = (
    '<joint name="{name}" type="continuous"><parent link="{parent}"/><child link="{child}"/>'
    '<origin xyz="{x!r} 0 {z!r}" rpy="0 {pitch!r} 0"/><axis xyz="0 1 0"/></joint>'
)


class TwoBar:
    """A bar from a point of the arm to an elbow, and one from there to the torso; all hinges along y.

    Parameters
    ----------
    point : float
        Distance of the arm's point below the shoulder, m.
    base : tuple of float
        x and z of the hinge on the torso, m.
    bars : tuple of float
        Lengths of the bars, from the arm on, m.
    side : int
        Sign of the elbow at rest.
    """

    def __init__(self, point, base, bars, side=1):
        self.point, self.base, self.bars, self.side = point, base, bars, side
        self.elbow_at_rest = float(self.elbow(0.0))
        first = self._first_bar(0.0)
        links = "".join(
            f'<link name="{name}"><inertial><mass value="{mass}"/><origin xyz="0 0 {z}"/>'
            '<inertia ixx="0.1" iyy="0.1" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>'
            for name, mass, z in (("arm", 4.0, -0.3), ("fore", 0.3, 0.1), ("upper", 0.4, 0.1))
        )
        # A bar lies along its own x axis; about y, x turns towards -z.
        cuff = JOINT.format(name="cuff", parent="arm", child="fore", x=0.0, z=-point, pitch=-first)
        elbow = JOINT.format(name="elbow", parent="fore", child="upper", x=bars[0], z=0.0, pitch=-self.elbow_at_rest)
        xml = f'<robot name="two-bar">{links}{cuff}{elbow}</robot>'
        ends = ep.chain.Placement((bars[1], 0.0, 0.0)), ep.chain.Placement((base[0], 0.0, base[1]))
        pin = ep.chain.Closure("base", "revolute", "upper", "universe", *ends, axis=(0.0, 1.0, 0.0))
        roles = ep.chain.Roles(arm="arm", shoulder="root_joint", actuated=("elbow",))
        closures = ep.chain.Closures("two-bar", ep.chain.Root("spherical"), (pin,), roles)
        self.chain = ep.ClosedChain.from_urdf(xml, closures)

    @property
    def device(self):
        """As a device."""
        return ChainDevice.from_chain(self.chain)

    def _point(self, turn):
        """Where the arm's point is, x and z, for a turn of the arm about y."""
        return -self.point * np.sin(turn), -self.point * np.cos(turn)

    def _cosine(self, turn):
        x, z = self._point(turn)
        square = (x - self.base[0]) ** 2 + (z - self.base[1]) ** 2
        return (square - self.bars[0] ** 2 - self.bars[1] ** 2) / (2.0 * self.bars[0] * self.bars[1])

    def _first_bar(self, turn):
        """Direction of the bar at the arm, from x towards z."""
        x, z = self._point(turn)
        elbow = float(self.elbow(turn))
        aim = math.atan2(self.base[1] - z, self.base[0] - x)
        return aim - math.atan2(self.bars[1] * math.sin(elbow), self.bars[0] + self.bars[1] * math.cos(elbow))

    def elbow(self, turn):
        """Angle of the second bar from the first, from x towards z, on the mode of rest; NaN where the loop is open."""
        with np.errstate(invalid="ignore"):
            return self.side * np.arccos(self._cosine(turn))

    def hinge(self, turn):
        """Coordinate of the joint ``elbow``: its angle from rest, about y."""
        return -(self.elbow(turn) - self.elbow_at_rest)

    def closes_on_the_way(self, turn, margin=0.0):
        """Whether the loop closes at every turn from 0 on, by a margin of the elbow's cosine."""
        way = np.abs(self._cosine(np.linspace(0.0, turn, 2001)))
        return bool(way.max() < 1.0 - margin)

    @classmethod
    def passing_straight(cls, least, rng):
        """A linkage that a turn brings within an angle of straight, and that opens again beyond.

        Returns
        -------
        TwoBar
        float
            The turn at which it is straightest.
        """
        point, height = rng.uniform(0.15, 0.3), rng.uniform(0.1, 0.3)
        turn = rng.choice([-1.0, 1.0]) * rng.uniform(0.6, 1.4)
        # Farthest where the point is opposite to the base, seen from the shoulder.
        base = height * math.sin(turn), height * math.cos(turn)
        share = rng.uniform(0.35, 0.65)
        # l1² + l2² + 2 l1 l2 cos(least) = (point + height)²
        whole = math.sqrt(share**2 + (1.0 - share) ** 2 + 2.0 * share * (1.0 - share) * math.cos(least))
        length = (point + height) / whole
        return cls(point, base, (share * length, (1.0 - share) * length), int(rng.choice([-1, 1]))), float(turn)
