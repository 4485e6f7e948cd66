"""The one object a user holds: a mechanism, and what can be computed of it."""

import lazy_loader

from .chains import robots as _robots  # noqa: F401 - tells ShoulderExo what a robot is

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
