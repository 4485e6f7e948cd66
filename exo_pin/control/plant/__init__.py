"""The plant: arm, shoulder, muscles, air and valves, as one set of differential equations in time.

from exo_pin.control.plant import Fault, Plant, PlantOptions

plant = Plant(exo)
run = plant.simulate(lambda t, measurement: [-1.0, 0.2, 0.4], duration=5.0)
run.reaction("elastic").shoulder_force
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
