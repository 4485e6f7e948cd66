"""The built machine in motion: plant, reference trajectories, controllers, sensors, experiments, measured runs."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
