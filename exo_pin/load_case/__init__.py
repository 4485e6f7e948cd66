"""What a reaction query is about: poses, motion, loads, the moving shoulder centre, trajectories, ranges of motion."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
