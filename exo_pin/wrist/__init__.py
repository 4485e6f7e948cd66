"""The wrist in closed form, for stacks of poses, compiled, without Pinocchio."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
