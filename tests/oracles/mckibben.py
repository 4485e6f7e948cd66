"""A pneumatic muscle as an actuator."""

import numpy as np


class McKibben:
    """F = P c (3 (l/b)² - 1) with a dead length: linear in pressure, as Chou and Hannaford's law."""

    def __init__(self, dead=0.05, braid=0.25, c=2.5e-4, supply=4e5):
        self.dead, self.braid, self.c, self.supply = dead, braid, c, supply

    def force(self, length, pressure):
        return pressure * self.c * (3 * ((length - self.dead) / self.braid) ** 2 - 1)

    def force_limits(self, length):
        upper = self.force(length, self.supply)
        return np.zeros_like(length), np.where(upper > 0, upper, np.nan)

    def pressure_for(self, force, length):
        return force / self.force(length, 1.0)

    def stiffness(self, length, pressure):
        return pressure * self.c * 6 * (length - self.dead) / self.braid**2
