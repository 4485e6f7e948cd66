"""A wrist of three limbs in one pose, with limits of one limb after the other."""

from dataclasses import replace

import numpy as np
from wrists import random_mechanism, regular_poses

import exo_pin as ep


class Wrist:
    """Three limbs in one pose, some of which pull and some push; limits that are not named are wide and known."""

    def __init__(self, seed):
        rng = np.random.default_rng(seed)
        self.exo = ep.ShoulderExo.from_mechanism(random_mechanism(rng, 3, ["SPS"] * 3))
        self.pose = regular_poses(self.exo.mechanism, rng, 1, margin=0.1)[0]
        self.f = self.exo.reaction(self.pose).actuator_forces
        self.lengths = self.exo.inverse_kinematics(self.pose).lengths
        self.size = np.abs(self.f).max()

    def limited(self, changes=(), estimated=()):
        """The device with changes of the limits of its limbs, by number."""
        limbs = []
        for i, length in enumerate(self.lengths):
            own = {
                "pull": 2.0 * self.size,
                "push": 2.0 * self.size,
                "shortest": length - 0.05,
                "longest": length + 0.05,
            }
            own |= {"fitting": 0.0, "speed": None, "power": None} | dict(changes).get(i, {})
            stroke = ep.Stroke(1.0, float(own["shortest"]), float(own["longest"]), own["fitting"])
            actuator = ep.Actuator(
                "linear",
                own["pull"],
                own["push"],
                speed_limit=own["speed"],
                power_limit=own["power"],
            )
            limbs.append(ep.Limb("SPS", stroke=stroke, actuator=actuator))
        marks = tuple(f"limbs[{i}].stroke.travel" for i in estimated)
        return ep.ShoulderExo.from_mechanism(replace(self.exo.mechanism, limbs=tuple(limbs), estimated=marks))

    def outcome(self, changes=(), estimated=(), **question):
        """Status, whether it is unknown, and the comparison with the limits."""
        exo = self.limited(changes, estimated)
        answer, mapped = exo.reaction(self.pose, **question), exo.reaction_map(self.pose, **question)
        assert answer.status == mapped.status
        for name in ("unknown", "can_hold", "held"):
            assert getattr(answer, name) == getattr(mapped, name)
        np.testing.assert_allclose(answer.actuator_forces, mapped.actuator_forces, atol=1e-9 * self.size)
        assert answer.limits.violated == (not answer.held)
        return str(answer.status), bool(answer.unknown), answer.limits
