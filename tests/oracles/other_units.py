"""Chains of hinges and slides written in other units of length and of mass; the second stays."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from mechanisms import placed
from scipy.spatial.transform import Rotation

from exo_pin.chain import ClosedChain
from exo_pin.chain.structure.motion_axes import in_metres


class Units(NamedTuple):
    """How many of the new units a metre and a kilogram are; powers of two leave every digit of a number."""

    metre: float
    kilogram: float

    @property
    def newton(self) -> float:
        return self.kilogram * self.metre

    def chain(self, chain: ClosedChain) -> ClosedChain:
        """The chain with its inertias, springs slack at zero, friction, damping, armatures and limits."""
        model = chain.model.copy()
        motion, force = self.motion(chain), self.force(chain)
        for joint in range(1, model.njoints):
            one = chain.model.inertias[joint]
            inertia = self.newton * self.metre * one.inertia
            model.inertias[joint] = pin.Inertia(self.kilogram * one.mass, self.metre * one.lever, inertia)
            model.jointPlacements[joint].translation *= self.metre
        for frame in model.frames:
            frame.placement.translation *= self.metre
        model.gravity.linear *= self.metre
        with np.errstate(over="ignore"):  # the largest number is no limit
            model.lowerPositionLimit = chain.model.lowerPositionLimit * motion
            model.upperPositionLimit = chain.model.upperPositionLimit * motion
        with np.errstate(over="ignore"):
            for name in ("effortLimit", "lowerDryFrictionLimit", "upperDryFrictionLimit"):
                setattr(model, name, getattr(chain.model, name) * force)
        for name in ("armature", "damping"):
            setattr(model, name, getattr(chain.model, name) * force / motion)
        closures = tuple(
            replace(
                closure,
                placement_a=self._place(closure.placement_a),
                placement_b=self._place(closure.placement_b),
                distance=closure.distance and closure.distance * self.metre,
            )
            for closure in chain.closures
        )
        per_motion = dict(zip(list(chain.model.names)[1:], force / motion, strict=True))
        springs = tuple(
            replace(spring, stiffness=per_motion[spring.joint] * spring.stiffness)
            for spring in chain.description.joints
        )
        return ClosedChain(model, replace(chain.description, closures=closures, joints=springs))

    def _place(self, placement):
        return placed(self.metre * np.array(placement.translation), Rotation.from_quat(placement.quaternion))

    def motion(self, chain: ClosedChain) -> np.ndarray:
        """What coordinates of q, v and a are multiplied by, shape (nv,)."""
        return np.where(in_metres(chain.model), self.metre, 1.0)

    def force(self, chain: ClosedChain) -> np.ndarray:
        """What efforts are multiplied by, shape (nv,)."""
        return self.newton * self.metre / self.motion(chain)

    def rows(self, chain: ClosedChain) -> np.ndarray:
        """What openings of closures are multiplied by, shape (rows,)."""
        return np.where(chain._state.topology.row_metres, self.metre, 1.0)

    def multipliers(self, chain: ClosedChain) -> np.ndarray:
        """What forces of closures are multiplied by, shape (rows,)."""
        return self.newton * self.metre / self.rows(chain)

    def wrench(self) -> np.ndarray:
        return self.newton * np.array([1.0, 1.0, 1.0, *[self.metre] * 3])

    def named(self, quantity: str) -> float:
        """What a ratio named as "N m per N" is multiplied by."""
        sizes = {"m": self.metre, "N": self.newton, "rad": 1.0}
        above, below = (np.prod([sizes[unit] for unit in part.split()]) for part in quantity.split(" per "))
        return float(above / below)
